"""Sentences on the swing of a recorded motion: whether it buzzes, and which low-pass leaves the swing in."""

from __future__ import annotations

import math
from typing import Any

from haploop.launch.stability.traces import is_felt
from haploop.protocol.amounts import amount
from haploop.protocol.filled import filled
from haploop.tools.dissipate.outcome import Outcome
from haploop.tools.dissipate.swing.buzz import ABOVE_HZ, LASTS_S, LEAST_RATE_HZ, SLOWER, Buzz, Span, Word
from haploop.tools.dissipate.swing.course import Course
from haploop.tools.dissipate.swing.fed import LEAST_FED
from haploop.tools.dissipate.swing.lines import COUNTS

_BUZZ: dict[Word, str] = {
    "buzzes": "The recording buzzes: it swings at {frequency}, {width} peak to peak at most, {when}; "
    "pauses of less than half a second are not reported.",
    "buzzes at several frequencies": (
        "The recording buzzes at several frequencies at once: {lines} peak to peak at most, together up to {width}, "
        "{when}."
    ),
    "none seen": (
        "No{other} swing above {above:g} Hz was seen, at one frequency or up to three at once, that lasts {lasts:g} s "
        "and is wide enough to be felt. Motion without a frequency is not called a buzz."
    ),
    "cannot say": (
        "Whether the recording buzzes cannot be said: that takes {lasts:g} s without a gap, and {rate:g} samples per "
        "second."
    ),
}
_SHORT = (
    " Parts between gaps that last less than {lasts:g} s, {short} in all, are too short to tell: a buzz may be in them."
)
# Short parts that last less than this in all are not mentioned.
_LEAST_SHORT_S = 0.1
_HIDDEN = (
    "Whether the recording buzzes cannot be said: a swing at {at:.1f} Hz, {width} peak to peak, would be felt, but it "
    "is within {counts} counts of the positions, {count} each, so it may be their staircase. Record with a finer "
    "encoder."
)
_ONE_HZ, _MOVING_HZ = "{0:.1f} Hz (give or take {1:g} Hz)", "{0:.0f} to {1:.0f} Hz"
# Up to this many spans with different frequencies are described one by one.
MOST_SPANS = 4
_SPAN = "{frequency} ({width}) from about {from_s:.1f} s to {to_s:.1f} s"
_LINE = "{0:.1f} Hz, {1}"
_NOT_FED = " What a recorded force gives to a swing is reported only for one at a single frequency."
_ONCE, _AGAIN = "from about {0:.1f} s to {1:.1f} s", "{0} times between about {1:.1f} s and {2:.1f} s, {3:.1f} s in all"
_COURSE: dict[Course, str] = {
    "grew": " It grew from {first} to {last}.",
    "died down": " It died down from {first} to {last}.",
    "stayed": " It stayed as wide.",
    "varied": " Its width varied from {least} to {widest}.",
}
_FED = " Meanwhile the recorded force gave {energy} to this swing, {power}: it feeds the swing."
_TAKEN = (
    " Meanwhile the recorded force took {energy} out of this swing, {power}: something else feeds it, unless the force "
    "came later than stated (--delay)."
)
_EITHER = (
    " Meanwhile the recorded force moved {energy} between itself and this swing, {power}; which way depends on its "
    "sign, which is in doubt."
)
_NEITHER = (
    " The recorded force neither fed this swing nor took from it, within a hundredth of the energy that went to and "
    "fro."
)
_SLOWER = (
    " It {also}swings at {frequency}, {width} peak to peak at most, {when}: slower than the {above:g} Hz from which "
    "on it would be called a buzz. It may be a hand's own motion, its tremor or a slow limit cycle, which a recording "
    "alone cannot tell apart."
)
_FAST = (
    " It moves by {rms} r.m.s. above {above:g} Hz for a second or more, at no frequency that lasts: so do a hand's "
    "fast motion, blows, noise, bursts of half a second and motion that dies away, but an irregular buzz does so, too."
)
# Motion is beyond noise from this many times the noise of single positions on.
_BEYOND_NOISE = 3.0
_HAND = " Its widest swing is at {main:.3g} Hz, {width} peak to peak at most, which a hand can do, too."
NEXT = (
    "Which wall and which element suit the device: describe it in a file (haploop scenes premium15 prints one to start "
    "from), and run haploop advise FILE."
)
_LEFT_OUT = (
    " A swing at {at:.1f} Hz, {width} peak to peak, was left out: near {order} times {of:.1f} Hz, it may belong to "
    "the shape of that slower motion, but it may also be a buzz."
)
_LOW_PASS = (
    "Low-pass the estimates, as with --set acceleration.cutoff={acceleration:.0f} or --set "
    "velocity.cutoff={velocity:.0f}, until the energy no longer depends on it."
)
_NO_LOW_PASS = (
    "No low-pass of the estimates is suitable, since the motion itself swings at {main:.3g} Hz; record it with a finer "
    "or faster encoder."
)
# Cutoffs, Hz, which are at least this many times the frequency at which the motion swings.
_CUTOFFS, _ABOVE_MAIN = {"acceleration": 20.0, "velocity": 50.0}, 3.0
_FILTERED_OUT = (
    "{name}.cutoff = {cutoff:g} Hz is no more than the {main:.3g} Hz at which the motion swings: it filters out that "
    "swing, and the energies are those of what is left."
)


