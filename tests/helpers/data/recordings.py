"""Recordings made in the tests: text files of motions with known energies, and the outcomes of booking them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from haploop.tools.dissipate.booking import Booking
from haploop.tools.dissipate.command import Request, Selection, compute_outcome, make_scene_for_text
from haploop.tools.dissipate.outcome import Outcome
from haploop.tools.dissipate.recording.samples import Floats, Samples
from haploop.tools.dissipate.recording.text_recording import Layout
from helpers.scenes.least import KINDS

PERIOD_S = 1e-3
# A swing of 2 mm at 15 Hz: times, s, and positions, m.
T = np.arange(200) * PERIOD_S
X = 2e-3 * np.sin(2.0 * np.pi * 15.0 * T)


def write(path: Path, columns: Mapping[str, Any], mark: str = ",") -> Path:
    """A text file of these columns, every number exact."""
    rows = [mark.join(columns), *(mark.join(map(repr, map(float, row))) for row in zip(*columns.values(), strict=True))]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def outcome(path: Path, *, delay_s: float | None = None, layout: Layout | None = None, **selection: Any) -> Outcome:
    """Books a recording and returns the outcome."""
    return compute_outcome(Request(path, Selection(**selection), layout or Layout(), delay_s), KINDS)


def true_J(path: Path, layout: Layout | None = None) -> float:
    """The energy that 2.7 N s/m of damping would have taken."""
    return outcome(path, layout=layout, dampings=["2.7"]).elements[0].true_J


def booking(
    delay_s: float, *, recorded: frozenset[str] = frozenset(), period_s: float = PERIOD_S, **selection: Any
) -> Booking:
    """The booking of elements on samples that are passed to it."""
    scene = make_scene_for_text(Selection(**selection), Path("made.csv"), period_s, recorded, KINDS)
    return Booking(scene, period_s, delay_s, KINDS, recorded)


def samples(x: Floats, begins: bool = True, first: int = 0, **more: Any) -> Samples:
    """Positions a period apart."""
    t = np.arange(first, first + len(x), dtype=float) * PERIOD_S
    more = {"v_m_s": None, "a_m_s2": None, "between_x_m": None} | more
    return Samples(t_s=t, x_m=x, true_x_m=x, begins=begins, **more)
