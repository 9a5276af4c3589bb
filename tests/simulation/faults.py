"""Faults of processes, network and disk of a run: each with what it excuses, and how long it takes.

A run may end as a failure only with a sentence that one of its faults excuses; all other histories end in order.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from simulation.sim import Sim

OWN = ("plant", "controller", "logger")
ALL = (*OWN, "launcher")
OPERATIONS = ("create", "write", "rename")


class When(NamedTuple):
    """A time after the tick ``tick`` was granted, or after the launch where it is -1, s."""

    tick: int
    delay_s: float


@dataclass(frozen=True)
class Fault:
    """Something that happens once.

    Attributes:
        excuse: pattern of the failures of the run that it may lead to, "" for none.
        lasts_s: how long after it happened it may hold the run up.
    """

    when: When

    @property
    def excuse(self) -> str:
        return ""

    @property
    def lasts_s(self) -> float:
        return 0.0

    def silences(self, role: str) -> float:
        """Returns for how long a process may be silent because of it, s."""
        return 0.0

    def prepare(self, sim: Sim) -> None:
        """Has it happen at its time."""
        world = sim.world

        def due() -> None:
            world.after(self.when.delay_s, sim.let_happen, self)

        if self.when.tick < 0:
            due()
        else:
            sim.watch.when_granted(self.when.tick, due)

    def happen(self, sim: Sim) -> None:
        raise NotImplementedError


@dataclass(frozen=True)
class Kill(Fault):
    """SIGKILL to one of the run's own processes."""

    role: str

    @property
    def excuse(self) -> str:
        return f"The {self.role} was killed by SIGKILL; the last tick all nodes had done is "

    def happen(self, sim: Sim) -> None:
        process = sim.run.nodes[self.role]
        if process.alive and sim.run.launcher.alive and not sim.failing:
            sim.killed_at.setdefault(self.role, sim.world.now)
        process.kill()


@dataclass(frozen=True)
class KillLauncher(Fault):
    """SIGKILL to the launcher, with which its nodes end a moment later; nobody is left to say anything."""

    def happen(self, sim: Sim) -> None:
        if sim.run.launcher.alive:
            sim.killed_at.setdefault("logger", sim.world.now)
            sim.run.launcher.kill(unwound_after_s=0.5)


@dataclass(frozen=True)
class Stop(Fault):
    """SIGSTOP to a process, and SIGCONT after some time."""

    role: str
    seconds: float

    @property
    def lasts_s(self) -> float:
        return self.seconds

    def silences(self, role: str) -> float:
        return self.seconds if role == self.role else 0.0

    def happen(self, sim: Sim) -> None:
        sim.stopped_at[self.role] = sim.world.now
        sim.process(self.role).stop(self.seconds)


@dataclass(frozen=True)
class Slow(Fault):
    """A process that gets the processor late at every turn, from now on."""

    role: str
    seconds: float

    @property
    def lasts_s(self) -> float:
        return 600 * self.seconds

    def silences(self, role: str) -> float:
        return 8 * self.seconds if role == self.role else 0.0

    def happen(self, sim: Sim) -> None:
        sim.process(self.role).slow_s = self.seconds


@dataclass(frozen=True)
class Late(Fault):
    """Messages from and to a process take longer, for some time."""

    role: str
    seconds: float
    span_s: float

    @property
    def lasts_s(self) -> float:
        return self.span_s + 300 * self.seconds

    def silences(self, role: str) -> float:
        return 4 * self.seconds

    def happen(self, sim: Sim) -> None:
        process = sim.process(self.role)
        process.late_s += self.seconds
        sim.world.after(self.span_s, setattr, process, "late_s", 0.0)


@dataclass(frozen=True)
class LateStart(Fault):
    """A process that takes long to start; below the 20 s that the launcher waits."""

    role: str
    seconds: float

    @property
    def lasts_s(self) -> float:
        return self.seconds

    def prepare(self, sim: Sim) -> None:
        sim.run.starts_s[self.role] += self.seconds
        sim.happened.append(self)

    def happen(self, sim: Sim) -> None:
        """Happens at the start."""


@dataclass(frozen=True)
class DiskFull(Fault):
    """No more than so many bytes find room on the logger's disk from now on."""

    room: int

    @property
    def excuse(self) -> str:
        return (
            r"(The logger failed: )?(The log .* cannot be made|Writing the log .* failed|The summary .* not be written)"
        )

    def happen(self, sim: Sim) -> None:
        sim.run.disk.room = min(sim.run.disk.room, self.room)


@dataclass(frozen=True)
class Refuse(Fault):
    """The logger's disk refuses to make, to write or to rename from now on."""

    operation: str
    error: int

    @property
    def excuse(self) -> str:
        return DiskFull(self.when, 0).excuse + f".*{os.strerror(self.error)}"

    def happen(self, sim: Sim) -> None:
        sim.run.disk.refused.setdefault(self.operation, self.error)


@dataclass(frozen=True)
class Garble(Fault):
    """A broken controller or plant: on its side of the loop comes a frame that is none of the loop's."""

    role: str
    data: bytes

    @property
    def excuse(self) -> str:
        return "The (plant|controller) failed: (In the loop,|The plant's greeting) "

    def happen(self, sim: Sim) -> None:
        partner = sim.run.nodes["controller"]
        for socket in partner.sockets:
            for pipe in socket.pipes.values():
                if pipe.far is not None and pipe.address.endswith("/loop.sock"):
                    (pipe.there if self.role == "controller" else pipe.back).send([self.data])


@dataclass(frozen=True)
class SlowDisk(Fault):
    """Every write reaches the disk in pieces."""

    def happen(self, sim: Sim) -> None:
        sim.run.disk.is_slow = True


@dataclass(frozen=True)
class Signals(Fault):
    """Ctrl-C to the launcher, once or twice."""

    count: int

    def happen(self, sim: Sim) -> None:
        sim.run.received += [2] * self.count
