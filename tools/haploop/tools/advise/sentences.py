"""What was found, in sentences that a device builder can act on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from haploop.tools.advise.effects_off import SAMPLING
from haploop.tools.render.units import amount, fixed

if TYPE_CHECKING:
    from haploop.tools.advise.advice import Advice
    from haploop.tools.advise.buzz import Buzz, Without
    from haploop.tools.advise.limits.gains import Gains
    from haploop.tools.advise.limits.largest import Limit

# A stiffness this much larger is worth a word.
_MORE = 1.1
# Every loop is sampled: that is named before a cause of this loop's own where it allows so many times as much.
_STANDS_OUT = 2.0


def stiff(stiffness_N_m: float) -> str:
    """``1.4 N/mm``, from 0.01 N/mm on; softer ones in N/m."""
    if not math.isfinite(stiffness_N_m):
        return "any"
    if 0.0 < stiffness_N_m < 10.0:
        return f"{fixed(stiffness_N_m, 2)} N/m"
    return f"{fixed(stiffness_N_m / 1e3)} N/mm" if stiffness_N_m >= 1e3 else f"{fixed(stiffness_N_m / 1e3, 2)} N/mm"


def largest(limit: Limit) -> str:
    """A limit: ``none`` where no wall is steady, ``over ...`` where no end was found."""
    if not limit.stiffness_N_m:
        return "none"
    over = "over " if not math.isfinite(limit.not_steady_N_m) else ""
    return over + stiff(limit.stiffness_N_m)


def gain_sentences(found: Advice) -> list[str]:
    """The advice, then what else would do, then what is nearest to going wrong."""
    safe, best = found.safe, found.safe.gains
    if not safe.stiffness_N_m:
        return ["No wall stays steady when delay, hand and device may each be 20 % off: add damping or cut the delay."]
    doubt = _listed(list(found.uncertain))
    changed = f" also with {doubt} 20 % off, in all {safe.corners} combinations" if found.uncertain else ""
    tried = best.tried[best.safe_values]
    said = [
        f"Render at most {stiff(safe.stiffness_N_m)} with {best.family.phrase(best.safe_values)}: steady{changed}; "
        f"in the loop as described up to {_as_far_as(tried)}."
    ]
    return [*said, *_others(found), _nearest(found)]


def _others(found: Advice) -> list[str]:
    """What the elements not recommended would allow, where that is more."""
    safe, best = found.safe, found.safe.gains
    said = []
    bare = found.gains[0]
    if best is not bare:
        gain = safe.stiffness_N_m / bare.safe.stiffness_N_m if bare.safe.stiffness_N_m else math.inf
        times = f", {fixed(gain, 2)} times less" if math.isfinite(gain) and gain >= _MORE else ""
        said.append(f"Without any element it would be {_at_most(bare)}{times}.")
    tempting = [
        gains
        for gains in found.gains
        if gains is not best and gains.limit.stiffness_N_m > _MORE * best.tried[best.safe_values].stiffness_N_m
    ]
    if tempting:
        most = max(tempting, key=lambda gains: gains.limit.stiffness_N_m)
        hardly = most.safe.stiffness_N_m > safe.stiffness_N_m
        doubt = (
            f"with 20 % doubt {_at_most(most)}: hardly more" if hardly else f"but with 20 % doubt only {_at_most(most)}"
        )
        said.append(
            f"With {most.family.phrase(most.values)}, {largest(most.limit)} would be steady in the loop as described, "
            f"{doubt}."
        )
    return said


def _at_most(gains: Gains) -> str:
    return largest(gains.safe) if gains.safe.stiffness_N_m else "no wall at all"


def _nearest(found: Advice) -> str:
    safe = found.safe
    if safe.nearest:
        return f"The nearest instability is {safe.nearest.words}."
    return "No other single change that was tried, up to five times more or less, makes it unsteady."


def buzz_sentences(buzz: Buzz) -> list[str]:
    """Why it buzzes, or how far it is from that."""
    if buzz.steady:
        return _steady(buzz)
    cures = _ranked([without for without in buzz.alone if without.steady and not without.is_element])
    elements = [without for without in buzz.alone if without.steady and without.is_element]
    said = []
    if cures:
        first, *others = cures
        others = [without for without in others if _stands_well(without, buzz)]
        said.append(f"It buzzes because of the {first.names[0]}: without it the wall is steady up to {_up_to(first)}.")
        if others:
            told = _listed([f"without the {w.names[0]} (up to {_up_to(w)})" for w in others])
            said.append(f"It would also be steady {told}.")
    if elements:
        told = _listed([f"{without.names[0]} (up to {_up_to(without)})" for without in _ranked(elements)])
        if cures:
            said.append(f"Leaving out {told} would do, too.")
        else:
            said.append(f"It is steady without {told}; no other single cause makes it buzz.")
    if not cures and not elements:
        said += _only_together(buzz)
    return said + _harm(buzz)


def _only_together(buzz: Buzz) -> list[str]:
    if buzz.together:
        sets = _ranked(list(buzz.together))
        first = _listed([f"the {name}" for name in sets[0].names])
        said = [
            f"No single cause makes it buzz: it is steady only without {first} together, then up to {_up_to(sets[0])}."
        ]
        if len(sets) > 1:
            others = [" and ".join(without.names) for without in sets[1:]]
            said.append(f"So would it be without {'; or '.join(others)}.")
        return said
    if buzz.all_off:
        return [
            "It buzzes even without all of these together: the wall is too stiff for what damping there is, sampled "
            "as finely as the plant steps."
        ]
    return ["Nothing that could be switched off makes it buzz."]


def _harm(buzz: Buzz) -> list[str]:
    """Friction that helps is said; so are causes whose absence makes it worse."""
    worse = [
        without.names[0]
        for without in buzz.alone
        if without.limit
        and buzz.limit.stiffness_N_m
        and without.limit.stiffness_N_m * _MORE < buzz.limit.stiffness_N_m
        and not without.steady
    ]
    if not worse:
        return []
    help_, them = ("helps", "it") if len(worse) == 1 else ("help", "them")
    return [f"The {_listed(worse)} {help_}: without {them}, less is steady."]


def _steady(buzz: Buzz) -> list[str]:
    if not math.isfinite(buzz.limit.not_steady_N_m):
        return [f"It does not buzz, nor does any wall that was tried, up to {stiff(buzz.limit.stiffness_N_m)}."]
    if buzz.limit.stiffness_N_m < buzz.stiffness_N_m:
        return [
            f"It does not buzz at {stiff(buzz.stiffness_N_m)}, but a softer wall of {stiff(buzz.limit.not_steady_N_m)} "
            "does: it stands on an island."
        ]
    factor = buzz.limit.stiffness_N_m / buzz.stiffness_N_m
    return [
        f"It does not buzz: its wall of {stiff(buzz.stiffness_N_m)} could be {fixed(factor, 2)} times as stiff, "
        f"{largest(buzz.limit)}, before it does."
    ]


def _stands_well(without: Without, buzz: Buzz) -> bool:
    """Whether the wall is steady without it by more than a hair."""
    return bool(without.limit and without.limit.stiffness_N_m > _MORE * buzz.stiffness_N_m)


def _ranked(some: list[Without]) -> list[Without]:
    """Those first without which the stiffest wall is steady; what every loop has only where it stands out."""

    def stands_out(without: Without) -> float:
        limit = without.limit.stiffness_N_m if without.limit else 0.0
        return limit / _STANDS_OUT if SAMPLING in without.names else limit

    return sorted(some, key=stands_out, reverse=True)


def _up_to(without: Without) -> str:
    return _as_far_as(without.limit) if without.limit else "this"


def _as_far_as(limit: Limit) -> str:
    """As in "up to 1.4 N/mm"."""
    return stiff(limit.stiffness_N_m) + ("" if math.isfinite(limit.not_steady_N_m) else " and beyond")


def share(without: Without) -> str:
    """``80 %, −973 µJ``."""
    if without.leak_J is None or without.leak_share is None:
        return "–"
    return f"{100 * without.leak_share:.0f} %, {amount(without.leak_J, 'J')}"


def _listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + f" and {words[-1]}" if words else ""
