"""The plan of a scene: it says what runs, and only what is named is imported and executed."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import haploop.logger
from haploop.launch.plan.effect import Effect
from haploop.launch.plan.effects import EFFECTS, effects_of
from haploop.launch.plan.plan import plan
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from helpers.scenes.every_effect import BESIDE, EVERYTHING, METHODS, NAMING
from helpers.scenes.least import KINDS, scene

SCENES = Path(__file__).parents[2] / "launch/scenes"
# The nodes' cores, built from scenes on stdin as their processes build them. Each scene is built in a fork of a fresh
# interpreter that has built none, and a line tells what of haploop is loaded then.
CORES = {
    "plant": "from haploop.plant.plant import Plant as Core; rest = ()",
    "controller": "from haploop.controller.controller import Controller as Core\n"
    "from haploop.controller.dissipation import registry; rest = (registry(),)",
}
BUILD = """
import json, os, sys
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
{core}
for scene in map(Scene.from_dict, json.load(sys.stdin)):
    if child := os.fork():
        assert os.waitpid(child, 0)[1] == 0
        continue
    Core(scene, Timebase.from_scene(scene), *rest)
    loaded = [module for name, module in sys.modules.items() if name.startswith("haploop.")]
    print(*(module.__name__ for module in loaded if not hasattr(module, "__path__")), flush=True)
    os._exit(0)
