"""``haploop advise``: the stiffest wall that is safe, what breaks it first, and what to change to gain most."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from haploop.launch.scene.events import elements_of, try_out
from haploop.launch.scene.toml_writer import to_toml
from haploop.launch.spec import OutputError, make_output
from haploop.logger.summary import finite
from haploop.protocol.scene.paths import value_at, with_value
from haploop.tools.advise.advice import Advice, AdviceData, advice, advice_data
from haploop.tools.advise.figure import draw
from haploop.tools.advise.report import report, sentences
from haploop.tools.advise.search import STAGES
from haploop.tools.advise.subject import InvalidRequest, Subject, make_subject
from haploop.tools.advise.walls.cases import Case, make_loop
from haploop.tools.advise.walls.store import Store
from haploop.tools.advise.walls.trial import Trial
from haploop.tools.command.given import kinds_with, print_notes
from haploop.tools.command.options import FAILED, WRONG_USE, leave, note_without_numba, plain_errors, print_json
from haploop.tools.figure.data import FigureError
from haploop.tools.render.terminal import console
from haploop.tools.render.units import format_stiffness

ADVICE, FIGURE, WALLS, _ASKED = "advice.json", "figure.png", "walls.jsonl", "asked.toml"
_STIFFER = ", on which the swing is plainer; it is felt from {0} on"
_SCENE, _BREAKS = "advice.toml", "advice_breaks.toml"


_OF_ANOTHER = (
    "{out} contains advice on another scene, {asked}; name another directory with --out, or give the device and the "
    "options of that advice to continue it."
)


def advise(
    device: str,
    hand: str | None,
    delay: str | None,
    estimator: str | None,
    overrides: list[str],
    plugins: list[Path],
    workers: int | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """Searches, writes the results into the directory and prints them; the arguments are those of the command."""
    if workers is not None and workers < 1:
        leave(f"--workers must be at least 1, but {workers} was given.", WRONG_USE)
    with plain_errors():
        kinds = kinds_with(plugins)
        try:
            asked = make_subject(device, hand, delay, estimator, overrides, kinds)
        except InvalidRequest as error:
            leave(str(error), WRONG_USE)
        try_out(elements_of(asked.scene), kinds)
        note_without_numba()
        tried = Case(1.0).scene(make_loop(asked.scene, asked.has_task))
        # The stiffness in a loop to be searched is a placeholder.
        tried = with_value(tried, "wall.stiffness", value_at(asked.scene, "wall.stiffness"))
        asked = replace(asked, notes=(*print_notes(tried, kinds), *asked.notes))
        out = _output(out, asked)
        store = Store(out / WALLS)
        try:
            with _progress() as (stage, on_progress), Trial(store, workers, on_progress) as trial:
                found = advice(asked, trial, stage)
        except KeyboardInterrupt:
            leave(f"Interrupted; the same command with --out {out} continues.", FAILED)
    if not as_json:
        console().print(report(found))
    data = _write(found, out)
    if as_json:
        print_json(data)
    for key, path in data["files"].items():
        print(path + (breaks_words(found) if key == "breaks" else ""), file=sys.stderr)


def _output(out: Path | None, asked: Subject) -> Path:
    """Returns a new directory, or one with the walls of an advice on the same scene, which is then continued.

    Raises OutputError for one that holds anything else.
    """
    scene = to_toml(asked.scene.as_dict())
    if out is None or not (out / WALLS).exists():
        out = make_output(out, Path(f"advice-{asked.name}"), first=WALLS)
        (out / _ASKED).write_text(scene, encoding="utf-8")
    elif not (out / _ASKED).exists() or (out / _ASKED).read_text(encoding="utf-8") != scene:
        raise OutputError(_OF_ANOTHER.format(out=out, asked=out / _ASKED))
    return out


def breaks_words(found: Advice) -> str:
    """Returns what the scene of the case that breaks first shows; its wall may be stiffer than the reported one."""
    scene, broken = found.breaks, found.found.breaks
    assert scene
    assert scene.wall
    assert broken
    if scene.run.verdict != "pushed":
        return ": the case that breaks first, to the end of the time in which it is felt"
    shown, told = format_stiffness(scene.wall.stiffness), format_stiffness(broken[0])
    return f": the case that breaks first, with a wall of {shown}" + (_STIFFER.format(told) if shown != told else "")


def _write(found: Advice, out: Path) -> AdviceData:
    files, data = {}, advice_data(found, sentences(found))
    try:
        for key, name, scene in (("scene", _SCENE, found.scene), ("breaks", _BREAKS, found.breaks)):
            if scene:
                (out / name).write_text(to_toml(scene.as_dict()), encoding="utf-8")
                files[key] = str(out / name)
        with contextlib.suppress(FigureError):
            files["figure"] = str(draw(found, out / FIGURE))
        files["data"] = str(out / ADVICE)
        data["files"] = files
        (out / ADVICE).write_text(json.dumps(finite(data), indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        leave(f"{out} cannot be written to: {error.strerror}.", FAILED)
    return data


@contextlib.contextmanager
def _progress() -> Iterator[tuple[Callable[[str], None], Callable[[int], None]]]:
    """Shows stage and runs so far on a terminal, and one line per stage elsewhere."""
    screen, now = console(stderr=True), ["starting"]
    with screen.status("starting") if screen.is_terminal else contextlib.nullcontext() as status:

        def stage(name: str) -> None:
            now[0] = f"{name} ({STAGES.index(name) + 1} of {len(STAGES)})"
            if not status:
                print(f"{now[0]} ...", file=sys.stderr)

        def on_progress(runs: int) -> None:
            if status:
                status.update(f"{now[0]}: {runs} runs")

        yield stage, on_progress
