"""tau(t), the force of the hand's muscles: its value at every plant step, straight lines between steps."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from haploop.protocol.scene import hand_force as tables
from haploop.protocol.scene.scene import Scene
from haploop.protocol.trees import tree_leaves, tree_select

# The force is made in pieces on a fixed grid, so that the way a run is cut into messages cannot change a bit of it.
_PIECE_STEPS = 4096
# If every member of a batch has its own force, it is made for fewer steps at a time.
_PIECE_STEPS_OF_EACH = 256

# Other packages name their forces in this group of entry points.
_GROUP = "haploop.forces"

Profile = Callable[[np.ndarray], np.ndarray]


class HandForce:
    """The hand force of a scene at plant steps, in N; step s is at ``s / plant_rate``.

    In a batch it has a last axis for the members, of length 1 where all have the same force.
    """

    def __init__(self, table: tables.HandForce | None, plant_rate: int, members: int | None = None) -> None:
        self._table, self._profile, self._plant_rate = table, _profile(table), plant_rate
        self._has_members = members is not None
        self.is_shared = not any(getattr(number, "shape", ()) for number in tree_leaves(table))
        self._piece_steps = _PIECE_STEPS if self.is_shared else _PIECE_STEPS_OF_EACH
        self._piece = lru_cache(maxsize=3)(self._made)

    def add(self, constant_N: float) -> None:
        profile = self._profile
        self._profile = lambda t: profile(t) + constant_N

    def at_steps(self, first: int, last: int) -> np.ndarray:
        """Returns tau at the steps first ... last - 1, shape (last - first,) or (last - first, 1 or members)."""
        size = self._piece_steps
        pieces = range(first // size, (last - 1) // size + 1)
        joined = (
            self._piece(pieces[0]) if len(pieces) == 1 else np.concatenate([self._piece(index) for index in pieces])
        )
        start = first - pieces.start * size
        return joined[start : start + last - first]

    def _made(self, piece: int) -> np.ndarray:
        times = np.arange(piece * self._piece_steps, (piece + 1) * self._piece_steps) / self._plant_rate
        return self._profile(times[:, None] if self._has_members else times)

    def select(self, kept: np.ndarray) -> None:
        if not self.is_shared:
            self._table = tree_select(self._table, kept)
            self._profile = _profile(self._table)
            self._piece.cache_clear()


def make_hand_force(scene: Scene, plant_rate: int, members: int | None = None) -> HandForce:
    """Makes the hand force of a resolved scene, or of the stacked scene of a batch.

    The constant forces of other packages are added to it, since they act on the same body; the books part them again.
    """
    force = HandForce(scene.hand.force if scene.hand else None, plant_rate, members)
    if constant := constant_forces(scene):
        force.add(sum(constant.values()))
    return force


def constant_forces(scene: Scene) -> dict[str, float]:
    """Returns the constant forces of other packages' effects on the last body, N, by the key of the effect's table.

    The group of entry points ``haploop.forces`` names, by that key, functions that make the force of a resolved scene.
    """
    if not scene.others:
        return {}
    from haploop.protocol.installed import entry_points_of, loaded

    return {entry.name: loaded(entry)(scene) for entry in entry_points_of(_GROUP) if entry.name in scene.others}


def _profile(force: tables.HandForce | None) -> Profile:
    return np.zeros_like if force is None else force.force_at
