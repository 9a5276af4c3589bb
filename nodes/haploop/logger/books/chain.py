"""The energy books of a chain of bodies, by exact integrals over each step and each piece of a step."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import reduce
from itertools import accumulate
from operator import add
from typing import Any

import numpy as np

from haploop.logger.books.buffers import PIECES
from haploop.logger.books.one_mass import beyond_limits
from haploop.logger.books.segments import LOOPS, BatchColumns, ChainForms, Columns, Segments, end_to_end
from haploop.logger.books.work import Displacement, by_interval, sum_rows, sum_steps
from haploop.plant.chain.chain import Chain
from haploop.plant.motion.hand_force import constant_forces, make_hand_force
from haploop.protocol.arrays import first_row
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_select


class ChainBooks:
    """Energies that every plant step moves between the hand's muscles, dampers, friction, actuator, masses and springs.

    Over a step, or a piece of it where friction cut it, with x_j, v_j of body j and the stretch s_i of link i:
        work of tau        (tau + tau+)/2 dx + (tau+ - tau) integral (t - t_mid)/t_end v dt, of the last body
        heats              b integral v_j^2 dt of the dampers to ground, b_i integral s_i'^2 dt of the links
        heat of friction   -F dx_0, and m_0 v_0^2 / 2 where it stopped body 0
        kinetic change     sum of m_j dv_j (v_j + dv_j / 2)
        spring change      k_h dx (x - x_rest + dx / 2) of the last body + sum of k_i ds_i (s_i + ds_i / 2)
        actuator           (f_commanded - force) dx_0 + integral p' v_0 dt / (2 pi bandwidth)
    The last is what the actuator's limits keep from the device: it feels p = force - p' / (2 pi bandwidth), while the
    true books of wall and elements are those of the forces they commanded. Integrals are forms of the rates at the
    start (``ChainIntegrals``). No book is derived from the balance, so that its residual is a proof.

    In a batch with friction all members have the same chain. Members in which friction cut a step are booked
    separately, one after the other as if they were one run.

    Attributes:
        names: the books, in the order in which ``increments`` yields them; heats end in ``_heat``.
    """

    def __init__(self, scene: Scene, time: Timebase, members: int | None = None) -> None:
        # A sensor takes no energy.
        self._chain = replace(Chain.from_scene(scene), sensor=None)
        self._n, self._tau = time.steps_per_tick, make_hand_force(scene, time.plant_rate, members)
        self._rubs, self._is_limited = scene.friction is not None, scene.actuator is not None
        self._forms = ChainForms(self._chain, time.step_s, of_batch=members is not None and not self._rubs)
        self._heats = [name for name in self._forms.names if name.endswith("_heat")]
        friction, actuator = ["friction_heat"] * self._rubs, ["actuator"] * self._is_limited
        self._constant = constant_forces(scene)
        works = [f"{name}_work" for name in self._constant]
        self.names = ["hand_work", *self._heats, *friction, "kinetic", "spring", *actuator, *works]
        if members is None:  # a run that is long enough has its loops loaded before it begins
            LOOPS.module_for(time.ticks * self._n)

    def increments(
        self, first_step: int, columns: BatchColumns, moved: Displacement, commanded: Iterable[np.ndarray]
    ) -> Iterator[np.ndarray]:
        """Yields the energy each interval adds to each book, J; see ``OneMassBooks.increments``."""
        dx = moved.by_step.reshape(-1, *moved.by_step.shape[2:])
        loops = LOOPS.module_for(dx.size) if dx.ndim == 1 or self._rubs else None
        if loops and (found := self._by_loops(loops, first_step, columns, len(dx), commanded)) is not None:
            yield from found.reshape(-1, *moved.by_tick.shape)
        else:
            for book in self.by_step(first_step, columns, dx, commanded):
                yield sum_steps(by_interval(book, self._n))

    def by_step(
        self, first_step: int, columns: BatchColumns, dx: np.ndarray, commanded: Iterable[np.ndarray]
    ) -> Iterator[np.ndarray]:
        """Yields the energy each step adds to each book, J, shape (steps,), or (steps, batch), each."""
        tau = self._tau.at_steps(first_step, first_step + len(dx) + 1)
        if "pieces" not in columns or not len(columns["pieces"][0]):
            return self._of_run(first_step, columns, tau, dx, commanded)
        return self._with_cut_steps(first_step, columns, tau, dx, list(commanded))

    def _by_loops(
        self, loops: Any, first_step: int, columns: BatchColumns, steps: int, commanded: Iterable[np.ndarray]
    ) -> np.ndarray | None:
        """Returns the books tick by tick, computed by the machine-code loops; None where these cannot be used."""
        tau = self._tau.at_steps(first_step, first_step + steps + 1)
        chain, members = self._chain, columns["x"].size // len(columns["x"])
        names = [*chain.states, *(f"{name}_low" for name in chain.positions), "friction", "stuck"]
        places, some, of_pieces = columns.get("pieces") or ([0], [len(columns.get(f"{PIECES}step", ()))], columns)
        counts, none = np.zeros(members, np.int64), np.zeros(0)
        counts[places] = some
        pieces = np.stack([of_pieces.get(PIECES + name, none) for name in (*names, "step", "level", "snap_J")])
        pieces[len(names)] -= first_step
        kinds = np.flatnonzero(np.bincount((2.0 * pieces[-2] + pieces[len(names) - 1]).astype(np.int64)))
        if (forms := self._forms.for_loops(kinds, loops)) is None:
            return None
        rows = np.empty((len(names) + 3, steps + 1, members))
        for row, name in zip(rows, (*names, "force"), strict=False):
            row[:] = columns[name].reshape(steps + 1, -1) if name in columns else 0.0
        rows[-2], rows[-1] = tau.reshape(steps + 1, -1), 0.0
        if self._is_limited:
            rows[-1, :-1] = beyond_limits(commanded, columns["force"][:-1]).reshape(steps, -1)
        constants = [*self._constant.values()]
        held_N = np.array([*constants, sum(constants)] if constants else [])
        device = [np.array(chain.masses_kg), np.array([link.stiffness for link in chain.links]), np.array(chain.spring)]
        first = np.append(0, np.cumsum(counts))
        heats = len(self._heats)
        lags, books = len(self._forms.names) - 1 - heats, len(self._forms.names) + 4 + len(constants)
        found = loops.books_by_tick([*device, *forms], rows, pieces, first, held_N, books, steps // self._n, lags > 0)
        friction = 1 + heats + lags
        kept = [*range(1 + heats), *range(friction + (not self._rubs), friction + 3)]
        return found[[*kept, *[books - 1] * self._is_limited, *range(friction + 3, books - 1)]]

    def _with_cut_steps(
        self, first_step: int, columns: BatchColumns, tau: np.ndarray, dx: np.ndarray, commanded: list[np.ndarray]
    ) -> Iterator[np.ndarray]:
        (places, *pieces), rows, shape = columns["pieces"], len(dx) + 1, columns["x"].shape
        whole = {name: column for name, column in columns.items() if getattr(column, "shape", ()) == shape}

        def joined(values: np.ndarray) -> np.ndarray:
            """Returns a column of all steps of those members, one member after the other, with a 0 between them."""
            column = np.zeros((len(places), rows))
            column[:, : len(values)] = np.broadcast_to(values, (len(values), shape[1]))[:, places].T
            return column.ravel()

        cut = end_to_end(first_step, {name: column[:, places] for name, column in whole.items()}, *pieces)
        anew = self._of_run(0, cut, joined(tau), joined(dx)[:-1], [joined(force)[:-1] for force in commanded])
        others = np.setdiff1d(np.arange(shape[1]), places)
        tau_of, dx_of, *forces = (part if part.shape[-1] == 1 else part[:, others] for part in (tau, dx, *commanded))
        uncut = {name: column[:, others] for name, column in whole.items()}
        for flow, of_cut in zip(self._of_run(first_step, uncut, tau_of, dx_of, forces), anew, strict=True):
            both = np.empty(dx.shape)
            both[:, others], both[:, places] = flow, np.append(of_cut, 0.0).reshape(-1, rows).T[:-1]
            yield both

    def _of_run(
        self, first_step: int, columns: Columns, tau: np.ndarray, dx: np.ndarray, commanded: Iterable[np.ndarray]
    ) -> Iterator[np.ndarray]:
        """Yields the energy each step adds to each book; in a batch, all steps must be whole."""
        segments, force, steps = Segments.from_columns(self._chain, first_step, columns), columns["force"][:-1], len(dx)
        rise = np.diff(tau, axis=0)[segments.step]
        start = tau[:-1][segments.step] + rise * segments.elapsed
        found = self._forms.integrals(segments, force[segments.step], start, rise)
        integrals = dict(zip(self._forms.names, found, strict=True))
        risen = np.ldexp(rise, -segments.level)
        way = sum_rows(segments.displacements)
        books = {"hand_work": (start + risen / 2.0) * way + risen * integrals["lag_integral"]}
        books |= {name: integrals[name] for name in self._heats}
        if self._rubs:
            books["friction_heat"] = -segments.friction * segments.displacements[0] + segments.stop_loss
        books |= {"kinetic": self._kinetic(segments), "spring": self._spring(segments, way)}
        if self._constant:
            books["hand_work"] -= sum(self._constant.values()) * way
        for book in books.values():
            yield _by_step(book, segments.step, steps)
        if self._is_limited:
            lag = _by_step(integrals.get("lag", np.zeros(way.shape)), segments.step, steps)
            yield lag + beyond_limits(commanded, force) * dx
        for constant_N in self._constant.values():
            yield _by_step(constant_N * way, segments.step, steps)

    def _kinetic(self, segments: Segments) -> np.ndarray:
        n, masses = self._chain.count, self._chain.masses_kg
        v, dv = np.cumsum(segments.states[n : 2 * n], axis=0), np.cumsum(segments.changes, axis=0)
        return sum_rows([masses[body] * dv[body] * (v[body] + dv[body] / 2.0) for body in range(n)])

    def _spring(self, segments: Segments, way: np.ndarray) -> np.ndarray:
        """Returns the change of energy in the hand's spring, whose end moves by ``way``, and in the links."""
        (stiffness, rest), lengths = self._chain.spring, segments.states[: self._chain.count]
        beyond = sum_rows([lengths[0] - rest, *lengths[1:], *segments.lows])
        parts = [stiffness * way * (beyond + way / 2.0)]
        for link, stretch, change in zip(self._chain.links, lengths[1:], segments.displacements[1:], strict=True):
            parts.append(link.stiffness * change * (stretch + change / 2.0))
        return sum_rows(parts)

    def select(self, kept: np.ndarray) -> None:
        """Drops the members of a batch for which ``kept``, shape (members,), is false."""
        self._chain, self._constant = tree_select((self._chain, self._constant), kept)
        self._forms.select(kept)
        self._tau.select(kept)

    def stored_J(self, columns: Columns) -> Any:
        """Returns kinetic and spring energy in the first state of some telemetry, J."""
        chain, n = self._chain, self._chain.count
        state = [first_row(columns[name]) for name in chain.states]
        (stiffness, rest), velocities = chain.spring, accumulate(state[n : 2 * n])
        energies = [mass * v * v for mass, v in zip(chain.masses_kg, velocities, strict=True)]
        energies += [link.stiffness * s * s for link, s in zip(chain.links, state[1:n], strict=True)]
        beyond = reduce(add, state[:n]) - rest
        return reduce(add, [*energies, stiffness * beyond * beyond]) / 2.0


def _by_step(values: np.ndarray, step: np.ndarray, steps: int) -> np.ndarray:
    """Returns the sum over the segments of each step, in their order."""
    return values if len(values) == steps == step[-1] + 1 else np.bincount(step, values, steps)
