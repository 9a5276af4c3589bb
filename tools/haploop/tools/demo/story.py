"""Story of a swap in mid-contact: two verdicts, what the wall gave away and why, in words that follow from runs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from haploop.controller.dissipation import Element
from haploop.launch.runs import start
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.spec import RunFailed, RunSpec
from haploop.logger.cause import by_trial, cause
from haploop.logger.summary import Summary
from haploop.logger.verdict.measures import WINDOW_S
from haploop.protocol.amounts import amount
from haploop.protocol.scene.scene import ElementTable
from haploop.tools.figure.data import RunData

# By whether the loop is steady before and after the swap.
OUTCOME = {
    (False, True): "With {element} the same wall is steady.",
    (False, False): "With {element} the same wall is not steady.",
    (True, True): "The wall was steady before {element} came, and it is steady with it.",
    (True, False): "The wall was steady before {element} came, and it is not with it.",
}


@dataclass(frozen=True)
class Part:
    """The loop before or after the swap.

    Attributes:
        summary: of the run up to the end of this part, with its verdict.
        swing_m, force_swing_N: of position and commanded force over the last half second, peak to peak.
    """

    summary: Summary
    swing_m: float
    force_swing_N: float

    @property
    def verdict(self) -> str:
        return self.summary["verdict"]

    @property
    def provisos(self) -> list[str]:
        """What the verdict rests on."""
        return self.summary.get("stability", {}).get("provisos", [])

    @property
    def frequency_Hz(self) -> float | None:
        """Frequency of the swing that remains; None where none does, or the loop was not judged."""
        found: dict[str, Any] = self.summary.get("stability", {})
        remains = (found.get("width_m") or 0.0) >= 1e-9
        return found.get("frequency_Hz") or None if remains else None

    def rows(self) -> list[tuple[str, str]]:
        """Returns name and value of everything to be compared."""
        return [
            ("verdict", self.verdict),
            ("condition", "; ".join(self.provisos) or "–"),
            ("position swings by", amount(self.swing_m, "m")),
            ("force swings by", amount(self.force_swing_N, "N")),
            ("at", amount(self.frequency_Hz, "Hz")),
        ]


@dataclass(frozen=True)
class Story:
    """One run with a swap, and the loops before and after it.

    Attributes:
        data: the run, with its log.
        at_s: time of the swap.
        element: the element that was swapped in, with its parameters.
    """

    data: RunData
    at_s: float
    element: str
    before: Part
    after: Part

    def parts(self) -> tuple[tuple[str, Part], tuple[str, Part]]:
        """Returns either side of the swap by its name."""
        return ("before", self.before), ("after", self.after)

    def why(self) -> str:
        """Returns the likely cause of the swing before the swap, and where its energy is from, as sentences."""
        tried = by_trial(self.before.summary["stability"].get("without"))
        books = cause(self.before.summary["energy"], f"Up to {self.at_s:g} s")
        return f"Likely cause: {tried} {books}" if tried else books

    def outcome(self) -> str:
        """Returns what the swap did, as a sentence."""
        steady = self.before.verdict == "steady", self.after.verdict == "steady"
        provisos = f" Condition: {', '.join(self.after.provisos)}." if self.after.provisos else ""
        return OUTCOME[steady].format(element=self.element) + provisos


def tell(spec: RunSpec) -> Story:
    """Runs a scene with one swap as processes, and judges its loop before and after.

    Args:
        spec: a run that is laid out, whose scene's first event is the swap of an element.

    Raises:
        OutputError, RunFailed, LogError: as ``haploop.launch.runs.start.run``.
    """
    event = spec.scene.event[0]
    assert event.swap is not None
    after = start.run(spec)
    if after["ended"] != "done":
        raise RunFailed(f"The run did not reach its end: {after['ended']}.")
    before = run_in_process(replace(spec.scene, event=(), duration=event.at), spec.kinds, causes=True)
    data = RunData.from_directory(spec.out)
    parts = _part(before, data, event.at), _part(after, data, data.span_s[1])
    return Story(data, event.at, _named(event.swap, spec.kinds[event.swap.name]), *parts)


def _named(element: ElementTable, kind: type[Element]) -> str:
    """Returns an element's kind and its numbers with their units."""
    units = {name: quantity.unit for name, (quantity, _) in kind.parameters().items()}
    numbers = [f"{value:g} {units[name]}".rstrip() for name, value in element.parameters.items()]
    return f"{element.name} of {', '.join(numbers)}" if numbers else element.name


def _part(summary: Summary, data: RunData, end_s: float) -> Part:
    inside = (data.ticks_s >= end_s - WINDOW_S) & (data.ticks_s < end_s)
    swing_m = summary["window"]["oscillation_m"] or 0.0
    return Part(summary, swing_m, float(np.ptp(data.controller["total"][inside])) if inside.any() else 0.0)
