"""A loop in its builder's terms: what swings, how stiff a wall may be, what one count of the encoder causes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from haploop.controller.controller import make_params
from haploop.controller.tick import initial_state, tick
from haploop.plant.chain.chain import Chain
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.protocol.walls.registry import make_wall
from haploop.tools.linear.bounds import bounds_of
from haploop.tools.linear.linearity import Kinds, is_linear, why_not_linear
from haploop.tools.linear.one_tick import NeverStable, NotLinear, OneTickMap

# Counts inside the wall at which a step of one count is made; ticks of rest before it, and as many watched after it.
DEEP_COUNTS, _TICKS = 1000, 500


@dataclass(frozen=True)
class Limit:
    """Largest stiffness of a scene's wall by a formula, or by the loop's own map.

    Attributes:
        kind: "passivity" with any passive hand, or "stability" with the scene's own.
        stiffness_N_m: None where the limit does not apply to the scene; ``why_not`` gives the reason, or says that the
            limit is of the loop without friction.
    """

    name: str
    kind: str
    stiffness_N_m: float | None
    why_not: str = ""


def limits_of(scene: Scene, kinds: Kinds) -> list[Limit]:
    """Returns all known bounds, then where the one-tick map M stops being stable, rho(M) = 1, from a soft wall on.

    If there are elements, the last is that of the wall alone. For a loop that only friction keeps from being linear, it
    is that of the same loop without friction.
    """
    found = [Limit(bound.name, bound.kind, bound.stiffness_N_m, bound.why_not) for bound in bounds_of(scene, kinds)]
    found.append(_of_map("rho(M) = 1", scene, kinds))
    # A spring needs no velocity, so the velocity's estimator is not in the loop either.
    is_spring = scene.wall is None or not scene.wall.kind
    alone = replace(scene, dissipation=(), **{"velocity": None, "acceleration": None} if is_spring else {})
    return [*found, *([_of_map("rho(M) = 1, wall alone", alone, kinds)] if scene.dissipation else [])]


def _of_map(name: str, scene: Scene, kinds: Kinds) -> Limit:
    """Returns the exact limit of a loop, or that of the loop without friction if only friction is in the way."""
    smooth = replace(scene, friction=None)
    if not scene.friction or not is_linear(smooth, kinds):
        return _exact(name, scene, kinds)
    found = _exact(f"{name}, no friction", smooth, kinds)
    return found if found.why_not else replace(found, why_not="of the loop without [friction]")


def _exact(name: str, scene: Scene, kinds: Kinds) -> Limit:
    try:
        return Limit(name, "stability", OneTickMap.from_scene(scene, kinds).stiffness_limit())
    except NotLinear:
        return Limit(name, "stability", None, f"The scene has {', '.join(why_not_linear(scene, kinds))}.")
    except NeverStable as error:
        return Limit(name, "stability", None, str(error))


@dataclass(frozen=True)
class Mode:
    """A swing of the bodies in steady contact, without delay and sampling."""

    frequency_Hz: float
    damping_ratio: float


def modes(scene: Scene) -> list[Mode]:
    """Returns |s| / 2 pi and -Re s / |s| of every pair of complex eigenvalues s, slow ones first.

    Of one mass m, damped by b, on the hand's spring k and the wall's K they are sqrt((K + k) / m) / 2 pi and
    b / (2 sqrt((K + k) m)), b with the damping of the wall. Empty for a wall whose stiffness changes with the depth.
    """
    known = make_wall(scene.wall).stiffness_and_damping()
    if known is None:
        return []
    chain = Chain.from_scene(scene)
    rates = np.asarray(chain.rates(), float)
    size = len(chain.states)
    closed = rates[:, :size].copy()
    closed[:, 0] -= known[0] * rates[:, size]
    closed -= known[1] * np.outer(rates[:, size], rates[0, :size])
    pairs = sorted((s for s in np.linalg.eigvals(closed) if s.imag > 0.0), key=abs)
    return [Mode(abs(s) / (2.0 * math.pi), -s.real / abs(s)) for s in pairs]


@dataclass(frozen=True)
class OneCount:
    """The largest change of every estimate and force by a step of one count, deep in contact and from rest.

    Attributes:
        elements_N: by element, in the scene's order.
        total_N: of all forces together, peak to peak over the ticks about the step.
    """

    x_m: float
    v_m_s: float
    a_m_s2: float
    wall_N: float
    elements_N: tuple[float, ...]
    total_N: float


def one_count(scene: Scene, kinds: Kinds) -> OneCount | None:
    """Returns how the scene's own controller responds to one count of its encoder, to either side; None without one."""
    if scene.encoder is None:
        return None
    count_m, wall = scene.encoder.resolution, scene.wall
    inward = 1.0 if wall and wall.occupies == "above" else -1.0
    x_m = (wall.position if wall else 0.0) + inward * DEEP_COUNTS * count_m
    most, most_N = np.zeros(4 + len(scene.dissipation)), 0.0
    for step_m in (count_m, -count_m):
        params = make_params(replace(scene, event=()), 1.0 / scene.clock.control_rate, dict(kinds))
        rest = (0.0,) * accelerometer_is_used(scene)
        state = initial_state(params, (x_m, *rest))
        before, total_N = np.zeros(len(most)), list[float]()
        for number in range(2 * _TICKS):
            state, row = tick(params, state, (x_m + step_m * (number >= _TICKS), *rest))
            if number < _TICKS:
                before, total_N = np.array(row[:-2], float), [float(row[-2])]
            else:
                total_N.append(float(row[-2]))
                most = np.maximum(most, np.abs(np.array(row[:-2], float) - before))
        most_N = max(most_N, max(total_N) - min(total_N))
    return OneCount(
        count_m, *(float(value) for value in most[1:4]), elements_N=tuple(map(float, most[4:])), total_N=most_N
    )
