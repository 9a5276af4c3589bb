"""An attached node that watches: it hears telemetry, may skip what it is too slow for, and never holds the loop up."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import zmq

from haploop.protocol.clock_client import ClockClient
from haploop.protocol.telemetry import Subscriber
from haploop.protocol.wire import Frame

# How often the clock is told how far the observer is, and what it skipped.
_REPORT_S = 0.2


class Observer:
    """A lossy node of a running loop; one thread's, never blocking but in ``wait``.

    The clock may drop one that was stopped for long (its queue is full then): it joins again by itself and goes on
    with what is sent from there.

    Args:
        context: of the run's transport.
        role: under which name the clock lists it.
        clock: the clock's address.
        listens: roles whose telemetry it hears.

    Attributes:
        welcome: run, scene, timebase, endpoints, granted and context, as the clock gave them.
        ended: last frame of every stream that has ended, by role: its tick, reason and trouble.

    Raises:
        Refused: the clock did not let it join.
    """

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], role: str, clock: str, listens: Sequence[str]) -> None:
        self._context, self._role, self._clock = context, role, clock
        self._taken = 0
        self._events: list[tuple[int, dict[str, Any]]] = []
        self._client = self._join()
        addresses = {name: self.welcome["endpoints"][name]["telemetry"] for name in listens}
        self._streams = Subscriber(context, addresses)
        self.ended: dict[str, Frame] = {}
        self._report_due = 0.0

    def _join(self) -> ClockClient:
        client = ClockClient(self._context, self._role, self._clock, "")
        try:
            self.welcome = client.join({}, lossless=False)
        except BaseException:
            client.close()
            raise
        client.ready(0)
        self._known_before = self._taken
        return client

    @property
    def skipped(self) -> dict[str, int]:
        """Ticks that never came, by role."""
        return self._streams.gaps

    def poll(self) -> list[tuple[str, Frame]]:
        """What came since the last call, (role, message), without waiting.

        Raises:
            Aborted: the run failed, or the clock goes on without this node for good.
        """
        frames = self._streams.drain()
        self.ended |= {role: frame for role, frame in frames if frame.name == "END"}
        self._client.poll()
        if self._client.refused:
            self._client.close()
            self._client = self._join()
        self._note_events()
        now = time.monotonic()
        if now >= self._report_due:
            self._report_due = now + _REPORT_S
            status = {"skipped_ticks": sum(self.skipped.values()), "garbled": self._streams.malformed}
            self._client.progress(min(self._streams.tick, self._client.until), status)
        return frames

    def _note_events(self) -> None:
        """The clock tells all events from the first on whenever a node joins: those known already are passed over."""
        events = self._client.take_events()
        passed = min(self._known_before, len(events))
        self._known_before -= passed
        self._taken += len(events) - passed
        self._events += events[passed:]

    def take_events(self) -> list[tuple[int, dict[str, Any]]]:
        """What changed the run, (tick, event) in order, since the last call; at first everything since its start."""
        events, self._events = self._events, []
        return events

    def wait(self, timeout_ms: int) -> None:
        """Wait until something comes."""
        poller = zmq.Poller()
        poller.register(self._client.socket, zmq.POLLIN)
        self._streams.register(poller)
        poller.poll(timeout_ms)

    def leave(self) -> None:
        """Go; the run goes on."""
        self._client.leave("LEAVE", self._streams.tick)
        self._streams.close()
