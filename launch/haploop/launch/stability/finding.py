"""The finding on a loop that was held still and pushed: its verdict, and its numbers and sentence in a summary."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from haploop.launch.stability.swing import REST_M
from haploop.launch.stability.why import (
    AFTER_BLOW,
    AT_HARDEST,
    DECAYING,
    DEEPER,
    FRICTIONLESS,
    GROWS,
    GROWS_ON,
    JUDGE,
    JUDGED_S,
    LASTS,
    LEFT_ALONE,
    SWINGS_ON,
    WHY,
)  # fmt: skip
from haploop.logger.verdict.measures import WINDOW_S
from haploop.protocol.amounts import amount
from haploop.protocol.filled import filled

# Swings of the loop and of its run whose widths differ by more than this factor are not the same; chaotic ones vary
# from one window to the next by more than their pieces show.
_WIDER, _WIDER_CHAOTIC = 1.2, 1.5
# Nobody is asked for a run longer than this.
_LONGEST_S = 3600.0
# A command whose ripple exceeds this share of the push (a tenth of the hold), or this force, is reported beside the
# verdict; so is noise that moves the device, peak to peak, by as much as a hand feels from 25 Hz on.
_RIPPLES, _RIPPLES_N, _SHAKEN_M = 0.33, 0.1, 10e-6
HAND_MOVES, NOISE = "the hand's motion", "noise"
UNFELT, OTHER_WIDTH = "less than a hand feels", "of another width than in its run"
# This near to the least that a hand feels, a run of another length may give the other verdict.
EDGE, _EDGE = "at the edge of what a hand feels", (0.8, 1.25)
# A swing that changes by less than this, in 1/s, has reached its end.
STILL_1_S = 0.05

# What ``Finding.entries`` reports about the run beside the finding.
BESIDE = {
    "own_share": "share of the oscillation in the run's last window that the loop sustains alone; the rest is the "
    "hand's own motion or noise, dies away, or is wider than what the push leaves; null where that is unknown",
    "moved_beside": "what else moved the run at its end: the hand's motion, noise",
    "provisos": "conditions that the verdict rests on, to be stated together with it",
}
# Numbers that only a push gives.
_OF_PUSH = ("push_N", "watched_s", "frequency_Hz", "width_m", "spread_m", "force_ripple_N")
# Findings without a verdict that more time would not change.
_TOLD = ("rests off the wall", "larger rests", "smaller rests")
DOES = {"steady": "rests", "limit-cycle": "swings on", "growing": "swings on", "diverged": "swings on"}


@dataclass(frozen=True)
class Finding:
    """What was found about a loop whose hand is held still; in a summary the sizes are None if it was not pushed.

    Attributes:
        word: steady, limit-cycle, growing, diverged, no-contact or undecided.
        why: what was found, in short, such as ``rest`` or ``forgets``: a key of ``why.WHY``.
        push_N: the larger of the two pushes, in magnitude; 0 for a run that was not pushed because it diverged or ended
            out of contact.
        watched_s: time watched since the push.
        rate_1_s: the r of e^(r t) by which the steadier of the two swings grows; negative: it decays; None if it
            died within a few pieces.
        error_1_s: standard error of ``rate_1_s``.
        frequency_Hz: frequency of the swing that remains at the end; 0 if none does.
        width_m: width of the swing that remains, peak to peak: the mean over the last quarter of both traces.
        spread_m: half the range of ``width_m`` over the pieces and traces.
        force_ripple_N: swing of the command above 30 Hz, peak to peak, in the last quarter.
        felt: whether a hand feels the swing.
        times_felt: how many times as wide the swing is as the least that a hand feels; None for a loop that rests.
        chaotic: whether two copies started a thousandth apart ended a fifth of the swing apart; None if not asked.
        detail: why the run itself ended, if it diverged, or what failed.
        needs_s: estimate of the time after which a swing that changes too slowly can be judged; None otherwise.
        most_1_s: the most that either swing may grow or decay by: rate and two standard errors of the one that may
            change most; None if it was not watched to an answer.
        blow_N: for a loop that rests after the push, a harder push, into the wall and off it; None if not asked.
        blown: what it does after these: rests, rests off the wall, swings on, or undecided; None if not asked.
        left: for a loop that rests after these, while its run still moved at its end, what it does left alone there:
            rests, rests off the wall, swings on, or undecided; None if not asked, or if it did not move.
        left_m: how wide the swing that lasts there is, peak to peak; None if none does, or if it grows.
        frictionless: what a loop that also rests after these would do after the push without its friction: rests,
            swings on, swings on a part of a count deeper, or undecided; None if not asked, or if it has no friction.
        frictionless_m: how wide the swing that lasts then is, peak to peak; None if none does, or if it grows.
        deeper_N: for a loop without friction that rests, how much harder the hand holds it where it lies a part of an
            encoder's count deeper; None if not asked, or without counts.
        deeper: what it does there: rests, swings on, or undecided; None if not asked.
        hardest_N: for a loop that rests then too, the hardest hold that its hand reached; None if that was about the
            last one, or if the hand does not move.
        at_hardest: what it does there: rests, swings on, or undecided; None if not asked.
        without: for a loop that swings, what it does without each of its parts, by the part's name, such as
            ``friction``; at a higher control rate (``sampling and hold``) and without ``all`` of these if it swings
            without any one of them: rests, swings within its limit (which the loop leaves otherwise), swings less (than
            a third as wide), swings otherwise (at another frequency), swings on, or undecided. None if not
            asked, or if it does not swing when started anew; empty if the hand presses harder than the wall answers
            within the device's limit, or than the actuator can.
        settles_s: how long after the push it came within 5 % of where it rests; None if it does not.
        memory_drifts: whether the memory of an element still changes while the loop rests.
        saturated: whether the actuator was at its largest force at any of the last quarter of the ticks watched.
    """

    word: str
    why: str
    push_N: float = 0.0
    watched_s: float = 0.0
    rate_1_s: float | None = None
    error_1_s: float | None = None
    frequency_Hz: float = 0.0
    width_m: float = 0.0
    spread_m: float = 0.0
    force_ripple_N: float = 0.0
    felt: bool = False
    chaotic: bool | None = None
    needs_s: float | None = None
    most_1_s: float | None = None
    blow_N: float | None = None
    blown: str | None = None
    left: str | None = None
    left_m: float | None = None
    frictionless: str | None = None
    frictionless_m: float | None = None
    hardest_N: float | None = None
    at_hardest: str | None = None
    deeper_N: float | None = None
    deeper: str | None = None
    times_felt: float | None = None
    without: Mapping[str, str] | None = None
    settles_s: float | None = None
    memory_drifts: bool = False
    saturated: bool = False
    detail: str = ""

    @property
    def tells(self) -> bool:
        """Tells whether watching for longer would show nothing else."""
        return (self.word != "undecided" or self.why in _TOLD) and not self.memory_drifts

    def after_blow(self, found: Finding) -> Finding:
        """Returns the finding with what was found after a harder push: undecided unless it rests then, too."""
        blown = _does(found)
        return replace(self, blow_N=found.push_N, blown=blown)._if_rests(blown, found)

    def left_alone(self, found: Finding) -> Finding:
        """Returns the finding with what was found without a push: undecided unless it rests then, too.

        A swing no wider than the one that the push left, which no hand feels, is that swing.
        """
        left, left_m = _does(found), _lasting_m(found)
        if left_m is not None and left_m <= _WIDER * self.width_m:
            left, left_m = "rests", None
        return replace(self, left=left, left_m=left_m)._if_rests(left, found)

    def _if_rests(self, does: str, found: Finding) -> Finding:
        told = replace(self, **self._at_either(found))
        return told if does.startswith("rests") else replace(told, word="undecided")

    def held_harder(self, hold_N: float, found: Finding) -> Finding:
        """Returns the finding with what was found at a harder hold: undecided unless it rests there, too."""
        does = DOES.get(found.word, "undecided")
        told = replace(self, hardest_N=abs(hold_N), at_hardest=does, **self._at_either(found))
        return told if does == "rests" else replace(told, word="undecided")

    @property
    def rests_freely(self) -> bool:
        """Tells whether it rests without friction, wherever it was held."""
        return self.word == "steady" and self.frictionless in (None, "rests")

    def held_deeper(self, more_N: float, found: Finding) -> Finding:
        """Returns the finding of a loop that rests, with what was found a part of a count deeper, without friction.

        A loop that has no friction is undecided unless it rests there too.
        """
        does = DOES.get(found.word, "undecided")
        if self.frictionless:
            does = f"{does} a part of a count deeper" if does == "swings on" else does
            return replace(self, frictionless=does, frictionless_m=_lasting_m(found))
        told = replace(self, deeper_N=abs(more_N), deeper=does, **self._at_either(found))
        return told if does == "rests" else replace(told, word="undecided")

    def _at_either(self, found: Finding) -> dict[str, bool]:
        """Returns what is told of a loop that rests if it holds here or where it was tried next."""
        return {
            "memory_drifts": self.memory_drifts or found.memory_drifts,
            "saturated": self.saturated or found.saturated,
        }

    def without_friction(self, found: Finding) -> Finding:
        """Returns the finding with what was found after the same push of the loop without its friction."""
        does = DOES.get(found.word, "undecided")
        return replace(self, frictionless=does, frictionless_m=_lasting_m(found))

    def entries(
        self, seen_m: float | None = None, beside: Sequence[str] = (), ripple_N: float | None = None
    ) -> dict[str, Any]:
        """Returns its entries in a summary: the verdict, the reason as a sentence, and the numbers as ``stability``.

        Args:
            seen_m: how far the run itself swung at its end, peak to peak.
            beside: what else moved the run there, see ``moved_beside``.
            ripple_N: swing of its command above 30 Hz there, peak to peak.
        """
        numbers = {name: value for name, value in vars(self).items() if name not in ("word", "detail")}
        if not self.push_N:
            numbers |= dict.fromkeys(_OF_PUSH)
        # A swing that nothing else moves is the loop's own, and differs from the one after a push by chance alone.
        is_told = beside or self.word == "steady"
        told = self.own_share(seen_m) if is_told else None, [*beside], self._provisos(seen_m, beside, ripple_N)
        numbers |= zip(BESIDE, told, strict=True)
        return {"verdict": self.word, "verdict_rule": self.sentence(), "stability": numbers}

    def _provisos(self, seen_m: float | None, beside: Sequence[str], ripple_N: float | None) -> list[str]:
        """Returns what has to be said in the same breath as ``steady``, or as a lasting swing."""
        edge = [EDGE] * (self.times_felt is not None and _EDGE[0] < self.times_felt < _EDGE[1])
        if self.word == "limit-cycle":
            unlike = [OTHER_WIDTH] * (not beside and self._is_other(seen_m))
            return [*edge, *unlike] if edge else [UNFELT] * (not self.felt) + unlike
        holds = {
            "only friction holds it": self.frictionless in ("swings on", "swings on a part of a count deeper"),
            "perhaps only friction holds it": self.frictionless == "undecided",
            "an element's memory still changes": self.memory_drifts,
            "its actuator is at its limit": self.saturated,
            "tried at only some holds of its hand": HAND_MOVES in beside,
            "noise shakes it": NOISE in beside and (seen_m or 0.0) > _SHAKEN_M,
            "its swing dies slowly": self.why == "decays" and self.felt,
            "its force ripples": (ripple_N or 0.0) > min(_RIPPLES * self.push_N, _RIPPLES_N),
        }
        told = [*edge, *(proviso for proviso, holds_it in holds.items() if holds_it)]
        return told if self.word == "steady" else []

    def _is_other(self, seen_m: float | None) -> bool:
        """Tells whether the run's swing is wider or narrower than that after the push, by more than both vary."""
        if seen_m is None or self.frequency_Hz * WINDOW_S < 1.0:
            return False
        most_m, least_m = self.width_m + 2.0 * self.spread_m, self.width_m - 2.0 * self.spread_m
        wider = _WIDER_CHAOTIC if self.chaotic else _WIDER
        return not least_m / wider <= seen_m <= most_m * wider

    def own_share(self, seen_m: float | None) -> float | None:
        """Returns the share of the swing seen in the run that the loop sustains alone, with a still hand and no noise.

        The rest is the hand's own motion, the noise, or dies away. None if the share is unknown: for a loop that does
        not settle, for a run that did not swing, and if the loop swings wider than the run did.
        """
        if self.word not in ("steady", "limit-cycle") or not seen_m or seen_m < REST_M:
            return None
        own_m = 0.0 if self.why == "decays" else self.width_m
        return min(own_m / seen_m, 1.0) if own_m < _WIDER * seen_m else None

    def _decaying(self) -> str:
        """Returns words on whether what is left still decays, by more than three standard errors; "" if it does not."""
        rate_1_s, error_1_s = self.rate_1_s or 0.0, self.error_1_s or 0.0
        return DECAYING.format(-rate_1_s, error_1_s) if rate_1_s < -max(3.0 * error_1_s, STILL_1_S) else ""

    def sentence(self) -> str:
        """Returns the reason for the verdict, a sentence with its numbers."""
        numbers = {name: math.nan if value is None else value for name, value in vars(self).items()}
        width_um, width = 1e6 * self.width_m, amount(self.width_m, "m")
        about_s = float(f"{numbers['needs_s']:.2g}")
        longer = f"watching for about {about_s:.0f} s" if about_s <= _LONGEST_S else "a much longer run"
        run = JUDGE if self.watched_s < JUDGED_S else longer
        sentence = filled(WHY[self.why], **numbers, width=width, width_um=width_um, run=run, decaying=self._decaying())
        sentence += filled(AFTER_BLOW[self.blown], **numbers) if self.blown else ""
        on = SWINGS_ON.format(amount(self.left_m, "m")) if self.left_m else GROWS_ON
        sentence += LEFT_ALONE[self.left].format(on) if self.left else ""
        sentence += filled(AT_HARDEST[self.at_hardest], **numbers) if self.at_hardest else ""
        sentence += filled(DEEPER[self.deeper], **numbers) if self.deeper else ""
        lasts = LASTS.format(amount(self.frictionless_m, "m")) if self.frictionless_m else GROWS
        return sentence + (FRICTIONLESS[self.frictionless].format(lasts) if self.frictionless else "")


def _does(found: Finding) -> str:
    """Returns what a loop does: rests, rests off the wall, swings on, or undecided."""
    return found.why if found.why == "rests off the wall" else DOES.get(found.word, "undecided")


def _lasting_m(found: Finding) -> float | None:
    """Returns the width of a swing that lasts, m; None for any other."""
    return found.width_m if found.word == "limit-cycle" else None
