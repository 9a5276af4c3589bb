"""The whole loop in one process: the same plant, controller and logger, without sockets."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from haploop.controller.controller import Controller
from haploop.controller.dissipation import ElementError
from haploop.launch.scene.events import scene_events
from haploop.launch.spec import RunFailed
from haploop.launch.stability.causes import with_causes
from haploop.launch.stability.finding import Finding
from haploop.launch.stability.judge import end_at, judge, with_verdict
from haploop.launch.stability.looks import LOOKS_S
from haploop.logger.session import LogSession, open_session
from haploop.logger.summary import Summary
from haploop.plant.plant import Plant
from haploop.plant.where_it_pays import WhereItPays
from haploop.protocol.changes import Event, is_change, refusal
from haploop.protocol.plugin_file import raised_in_file
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import BlockLength, Timebase

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element
    from haploop.logger.log.recording import MemoryLog
    from haploop.protocol.transport.wire import Message


def run_in_process(
    scene: Scene,
    kinds: dict[str, type[Element]],
    *,
    out: Path | None = None,
    attachments: dict[str, str] | None = None,
    events: list[tuple[int, Event]] | None = None,
    on_progress: Callable[[Message], None] | None = None,
    memory: MemoryLog | None = None,
    stop: Callable[[], bool] = lambda: False,
    causes: bool = False,
) -> Summary:
    """Runs a resolved scene to its end and returns the summary.

    Args:
        out: directory for log and summary; no file is written when None.
        attachments: text files for the log, by name.
        events: (tick, event) in order; the scene's own when None. Pauses concern the wall clock and change nothing.
        on_progress: called from time to time with the logger's status.
        memory: where to log without a directory.
        stop: asked after every block; True ends the run there.
        causes: whether a loop that swings at the end is tried without each of its parts.

    Raises:
        RunFailed: an element raised, or gave something that is not a number.
        LogError: the log could not be written.
    """
    time = Timebase.from_scene(scene)
    session = open_session(scene, time, out, attachments or {}, memory)
    loop = Loop(scene, time, kinds, session)
    loop.schedule(scene_events(scene, time) if events is None else events)
    try:
        while loop.block():
            session.flush_when_due()
            if on_progress:
                on_progress(session.logger.status())
            if stop():
                loop.end_here()
    except ElementError as error:
        loop.fail(f"The controller failed: {error}")
    except ArithmeticError as error:
        loop.fail(f"The plant failed: {raised_in_file(error) or error}")
    except Exception as error:
        if not (why := raised_in_file(error)):
            raise
        loop.fail(f"Code from a plugin file failed: {why}")
    return loop.judged(out, causes)


class Loop:
    """Plant, controller and session of one scene, advanced block by block."""

    def __init__(self, scene: Scene, time: Timebase, kinds: dict[str, type[Element]], session: LogSession) -> None:
        WhereItPays.may_wait = True
        self._plant, self._controller = Plant(scene, time), Controller(scene, time, kinds)
        self._scene, self._session = scene, session
        self._events: list[tuple[int, Event]] = []
        self._end = time.ticks
        self._block = BlockLength(time.block_ticks(scene.run))
        session.logger.start(self._plant.state(), [])

    def schedule(self, events: list[tuple[int, Event]]) -> None:
        self._events += events
        for tick, event in events:
            self._session.logger.event(tick, event)
            if is_change(event):
                self._controller.schedule(tick, event)
                self._plant.schedule(tick, event)
            elif event.get("stop"):
                self._end = min(self._end, tick)

    def block(self) -> bool:
        """Works through one block; returns False when the run has ended."""
        plant, controller = self._plant, self._controller
        until = min(plant.tick + self._block.ticks, self._end)
        plant.run_until(until, lambda _, samples: [float(force) for force in controller.answer(samples)])
        self._hand_over()
        self._block.next()
        return plant.tick < self._end and plant.stop_reason is None

    def _hand_over(self) -> None:
        first, ticks, columns = self._plant.take_block()
        logger = self._session.logger
        if ticks:
            logger.plant_block({"from_tick": first, "ticks": ticks, "columns": columns})
        for block in self._controller.recorder.take():
            logger.controller_block(block)
        refused, restored = self._controller.recorder.take_told()
        for event in (*map(refusal, refused), *restored):
            logger.event(self._controller.tick, event)
            self._events.append((self._controller.tick, event))

    def end_here(self) -> None:
        self.schedule([(self._plant.tick, {"stop": True})])

    def fail(self, reason: str) -> NoReturn:
        """Saves what there is and raises RunFailed."""
        self._hand_over()
        self.finish(reason)
        raise RunFailed(reason)

    def finish(self, failed: str = "") -> Summary:
        """Closes the books and returns the summary; ``failed`` says why the run could not go on."""
        return self._session.close(failed, self._plant.stop_reason, self._controller.recorder.trouble, 0)

    def judged(self, out: Path | None, causes: bool = False) -> Summary:
        """Closes the books of a run that came to its end and returns the summary with the verdict it asks for."""
        summary, logger = self.finish(), self._session.logger

        def find() -> Finding:
            [inside] = logger.window.contacts(np.zeros(1, np.intp))
            end = end_at(self._scene, self._plant, self._controller, inside, self._events)
            found = judge(end, LOOKS_S, thorough=True)
            return with_causes(end, found) if causes else found

        return with_verdict(self._scene, summary, find, out)
