"""Velocity and acceleration from samples: backward differences, or what the scene names instead, low-passed or not."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from haploop.protocol.arrays import each

Sample = Sequence[Any]
# From the newest input and the sample it came with to the estimate; what it remembers is its own.
Estimator = Callable[[Any, Sample], Any]


def difference(period_s: float, first: Any) -> Estimator:
    """Backward difference (u[k] - u[k-1]) / T, 0 at the first input.

    Delays slow signals by T / 2; white noise of standard deviation sigma in u becomes sqrt(2) sigma / T.
    """
    before = first

    def estimate(u: Any, _sample: Sample) -> Any:
        nonlocal before
        rate = (u - before) / period_s
        before = u
        return rate

    return estimate


def low_passed(raw: Estimator, cutoff_hz: float, period_s: float, first: Any) -> Estimator:
    """First-order low-pass y += (1 - exp(-2 pi fc T)) (u - y), y starting at the first input.

    Delays slow signals by T / gain - T, about 1 / (2 pi fc); white noise of standard deviation sigma in u becomes
    sqrt(gain / (2 - gain)) sigma.
    """
    gain = 1.0 - each(math.exp, -2.0 * math.pi * cutoff_hz * period_s)
    y = first

    def estimate(u: Any, sample: Sample) -> Any:
        nonlocal y
        y = y + gain * (raw(u, sample) - y)
        return y

    return estimate


def reading(_v: Any, sample: Sample) -> Any:
    """The accelerometer's own, as it came with the sample."""
    return sample[1]


def estimators(scene: dict[str, Any], period_s: float) -> Callable[[Sample], tuple[Estimator, Estimator]]:
    """From x_m[k] to v[k] by the ``[velocity]`` table, and from v[k], as filtered, to a[k] by ``[acceleration]``.

    All is decided, and modules and gains are fetched, here; what is returned starts the two with the first sample.
    The two are to be called in turn at every tick.
    """
    of_velocity, of_acceleration = scene.get("velocity", {}), scene.get("acceleration", {})
    velocity_from = _velocity(scene, of_velocity, period_s)
    source = of_acceleration.get("source", "encoder")
    acceleration_from = _rate(of_acceleration, 0.0, period_s)

    def start(first: Sample) -> tuple[Estimator, Estimator]:
        still = 0.0 * first[0]
        velocity = velocity_from(first)
        match source:
            case "accelerometer":
                acceleration, start_a = reading, first[1]
            case "kalman":
                acceleration, start_a = velocity.acceleration, velocity.a
            case _:
                acceleration, start_a = acceleration_from(still), still
        return (
            _filtered(velocity, of_velocity, period_s, still),
            _filtered(acceleration, of_acceleration, period_s, start_a),
        )

    return start


def _velocity(scene: dict[str, Any], table: dict[str, Any], period_s: float) -> Callable[[Sample], Any]:
    """What makes the velocity's estimator of the first sample."""
    if table.get("estimator") == "kalman":
        from haploop.controller.estimators.kalman import kalman_of

        return kalman_of(scene, period_s)
    one_count = scene.get("encoder", {}).get("resolution", 0.0)
    rate = _rate(table, one_count, period_s)
    return lambda first: rate(first[0])


def _rate(table: dict[str, Any], bound: float, period_s: float) -> Callable[[Any], Estimator]:
    """What makes an estimator of a rate of its first input; ``bound`` where the table has none."""
    match table.get("estimator"):
        case "window":
            from haploop.controller.estimators.window import window_difference

            return partial(window_difference, table["ticks"], period_s)
        case "foaw":
            from haploop.controller.estimators.foaw import FITS

            return partial(FITS[table.get("fit", "end")], table["ticks"], table.get("bound", bound), period_s)
        case _:
            return partial(difference, period_s)


def _filtered(raw: Estimator, table: dict[str, Any], period_s: float, first: Any) -> Estimator:
    return low_passed(raw, table["cutoff"], period_s, first) if "cutoff" in table else raw
