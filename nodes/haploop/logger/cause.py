"""Likely cause of a swing, as sentences: the part without which the loop rests, and where the energy comes from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from haploop.protocol.amounts import amount

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from haploop.logger.summary import Summary

# Verdicts of a loop that swings.
SWINGS = ("limit-cycle", "swinging", "growing", "diverged")
# By the cause with the largest share of what the wall gave away.
_BECAUSE = {
    "delay_J": "each force comes after a delay, so that the wall still pushes while the device moves out",
    "sampling_and_hold_J": "each force is held for a tick while the device moves on",
    "quantisation_J": "the encoder rounds the position that the wall answers to",
}
_NONE = "{when}, the wall gave no more energy than an ideal one would have: the motion here is not fed by the wall."
_NOTHING = "{when}, the wall moved no energy at all: the motion here is not fed by it."
_WALL = (
    "{when}, the wall gave the device {energy} more than an ideal one would have, {share:.0f} % of it "
    "because {because}."
)
# What a loop does without its parts, in the order in which it is told.
_DOES = {
    "rests": "rests without {}",
    "swings within its limit": "swings within its limit without {}",
    "swings less": "swings less than a third as wide without {}",
    "swings otherwise": "swings at another frequency without {}",
    "swings on": "swings on without {}",
    "undecided": "is undecided without {}",
}
_ALL = {"all": "all of these at once"}
_SEVERAL = "{} together: it rests as soon as one of them is left out"
_MOSTLY = "mostly {}"
_ANY = "{}, either of which makes most of it"
_BOTH = "{} together: taking out any one of them keeps it within its limit"
# Words for one part and for several, by what the loop does without it.
_CAUSES = ("rests", "{}", _SEVERAL), ("swings within its limit", _MOSTLY, _BOTH), ("swings less", _MOSTLY, _ANY)
_NO_SINGLE_ONE = "no single part, since it swings whichever one is left out"
_NOT_FOUND = "not found by these trials; what they leave is the wall itself, the hand, and the estimators"
_UNTOLD = "not determined by these trials"
# Below this share most of what is seen is the hand's motion, noise, or dies away.
_HALF = 0.5
# Share of the energy that moved in a run from which on what the wall gave away is told without trials.
_TELLING = 0.01
_LIKELY = "Likely cause: {}"
_PRESSED_THROUGH = (
    "the hand, which presses harder than the wall answers within the device's limit, or than the actuator can."
)
_NO_TRIALS = (
    "No part is named: none was tried, or the loop, started anew on the wall and pushed, does not swing as here."
)
_SMALL_SHARE = "of the {:.0%} of the oscillation that the loop sustains alone, "
_TRIED = "{cause}. Started anew on the wall, pushed, and struck where it rests, the loop {trials}."
_BY_BOOKS = "According to the books of the whole run"
# The books of wall and elements are those of the commands, and the actuator has one of its own.
_LIMITED = " That counts what was commanded: the actuator's limits kept {kept} of it back."
_KEPT = 0.1
_ELEMENT = "{when}, {element} gave the device {energy}, more than the wall did."


def likely_cause(summary: Summary) -> str:
    """Returns the likely cause of a swing, given the summary of its run; "" where nothing is known of it.

    Where the loop was tried without its parts, it is the part without which it rests, followed by the trials. The
    energy by the books, ``cause``, comes after it: one part may feed a swing that rests without another. It is left out
    of a run that was changed within its last window, since the books are of all its loops, and of one whose wall fed
    nothing, such as when its first force came after the end. Without trials it stands alone, unless it is less than a
    hundredth of what moved.
    """
    stability, energy = summary.get("stability", {}), summary["energy"]
    without, share = stability.get("without"), stability.get("own_share")
    if without == {}:
        return cause_in_short(summary)
    tried = by_trial(without)
    if tried and share is not None and share < _HALF:
        tried = _SMALL_SHARE.format(share) + tried
    if tried:
        is_of_this_loop = summary["window"].get("changed_s") is None and energy["wall"].get("true_J") != 0.0
        fed = is_of_this_loop and _most_fed_J(energy) > 0.0
        return " ".join([_LIKELY.format(tried), *([cause(energy, _BY_BOOKS)] if fed else [])]).strip()
    hardly_fed = 0.0 < _most_fed_J(energy) < _TELLING * (energy.get("moved_J") or 0.0)
    untried = _NO_TRIALS if summary["verdict"] != "swinging" and stability and not without else ""
    return " ".join(filter(None, ["" if hardly_fed else cause(energy), untried]))


def cause_in_short(summary: Summary) -> str:
    """Returns the first sentence of the likely cause of a swing; "" where no part of the loop was tried."""
    without = summary.get("stability", {}).get("without")
    if without is None:
        return ""
    return _LIKELY.format(f"{_cause_by_trial(without)}." if without else _PRESSED_THROUGH)


def _most_fed_J(energy: Summary) -> float:
    """Returns the most that the wall, or an element, gave the device more than an ideal one, J."""
    leak_J = (energy["wall"].get("leak") or {}).get("total_J") or 0.0
    return max([-leak_J, *(-(element["true_J"] or 0.0) for element in energy["elements"])])


def by_trial(without: Mapping[str, str] | None) -> str:
    """Returns the likely cause and its trials, given ``without`` of a summary's ``stability``; "" without trials."""
    if not without:
        return ""
    told = {does: [_ALL.get(name, name) for name, did in without.items() if did == does] for does in _DOES}
    trials = "; ".join(_DOES[does].format(_listed(names, "or")) for does, names in told.items() if names)
    return _TRIED.format(cause=_cause_by_trial(without), trials=trials)


def _listed(names: Sequence[str], last: str) -> str:
    return f" {last} ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _cause_by_trial(without: Mapping[str, str]) -> str:
    for does, one, several in _CAUSES:
        if parts := [name for name, did in without.items() if did == does and name != "all"]:
            return (several if len(parts) > 1 else one).format(_listed(parts, "and"))
    if "undecided" in without.values():
        return _UNTOLD
    return _NO_SINGLE_ONE if without.get("all") in [does for does, *_ in _CAUSES] else _NOT_FOUND


def cause(energy: Summary, when: str = "In all") -> str:
    """Returns where a swing gets its energy from, given a summary's ``energy``; "" for books without a wall."""
    if "leak" not in energy["wall"] or energy["wall"]["leak"]["total_J"] is None:
        return ""
    leak = energy["wall"]["leak"]
    given = {cause: max(0.0, -leak[cause]) for cause in _BECAUSE}
    fed = [(-element["true_J"], element["kind"]) for element in energy["elements"] if element["true_J"]]
    most_J, element = max(fed, default=(0.0, ""))
    if most_J > max(0.0, -leak["total_J"]):
        return _ELEMENT.format(when=when, element=element, energy=amount(most_J, "J")) + _limited(energy, most_J)
    if energy["wall"].get("true_J") == 0.0:  # such as when its first force comes after the end
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
