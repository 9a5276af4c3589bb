"""The logger as a process: listens to plant and controller, keeps the books, writes log and summary."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import zmq

from haploop.logger.books.buffers import TelemetryGap
from haploop.logger.log import LogError
from haploop.logger.session import open_session
from haploop.logger.summary import Summary
from haploop.protocol.changes import refusals_as_status
from haploop.protocol.plugin_file import bring_file
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.clock_client import REPORT_MS, Aborted, ClockClient
from haploop.protocol.transport.machine import machine_of
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.node import NodeError, run_node
from haploop.protocol.transport.sockets import bind
from haploop.protocol.transport.telemetry import Publisher, Subscriber
from haploop.protocol.transport.wire import Frame, Message

if TYPE_CHECKING:
    from haploop.logger.carried_out import CarriedOut

ROLE = "logger"
_LISTENS = ("plant", "controller")
# Shortest interval at which books go out to viewers and the verdict is judged again.
_STATUS_S = 0.1
# How long another logger waits for the states from which it continues, s.
_STATE_S = 15.0
# How long a last block that was sent may be on its way.
_LAST_MS = 100
_NO_STATE = (
    "No STATE of the {} came within {:g} s: it does not answer a second subscription, which ZeroMQ hands to it only "
    "with ZMQ_XPUB_VERBOSE."
)


class LoggerNode:
    """Takes every block there is; its progress limits how far the loop may run ahead.

    The run's own logger is one; any number of others may join later, each with a directory of its own.

    Args:
        leave: called in every cycle; returns None to stay, why it is useless to stay, or "" to leave in order.
    """

    def __init__(
        self,
        client: ClockClient,
        context: zmq.Context[zmq.Socket[bytes]],
        publisher: Publisher | None,
        leave: Callable[[], str | None] = lambda: None,
    ) -> None:
        self._client, self._context, self._publisher, self._leave = client, context, publisher, leave
        self._machine = machine_of(context)
        self._ended: dict[str, tuple[int, str, str | None]] = {}
        self._status: Message = {}
        self._status_due = 0.0
        self._judged_at = 0
        self._started = False
        self._foreign: dict[str, bool] = {}
        self._carried_out: CarriedOut | None = None

    @property
    def _tick(self) -> int:
        return self.session.logger.tick

    def start(self, welcome: Message, out: Path) -> None:
        """Subscribes to plant and controller, takes their state, and reports that it is ready."""
        self.out = out
        self._streams = Subscriber(self._context, {role: welcome["endpoints"][role] for role in _LISTENS})
        for path in welcome["context"].get("brings", ()):
            bring_file(Path(path))
        attachments = welcome["context"].get("attachments", {})
        scene, time = Scene.from_dict(welcome["scene"]), Timebase(**welcome["timebase"])
        self.session = open_session(scene, time, out, attachments, machine=self._machine)
        self.session.programs = welcome["context"].get("programs", {})
        self._foreign = {role: not program["own"] for role, program in self.session.programs.items()}
        self.session.logger.foreign = tuple(role for role, is_foreign in self._foreign.items() if is_foreign)
        self._scene, self._time = scene, time
        if any(self._foreign.values()) and self._publisher:  # the run's own logger
            from haploop.logger.carried_out import CarriedOut

            self._carried_out = CarriedOut(scene, time, self.session.logger.foreign)
        self.session.logger.booked = self._publish_energy
        states: dict[str, Message] = {}
        give_up = self._machine.now() + _STATE_S
        early: list[tuple[str, Frame]] = []
        while len(states) < len(_LISTENS):
            received = self._streams.receive(REPORT_MS)
            for role, frame in received:
                self._check(role, frame)
                if frame.name == "STATE":
                    states[role] = {"tick": frame.fields[0], **frame.fields[1]}
                else:
                    early.append((role, frame))
            if not received:
                missing = "controller" if "plant" in states else "plant"
                self._client.waiting(0, f"{missing}'s STATE")
                if not self._publisher and self._machine.now() > give_up:
                    raise Aborted(_NO_STATE.format(missing, _STATE_S))
            self._client.poll()
            if (why := self._leave()) is not None:
                raise Aborted(why or "The logger left before it received anything.")
        controller = states["controller"]
        self.session.logger.start(states["plant"], controller["history"], controller["tick"])
        self._started = True
        for role, frame in early:
            self._take(role, frame)
        self._client.ready(self._tick)

    def run(self) -> tuple[int, Summary]:
        """Takes blocks until plant and controller have ended, then closes the log and writes the summary."""
        poller = self._machine.poller()
        poller.register(self._client.socket, zmq.POLLIN)
        self._streams.register(poller)
        reported = -1
        # The last grant brings the last events.
        while len(self._ended) < len(_LISTENS) or not self._client.last or self._awaits_refusals:
            idle = not poller.poll(REPORT_MS)
            if not self._client.until:  # the run has not begun
                self.session.logger.count_wall_time()
            if idle or self._client.is_quiet:  # blocks of only one of them complete no tick
                self._client.waiting(self._tick, self._awaited)
            self._drain()
            self._client.poll()
            self._note_events()
            if (why := self._leave()) is not None and (idle or not why):  # what still arrives is taken first
                return self.finish(why)
            if self._carried_out:
                self._report_refusals(self._carried_out)
            if self._reached != reported or (idle and self._tick != self._judged_at):
                reported = self._reached
                self._report(reported)
            if self._publisher:
                self._publisher.serve()
            self.session.flush_when_due()
        if any(self._foreign.values()):
            self._demand_all_blocks()
        return self.finish("")

    def _demand_all_blocks(self) -> None:
        """Fails the run if a foreign program has ended without having sent all of its blocks."""
        end = min(tick for tick, *_ in self._ended.values())
        if self._tick < end:
            why = f"The {self._streams.slowest} has ended at tick {end}, but its blocks reach only tick {self._tick}."
            raise NodeError(why)

    @property
    def _awaited(self) -> str:
        """The role that this logger waits for, and for what from it where nothing else is missing."""
        missing = [role for role in _LISTENS if role not in self._ended]
        is_at_end = len(missing) == 1 or (self._client.last and self._tick >= self._client.until)
        return f"{missing[0]}'s END" if missing and is_at_end else self._streams.slowest

    @property
    def _reached(self) -> int:
        """The tick up to which everything is booked and all changes were looked for."""
        return int(min(self._tick, self._carried_out.tick)) if self._carried_out else self._tick

    @property
    def _awaits_refusals(self) -> bool:
        return self._carried_out is not None and bool(self._carried_out.awaited)

    def _report_refusals(self, carried_out: CarriedOut) -> None:
        """Tells the clock of changes that the controller did not carry out; they come back as events."""
        refused = carried_out.judge(self._client.until)
        if refused:
            self._client.progress(self._reached, self._status | (refusals_as_status(refused) or {}))

    def _drain(self, wait_ms: int = 0) -> bool:
        """Takes what has arrived, or arrives within ``wait_ms``; tells whether there was anything."""
        came = self._streams.receive(wait_ms) if wait_ms else self._streams.drain()
        for role, frame in came:
            self._check(role, frame)
            try:
                self._take(role, frame)
            except (ArithmeticError, LookupError, RuntimeError, TypeError, ValueError) as error:
                if not self._foreign or isinstance(error, TelemetryGap):
                    raise
                what = f"{frame.name} of the {role} from tick {frame.fields[0]}"
                raise NodeError(f"{what} cannot be booked: {type(error).__name__}: {error}.") from error
        return bool(came)

    def _check(self, role: str, frame: Frame) -> None:
        """Checks what a foreign program has sent.

        Raises NodeError where it cannot be booked.
        """
        if self._foreign.get(role):
            from haploop.logger.foreign import complaint

            if why := complaint(frame, role, self._scene, self._time):
                raise NodeError(why)

    def _take(self, role: str, frame: Frame) -> None:
        if frame.name == "PLANT_BLOCK":
            self.session.logger.plant_block(frame.as_dict())
            if self._carried_out:
                self._carried_out.add_motion(frame.as_dict())
        elif frame.name == "CONTROLLER_BLOCK":
            self.session.logger.controller_block(frame.as_dict())
            if self._carried_out:
                self._carried_out.add(frame.as_dict())
        elif frame.name == "END":
            tick, reason, trouble = frame.fields
            self._ended[role] = tick, reason, trouble

    def _note_events(self) -> None:
        for tick, event in self._client.take_events():
            self.session.logger.event(tick, event)
            if self._carried_out:
                self._carried_out.note(tick, event)

    def _report(self, tick: int) -> None:
        now = self._machine.now()
        if now < self._status_due:
            self._client.progress(tick)
            return
        self._status_due = now + _STATUS_S
        self._status, self._judged_at = self.session.logger.status(), tick
        self._client.progress(tick, self._status)

    def _publish_energy(self, first: int, books: dict[str, np.ndarray]) -> None:
        if self._publisher and self._publisher.subscribed:
            columns = {name: column.tobytes() for name, column in books.items()}
            self._publisher.publish("ENERGY_BLOCK", first, self._tick - first, columns, self._status)

    def save(self, failed: str) -> Summary | None:
        """Finishes for the reason in ``failed``, with the blocks that were sent; returns None if nothing has begun."""
        if not self._started:
            return None
        with contextlib.suppress(TelemetryGap, NodeError):
            while self._drain(_LAST_MS):
                pass
        return self.finish(failed)[1]

    def finish(self, failed: str) -> tuple[int, Summary]:
        """Closes the log and writes the summary of what ran; ``failed`` says why it ended early, if it did."""
        self._note_events()
        self._streams.close()
        reason = next((reason for _, reason, _ in self._ended.values() if reason), None)
        trouble = next((trouble for _, _, trouble in self._ended.values() if trouble), None)
        result = self.session.close(failed, reason, trouble, sum(self._streams.gaps.values()))
        if self._publisher:
            self._publisher.publish("END", self._tick, reason or "", trouble)
        return self._tick, result


def work(client: ClockClient, context: zmq.Context[zmq.Socket[bytes]], directory: Path) -> tuple[int, Summary]:
    node: LoggerNode
    publisher = Publisher(context, ROLE, lambda: (node.session.logger.tick, node.session.logger.status()))
    address = bind(publisher.socket, directory, PROCESSES[ROLE].binds["telemetry"])
    welcome = client.join({"telemetry": address})
    node = LoggerNode(client, context, publisher)
    try:
        try:
            node.start(welcome, Path(welcome["context"]["out"]))
            return node.run()
        except (Aborted, NodeError) as error:
            node.save(str(error))
            raise
    except LogError as error:
        raise NodeError(str(error)) from error


if __name__ == "__main__":
    run_node(ROLE, work)
