"""An attached node that observes: it receives telemetry, may skip blocks, and never holds the simulation up."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import zmq

from haploop.protocol.changes import Event
from haploop.protocol.transport.clock_client import ClockClient
from haploop.protocol.transport.machine import machine_of
from haploop.protocol.transport.telemetry import Subscriber
from haploop.protocol.transport.wire import Frame

# How often the clock is told how far the observer is, and what it skipped.
_REPORT_S = 0.2


class Observer:
    """Joins a running simulation as a lossy node; for use in one thread, blocking only in ``wait``.

    The clock may drop an observer that was stopped for long (its queue is full then): the observer joins again by
    itself and continues with what is sent from then on.

    Args:
        role: name under which the clock lists it.
        listens: roles whose telemetry it receives.
        goes_on: tells whether the run is still there; called while the clock does not answer.

    Attributes:
        welcome: run, scene, timebase, endpoints, granted and context, as the clock gave them.
        ended: last frame of every stream that has ended, by role: its tick, reason and trouble.

    Raises:
        Refused: the clock did not let it join.
    """

    def __init__(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        role: str,
        clock: str,
        listens: Sequence[str],
        goes_on: Callable[[], bool] = lambda: True,
    ) -> None:
        self._context, self._role, self._clock, self._goes_on = context, role, clock, goes_on
        self._machine = machine_of(context)
        self._taken = 0
        self._events: list[tuple[int, Event]] = []
        self.client = self._join()
        self._streams = Subscriber(context, {name: self.welcome["endpoints"][name] for name in listens})
        self.ended: dict[str, Frame] = {}
        self._report_due = 0.0

    def _join(self) -> ClockClient:
        client = ClockClient(self._context, self._role, self._clock, "")
        try:
            self.welcome = client.join({}, lossless=False, goes_on=self._goes_on)
        except BaseException:
            client.close()
            raise
        client.ready(0)
        self._known_before = self._taken
        return client

    @property
    def tick(self) -> int:
        """Returns the tick before which everything has come from every stream, or never will."""
        return self._streams.tick

    @property
    def skipped(self) -> dict[str, int]:
        """Returns the number of ticks that never came, by role."""
        return self._streams.gaps

    def poll(self) -> list[tuple[str, Frame]]:
        """Returns the messages since the last call, (role, message), without waiting.

        Raises Aborted where the run failed, or the clock continues without this node for good.
        """
        frames = self._streams.drain()
        self.ended |= {role: frame for role, frame in frames if frame.name == "END"}
        self.client.poll()
        if self.client.refused:
            self.client.close()
            self.client = self._join()
        self._note_events()
        now = self._machine.now()
        if now >= self._report_due:
            self._report_due = now + _REPORT_S
            status = {"skipped_ticks": sum(self.skipped.values()), "garbled": self._streams.malformed}
            self.client.progress(self.tick, status)
        return frames

    def _note_events(self) -> None:
        """Takes new events; those that the clock repeats after a node has joined again are skipped."""
        events = self.client.take_events()
        passed = min(self._known_before, len(events))
        self._known_before -= passed
        self._taken += len(events) - passed
        self._events += events[passed:]

    def take_events(self) -> list[tuple[int, Event]]:
        """Returns the events since the last call, (tick, event) in order; at first all since the start of the run."""
        events, self._events = self._events, []
        return events

    def wait(self, timeout_ms: int) -> None:
        """Waits until a message comes, at most ``timeout_ms``."""
        poller = self._machine.poller()
        poller.register(self.client.socket, zmq.POLLIN)
        self._streams.register(poller)
        poller.poll(timeout_ms)

    def leave(self) -> None:
        """Leaves the run, which goes on."""
        self.client.leave("LEAVE", self.tick)
        self._streams.close()
