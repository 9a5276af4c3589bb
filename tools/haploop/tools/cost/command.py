"""``haploop cost``: errors and times of every method at every plant rate; a stopped command goes on where it was."""

from __future__ import annotations

import dataclasses
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from haploop.launch.scene.mistakes import nearest
from haploop.tools.cli.exit_codes import FAILED, WRONG_USE, leave, plain_errors, print_json
from haploop.tools.render.progress import bars

if TYPE_CHECKING:
    from haploop.tools.cost.data import Cost
    from haploop.tools.cost.grid import Grid
    from haploop.tools.cost.measure import Measurement


@dataclass(frozen=True)
class Request:
    """The arguments of ``haploop cost``.

    Attributes:
        scenes: scene files; where there are none, the scenes of the folder accuracy, and the other prices with them.
        methods, rates: as comma-separated text, rates in Hz or with a k; every method when None.
        out: directory, made where missing; what it holds already is not measured again.
        tolerance_m: for the advice.
        repeats: of each time.
        processes: whether to time runs as processes at all.
    """

    scenes: list[Path]
    methods: str | None
    rates: str
    out: Path
    tolerance_m: float
    repeats: int
    processes: bool


def cost(request: Request, as_json: bool) -> None:
    """Measures what is missing, writes cost.json and the figure, and prints tables and advice."""
    from haploop.tools.cost.data import save
    from haploop.tools.cost.measure import Measurement

    rates, methods = _rates(request.rates), _methods(request.methods)
    _check_numbers(request)
    with plain_errors():
        grids = _grids(request.scenes, methods, rates)
        try:
            request.out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            leave(f"The directory {request.out} cannot be used: {error.strerror}.", WRONG_USE)
        times = request.repeats if request.processes else 0
        with Measurement(grids, request.out, request.repeats, times) as measurement:
            interrupted = _measure(measurement, with_prices=not request.scenes)
            result = measurement.cost(request.tolerance_m)
    save(result, request.out)
    if interrupted:
        leave(f"Stopped; what was measured is in {request.out}, and the same command takes it up again.", FAILED)
    _show(result, request.out, as_json)


def _grids(scenes: list[Path], methods: list[str], rates: list[int]) -> list[Grid]:
    from haploop.tools.cost.grid import accuracy_scenes, grid

    return [grid(path, methods, rates) for path in scenes or accuracy_scenes()]


def _measure(measurement: Measurement, with_prices: bool) -> bool:
    """Measures, with progress on a terminal; returns whether it was interrupted."""
    try:
        # A thread that drew meanwhile would be measured too.
        with bars(by_itself=False) as stage:
            measurement.errors(stage)
            measurement.times(stage)
            if with_prices:
                measurement.other_prices(stage)
    except KeyboardInterrupt:
        return True
    return False


def _show(result: Cost, out: Path, as_json: bool) -> None:
    """Prints tables and advice, or JSON, on stdout and the names of the files on stderr."""
    from haploop.tools.cost.data import COST_FILE
    from haploop.tools.cost.report import report
    from haploop.tools.render.terminal import console

    if as_json:
        print_json(dataclasses.asdict(result))
    else:
        console().print(report(result))
    for path in (out / COST_FILE, *_draw(result, out)):
        print(path, file=sys.stderr)


def _draw(result: Cost, out: Path) -> list[Path]:
    """Draws the figures and returns their files; prints a note where that cannot be done."""
    from haploop.tools.cost import figure
    from haploop.tools.cost.prices import figure as prices_figure
    from haploop.tools.figure.data import FigureError

    try:
        drawn = [figure.draw(result, out / "cost.png")]
        return [*drawn, prices_figure.draw(result, out / "prices.png")] if result.prices else drawn
    except FigureError as error:
        print(f"Note: {error}", file=sys.stderr)
        return []


def _rates(text: str) -> list[int]:
    """Reads rates in Hz: ``1k,2.5k,10000``."""
    rates = []
    for word in text.split(","):
        factor, number = (1000.0, word.strip()[:-1]) if word.strip().endswith("k") else (1.0, word)
        try:
            rate = float(number) * factor
        except ValueError:
            rate = math.nan
        if not (rate > 0 and rate == round(rate)):
            leave(
                f"--rates must be whole numbers of Hz above 0, such as 1k,10k,20000, but {word!r} was given.", WRONG_USE
            )
        rates.append(round(rate))
    return rates


def _methods(text: str | None) -> list[str]:
    """Reads names of integrators; all of them when None."""
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


def _check_numbers(request: Request) -> None:
    if not (request.tolerance_m > 0 and math.isfinite(request.tolerance_m)):
        leave(f"--tolerance must be above 0 m, but {request.tolerance_m} was given.", WRONG_USE)
    if request.repeats < 1:
        leave(f"--repeats must be at least 1, but {request.repeats} was given.", WRONG_USE)
