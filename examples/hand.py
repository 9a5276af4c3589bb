"""The force of a scene's hand, for plants that move the hand themselves."""

import math
from bisect import bisect_right


def hand_force(scene):
    """Returns the force of the hand's muscles, N, as a function of time in s, as defined by [hand.force]."""
    table = (scene.get("hand") or {}).get("force") or {"kind": "constant", "value": 0.0}
    kind, value = table["kind"], table.get("value", 0.0)
    if kind == "constant":
        return lambda t: value
    if kind == "step":
        return lambda t: value if t >= table["at"] else 0.0
    if kind == "ramp":
        return lambda t: value * min(t / table["rise_time"], 1.0)
    if kind == "minimum-jerk":
        return lambda t: value * _minimum_jerk(min(t / table["rise_time"], 1.0))
    if kind == "sine":
        turn, phase = 2 * math.pi * table["frequency"], table.get("phase", 0.0)
        return lambda t: table.get("offset", 0.0) + table["amplitude"] * math.sin(turn * t + phase)
    if kind == "trace":
        times, forces = table["time"], table["force"]
        return lambda t: _between(t, times, forces)
    raise ValueError(f"A hand force of kind {kind!r} is not supported here.")


def _minimum_jerk(s):
    return s**3 * (10.0 + s * (6.0 * s - 15.0))


def _between(t, times, forces):
    after = bisect_right(times, t)
    if after in (0, len(times)):
        return forces[min(after, len(times) - 1)]
    share = (t - times[after - 1]) / (times[after] - times[after - 1])
    return forces[after - 1] + share * (forces[after] - forces[after - 1])
