"""Likely cause of a swing, as a sentence: what gave the device the most energy, by the books of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from haploop.tools.render.units import amount

if TYPE_CHECKING:
    from haploop.logger.summary import Summary

# Verdicts of a loop that swings.
SWINGS = ("limit-cycle", "swinging", "growing", "diverged")
# By the cause with the largest share of what the wall gave away.
_BECAUSE = {
    "delay_J": "each force comes after a delay, so that the wall still pushes while the device moves out",
    "sampling_and_hold_J": "each force is held for a tick while the device moves on",
    "quantisation_J": "the encoder rounds the position that the wall answers to",
}
_NONE = "{when} the wall gave no more energy than an ideal one would have: what moves here is not fed by the wall."
_NOTHING = "{when} the wall moved no energy at all: what moves here is not fed by it."
_WALL = (
    "{when} the wall gave the device {energy} more than an ideal one would have, {share:.0f} % of it because {because}."
)
# A linear loop without counts has no swing of a width of its own: it dies, or grows.
_MOST_COUNTS = 2.0
_COUNTS = (
    "the encoder: it swings by {counts:.2g} of its counts. A swing within two comes of them as a rule, whatever feeds "
    "it; the same scene with a finer encoder tells. "
)
# The books of wall and elements are those of the commands, and the actuator has one of its own.
_LIMITED = " That is by what was commanded: the actuator's limits kept {kept} of it back."
_KEPT = 0.1
_ELEMENT = "{when} {element} gave the device {energy}, more than the wall did."


def likely_cause(summary: Summary) -> str:
    """Returns what a swing comes of, given the summary of its run: the encoder where it is within two of its counts.

    Beside that, or alone, stands where its energy is from; "" of books without a wall.
    """
    counts = summary.get("stability", {}).get("counts")
    of_counts = _COUNTS.format(counts=counts) if counts and counts < _MOST_COUNTS else ""
    return (of_counts + cause(summary["energy"])).rstrip()


def cause(energy: Summary, when: str = "In all") -> str:
    """Returns where a swing has its energy from, given a summary's ``energy``; nothing of books without a wall."""
    if "leak" not in energy["wall"] or energy["wall"]["leak"]["total_J"] is None:
        return ""
    leak = energy["wall"]["leak"]
    given = {cause: max(0.0, -leak[cause]) for cause in _BECAUSE}
    fed = [(-element["true_J"], element["kind"]) for element in energy["elements"] if element["true_J"]]
    most_J, element = max(fed, default=(0.0, ""))
    if most_J > max(0.0, -leak["total_J"]):
        return _ELEMENT.format(when=when, element=element, energy=amount(most_J, "J")) + _limited(energy, most_J)
    if energy["wall"].get("true_J") == 0.0:  # as where its first force comes after the end
        return _NOTHING.format(when=when)
    if leak["total_J"] >= 0.0 or not (total := sum(given.values())):
        return _NONE.format(when=when)
    most = max(given, key=given.__getitem__)
    share = 100.0 * given[most] / total
    words = _WALL.format(when=when, energy=amount(-leak["total_J"], "J"), share=share, because=_BECAUSE[most])
    return words + _limited(energy, -leak["total_J"])


def _limited(energy: Summary, given_J: float) -> str:
    kept_J = energy.get("actuator_J") or 0.0
    return _LIMITED.format(kept=amount(kept_J, "J")) if kept_J > _KEPT * given_J else ""
