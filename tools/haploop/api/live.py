"""A running loop in Python's hands: its processes started, watched, swapped, set, stepped and ended."""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import time
import weakref
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

import haploop.logger
from haploop.launch.processes import run_directory
from haploop.launch.processes.run_directory import Elsewhere, LiveRun, RunNotFound, ask
from haploop.launch.runs.loaded_scene import LoadedScene, load, plain
from haploop.launch.runs.result import Result
from haploop.launch.scene.file import load as load_resolved
from haploop.launch.spec import SCENE, RunFailed
from haploop.logger.log.recording import Recording
from haploop.logger.session import LOG
from haploop.logger.summary import SUMMARY
from haploop.logger.summary import read as read_summary

_LOOK_S, _BEGINS_WITHIN_S, _ENDS_WITHIN_S = 0.01, 60.0, 20.0
# Simulated seconds per second of a run that is to stand still at its start: no tick after the first is due.
_STANDING = 1e-6


def start(
    scene: LoadedScene | str | Path, out: str | Path | None = None, *, pace: float = math.inf, paused: bool = False
) -> LiveLoop:
    """Starts a scene as processes, which other terminals and the live page can watch and steer, too.

    Args:
        scene: a loaded scene, or the path or name of one.
        out: directory for log, summary and scene, new or empty; when None, nothing is left of it.
        pace: simulated seconds per second; infinite for as fast as it goes, 1 for real time.
        paused: stand still at the first ticks, until ``step`` or ``resume``. What is then changed between steps takes
            effect at the same tick every time, and gives the same bits.

    Raises:
        SceneError, ElementError, PluginError: the scene cannot be run.
        RunFailed: the run ended before it began; the message is that of ``haploop run``.
    """
    scene = scene if isinstance(scene, LoadedScene) else load(scene)
    scratch = tempfile.TemporaryDirectory(prefix="haploop-")
    file, told = Path(scratch.name, SCENE), Path(scratch.name, "told.txt")
    file.write_text(str(scene), encoding="utf-8")
    directory = Path(scratch.name, "run") if out is None else Path(out)
    words = [sys.executable, "-m", "haploop.tools.cli", "run", str(file), "--out", str(directory), "--json"]
    words += ["--pace", repr(_STANDING) if paused else "free" if math.isinf(pace) else repr(float(pace))]
    words += [word for plugin in dict.fromkeys(scene.plugin_files.values()) for word in ("--plugin", str(plugin))]
    with told.open("w", encoding="utf-8") as errors:
        # In a group of its own: Ctrl-C is for this program, which ends the run in order.
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=errors, process_group=0)
    give_up = time.monotonic() + _BEGINS_WITHIN_S
    while process.poll() is None and time.monotonic() < give_up:
        found = [run for run in run_directory.live_runs() if run.pid == process.pid]
        if found:
            loop = LiveLoop(found[0], scene, process, scratch, None if out is None else directory, told)
            if paused:
                loop.pause()
                loop.pace(pace)
            return loop
        time.sleep(_LOOK_S)
    process.terminate()
    process.wait()
    why = told.read_text(encoding="utf-8").strip()
    if (directory / SUMMARY).exists():  # a short run, over before it was looked for
        run = LiveRun("", None, process.pid, "", scene["title"], str(directory))
        return LiveLoop(run, scene, process, scratch, None if out is None else directory, told)
    scratch.cleanup()
    raise RunFailed(why)


def attach(run_id: str | None = None, *, at: str | None = None, keys: str | Path | None = None) -> LiveLoop:
    """Returns the handle of a run that was started elsewhere, as by ``haploop run``; leaving it does not end it.

    Args:
        run_id: its id or the beginning of it; the only run there is when None.
        at: ``"HOST:PORT"`` of a run on another host; ``keys`` is a directory with a copy of its keys.

    Raises:
        RunNotFound: not one run fits, or it does not answer.
    """
    from haploop.protocol.transport.addresses import address_to_reach

    which = run_id if at is None else Elsewhere(address_to_reach(at), None if keys is None else Path(keys))
    return LiveLoop(run_directory.find(which))


