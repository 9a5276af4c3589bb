"""``haploop dissipate``: reads a recording, makes the controller that works on it, books energy, prints and draws."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from haploop.controller.dissipation import Element
from haploop.launch.runs.run_files import holds_readings
from haploop.launch.scene.file import resolved
from haploop.launch.scene.reading.delimited import RecordingError
from haploop.launch.scene.reading.layers import Layers, key_path
from haploop.protocol.scene.scene import Clock, Device, Scene, accelerometer_is_used
from haploop.tools.command.given import kinds_with
from haploop.tools.command.options import FAILED, WRONG_USE, leave, parse_assignments, plain_errors, print_json
from haploop.tools.dissipate.booking import Booking
from haploop.tools.dissipate.figure import make_figure
from haploop.tools.dissipate.outcome import Outcome, Recording, make_outcome, make_tried
from haploop.tools.dissipate.recording.position_noise import PositionNoise
from haploop.tools.dissipate.recording.samples import LogRecording, read_scene
from haploop.tools.dissipate.recording.text_recording import Layout, TextRecording
from haploop.tools.dissipate.report import make_report
from haploop.tools.dissipate.swing.finder import BuzzFinder
from haploop.tools.dissipate.trace import Trace
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.style import write_figure
from haploop.tools.render.terminal import console

_A_SCENE = "{} is a scene or a sweep, not a recording: give a table of numbers as text, or the directory of a run."
_OWN_COLUMNS = (
    "A log has its own columns, times, units and force: leave out the options that name them, which are for text files."
)
_LONGEST_DELAY_S = 60.0
Kinds = Mapping[str, "type[Element]"]
# Tables that can be overridden; [encoder] tells the estimators to which step the positions were rounded.
_ESTIMATES = ("velocity", "acceleration", "encoder")
_ESTIMATED = frozenset({"velocity", "acceleration"})


@dataclass(frozen=True)
class Selection:
    """The elements to be booked, and how the controller sees the motion.

    Attributes:
        dampings, masses: of damping, and of bi- and unidirectional inertia; numbers in SI units or text with a unit.
        elements: others, each as "KIND KEY=VALUE ...".
        wall, occupies: position of a wall, and the side of it on which the elements act; without one they always act.
        overrides: ``KEY=VALUE`` for ``[velocity]``, ``[acceleration]`` and ``[encoder]``.
    """

    dampings: Sequence[str] = ()
    masses: Sequence[str] = ()
    elements: Sequence[str] = ()
    wall: str | None = None
    occupies: str = "below"
    overrides: Sequence[str] = ()

    def tables(self) -> frozenset[str]:
        """Returns the tables that the overrides change; raises RecordingError where one is for another table."""
        found = set()
        for text in self.overrides:
            table = (key_path(text.partition("=")[0]) or [text])[0]
            if table not in _ESTIMATES:
                raise RecordingError(
                    f"--set {text} has no meaning here: a recorded motion does not change. "
                    "Only keys of [velocity], [acceleration] and [encoder] can be set."
                )
            found.add(table)
        return frozenset(found)

    def estimated_anew(self) -> frozenset[str]:
        """Returns which of "velocity" and "acceleration" the overrides change, directly or by their source."""
        return _ESTIMATED if self.tables() - {"acceleration"} else _ESTIMATED & self.tables()


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
    """Books the energy, prints the table, draws the figure and prints the name of its file."""
    with plain_errors():
        try:
            outcome = compute_outcome(request, kinds_with(request.plugins))
        except (RecordingError, FileNotFoundError) as error:
            leave(str(error), WRONG_USE)
    figure = _draw(outcome, request)
    if as_json:
        print_json(outcome.as_data() | {"figure": str(figure) if figure else None})
        return

    console().print(make_report(outcome))
    if figure:
        print(figure)


def compute_outcome(request: Request, kinds: dict[str, type[Element]]) -> Outcome:
    """Returns what the elements would have taken out of the recorded motion.

    Raises:
        RecordingError, FileNotFoundError, LogError: the recording cannot be used.
        SceneError, ElementError: the selection is wrong.
    """

    recording, scene = _open(request, kinds)
    for kind in (table.name for table in scene.dissipation):
        if set(kinds[kind].asks) - {"way"}:
            raise RecordingError(
                f"The element {kind} depends on forces and energies of its loop, which a recorded motion does not "
                "have; with them the motion would have been different. Run it in a scene: haploop run."
            )
    makings = scene, recording.period_s, recording.delay_s, kinds, recording.recorded, recording.has_force
    booking, noisier = Booking(*makings), Booking(*makings)
    # For positions alone: a velocity or acceleration recorded beside them does not depend on their noise.
    noise = PositionNoise() if isinstance(recording, TextRecording) and not recording.recorded else None
    all_of = None if scene.dissipation else _scene_of_all(request, scene, kinds)
    trying = Booking(all_of, *makings[1:-1]) if all_of else None
    found = BuzzFinder(recording.period_s, recording.delay_s)
    trace = Trace(recording.period_s, 2 + 2 * len(scene.dissipation) + 3 * recording.has_force)
    end_x_m, shown = None, console(stderr=True)
    with shown.status(f"reading {request.path.name}") if shown.is_terminal else nullcontext() as line:
        for piece in recording.samples():
            trace.add(booking.add(piece))
            found.add(piece)
            if trying:
                trying.add(piece)
            if noise:
                noisier.add(noise.added_to(piece))
            end_x_m = piece.end_x_m
            if line:
                line.update(f"{request.path.name}: booked to {piece.t_s[-1]:.6g} s")
    if end_x_m is not None:
        booking.finish(end_x_m)
    noisy = noise and (noise.deviation_m, noisier.true_J)
    outcome = make_outcome(recording, booking, trace, scene, kinds, noisy, found)
    return replace(outcome, tried=tuple(make_tried(trying, all_of, kinds))) if trying and all_of else outcome


def _scene_of_all(request: Request, scene: Scene, kinds: dict[str, type[Element]]) -> Scene | None:
    """Returns the scene with every element that acts on a recorded motion, at a size of 1; None where it is refused."""
    inward = ["unidirectional-damping damping=1"] if scene.wall else []
    selection = replace(request.selection, dampings=["1"], masses=["1"], elements=inward)
    with suppress(RecordingError):
        return _open(replace(request, selection=selection), kinds)[1]
    return None


def _open(request: Request, kinds: dict[str, type[Element]]) -> tuple[Recording, Scene]:
    if request.delay_s is not None and not 0.0 <= request.delay_s <= _LONGEST_DELAY_S:
        raise RecordingError(f"The delay must be from 0 to {_LONGEST_DELAY_S:g} s, but is {request.delay_s:g} s.")
    path, selection = request.path, request.selection
    if path.is_dir() or path.suffix == ".mcap":
        if request.layout != Layout():
            raise RecordingError(_OWN_COLUMNS)

        scene = read_scene(path)
        recording = LogRecording(path, scene, request.delay_s, selection.estimated_anew())
        return recording, make_scene_for_log(selection, path, scene, kinds)

    if path.suffix == ".toml":
        raise RecordingError(_A_SCENE.format(path))
    recording = TextRecording(path, request.layout, request.delay_s or 0.0)
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


def make_scene_for_text(
    selection: Selection, path: Path, period_s: float, recorded: frozenset[str], kinds: Kinds
) -> Scene:
    """Makes the scene for a recording in a text file.

    Raises RecordingError where the selection does not fit it, SceneError where a number or a kind is wrong.
    """
    if clash := sorted(selection.tables() & recorded):
        raise RecordingError(f"Give either a column of the {clash[0]} or --set for its estimate, not both.")
    rate = max(1, round(1.0 / period_s))
    clock, device = Clock(plant_rate=rate, control_rate=rate), Device(mass=1.0, damping=0.0)
    bare = Scene(title=path.stem, duration=1.0 / rate, clock=clock, device=device)
    made = _make_scene(bare, selection, path, kinds)
    if accelerometer_is_used(made) and "acceleration" not in recorded:
        raise RecordingError("The estimates read an accelerometer; say with --acceleration which column that is.")
    return made


def make_scene_for_log(selection: Selection, path: Path, scene: Scene, kinds: Kinds) -> Scene:
    """Makes the scene for a run's log: its own estimators, wall and events of the wall unless others are selected.

    Raises RecordingError where the selection does not fit it, SceneError where a number or a kind is wrong.
    """
    kept = ("title", "duration", "clock", "device", "encoder", "noise", "accelerometer", *_ESTIMATED, "wall")
    made = _make_scene(Scene(**{key: getattr(scene, key) for key in kept}), selection, path, kinds)
    if selection.overrides and accelerometer_is_used(made) and not holds_readings(scene):
        raise RecordingError("The estimates read an accelerometer, but its readings are not in the log.")
    walls = tuple(event for event in scene.event if any(key.startswith("wall.") for key in event.set or ()))
    return replace(made, event=() if selection.wall else walls)


def _make_scene(bare: Scene, selection: Selection, path: Path, kinds: Kinds) -> Scene:
    """Resolves a scene with the selected wall, elements and estimates, worded as they were given."""
    layers = Layers(path, bare.as_dict())
    if selection.wall is not None:
        wall = {"position": _value(selection.wall), "stiffness": 0.0, "occupies": selection.occupies}
        layers.data["wall"] = wall
    elements = [{"kind": "damping", "damping": _value(text)} for text in selection.dampings]
    for kind in ("bidirectional-inertia", "unidirectional-inertia"):
        elements += [{"kind": kind, "mass": _value(text)} for text in selection.masses]
    for text in selection.elements:
        try:
            kind, *parameters = shlex.split(text) or [""]
        except ValueError as error:
            raise RecordingError(f"--element {text!r} cannot be read: a quotation mark is not closed.") from error
        elements.append({"kind": kind, **parse_assignments(parameters)})
    if "wall" not in layers.data:
        if any(table["kind"] == "unidirectional-damping" for table in elements):
            raise RecordingError("Unidirectional damping acts on the way into a wall; say where it begins with --wall.")
        elements = [{"acts": "always", **table} for table in elements]
    layers.data["dissipation"] = elements
    return resolved(layers, selection.overrides, kinds)


def _value(text: str) -> Any:
    return parse_assignments([f"value={text}"])["value"]
