"""Devices and hands that come with haploop: their values, their sources, and that they go together."""

import math
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from haploop.launch.scene.check import resolve
from haploop.launch.scene.file import load
from haploop.launch.scene.reading.layers import read_layers
from haploop.protocol.scene.effects import Actuator, Grip
from haploop.protocol.scene.paths import value_at, without
from haploop.protocol.scene.scene import Encoder, Hand, Scene
from helpers.scenes.least import KINDS

LAUNCH = Path(__file__).parents[2] / "launch"
DEVICES = sorted((LAUNCH / "devices").glob("*.toml"))
HANDS = sorted((LAUNCH / "hands").glob("*.toml"))
KEY = re.compile(r"^(\w+) = ")
SOURCE = re.compile(r"#.*(ASSUMPTION|\b(19|20)\d\d\b|[Dd]ata sheet|Vendor|MAHI lab|libnifalcon)")
G = 9.80665

# Typed from the literature: m in kg, b in N s/m, Coulomb friction in N, one count in m, saturation in N; None: unknown,
# so that the preset holds an assumption.
PUBLISHED: dict[str, tuple[float | None, float | None, float | None, float, float]] = {
    "premium15": (0.0525, 0.0114, 0.048, 28.7e-6, 6.9),
    "touch": (0.045, None, 0.26, 55e-6, 3.3),
    "falcon": (None, None, None, 38e-6, 8.0),
    "omega3": (None, None, None, 10e-6, 12.0),
}
# Fu and Cavusoglu 2012: M, k1, b1, k2, b2.
PEN_HOLD = {
    "x": (0.218, 379.5, 1.839, 78.75, 4.645),
    "y": (0.269, 552.4, 3.609, 105.3, 6.430),
    "z": (0.204, 769.9, 0.776, 271.7, 18.06),
}


def preset(*paths: Path) -> Scene:
    """Presets laid over one another with the least of a task, resolved."""
    layers = read_layers(paths[0])
    for path in paths[1:]:
        layers.lay(read_layers(path).data, str(path))
    layers.lay({"title": "task", "duration": 0.1, "wall": {"position": -0.01, "stiffness": 500.0}}, "task")
    if "device" not in layers.data:
        layers.lay({"device": {"mass": 0.05, "damping": 0.01}}, "task")
    return resolve(layers, KINDS)


def value_lines(path: Path) -> list[str]:
    return [line for line in path.read_text().splitlines() if KEY.match(line) and not line.startswith("extends")]


@pytest.mark.parametrize("hand", HANDS, ids=lambda path: path.stem)
@pytest.mark.parametrize("device", DEVICES, ids=lambda path: path.stem)
def test_every_device_goes_with_every_hand(device, hand):
    read = preset(device, hand)
    assert read.device.mass > 0
    assert value_at(read, "hand.mass") > 0


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_device_holds_what_was_published_and_says_where_it_assumes(name):
    path = LAUNCH / f"devices/{name}.toml"
    read = preset(path)
    held = (read.device.mass, read.device.damping, value_at(read, "friction.kinetic"))
    for value, published, line in zip(held, PUBLISHED[name], value_lines(path), strict=False):
        assert (value == published) if published is not None else ("ASSUMPTION" in line)
        assert ("ASSUMPTION" in line) == (published is None)
    assert read.encoder == Encoder(resolution=PUBLISHED[name][3], rounding="nearest")
    assert read.actuator == Actuator(saturation=PUBLISHED[name][4])
    assert read.transmission is None
    assert "peak" in next(line for line in value_lines(path) if line.startswith("saturation"))


def test_the_encoder_of_the_premium_makes_the_accelerations_that_the_paper_avoids():
    """One count is 28.7 mm/s of velocity, 28.7 m/s^2 of twice differenced position: 0.26 N with 9 g of inertia."""
    count = value_at(preset(LAUNCH / "devices/premium15.toml"), "encoder.resolution")
    assert count / 1e-3 == pytest.approx(0.0287)
    assert 0.009 * count / 1e-3**2 == pytest.approx(0.26, abs=0.005)


