"""The balance of the books: their totals, what they leave unexplained, and a sentence on what that says of a plant."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Any, NamedTuple

import numpy as np

from haploop.logger.books.work import CLOSING, Sums
from haploop.protocol.walls.wall import Wall

# A residual above this share of the energy that moved is reported in words.
_TOLD = 1e-3
# What causes the residual, and on which condition, by the roles of foreign programs: the books rest on what plant and
# controller report, and on the scene.
_IF = ", if its device and hand are those of the scene"
_WHOSE = {
    (): ("This plant", ""),
    ("plant",): ("This plant", _IF),
    ("controller",): ("This controller, by the forces that it reports,", ""),
    ("controller", "plant"): ("The pair of plant and controller, by what both report,", _IF),
}


class BooksState(NamedTuple):
    """The complete state of the books; in a batch, arrays have the members as their last axis.

    Attributes:
        names: the books, in the order of the rows of the sums: the plant's, the causes of the wall's leak where there
            is a wall, ``moved``, then ``<b>.sampled`` and ``<b>.true`` for the wall and for every element's book b.
        sums: their totals so far, J.
        stored_at_start_J: kinetic and spring energy at the start.
        wall: as it was in the intervals booked last; None before the first.
        wall_changes_J: energy that changes of the wall in contact would have put into an ideal one.
    """

    names: tuple[str, ...]
    sums: Sums
    stored_at_start_J: Any
    wall: Wall | None
    wall_changes_J: Any


# Signs of the books in the balance: what the hand gave, less what is elsewhere.
_SIGNS = {"kinetic": -1.0, "spring": -1.0, "actuator": -1.0}
_ENDINGS = {"_work": 1.0, "_heat": -1.0, ".true": -1.0}


def balance_sign(name: str) -> float:
    """Returns the sign of a book in the balance; 0 for a book that is not part of it."""
    return _SIGNS.get(name) or next((sign for ending, sign in _ENDINGS.items() if name.endswith(ending)), 0.0)


def balance(names: Sequence[str]) -> list[tuple[float, int]]:
    """Returns the sign and the row of every book of the balance."""
    return [(sign, row) for row, name in enumerate(names) if (sign := balance_sign(name))]


def total_J(state: BooksState, name: str) -> Any:
    """Returns the total of one book so far, J; shape (batch,) for a batch."""
    row = state.names.index(name)
    total = state.sums.sums[row] + state.sums.errors[row]
    return total if total.shape else float(total)


def stored_J(state: BooksState) -> Any:
    """Returns kinetic and spring energy now, J."""
    return state.stored_at_start_J + total_J(state, "kinetic") + total_J(state, "spring")


def moved_J(state: BooksState) -> Any:
    """Returns the energy that changed its place so far, J."""
    return abs(state.stored_at_start_J) + total_J(state, "moved")


def residual_J(state: BooksState) -> Any:
    """Returns the magnitude of what the books leave unexplained, J; None where one book closes the balance."""
    unexplained = unexplained_J(state)
    return None if unexplained is None else abs(unexplained)


def unexplained_J(state: BooksState) -> Any:
    """Returns the energy that the books leave unexplained, J: positive if lost, negative if it came from nowhere.

    It is infinite where a book is not finite, and None where one book closes the balance.
    """
    if CLOSING in state.names:
        return None
    parts = np.array([sign * of[row] for sign, row in balance(state.names) for of in state.sums])
    if parts.ndim == 1:
        return _sum_exactly(parts.tolist())
    return np.array([_sum_exactly(of_member) for of_member in parts.T.tolist()])


def _sum_exactly(parts: list[float]) -> float:
    return math.fsum(parts) if all(map(math.isfinite, parts)) else math.inf


def balance_words(unexplained_J: float | None, moved_J: float, foreign: Collection[str] = ()) -> str:
    """Returns a sentence on what the books of a run leave unexplained; "" where it is too little to mention.

    Args:
        unexplained_J: positive if lost, negative if it came from nowhere; None where no figure is claimed.
        moved_J: energy that changed its place.
        foreign: roles taken by foreign programs, and those that may generate energy beside them.
    """
    if unexplained_J is None or not math.isfinite(unexplained_J) or not abs(unexplained_J) > _TOLD * moved_J:
        return ""
    does, where = ("loses", "went nowhere") if unexplained_J > 0.0 else ("invents", "came from nowhere")
    percent = float(f"{100.0 * abs(unexplained_J) / moved_J:.2g}") if moved_J else math.inf
    whose, condition = _WHOSE[tuple(sorted(foreign))]
    amount = f"{abs(unexplained_J):.3g} J of the {moved_J:.3g} J that moved {where}"
    return f"{whose} {does} {percent:g} % of the energy: {amount}{condition}."
