"""``haploop dissipate``: reads a recording, books the selected elements, prints a table and draws a figure."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path

from haploop.controller.dissipation import Element
from haploop.protocol.scene.scene import Scene
from haploop.tools.cli.options import FAILED, WRONG_USE, leave, plain_errors, print_json
from haploop.tools.cli.scenes import kinds_with
from haploop.tools.dissipate.booking import Booking
from haploop.tools.dissipate.controller_scene import Selection, make_scene_for_log, make_scene_for_text
from haploop.tools.dissipate.figure import make_figure
from haploop.tools.dissipate.outcome import Outcome, Recording, Trace, make_outcome
from haploop.tools.dissipate.report import make_report
from haploop.tools.dissipate.samples import LogRecording, RecordingError, read_scene
from haploop.tools.dissipate.text_recording import Layout, TextRecording
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.style import write_figure
from haploop.tools.render.terminal import console

_LONGEST_DELAY_S = 60.0


@dataclass(frozen=True)
class Request:
    """The arguments of the command line.

    Attributes:
        delay_s: delay of the forces; None for none, or for that of the run.
        out: file of the figure; beside the recording when None.
    """

    path: Path
    selection: Selection
    layout: Layout
    delay_s: float | None = None
    plugins: list[Path] = field(default_factory=list)
    out: Path | None = None


def dissipate(request: Request, as_json: bool) -> None:
    """Books, prints the table, draws the figure and names its file."""
    with plain_errors():
        try:
            outcome = compute_outcome(request, kinds_with(request.plugins))
        except (RecordingError, FileNotFoundError) as error:
            leave(str(error), WRONG_USE)
    figure = _draw(outcome, request)
    if as_json:
        print_json(outcome.as_data() | {"figure": str(figure) if figure else None})
        return

    console(stderr=True).print(make_report(outcome))
    if figure:
        print(figure)


def compute_outcome(request: Request, kinds: dict[str, type[Element]]) -> Outcome:
    """Returns what the elements would have taken out of the recorded motion.

    Raises:
        RecordingError, FileNotFoundError, LogError: the recording cannot be used.
        SceneError, ElementError: the selection is wrong.
    """

    recording, scene = _open(request, kinds)
    booking = Booking(scene, recording.period_s, recording.delay_s, kinds, recording.recorded, recording.has_force)
    trace = Trace(recording.period_s, 2 + 2 * len(scene.dissipation) + 3 * recording.has_force)
    end_x_m, shown = None, console(stderr=True)
    with shown.status(f"reading {request.path.name}") if shown.is_terminal else nullcontext() as line:
        for piece in recording.samples():
            trace.add(booking.add(piece))
            end_x_m = piece.end_x_m
            if line:
                line.update(f"{request.path.name}: booked to {piece.t_s[-1]:.6g} s")
    if end_x_m is not None:
        booking.finish(end_x_m)
    return make_outcome(recording, booking, trace, scene, kinds)


def _open(request: Request, kinds: dict[str, type[Element]]) -> tuple[Recording, Scene]:
    if request.delay_s is not None and not 0.0 <= request.delay_s <= _LONGEST_DELAY_S:
        raise RecordingError(f"The delay must be from 0 to {_LONGEST_DELAY_S:g} s, but is {request.delay_s:g} s.")
    path, selection = request.path, request.selection
    if path.is_dir() or path.suffix == ".mcap":
        if request.layout != Layout():
            raise RecordingError("A log has its own columns, times and units; columns are named for text files alone.")

        scene = read_scene(path)
        recording = LogRecording(path, scene, request.delay_s, selection.estimated_anew())
        return recording, make_scene_for_log(selection, path, scene, kinds)

    recording = TextRecording(path, request.layout, request.delay_s or 0.0)
    if not (selection.has_elements or recording.has_force):
        raise RecordingError(
            "Say which elements, --damping 2.7, --mass 0.0018, or --element KIND KEY=VALUE in quotes, "
            "or which column is a force with --force."
        )
    return recording, make_scene_for_text(selection, path, recording.period_s, recording.recorded, kinds)


def _draw(outcome: Outcome, request: Request) -> Path | None:
    path = request.path
    beside = path / "dissipate.png" if path.is_dir() else path.with_name(f"{path.stem}-dissipate.png")
    try:
        return write_figure(make_figure(outcome), request.out or beside)
    except FigureError as error:
        if request.out:
            leave(str(error), FAILED)
        print(f"No figure: {error}", file=sys.stderr)
        return None
