"""Runs as the live page finds them: live ones, and finished ones in ``runs``."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from haploop.launch.processes.run_directory import LiveRun
    from haploop.protocol.scene.scene import Scene
    from haploop.protocol.transport.sockets import SecureContext
    from haploop.protocol.transport.wire import Message

# The directory in which recorded runs are looked for, and how many of them are offered.
_RUNS, _MOST_PAST = "runs", 50


@dataclass
class RecordedRun:
    """A finished run, as a viewer finds it."""

    id: str
    out: Path
    title: str
    told: str
    clock: str = ""
    is_here: bool = True

    @classmethod
    def of_summary(cls, file: Path, ended_s: float) -> RecordedRun:
        """Makes it from its summary, written at a time in s; named by its folder if the summary cannot be read."""
        from haploop.launch.runs.run_files import recorded_summary
        from haploop.logger.log import LogError
        from haploop.logger.summary import misfit
        from haploop.tools.render.terminal import told

        name, when = file.parent.name, time.strftime("%d %b %H:%M", time.localtime(ended_s))
        try:
            summary = recorded_summary(file.parent) or {}
            stability = {"provisos": [], **summary.get("stability", {})}
            word = "failed" if summary["ended"] == "failed" else told(summary)
            if misfit(stability, {"provisos": [str]}):
                raise LogError(f"The verdict in {file} cannot be read.")
            words = [word, *stability["provisos"], when]
            return cls(name, file.parent, str(summary.get("title") or name), ", ".join(words))
        except (LogError, KeyError, TypeError):  # a foreign file, or one of another version
            return cls(name, file.parent, name, when)

    def scene(self) -> Scene:
        """Reads its resolved scene; raises OSError if there is none."""
        from haploop.launch.runs.run_files import recorded_scene
        from haploop.launch.scene.mistakes import SceneError

        try:
            scene = recorded_scene(self.out, {})
        except SceneError as error:
            raise OSError(str(error)) from error
        if scene is None:
            raise FileNotFoundError(f"There is no scene.toml in {self.out}.")
        return scene

    def units(self, scene: Scene, keys: Iterable[str]) -> dict[str, str]:
        """Returns the units of these keys of a scene, and units by kind and parameter; leaves out keys without one."""
        from haploop.tools.render.scene_units import element_units, unit_at

        kinds = element_units()
        return kinds | {key: unit for key in keys if (unit := unit_at(scene, key, kinds))}

    def make_context(self) -> SecureContext:
        """Raises OSError: there is no process to connect to."""
        raise OSError(f"Run {self.id} is over.")


class LiveRuns:
    """The live runs of this user, as a viewer finds and steers them; or only one run elsewhere."""

    def __init__(self, only: LiveRun | None = None) -> None:
        self._only = only
        self._recorded: dict[tuple[Path, float], RecordedRun] = {}

    def live(self) -> Sequence[LiveRun]:
        """Returns the runs that are live now, the oldest first."""
        from haploop.launch.processes import run_directory

        return [self._only] if self._only else run_directory.live_runs()

    def past(self) -> Sequence[RecordedRun]:
        """Returns the recorded runs in ./runs that have a summary, the newest first; none for a run elsewhere."""
        if self._only:
            return []
        from haploop.launch.spec import SCENE

        found: list[tuple[float, Path]] = []
        for file in Path(_RUNS).glob("*/summary.json"):  # a sweep has one, too, and no scene
            with suppress(OSError):  # it may be deleted meanwhile
                if (file.parent / SCENE).is_file():
                    found.append((file.stat().st_mtime, file))
        found.sort(reverse=True)
        now = {(file, ended_s) for ended_s, file in found[:_MOST_PAST]}
        self._recorded = {key: run for key, run in self._recorded.items() if key in now}
        for key in now - self._recorded.keys():
            self._recorded[key] = RecordedRun.of_summary(*key)
        return [self._recorded[file, ended_s] for ended_s, file in found[:_MOST_PAST]]

    def record_of(self, run: LiveRun) -> RecordedRun | None:
        """Returns the record of a run that was live, from its summary; None where there is none on this machine."""
        from haploop.logger.summary import SUMMARY

        file = Path(run.out) / SUMMARY
        with suppress(OSError):
            if run.is_here:
                return RecordedRun.of_summary(file, file.stat().st_mtime)
        return None

    def stiffness_limit(self, scene: Scene) -> float | str:
        """Returns the largest stiffness with which the linear map of a loop is stable, N/m, or why there is none.

        Friction is left out of it, and may hold stiffer walls. Plugin files are not read: they are code, and the code
        of a run works in the run alone.
        """
        from haploop.controller.dissipation.element import ElementError
        from haploop.protocol.register import UnknownKind
        from haploop.tools.linear.linearity import installed_kinds, why_not_linear
        from haploop.tools.linear.one_tick import NeverStable, OneTickMap

        scene = replace(scene, friction=None)
        known = [table for table in scene.dissipation if table.name in installed_kinds()]
        strange = [table.name for table in scene.dissipation if table not in known]
        try:
            if curved := why_not_linear(replace(scene, dissipation=tuple(known))):
                return f"not linear, because of {' and '.join(curved)}"
            if strange:
                return f"the element {' and '.join(strange)} is not known to this page, which reads no plugin files"
            limit = OneTickMap.from_scene(scene).stiffness_limit()
        except NeverStable:
            return "unstable with the softest wall"
        except UnknownKind as error:
            missing = str(error).partition(" here.")[0].removeprefix("There is ")
            return f"{missing} is known to this page, which reads no plugin files"
        except (ElementError, KeyError, ValueError, ArithmeticError) as error:
            return f"it cannot be computed: {error}"
        return limit if math.isfinite(limit) else "stable with any wall"

    def has_launcher(self, run: LiveRun) -> bool:
        """Returns whether the process that started a run, and judges it at its end, is still there."""
        from haploop.launch.processes import run_directory

        return run_directory.has_launcher(run)

    def ask(self, run: LiveRun, verb: str, arguments: Message) -> tuple[str, Message]:
        """Sends a command to a run and returns its answer."""
        from haploop.launch.processes.run_directory import CommandRefused, RunNotFound, ask
        from haploop.view.receive.runs import CommandFailed

        try:
            return ask(run, verb, **arguments)
        except (CommandRefused, RunNotFound) as error:
            raise CommandFailed(str(error)) from error
        except (TypeError, ValueError, OverflowError) as error:  # names that ask() uses, numbers no message can carry
            raise CommandFailed(f"The arguments of {verb} cannot be used: {error}.") from error
