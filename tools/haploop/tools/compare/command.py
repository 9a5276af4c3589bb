"""``haploop compare``: every stabilizer on a device or a scene, each tuned by the same search with the same effort."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from haploop.tools.command.options import (
    FAILED,
    WRONG_USE,
    Delay,
    Device,
    Estimator,
    Hand,
    Json,
    Plugin,
    Set,
    leave,
    plain_errors,
    print_json,
)  # fmt: skip

_NO_BOUND = (
    "Force bounding is left out: of any wall that is pressed slowly, it holds 2 b / T, where b is the damping that the "
    "device declares; here {0}."
)
_ONE_DEVICE = (
    "One device was expected, to compare stabilizers on it, but {0} and {1} were given. What differs between two runs "
    "is listed by haploop diff {0} {1}, and drawn by haploop plot {0} {1}."
)
ROWS, COMPARISON, FIGURE = "rows.jsonl", "comparison.json", "comparison.png"

if TYPE_CHECKING:
    from haploop.tools.advise.subject import Subject
    from haploop.tools.compare.comparison import Comparison


def compare(
    device: Device,
    more: Annotated[list[str] | None, typer.Argument(hidden=True)] = None,
    hand: Hand = None,
    delay: Delay = None,
    estimator: Estimator = None,
    set: Set = None,
    plugin: Plugin = None,
    grid: Annotated[
        bool, typer.Option("--grid/--no-grid", help="also with more delay, a finer encoder, a slower drive")
    ] = True,
    workers: Annotated[int | None, typer.Option(help="processes [as many as cores]", show_default=False)] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="directory; a comparison in it is continued [runs/compare-DEVICE-TIME]"),
    ] = None,
    json: Json = False,
) -> None:
    """Compare every stabilizer, each tuned alike.

    How stiff a wall it renders safely, what it costs, where it breaks.

    It can be stopped; the same command with --out DIR, the directory of the first, continues it.
    """
    from haploop.tools.advise.subject import InvalidRequest, make_subject
    from haploop.tools.command.given import kinds_with

    if more:
        leave(_ONE_DEVICE.format(device, more[0]), WRONG_USE)
    if workers is not None and workers < 1:
        leave(f"--workers must be at least 1, but {workers} was given.", WRONG_USE)
    with plain_errors():
        try:
            subject = make_subject(device, hand, delay, estimator, set or [], kinds_with(plugin or []))
        except InvalidRequest as error:
            leave(str(error), WRONG_USE)
        _compare(subject, grid, workers, out, json)


def find(subject: Subject, grid: bool, workers: int | None, rows: Path) -> Comparison:
    """Compares the stabilizers on a subject's loop, and with ``grid`` on others like it; ``rows`` keeps the results."""
    from haploop.tools.advise.families import FORCE_BOUNDING
    from haploop.tools.advise.walls.cases import make_loop
    from haploop.tools.compare.bench import BESIDE, Effort
    from haploop.tools.compare.comparison import Comparison, Kept, bounded_N_m, compare, variants
    from haploop.tools.compare.conditions import COMPARED_WITH, task_words
    from haploop.tools.executor.executors import make_executor
    from haploop.tools.render.progress import bars
    from haploop.tools.render.units import format_stiffness

    loop = make_loop(subject.scene, subject.has_task, COMPARED_WITH)
    loops, effort = variants(loop), Effort()
    if not grid:
        loops = dict([*loops.items()][:1])
    with bars() as stage, make_executor(workers) as executor:
        found = compare(loops, effort, BESIDE, Kept(rows), executor, stage)
    is_left_out = all(row.family != FORCE_BOUNDING.name for row in found[0].rows)
    notes = [*subject.notes, *[_NO_BOUND.format(format_stiffness(bounded_N_m(loop)))] * is_left_out]
    return Comparison(subject.name, task_words(loop), tuple(notes), effort, BESIDE, found)


def _compare(subject: Subject, grid: bool, workers: int | None, out: Path | None, as_json: bool) -> None:
    from haploop.launch.spec import make_output
    from haploop.logger.summary import finite
    from haploop.tools.compare.figure import draw
    from haploop.tools.compare.report import comparison_data, report
    from haploop.tools.figure.data import FigureError
    from haploop.tools.render.terminal import console

    goes_on = out is not None and (out / ROWS).exists()
    out = out if out is not None and goes_on else make_output(out, Path(f"compare-{subject.name}"), first=ROWS)
    try:
        told = find(subject, grid, workers, out / ROWS)
    except KeyboardInterrupt:
        leave(f"Interrupted; the same command with --out {out} continues.", FAILED)
    if not as_json:
        console().print(report(told))
    data = comparison_data(told)
    (out / COMPARISON).write_text(json.dumps(finite(data), indent=1) + "\n", encoding="utf-8")
    if as_json:
        print_json(data)
    print(out / COMPARISON, file=sys.stderr)
    try:
        print(draw(told, out / FIGURE), file=sys.stderr)
    except FigureError as error:
        print(f"Note: {error}", file=sys.stderr)
