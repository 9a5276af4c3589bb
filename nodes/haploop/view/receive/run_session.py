"""One run as a viewer hears it, from joining it to its end and beyond."""

from __future__ import annotations

import contextlib
import json
import time as wall_clock
from collections import deque
from pathlib import Path
from typing import Any

import zmq

from haploop.protocol.changes import at_work, changes_of
from haploop.protocol.clock_client import Aborted, Refused
from haploop.protocol.observer import Observer
from haploop.protocol.ticks import DELAY, Timebase
from haploop.view.receive.at_work import elements_of, wall_of
from haploop.view.receive.ingest import hear
from haploop.view.receive.runs import Run
from haploop.view.store.history import History

ROLE = "view"
_STREAMS = ("plant", "controller", "logger")
# Real time is counted over so much of it, and over no less.
_FACTOR_S, _LEAST_FACTOR_S = 1.0, 0.3


class Followed:
    """A run, what is known of it, and how it ended.

    Making one joins the run, which may take a while.

    Attributes:
        run: as it was found.
        scene, time, out: the resolved scene, its integers, the run's directory.
        history: what was heard.
        status: how the run looks, as its logger says.
        events: (tick, event) in order, everything that changed the run.
        delay_s: the round-trip delay as it stands.
        over: "" while the run goes on, then "ended" or "failed"; ``why`` is a sentence, if there is one.
        summary: of the run, once it is there.

    Raises:
        Refused, Aborted: the run did not let this viewer in.
    """

    def __init__(self, run: Run) -> None:
        self.run = run
        self._context = run.make_context()
        try:
            self._observer = Observer(self._context, ROLE, run.clock, _STREAMS)
        except (Refused, Aborted):
            self._context.destroy(linger=0)
            raise
        welcome = self._observer.welcome
        self.scene: dict[str, Any] = welcome["scene"]
        self.time = Timebase(**welcome["timebase"])
        self.out = Path(welcome["context"]["out"])
        window = self.scene["run"]["window_blocks"] * self.scene["run"]["block_ticks"]
        self.history = History(self.time, max(0, welcome["granted"] - window))
        self.status: dict[str, Any] = {}
        self.events: list[tuple[int, dict[str, Any]]] = []
        self.delay_s: float = self.scene["clock"]["round_trip_delay"]
        self.over = self.why = ""
        self.summary: dict[str, Any] | None = None
        self.skipped_ticks = 0
        self._seen: deque[tuple[float, int]] = deque()

    def poll(self) -> None:
        """Take in what has come."""
        if self.over:
            return
        try:
            frames = self._observer.poll()
        except (Aborted, Refused) as error:
            self.end("failed", str(error))
            return
        self.status |= hear(self.history, frames)
        self._note_events()
        if not self.history.wall:
            now = at_work(self.scene, changes_of(self.events))
            self.history.works(elements_of(now), wall_of(now))
        self.skipped_ticks = sum(self._observer.skipped.values())
        self._count_time()
        if "logger" in self._observer.ended:
            self.end("ended", "")

    def _count_time(self) -> None:
        """Remember when how much had come, as far back as the real-time factor looks."""
        now = wall_clock.monotonic()
        if self.history.first_tick is not None:
            self._seen.append((now, self.history.end_tick))
        while self._seen and now - self._seen[0][0] > _FACTOR_S:
            self._seen.popleft()

    def _note_events(self) -> None:
        events = self._observer.take_events()
        self.events += events
        for _, event in events:
            self.delay_s = event.get("set", {}).get(DELAY, self.delay_s)

    @property
    def real_time_factor(self) -> float | None:
        """Simulated seconds per second of the last one; None when nothing moves."""
        if len(self._seen) < 2:
            return None
        (began, first), (now, last) = self._seen[0], self._seen[-1]
        moves = not self.over and last > first and now - began > _LEAST_FACTOR_S
        return (last - first) / self.time.control_rate / (now - began) if moves else None

    def end(self, how: str, why: str) -> None:
        """The run is over: nothing more will come."""
        self._note_events()
        self.over, self.why = how, why
        self.read_summary()

    def close(self) -> None:
        """Leave the run, which may go on, and let go of its sockets."""
        with contextlib.suppress(zmq.ZMQError):  # closed already, where the clock did not let this viewer in again
            self._observer.leave()
        self._context.destroy(linger=200)

    def read_summary(self) -> None:
        """Look for the run's summary; a run that failed may still be writing it."""
        try:
            summary = json.loads((self.out / "summary.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return
        self.summary = summary
        self.over = "failed" if summary.get("ended") == "failed" else self.over
        self.why = self.why or summary.get("why", "")

    @property
    def is_complete(self) -> bool:
        """Whether every tick was surely heard from the start on."""
        begun = all(track.first_tick == 0 for track in self.history.tracks)
        return begun and not self.skipped_ticks and self.over != "failed"

    def recall(self, past: History) -> None:
        """Put what was read of the log in front of what was heard."""
        past.continue_with(self.history)
        self.history = past
