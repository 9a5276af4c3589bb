"""What came of it: numbers of every element, and what is to be known of the recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from haploop.tools.dissipate.booking import Booking
from haploop.tools.dissipate.course import Course
from haploop.tools.dissipate.samples import Notes, Recording
from haploop.tools.render.units import amount

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# The terms of a sum that cancel leave so much of them.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class ElementOutcome:
    """What an element would have done.

    Attributes:
        kind, parameters: as in a scene.
        label: both, in short.
        sampled_J, true_J: its books at the end; positive: taken out of the device.
        taken_J, given_J: what it took in the periods in which it took, and gave back in the others (true).
        strongest_N: its largest force.
    """

    kind: str
    parameters: dict[str, Any]
    label: str
    sampled_J: float
    true_J: float
    taken_J: float
    given_J: float
    strongest_N: float


@dataclass(frozen=True)
class Outcome:
    """The whole.

    Attributes:
        name: of the recording.
        period_s, delay_s: control period, and age of a force when it acts.
        between: how the motion between samples is known: "plant steps" or "straight lines".
        recorded: which of velocity and acceleration were recorded.
        elements: in the order in which they were asked for.
        notes: what was found in the recording.
        course: for the figure.
        setting: the resolved scene of the controller.
    """

    name: str
    period_s: float
    delay_s: float
    between: str
    recorded: list[str]
    elements: list[ElementOutcome]
    notes: Notes
    course: Course
    setting: dict[str, Any]

    @property
    def span_s(self) -> tuple[float, float]:
        """From the first sample to the last."""
        times = self.course.lines()[0]
        return float(times[0]), float(times[-1])

    @property
    def books_agree(self) -> bool:
        """Whether the sampled books tell the truth: they do where forces act at once and positions are not rounded."""
        return all(
            abs(element.true_J - element.sampled_J) <= _ROUNDING * (element.taken_J + element.given_J)
            for element in self.elements
        )

    def as_data(self) -> dict[str, Any]:
        """Everything but the course, for JSON."""
        from_s, to_s = self.span_s
        notes = asdict(self.notes)
        return {
            "recording": self.name,
            "from_s": from_s,
            "to_s": to_s,
            "rate_Hz": 1.0 / self.period_s,
            "delay_s": self.delay_s,
            "between_samples": self.between,
            "recorded": self.recorded,
            "samples": notes.pop("rows"),
            **notes,
            "elements": [asdict(element) for element in self.elements],
        }


def outcome_of(
    recording: Recording, booking: Booking, course: Course, setting: dict[str, Any], kinds: Mapping[str, type[Element]]
) -> Outcome:
    """Gather the numbers once all samples are booked."""
    elements = []
    for index, table in enumerate(setting["dissipation"]):
        parameters = {key: value for key, value in table.items() if key != "kind"}
        numbers = (booking.sampled_J, booking.true_J, booking.taken_J, booking.given_J, booking.strongest_N)
        label = label_of(table, kinds)
        elements.append(ElementOutcome(table["kind"], parameters, label, *(float(of[index]) for of in numbers)))
    return Outcome(
        recording.name,
        recording.period_s,
        recording.delay_s,
        recording.between,
        sorted(recording.recorded),
        elements,
        recording.notes,
        course,
        setting,
    )


def label_of(table: dict[str, Any], kinds: Mapping[str, type[Element]]) -> str:
    """Kind and parameters with their units: "damping 2.7 N s/m", "my element (mass 1.80 g, damping 0.1 N s/m)"."""
    declared = kinds[table["kind"]].parameters()
    values = [_in_words(name, table[name], quantity.unit, len(declared)) for name, (quantity, _) in declared.items()]
    name = table["kind"].replace("-", " ")
    return " ".join([name, *values]) if len(values) < 2 else f"{name} ({', '.join(values)})"


def _in_words(name: str, value: float, unit: str, parameters: int) -> str:
    words = amount(1e3 * value, "g") if unit == "kg" else f"{value:g} {unit}".rstrip()
    return words if parameters == 1 else f"{name} {words}"


def in_words(outcome: Outcome) -> list[str]:
    """What is to be known of the recording and of how it was booked, a sentence each."""
    notes, (from_s, to_s) = outcome.notes, outcome.span_s
    rate = 1.0 / outcome.period_s
    sentences = [f"{notes.rows} samples at {rate:.6g} Hz, {from_s:g} to {to_s:g} s."]
    estimated = [name for name in ("velocity", "acceleration") if name not in outcome.recorded]
    taken = " and ".join(outcome.recorded)
    sentences.append((f"Taken as recorded: {taken}. " if taken else "") + _estimates(outcome.setting, estimated))
    sentences.append(_truth(outcome))
    if notes.gaps:
        sentences.append(
            f"{notes.gaps} gap{'s' * (notes.gaps != 1)} of {amount(notes.missing_s, 's')} in all: what happened there "
            "is not booked, and estimates begin anew after."
        )
    if notes.unusable_rows:
        sentences.append(f"Rows left out, since a number in them is missing or not finite: {notes.unusable_rows}.")
    if notes.uneven:
        sentences.append(
            f"{notes.uneven} periods are more than a tenth off the others; estimates take them for equal, as a "
            "controller does that counts its ticks."
        )
    return [sentence for sentence in [*sentences, *notes.remarks] if sentence]


def _estimates(setting: dict[str, Any], names: list[str]) -> str:
    words = []
    for name in names:
        table = setting.get(name, {})
        source = table.get("source", "encoder")
        how = table.get("estimator") or ("backward difference" if source == "encoder" else source)
        cutoff = f", low-passed at {table['cutoff']:g} Hz" if "cutoff" in table else ""
        words.append(f"{name} by {how}{cutoff}")
    return f"Estimated: {'; '.join(words)}." if words else ""


def _truth(outcome: Outcome) -> str:
    """What the true books rest on."""
    delay = f"{amount(outcome.delay_s, 's')} after their sample" if outcome.delay_s else "at once"
    if outcome.between == "plant steps":
        return f"True books: forces that act {delay}, over every step of the plant."
    if outcome.books_agree:
        return f"True books: forces that act {delay} on the recorded positions; they agree with the sampled ones."
    return f"True books: forces that act {delay}, the device on straight lines between the samples."
