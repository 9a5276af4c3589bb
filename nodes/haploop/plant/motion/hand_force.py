"""tau(t), the force of the hand's muscles: its value at every plant step, straight lines between steps."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any

import numpy as np

from haploop.protocol.scene.scene import Scene
from haploop.protocol.trees import tree_select

# The force is made in pieces on a fixed grid, so that how a run is cut into messages cannot change a bit of it.
_PIECE_STEPS = 4096
# Where every member of a batch has a force of its own, fewer steps of it are made at a time.
_PIECE_STEPS_OF_EACH = 256

# The tables of a scene that come with haploop, and the group in which other packages name their forces.
_DECLARED, _GROUP = {field.name for field in Scene.fields()}, "haploop.forces"

Profile = Callable[[np.ndarray], np.ndarray]


class HandForce:
    """The hand force of a scene at plant steps, in N.

    In a batch it has a last axis for the members, of length 1 where all have the same force.

    Args:
        table: the resolved ``[hand.force]`` table, or None for no force; a stacked one in a batch.
        plant_rate: plant steps per second; step s is at ``s / plant_rate``.
        members: of a batch; None for one run.

    Attributes:
        is_shared: whether all members have the same force.
    """

    def __init__(self, table: dict[str, Any] | None, plant_rate: int, members: int | None = None) -> None:
        self._table, self._plant_rate = table, plant_rate
        self._has_members = members is not None
        self.is_shared = not any(getattr(value, "shape", ()) for value in (table or {}).values())
        self._piece_steps = _PIECE_STEPS if self.is_shared else _PIECE_STEPS_OF_EACH
        self._prepare()

    def _prepare(self) -> None:
        table = self._table
        self._profile = PROFILES[table["kind"]](table) if table else np.zeros_like
        self._pieces: dict[int, np.ndarray] = {}

    def add(self, constant_N: float) -> None:
        """Adds a constant force; for one run."""
        profile = self._profile
        self._profile = lambda t: profile(t) + constant_N

    def at_steps(self, first: int, last: int) -> np.ndarray:
        """Returns tau at the steps first ... last - 1, shape (last - first,) or (last - first, 1 or members)."""
        size = self._piece_steps
        pieces = range(first // size, (last - 1) // size + 1)
        joined = np.concatenate([self._piece(index) for index in pieces])
        start = first - pieces.start * size
        return joined[start : start + last - first]

    def _piece(self, index: int) -> np.ndarray:
        if index not in self._pieces:
            if len(self._pieces) > 2:
                self._pieces.clear()
            times = np.arange(index * self._piece_steps, (index + 1) * self._piece_steps) / self._plant_rate
            self._pieces[index] = self._profile(times[:, None] if self._has_members else times)
        return self._pieces[index]

    def select(self, kept: np.ndarray) -> None:
        """Drops the members of a batch that are not kept, shape (members,)."""
        if not self.is_shared:
            self._table = tree_select(self._table, kept)
            self._prepare()


def make_hand_force(scene: dict[str, Any], plant_rate: int, members: int | None = None) -> HandForce:
    """Makes the hand force of a resolved scene, or of the stacked scene of a batch.

    The constant forces of other packages are added to it, since they act on the same body; the books part them again.
    """
    force = HandForce(scene.get("hand", {}).get("force"), plant_rate, members)
    if constant := constant_forces(scene):
        force.add(sum(constant.values()))
    return force


def constant_forces(scene: dict[str, Any]) -> dict[str, float]:
    """Returns the constant forces on the last body that effects of other packages bring, N, by the key of their table.

    The group of entry points ``haploop.forces`` names, by that key, functions that make the force of a resolved scene.
    """
    others = scene.keys() - _DECLARED
    if not others:
        return {}
    return {entry.name: entry.load()(scene) for entry in entry_points(group=_GROUP) if entry.name in others}


def _constant(table: dict[str, Any]) -> Profile:
    """tau = value."""
    return lambda t: np.zeros_like(t) + table["value"]


def _ramp(table: dict[str, Any]) -> Profile:
    """tau rises in a straight line from 0 at t = 0 to value at rise_time, then holds."""
    return lambda t: table["value"] * np.minimum(t / table["rise_time"], 1.0)


def _step(table: dict[str, Any]) -> Profile:
    """tau = value from t = at on."""
    return lambda t: np.where(t >= table["at"], table["value"], 0.0)


def _sine(table: dict[str, Any]) -> Profile:
    """tau = offset + amplitude sin(2 pi frequency t + phase)."""
    return lambda t: table["offset"] + table["amplitude"] * np.sin(2 * np.pi * table["frequency"] * t + table["phase"])


def _minimum_jerk(table: dict[str, Any]) -> Profile:
    """tau = value (10 s^3 - 15 s^4 + 6 s^5), s = t / rise_time up to 1 (Flash and Hogan 1985)."""

    def profile(t: np.ndarray) -> np.ndarray:
        s = np.minimum(t / table["rise_time"], 1.0)
        return table["value"] * (s * s * s * (10.0 + s * (6.0 * s - 15.0)))

    return profile


def _trace(table: dict[str, Any]) -> Profile:
    """tau through recorded points, straight between them, held before the first and after the last."""
    times, forces = np.asarray(table["time"], float), np.asarray(table["force"], float)
    return lambda t: np.interp(t, times, forces)


PROFILES: dict[str, Callable[[dict[str, Any]], Profile]] = {
    "constant": _constant,
    "ramp": _ramp,
    "step": _step,
    "sine": _sine,
    "minimum-jerk": _minimum_jerk,
    "trace": _trace,
}
