"""Runs as somebody who only watches meets them: waiting for one, hearing it to its end, waiting for the next."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Self

from haploop.launch.processes import run_directory
from haploop.launch.processes.run_directory import LiveRun, RunNotFound
from haploop.protocol.clock_client import Aborted, Refused
from haploop.protocol.observer import Observer
from haploop.protocol.processes import PROCESSES
from haploop.protocol.wire import Frame

# How often to look for a run that starts, and to ask again to join one that is about to begin.
_LOOK_S, _ASK_AGAIN_S = 0.05, 0.02
# A run that has not begun after so long never will.
_BEGINS_WITHIN_S = 30.0
# Whoever watches looks around this often, even when nothing is said.
_IDLE_MS = 200


def runs_to_come(run_id: str | None) -> Iterator[LiveRun]:
    """The run with this id alone; without one, the run that is live or starts next, and after it every other.

    Raises:
        RunNotFound: no run has the id, or several are live and none was named.
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
    """Whether a run's launcher has gone, or has cleared the run away."""
    return not (run_directory.is_live(run) and (run.sockets / "run.json").exists())


class Following:
    """One run, heard by an observer from wherever it is to its end; a context manager that leaves it.

    Attributes:
        observer: what hears it.
        failure: why the run ended before its time, as a sentence; "" while it goes on and after an end in order.

    Raises:
        RunNotFound: the run has ended before it could be joined.
        Refused: it does not let the observer join.
    """

    def __init__(self, run: LiveRun, role: str, listens: Sequence[str] = tuple(PROCESSES)) -> None:
        self._run, self._listens = run, listens
        self._over = False
        self._heard = dict.fromkeys(listens, 0)
        self._unheard_ticks = 0
        self.failure = ""
        self._context = run.make_context()
        try:
            self.observer = self._join(role)
        except BaseException:
            self._context.destroy(linger=0)
            raise

    def _join(self, role: str) -> Observer:
        """A run that is about to begin refuses; it is asked again until it has begun."""
        give_up = time.monotonic() + _BEGINS_WITHIN_S
        while not is_over(self._run):
            try:
                return Observer(self._context, role, self._run.clock, self._listens)
            except Refused:
                if time.monotonic() > give_up:
                    raise
                time.sleep(_ASK_AGAIN_S)
        raise RunNotFound(f"Run {self._run.id} ({self._run.title}) has ended.")

    @property
    def skipped_ticks(self) -> int:
        """Ticks that were never heard of, summed over the streams."""
        return sum(self.observer.skipped.values()) + self._unheard_ticks

    def frames(self, every_s: float) -> Iterator[list[tuple[str, Frame]]]:
        """What the run says, (role, message), gathered for ``every_s`` wall seconds each time, until it is over.

        An empty list comes now and then while it says nothing.
        """
        gone = False
        while not self._over:
            self.observer.wait(_IDLE_MS)
            time.sleep(every_s)
            # Its last words may still be on their way when the run is gone: one more turn is for them.
            last = gone
            gone = is_over(self._run)
            try:
                frames = self.observer.poll()
            except (Aborted, Refused) as error:
                self._over, self.failure = True, str(error)
                return
            for role, frame in frames:
                self._heard[role] = frame.fields[0] + (frame.fields[1] if frame.name.endswith("_BLOCK") else 0)
            ended = self.observer.ended.keys() >= set(self._listens)
            self._over = ended or last
            if last and not ended:
                self._miss_the_end()
            yield frames

    def _miss_the_end(self) -> None:
        """The run ended while nobody listened here, or without a word: its summary tells how long it was."""
        summary = summary_of(self.observer.welcome)
        if summary is None:
            self.failure = "Its launcher has gone without a word."
            return
        end = summary["from_tick"] + summary["ticks"]
        missed = (end - tick for role, tick in self._heard.items() if role not in self.observer.ended)
        self._unheard_ticks = sum(max(0, ticks) for ticks in missed)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if not self._over:
            self.observer.leave()
        self._context.destroy(linger=0)


def summary_of(welcome: dict[str, Any]) -> dict[str, Any] | None:
    """The summary a run has left; None where it left none, or on another machine."""
    try:
        return json.loads((Path(welcome["context"]["out"]) / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