"""
READ_BY_NOTHING = {"accelerometer": {"bandwidth": 400, "range": 20}}
BUILT: dict[str, dict[str, Any]] = {
    "plain": {},
    "everything": EVERYTHING,
    "read by nothing": READ_BY_NOTHING,
    **{f"everything by {method}": EVERYTHING | {"clock": {"integrator": method}} for method in METHODS},
    **NAMING,
}
Loaded = dict[str, dict[str, set[str]]]


@pytest.fixture(scope="module")
def loaded() -> Loaded:
    """Node -> name of the scene -> the modules of haploop that are loaded once its core is built."""
    scenes = json.dumps([scene(**tables).as_dict() for tables in BUILT.values()])
    told: Loaded = {}
    for node, core in CORES.items():
        command = [sys.executable, "-c", BUILD.format(core=core)]
        child = subprocess.run(command, input=scenes, capture_output=True, text=True, check=False)
        assert child.returncode == 0, child.stderr
        lines = child.stdout.splitlines()
        told[node] = {name: set(line.split()) for name, line in zip(BUILT, lines, strict=True)}
    return told


def test_a_plain_scene_loads_no_module_of_any_effect(loaded):
    modules = {module for effect in EFFECTS for module in effect.modules}
    assert plan(scene()).named == ()
    for node in CORES:
        assert {f"haploop.{node}.{node}", "haploop.protocol.ticks"} < loaded[node]["plain"]
        assert not loaded[node]["plain"] & modules


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_an_effect_brings_only_itself_and_what_it_cannot_be_without(effect: Effect):
    assert {e.name for e in effects_of(scene(**NAMING[effect.name]))} == {effect.name, *BESIDE.get(effect.name, [])}


@pytest.mark.parametrize("name", [name for name in BUILT if name != "plain"])
def test_a_scene_loads_the_modules_its_plan_says_and_nothing_else(name, loaded):
    """In both nodes; an effect of one loads nothing in the other."""
    modules = plan(scene(**BUILT[name])).modules
    assert {node: loaded[node][name] - loaded[node]["plain"] for node in CORES} == {
        node: set(modules[node]) for node in CORES
    }


def test_an_accelerometer_that_nothing_reads_is_not_in_the_plan():
    assert effects_of(scene(**READ_BY_NOTHING)) == ()


def test_the_table_of_effects_is_whole():
    names = [effect.name for effect in EFFECTS]
    assert len(set(names)) == len(names)
    assert set(names) == set(NAMING)
    for effect in EFFECTS:
        assert all(module.startswith(f"haploop.{effect.node}.") for module in effect.modules)
        assert all(importlib.util.find_spec(module) for module in effect.modules)


def test_the_log_and_the_summary_hold_what_the_plan_says(tmp_path):
    resolved = scene(**EVERYTHING, duration=0.1)
    planned = plan(resolved)
    summary = run_in_process(resolved, KINDS, out=tmp_path)
    log = haploop.logger.read(tmp_path)
    for channel, columns in planned.columns.items():
        assert [name for name in log[channel] if name not in ("timestamp", "t")] == list(columns)
    assert planned.counts
    for count in planned.counts:
        entry, _, key = count.partition(".")
        assert isinstance(summary[entry][key], int)


# What each scene that comes with haploop is: bodies, states, effects.
GOLDEN = {
    "fig6a": (["device"], 2, ["encoder"]),
    "fig6b": (["device"], 2, ["encoder"]),
    "fig6c": (["device"], 2, ["encoder"]),
    "swap": (["device"], 2, ["encoder"]),
    "tap": (["device"], 2, ["encoder"]),
    "demo": (["device", "hand"], 4, ["hand.grip", "friction", "encoder", "actuator.saturation"]),
    "premium_tap": (["device", "hand"], 4, ["hand.grip", "friction", "encoder", "actuator.saturation"]),
    "premium_press": (
        ["motor", "tip", "hand"],
        # Three positions, three velocities, accelerometer, its noise, ten steps of delay, low-pass of the velocity.
        19,
        [
            "transmission",
            "hand.grip",
            "accelerometer.bandwidth",
            "accelerometer.delay",
            "encoder",
            "accelerometer",
            "accelerometer.range",
            "velocity.cutoff",
            "acceleration.source = accelerometer",
            "actuator.saturation",
        ],
    ),
    "all_effects": (
        ["motor", "tip", "hand"],
        20,  # three positions, three velocities, actuator, accelerometer, two kinds of noise, ten steps of delay
        [
            "transmission",
            "hand.grip",
            "actuator.bandwidth",
            "friction",
            "accelerometer.bandwidth",
            "accelerometer.delay",
            "noise",
            "encoder",
            "accelerometer",
            "accelerometer.range",
            "acceleration.source = accelerometer",
            "jitter",
            "loss",
            "actuator.resolution",
            "actuator.saturation",
        ],
    ),
}


@pytest.mark.parametrize("name", sorted(path.stem for path in SCENES.glob("*.toml")))
def test_the_scenes_that_come_with_haploop_are_what_they_were(name):
    planned = plan(load(SCENES / f"{name}.toml"))
    bodies, states, effects = GOLDEN[name]
    assert list(planned.bodies) == bodies
    assert len(planned.states) + sum(planned.memory.values()) == states
    assert [effect.name for effect in planned.named] == effects


def test_a_tick_of_figure_6c_in_order():
    planned = plan(load(SCENES / "fig6c.toml"))
    assert [(step.node, step.what) for step in planned.tick] == [
        ("plant", "the position of the device is sampled"),
        ("plant", "the position is rounded to whole counts (resolution = 1e-05)"),
        ("controller", "v is the backward difference of the position"),
        ("controller", "a is the backward difference of v"),
        ("controller", "wall: 150 N/m where x < -0.06 m"),
        ("controller", "unidirectional-inertia (mass = 0.01), in-contact"),
        ("controller", "their sum is the command"),
        ("plant", "the command takes effect 20 plant steps after its sample and is held until the next does"),
    ]


@pytest.mark.parametrize("method", METHODS)
def test_the_integrator_is_what_moves_the_bodies_in_a_plant_step(method):
    named = plan(scene(clock={"integrator": method}))
    assert named.plant_step[0].what.startswith(f"{method} of 2 states (device)")
    assert named.plant_step[1].effect == f"clock.integrator = {method}"
    assert plan(scene()).plant_step[0].what.startswith("exact flow of 2 states (device)")


def test_what_effects_do_stands_where_they_do_it():
    """Motion in the plant step; in a tick measurement, estimates, forces and command, in the order of the loop."""
    planned = plan(scene(**EVERYTHING))
    assert [step.effect for step in planned.plant_step] == [
        "",
        "transmission",
        "hand.grip",
        "actuator.bandwidth",
        "friction",
        "accelerometer.bandwidth",
    ]
    assert [step.effect for step in planned.tick if step.effect] == [
        "accelerometer.delay",
        "noise",
        "encoder",
        "accelerometer",
        "accelerometer.range",
        "velocity.estimator = window",
        "velocity.cutoff",
        "acceleration.source = accelerometer",
        "acceleration.cutoff",
        "jitter",
        "loss",
        "actuator.resolution",
        "actuator.saturation",
    ]
    assert not any("backward difference" in step.what for step in planned.tick)
    assert list(planned.bodies) == ["motor", "tip", "hand"]
    states = ("x", "cable.stretch", "grip.stretch", "v", "cable.rate", "grip.rate", "actuator", "accelerometer")
    assert planned.states == states
    assert planned.memory == {
        "accelerometer.delay": 10,
        "noise": 1,
        "accelerometer": 1,
        "velocity.estimator = window": 5,
        "velocity.cutoff": 1,
        "acceleration.cutoff": 1,
    }
