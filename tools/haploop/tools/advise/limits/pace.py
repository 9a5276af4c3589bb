"""How much is tried at once: loops in arrays cost little more together than one alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from haploop.launch.batch.stacking import runs_in_arrays

Scene = dict[str, Any]


@dataclass(frozen=True)
class Pace:
    """How much a search for the largest steady stiffness tries in a round.

    Attributes:
        ladder: factors of the start in the first round.
        beyond: factors up or down from there, where the limit lies beyond.
        between: stiffnesses between one that is steady and one that is not, in every later round.
        tolerance: relative, between the last two of these.
        below: shares of the largest that must hold, too.
    """

    ladder: tuple[float, ...]
    beyond: tuple[float, ...]
    between: int
    tolerance: float
    below: tuple[float, ...] = (0.75, 0.5, 0.25)


def way(scene: Scene) -> str:
    """How such scenes run: ``"arrays"``, where hundreds cost what one does; ``"friction"``, in arrays from which every
    stop and start is taken out; ``"alone"``."""
    if not runs_in_arrays(scene):
        return "alone"
    return "friction" if "friction" in scene else "arrays"


# From nowhere.
WIDE = {
    "arrays": Pace(tuple(2.0 ** (i / 2) for i in range(-8, 9)), tuple(2.0 ** (i / 2) for i in range(1, 11)), 17, 0.02),
    "friction": Pace((1 / 8, 1 / 4, 1 / 2, 1.0, 2.0), (2.0,), 2, 0.05),
    "alone": Pace((1.0,), (2.0,), 1, 0.05),
}
# From what another has reached: only more than that counts.
BEYOND = {way: replace(pace, ladder=(0.5, 1.0)) for way, pace in WIDE.items()} | {"arrays": WIDE["arrays"]}
# Where the limit is known to be no more, about, and so is what lies below it. With friction, bodies that differ share
# no array, and what swings for long before it rests costs as much in one as alone: few runs, one after the other.
NEAR = {
    "arrays": Pace(tuple(1.1 * 0.92**i for i in range(16)), tuple(2.0 ** (i / 2) for i in range(1, 11)), 17, 0.02, ()),
    "friction": Pace((0.85,), (1.3,), 1, 0.1, ()),
    "alone": Pace((0.85,), (1.3,), 1, 0.1, ()),
}
