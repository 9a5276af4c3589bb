"""The viewer: waits for a run, receives it to its end, keeps it on show until the next one starts."""

from __future__ import annotations

import asyncio
import math
import time as wall_clock
from collections.abc import Sequence

from haploop.logger.log import LogError
from haploop.protocol.transport.clock_client import Aborted, Refused
from haploop.protocol.transport.wire import Message
from haploop.view.draw.snapshot import Viewport, snapshot
from haploop.view.receive.ingest import Backfill
from haploop.view.receive.past_session import PastSession
from haploop.view.receive.run_session import RunSession
from haploop.view.receive.runs import CommandFailed, PastRun, Run, Runs, is_live

# Updates per second, at which telemetry is received and shown.
UPDATE_HZ = 31.5
# Intervals at which runs are looked for, and at which pages are updated while nothing comes.
_LOOK_S, _IDLE_TURN_S = 0.2, 0.05
# Number of times that a summary is looked for, which a failed run may still be writing.
_LOOKS = 10
# The log is written at least this often: after this time it holds what was received before.
_LOGGED_S = 0.6
_NOT_BEGUN = 'Run {}, "{}", ended before its first tick; its terminal says why.'
# Number of parts of a run that pages may look at at once without one being made twice.
_MOST_MADE = 4
# How long the answer to opening a live run waits for the run to let the viewer in.
_JOIN_S = 1.0
# Interval at which runs to choose from are looked for.
_LIST_S = 2.0


