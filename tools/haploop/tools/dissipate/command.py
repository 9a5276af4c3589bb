"""``haploop dissipate``: a recording in, the books of the elements asked for out."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haploop.tools.cli.exit_codes import FAILED, WRONG_USE, leave, plain_errors, print_json
from haploop.tools.cli.scenes import kinds_with

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element
    from haploop.tools.dissipate.outcome import Outcome
    from haploop.tools.dissipate.setting import Asked
    from haploop.tools.dissipate.text_recording import Layout


_LONGEST_DELAY_S = 60.0


@dataclass(frozen=True)
class Request:
    """What the command line asks for.

    Attributes:
        path: a text file, a run's directory or its log.
        asked: elements, wall and estimates.
        layout: columns of a text file.
        delay_s: of the forces; None for none, or for a run's own.
        plugins: Python files with elements.
        out: the figure's file; beside the recording when None.
    """

    path: Path
    asked: Asked
    layout: Layout
    delay_s: float | None = None
    plugins: list[Path] = field(default_factory=list)
    out: Path | None = None


def dissipate(request: Request, as_json: bool) -> None:
    """Book, print the table, draw the figure and name its file."""
    from haploop.tools.dissipate.samples import RecordingError

    with plain_errors():
        try:
            outcome = dissipation_of(request, kinds_with(request.plugins))
        except (RecordingError, FileNotFoundError) as error:
            leave(str(error), WRONG_USE)
    figure = _draw(outcome, request)
    if as_json:
        print_json(outcome.as_data() | {"figure": str(figure) if figure else None})
        return
    from haploop.tools.dissipate.report import report
    from haploop.tools.render.terminal import console

    console(stderr=True).print(report(outcome))
    if figure:
        print(figure)


def dissipation_of(request: Request, kinds: dict[str, type[Element]]) -> Outcome:
    """What the elements would have taken out of the recorded motion.

    Raises:
        RecordingError, FileNotFoundError, LogError: the recording cannot be used.
        SceneError, ElementError: what is asked for is wrong.
    """
    from haploop.tools.dissipate.booking import Booking
    from haploop.tools.dissipate.course import Course
    from haploop.tools.dissipate.outcome import outcome_of

    recording, setting = _open(request, kinds)
    booking = Booking(setting, recording.period_s, recording.delay_s, kinds, recording.recorded)
    course = Course(recording.period_s)
    end_x_m = None
    with _shown(request.path.name) as show:
        for piece in recording.samples():
            course.add(booking.add(piece))
            end_x_m = piece.end_x_m
            show(float(piece.t_s[-1]))
    if end_x_m is not None:
        booking.finish(end_x_m)
    return outcome_of(recording, booking, course, setting, kinds)


def _open(request: Request, kinds: dict[str, type[Element]]) -> tuple[Any, dict[str, Any]]:
    """The recording and the controller's scene."""
    from haploop.tools.dissipate.samples import RecordingError
    from haploop.tools.dissipate.setting import holds_readings, setting_of_log, setting_of_text
    from haploop.tools.dissipate.text_recording import Layout, TextRecording

    if request.delay_s is not None and not 0.0 <= request.delay_s <= _LONGEST_DELAY_S:
        raise RecordingError(f"The delay must be from 0 to {_LONGEST_DELAY_S:g} s, but is {request.delay_s:g} s.")
    if _is_log(request.path):
        if request.layout != Layout():
            raise RecordingError("A log has its own columns, times and units; columns are named for text files alone.")
        from haploop.tools.dissipate.log_recording import LogRecording, scene_of_log

        scene = scene_of_log(request.path)
        estimated = request.asked.estimated_anew()
        recording = LogRecording(request.path, scene, request.delay_s, estimated, holds_readings(scene))
        return recording, setting_of_log(request.asked, request.path, scene, kinds)

    recording = TextRecording(request.path, request.layout, request.delay_s or 0.0)
    return recording, setting_of_text(request.asked, request.path, recording.period_s, recording.recorded, kinds)


@contextlib.contextmanager
def _shown(name: str) -> Iterator[Callable[[float], None]]:
    """On a terminal, a line that tells how far the recording is booked, fed with its time in s."""
    from haploop.tools.render.terminal import console

    shown = console(stderr=True)
    if not shown.is_terminal:
        yield lambda _to_s: None
        return
    with shown.status(f"reading {name}") as line:
        yield lambda to_s: line.update(f"{name}: booked to {to_s:.6g} s")


def _is_log(path: Path) -> bool:
    return path.is_dir() or path.suffix == ".mcap"


def _draw(outcome: Outcome, request: Request) -> Path | None:
    """The figure's file; None, and a word on it, where there is no matplotlib."""
    from haploop.tools.dissipate.figure import figure_of
    from haploop.tools.figure.data import FigureError
    from haploop.tools.figure.style import write_figure

    path = request.path
    beside = path / "dissipate.png" if path.is_dir() else path.with_name(f"{path.stem}-dissipate.png")
    try:
        return write_figure(figure_of(outcome), request.out or beside)
    except FigureError as error:
        if request.out:
            leave(str(error), FAILED)
        print(f"No figure: {error}", file=sys.stderr)
        return None
