"""The estimates of a scene: defaults, mistakes, and one file over another."""

from pathlib import Path

import pytest

from haploop.launch.scene.check import resolve
from haploop.launch.scene.file import load
from haploop.launch.scene.reading.layers import Layers
from haploop.protocol.scene.estimators import Acceleration, Velocity
from helpers.runs.estimates import ENCODER, KALMAN
from helpers.scenes.least import KINDS, LEAST, mistakes, scene

SCENE = Path(__file__).parents[2] / "launch/scenes/fig6c.toml"


def test_a_scene_that_names_no_estimator_resolves_as_it_did():
    assert scene(velocity={"cutoff": 50}).velocity == Velocity(cutoff=50.0)
    assert scene(acceleration={"cutoff": "50 Hz"}).acceleration == Acceleration(source="encoder", cutoff=50.0)


def test_a_scene_that_names_one_resolves_to_si_numbers_and_to_itself():
    table = {"estimator": "kalman", "jerk_density": "50 mm/s^3/Hz^0.5", "measurement_noise": "3 um"}
    found = scene(velocity=table, acceleration={"source": "kalman"})
    assert found.velocity == Velocity(estimator="kalman", jerk_density=0.05, measurement_noise=3e-6)
    assert scene(**found.as_dict()) == found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tables", "sentences"),
    [
        (
            {"velocity": {"estimator": "foaw"}},
            [
                "velocity.ticks is missing. The foaw estimator needs a whole number, at least 1 and at most 10000.",
                "velocity.bound is missing. Without an [encoder] to take it from, it must be a number in m, above 0, "
                'or text with its unit such as "1 m".',
            ],
        ),
        (
            {"velocity": {"ticks": 3, "cutoff": 50.0}},
            ["velocity.ticks is 3. It is used only with the estimator window or foaw."],
        ),
        (
            {"velocity": {"estimator": "window", "ticks": 2, "bound": 1e-5, "jerk_density": 1.0}},
            [
                "velocity.bound is 1e-05. It is used only with the estimator foaw.",
                "velocity.jerk_density is 1.0. It is used only with the estimator kalman.",
            ],
        ),
        (
            {"velocity": {"estimator": "kalman"}, "noise": {"deviation": "0 mm", "cutoff": 100}},
            [
                "velocity.jerk_density is missing. The kalman estimator needs a number in m/s^3/Hz^0.5, above 0, "
                'or text with its unit such as "1 m/s^3/Hz^0.5".',
                "velocity.measurement_noise is missing. Without an [encoder] or [noise] to take it from, it must be "
                'a number in m, above 0, or text with its unit such as "1 m".',
            ],
        ),
        (
            {"velocity": KALMAN | {"accelerometer_noise": 1.0}},
            ["velocity.accelerometer_noise is 1.0. It is used only with accelerometer = true."],
        ),
        (
            {"acceleration": {"source": "kalman"}, "encoder": ENCODER},
            [
                'acceleration.source is "kalman". It comes from the filter of the velocity, so velocity.estimator '
                'must be "kalman" too.'
            ],
        ),
        (
            {"acceleration": {"estimator": "foaw", "ticks": 5}, "encoder": ENCODER},
            [
                "acceleration.bound is missing. The foaw estimator needs a number in m/s, above 0, or text with its "
                'unit such as "1 m/s".'
            ],
        ),
        (
            {"acceleration": {"source": "accelerometer", "estimator": "window", "ticks": 5}},
            ['acceleration.estimator is "window". It is used only with source = "encoder".'],
        ),
        (
            {"acceleration": {"estimator": "kalman"}},
            ['acceleration.estimator is "kalman". Allowed: difference, window, foaw.'],
        ),
        (
            {"velocity": {"estimator": "foav", "ticks": 5}},
            [
                'velocity.estimator is "foav"; did you mean foaw? Allowed: difference, window, foaw, kalman.',
            ],
        ),
        ({"velocity": {"estimator": ["foaw"]}}, ["velocity.estimator is"]),
        (
            {"velocity": KALMAN | {"jerk_density": 1e20}},
            [
                "velocity.jerk_density is 1e+20. With a measurement noise of 3e-06 m at 1000 Hz it must be from "
                "9.5e-14 to 9.5e+13."
            ],
        ),
        ({"velocity": {"estimator": "window", "ticks": 0}}, ["velocity.ticks is 0. It must be at least 1"]),
    ],
)
def test_a_key_that_is_missing_or_out_of_place_is_a_mistake_with_a_sentence(tables, sentences):
    found = mistakes(**tables)
    assert len(found) == len(sentences)
    assert all(said.startswith(sentence) for said, sentence in zip(found, sentences, strict=True)), found


def test_the_command_line_can_name_an_estimator_and_its_numbers():
    resolved = load(SCENE, ["velocity.estimator=foaw", "velocity.ticks=8", "velocity.bound=20 um"])
    assert resolved.velocity == Velocity(estimator="foaw", ticks=8, bound=2e-5)


def test_another_estimator_drops_the_numbers_of_the_one_below_it_and_keeps_the_cutoff():
    layers = Layers(Path("scene.toml"))
    below = {"estimator": "foaw", "ticks": 8, "bound": 1e-5, "cutoff": 100.0}
    layers.lay({**LEAST, "velocity": below}, "device.toml")
    layers.lay({"velocity": {"estimator": "window", "ticks": 3}}, "scene.toml")
    assert resolve(layers, KINDS).velocity == Velocity(estimator="window", ticks=3, cutoff=100.0)
    layers.lay({"velocity": {"estimator": "difference"}}, "--set")
    assert resolve(layers, KINDS).velocity == Velocity(estimator="difference", cutoff=100.0)
