"""The tables of the effects: what is filled in, what cannot be, and what may not have been meant."""

from pathlib import Path
from typing import Any

import jsonschema
import pytest
from typer.testing import CliRunner

from haploop.launch.plan.effects import notes
from haploop.launch.scene.file import load
from haploop.launch.scene.reading.layers import Layers
from haploop.launch.scene.schema import json_schema
from haploop.launch.scene.toml_writer import to_toml
from haploop.protocol.scene.effects import Accelerometer, Friction, GammaJitter, Grip
from haploop.protocol.scene.scene import Hand
from haploop.tools.cli.app import app
from helpers.scenes.least import KINDS, LEAST, mistakes, scene

LEAST_OF_EACH: dict[str, Any] = {
    "transmission": {"motor_mass": 0.003, "stiffness": 4000},
    "friction": {"kinetic": 0.05},
    "hand": {"mass": 0.2, "grip": {"stiffness": 500}},
    "noise": {"deviation": "10 um", "cutoff": "0.3 kHz"},
    "accelerometer": {},
    "actuator": {"saturation": 8},
    "jitter": {"kind": "uniform", "most": "0.5 ms"},
    "loss": {"probability": "10 %"},
}


def test_only_what_a_scene_names_is_in_it_and_only_what_has_a_default_is_filled_in():
    assert {key: value for key, value in scene(**LEAST_OF_EACH).as_dict().items() if key in LEAST_OF_EACH} == {
        "transmission": {"motor_mass": 0.003, "stiffness": 4000.0, "damping": 0.0, "motor_damping": 0.0},
        "friction": {"kinetic": 0.05},
        "hand": {
            "mass": 0.2,
            "damping": 0.0,
            "stiffness": 0.0,
            "rest": 0.0,
            "grip": {"stiffness": 500.0, "damping": 0.0},
        },
        "noise": {"deviation": 1e-5, "cutoff": 300.0},
        "accelerometer": {"noise_density": 0.0, "delay": 0.0, "bias": 0.0, "mount": "tip"},
        "actuator": {"saturation": 8.0},
        "jitter": {"kind": "uniform", "most": 0.0005},
        "loss": {"probability": 0.1},
    }
    assert not scene().as_dict().keys() & LEAST_OF_EACH.keys()
    assert scene(hand={"mass": 0.2}).hand == Hand(mass=0.2)


def test_a_resolved_scene_with_every_effect_resolves_to_itself_and_runs_by_itself(tmp_path):
    resolved = scene(**LEAST_OF_EACH)
    assert scene(**resolved.as_dict()) == resolved
    (tmp_path / "scene.toml").write_text(to_toml(resolved.as_dict()))
    assert load(tmp_path / "scene.toml") == resolved


def test_the_density_of_noise_is_read_in_the_units_of_data_sheets():
    """300 ug/Hz^0.5, where g is the standard acceleration of free fall."""
    read = scene(accelerometer={"noise_density": "300 microgravity/Hz^0.5", "range": "16 g_0"}).accelerometer
    assert read == Accelerometer(noise_density=0.002941995, range=156.9064)
    [mistake] = mistakes(accelerometer={"noise_density": "300 microgravity/Hz"})
    assert "has the dimension" in mistake


def test_the_schema_for_editors_knows_the_effects():
    validator = jsonschema.Draft202012Validator(json_schema(KINDS))
    validator.validate({**LEAST, **LEAST_OF_EACH})
    validator.validate(scene(**LEAST_OF_EACH).as_dict())
    for wrong in (
        {"friction": {"kinetic": -1}},
        {"jitter": {"kind": "uniform", "mean": 1}},
        {"hand": {"grip": {"stiffnes": 1}}},
        {"accelerometer": {"mount": "hand"}},
        {"loss": {"probability": 2}},
    ):
        assert not validator.is_valid({**LEAST, **wrong})


