"""Sockets that treat messages as ZeroMQ does, in virtual time: in order on one connection, in any order between two.

Nothing is lost but what ZeroMQ may lose: blocks of a publisher to a subscriber that is far behind, and what was still
on its way when a socket was closed without waiting.
"""

from __future__ import annotations

import itertools
from collections import deque
from typing import Any

import zmq

from simulation.computer.world import World

Frames = list[bytes]

# What a connection holds before it is full, ever since libzmq counts what was read in steps of half a high-water mark:
# so many on their way, and so many more received and not read.
ROOM: dict[int, tuple[int, int]] = {zmq.XPUB: (129, 256), zmq.SUB: (129, 256)}
_ROOM = (501, 1000)
_identities = itertools.count(1)
_RETRY_S = 0.02
# Far less than a kernel keeps, as these blocks are far smaller than those of a real run: all reports, and a block.
_KERNEL_BYTES = 4096


class Lane:
    """One direction of a connection."""

    def __init__(self, world: World, pipe: Pipe, kind: int) -> None:
        self._world, self._pipe = world, pipe
        self._flying_room, self._room = ROOM.get(kind, _ROOM)
        self.flying: deque[Frames] = deque()
        self.inbox: deque[Frames] = deque()
        self.to: Any = None
        self.last = world.now

    @property
    def is_full(self) -> bool:
        flying = len(self.flying)
        return flying >= self._flying_room or flying + len(self.inbox) >= self._flying_room + self._room

    def send(self, frames: Frames) -> None:
        self.flying.append(frames)
        if self.to is not None:
            self._launch()

    def _launch(self) -> None:
        world = self._world
        late_s = self._pipe.near.process.late_s + self._pipe.far.process.late_s
        self.last = max(self.last, world.now + world.delay() + late_s)
        world.at(self.last, self._arrive)

    def open(self, to: Any) -> None:
        """Connects it; what was sent before sets out now."""
        self.to = to
        for _ in range(len(self.flying)):
            self._launch()

    @property
    def arrives_at(self) -> float:
        """When the last of it arrives: a process that is stopped takes nothing."""
        return max(self.last, self.to.process.stopped_until) if self.flying and self.to is not None else self.last

    @property
    def due(self) -> float:
        """When the last of it is off its sender's hands."""
        return self.last if self._in_the_kernel == len(self.flying) else self.arrives_at

    @property
    def _in_the_kernel(self) -> int:
        """How many of the messages under way the kernel keeps for a process that is stopped."""
        sizes = itertools.accumulate(sum(map(len, frames)) for frames in self.flying)
        return sum(size <= _KERNEL_BYTES for size in sizes)

    def _arrive(self) -> None:
        if self.to is not None and self._world.now < self.to.process.stopped_until:
            self._world.at(self.to.process.stopped_until, self._arrive)
            return
        if self.flying and self.to is not None:
            self.to.take(self._pipe, self, self.flying.popleft())

    def cut(self, linger_s: float) -> None:
        """Ends it: without linger, some of what is on its way, the latest, is lost."""
        world = self._world
        is_lost = self.to is None or linger_s <= 0.0 or self.last > world.now + linger_s
        if is_lost or self.due > world.now + linger_s:
            for _ in range(world.dice.randint(0, len(self.flying) - (0 if is_lost else self._in_the_kernel))):
                self.flying.pop()


class Pipe:
    """A connection from a socket that connects to one that is bound."""

    def __init__(self, world: World, near: Any, address: str) -> None:
        self._world, self.near, self.address = world, near, address
        self.far: Any = None
        self.identity = b"\0" + next(_identities).to_bytes(4, "big")
        self.there = Lane(world, self, near.kind)
        self.back = Lane(world, self, near.kind)
        self.topics: set[bytes] = set()
        self.given_up_at = float("inf")
        world.after(world.delay(), self._shake_hands)

    def _shake_hands(self) -> None:
        far = self._world.listening.get(self.address)
        if self._world.now > self.given_up_at or (self.near.is_closed and not self.there.flying):
            return
        if far is None:
            self._world.after(_RETRY_S, self._shake_hands)
            return
        self.far = far
        far.pipes[self.identity] = self
        self.back.to = self.near
        self.near.greet(self)
        self.there.open(far)

    def lane_from(self, socket: Any) -> Lane:
        return self.there if socket is self.near else self.back

    def lane_to(self, socket: Any) -> Lane:
        return self.back if socket is self.near else self.there

    def close(self, end: Any, linger_s: float) -> None:
        """Closes one end; the other hears of it after the last message that still comes."""
        away = self.lane_from(end)
        away.cut(linger_s)
        self.lane_to(end).flying.clear()
        if self.far is None:
            self.given_up_at = self._world.now + linger_s
            if linger_s > 0.0:
                self._world.after(linger_s, self._hang_up, end)
        else:
            self._world.at(away.arrives_at, self._hang_up, end)

    def _hang_up(self, end: Any) -> None:
        other = self.far if end is self.near else self.near
        if other is not None:
            other.lose(self)
