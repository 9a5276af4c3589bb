"""Plant steps of all methods written alike: their operations counted, and timed step by step and in arrays.

In a run, the exact flow of one mass has code of its own, and every other method uses that for any chain of bodies, step
by step in Python: what that costs is not a property of the method. Here each makes its step by the same kind of formula
on rows of numbers, or of arrays of motions, and no friction acts.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.integrators.linear_rates import LinearRates, OneStep, Rows
from haploop.plant.integrators.registry import INTEGRATORS
from haploop.plant.motion.transition import transition_minus_identity
from haploop.protocol.scene.scene import Scene
from haploop.tools.cost.data import Spread, Step

MOTIONS = 4096
_STEPS = 50


class ExactStep:
    """z+ = z + E z + J p(0) + K (p(h) - p(0)): the exact flow under a push p that is linear over the step.

    E = e^{A h} - I, J = int_0^h e^{A s} ds, K = int_0^h e^{A (h - s)} s/h ds, all from one exponential of
    (A, I, 0; 0, 0, I/h; 0, 0, 0); of J and K only the columns on which a force acts.
    """

    def __init__(self, rates: LinearRates, step_s: float) -> None:
        n = len(rates.matrix)
        augmented = np.zeros((3 * n, 3 * n), np.longdouble)
        augmented[:n, :n], augmented[:n, n : 2 * n] = rates.matrix, np.eye(n)
        augmented[n : 2 * n, 2 * n :] = np.eye(n) / step_s
        made = transition_minus_identity(augmented, np.longdouble(step_s))[:n].astype(float)
        self._pushed = np.flatnonzero(np.abs(rates.of_inputs).sum(axis=0)).tolist()
        parts = made[:, :n], made[:, n : 2 * n][:, self._pushed], made[:, 2 * n :][:, self._pushed]
        self._rows = [[row.tolist() for row in rows] for rows in zip(*parts, strict=True)]

    def step(self, z: Rows, begin: Rows, _middle: Rows, end: Rows) -> Rows:
        pushes = [begin[i] for i in self._pushed]
        rises = [end[i] - begin[i] for i in self._pushed]
        after = []
        for at, (of_z, of_push, of_rise) in zip(z, self._rows, strict=True):
            for factors, acting in ((of_z, z), (of_push, pushes), (of_rise, rises)):
                for factor, a in zip(factors, acting, strict=True):
                    at = at + factor * a
            after.append(at)
        return after


class _Counted:
    """A number that counts the additions and multiplications that it is part of."""

    def __init__(self, tally: list[int]) -> None:
        self._tally = tally

    def _count(self, _other: object) -> _Counted:
        self._tally[0] += 1
        return self

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = _count


def one_steps(scene: Scene) -> dict[str, OneStep]:
    """Returns the exact flow's step and that of every one-step method on the bodies of a scene, friction left out."""
    rates, step_s = LinearRates(Chain.from_scene(scene)), 1.0 / scene.clock.plant_rate
    found: dict[str, OneStep] = {"exact": ExactStep(rates, step_s)}
    for name, integrator in INTEGRATORS.items():
        if name != "exact" and (method := integrator.one_step()):
            found[name] = method(rates, step_s)
    return found


def operations(scene: Scene) -> dict[str, int]:
    """Counts the additions and multiplications of a plant step of every method."""
    rates = LinearRates(Chain.from_scene(scene))
    counts = {}
    for name, method in one_steps(scene).items():
        tally = [0]
        z: Rows = [_Counted(tally) for _ in rates.matrix]
        method.step(z, *_pushes(rates, _Counted(tally)))
        counts[name] = tally[0]
    return counts


def timed_alike(scene: Scene, repeats: int) -> list[Step]:
    """Times the steps of all methods, each against the exact flow's before and after it."""
    rates, methods = LinearRates(Chain.from_scene(scene)), one_steps(scene)
    counts = operations(scene)
    number, array = 1e-3, np.full(MOTIONS, 1e-3)
    ratios: dict[str, tuple[list[float], list[float]]] = {name: ([], []) for name in methods}
    for _ in range(repeats):
        for name, method in methods.items():
            for found, value in zip(ratios[name], (number, array), strict=True):
                before, took, after = (
                    _took_s(each, rates, value) for each in (methods["exact"], method, methods["exact"])
                )
                found.append(2.0 * took / (before + after))
    return [Step(name, counts[name], *(Spread.from_values(found) for found in ratios[name])) for name in methods]


def _took_s(method: OneStep, rates: LinearRates, value: float | np.ndarray) -> float:
    z: Rows = [value for _ in rates.matrix]
    pushes = list(_pushes(rates, value))
    began = time.process_time()
    for _ in range(_STEPS):
        z = method.step(z, *pushes)
    return time.process_time() - began


def _pushes(rates: LinearRates, value: object) -> Iterator[Rows]:
    """Yields the pushes at the beginning, middle and end of a step: of this value where a force acts, else 0."""
    acts: Sequence[bool] = (np.abs(rates.of_inputs).sum(axis=0) > 0.0).tolist()
    for _ in range(3):
        yield [value if on else 0.0 for on in acts]