def test_jitter_of_another_kind_keeps_nothing_of_the_old_one():
    layers = Layers(Path("x.toml"), {})
    layers.lay({"jitter": {"kind": "uniform", "most": 0.001}}, "below.toml")
    layers.lay({"jitter": {"kind": "gamma", "mean": 0.001, "deviation": 0.001}}, "x.toml")
    assert layers.data["jitter"] == {"kind": "gamma", "mean": 0.001, "deviation": 0.001}
    assert scene(**layers.data).jitter == GammaJitter(mean=0.001, deviation=0.001)


@pytest.mark.parametrize(
    ("tables", "sentence"),
    [
        (
            {"friction": {"kinetic": 0.1, "breakaway": 0.05}},
            "friction.breakaway is 0.05. It must be at least friction.kinetic, 0.1 N.",
        ),
        (
            {"friction": {"kinetic": 0.1, "stribeck_velocity": 0.01}},
            "friction.stribeck_velocity is 0.01. It says how breakaway falls towards kinetic, so friction.breakaway",
        ),
        ({"hand": {"grip": {"stiffness": 500}}}, "hand.grip holds no mass. The grip lies between the device and"),
        ({"hand": {"mass": "0 g", "grip": {"stiffness": 500}}}, "hand.grip holds no mass."),
        ({"hand": {"grip": {"stiffness": 500}}, "friction": {"kinetic": 0.1}}, "hand.grip holds no mass."),
        ({"actuator": {}}, "actuator is empty. It must have at least one of saturation, bandwidth and resolution."),
        (
            {"accelerometer": {"range": "2 g_0", "resolution": 20}},
            "accelerometer.resolution is 20. It must be at most accelerometer.range, 19.6133 m/s^2",
        ),
        (
            {"accelerometer": {"delay": 0.00138}},
            "accelerometer.delay is 0.00138. The delay of a reading must be a whole number of plant steps at 10000 Hz, "
            "but 0.00138 s is 13.8 of them; the nearest legal values are 0.0013 s and 0.0014 s.",
        ),
        (
            {"jitter": {"kind": "uniform", "most": "0.25 ms"}},
            'jitter.most is "0.25 ms". The longest additional delay must be a whole number of plant steps at 10000 Hz, '
            "but 0.00025 s is 2.5 of them; the nearest legal values are 0.0002 s and 0.0003 s.",
        ),
        (
            {"jitter": {"kind": "uniform", "most": 0.0015}, "clock": {"plant_rate": 1000}},
            "jitter.most is 0.0015. The longest additional delay must be a whole number of plant steps at 1000 Hz",
        ),
        ({"jitter": {"most": 0.001}}, "jitter.kind is missing. Allowed: uniform, gamma."),
        ({"jitter": {"kind": "gama"}}, 'jitter.kind is "gama"; did you mean gamma? Allowed: uniform, gamma.'),
        ({"jitter": {"kind": "gamma", "mean": 1, "deviation": 0}}, "jitter.deviation is 0. It must be above 0 s."),
        ({"loss": {"probability": 1.5}}, "loss.probability is 1.5. It must be at most 1."),
        ({"noise": {"deviation": 1e-5}}, "noise.cutoff is missing. It must be a number in Hz, above 0"),
        ({"noise": {"deviation": -1e-5, "cutoff": 1}}, "noise.deviation is -1e-05. It must be at least 0 m."),
        ({"accelerometer": {"mount": "mottor"}}, 'accelerometer.mount is "mottor"; did you mean motor?'),
        ({"transmission": {"motor_mass": 0, "stiffness": 1}}, "transmission.motor_mass is 0. It must be above 0 kg."),
        ({"hand": {"mass": 1, "grip": {"stifness": 1, "stiffness": 1}}}, "hand.grip.stifness is not a key of [hand.g"),
        ({"friction": 0.05}, "friction is 0.05. It must be a table."),
        ({"frction": {"kinetic": 0.05}}, "frction is not a key of a scene; did you mean friction? Allowed:"),
    ],
)
def test_what_cannot_be_simulated_is_told_in_one_sentence(tables, sentence):
    [mistake] = mistakes(**tables)
    assert mistake.startswith(sentence)


