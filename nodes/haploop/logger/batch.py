"""What came of many runs at once: books, windows and trajectories of arrays of loops."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from haploop.logger.books.books import Books
from haploop.logger.books.buffers_batch import ControllerTapeArray, Row
from haploop.logger.summary import energy, finite, outcome
from haploop.logger.verdict.window_batch import WindowArray
from haploop.protocol.arrays import by_loop, of_loops
from haploop.protocol.ticks import Timebase

# Steps of a trajectory that are hashed together.
_HASHED_STEPS = 320


class End(NamedTuple):
    """The end of one loop.

    Attributes:
        loop: where it is in the arrays.
        scene: its resolved scene.
        x_m, v_m_s: where the device ended, and how fast.
        reason: why the plant ended by itself, or None.
    """

    loop: int
    scene: dict[str, Any]
    x_m: float
    v_m_s: float
    reason: str | None


class LoggerArray:
    """Books the intervals of many loops, whose plant and controller come block by block, and tells what came of each.

    Args:
        scene: the stacked scene.
        time: the integers all loops share.
        energy: whether to keep energy books.
        trajectories: whether to hash the trajectories.

    Attributes:
        tick: every interval before it is booked.
    """

    def __init__(self, scene: dict[str, Any], time: Timebase, *, energy: bool, trajectories: bool) -> None:
        loops = scene["loops"]
        self._time = time
        self._books = Books(scene, time) if energy else None
        self._window = WindowArray(time, scene.get("encoder", {}).get("resolution", 0.0), loops)
        self._tape = ControllerTapeArray()
        self._accounts: dict[int, dict[str, Any]] = {}
        self._trajectories = Trajectories(loops) if trajectories else None
        self.tick = 0

    def book(self, plant: dict[str, np.ndarray], rows: Sequence[Row], into_wall: float) -> None:
        """Book the intervals from ``tick`` on.

        Args:
            plant: telemetry columns, shape (ticks * n + 1, loops).
            rows: of the controller, one a tick.
            into_wall: direction into the wall.
        """
        first, ticks, x = self.tick, len(rows), plant["x"]
        if self._books:
            self._tape.add(rows, x.shape[1])
            if first == 0:
                self._books.start(plant)
            self._books.book_loops(first, plant, self._tape, into_wall)
            self._tape.forget_before(first + ticks, int(plant["command"][-1]))
        self._window.add(x, plant["held_N"], rows)
        if self._trajectories:
            self._trajectories.add(x[first > 0 :], plant["v"][first > 0 :])
        self.tick += ticks
        self._note_accounts(rows[-1])

    def _note_accounts(self, row: Any) -> None:
        for element in row.elements:
            self._accounts.setdefault(element["book"], dict(element))["to_tick"] = self.tick

    def outcomes(self, ends: Sequence[End], ended: str, counted: dict[str, Any]) -> Iterator[dict[str, Any]]:
        """What ``summary`` says of each of these loops but for the machine, as they stand now.

        Args:
            ends: loops that end here.
            ended: "done", "stopped" or "diverged".
            counted: what was counted besides, by name of the tally, shape (loops,).
        """
        places = np.array([end.loop for end in ends], np.intp)
        shown = self._window.shown(places)
        tallies = [(name.partition("."), by_loop(of_loops(of, places), len(ends))) for name, of in counted.items()]
        for index, (end, one, energies) in enumerate(zip(ends, shown, self._energies(ends, places), strict=True)):
            ran: dict[str, Any] = {
                "duration_s": self.tick / self._time.control_rate,
                "ticks": self.tick,
                "steps": self.tick * self._time.steps_per_tick,
                "from_tick": 0,
                "ended": ended,
                "why": end.reason or "",
                "final": {"x_m": end.x_m, "v_m_s": end.v_m_s},
                "lost": {"commands_dropped": 0, "commands_lost": 0, "telemetry_gaps": 0},
            }
            for (entry, _, what), counts in tallies:
                ran.setdefault(entry, {})[what] = counts[index]
            if self._trajectories:
                ran["trajectory_sha256"] = self._trajectories.digest(end.loop)
            entries = outcome(end.scene, ran, one, end.reason)
            is_finite = one.is_finite() and math.isfinite(end.v_m_s)
            yield (entries if is_finite else finite(entries)) | energies

    def _energies(self, ends: Sequence[End], places: np.ndarray) -> list[dict[str, Any]]:
        """The ``energy`` entry of each summary; none without books."""
        if not self._books or not ends:
            return [{} for _ in ends]
        accounts = of_loops([*self._accounts.values()], places)
        entry = energy(self._books.of_loops(places), accounts, "wall" in ends[0].scene)
        entries = by_loop({"energy": entry}, len(places))
        return entries if _is_finite(entry) else [finite(entry) for entry in entries]


def _is_finite(value: Any) -> bool:
    """Whether all numbers of all loops are finite."""
    if isinstance(value, dict | list):
        return all(map(_is_finite, value.values() if isinstance(value, dict) else value))
    return isinstance(value, str) or bool(np.isfinite(value).all())


class Trajectories:
    """SHA-256 of x and v at every plant step, loop by loop."""

    def __init__(self, loops: int) -> None:
        self._digests = np.array([hashlib.sha256() for _ in range(loops)], object)
        self._waiting: list[np.ndarray] = []

    def add(self, x: np.ndarray, v: np.ndarray) -> None:
        """Take the next states, shape (steps, loops) each."""
        self._waiting.append(np.stack([x, v], axis=1))
        if sum(map(len, self._waiting)) >= _HASHED_STEPS:
            self._hash()

    def _hash(self) -> None:
        by_loop = np.ascontiguousarray(np.concatenate(self._waiting).transpose(2, 0, 1))
        self._waiting = []
        for digest, states in zip(self._digests, by_loop, strict=True):
            digest.update(states)

    def digest(self, loop: int) -> str:
        """Of one loop so far."""
        if self._waiting:
            self._hash()
        return self._digests[loop].hexdigest()
