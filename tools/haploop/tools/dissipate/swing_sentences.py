"""Sentences on the swing of a recorded motion: whether it buzzes, and which low-pass leaves the swing in."""

from __future__ import annotations

from haploop.tools.dissipate.buzz import ABOVE_HZ, LASTS_S, LEAST_RATE_HZ, Word
from haploop.tools.dissipate.outcome import Outcome
from haploop.tools.render.units import amount

_BUZZ: dict[Word, str] = {
    "buzzes": (
        "The recording buzzes: it swings at {frequency:.1f} Hz (give or take {within:g} Hz), {width} peak to peak at "
        "most, from about {from_s:.1f} s to {to_s:.1f} s."
    ),
    "none seen": (
        "No buzz was seen: no swing at one frequency above {above:g} Hz lasts {lasts:g} s and is wide enough to be "
        "felt."
    ),
    "cannot say": (
        "Whether the recording buzzes cannot be said: that takes {lasts:g} s without a gap, and {rate:g} samples a "
        "second."
    ),
}
_SLOWER = " It swings at {main:.3g} Hz, which a hand can, too."
_LOW_PASS = (
    "Low-pass the estimates, as by --set acceleration.cutoff={acceleration:.0f} or --set "
    "velocity.cutoff={velocity:.0f}, until the energy no longer depends on it."
)
_NO_LOW_PASS = (
    "No low-pass of the estimates suits, since the motion itself swings at {main:.3g} Hz; record it with a finer or "
    "faster encoder."
)
# Cutoffs, Hz, and at least so many times the frequency at which the motion swings.
_CUTOFFS, _ABOVE_MAIN = {"acceleration": 20.0, "velocity": 50.0}, 3.0
_FILTERED_OUT = (
    "{name}.cutoff = {cutoff:g} Hz is no more than the {main:.3g} Hz at which the motion swings: it filters out that "
    "swing, and the energies are those of what is left."
)


def buzz_sentence(outcome: Outcome) -> str:
    """Returns whether the recording buzzes: at which frequency, how wide, since when."""
    limits = {"above": ABOVE_HZ, "lasts": LASTS_S, "rate": LEAST_RATE_HZ}
    if buzz := outcome.buzz:
        limits |= {"frequency": buzz.frequency_Hz, "within": buzz.within_Hz, "from_s": buzz.from_s, "to_s": buzz.to_s}
    words = _BUZZ[outcome.buzz_word].format(width=amount(outcome.buzz and outcome.buzz.width_m, "m"), **limits)
    return words + ("" if outcome.buzz or not outcome.main_Hz else _SLOWER.format(main=outcome.main_Hz))


def filtered_out(outcome: Outcome) -> list[str]:
    """Returns which cutoffs filter out the swing of the motion itself."""
    main_Hz, found = outcome.main_Hz, []
    for name in ("velocity", "acceleration"):
        cutoff = None if name in outcome.recording.recorded else outcome.scene.estimate(name).cutoff
        if main_Hz and cutoff and cutoff <= main_Hz:
            found.append(_FILTERED_OUT.format(name=name, cutoff=cutoff, main=main_Hz))
    return found


def low_pass(outcome: Outcome) -> str:
    """Returns which cutoffs take noise out of the estimates, and leave the swing of the motion in."""
    least_Hz = _ABOVE_MAIN * (outcome.main_Hz or 0.0)
    if least_Hz > 0.25 / outcome.recording.period_s:
        return _NO_LOW_PASS.format(main=outcome.main_Hz)
    return _LOW_PASS.format(**{name: max(cutoff, least_Hz) for name, cutoff in _CUTOFFS.items()})