def test_what_does_not_go_together_is_told_with_every_other_mistake():
    """A mistake in one table hides none in another, nor does one in a hand hide that its grip holds nothing."""
    found = mistakes(
        duration=1.00005,
        friction={"kinetic": 0.1, "breakaway": 0.05, "stribeck_velocity": 0},
        hand={"grip": {"stiffness": 500}, "force": 3},
        accelerometer={"range": 1, "resolution": 2, "delay": 0.00025},
        actuator={},
        jitter={"kind": "uniform", "most": 0.00025},
        loss={},
    )
    assert [line.split(" ")[0] for line in found] == [
        "friction.stribeck_velocity",
        "hand.force",
        "loss.probability",
        "hand.grip",
        "actuator",
        "accelerometer.resolution",
        "accelerometer.delay",
        "jitter.most",
        "duration",
    ]


def test_what_goes_together_is_no_mistake():
    assert mistakes(friction={"kinetic": 0.1, "breakaway": 0.1, "stribeck_velocity": 0.01}) == []
    assert mistakes(accelerometer={"delay": 0.0014}, jitter={"kind": "uniform", "most": 0}) == []
    assert mistakes(hand={"mass": "1 g", "grip": {"stiffness": 500}}) == []
    assert mistakes(actuator={"bandwidth": 300}, loss={"probability": 1}) == []


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"accelerometer": {}}, ["[accelerometer] is not simulated, since no estimate reads it"]),
        (
            {"accelerometer": {"mount": "motor"}, "acceleration": {"source": "accelerometer"}},
            ['accelerometer.mount = "motor" means the only mass, since'],
        ),
        ({"accelerometer": {"mount": "motor"}}, ["[accelerometer] is not simulated"]),
        ({"accelerometer": {}, "acceleration": {"source": "accelerometer"}}, []),
        ({"accelerometer": {"mount": "motor"}, "acceleration": {"source": "accelerometer"},
          "transmission": LEAST_OF_EACH["transmission"]}, []),
        ({}, []),
    ],
)  # fmt: skip
def test_what_may_not_have_been_meant_is_noted_and_no_mistake(tables, words):
    found = notes(scene(**{"device": LEAST["device"] | {"velocity": 0.1}} | tables))
    assert len(found) == len(words)
    assert all(note.startswith(start) for note, start in zip(found, words, strict=True))


def test_check_and_run_print_the_notes_for_people(tmp_path):
    (tmp_path / "least.toml").write_text(to_toml({**LEAST, "accelerometer": {"bias": 0.1}}))
    for command in (["check"], ["run", "--in-process", "--set", "duration=0.01", "--out", str(tmp_path / "out")]):
        result = CliRunner().invoke(app, [*command, str(tmp_path / "least.toml")])
        assert result.exit_code == 0
        assert "Note: [accelerometer] is not simulated" in result.stderr
        assert "Note" not in result.stdout


def test_an_effect_can_be_named_on_the_command_line_alone(tmp_path):
    (tmp_path / "least.toml").write_text(to_toml(LEAST))
    overrides = ["friction.kinetic=50 mN", "hand.mass=0.2", "hand.grip.stiffness=0.5 N/mm", "jitter.kind=gamma",
                 "jitter.mean=1 ms", "jitter.deviation=0.5 ms"]  # fmt: skip
    read = load(tmp_path / "least.toml", overrides)
    assert read.friction == Friction(kinetic=0.05)
    assert read.hand == Hand(mass=0.2, grip=Grip(stiffness=500.0))
    assert read.jitter == GammaJitter(mean=0.001, deviation=0.0005)


def test_no_effect_can_be_changed_while_a_loop_runs():
    """Gains of the controller and the line's delay are live; the device is what it is."""
    event = {"at": 0.5, "set": {"friction.kinetic": 0.1}}
    [mistake] = mistakes(friction={"kinetic": 0.05}, wall={"position": 0, "stiffness": 1}, event=[event])
    assert mistake.startswith("event.0.set.friction.kinetic cannot be set")
    assert mistake.endswith("Allowed at that time: wall.stiffness, wall.position, clock.round_trip_delay.")