class Viewer:
    """Follows one run after another.

    Args:
        first: id of the run to follow first; the newest one if None.
        from_start: whether what was logged before joining is shown as well.
        stays: whether another run is followed only when it is chosen.

    Attributes:
        session: the run on show; None before the first.
        overlay: a recorded run that is drawn over it; None without.
        why: a sentence on why no run is on show, if there is one.
    """

    def __init__(self, runs: Runs, first: str | None, from_start: bool, stays: bool = False) -> None:
        self._runs, self._first, self._from_start, self._stays = runs, first, from_start, stays
        self._known: set[str] = set()
        self._opened: tuple[Run, asyncio.Future[bool]] | None = None
        self._updated = asyncio.Event()
        self.session: RunSession | None = None
        self.overlay: RunSession | None = None
        self.why = ""
        self._past: Sequence[PastRun] = ()
        self._followed: RunSession | None = None
        self._listed: tuple[float, Message] = -math.inf, {}
        self._made: dict[tuple[tuple[object, ...], bool], bytes] = {}

    async def wait_for_update(self) -> None:
        """Waits until what there is to show may have changed."""
        await self._updated.wait()

    def snapshot(self, viewport: Viewport, beside: bool) -> tuple[tuple[object, ...], bytes] | None:
        """Returns a key and the snapshot of what is shown in a viewport, made once for all pages that ask.

        ``beside`` asks for what stands beside the charts over time, too; the key is the same with and without it.
        """
        if (session := self.session) is None:
            return None
        key = session.history, session.history.version, self.overlay, viewport
        if (key, beside) not in self._made:
            overlay = self.overlay and self.overlay.history
            others = [(made, data) for made, data in self._made.items() if made[0][:3] == key[:3]]
            self._made = dict(others[-_MOST_MADE:])
            self._made[key, beside] = snapshot(session.history, viewport, session.changes, overlay, beside)
        return key, self._made[key, beside]

    def _notify_pages(self) -> None:
        turned, self._updated = self._updated, asyncio.Event()
        turned.set()

    async def follow_runs(self) -> None:
        while True:
            run, joined = await self._next_run()
            session = await self._join(run)
            found = session or await self._missed(run)
            if not joined.done():
                joined.set_result(found is not None)
            if found is None:
                self.why = _NOT_BEGUN.format(run.id, run.title)
                self._go_back(run)
                continue
            self.session = self._followed = found
            self.why, self._listed = "", (-math.inf, {})
            if session is None:
                await self._complete(found)
                continue
            tasks = [asyncio.create_task(session.clock.keep_asking())]
            if self._from_start:
                tasks.append(asyncio.create_task(self._backfill(session)))
            try:
                await self._receive(session)
            finally:
                await _end(tasks)
                await asyncio.to_thread(session.close)
            if not self._opened:
                await self._complete(session)

    def _go_back(self, gone: Run) -> None:
        """Follows the previous run again, if that is still live, after the run it was left for has gone."""
        left = self._followed
        if left is None or left.outcome:
            self._stays = False  # there is nothing to stay with
        elif left.run.id == gone.id:
            left.end("ended", "")
        else:
            self._opened = left.run, asyncio.get_running_loop().create_future()

    def listing(self) -> Message:
        """Returns the live runs and the recorded ones, looked for now and then, and which are on show.

        ``missed`` is a sentence on a run that could not be shown, ``overlay_diverged`` tells whether the numbers of the
        run drawn over it left every bound, ``overlay_end_s`` when that run ended, ``stays`` whether the page keeps its
        run when that has ended.
        """
        if wall_clock.monotonic() - self._listed[0] > _LIST_S:
            live, self._past = self._runs.live(), self._runs.past()
            named: Message = {
                "live": [{"id": run.id, "title": run.title} for run in live],
                "past": [{"id": run.id, "title": run.title, "told": run.told} for run in self._past],
            }
            self._listed = wall_clock.monotonic(), named
        behind = self.overlay and self.overlay.summary
        shown = {
            "shown": self.session and self._listed_as(self.session),
            "title": self.session and self.session.scene.title,
            "stays": self._stays,
            "missed": self.why,
            "overlay": self.overlay and self.overlay.run.id,
            "overlay_diverged": bool(behind) and behind["verdict"] == "diverged",
            "overlay_end_s": self.overlay and self.overlay.end_s,
        }
        return {"type": "runs", **self._listed[1], **shown}

    def _listed_as(self, session: RunSession) -> str:
        """Returns the id of a run in the list: that of its folder once it is over and recorded there."""
        found = [run.id for run in self._past if session.outcome and run.out.resolve() == session.out.resolve()]
        return found[0] if found else session.run.id

    async def open(self, run_id: str) -> str:
        """Puts a live or a recorded run on show, for all pages.

        Raises:
            CommandFailed: there is no run of that id, or it was gone before it could be joined.
        """
        if self._followed and self._listed_as(self._followed) == run_id:
            self.session = self._followed
        elif run := next((run for run in self._runs.live() if run.id == run_id), None):
            self._opened = run, (joined := asyncio.get_running_loop().create_future())
            await asyncio.wait([joined], timeout=_JOIN_S)
            if not joined.done():
                return f"Run {run_id} is shown as soon as it begins."
            if not joined.result():
                raise CommandFailed(_NOT_BEGUN.format(run_id, run.title))
        else:
            self.session = await self._read(run_id)
        return f"Run {run_id} is shown."

    async def lay_over(self, run_id: str) -> str:
        """Draws a recorded run over the one on show, none for ""; raises CommandFailed as ``open`` does."""
        self.overlay = behind = await self._read(run_id) if run_id else None
        return (
            f"Run {run_id} is drawn over it, to its end at {behind.end_s:g} s." if behind else "No other run is drawn."
        )

    async def _read(self, run_id: str) -> RunSession:
        run = next((run for run in self._runs.past() if run.id == run_id), None)
        if run is None:
            raise CommandFailed(f"There is no run {run_id[:40]!r} that can still be opened.")
        try:
            return await asyncio.to_thread(PastSession, run)
        except (OSError, LogError, ValueError) as error:
            raise CommandFailed(f"Run {run_id} cannot be read: {error}") from error

    async def _next_run(self) -> tuple[Run, asyncio.Future[bool]]:
        """Waits for a run to follow; returns it, and the future that takes whether it could be joined.

        It is the run that was opened or asked for first, or the newest of those that were not there at the last choice.
        """
        while True:
            live = self._runs.live()
            if self._opened:
                opened, self._opened, self._known = self._opened, None, {run.id for run in live}
                return opened
            fresh = self._fresh(live)
            asked_for = [run for run in fresh if self._first and run.id.startswith(self._first)]
            if fresh:
                self._known, self._first = {run.id for run in live}, None
                return [*fresh, *asked_for][-1], asyncio.get_running_loop().create_future()
            await self._idle(_LOOK_S)

    def _fresh(self, live: Sequence[Run]) -> list[Run]:
        fresh = [run for run in live if run.id not in self._known]
        return [run for run in fresh if self._first and run.id.startswith(self._first)] if self._stays else fresh

    async def _idle(self, seconds: float) -> None:
        """Updates pages while no telemetry comes: a page may have changed its viewport."""
        until = wall_clock.monotonic() + seconds
        while wall_clock.monotonic() < until:
            self._notify_pages()
            await asyncio.sleep(_IDLE_TURN_S)

    async def _join(self, run: Run) -> RunSession | None:
        """Joins a run as soon as it has begun; returns None if it is gone by then."""
        while is_live(self._runs, run):
            joining = asyncio.create_task(asyncio.to_thread(RunSession, self._runs, run))
            while not joining.done():
                self._notify_pages()
                await asyncio.wait([joining], timeout=_IDLE_TURN_S)
            try:
                return joining.result()
            except (Refused, Aborted):
                await self._idle(_LOOK_S)
        return None

    async def _missed(self, run: Run) -> RunSession | None:
        """Reads the record of a run that was over before it could be joined; returns None where it left none."""
        for _ in range(_LOOKS):
            is_last = not self._runs.has_launcher(run)
            if record := self._runs.record_of(run):
                try:
                    session = await asyncio.to_thread(PastSession, record)
                except (OSError, LogError, ValueError):
                    return None
                session.run, session.given_up = run, False
                return session
            if is_last:
                return None
            await self._idle(_LOOK_S)
        return None

    async def _receive(self, session: RunSession) -> None:
        due = gone_due = wall_clock.monotonic()
        while not session.outcome and not self._opened:
            session.poll()
            self._notify_pages()
            now = wall_clock.monotonic()
            if now >= gone_due:
                gone_due = now + 1.0
                if not is_live(self._runs, session.run):
                    session.end_without_launcher()
            due = max(due + 1.0 / UPDATE_HZ, now)
            await asyncio.sleep(due - now)
        self._notify_pages()

    async def _complete(self, session: RunSession) -> None:
        """Reads what is available only after the end of a run: what was not received, from its log, and its summary.

        The verdict comes last, when the launcher has judged the run; a new run is not kept waiting for it.
        """
        for _ in range(_LOOKS):
            if session.summary:
                break
            await self._idle(_LOOK_S)
            session.read_summary()
        if self._from_start and not session.is_complete:
            await self._backfill(session)
        while session.verdict_is in ("awaited", "abandoned") and not (self._opened or self._fresh(self._runs.live())):
            session.given_up = not self._runs.has_launcher(session.run)
            session.read_summary()
            await self._idle(_LOOK_S)

    async def _backfill(self, session: RunSession) -> None:
        """Puts what was logged before joining in front of what was received."""
        if session.scene.run.log == "none" or not session.run.is_here:
            return
        backfill = Backfill(session.out, session.scene, session.time, session.events)
        while True:
            over = bool(session.outcome)
            if not over:
                await asyncio.sleep(_LOGGED_S)
            try:
                await asyncio.to_thread(backfill.read)
            except (OSError, LogError):
                if over:
                    return  # no log that this process may read: there is only what was received
                continue  # the logger, welcomed at the same time, may be about to create it
            if over or backfill.reaches(session.history):
                session.prepend(backfill.history)
                return


async def _end(tasks: Sequence[asyncio.Task[None]]) -> None:
    """Cancels tasks that run beside the one that draws; an error in one of them is reported, and ends nothing else."""
    for task in tasks:
        task.cancel()
    for error in await asyncio.gather(*tasks, return_exceptions=True):
        if isinstance(error, Exception):
            loop = asyncio.get_running_loop()
            loop.call_exception_handler({"message": "A task beside the page has failed.", "exception": error})