def test_motor_and_encoder_of_the_premium_follow_from_their_data_sheets():
    """1024 lines and a stall torque of 129 mN m behind 11.2 to 1 on a link of 0.2095 m."""
    read = preset(LAUNCH / "devices/premium15.toml")
    assert value_at(read, "encoder.resolution") == pytest.approx(2 * math.pi * 0.2095 / (4 * 1024 * 11.2), rel=2e-3)
    assert value_at(read, "actuator.saturation") == pytest.approx(0.129 * 11.2 / 0.2095, rel=2e-3)


def test_the_cable_of_the_premium_rings_near_200_Hz_and_adds_nothing_to_its_mass():
    """Choi and Tan 2004; two free masses on a spring ring at sqrt(k (1/m1 + 1/m2)) / (2 pi)."""
    cable, plain = (preset(LAUNCH / f"devices/{name}.toml") for name in ("premium15_cable", "premium15"))
    assert cable.transmission is not None
    motor, tip, stiffness = cable.transmission.motor_mass, cable.device.mass, cable.transmission.stiffness
    assert motor + tip == pytest.approx(plain.device.mass)
    assert cable.transmission.motor_damping + cable.device.damping == plain.device.damping
    assert math.sqrt(stiffness * (1 / motor + 1 / tip)) / (2 * math.pi) == pytest.approx(200, rel=0.01)
    assert (cable.friction, cable.encoder, cable.actuator) == (plain.friction, plain.encoder, plain.actuator)


def test_the_accelerometer_is_of_the_class_of_the_MPU_9250():
    """300 ug/Hz^0.5, 16 bits, 420 Hz with 1.38 ms in all; 0.08 m/s^2 of noise, at the motor as in Choi et al. 2022."""
    table = preset(LAUNCH / "devices/premium15_cable.toml").accelerometer
    assert table
    assert table.bandwidth
    assert table.range
    assert table.mount == "motor"
    assert table.noise_density == pytest.approx(300e-6 * G, rel=1e-3)
    assert table.resolution == pytest.approx(2 * table.range / 2**16, rel=1e-3)
    assert table.delay + 1 / (2 * math.pi * table.bandwidth) == pytest.approx(1.38e-3, rel=1e-2)
    assert table.noise_density * math.sqrt(math.pi / 2 * table.bandwidth) == pytest.approx(0.08, abs=0.01)


@pytest.mark.parametrize("axis", PEN_HOLD)
def test_the_pen_hold_has_the_numbers_of_fu_and_cavusoglu(axis):
    """Tip -(k1 || b1)- M -(k2 || b2)- ground."""
    mass, k1, b1, k2, b2 = PEN_HOLD[axis]
    path = LAUNCH / f"hands/fu_cavusoglu_{axis}.toml"
    grip = Grip(stiffness=k1, damping=b1)
    assert preset(path).hand == Hand(mass=mass, stiffness=k2, damping=b2, grip=grip)
    assert "below 20 Hz" in path.read_text()


def test_the_hand_of_the_paper_is_the_one_its_simulation_extends():
    alone, simulated = preset(LAUNCH / "hands/choi2022.toml"), preset(LAUNCH / "devices/choi2022_simulation.toml")
    assert alone.hand == simulated.hand == Hand(mass=0.01, damping=0.01, stiffness=10.0, rest=0.0)


@pytest.mark.parametrize(
    "path", [p for p in (*DEVICES, *HANDS) if p.stem != "choi2022_simulation"], ids=lambda p: p.stem
)
def test_every_value_of_a_preset_names_its_source_or_says_assumption(path):
    lines = value_lines(path)
    assert lines
    assert [line for line in lines if not SOURCE.search(line)] == []
    values = tomllib.loads(path.read_text())
    assert len(lines) == sum(1 for _ in leaves(values)) - ("extends" in values)


def leaves(table: dict[str, Any]):
    for value in table.values():
        if isinstance(value, dict):
            yield from leaves(value)
        else:
            yield value


def test_the_tap_is_a_device_a_hand_and_a_task():
    tap = load(LAUNCH / "scenes/premium_tap.toml")
    parts = preset(LAUNCH / "devices/premium15.toml", LAUNCH / "hands/fu_cavusoglu_y.toml")
    without_force = without(tap, "hand.force")
    for table in ("device", "friction", "encoder", "actuator", "hand"):
        assert value_at(without_force, table) == value_at(parts, table)
    assert value_at(tap, "hand.force.frequency") * tap.duration == 1
    assert "[device]" not in (LAUNCH / "scenes/premium_tap.toml").read_text()
