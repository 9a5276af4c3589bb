"""Energy books of elements at work on a recorded motion, which they do not change."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element, ElementError
from haploop.controller.estimators.base import Sample, Unchanged
from haploop.logger.books.buffers import as_float64
from haploop.logger.books.work import add_columns, no_sums, sampled_work
from haploop.protocol.changes import Event
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.tools.dissipate.force_book import ForceBook, ForceRows
from haploop.tools.dissipate.force_sign import ForceSign
from haploop.tools.dissipate.recording.samples import Floats, Samples

# Samples left out at the beginning: estimates start at rest, and the jump of the first samples is no noise.
_FIRST = 4


class Booked(NamedTuple):
    """The books at some samples: t_s and x_m of shape (samples,), the others (elements, samples).

    ``added_J`` is the gain of the true books since the sample before; ``force`` is None where none was recorded.
    """

    t_s: Floats
    x_m: Floats
    sampled_J: Floats
    true_J: Floats
    added_J: Floats
    force: ForceRows | None = None


class Booking:
    """Runs estimates, elements and books on samples, as a run does.

    sampled  E += -f[k-1] (x_m[k] - x_m[k-1]), all that the controller can know (Choi et al. 2022, eq. 4)
    true     E += -f_held dx: command k is held for a period from t_k + d on, d = (L + mu) T; in the period after
             sample k command k - L - 1 still holds for mu T, and command k - L for the rest

    After a gap everything but the sums restarts; the motion within the gap is not known and not booked. Nor are the
    forces of the first samples after it, whose velocity and acceleration would need the missing samples: an estimate
    that starts at rest there would book the device's kinetic energy out of nothing.

    A recorded force is booked as the elements' forces are, in the last row.

    Args:
        period_s, delay_s: T and d.
        recorded: which of "velocity" and "acceleration" come with the samples and are taken as they are.
        has_force: whether the samples come with a force.

    Attributes:
        force: the naive sum of the recorded force, and its passivity.
        taken_J, given_J: sum of the gains of the true books over the periods in which they gained, and of the losses
            over the others, shape (rows,), one row per element and one more for a recorded force.
        strongest_N: the largest force of each, shape (rows,).
        fast_share: share of each one's mean square force that is faster than a quarter of the sampling rate, shape
            (rows,); of the line at a frequency f the share sin(pi f T)^2 counts as fast, and the rest as slow. For
            white noise in the positions it is 0.75 in a damper's force by backward differences, and 0.83 in an
            inertia's.
    """

    def __init__(
        self,
        scene: Scene,
        period_s: float,
        delay_s: float,
        kinds: dict[str, type[Element]],
        recorded: frozenset[str],
        has_force: bool = False,
    ) -> None:
        self._scene, self._kinds, self._recorded = scene, kinds, recorded
        periods = delay_s / period_s
        self._lookahead = math.floor(periods + 1e-9)
        self._late = max(0.0, periods - self._lookahead)
        self._time = MeasuredTime.from_period(period_s, self._lookahead)
        self._elements = len(scene.dissipation)
        self._count = self._elements + has_force
        self.force = ForceBook(period_s, delay_s) if has_force else None
        self.force_sign = ForceSign(period_s)
        self._sums = no_sums(2 * self._count)
        self._events = _wall_events(scene, self._time)
        self.taken_J, self.given_J, self.strongest_N, self._fast_N2, self._slow_N2 = np.zeros((5, self._count))

    def add(self, piece: Samples) -> Booked:
        """Books a piece; returns the books at its samples.

        Raises ElementError where an element raised, or returned something that is no finite number.
        """
        if piece.begins:
            self._begin()
        first, count = len(self._last_x), len(piece.x_m)
        answer, v = self._answer(piece)
        answer[: self._elements, : piece.unknown] = 0.0
        forces = np.hstack([self._forces, answer])
        x_m, true_x = np.append(self._last_x, piece.x_m), np.append(self._last_true_x, piece.true_x_m)
        between = self._between(piece, true_x)
        periods = slice(1 - first, count), slice(2 - first, count + 1)  # of the old and the new command in each
        known = forces[:, self._lookahead + 2 - first : self._lookahead + 1 + count]
        added = np.zeros((2 * self._count, count))
        added[: self._count, 1 - first :] = sampled_work(x_m, known)
        added[self._count :, 1 - first :] = _held(forces[:, periods[0]], forces[:, periods[1]], true_x, between)
        if piece.taken_J is not None:
            taken = np.append(self._last_taken_J, piece.taken_J)
            added[-1, 1 - first :], self._last_taken_J = taken[:-1], taken[-1:]
        self._forces = forces[:, -self._lookahead - 2 :]
        self._last_x, self._last_true_x = piece.x_m[-1:], piece.true_x_m[-1:]
        self._last_between = None if piece.between_x_m is None else piece.between_x_m[-1:]
        self.strongest_N = np.fmax(self.strongest_N, np.abs(forces).max(axis=1))
        some = answer[:, _FIRST if piece.begins else 0 :]
        self._fast_N2 += (np.diff(some) ** 2).sum(axis=1)
        self._slow_N2 += ((some[:, 1:] + some[:, :-1]) ** 2).sum(axis=1)
        if piece.force_N is not None:
            self.force_sign.add(piece.x_m, piece.force_N, piece.begins)
        totals = self._add(added)[:, 1:]
        sampled, true = np.split(totals, 2)
        force = self.force.add(piece, v, added[-1], true[-1]) if self.force else None
        elements = slice(self._elements)
        gains = added[self._count :][elements]
        return Booked(piece.t_s, piece.x_m, sampled[elements], true[elements], gains, force)

    def finish(self, end_x_m: float) -> None:
        """Books the true energy of the period after the last sample, which ends at ``end_x_m``."""
        true_x = np.append(self._last_true_x, end_x_m)
        between = self._last_between if self._last_between is not None else self._on_a_line(true_x)
        held = _held(self._forces[:, :1], self._forces[:, 1:2], true_x, between)
        if self._last_taken_J.size:
            held[-1] = self._last_taken_J
        if self.force:
            self.force.finish(float(held[-1, 0]))
        self._add(np.vstack([np.zeros_like(held), held]))

    @property
    def fast_share(self) -> Floats:
        whole = self._fast_N2 + self._slow_N2
        return np.divide(self._fast_N2, whole, out=np.zeros_like(whole), where=whole > 0.0)

    @property
    def sampled_J(self) -> Floats:
        return (self._sums.sums + self._sums.errors)[: self._count]

    @property
    def true_J(self) -> Floats:
        return (self._sums.sums + self._sums.errors)[self._count :]

    def _begin(self) -> None:
        self._controller = _recorded_controller(self._scene, self._time, self._kinds, self._recorded)
        for tick, event in self._events:
            self._controller.schedule(tick, event)
        self._forces = np.zeros((self._count, self._lookahead + 2))
        self._last_x = self._last_true_x = self._last_taken_J = np.empty(0)
        self._last_between: Floats | None = None

    def _answer(self, piece: Samples) -> tuple[Floats, Floats]:
        """Returns the forces of all rows, shape (rows, samples), and the velocity at every sample."""
        nothing = [0.0] * len(piece.x_m)
        v, a = (nothing if column is None else column.tolist() for column in (piece.v_m_s, piece.a_m_s2))
        controller = self._controller
        controller.answer(list(zip(piece.x_m.tolist(), a, v, strict=True)))
        blocks = controller.recorder.take()
        if controller.recorder.trouble:
            raise ElementError(f"On this recording {controller.recorder.trouble}.")
        names = ["v", *(f"dissipation.{i}" for i in range(self._elements))]
        velocity, *rows = ([as_float64(block["columns"][name]) for block in blocks] for name in names)
        forces = [np.concatenate(row) for row in rows]
        if piece.force_N is not None and self.force:
            forces.append(piece.force_N)
        return np.array(forces).reshape(len(forces), len(piece.x_m)), np.concatenate(velocity)

    def _between(self, piece: Samples, true_x: Floats) -> Floats:
        """Returns the position at which the command changed, for every period that ends within the piece."""
        if piece.between_x_m is None:
            return self._on_a_line(true_x)
        last = np.empty(0) if self._last_between is None else self._last_between
        return np.append(last, piece.between_x_m)[:-1]

    def _on_a_line(self, true_x: Floats) -> Floats:
        return true_x[:-1] + self._late * np.diff(true_x)

    def _add(self, added: Floats) -> Floats:
        true = added[self._count :]
        self.taken_J += np.maximum(true, 0.0).sum(axis=1)
        self.given_J -= np.minimum(true, 0.0).sum(axis=1)
        self._sums, totals = add_columns(self._sums, added)
        return totals


def _held(old: Floats, new: Floats, true_x: Floats, between: Floats) -> Floats:
    """Returns -f dx over each period of two held forces, J, shape (elements, periods)."""
    return -(old * (between - true_x[:-1]) + new * (true_x[1:] - between))


def _wall_events(scene: Scene, time: Timebase) -> list[tuple[int, Event]]:
    """Returns the events that change the wall, by tick: its position decides when elements act."""
    found = []
    for event in scene.event:
        if of_wall := {key: value for key, value in (event.set or {}).items() if key.startswith("wall.")}:
            found.append((time.first_tick_at(event.at), {"set": of_wall}))
    return found


@dataclass(frozen=True)
class MeasuredTime(Timebase):
    """The timebase of samples whose rate is that of their measured period, not a whole number of Hz."""

    measured_s: float

    @classmethod
    def from_period(cls, period_s: float, lookahead: int) -> MeasuredTime:
        """Makes it for samples ``period_s`` apart; commands take effect ``lookahead`` samples later, or one more."""
        rate = max(1, round(1.0 / period_s))
        return cls(rate, rate, lookahead, 1, period_s)

    @property
    def period_s(self) -> float:
        return self.measured_s


@dataclass(frozen=True)
class Recorded(Unchanged):
    """The estimator that returns the recorded value at one place of the sample."""

    place: int

    def step(self, memory: Any, u: Any, sample: Sample) -> tuple[Any, Any]:
        return None, sample[self.place]


def _recorded_controller(
    scene: Scene, time: Timebase, kinds: dict[str, type[Element]], recorded: frozenset[str]
) -> Controller:
    """Makes a controller of samples (x, acceleration, velocity) that uses recorded values in place of estimates."""
    controller = Controller(scene, time, kinds)
    places = {"acceleration": 1, "velocity": 2}
    controller.params = replace(controller.params, **{of: Recorded(places[of]) for of in recorded})
    return controller
