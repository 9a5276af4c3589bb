"""Virtual time, and the processes that share it: greenlets, of which a seed decides who runs when, and who is stopped.

A process runs without time passing until it waits. Time jumps from event to event, so that a stall of minutes costs
nothing; what is drawn from ``World.dice`` is the same for the same seed.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from heapq import heappop, heappush
from random import Random
from typing import Any

from greenlet import getcurrent, greenlet

# More events than this in one run: something goes round and round.
_MOST_EVENTS = 100_000
# What a turn takes at least: to wait for no time at all takes time, too.
_TURN_S = 5e-6


class Killed(BaseException):
    """Raised in a process that was killed, so that its stack unwinds; nothing it does any more is seen by others."""


class Stuck(Exception):
    """Raised where a history does not come to its end; the message says what it waits for."""


class World:
    """Time, the order of events, and who is running.

    Args:
        jumpiness: chance that a process loses the processor where it need not wait (a send, a look at a socket).
        latency_s: mean of what a message is on its way; a few take far longer.
    """

    def __init__(self, seed: object, jumpiness: float = 0.0, latency_s: float = 50e-6) -> None:
        self.dice = Random(str(seed))
        self.jumpiness, self.latency_s = jumpiness, latency_s
        self.now = 1000.0
        self.running: Process | None = None
        self.processes: list[Process] = []
        self.listening: dict[str, Any] = {}
        self.scheduler = getcurrent()
        self.history: deque[tuple[float, str]] = deque(maxlen=400)
        self._events: list[tuple[float, int, Callable[..., object], tuple[Any, ...]]] = []
        self._number = 0

    def note(self, what: str) -> None:
        """Puts a line into the history, which a failing seed shows."""
        self.history.append((self.now, what))

    def at(self, when: float, call: Callable[..., object], *arguments: Any) -> None:
        self._number += 1
        heappush(self._events, (max(when, self.now), self._number, call, arguments))

    def after(self, delay_s: float, call: Callable[..., object], *arguments: Any) -> None:
        self.at(self.now + delay_s, call, *arguments)

    def delay(self) -> float:
        """Draws how long a message is on its way, s: exponentially, and one in a hundred fifty times as long."""
        dice = self.dice
        return dice.expovariate(1.0 / self.latency_s) * (50.0 if dice.random() < 0.01 else 1.0)

    def run(self, done: Callable[[], bool], until: Callable[[], float]) -> None:
        """Lets time go on until ``done``; raises Stuck at the time ``until``, or where nothing is left to happen."""
        for _ in range(_MOST_EVENTS):
            if done():
                return
            if not self._events:
                raise Stuck("nothing is left that could happen")
            self.now, _, call, arguments = heappop(self._events)
            if self.now > until():
                raise Stuck(f"it goes on without end; {', '.join(p.whereabouts() for p in self.processes if p.alive)}")
            call(*arguments)
        raise Stuck(f"{_MOST_EVENTS} events were not enough to come to an end")

    def clear_away(self) -> None:
        """Unwinds the stacks of all that still run."""
        for process in self.processes:
            process.kill()
            process.unwind()


class Process:
    """One process: it runs ``work`` until it waits, goes on when what it waits for has come, and may be killed.

    Attributes:
        status: exit status once it has ended; -9 where it was killed.
        result, error: what ``work`` returned, or raised.
        granted: the tick before which it has been allowed to work, as far as it has read.
        slow_s, late_s: what every turn of it, and every message from it or to it, is delayed by.
    """

    def __init__(self, world: World, name: str, work: Callable[[], Any], delay_s: float = 0.0) -> None:
        self.world, self.name, self._work = world, name, work
        self.alive, self.status = True, 0
        self.result: Any = None
        self.error: BaseException | None = None
        self.ended_at = 0.0
        self.granted = 0
        self.slow_s = self.late_s = self.stopped_until = self.stopped_s = 0.0
        self.sockets: list[Any] = []
        self.on_end: list[Callable[[], object]] = []
        self._ready: Callable[[], bool] | None = None
        self._ticket = 0
        self._greenlet = greenlet(self._main, parent=world.scheduler)
        world.processes.append(self)
        world.after(delay_s, self._go_on, 0)

    def _main(self) -> None:
        try:
            self.result = self._work()
            self.status = self.result if isinstance(self.result, int) else 0
        except Killed:
            return
        except BaseException as error:
            self.error, self.status = error, 1
        self._over()

    def _over(self) -> None:
        self.alive = False
        self.ended_at = self.world.now
        for socket in list(self.sockets):
            socket.vanish()
        for call in self.on_end:
            call()

    def wait(self, ready: Callable[[], bool], timeout_s: float | None) -> bool:
        """Waits until ``ready``, at most so long; returns whether it is. For the process that runs."""
        self.check()
        if not ready():
            self._ticket += 1
            self._ready = ready
            if timeout_s is not None:
                self.world.after(max(timeout_s, _TURN_S), self._go_on, self._ticket)
            self.world.scheduler.switch()
        self.check()
        return ready()

    def sleep(self, seconds: float) -> None:
        self.wait(lambda: False, seconds)

    def may_lose_the_processor(self) -> None:
        self.check()
        world = self.world
        if world.jumpiness and world.dice.random() < world.jumpiness:
            self.sleep(world.dice.expovariate(1e4))

    def check(self) -> None:
        """Raises Killed in a process that has been."""
        if not self.alive:
            raise Killed

    def nudge(self) -> None:
        """Has it look again whether what it waits for has come."""
        if self._ready is not None and self._ready():
            self._ready = None
            self.world.after(self.world.dice.random() * 40e-6 + self.slow_s, self._go_on, self._ticket)

    def _go_on(self, ticket: int) -> None:
        if ticket != self._ticket or not self.alive:
            return
        if self.world.now < self.stopped_until:
            self.world.at(self.stopped_until, self._go_on, ticket)
            return
        self._ticket += 1
        self._ready = None
        self.world.running = self
        self._greenlet.switch()

    def stop(self, seconds: float) -> None:
        """Stops it, as SIGSTOP does, for some time."""
        self.stopped_until = max(self.stopped_until, self.world.now + seconds)
        self.stopped_s += seconds

    def kill(self, unwound_after_s: float = 0.0) -> None:
        """Ends it now, whatever it is doing; its stack, with what that holds of the disk, is unwound later."""
        if self.alive:
            self.status = -9
            self._over()
            if self._greenlet is not getcurrent():
                self.world.after(unwound_after_s, self.unwind)

    def unwind(self) -> None:
        if self._greenlet and not self.alive:
            self.world.running = self
            self._greenlet.throw(Killed)

    def whereabouts(self) -> str:
        frame = self._greenlet.gr_frame
        while frame and "/simulation/" in frame.f_code.co_filename:
            frame = frame.f_back
        where = f" in {frame.f_code.co_qualname}, line {frame.f_lineno}" if frame else ""
        return f"{self.name} waits{where}"