def buzz_sentence(outcome: Outcome) -> str:
    """Returns in words whether the recording buzzes: at which frequency, how wide and when."""
    limits: dict[str, Any] = {
        "above": ABOVE_HZ,
        "lasts": LASTS_S,
        "rate": LEAST_RATE_HZ,
        "other": " other" if outcome.left_out else "",
    }
    if buzz := outcome.buzz:
        limits |= _told(buzz)
    if several := outcome.several:
        limits["lines"] = " and ".join(_LINE.format(at_Hz, amount(width_m, "m")) for at_Hz, width_m in several.lines)
        limits["width"] = amount(several.width_m, "m")
        limits["when"] = _ONCE.format(several.from_s, several.to_s)
    words = _BUZZ[outcome.buzz_word].format(**limits)
    if of := outcome.hidden:
        told = {"at": of.frequency_Hz, "width": amount(of.width_m, "m"), "count": amount(of.count_m, "m")}
        words = _HIDDEN.format(**told, counts=COUNTS)
    if outcome.buzz:
        sign_is_known = not outcome.force or outcome.force.sign_is_known
        return words + _course(outcome.buzz) + _fed(outcome.buzz, sign_is_known) + _slower(outcome, "also ")
    if several:
        return words + _NOT_FED * bool(outcome.force)
    rms_m = outcome.fast_rms_m
    is_beyond_noise = rms_m > _BEYOND_NOISE * (outcome.noise_m or 0.0)
    if outcome.buzz_word == "none seen" and is_beyond_noise and is_felt(2.0 * math.sqrt(2.0) * rms_m, ABOVE_HZ):
        words += _FAST.format(rms=amount(rms_m, "m"), **limits)
    if outcome.buzz_word == "none seen" and outcome.short_s > _LEAST_SHORT_S:
        words += _SHORT.format(short=amount(outcome.short_s, "s"), lasts=LASTS_S)
    words += _slower(outcome)
    if (slow := outcome.slow) and not (outcome.slower and slow.frequency_Hz > SLOWER.above_Hz):
        words += filled(_HAND, main=slow.frequency_Hz, width=amount(slow.width, "m"))
    if not (left := outcome.left_out):
        return words
    numbers = {"at": left.line.frequency_Hz, "width": amount(left.line.width, "m")}
    numbers |= {"order": left.order, "of": left.slower_Hz}
    return words + _LEFT_OUT.format(**numbers)


def _slower(outcome: Outcome, also: str = "") -> str:
    slower = outcome.slower
    return _SLOWER.format(**_told(slower), above=ABOVE_HZ, also=also) if slower else ""