class LiveLoop:
    """A live run. As a context manager it ends the run that it started, if that still goes on.

    Its methods raise CommandRefused, whose message says why, where the run does not do what is asked, and RunNotFound
    where it has ended.

    Attributes:
        id: by which ``haploop --run ID`` finds it.
    """

    def __init__(
        self,
        run: LiveRun,
        scene: LoadedScene | None = None,
        process: subprocess.Popen[bytes] | None = None,
        scratch: tempfile.TemporaryDirectory[str] | None = None,
        directory: Path | None = None,
        told: Path | None = None,
    ) -> None:
        self.id, self._run, self._scene, self._process = run.id, run, scene, process
        self._directory, self._told = directory, told
        self._result: Result | None = None
        self._end = weakref.finalize(self, _end, process, scratch) if process and scratch else lambda: None

    def __repr__(self) -> str:
        return f"<LiveLoop {self.id}: {self._run.title!r}>"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def _ask(self, verb: str, **arguments: Any) -> dict[str, Any]:
        return ask(self._run, verb, **arguments)[1]

    def status(self) -> dict[str, Any]:
        """Returns tick, end, pace, whether it is paused, and every node, as ``haploop status --json``."""
        return self._ask("status")

    def set(self, values: Mapping[str, Any], at: float | None = None) -> int:
        """Changes numbers, ``{"wall.stiffness": "0.4 N/mm"}``, at once or at a simulated time; returns the tick."""
        return self._ask("set", set=plain(values), at=at)["tick"]

    def swap(self, kind: str, *, element: int = 0, at: float | None = None, **parameters: Any) -> int:
        """Replaces an element, at once or at a simulated time, s; returns the tick.

        Args:
            kind: of the new element; "none" removes the one there is.
            element: counted from 0; one past the end adds one.
            parameters: of the new element.
        """
        return self._ask("swap", swap={"kind": kind, **plain(parameters)}, element=element, at=at)["tick"]

    def undo(self) -> None:
        """Takes back the last swap or set."""
        self._ask("undo")

    def pause(self) -> int:
        """Stands still at the next tick that can; returns it."""
        return self._ask("pause")["tick"]

    def resume(self) -> int:
        """Goes on; returns the tick."""
        return self._ask("resume")["tick"]

    def pace(self, rate: float) -> int:
        """Goes on at another pace, simulated seconds per second; infinite for as fast as it goes."""
        return self._ask("pace", pace="free" if math.isinf(rate) else rate)["tick"]

    def step(self, ticks: int = 1) -> int:
        """Goes on for some control ticks and stands still; returns the tick once all of them are done."""
        tick = self._ask("step", ticks=ticks)["tick"]
        while self.status()["tick"] < tick:
            time.sleep(_LOOK_S)
        return tick

    def stop(self) -> int:
        """Ends the run in order, with a summary of what ran; returns the tick."""
        return self._ask("stop")["tick"]

    def watch(self, every_s: float = 0.05) -> Iterator[dict[str, NDArray[np.float64]]]:
        """Yields what the controller saw and did since the last time, until the run is over.

        Each is arrays of shape (ticks,) by column: ``t`` in s, ``x`` in m, ``v`` in m/s, ``wall``, ``total`` and
        ``dissipation.0`` in N, and so on. Whoever is too slow misses ticks and never holds the run up.
        """
        from haploop.tools.attach.observed_run import ObservedRun

        with ObservedRun(self._run, "observer") as observed:
            rate = observed.observer.welcome["scene"]["clock"]["control_rate"]
            for frames in observed.frames(every_s):
                for _, frame in frames:
                    if frame.name == "CONTROLLER_BLOCK":
                        block = frame.as_dict()
                        t_s = (block["from_tick"] + np.arange(block["ticks"])) / rate
                        yield {"t": t_s} | {name: np.frombuffer(of, "<f8") for name, of in block["columns"].items()}

    def finish(self) -> Result:
        """Lets the run go on if it stands still, to its end, and returns its result."""
        if self._process and self._process.poll() is None and self.status()["paused"]:
            self.resume()
        return self.wait()

    def wait(self, timeout_s: float | None = None) -> Result:
        """Waits for the end of the run and returns its result, verdict and all.

        Raises:
            TimeoutError: it still goes on.
            RunFailed: it could not go on.
            RunNotFound: it was one elsewhere, whose files are not on this machine.
        """
        if self._result is None:
            self._result = self._ended(timeout_s)
        return self._result

    def _ended(self, timeout_s: float | None) -> Result:
        late = TimeoutError(f"The run {self.id} still goes on after {timeout_s} s.")
        give_up = math.inf if timeout_s is None else time.monotonic() + timeout_s
        if self._process:
            try:
                self._process.wait(timeout_s)
            except subprocess.TimeoutExpired:
                raise late from None
            if self._process.returncode and self._told:
                raise RunFailed(self._told.read_text(encoding="utf-8").strip())
        elif not self._run.is_here:
            raise RunNotFound(f"The run at {self.id} leaves its files on its own host; wait for its end there.")
        while not self._process and run_directory.has_launcher(self._run):
            if time.monotonic() > give_up:
                raise late
            time.sleep(_LOOK_S)
        directory = Path(self._run.out)
        scene = self._scene or LoadedScene(load_resolved(directory / SCENE), directory / SCENE)
        kept = None
        if self._process and self._directory is None:
            kept = haploop.logger.read(directory) if (directory / LOG).exists() else Recording({}, "", {})
        result = Result(scene, read_summary(directory / SUMMARY), None if kept is not None else directory, kept)
        self._end()
        return result


def _end(process: subprocess.Popen[bytes], scratch: tempfile.TemporaryDirectory[str]) -> None:
    """Ends a run in order if it still goes on, or at once where it takes too long, and removes what it was told by."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(_ENDS_WITHIN_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
    scratch.cleanup()
