"""Many scenes, recordings and figures from Python: sweep, advise, compare, dissipate, plot."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haploop.controller.dissipation import registry
from haploop.launch.runs.loaded_scene import LoadedScene, Values, load, mistakes_of_python, plain, texts
from haploop.launch.runs.result import Result
from haploop.launch.scene.toml_writer import to_toml
from haploop.protocol.names import meant

if TYPE_CHECKING:
    from haploop.api.results import AdviceResult, ComparisonResult
    from haploop.tools.advise.subject import Subject
    from haploop.tools.dissipate.outcome import Outcome
    from haploop.tools.sweep.table import SweepTable

Plugins = Iterable[str | Path]
# Numbers of an element, each an SI number or text with its unit; a single one needs no list.
Amount = float | str
Amounts = Amount | Iterable[Amount]
# An option of a command in the text of an error, and the arguments that have another name than their option.
_OPTION = re.compile(r"(?<![\w-])--([a-z]+(?:-[a-z]+)*)")
_ARGUMENTS = {"rate": "rate_Hz", "unit": "length", "element": "elements", "set": "values"}


def sweep(
    of: LoadedScene | str | Path,
    axes: Mapping[str, Any] | None = None,
    *,
    values: Values = (),
    record: Sequence[str] = (),
    out: str | Path | None = None,
    workers: int | None = None,
    plugins: Plugins = (),
) -> SweepTable:
    """Runs a scene over one to three axes, on every core; ``table["wall.stiffness"]`` is a NumPy column.

    Args:
        of: a sweep file, or a name that ``haploop scenes`` lists; with ``axes``, a scene or its file.
        axes: for each key of the scene, an array or list of values, or a table
            ``{"from": 100, "to": 2000, "count": 20}``.
        values: laid over the scene, as in ``load``.
        record: with ``axes``, dotted keys of a run's summary, such as ``window.frequency_Hz``, in place of the usual.
        out: directory of the table; if it already holds this very sweep, that is continued. When None, nothing is kept.
        workers: number of processes; one per core when None.
        plugins: files with elements, walls, estimators or hand forces.

    Raises:
        SceneError, PluginError, NeedsPyarrow: the sweep cannot be run, or pyarrow is not installed.
        OutputError, StoreError: the directory cannot be used.
    """
    from haploop.tools.sweep.command import Request, carry_out
    from haploop.tools.sweep.table import read

    with tempfile.TemporaryDirectory(prefix="haploop-") as scratch:
        path = Path(of) if isinstance(of, str | Path) else of.path
        files = [Path(plugin) for plugin in plugins]
        if axes is not None:
            scene = of if isinstance(of, LoadedScene) else load(of, plugins=files)
            files = files or list(scene.plugins)
            listed = {key: getattr(points, "tolist", lambda of=points: of)() for key, points in axes.items()}
            made = {"title": scene["title"], "base": scene.tables, "axes": plain(listed)}
            made |= {"record": [*record]} if record else {}
            path = Path(scratch, "sweep.toml")
            path.write_text(to_toml(made), encoding="utf-8")
        elif isinstance(of, LoadedScene):
            raise TypeError('A scene is swept over axes, such as sweep(scene, {"wall.stiffness": [200, 400]}).')
        elif record:
            raise TypeError("What is recorded is given with axes; a sweep file names it itself.")
        directory = Path(out) if out is not None else Path(scratch, "sweep")
        request = Request(path, texts(values), directory, workers, plugins=files)
        with mistakes_of_python(path if axes is not None else None):
            return read(carry_out(request)[0])


def advise(
    device: str | Path,
    *,
    hand: str | None = None,
    delay: str | float | None = None,
    estimator: str | None = None,
    values: Values = (),
    plugins: Plugins = (),
    workers: int | None = None,
    out: str | Path | None = None,
) -> AdviceResult:
    """Finds how stiff a wall is safe on a device, with which element, and what breaks it first; takes minutes.

    Args:
        device: a device that ``haploop scenes`` lists, or a scene file.
        hand: a hand that ``haploop scenes`` lists, a file with one, or "none".
        delay: round-trip delay, in s or text with its unit; ``estimator`` is that of the velocity.
        out: directory that keeps every wall that was tried, so that an interrupted advice can be continued.
        values, plugins, workers: as for ``sweep``.

    Raises:
        InvalidRequest, SceneError, PluginError, ElementError: a name is unknown, or the scene cannot be run.
    """
    from haploop.api.results import AdviceResult
    from haploop.tools.advise.advice import advice
    from haploop.tools.advise.command import WALLS
    from haploop.tools.advise.walls.store import Store
    from haploop.tools.advise.walls.trial import Trial

    subject = _subject(device, values, plugins, hand=hand, delay=delay, estimator=estimator)
    with _kept(out, WALLS) as walls, Trial(Store(walls), workers, lambda runs: None) as trial:
        return AdviceResult(**vars(advice(subject, trial)))


def compare(
    device: str | Path, *, grid: bool = True, workers: int | None = None, out: str | Path | None = None, **asked: Any
) -> ComparisonResult:
    """Compares every stabilizer, each tuned in the same way, on a device or a scene; takes some minutes.

    Arguments and errors are those of ``advise``; ``grid`` also compares them with more delay, with a finer encoder and
    with a slower drive.
    """
    from haploop.api.results import ComparisonResult
    from haploop.tools.compare.command import ROWS, find

    with _kept(out, ROWS) as rows:
        return ComparisonResult(**vars(find(_subject(device, **asked), grid, workers, rows)))


def _subject(device: str | Path, values: Values = (), plugins: Plugins = (), **names: Any) -> Subject:
    """Makes the scene to be studied, and tries its elements out."""
    from haploop.launch.scene.events import elements_of, try_out
    from haploop.tools.advise.subject import make_subject

    kinds = registry([Path(plugin) for plugin in plugins])
    subject = make_subject(str(device), overrides=texts(values), kinds=kinds, **names)
    try_out(elements_of(subject.scene), kinds)
    return subject


@contextmanager
def _kept(out: str | Path | None, name: str) -> Iterator[Path]:
    """Yields a file path in the directory given, which is made if need be, or in one that is removed afterwards."""
    with tempfile.TemporaryDirectory(prefix="haploop-") if out is None else nullcontext(out) as directory:
        Path(directory).mkdir(parents=True, exist_ok=True)
        yield Path(directory, name)


def dissipate(
    recording: str | Path,
    *,
    damping: Amounts = (),
    mass: Amounts = (),
    elements: Sequence[str] = (),
    wall: float | str | None = None,
    occupies: str = "below",
    delay_s: float | None = None,
    values: Values = (),
    plugins: Plugins = (),
    **columns: Any,
) -> Outcome:
    """Computes the energy that elements would have dissipated on a recorded motion; they do not change the motion.

    Args:
        recording: CSV or TSV file, directory of a run, or its log.
        damping: virtual damping, in N s/m or text with a unit; one or several.
        mass: mass of bi- and unidirectional inertia, in kg or text with a unit; one or several.
        elements: any other elements, each ``"KIND KEY=VALUE ..."``.
        wall: where a wall begins, in m or text with a unit: elements act only beyond it; ``occupies`` says on which
            side of it the wall is.
        delay_s: age of a force when it acts; that of the run when None.
        values: of [velocity], [acceleration] and [encoder], by dotted key or as ``KEY=VALUE``.
        columns: columns of a text file: position, time, velocity, acceleration, force by name or number; rate_Hz; the
            units as length, time_unit, velocity_unit, acceleration_unit, force_unit.

    Returns:
        ``outcome.elements[0].true_J`` and so on; ``outcome.trace.lines()`` gives the books over time, rows t, x, then
        the sampled and true books of every element.

    Raises:
        RecordingError, FileNotFoundError, LogError, SceneError, ElementError: the recording or selection is wrong.
        TypeError: there is no such argument.
    """
    from haploop.launch.scene.reading.delimited import RecordingError
    from haploop.tools.dissipate.command import Request, Selection, compute_outcome
    from haploop.tools.dissipate.recording.text_recording import Layout

    dampings, masses = _texts(damping), _texts(mass)
    place = None if wall is None else str(plain(wall))
    selection = Selection(dampings, masses, list(elements), place, occupies, texts(values))
    known = [field.name for field in fields(Layout)]
    for name in columns:
        if name not in known:
            raise TypeError(f"dissipate() takes no {name}{meant(name, known)}; of a text file, {', '.join(known)}.")
    request = Request(Path(recording), selection, Layout(**columns), delay_s)
    try:
        with mistakes_of_python():
            return compute_outcome(request, registry([Path(plugin) for plugin in plugins]))
    except RecordingError as error:
        raise RecordingError(_OPTION.sub(_argument, str(error))) from None


def _argument(option: re.Match[str]) -> str:
    """Returns the argument of ``dissipate`` that stands for an option of the command."""
    return _ARGUMENTS.get(option[1], option[1].replace("-", "_"))


def _texts(amounts: Amounts) -> list[str]:
    values = plain(amounts if hasattr(amounts, "units") or isinstance(amounts, str | float | int) else list(amounts))
    return [str(value) for value in (values if isinstance(values, list) else [values])]


def plot(what: Result | str | Path | Sequence[Result | str | Path], target: str | Path | None = None) -> Path:
    """Draws a run that has a directory, several over one another, or the map of a sweep; returns the figure's file.

    Args:
        what: a result, or the directory of a run or a sweep; a list of runs.
        target: file of the figure, in the format of its suffix; ``figure.png`` in the directory when None.

    Raises:
        ValueError: a run was kept in memory only.
        FigureError: there is nothing to draw, or matplotlib is not installed.
    """
    from haploop.tools.draw import draw_any

    directories = []
    for one in [what] if isinstance(what, Result | str | Path) else what:
        directory = one.directory if isinstance(one, Result) else Path(one)
        if directory is None:
            raise ValueError(
                "This run was kept in memory only; give it a directory to draw it from: run(scene, out=...)."
            )
        directories.append(directory)
    return draw_any(directories, None if target is None else Path(target))
