"""The logger of a batch: books, windows and trajectories of many runs of one structure at once."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from haploop.logger.books.books import Books
from haploop.logger.books.buffers import Commanded
from haploop.logger.summary import Account, Summary, energy, finite, note_accounts, outcome
from haploop.logger.verdict.changes_made import ChangesMade
from haploop.logger.verdict.window import CONTROLLER_COLUMNS, Window
from haploop.protocol.arrays import rows_of
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_by_member, tree_select, tree_take
from haploop.protocol.walls.wall import Wall

# Steps of a trajectory that are hashed together.
_HASHED_STEPS = 320


class Row(Protocol):
    """One tick of a batch; numbers, or arrays of shape (members,)."""

    @property
    def columns(self) -> Mapping[str, float | np.ndarray]:
        """x, v, a, wall, total, in_contact, wall_position, wall_stiffness."""
        ...

    @property
    def forces(self) -> dict[int, Any]:
        """Force of every book at work, N."""
        ...

    @property
    def elements(self) -> Sequence[Any]:
        """Descriptions of the elements at work; parameters may be arrays."""
        ...


class MemberEnd(NamedTuple):
    """The end of one member of a batch: its place in the arrays, and the final position and velocity of the device.

    ``reason`` says why the plant itself ended the run, or is None.
    """

    place: int
    scene: Scene
    x_m: float
    v_m_s: float
    reason: str | None


class BatchLogger:
    """Books the intervals of a batch, block by block of plant and controller, and reports the result of each run.

    Attributes:
        rows: the last controller rows, which the books still need; the latest is of tick ``tick - 1``.
        changes: made in every member alike.
        tick: every interval before it is booked.
    """

    def __init__(self, scene: Scene, time: Timebase, members: int, *, energy: bool, trajectories: bool) -> None:
        self._time = time
        self.books = Books(scene, time, members) if energy else None
        self.window = Window(time, scene.count_m, members)
        self.rows: list[Row] = []
        self.changes = ChangesMade()
        self._accounts: dict[int, Account] = {}
        self._trajectories = Trajectories(members) if trajectories else None
        self.tick = 0

    def book(self, plant: dict[str, np.ndarray], rows: Sequence[Row], wall: Wall) -> None:
        """Books the intervals from ``tick`` on: plant columns of shape (ticks * n + 1, members), and one row per tick.

        ``wall`` is the wall in all of them.
        """
        first, ticks, x = self.tick, len(rows), plant["x"]
        members = x.shape[1]
        columns = {name: _column([row.columns[name] for row in rows], members) for name in CONTROLLER_COLUMNS}
        if self.books:
            self.rows += rows
            if first == 0:
                self.books.start(plant)
            self.books.book_batch(first, plant, self._commanded(first + ticks, wall, members))
            # The rows of commands that are still in effect, and the last row, are needed again.
            needed = first + ticks - min(first + ticks - 1, int(plant["command"][-1]))
            del self.rows[: max(0, len(self.rows) - needed)]
        self.window.add(x, plant["held_N"], columns)
        if self._trajectories:
            self._trajectories.add(x[first > 0 :], plant["v"][first > 0 :])
        self.tick += ticks
        self.note_accounts(rows[-1].elements)

    def _commanded(self, end: int, wall: Wall, members: int) -> Commanded:
        """Returns what the books need of the rows kept; the latest row is of tick ``end - 1``."""
        rows = self.rows
        forces = {"wall": rows_of([row.columns["wall"] for row in rows], members)}
        for book in sorted({book for row in rows for book in row.forces}):
            forces[str(book)] = rows_of([row.forces.get(book, 0.0) for row in rows], members)
        x_m = rows_of([row.columns["x"] for row in rows], members)
        return Commanded(end - len(rows), x_m, forces, wall)

    def select(self, kept: np.ndarray) -> None:
        """Drops the members for which ``kept``, shape (members,), is false."""
        self.rows, self._accounts = tree_select((self.rows, self._accounts), kept)
        for part in (self.books, self.window, self._trajectories):
            if part:
                part.select(kept)

    def note_accounts(self, elements: Sequence[Any]) -> None:
        """Records that these elements have been at work up to ``tick``."""
        note_accounts(self._accounts, elements, self.tick)

    def outcomes(self, ends: Sequence[MemberEnd], ended: str, counted: Mapping[str, np.ndarray]) -> Iterator[Summary]:
        """Yields the present summary entries of each of these members, except those of the machine.

        Args:
            ended: "done", "stopped" or "diverged".
            counted: further counts by name of the counter, shape (members,) each.
        """
        places = np.array([end.place for end in ends], np.intp)
        measures = self.window.measures(places)
        counters = [
            (name.partition("."), tree_by_member(tree_take(of, places), len(ends))) for name, of in counted.items()
        ]
        for index, (end, one, energies) in enumerate(zip(ends, measures, self._energies(ends, places), strict=True)):
            ran: Summary = {
                "duration_s": self.tick / self._time.control_rate,
                "ticks": self.tick,
                "steps": self.tick * self._time.steps_per_tick,
                "from_tick": 0,
                "ended": ended,
                "why": end.reason or "",
                "final": {"x_m": end.x_m, "v_m_s": end.v_m_s},
                "lost": {"commands_dropped": 0, "commands_lost": 0, "telemetry_gaps": 0},
            }
            for (entry, _, name), counts in counters:
                ran.setdefault(entry, {})[name] = counts[index]
            if self._trajectories:
                ran["trajectory_sha256"] = self._trajectories.digest(end.place)
            changed = self.changes.last_within(one.window.figures.from_s * self._time.control_rate, self.tick)
            changed_s = None if changed is None else changed / self._time.control_rate
            entries = outcome(end.scene, ran, one, end.reason, changed_s)
            is_finite = one.is_finite() and math.isfinite(end.v_m_s)
            yield (entries if is_finite else finite(entries)) | energies

    def _energies(self, ends: Sequence[MemberEnd], places: np.ndarray) -> list[Summary]:
        if not self.books or not ends:
            return [{} for _ in ends]
        accounts = tree_take([*self._accounts.values()], places)
        entry = energy(tree_take(self.books.state, places), accounts, ends[0].scene.wall is not None)
        entries = tree_by_member({"energy": entry}, len(places))
        return entries if _is_finite(entry) else [finite(entry) for entry in entries]


def _column(values: list[Any], members: int) -> np.ndarray:
    """Returns rows with one number per member, or one for all members; shape (rows, members), or (rows, 1)."""
    is_shared = not any(getattr(value, "shape", ()) for value in values)
    return np.array(values)[:, None] if is_shared else rows_of(values, members)


def _is_finite(value: Any) -> bool:
    if isinstance(value, dict | list):
        return all(map(_is_finite, value.values() if isinstance(value, dict) else value))
    return isinstance(value, str) or bool(np.isfinite(value).all())


class Trajectories:
    """SHA-256 of x and v at every plant step, member by member."""

    def __init__(self, members: int) -> None:
        self._digests = np.array([hashlib.sha256() for _ in range(members)], object)
        self._waiting: list[np.ndarray] = []

    def add(self, x: np.ndarray, v: np.ndarray) -> None:
        """Takes the next states, shape (steps, members) each."""
        self._waiting.append(np.stack([x, v], axis=1))
        if sum(map(len, self._waiting)) >= _HASHED_STEPS:
            self._hash()

    def _hash(self) -> None:
        by_member = np.ascontiguousarray(np.concatenate(self._waiting).transpose(2, 0, 1))
        self._waiting = []
        for digest, states in zip(self._digests, by_member, strict=True):
            digest.update(states)

    def select(self, kept: np.ndarray) -> None:
        """Drops the members for which ``kept``, shape (members,), is false."""
        self._digests, self._waiting = self._digests[kept], tree_select(self._waiting, kept)

    def digest(self, place: int) -> str:
        """Returns the hash of one member so far."""
        if self._waiting:
            self._hash()
        return self._digests[place].hexdigest()
