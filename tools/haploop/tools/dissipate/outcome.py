"""The outcome: numbers of every element, notes on the recording, and a trace of the books for a figure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.tools.dissipate.booking import Booked, Booking
from haploop.tools.dissipate.samples import Floats, Notes, Recording
from haploop.tools.render.units import amount
from haploop.view.store.lod_level import extremes

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# Points above which the trace is decimated.
_MOST = 8192
# Length of the detail, s.
_CLOSE_S = 0.1
# The terms of a sum that cancel leave so much of them.
_ROUNDING = 1e-12


class Trace:
    """Keeps the books of a recording of any length in bounded memory, decimated with their extremes kept.

    Attributes:
        close: in full, the interval in which most energy was given back, rows like those of ``lines``; None before
            anything is given back.
    """

    def __init__(self, period_s: float) -> None:
        self._span = max(8, round(_CLOSE_S / period_s))
        self._group, self._points, self._left = 1, np.empty((0, 0)), np.empty((0, 0))
        self._open = np.empty((0, 0))
        self._most_given_J = 0.0
        self.close: Floats | None = None

    def add(self, booked: Booked) -> None:
        """Takes the books at more samples."""
        rows = np.vstack([booked.t_s, booked.x_m, booked.sampled_J, booked.true_J])
        self._keep(rows)
        self._look_closely(rows, -np.minimum(booked.added_J, 0.0).sum(axis=0))

    def lines(self) -> Floats:
        """Returns t, x, and the sampled and the true books of every element, shape (rows, points)."""
        return np.hstack([self._points, self._left]) if self._points.size else self._left

    def _keep(self, rows: Floats) -> None:
        left = np.hstack([self._left, rows]) if self._left.size else rows
        whole = left.shape[1] - left.shape[1] % self._group
        done = left[:, :whole] if self._group == 1 else extremes(left[:, :whole], self._group)
        self._left = left[:, whole:]
        self._points = np.hstack([self._points, done]) if self._points.size else done
        while self._points.shape[1] > _MOST:
            usable = self._points.shape[1] // 4 * 4
            thinned = extremes(self._points[:, :usable], 4)
            # What is left of a group of four are the newest points; they stay as they are.
            self._points = np.hstack([thinned, self._points[:, usable:]])
            self._group = max(4, 2 * self._group)

    def _look_closely(self, rows: Floats, given_J: Floats) -> None:
        """Compares intervals of equal length that overlap by half."""
        tagged = np.vstack([rows, given_J])
        waiting = np.hstack([self._open, tagged]) if self._open.size else tagged
        half = self._span // 2
        while waiting.shape[1] >= self._span:
            self._consider(waiting[:, : self._span])
            waiting = waiting[:, half:]
        self._open = waiting
        if self.close is None and waiting.shape[1]:
            self._consider(waiting)

    def _consider(self, stretch: Floats) -> None:
        given = float(stretch[-1].sum())
        if given > self._most_given_J:
            self._most_given_J, self.close = given, stretch[:-1].copy()


@dataclass(frozen=True)
class ElementOutcome:
    """The numbers of one element.

    Attributes:
        kind, parameters: as in a scene.
        label: both, in short.
        sampled_J, true_J: its books at the end; positive: taken out of the device.
        taken_J, given_J: energy taken in the periods in which it dissipates, and given back in the others (true books).
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
    """The outcome of all elements on one recording.

    Attributes:
        name: of the recording.
        period_s, delay_s: control period, and delay of the forces.
        between: what the motion between samples is taken from: "plant steps" or "straight lines".
        recorded: which of velocity and acceleration were recorded.
        elements: in the order in which they were selected.
        notes: on the recording.
        trace: for the figure.
        scene: the resolved scene of the controller.
    """

    name: str
    period_s: float
    delay_s: float
    between: str
    recorded: list[str]
    elements: list[ElementOutcome]
    notes: Notes
    trace: Trace
    scene: dict[str, Any]

    @property
    def span_s(self) -> tuple[float, float]:
        """Returns the times of the first and of the last sample."""
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


def make_outcome(
    recording: Recording, booking: Booking, trace: Trace, scene: dict[str, Any], kinds: Mapping[str, type[Element]]
) -> Outcome:
    """Makes the outcome once all samples are booked."""
    elements = []
    for index, table in enumerate(scene["dissipation"]):
        parameters = {key: value for key, value in table.items() if key != "kind"}
        numbers = (booking.sampled_J, booking.true_J, booking.taken_J, booking.given_J, booking.strongest_N)
        label = make_label(table, kinds)
        elements.append(ElementOutcome(table["kind"], parameters, label, *(float(of[index]) for of in numbers)))
    return Outcome(
        recording.name,
        recording.period_s,
        recording.delay_s,
        recording.between,
        sorted(recording.recorded),
        elements,
        recording.notes,
        trace,
        scene,
    )


def make_label(table: dict[str, Any], kinds: Mapping[str, type[Element]]) -> str:
    """Returns kind and parameters: "damping 2.7 N s/m", "my element (mass 1.80 g, damping 0.1 N s/m)"."""
    declared = kinds[table["kind"]].parameters()
    values = [
        _parameter_words(name, table[name], quantity.unit, len(declared)) for name, (quantity, _) in declared.items()
    ]
    name = table["kind"].replace("-", " ")
    return " ".join([name, *values]) if len(values) < 2 else f"{name} ({', '.join(values)})"


def _parameter_words(name: str, value: float, unit: str, parameters: int) -> str:
    words = amount(1e3 * value, "g") if unit == "kg" else f"{value:g} {unit}".rstrip()
    return words if parameters == 1 else f"{name} {words}"
