"""The motion of a chain between recorded states, steps and pieces of steps, and its integrals as exact forms."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from haploop.logger.books.buffers import PIECES
from haploop.plant.chain.chain import Chain
from haploop.plant.chain.transition import ChainIntegrals, make_tables, of_device
from haploop.plant.where_it_pays import WhereItPays
from haploop.protocol.trees import tree_select

Columns = dict[str, np.ndarray]
# Those of a batch; with friction also ``pieces``: (places of members, their numbers of pieces, columns of all pieces).
BatchColumns = dict[str, Any]
# (forms of all products, shape (products, rates, rates); form of the lag integral, shape (rates,)) by kind.
Made = dict[int, tuple[np.ndarray, np.ndarray]]
# A part of a step is counted in 2^-62 of it: whole numbers, whose sums over many steps may overflow harmlessly.
_FINEST = 62
# From this many segments on, a kind is integrated separately; with fewer, together with others, each segment by its
# own coefficients.
_MANY = 256
# Used from this many plant steps in all.
LOOPS = WhereItPays("haploop.logger.books.loops", 200_000)


@dataclass(frozen=True)
class Segments:
    """Stretches of motion in order; every plant step is one segment or several.

    Attributes:
        step: plant step of each, counted from the first, shape (segments,).
        level: the segment lasts h / 2^level.
        is_stuck: whether body 0 is held in it.
        elapsed: fraction of its plant step that has passed when it begins.
        states: all states of the chain when it begins, shape (states, segments).
        lows: rounding remainders of the lengths among the states, shape (lengths, segments), m.
        displacements: change of every length, shape (lengths, segments), m.
        changes: change of every rate, up to where the next begins, shape (lengths, segments), m/s.
        friction: on body 0, N.
        stop_loss: kinetic energy friction took from body 0 in stopping it at the end, J.

    All but ``step`` may have a last axis for a batch, whose steps are all whole; of length 1 where members are alike.
    """

    step: np.ndarray
    level: np.ndarray
    is_stuck: np.ndarray
    elapsed: np.ndarray
    states: np.ndarray
    lows: np.ndarray
    displacements: np.ndarray
    changes: np.ndarray
    friction: np.ndarray
    stop_loss: np.ndarray

    @classmethod
    def from_columns(cls, chain: Chain, first_step: int, columns: Columns) -> Segments:
        """Reads the columns of some intervals, their end state included; see PLANT_BLOCK in the protocol."""
        n, steps = chain.count, len(columns["x"]) - 1
        zero = np.zeros((steps + 1, *[1] * (columns["x"].ndim - 1)))

        def table(name: str) -> np.ndarray:
            """Returns a column at every step, at the end, and where every piece begins; 0 in a row that has none."""
            column, of_pieces = columns.get(name, zero), columns.get(PIECES + name, zero[:0])
            return np.concatenate([column, of_pieces]) if len(of_pieces) else column

        step, begins = _in_order(steps, columns.get(f"{PIECES}step", zero[:0]).ravel().astype(np.int64) - first_step)
        path = np.append(begins, steps) if len(begins) > steps else slice(None)
        states = np.stack([table(name)[path] for name in chain.states])
        lows = np.stack([table(f"{name}_low")[path] for name in chain.positions])
        level = table("level")[begins].astype(np.int64)
        return cls(
            step=step,
            level=level,
            is_stuck=table("stuck")[begins] > 0.0,
            elapsed=_elapsed(step, level.ravel()).reshape(level.shape),
            states=states[:, :-1],
            lows=lows[:, :-1],
            displacements=np.diff(states[:n], axis=1) + np.diff(lows, axis=1),
            changes=np.diff(states[n : 2 * n], axis=1),
            friction=table("friction")[begins],
            stop_loss=table("snap_J")[begins],
        )

    def kinds(self) -> np.ndarray:
        """Returns level * 2 + is_stuck: segments of a kind have the same duration, and body 0 either free or held."""
        return self.level * 2 + self.is_stuck

    def groups(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray | slice]]:
        """Returns groups (kinds, kind of each segment, ``which``): one per kind with many segments, one for the rest.

        ``which`` selects from arrays of shape (segments,), or (segments, batch): all, or those where a mask is true.
        """
        kinds = self.kinds()
        found, counts = np.unique(kinds, return_counts=True)
        if len(found) == 1:
            return [(found, np.zeros(1, np.intp), slice(None))]
        kinds = np.broadcast_to(kinds, self.states.shape[1:])
        groups = [(found[i : i + 1], np.zeros(1, np.intp), kinds == found[i]) for i in np.flatnonzero(counts >= _MANY)]
        others = found[counts < _MANY]
        if len(others):
            which = np.isin(kinds, others)
            groups.append((others, np.searchsorted(others, kinds[which]), which))
        return groups


def end_to_end(first_step: int, columns: Columns, counts: Sequence[int], pieces: Columns) -> Columns:
    """Returns the telemetry of several members as if it were that of one run, member after member.

    Args:
        columns: shape (steps + 1, members).
        counts: how many pieces each of them has.
        pieces: the columns of all pieces, member after member.

    Returns:
        Columns whose first step is 0. Every (steps + 1)-th step leads from the end of a member to the start of the next
        and has no meaning.
    """
    joined = {name: column.T.ravel() for name, column in columns.items()}
    before = np.repeat(len(columns["x"]) * np.arange(len(counts)) - first_step, counts)
    return joined | pieces | {f"{PIECES}step": pieces[f"{PIECES}step"] + before}


def _in_order(steps: int, step_of_piece: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns (plant step, row of the table of states) of every segment: whole steps, and the pieces of the others."""
    whole = np.setdiff1d(np.arange(steps), step_of_piece)
    step = np.concatenate([whole, step_of_piece])
    rows = np.concatenate([whole, steps + 1 + np.arange(len(step_of_piece))])
    order = np.argsort(step, kind="stable")
    return step[order], rows[order]


