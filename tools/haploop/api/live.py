"""Control of a running loop from Python: start, watch, swap elements, set values, step and end it."""

from __future__ import annotations

import contextlib
import math
import subprocess
import sys
import tempfile
import time
import warnings
import weakref
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

import haploop.logger
from haploop.launch.processes import run_directory
from haploop.launch.processes.run_directory import CommandRefused, Elsewhere, LiveRun, RunNotFound, ask
from haploop.launch.runs.loaded_scene import SET_SO, LoadedScene, load, plain
from haploop.launch.runs.result import Result
from haploop.launch.scene.number import TIME
from haploop.launch.spec import PLUGINS, SCENE, RunFailed
from haploop.logger.log.recording import Recording
from haploop.logger.session import LOG
from haploop.logger.summary import SUMMARY
from haploop.logger.summary import read as read_summary

_LOOK_S, _ENDS_WITHIN_S, _TOLD = 0.01, 20.0, "told.txt"
# Pace, in simulated seconds per second, of a run that is to stand still at its start: no tick after the first is due.
_STANDING = 1e-6
_LEFT = (
    "The run {} was ended with its with block and kept no files; call finish() or wait() inside the block, or give a "
    "directory: start(scene, out=...)."
)
_PAUSED = (
    "The run {0} is paused at tick {1} and does not end by itself: resume() continues it, finish() continues it "
    "and waits for its end."
)


def _seconds(at: Any) -> float | None:
    """Returns a time in s, given in s, as text with its unit or as a pint quantity; None if there is none."""
    return None if at is None else TIME.read(plain(at))


class _Started(NamedTuple):
    """A run that this program started: its process, a folder of scratch files, and whether its files are kept."""

    process: subprocess.Popen[bytes]
    scratch: tempfile.TemporaryDirectory[str]
    keeps: bool

    def told(self) -> str:
        """Returns what the run wrote to stderr."""
        return Path(self.scratch.name, _TOLD).read_text(encoding="utf-8").strip()

    def end(self) -> None:
        """Ends the run in order if it is still going, and kills it if that takes too long."""
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(_ENDS_WITHIN_S)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self.scratch.cleanup()


def start(
    scene: LoadedScene | str | Path, out: str | Path | None = None, *, pace: float = math.inf, paused: bool = False
) -> LiveLoop:
    """Starts a scene as processes, which other terminals and the live page can also watch and steer.

    Args:
        scene: a loaded scene, or the path or name of one.
        out: directory for log, summary and scene, new or empty; when None, no files are kept.
        pace: simulated seconds per second; infinite for as fast as possible, 1 for real time.
        paused: stand still at the first tick, until ``step`` or ``resume``. A change made between steps takes effect
            at the same tick every time, and gives the same bits.

    Raises:
        SceneError, ElementError, PluginError: the scene cannot be run.
        RunFailed: the run ended before it began; the message is that of ``haploop run``.
    """
    scene = scene if isinstance(scene, LoadedScene) else load(scene)
    scratch = tempfile.TemporaryDirectory(prefix="haploop-")
    file, directory = Path(scratch.name, SCENE), Path(scratch.name, "run") if out is None else Path(out).resolve()
    file.write_text(str(scene), encoding="utf-8")
    words = [sys.executable, "-m", "haploop.tools.cli", "run", str(file), "--out", str(directory), "--json"]
    words += ["--pace", repr(_STANDING) if paused else "free" if math.isinf(pace) else repr(float(pace))]
    words += [word for plugin in scene.plugins for word in ("--plugin", str(plugin))]
    with Path(scratch.name, _TOLD).open("w", encoding="utf-8") as errors:
        # In a process group of its own: Ctrl-C goes to this program alone, which ends the run in order.
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=errors, process_group=0)
    started = _Started(process, scratch, out is not None)
    found: list[LiveRun] = []
    try:
        while not found and process.poll() is None:
            time.sleep(_LOOK_S)
            found = [run for run in run_directory.live_runs() if run.pid == process.pid]
    except BaseException:
        started.end()
        raise
    if not found and process.returncode:
        why = started.told()
        started.end()
        raise RunFailed(why)
    # A short run may be over before it was found.
    run = found[0] if found else LiveRun("", None, process.pid, "", scene["title"], str(directory))
    loop = LiveLoop(run, scene, started)
    if paused:
        loop.pause()
        loop.pace(pace)
    return loop


def attach(run_id: str | None = None, *, at: str | None = None, keys: str | Path | None = None) -> LiveLoop:
    """Returns a handle on a run started elsewhere, such as by ``haploop run``; closing the handle does not end the run.

    Args:
        run_id: its id or the beginning of it; when None, the only run there is.
        at: ``"HOST:PORT"`` of a run on another host; ``keys`` is a directory with a copy of its keys.

    Raises:
        RunNotFound: no run, or more than one, fits, or the run does not answer.
    """
    from haploop.protocol.transport.addresses import address_to_reach

    which = run_id if at is None else Elsewhere(address_to_reach(at), None if keys is None else Path(keys))
    return LiveLoop(run_directory.find(which))


