"""What no single key of an effect can show: whether they go together, and what a scene may not have meant."""

from __future__ import annotations

from typing import Any, TypeVar

from haploop.launch.scene.layers import KeyPath, Layers
from haploop.launch.scene.tables.models import read_table
from haploop.protocol.scene.effects import Accelerometer, Actuator, Friction, UniformJitter
from haploop.protocol.scene.scene import Clock, Hand, Scene
from haploop.protocol.scene.table import Table
from haploop.protocol.ticks import whole_count

TableType = TypeVar("TableType", bound=Table)
# What rounding adds to the factor 1 of a body that drifts.
_ROUNDING = 1e-7


def check_combinations(layers: Layers) -> None:
    """Add what cannot be simulated together to the mistakes; tables that are wrong in themselves are passed over."""
    if friction := _read(layers, "friction", Friction):
        _friction(layers, friction)
    _grip(layers, layers.data.get("hand"))
    if actuator := _read(layers, "actuator", Actuator):
        _actuator(layers, actuator)
    accelerometer = _read(layers, "accelerometer", Accelerometer)
    if accelerometer:
        _accelerometer(layers, accelerometer)
    if clock := Clock() if "clock" not in layers.data else _read(layers, "clock", Clock):
        if accelerometer:
            _whole_steps(layers, ("accelerometer", "delay"), "delay of a reading", accelerometer.delay, clock)
        if jitter := _read(layers, "jitter", UniformJitter):
            _whole_steps(layers, ("jitter", "most"), "longest additional delay", jitter.most, clock)


def check_rate(layers: Layers, scene: Scene) -> None:
    """Refuse a plant rate too low for friction: thousands of swings a step to be followed, or steps it cannot brake."""
    if scene.friction is None or scene.clock.integrator == "dop853":
        return
    rate, resolved = scene.clock.plant_rate, scene.as_dict()
    if scene.clock.integrator == "exact":
        from haploop.plant.chain.chain import Chain
        from haploop.plant.friction.substeps import MOST_PARTS, parts_of_a_step

        parts = parts_of_a_step(Chain.of(resolved), 1.0 / rate)
        if parts > MOST_PARTS:
            least = rate * parts // MOST_PARTS
            expected = f"With friction on bodies that swing this fast it must be at least {least} Hz."
            layers.complain(("clock", "plant_rate"), expected, f"is {rate} Hz")
        return
    from haploop.plant.integrators.one_step import friction_brakes

    if not friction_brakes(resolved):
        expected = f"Friction on bodies that swing this fast does not brake them by {scene.clock.integrator}; raise it."
        layers.complain(("clock", "plant_rate"), expected, f"is {rate} Hz")


def notes(scene: dict[str, Any]) -> list[str]:
    """What is in order, but may not be what was meant, in a resolved scene; one sentence each."""
    from haploop.plant.sensing.encoder import accelerometer_is_used

    found = []
    if accelerometer := scene.get("accelerometer"):
        if not accelerometer_is_used(scene):
            found.append(
                "[accelerometer] is not simulated, since no estimate reads it; "
                'acceleration.source = "accelerometer" would, or velocity.accelerometer with the Kalman filter.'
            )
        elif accelerometer["mount"] == "motor" and "transmission" not in scene:
            found.append('accelerometer.mount = "motor" means the one mass there is without a [transmission].')
    return [*found, *_unstable(scene["clock"]["integrator"], scene)]


def _unstable(integrator: str, scene: dict[str, Any]) -> list[str]:
    """Says where a method of a fixed step makes the bodies swing ever wider by itself."""
    if integrator in ("exact", "dop853"):
        return []
    from haploop.plant.integrators.one_step import growth

    factor = growth(scene)
    if factor <= 1.0 + _ROUNDING:
        return []
    return [
        f'clock.integrator = "{integrator}" is unstable by itself at {scene["clock"]["plant_rate"]} Hz: it multiplies '
        f"the fastest growing swing of the bodies by {factor:.7g} in every plant step, whatever the controller does."
    ]


def _friction(layers: Layers, friction: Friction) -> None:
    if friction.breakaway is not None and friction.breakaway < friction.kinetic:
        layers.complain(("friction", "breakaway"), f"It must be at least friction.kinetic, {friction.kinetic:g} N.")
    if friction.stribeck_velocity is not None and friction.breakaway is None:
        expected = "It says how breakaway falls towards kinetic, so friction.breakaway must be given too."
        layers.complain(("friction", "stribeck_velocity"), expected)


def _grip(layers: Layers, hand: Any) -> None:
    """Looks at the mass alone, so that another mistake in ``[hand]`` hides nothing."""
    if not isinstance(hand, dict) or "grip" not in hand:
        return
    alone = read_table(Hand, {"mass": hand.get("mass", 0.0)})
    if alone and not alone.mass:
        expected = "The grip lies between the device and the hand's mass, so hand.mass must be above 0 kg."
        layers.complain(("hand", "grip"), expected, "holds no mass")


def _actuator(layers: Layers, actuator: Actuator) -> None:
    if actuator == Actuator():
        layers.complain(("actuator",), "It must have at least one of saturation, bandwidth and resolution.", "is empty")


def _accelerometer(layers: Layers, accelerometer: Accelerometer) -> None:
    most = accelerometer.range
    if most is not None and accelerometer.resolution is not None and accelerometer.resolution > most:
        expected = f"It must be at most accelerometer.range, {most:g} m/s^2; else every reading is 0."
        layers.complain(("accelerometer", "resolution"), expected)


def _whole_steps(layers: Layers, key: KeyPath, name: str, seconds: float, clock: Clock) -> None:
    complaints: list[str] = []
    whole_count(seconds, clock.plant_rate, f"The {name}", "plant steps", complaints)
    for sentence in complaints:
        layers.complain(key, sentence)


def _read(layers: Layers, name: str, table: type[TableType]) -> TableType | None:
    """A table by itself; None where it is absent, or wrong, which is a mistake reported elsewhere."""
    return read_table(table, layers.data.get(name))
