"""The outcome: numbers of every element, and notes on the recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from haploop.controller.dissipation import Element, Quantity
from haploop.logger.verdict.spectrum import Line
from haploop.protocol.amounts import amount
from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.tools.dissipate.booking import Booking
from haploop.tools.dissipate.force_book import Passivity
from haploop.tools.dissipate.recording.samples import Floats, LogRecording
from haploop.tools.dissipate.recording.text_recording import TextRecording
from haploop.tools.dissipate.swing.buzz import Buzz, Overtone, Several, Word
from haploop.tools.dissipate.swing.finder import BuzzFinder
from haploop.tools.dissipate.swing.hidden import Hidden
from haploop.tools.dissipate.trace import Trace

# Both have a name, the control period and the delay of the forces in s, ``between`` (what the motion between samples is
# taken from), ``recorded`` (which of "velocity" and "acceleration" are not estimated), ``has_force``, and notes, which
# are complete once all samples have been read.
Recording = LogRecording | TextRecording
# Where no element is named, the available ones are tried at the sizes that give this largest force.
EQUAL_N = 0.1
# Share of the terms of a sum that rounding leaves over where they cancel.
_ROUNDING = 1e-12
# Lines closer than this are the same.
_SAME_HZ = 1.0


@dataclass(frozen=True)
class ElementOutcome:
    """The numbers of one element.

    Attributes:
        label: kind and parameters in short: "damping 2.7 N s/m", "my element (mass 1.80 g, damping 0.1 N s/m)".
        sampled_J, true_J: its books at the end; positive: taken out of the device.
        taken_J, given_J: energy taken in the periods in which it dissipates, and given back in the others (true books).
        fast_share: share of its mean square force that is faster than a quarter of the sampling rate, see ``Booking``.
        noisier_J: its true book on the positions with as much noise added as they have; None where velocity or
            acceleration was recorded.
    """

    kind: str
    parameters: dict[str, float | str]
    label: str
    sampled_J: float
    true_J: float
    taken_J: float
    given_J: float
    strongest_N: float
    fast_share: float
    noisier_J: float | None = None

    @property
    def is_fast(self) -> bool:
        """Tells whether more of its force is fast than a buzz at 0.15 of the sampling rate would cause."""
        return self.fast_share > 0.2

    @property
    def is_moved_by_noise(self) -> bool:
        """Tells whether noise of the positions changes its energy by more than a tenth, as far as that is known."""
        return self.noisier_J is not None and abs(self.noisier_J - self.true_J) > 0.1 * abs(self.true_J)


@dataclass(frozen=True)
class ForceOutcome:
    """The work of a recorded force, positive where it was taken out of the device.

    Attributes:
        books: like those of an element.
        naive_J: the sum -F v T over the same samples.
        excess_J: the most that it gave out beyond what it had taken.
        pushes_back: whether it pushes back, as a wall's does, or pulls further in; None where neither is seen. A force
            in a log is known to push back.
    """

    books: ElementOutcome
    naive_J: float
    passivity: Passivity
    excess_J: float
    pushes_back: bool | None = None

    @property
    def sign_is_known(self) -> bool:
        """Tells whether nothing suggests the other sign."""
        return self.pushes_back is not False and self.passivity != "other sign"

    def as_data(self) -> dict[str, Any]:
        entries = asdict(self)
        return entries.pop("books") | entries | {"work_on_device_J": -self.books.true_J}


@dataclass(frozen=True)
class Outcome:
    """The outcome of the elements on a recording, in the order of their selection, with the controller's scene.

    Attributes:
        force: outcome of a recorded force; None where there was none.
        noise_m: noise of the recorded positions; None where velocity or acceleration was recorded beside them.
        buzz_word, buzz: whether the recording buzzes, and the buzz.
        slow: the widest line of a slower motion; None without one.
        tried: where no element was named, the available ones at sizes of equal largest force, ``EQUAL_N``, best first.
        left_out: a line that was taken for the shape of a slower motion, where no buzz was seen.
        several: swings at several frequencies at once, where there was no buzz at a single one.
        fast_rms_m: r.m.s. motion above 15 Hz that lasts a second or more.
        short_s: total length of the parts between gaps that were too short for a buzz to be seen in them.
        hidden: a swing within the counts of the positions, because of which it cannot be said whether the recording
            buzzes.
        slower: a swing at one frequency from some 3 Hz up to that of a buzz, where there were not several.
    """

    recording: Recording
    elements: list[ElementOutcome]
    trace: Trace
    scene: Scene
    force: ForceOutcome | None
    noise_m: float | None
    buzz_word: Word
    buzz: Buzz | None
    slow: Line | None
    left_out: Overtone | None = None
    several: Several | None = None
    slower: Buzz | None = None
    fast_rms_m: float = 0.0
    short_s: float = 0.0
    hidden: Hidden | None = None
    tried: tuple[ElementOutcome, ...] = ()

    @property
    def main_Hz(self) -> float | None:
        """Returns the frequency of the buzz, of the widest of several, or of a slower motion; None without any."""
        if self.several:
            return self.several.lines[0][0]
        line = self.buzz or self.slower or self.slow
        return line.frequency_Hz if line else None

    @property
    def span_s(self) -> tuple[float, float]:
        times = self.trace.lines()[0]
        return float(times[0]), float(times[-1])

    @property
    def books_agree(self) -> bool:
        """Tells whether sampled and true books agree, as without delay and with positions that are not rounded."""
        return all(
            abs(element.true_J - element.sampled_J) <= _ROUNDING * (element.taken_J + element.given_J)
            for element in self.elements
        )

    def as_data(self) -> dict[str, Any]:
        """Returns everything but the trace, for JSON."""
        recording, (from_s, to_s) = self.recording, self.span_s
        notes = asdict(recording.notes)
        return {
            "recording": recording.name,
            "from_s": from_s,
            "to_s": to_s,
            "rate_Hz": 1.0 / recording.period_s,
            "delay_s": recording.delay_s,
            "between_samples": recording.between,
            "recorded": sorted(recording.recorded),
            "noise_m": self.noise_m,
            "buzz_word": self.buzz_word,
            "buzz": _buzz_data(self.buzz),
            "several": self.several and self.several._asdict(),
            "slower": _buzz_data(self.slower),
            "fast_rms_m": self.fast_rms_m,
            "hidden": self.hidden and self.hidden._asdict(),
            "left_out": self.left_out and self.left_out.line._asdict() | {"slower_Hz": self.left_out.slower_Hz},
            "main_Hz": self.main_Hz,
            "samples": notes.pop("rows"),
            **notes,
            "times_may_be_wrong": recording.notes.is_uneven,
            "elements": [asdict(element) for element in self.elements],
            "tried": [asdict(element) for element in self.tried],
            "force": self.force and self.force.as_data(),
        }


def _buzz_data(buzz: Buzz | None) -> dict[str, Any] | None:
    """Returns a buzz for JSON, with one table per span."""
    if not buzz:
        return None
    spans = [span._asdict() for span in buzz.spans]
    return asdict(buzz) | {"stretches": buzz.stretches, "spans": spans, "fed_J": buzz.fed_J}


def make_outcome(
    recording: Recording,
    booking: Booking,
    trace: Trace,
    scene: Scene,
    kinds: Mapping[str, type[Element]],
    noisier: tuple[float, Floats] | None,
    found: BuzzFinder,
) -> Outcome:
    """Makes the outcome; ``noisier``: the noise of the positions, m, and the true books with as much noise added."""
    noise_m, noisier_J = (noisier[0], noisier[1].tolist()) if noisier else (None, [None] * len(scene.dissipation))
    columns = (
        booking.sampled_J,
        booking.true_J,
        booking.taken_J,
        booking.given_J,
        booking.strongest_N,
        booking.fast_share,
    )
    books = np.array(columns).T.tolist()
    elements = [
        ElementOutcome(
            table.name,
            {"acts": table.acts, **table.parameters},
            _label(table, kinds[table.name].parameters()),
            *row,
            noisier_J=again,
        )
        for table, row, again in zip(scene.dissipation, books, noisier_J, strict=False)
    ]
    force, buzz = None, found.buzz()
    several = None if buzz else found.several()
    if of := booking.force:
        own = ElementOutcome("recorded-force", {}, "recorded force", *books[-1])
        # The sign of a force in a log is known.
        pushes_back = isinstance(recording, LogRecording) or booking.force_sign.pushes_back
        word: Passivity = "generated" if of.passivity == "other sign" and pushes_back else of.passivity
        # Energy that the contact stored before hides what the force gives to a buzz.
        word = "fed the buzz" if word == "passive" and buzz and buzz.is_fed else word
        force = ForceOutcome(own, of.naive_J, word, of.excess_J, pushes_back)
    return Outcome(
        recording,
        elements,
        trace,
        scene,
        force,
        noise_m,
        found.word(),
        buzz,
        found.slow,
        None if buzz or several else found.overtone(),
        several,
        None if several or not found.slower else _apart(found.slower.buzz(), buzz),
        found.fast_rms_m(),
        found.short_s,
        None if buzz or several else found.hidden.found,
    )


def _apart(slower: Buzz | None, buzz: Buzz | None) -> Buzz | None:
    """Returns the slower swing; None where it is the buzz itself, at the border that both bands share."""
    is_same = slower and buzz and abs(slower.frequency_Hz - buzz.frequency_Hz) < _SAME_HZ
    return None if is_same else slower


def make_tried(booking: Booking, scene: Scene, kinds: Mapping[str, type[Element]]) -> list[ElementOutcome]:
    """Makes the outcomes of elements at the sizes at which their largest force is ``EQUAL_N``; none without a force.

    Forces are proportional to the one parameter of each element, and so are the energies, which were booked at a size
    of 1.
    """
    tried = []
    for row, table in enumerate(scene.dissipation):
        [name] = table.parameters
        strongest_N = float(booking.strongest_N[row])
        if not strongest_N:
            continue
        size = EQUAL_N / strongest_N
        sized = replace(table, parameters={name: float(f"{size:.3g}")})
        label = _label(sized, kinds[table.name].parameters())
        sampled_J, true_J, taken_J, given_J = (
            size * float(of[row]) for of in (booking.sampled_J, booking.true_J, booking.taken_J, booking.given_J)
        )
        fast_share, entries = float(booking.fast_share[row]), {"acts": table.acts, **sized.parameters}
        tried.append(
            ElementOutcome(table.name, entries, label, sampled_J, true_J, taken_J, given_J, EQUAL_N, fast_share)
        )
    return sorted(tried, key=lambda element: -element.true_J)


def _label(table: ElementTable, declared: Mapping[str, tuple[Quantity, object]]) -> str:
    words = []
    for name, (quantity, _) in declared.items():
        value = table.parameters[name]
        number = amount(1e3 * value, "g") if quantity.unit == "kg" else quantity.text(value)
        words.append(number if len(declared) == 1 else f"{name} {number}")
    kind = table.name.replace("-", " ")
    return " ".join([kind, *words]) if len(words) < 2 else f"{kind} ({', '.join(words)})"
