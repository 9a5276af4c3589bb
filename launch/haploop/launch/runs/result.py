"""Runs a scene from Python and holds the result: the summary, and every channel with its units."""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import haploop.logger
from haploop.controller.dissipation import PluginError, registry
from haploop.launch.runs import start
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.runs.loaded_scene import LoadedScene, load
from haploop.launch.scene.events import elements_of
from haploop.launch.spec import SCENE, make_output
from haploop.logger.log.recording import MemoryLog, Recording, Table
from haploop.logger.session import LOG
from haploop.logger.summary import Summary
from haploop.protocol.installed import bring
from haploop.protocol.names import meant

if TYPE_CHECKING:
    import pint


# The unit that the end of a summary's key stands for; the first end that fits counts.
_UNITS = {"_Hz": "Hz", "_N_m": "N/m", "_m_s": "m/s", "_1_s": "1/s", "_m": "m", "_s": "s", "_N": "N", "_J": "J"}


_PARAMETER = re.compile(r"energy\.elements\.(\d+)\.parameters\.(\w+)")


def unit_of(key: str) -> str:
    """Returns the unit of a number in a summary, by its key; "" if it has none."""
    return next((unit for end, unit in _UNITS.items() if key.endswith(end)), "")


def _numbers(entry: Any, key: str = "") -> Iterator[tuple[str, float | None]]:
    """Yields the numbers of a summary by dotted key; None for a number that the run did not produce."""
    if isinstance(entry, dict | list):
        for name, inner in entry.items() if isinstance(entry, dict) else enumerate(entry):
            yield from _numbers(inner, f"{key}.{name}".lstrip("."))
    elif entry is None or (isinstance(entry, int | float) and not isinstance(entry, bool)):
        yield key, entry


@dataclass(frozen=True, eq=False)
class Result:
    """A finished run.

    ``result["/plant"]["x"]`` is an array of float64, ``result["/plant"].quantity("x")`` the same with its unit,
    ``result["/plant"].frame()`` a data frame; ``result["/events"]`` is a list of maps.

    Attributes:
        scene: what was run.
        summary: as in ``summary.json``; a number's key ends with its unit.
        directory: where the run left its files; None if it left none.
    """

    scene: LoadedScene
    summary: Summary
    directory: Path | None
    _kept: Recording | None = None

    @cached_property
    def log(self) -> Recording:
        """Every channel by topic, read from the directory when first asked for."""
        return haploop.logger.read(self.directory or "") if self._kept is None else self._kept

    def __getitem__(self, topic: str) -> Table | Any:
        return self.log[topic]

    @property
    def verdict(self) -> str:
        """``steady``, ``limit-cycle``, ``growing``, ``diverged``, ``no-contact`` or ``undecided``.

        ``no-swing-seen`` or ``swinging`` if the run was not pushed and only its last half second was looked at.
        """
        return self.summary["verdict"]

    @property
    def provisos(self) -> tuple[str, ...]:
        """What a verdict of ``steady`` depends on, in words: ``only friction holds it``; empty if on nothing."""
        return tuple(self.summary.get("stability", {}).get("provisos", ()))

    def quantity(self, key: str) -> pint.Quantity[float]:
        """A number of the summary with its unit, by dotted key: ``"window.oscillation_m"``, ``"energy.moved_J"``.

        A number that the run did not produce, None in the summary, is NaN.

        Raises:
            KeyError: there is no such number; the message names the nearest.
        """
        import pint

        known = dict(_numbers(self.summary))
        if key not in known:
            near = meant(key, known)
            raise KeyError(f"There is no number {key} in the summary{near or '; it has ' + ', '.join(known)}.")
        value = known[key]
        return pint.get_application_registry().Quantity(math.nan if value is None else value, self._unit_of(key))

    def _unit_of(self, key: str) -> str:
        """Returns the unit of a number of the summary; that of an element's parameter is its kind's."""
        if parameter := _PARAMETER.fullmatch(key):
            kind = self.scene.kinds[self.summary["energy"]["elements"][int(parameter[1])]["kind"]]
            return kind.parameters()[parameter[2]][0].unit
        return unit_of(key)

    def __repr__(self) -> str:
        swing_mm = 1e3 * (self.summary["window"]["oscillation_m"] or 0.0)
        title, duration_s = self.summary["title"], self.summary["duration_s"]
        word = ", ".join([self.verdict, *self.provisos])
        return f"<{word}: {title!r}, {duration_s:g} s, oscillation {swing_mm:.3g} mm peak to peak>"


def run(
    scene: LoadedScene | str | Path, out: str | Path | None = None, *, processes: bool = False, pace: float = math.inf
) -> Result:
    """Runs a scene to its end.

    Args:
        scene: a loaded scene, or the path of one.
        out: directory for log, summary and scene, new or empty; when None, everything stays in memory.
        processes: whether to run plant, controller and logger as processes, which other terminals can watch and steer;
            otherwise all run in this one. The bits are the same.
        pace: simulated seconds per second, for processes; infinite for as fast as possible.

    Raises:
        SceneError, ElementError: the scene cannot be run.
        OutputError: the directory cannot be used.
        PluginError: the processes could not find an element that was given as a class.
        RunFailed: a process was killed, hung or could not go on, or an element raised.
        LogError: the log could not be written.
        TypeError: ``out`` is not a path.
        ValueError: a finite pace was given without ``processes``.
    """
    if out is not None and not isinstance(out, str | Path):
        raise TypeError(
            f"out must be a directory, but {out!r:.60} was given; to change a scene, use load(scene).set(...)."
        )
    scene = scene if isinstance(scene, LoadedScene) else load(scene)
    if math.isfinite(pace) and not processes:
        raise ValueError(f"A pace of {pace:g} needs the clock of a run in processes; give processes=True too.")
    bring(scene.brought)
    if out is None and not processes:
        memory = MemoryLog()
        summary = run_in_process(
            scene.scene, dict(scene.kinds), attachments={SCENE: str(scene)}, memory=memory, causes=True
        )
        return Result(scene, summary, None, memory.recording())
    if processes:
        _check_files(scene)
    # Without ``out``, a temporary directory, which is removed once it has been read.
    with tempfile.TemporaryDirectory(prefix="haploop-") if out is None else nullcontext(out) as directory:
        target = make_output(Path(directory), scene.path)
        prepared = start.lay_out(scene.scene, dict(scene.kinds), target, scene.plugins, dict(scene.plugin_files))
        summary = start.run(prepared, in_process=not processes, pace=pace)
        has_log = (target / LOG).exists()  # a scene may ask for none
        kept = None if out is not None else haploop.logger.read(target) if has_log else Recording({}, "", {})
    return Result(scene, summary, None if out is None else target, kept)


def _check_files(scene: LoadedScene) -> None:
    """Raises PluginError unless every element is installed or has a file: processes load their elements themselves."""
    installed = registry()
    for element in elements_of(scene.scene):
        kind = element.name
        if kind not in scene.plugin_files and installed.get(kind) is not scene.kinds[kind]:
            raise PluginError(
                f"The element {kind} was given as a class, which other processes cannot load; "
                f'put it into a file and give that: load(..., plugins=["{kind}.py"]).'
            )