def _elapsed(step: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Returns what fraction of its step has passed at each segment's start: exact, the same wherever a block begins."""
    lasts = np.uint64(1) << (_FINEST - level).astype(np.uint64)
    over = np.cumsum(lasts) - lasts
    first = np.searchsorted(step, step)
    return (over - over[first]).astype(float) / 2.0**_FINEST


@of_device
def _made_of(_chain: Chain, _step_s: float) -> Made:
    """Returns the forms made so far for a chain; runs of one device in one process share them."""
    return {}


class ChainForms:
    """The integrals that the books need, of any segments; the forms of a level are made when it first occurs.

    Args:
        chain: of a resolved scene, or of a batch, whose numbers may be arrays of shape (members,).
        step_s: duration of a plant step, s.
        of_batch: whether each member has its own chain; these are without friction, and their forms need no wide float.

    Attributes:
        names: the integrals, in the order of the rows of ``integrals``: heat of every damper to ground and of every
            link, as ``<damper>_heat``; ``lag`` of the actuator's force behind the force held, where it has a bandwidth,
            J; and ``lag_integral``, integral of (t - t_mid) / t_end v dt of the last body, m.
    """

    def __init__(self, chain: Chain, step_s: float, *, of_batch: bool = False) -> None:
        self._chain = chain
        heats = [f"{name}_heat" for name in (*chain.grounded, *(link.name for link in chain.links))]
        self.names = [*heats, *["lag"] * (chain.actuator_rate is not None), "lag_integral"]
        self._made: Made = {}
        self._of_batch, self._of_loops = of_batch, list[np.ndarray]()
        if of_batch:
            rates, *forms = make_tables(lambda one: _tables(one, step_s), chain, has_members=True)
            self._real: Any = np.float64
            self._rates, self._made[0] = {False: rates}, (forms[0], forms[1])
            return
        self._made = _made_of(chain, step_s)
        self._flows = {stuck: ChainIntegrals(chain, step_s, stuck) for stuck in (False, True)}
        self._real = chain.real_for(step_s)
        self._rates = {stuck: chain.rates(stuck).astype(self._real) for stuck in (False, True)}
        rates = np.eye(len(chain.states))[: chain.count]
        bodies = chain.absolute() @ rates  # what picks the velocity of each body from the rates of the states
        self._products = [(damping, bodies[body], bodies[body]) for body, damping in chain.grounded.values()]
        self._products += [(link.damping, *[rates[i + 1]] * 2) for i, link in enumerate(chain.links)]
        if chain.actuator_rate is not None:
            force = np.eye(len(chain.states))[chain.states.index("actuator")]
            self._products.append((1.0 / chain.actuator_rate, force, bodies[0]))
        self._last = bodies[-1]

    def integrals(self, segments: Segments, force: np.ndarray, tau: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """Returns all integrals of all segments.

        Args:
            force: held in each, N, shape (segments,), or (segments, batch).
            tau: of the hand, at the beginning of each, N.
            rise: by which tau rises in a whole plant step, N.

        Returns:
            Shape (integrals, segments), or (integrals, segments, batch), ordered as ``names``.
        """
        # The hand's spring acts by its distance from rest; thus no digits are spent on where the rest lies.
        states = segments.states.copy()
        states[0] = states[0] - self._chain.spring[1] + segments.lows[0]
        acting = [of.astype(self._real, copy=False) for of in (*states, force, segments.friction, tau)]
        groups, result = segments.groups(), np.empty((len(self.names), *force.shape))
        if any(not isinstance(which, slice) for *_, which in groups):  # a mask selects only from arrays of full shape
            acting, rise = [np.broadcast_to(of, force.shape) for of in acting], np.broadcast_to(rise, force.shape)
        forms = self.forms([kind for kinds, *_ in groups for kind in kinds.tolist()])
        for kinds, of, which in groups:
            made = [(self._rates[kind % 2 == 1], *forms[kind]) for kind in kinds.tolist()]
            rates, products, lag_integral = made[0]
            if len(made) > 1:
                rates, products, lag_integral = (np.stack(part, axis=-1)[..., of] for part in zip(*made, strict=True))
            acting_here = [column[which] for column in acting]
            w = [*(_sum_of(row, acting_here) for row in rates), rise[which]]
            result[:-1, which] = _forms_of(products, w)
            result[-1, which] = _sum_of(lag_integral, w)
        return result

    def forms(self, kinds: Iterable[int]) -> Made:
        """Returns the forms made so far, with those of these kinds of segments; all missing levels are made at once."""
        missing = {*kinds} - self._made.keys()
        for stuck in {kind % 2 for kind in missing}:
            of, flow = sorted(kind for kind in missing if kind % 2 == stuck), self._flows[stuck == 1]
            levels, (factors, *pairs) = np.array(of) // 2, zip(*self._products, strict=True)
            products = np.array(factors)[:, None, None] * flow.products([*zip(*pairs, strict=True)], levels)
            made = products.astype(self._real), flow.lag(self._last, levels).astype(self._real)
            self._made |= zip(of, zip(*made, strict=True), strict=True)
        return self._made

    def for_loops(self, kinds: np.ndarray, loops: Any) -> list[np.ndarray] | None:
        """Returns what the machine-code loops need for some kinds and whole steps; None where floats are too short.

        These are the rates with body 0 free and held, the forms of products and of the lag integral by kind, and the
        place of each kind among them.
        """
        if self._of_batch or self._real is not np.float64:
            return None
        forms = self.forms([0, 1, *kinds.tolist()])
        if not self._of_loops or len(self._of_loops[1]) != len(forms):
            products, lags = (np.stack(part) for part in zip(*forms.values(), strict=True))
            which = np.zeros(max(forms) + 1, np.int64)
            which[[*forms]] = np.arange(len(forms))
            self._of_loops = [loops.rates_of([*self._rates.values()]), loops.pairs_of(products), lags, which]
        return self._of_loops

    def select(self, kept: np.ndarray) -> None:
        """Drops the members of a batch for which ``kept``, shape (members,), is false."""
        if self._of_batch:
            self._chain, self._rates, self._made = tree_select((self._chain, self._rates, self._made), kept)


def _tables(chain: Chain, step_s: float) -> tuple[np.ndarray, ...]:
    return chain.rates().astype(float), *ChainForms(chain, step_s).forms([0])[0]


def _sum_of(factors: np.ndarray, columns: Sequence[np.ndarray]) -> np.ndarray:
    """Returns the sum of factor times column in a fixed order (a matrix product may reorder with its size)."""
    total = np.zeros_like(columns[0])
    counts: Any = (factors.any(axis=-1) if factors.ndim > 1 else factors).tolist()
    for factor, column, there in zip(factors, columns, counts, strict=True):
        if there:
            total = total + factor * column
    return total


def _forms_of(forms: np.ndarray, w: Sequence[np.ndarray]) -> np.ndarray:
    """Returns w' Q w of every form Q and every column of w in a fixed order, shape (forms, columns)."""
    total = np.zeros((len(forms), *w[0].shape), w[0].dtype)
    counts: Any = forms.any(axis=(0, *range(3, forms.ndim))).tolist()
    for i in range(len(w)):
        for j in range(i, len(w)):
            if counts[i][j]:
                entries = forms[:, i, j] if i == j else 2.0 * forms[:, i, j]
                between = [1] * (w[0].ndim - entries.ndim + 1)
                total += entries.reshape(len(entries), *between, *entries.shape[1:]) * (w[i] * w[j])
    return total
