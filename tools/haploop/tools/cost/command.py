"""``haploop cost``: errors and times of every method at every plant rate; a stopped command continues where it was."""

from __future__ import annotations

import dataclasses
import math
import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from haploop.tools.command.options import FAILED, WRONG_USE, Json, leave, plain_errors, print_json
from haploop.tools.render.progress import bars


def cost(
    scenes: Annotated[
        list[Path] | None, typer.Argument(metavar="[SCENE]...", help="scene files [the accuracy scenes]")
    ] = None,
    rates: Annotated[str, typer.Option(help="plant rates, Hz")] = "1k,2k,5k,10k,20k,100k",
    methods: Annotated[str | None, typer.Option(help="integrators, comma-separated [all]")] = None,
    out: Annotated[Path, typer.Option(help="directory; what it holds is not measured again")] = Path("runs/cost"),
    tolerance: Annotated[float, typer.Option(help="RMS error the advice is for, m")] = 1e-6,
    repeats: Annotated[int, typer.Option(help="repeats of each timing")] = 7,
    processes: Annotated[bool, typer.Option("--processes/--no-processes", help="also time what processes cost")] = True,
    json: Json = False,
) -> None:
    """Measure what accuracy costs in time. Error and time of every method at every plant rate, and advice.

    It can be stopped; the same command continues it.
    """
    from haploop.tools.cost import figure, prices_figure
    from haploop.tools.cost.data import COST_FILE, save
    from haploop.tools.cost.grid import accuracy_scenes, grid
    from haploop.tools.cost.measure import Measurement
    from haploop.tools.cost.page import report
    from haploop.tools.figure.data import FigureError
    from haploop.tools.figure.style import write_figure
    from haploop.tools.render.terminal import console

    plant_rates, names = _rates(rates), _methods(methods)
    if not (tolerance > 0 and math.isfinite(tolerance)):
        leave(f"--tolerance must be above 0 m, but {tolerance} was given.", WRONG_USE)
    if repeats < 1:
        leave(f"--repeats must be at least 1, but {repeats} was given.", WRONG_USE)
    with plain_errors():
        grids = [grid(path, names, plant_rates) for path in scenes or accuracy_scenes()]
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            leave(f"The directory {out} cannot be used: {error.strerror}.", WRONG_USE)
        interrupted = False
        measurement = Measurement(grids, out, repeats, repeats if processes else 0)
        try:
            with bars() as stage:
                measurement.errors(stage)
                measurement.times(stage)
                if not scenes:
                    measurement.other_prices.measure(stage)
        except KeyboardInterrupt:
            interrupted = True
        result = measurement.cost(tolerance)
    save(result, out)
    if interrupted:
        leave(f"Stopped; what was measured is in {out}, and the same command continues from it.", FAILED)
    if json:
        print_json(dataclasses.asdict(result))
    else:
        console().print(report(result))
    print(out / COST_FILE, file=sys.stderr)
    try:
        print(write_figure(figure.figure_of(result), out / "cost.png"), file=sys.stderr)
        if result.prices:
            print(write_figure(prices_figure.figure_of(result.prices), out / "prices.png"), file=sys.stderr)
    except FigureError as error:
        print(f"Note: {error}", file=sys.stderr)


def _rates(text: str) -> list[int]:
    rates = []
    for word in text.split(","):
        number, rate = word.strip(), math.nan
        with suppress(ValueError):
            rate = float(number.removesuffix("k")) * (1000.0 if number.endswith("k") else 1.0)
        if not (0 < rate < math.inf and rate.is_integer()):
            expected = "--rates must be whole numbers of Hz above 0, such as 1k,10k,20000"
            leave(f"{expected}, but {word!r} was given.", WRONG_USE)
        rates.append(int(rate))
    return rates


def _methods(text: str | None) -> list[str]:
    from haploop.protocol.names import nearest
    from haploop.tools.cost.grid import METHODS

    if text is None:
        return list(METHODS)
    names = [word.strip() for word in text.split(",")]
    for name in names:
        if name not in METHODS:
            meant = nearest(name, METHODS)
            hint = f"; did you mean {meant}?" if meant else "."
            leave(f"--methods must be among {', '.join(METHODS)}, but {name!r} was given{hint}", WRONG_USE)
    return list(dict.fromkeys(names))