def buzzing(outcome: Outcome) -> list[tuple[float, float, str]]:
    """Returns each stretch in which the recording buzzes: its start and end, s, and its frequencies in words."""
    if several := outcome.several:
        return [(several.from_s, several.to_s, " and ".join(f"{at_Hz:.1f} Hz" for at_Hz, _ in several.lines))]
    if not (buzz := outcome.buzz):
        return []
    if len(buzz.spans) == 1 and not _moves(buzz.least_Hz, buzz.most_Hz, buzz):
        return [(*buzz.stretches[0], f"{buzz.frequency_Hz:.1f} Hz")]
    return [(span.from_s, span.to_s, _frequency(span, buzz)) for span in buzz.spans]


def _told(buzz: Buzz) -> dict[str, str]:
    """Returns frequency, width and time of a swing in words; spans with different frequencies one by one."""
    moves = _moves(buzz.least_Hz, buzz.most_Hz, buzz)
    of_Hz = (buzz.least_Hz, buzz.most_Hz) if moves else (buzz.frequency_Hz, buzz.within_Hz)
    told = {"frequency": (_MOVING_HZ if moves else _ONE_HZ).format(*of_Hz), "width": amount(buzz.width_m, "m")}
    from_s, to_s = buzz.stretches[0][0], buzz.stretches[-1][1]
    times = len(buzz.spans)
    if moves and 1 < times <= MOST_SPANS:
        return told | {"when": " and ".join(_span(span, buzz) for span in buzz.spans)}
    return told | {
        "when": _ONCE.format(from_s, to_s) if times == 1 else _AGAIN.format(times, from_s, to_s, buzz.lasts_s)
    }


def _moves(least_Hz: float, most_Hz: float, buzz: Buzz) -> bool:
    return most_Hz - least_Hz > 2.0 * buzz.within_Hz


def _span(span: Span, buzz: Buzz) -> str:
    told = {"frequency": _frequency(span, buzz), "width": amount(span.width_m, "m")}
    return _SPAN.format(**told, from_s=span.from_s, to_s=span.to_s)


def _frequency(span: Span, buzz: Buzz) -> str:
    least_Hz, most_Hz = span.least_Hz, span.most_Hz
    return (
        _MOVING_HZ.format(least_Hz, most_Hz)
        if _moves(least_Hz, most_Hz, buzz)
        else f"{(least_Hz + most_Hz) / 2:.1f} Hz"
    )


def _course(buzz: Buzz) -> str:
    """Returns in words how the width of a buzz of one stretch changed."""
    if buzz.course is None:
        return ""
    told = {"first": buzz.first_m, "last": buzz.last_m, "least": buzz.least_m, "widest": buzz.width_m}
    return _COURSE[buzz.course].format(**{name: amount(width_m, "m") for name, width_m in told.items()})


def _fed(buzz: Buzz, sign_is_known: bool) -> str:
    if buzz.fed_W is None or buzz.fed_J is None:
        return ""
    words = _FED if buzz.is_fed else _TAKEN if -buzz.fed_W > LEAST_FED * buzz.moved_W else _NEITHER
    words = words if sign_is_known or words == _NEITHER else _EITHER
    return words.format(energy=amount(abs(buzz.fed_J), "J"), power=amount(abs(buzz.fed_W), "W"))


def filtered_out(outcome: Outcome) -> list[str]:
    """Returns a sentence on each cutoff that filters out the swing of the motion itself."""
    main_Hz, found = outcome.main_Hz, []
    for name in ("velocity", "acceleration"):
        cutoff = None if name in outcome.recording.recorded else outcome.scene.estimate(name).cutoff
        if main_Hz and cutoff and cutoff <= main_Hz:
            found.append(filled(_FILTERED_OUT, name=name, cutoff=cutoff, main=main_Hz))
    return found


def low_pass(outcome: Outcome) -> str:
    """Returns in words which cutoffs remove noise from the estimates but keep the swing of the motion."""
    least_Hz = _ABOVE_MAIN * (outcome.main_Hz or 0.0)
    if least_Hz > 0.25 / outcome.recording.period_s:
        return filled(_NO_LOW_PASS, main=outcome.main_Hz)
    return _LOW_PASS.format(**{name: max(cutoff, least_Hz) for name, cutoff in _CUTOFFS.items()})