class LiveLoop:
    """A live run. As a context manager it ends the run that it started, if that is still going.

    Its methods raise CommandRefused, with the reason in the message, if the run refuses a command, and RunNotFound if
    it has ended.

    Attributes:
        id: the ID by which ``--run ID`` of a command finds the run.
    """

    def __init__(self, run: LiveRun, scene: LoadedScene | None = None, started: _Started | None = None) -> None:
        self.id, self._run, self._scene, self._started = run.id, run, scene, started
        self._result: Result | None = None
        self._end = weakref.finalize(self, started.end) if started else lambda: None

    def __repr__(self) -> str:
        return f"<LiveLoop {self.id}: {self._run.title!r}>"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def _ask(self, verb: str, **arguments: Any) -> dict[str, Any]:
        return ask(self._run, verb, **arguments)[1]

    def status(self) -> dict[str, Any]:
        """Returns tick, end, pace, whether it is paused, and every node, as ``haploop status --json`` does."""
        return self._ask("status")

    def set(self, values: Mapping[str, Any], at: Any = None) -> int:
        """Changes numbers, ``{"wall.stiffness": "0.4 N/mm"}``, at once or at a simulated time; returns the tick.

        The time is in s or text with its unit. A number that hardly any loop has, such as one in a unit other than the
        one meant, causes a ``UserWarning``.

        Raises:
            TypeError: the values are not a mapping from keys.
        """
        if not isinstance(values, Mapping):
            raise TypeError(SET_SO)
        done = self._ask("set", set=plain(values), at=_seconds(at))
        for note in done.get("notes", ()):
            warnings.warn(note, stacklevel=2)
        return done["tick"]

    def swap(self, kind: str, *, element: int = 0, at: Any = None, reload: bool = False, **parameters: Any) -> int:
        """Replaces an element, at once or at a simulated time; returns the tick.

        Args:
            kind: kind of the new element; "none" removes the present one.
            element: which element to replace, counted from 0; one past the end adds one.
            at: simulated time of the swap, in s or text with its unit; at once when None.
            reload: whether to load the kind's plugin file again first.
            parameters: parameters of the new element.
        """
        table = {"kind": kind, **plain(parameters)}
        return self._ask("swap", swap=table, element=element, at=_seconds(at), reload=reload)["tick"]

    def undo(self) -> int | None:
        """Undoes the last swap or set; returns the tick, or None for a change withdrawn before it came into effect."""
        return self._ask("undo").get("tick")

    def pause(self) -> int:
        """Pauses the run at the next tick possible; returns that tick once all before it are done."""
        return self._when_done(self._ask("pause")["tick"])

    def resume(self) -> int:
        """Continues after a pause; returns the tick."""
        return self._ask("resume")["tick"]

    def pace(self, rate: float) -> int:
        """Changes the pace, in simulated seconds per second, infinite for as fast as possible; returns the tick."""
        return self._ask("pace", pace="free" if rate == math.inf else rate)["tick"]

    def step(self, ticks: int = 1) -> int:
        """Runs for some control ticks, then stands still; returns the tick once all of them are done."""
        return self._when_done(self._ask("step", ticks=ticks)["tick"])

    def _when_done(self, tick: int) -> int:
        while self.status()["tick"] < tick:
            time.sleep(_LOOK_S)
        return tick

    def stop(self) -> int:
        """Ends the run in order, with a summary of what ran; returns the tick."""
        return self._ask("stop")["tick"]

    def watch(self, every_s: float = 0.05) -> Iterator[dict[str, NDArray[np.float64]]]:
        """Yields what the controller measured and did since the last item, until the run is over.

        Each item maps columns to arrays of shape (ticks,): ``t`` in s, ``x`` in m, ``v`` in m/s, ``wall``, ``total``
        and ``dissipation.0`` in N, and so on. A reader that is too slow misses ticks and never holds the run up.
        Nothing is yielded while the run stands still: resume it first, or from another thread.
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
        """Resumes the run if it stands still, waits for its end and returns its result."""
        with contextlib.suppress(RunNotFound):  # it has ended
            if self.status()["paused"]:
                self.resume()
        return self.wait()

    def wait(self, timeout_s: float | None = None) -> Result:
        """Waits for the end of the run and returns its result, including the verdict.

        Raises:
            TimeoutError: the run is still going after this time.
            CommandRefused: the run stands still when the wait begins, and would not end unless resumed.
            RunFailed: the run could not continue.
            RunNotFound: the run is on another host, so its files are not on this machine, or it kept none and its
                ``with`` block has been left.
        """
        started, run = self._started, self._run
        if self._result:
            return self._result
        if started and not Path(run.out).exists():
            raise RunNotFound(_LEFT.format(run.id))
        if not started and not run.is_here:
            raise RunNotFound(f"The run at {self.id} keeps its files on its own host; wait for its end there.")
        with contextlib.suppress(RunNotFound):  # it has ended
            if (now := self.status())["paused"]:
                raise CommandRefused(_PAUSED.format(run.id, now["tick"]))
        give_up = math.inf if timeout_s is None else time.monotonic() + timeout_s
        while started.process.poll() is None if started else run_directory.has_launcher(run):
            if time.monotonic() > give_up:
                raise TimeoutError(f"The run {self.id} is still running after {timeout_s} s.")
            time.sleep(_LOOK_S)
        if started and started.process.returncode:
            raise RunFailed(started.told())
        directory, kept = Path(run.out), None
        if started and not started.keeps:
            kept = haploop.logger.read(directory) if (directory / LOG).exists() else Recording({}, "", {})
        scene = self._scene or load(directory / SCENE, plugins=sorted((directory / PLUGINS).glob("*.py")))
        self._result = Result(scene, read_summary(directory / SUMMARY), None if kept is not None else directory, kept)
        self._end()
        return self._result
