"""Observation of runs by attached nodes: waiting for a run, receiving it to its end, waiting for the next."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Self

from haploop.launch.processes import run_directory
from haploop.launch.processes.run_directory import Elsewhere, LiveRun, RunNotFound
from haploop.logger.log import LogError
from haploop.logger.summary import SUMMARY, Summary, read
from haploop.protocol.transport.clock_client import Aborted, Refused
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.observer import Observer
from haploop.protocol.transport.wire import Frame, Message

# Intervals at which to look for a run that starts, and to ask again to join one that is about to begin.
_LOOK_S, _ASK_AGAIN_S = 0.05, 0.02
# Time after which a run that has not begun never will.
_BEGINS_WITHIN_S = 30.0
# Longest wait for a message before the state of the run is checked.
_IDLE_MS = 200


def iterate_runs(run_id: str | Elsewhere | None) -> Iterator[LiveRun]:
    """Yields the run with this id alone; without one, the run that is live or starts next, and then all later ones.

    Raises RunNotFound where no run has the id, or several are live and none was named.
    """
    if run_id is not None or len(run_directory.live_runs()) > 1:
        yield run_directory.find(run_id)
        return
    seen: set[str] = set()
    while True:
        new = next((run for run in run_directory.live_runs() if run.id not in seen), None)
        if new is None:
            time.sleep(_LOOK_S)
        else:
            seen.add(new.id)
            yield new


def is_over(run: LiveRun) -> bool:
    """Tells whether a run's launcher has gone, or has removed the run's directory."""
    return run.sockets is not None and not (run_directory.is_live(run) and (run.sockets / "run.json").exists())


class ObservedRun:
    """Observes one run from its present tick to its end; a context manager that leaves it.

    ``failure`` says why the run ended early; "" while it goes on and after a normal end. Raises RunNotFound where the
    run has ended before it could be joined, Refused where it does not let the observer join.
    """

    def __init__(self, run: LiveRun, role: str) -> None:
        self._run = run
        self._over = False
        self._received = dict.fromkeys(PROCESSES, 0)
        self._missed_ticks = 0
        self.failure = ""
        self._context = run.make_context()
        try:
            self.observer = self._join(role)
        except BaseException:
            self._context.destroy(linger=0)
            raise

    def _join(self, role: str) -> Observer:
        """Joins the run; one that is about to begin refuses, and is asked again until it has begun."""
        give_up = time.monotonic() + _BEGINS_WITHIN_S
        while not is_over(self._run):
            try:
                return Observer(self._context, role, self._run.clock, tuple(PROCESSES), lambda: not is_over(self._run))
            except Refused:
                if time.monotonic() > give_up:
                    raise
                time.sleep(_ASK_AGAIN_S)
        raise RunNotFound(f"Run {self._run.id} ({self._run.title}) has ended.")

    @property
    def skipped_ticks(self) -> int:
        """Returns the ticks that were never received, summed over the streams."""
        return sum(self.observer.skipped.values()) + self._missed_ticks

    def frames(self, every_s: float) -> Iterator[list[tuple[str, Frame]]]:
        """Yields the messages of ``every_s`` wall seconds at a time, (role, message), until the run is over.

        An empty list comes now and then while there are none.
        """
        gone = False
        while not self._over:
            self.observer.wait(_IDLE_MS)
            time.sleep(every_s)
            # Its last messages may still be on their way when the run is gone: they are polled once more.
            last = gone
            gone = is_over(self._run)
            try:
                frames = self.observer.poll()
            except (Aborted, Refused) as error:
                self._over, self.failure = True, str(error)
                return
            for role, frame in frames:
                self._received[role] = frame.fields[0] + (frame.fields[1] if frame.name.endswith("_BLOCK") else 0)
            ended = self.observer.ended.keys() >= set(PROCESSES)
            self._over = ended or last
            if last and not ended:
                self._count_missed()
            yield frames

    def _count_missed(self) -> None:
        """Counts what was missed of a run whose END never came; its summary tells how long it was."""
        summary = read_summary(self._run, self.observer.welcome)
        if summary is None:
            self.failure = "Its launcher has ended without a word."
            return
        end = summary["from_tick"] + summary["ticks"]
        missed = (end - tick for role, tick in self._received.items() if role not in self.observer.ended)
        self._missed_ticks = sum(max(0, ticks) for ticks in missed)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if not self._over:
            self.observer.leave()
        self._context.destroy(linger=0)


def read_summary(run: LiveRun, welcome: Message) -> Summary | None:
    """Returns the summary that a run has written; None where there is none, or it is on another machine."""
    if not run.is_here:
        return None
    try:
        return read(Path(welcome["context"]["out"]) / SUMMARY)
    except LogError:
        return None
