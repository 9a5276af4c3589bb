"""The cost of a scene, counted in instructions, and what ``haploop explain`` shows of it."""

import json
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from haploop.controller.dissipation.damping import Damping
from haploop.launch.plan.effect import Effect
from haploop.launch.plan.effects import EFFECTS, effects_of
from haploop.tools.cli.app import app
from haploop.tools.operations import bill, operations
from helpers.scenes.effect_tables import slowly
from helpers.scenes.every_effect import BESIDE, EVERYTHING, NAMING
from helpers.scenes.least import KINDS, scene

SCENES = Path(__file__).parents[2] / "launch/scenes"
# A scene without effects.
PRESS = {
    "wall": {"position": -0.001, "stiffness": 500},
    "dissipation": [{"kind": "damping", "damping": 0.5}, {"kind": "unidirectional-inertia", "mass": 0.005}],
    "hand": {"mass": 0.2, "stiffness": 80, "damping": 4, "force": {"kind": "ramp", "value": -1, "rise_time": 0.01}},
}


@pytest.mark.parametrize("name", [*[*NAMING][::4], *slowly(name for at, name in enumerate(NAMING) if at % 4)])
def test_a_scene_with_an_effect_taken_out_executes_what_one_that_never_named_it_does(name):
    """Not one instruction more in plant or controller for all that effects can be."""
    rest = scene(**PRESS | NAMING[name] | {"hand": PRESS["hand"] | NAMING[name].get("hand", {})})
    assert name in [effect.name for effect in effects_of(rest)]
    while named := effects_of(rest):
        rest = named[0].without(rest)
    assert operations(rest, KINDS) == operations(scene(**PRESS), KINDS)


def test_a_single_dead_branch_would_be_seen():
    class Heavier(Damping):
        kind = "damping"

        def force(self, motion):
            if motion.contact is None:
                return 0.0
            return super().force(motion)

    resolved = scene(dissipation=[{"kind": "damping", "damping": 1.0}])
    light, heavy = operations(resolved, KINDS), operations(resolved, KINDS | {"damping": Heavier})
    assert heavy.plant == light.plant
    assert heavy.controller > light.controller


@pytest.mark.slow
def test_counts_are_the_same_each_time_and_leave_tracing_as_it_was():
    resolved = scene(**EVERYTHING)
    before = sys.gettrace()
    assert operations(resolved, KINDS) == operations(resolved, KINDS)
    assert sys.gettrace() is before


@pytest.mark.parametrize("ticks", [1, 2, 30])
def test_a_short_run_is_counted_too(ticks):
    assert operations(scene(duration=ticks / 1000), KINDS).per_tick > 0


@pytest.mark.parametrize(
    "effect",
    [*EFFECTS[::3], *slowly(each for at, each in enumerate(EFFECTS) if at % 3)],
    ids=lambda effect: effect.name,
)
def test_a_scene_without_one_of_its_effects_is_the_scene_that_never_named_it(effect: Effect):
    """What goes with it is what cannot be there without it; the rest is left alone, and it can be run."""
    resolved = scene(**NAMING[effect.name], wall={"position": 0, "stiffness": 1})
    rest = effect.without(resolved)
    assert effect in effects_of(resolved)
    gone = {e.name for e in effects_of(resolved)} - {e.name for e in effects_of(rest)}
    dependent = {name for name, needs in BESIDE.items() if effect.name in needs}
    assert {effect.name} <= gone <= {effect.name} | dependent
    assert operations(rest, KINDS).per_tick > 0
    assert resolved == scene(**NAMING[effect.name], wall={"position": 0, "stiffness": 1})


def test_every_effect_of_a_tick_costs_instructions_and_is_billed():
    elements = [{"kind": "damping", "damping": 1}, {"kind": "unidirectional-inertia", "mass": 0.01}]
    resolved = scene(**NAMING["noise"], **NAMING["encoder"], **NAMING["friction"], velocity={"cutoff": 9},
                     dissipation=elements)  # fmt: skip
    billed = bill(resolved, effects_of(resolved), KINDS)
    assert list(billed.effects) == ["friction", "noise", "encoder", "velocity.cutoff"]
    assert all(cost > 0 for cost in [*billed.effects.values(), *billed.elements])
    assert len(billed.elements) == 2


@pytest.mark.slow
def test_explain_shows_bodies_states_order_and_costs():
    result = CliRunner().invoke(app, ["explain", "premium_tap", "--cost", "--set", "accelerometer.bias=1"])
    assert result.exit_code == 0
    for words in (
        "device 52.5 g, hand 269 g",
        "4: x, grip.stretch, v, grip.rate",
        "friction.motion",
        "in every tick",
        "2 f_c / q",
    ):
        assert words in result.stdout, words
    assert "Note: [accelerometer] is not simulated" in result.stderr


def test_explain_gives_one_json_object():
    result = CliRunner().invoke(app, ["explain", str(SCENES / "fig6c.toml"), "--cost", "--json"])
    data = json.loads(result.stdout)
    assert data["states"] == ["x", "v"]
    assert [effect["name"] for effect in data["effects"]] == ["encoder"]
    assert data["elements"][0]["instructions_per_tick"] > 0
    assert len(data["absent"]) == len(EFFECTS) - 1
    assert data["modules"] == {"plant": [], "controller": []}
    assert data["one_count"]["x_m"] == 1e-5
    without = json.loads(CliRunner().invoke(app, ["explain", str(SCENES / "fig6c.toml"), "--json"]).stdout)
    assert "instructions" not in str(without)


@pytest.mark.parametrize("name", ["fig6b", "premium_press", "all_effects", "accuracy/stick_slip"])
def test_explain_fits_a_hundred_columns_of_a_pipe_and_shows_brackets_as_they_are(name):
    told = CliRunner().invoke(app, ["explain", name]).stdout
    assert max(map(len, told.splitlines())) <= 100
    assert "[friction]" in told or name != "all_effects"
    assert "rho(M) = 1" in told


def test_explain_tells_every_mistake_with_exit_status_2():
    result = CliRunner().invoke(app, ["explain", str(SCENES / "fig6c.toml"), "--set", "frction.kinetic=1"])
    assert result.exit_code == 2
    assert "did you mean friction?" in result.stderr
