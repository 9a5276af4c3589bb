"""The state of a plant is all it goes on from: packed and unpacked, and with members of a batch dropped."""

from __future__ import annotations

from typing import Any

import msgpack
import numpy as np
import pytest

from haploop.launch.batch.stacking import stacked
from haploop.plant.choose import make_motion, make_position_sensor
from haploop.plant.line.delay import make_line
from haploop.plant.plant import Plant
from haploop.plant.sensing.accelerometer import make_accelerometer
from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from helpers.scenes.every_effect import EVERYTHING
from helpers.scenes.least import scene

SENSORS = {
    "encoder": {"resolution": 1e-5},
    "noise": {"deviation": 1e-5, "cutoff": 50.0},
    "acceleration": {"source": "accelerometer"},
    "accelerometer": {"range": 2.0, "noise_density": 1e-2, "resolution": 1e-3},
}
HAND = {"mass": 0.1, "stiffness": 50.0, "force": {"kind": "sine", "amplitude": 2.0, "frequency": 7.0}}
LATE = {"clock": {"round_trip_delay": 0.0023}, "device": {"mass": 0.05, "damping": 0.2}, "hand": HAND}
FRICTION = {"friction": {"kinetic": 0.3, "breakaway": 0.4}}
SCENES: dict[str, dict[str, Any]] = {
    "one mass": LATE,
    "one mass with sensors and an actuator": LATE | SENSORS | {"actuator": {"saturation": 0.5, "resolution": 0.01}},
    "jitter and loss": LATE
    | {"jitter": {"kind": "gamma", "mean": 0.002, "deviation": 0.002}, "loss": {"probability": 0.3}},
    "friction": LATE | FRICTION,
    "everything": EVERYTHING,
    "everything by rk4": EVERYTHING | {"clock": {"integrator": "rk4"}},
    "everything by dop853": EVERYTHING | {"clock": {"integrator": "dop853"}},
}

# The eighth-order method takes seconds a scene.
SLOW = "everything by dop853"
NAMES = [*(name for name in SCENES if name != SLOW), pytest.param(SLOW, marks=pytest.mark.slow)]


def plant_of(tables: dict[str, Any]) -> Plant:
    made = scene(duration=0.4, **tables)
    plant = Plant(made, Timebase.from_scene(made))
    plant.schedule(130, {"set": {"clock.round_trip_delay": 0.0041}})
    plant.schedule(230, {"set": {"clock.round_trip_delay": 0.0012}})
    return plant


def run(plant: Plant, end: int) -> tuple[int, int, dict[str, bytes]]:
    plant.run_until(end, lambda _, samples: [-60.0 * sample[0] - 0.01 * sum(sample) for sample in samples])
    return plant.take_block()


@pytest.mark.parametrize(
    ("name", "cut"),
    [
        *((name, 132) for name in SCENES if name != SLOW),
        *(pytest.param(name, cut, marks=pytest.mark.slow) for name in SCENES for cut in (1, 100, 250) if name != SLOW),
        pytest.param(SLOW, 132, marks=pytest.mark.slow),
    ],
)
def test_a_plant_whose_state_was_packed_and_unpacked_goes_on_to_the_same_bits(name: str, cut: int) -> None:
    whole, before, after = (plant_of(SCENES[name]) for _ in range(3))
    run(whole, cut)
    run(before, cut)
    packed = msgpack.packb(before.checkpoint(), default=np.ndarray.tolist)
    after.restore(msgpack.unpackb(packed))
    for end in (cut + 1, 300, 400):
        assert run(after, end) == run(whole, end)
    assert after.state() == whole.state()


@pytest.mark.parametrize("name", NAMES)
def test_the_motion_of_another_tick_goes_on_otherwise(name: str) -> None:
    """So that the states of the test above are seen to hold something."""
    whole, before, after = (plant_of(SCENES[name]) for _ in range(3))
    run(whole, 100)
    run(before, 99)
    after.restore(whole.checkpoint()._replace(motion=before.checkpoint().motion))
    assert run(after, 300) != run(whole, 300)


class Batch:
    """The plants of a batch, driven by forces made of what they measure."""

    def __init__(self, scenes: list[Scene]) -> None:
        made, members = stacked(scenes), len(scenes)
        time = Timebase.from_scene(made)
        self.motion, self.line = make_motion(made, time, members), make_line(made, time, members)
        self.position, self.meter = make_position_sensor(made, time), make_accelerometer(made, time, members)
        self.parts = [part for part in (self.motion, self.line, self.position, self.meter) if part]
        self.tick = 0

    def run(self, end: int) -> dict[str, Any]:
        first = self.tick
        for tick in range(first, end):
            x, a = self.position.reading(self.motion.x), 0.0
            if self.meter:
                a = self.meter.reading(self.motion.acceleration(tick))
            self.line.receive([-60.0 * x - 0.01 * a])
            self.motion.advance(tick, self.line.holds(tick))
        self.tick = end
        counts = {
            name: counter.state for part in (self.line, self.meter) if part for name, counter in part.counters.items()
        }
        return self.motion.take_record(first) | counts


def members(tables: dict[str, Any], *, alike: bool) -> list[Scene]:
    """Five scenes; their bodies and forces differ, unless they have friction, whose bodies must be alike."""
    scenes = []
    for seed in range(5):
        made = scene(duration=0.3, seed=seed, **tables)
        if not alike:
            for key in ("device.mass", "hand.force.amplitude"):
                made = with_value(made, key, value_at(made, key) * (1.0 + 0.1 * seed))
        scenes.append(made)
    return scenes


ACTUATOR = {"actuator": {"saturation": 0.5, "resolution": 0.01}}
GRIP = {"hand": HAND | {"grip": {"stiffness": 500.0, "damping": 1.0}}}
BATCHES: dict[str, tuple[dict[str, Any], bool]] = {
    "one mass": (LATE, False),
    "one mass, alike": (LATE | SENSORS, True),
    "sensors and an actuator": (LATE | SENSORS | ACTUATOR, False),
    "a chain": (LATE | SENSORS | GRIP, False),
    "friction": (LATE | FRICTION | {"noise": SENSORS["noise"]}, True),
}


@pytest.mark.parametrize("name", BATCHES)
def test_a_member_dropped_from_a_batch_leaves_the_bits_of_the_others(name: str) -> None:
    tables, alike = BATCHES[name]
    whole, cut = (Batch(members(tables, alike=alike)) for _ in range(2))
    kept = np.array([True, False, True, True, False])
    for end in (70, 140, 300):
        found, of_whole = cut.run(end), whole.run(end)
        for column, values in found.items():
            if column == "pieces":
                still = np.flatnonzero(kept) if end > 70 else np.arange(5)
                places, counts, _ = of_whole[column]
                has_any = zip(places.tolist(), counts, strict=True)
                expected = [(place, count) for place, count in has_any if place in still]
                assert [*zip(still[values[0]].tolist(), values[1], strict=True)] == expected
                continue
            expected = np.asarray(of_whole[column])
            if end > 70 and expected.ndim and expected.shape[-1] == 5:
                expected = expected[..., kept]
            assert np.array_equal(values, expected), (column, end)
        if end == 70:
            for part in cut.parts:
                part.select(kept)
