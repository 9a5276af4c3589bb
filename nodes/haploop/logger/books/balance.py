"""The balance of the books in words: what a plant, or a program that came in its place, makes of the energy."""

from __future__ import annotations

import math
from collections.abc import Collection

# A residual is told in words beyond this share of the energy that moved.
_TOLD = 1e-3
# Whose doing it is and on which condition, by the roles that programs of others had: the books rest on what plant and
# controller tell, and on the scene.
_IF = ", if its device and hand are those of the scene"
_WHOSE = {
    (): ("This plant", ""),
    ("plant",): ("This plant", _IF),
    ("controller",): ("This controller, by what it says of its forces,", ""),
    ("controller", "plant"): ("Plant and controller together, by what they say of themselves,", _IF),
}


def balance_words(unexplained_J: float | None, moved_J: float, foreign: Collection[str] = ()) -> str:
    """Returns what the books of a run leave unexplained, as a sentence; "" where it is nothing worth a word.

    Args:
        unexplained_J: above 0 what got lost, below 0 what came from nowhere; None where none is claimed.
        moved_J: energy that changed its place.
        foreign: roles that were taken by programs of others, or may make energy beside them.
    """
    if unexplained_J is None or not math.isfinite(unexplained_J) or not abs(unexplained_J) > _TOLD * moved_J:
        return ""
    does, where = ("loses", "went nowhere") if unexplained_J > 0.0 else ("invents", "came from nowhere")
    percent = float(f"{100.0 * abs(unexplained_J) / moved_J:.2g}") if moved_J else math.inf
    whose, condition = _WHOSE[tuple(sorted(foreign))]
    amount = f"{abs(unexplained_J):.3g} J of the {moved_J:.3g} J that moved {where}"
    return f"{whose} {does} {percent:g} % of the energy: {amount}{condition}."
