"""Known analytic bounds of wall stiffness, each with its source, and whether it applies to a given scene."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.motion.one_mass import Mechanics
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.tools.linear.linearity import Kinds, LinearController, installed_kinds, why_not_linear, with_spring

# Gil et al. leave out what grows with the square of this: the angle in rad by which the wall's swing turns in T/2 + td.
_SMALL_ANGLE = 0.3
# Angles theta = w T in rad at which passivity is checked first; below the least nothing changes any more.
_LEAST_ANGLE, _ANGLES = 1e-4, 1000


@dataclass(frozen=True)
class Bound:
    """Bound on the stiffness of a scene's wall by an author's formula.

    Attributes:
        name: authors and year, short enough for a label.
        formula: in the field's symbols: K, B virtual and b physical; T the period, td the delay.
        domain: for what it was derived.
        kind: passive with any passive hand, or stable with the scene's own.
        stiffness_N_m: the largest stiffness it allows, 0 where it allows none; None where it does not apply.
        why_not: what takes the scene out of its domain, one sentence; empty where it applies.
    """

    name: str
    source: str
    formula: str
    domain: str
    kind: Literal["passivity", "stability"]
    stiffness_N_m: float | None = None
    why_not: str = ""

    @property
    def applies(self) -> bool:
        return self.stiffness_N_m is not None


class _DoesNotApply(Exception):
    """The scene is outside a bound's domain; the message says why."""


def bounds_of(scene: Scene, kinds: Kinds | None = None) -> list[Bound]:
    """Returns all known bounds of a resolved scene's wall, including those that do not apply."""
    kinds, scene = installed_kinds() if kinds is None else kinds, with_spring(scene)
    return [_bound(about, stiffness, scene, kinds) for stiffness, about in _KNOWN.items()]


def _bound(about: Bound, stiffness: Callable[[Scene, Kinds], float], scene: Scene, kinds: Kinds) -> Bound:
    try:
        return replace(about, stiffness_N_m=stiffness(scene, kinds))
    except _DoesNotApply as error:
        return replace(about, why_not=str(error))


def _refuse(scene: Scene, kinds: Kinds, *outside: str, friction: bool = False) -> None:
    """Raises if the loop is not linear, except for friction where that is allowed, or if one of ``outside`` holds."""
    curved = [what for what in why_not_linear(scene, kinds) if not (friction and what == "[friction]")]
    if curved:
        raise _DoesNotApply(f"The scene has {', '.join(curved)}.")
    for what in outside:
        holds, sentence = _OUTSIDE[what]
        if holds(scene):
            raise _DoesNotApply(sentence)


def _passive(scene: Scene, kinds: Kinds) -> float:
    _refuse(scene, kinds, "lag", "accelerometer", friction=True)
    delay_s = scene.clock.round_trip_delay
    ticks = delay_s * scene.clock.control_rate
    if abs(ticks - round(ticks)) > 1e-6:
        raise _DoesNotApply(f"The delay of {delay_s * 1e3:g} ms is not a whole number of ticks.")
    return _largest_passive_stiffness(scene, round(ticks), kinds)


def _largest_passive_stiffness(scene: Scene, delay_ticks: int, kinds: Kinds) -> float:
    """K in N/m at which the sampled wall with its elements is just passive; 0 where the elements alone are not.

    With z = e^(j theta), H the elements' force over -x, L whole ticks of delay and b the damping of the sampled body
    to ground, whatever passive hangs on it, the loop is passive if and only if at all 0 < theta <= pi
        b > (T/2) / (1 - cos theta) Re{(1 - z^-1) (K + H(z)) z^-L} = Re{g (K + H(z))},
        g = (T/2) j e^(-j theta (L + 1/2)) / sin(theta / 2)
    """
    from scipy.optimize import minimize_scalar

    controller = LinearController.from_scene(scene, kinds)
    damping = next(b for name, (body, b) in Chain.from_scene(scene).grounded.items() if body == 0 and name != "hand")
    period_s = 1.0 / scene.clock.control_rate

    def allowed(theta: np.ndarray) -> np.ndarray:
        g = 0.5j * period_s * np.exp(-1j * theta * (delay_ticks + 0.5)) / np.sin(theta / 2.0)
        left = damping - (g * _force_over_motion(controller, np.exp(1j * theta))).real
        spring = np.where(g.real > 0.0, g.real, 1.0)
        return np.where(left < 0.0, 0.0, np.where(g.real > 0.0, left / spring, np.inf))

    grid = np.union1d(np.geomspace(_LEAST_ANGLE, np.pi, _ANGLES), np.linspace(_LEAST_ANGLE, np.pi, _ANGLES))
    found = allowed(grid)
    least = int(np.argmin(found))
    around = grid[max(least - 1, 0)], grid[min(least + 1, len(grid) - 1)]
    refined = minimize_scalar(lambda theta: float(allowed(np.array([theta]))[0]), bounds=around, method="bounded")
    return float(min(found[least], refined.fun))


def _force_over_motion(controller: LinearController, z: np.ndarray) -> np.ndarray:
    """Returns H(z): the elements' force over -x, at every z."""
    moved, force = controller
    memory = len(moved)
    of_memory = z[:, None, None] * np.eye(memory) - moved[:, :memory]
    states = np.linalg.solve(of_memory, np.broadcast_to(moved[:, memory:], (len(z), memory, 1)))[..., 0]
    return -(states @ force[:memory] + force[memory])


def _soft(scene: Scene, kinds: Kinds) -> float:
    _refuse(scene, kinds, "lag", "bodies")
    if others := sorted({element.name for element in scene.dissipation} - {"damping"}):
        raise _DoesNotApply(f"It covers no element but damping; the scene has {', '.join(others)}.")
    virtual = sum(element.parameters["damping"] for element in scene.dissipation)
    if virtual and scene.velocity:
        raise _DoesNotApply("The velocity is not a plain backward difference.")
    mechanics, late_s = Mechanics.from_scene(scene), _half_period_s(scene) + scene.clock.round_trip_delay
    bound = (mechanics.damping + virtual) / late_s
    angle = math.sqrt((bound + mechanics.stiffness) / mechanics.mass_kg) * late_s
    if angle > _SMALL_ANGLE:
        raise _DoesNotApply(
            f"It holds for soft walls; one of {bound:.4g} N/m turns the device's swing by {angle:.2g} rad in half a "
            f"period and the delay, more than {_SMALL_ANGLE:g}."
        )
    return bound


def _at_once(scene: Scene, kinds: Kinds) -> float:
    _refuse(scene, kinds, "lag", "bodies", "elements", "delay", "spring")
    mechanics = Mechanics.from_scene(scene)
    return _jury(mechanics.mass_kg, mechanics.damping, 2.0 * _half_period_s(scene))


def _jury(mass_kg: float, damping: float, period_s: float) -> float:
    """The exact limit without delay, g0 and g1 in units of T^2 / m: in r = b T / m, by series where floats cancel."""
    r = damping * period_s / mass_kg
    lost = -math.expm1(-r)  # 1 - E
    if r > 1e-2:
        g0, g1 = (lost - r * (1.0 - lost)) / r**2, (r - lost) / r**2
    else:
        g1 = sum((-r) ** i / math.factorial(i + 2) for i in range(8))
        g0 = sum((-r) ** i * (i + 1) / math.factorial(i + 2) for i in range(8))
    swings_wider, alternates = lost / g0, 2.0 * (2.0 - lost) / (g1 - g0) if g1 > g0 else math.inf
    return mass_kg / period_s**2 * min(swings_wider, alternates)


def _over_an_encoder(scene: Scene, kinds: Kinds) -> float:
    _refuse(scene, kinds, "lag", "elements", "delay", "transmission", "no encoder", "noise", friction=True)
    assert scene.encoder
    friction_N = scene.friction.kinetic if scene.friction else 0.0
    return min(scene.device.damping / _half_period_s(scene), 2.0 * friction_N / scene.encoder.resolution)


def _half_period_s(scene: Scene) -> float:
    return 0.5 / scene.clock.control_rate


# What may take a scene out of the domain of a bound, and the sentence that says so.
_OUTSIDE: dict[str, tuple[Callable[[Scene], object], str]] = {
    "lag": (lambda scene: value_at(scene, "actuator.bandwidth"), "The actuator lags: its bandwidth is limited."),
    "accelerometer": (accelerometer_is_used, "The controller also reads an accelerometer, not the position alone."),
    "bodies": (
        lambda scene: scene.transmission or value_at(scene, "hand.grip"),
        "Device and hand are not a single rigid mass.",
    ),
    "elements": (
        lambda scene: scene.dissipation,
        "It is for a spring alone; the scene has damping or dissipation elements.",
    ),
    "delay": (lambda scene: scene.clock.round_trip_delay, "It is for a loop without delay."),
    "spring": (lambda scene: value_at(scene, "hand.stiffness"), "The hand has a spring."),
    "transmission": (lambda scene: scene.transmission, "The device is not rigid: it has a [transmission]."),
    "no encoder": (lambda scene: not scene.encoder, "The scene has no [encoder]."),
    "noise": (lambda scene: scene.noise, "The position is noisy, not only rounded."),
}

_KNOWN: dict[Callable[[Scene, Kinds], float], Bound] = {
    _passive: Bound(
        "Colgate & Schenkel 1997",
        "J. E. Colgate, G. G. Schenkel: Passivity of a class of sampled-data systems: application to haptic "
        "interfaces. J. Robotic Systems 14(1), 1997",
        "b > (T/2) / (1 - cos wT) Re{(1 - e^-jwT) H(e^jwT)} at all w; b > K T/2 + |B| for a spring and a damper",
        "a device with damping b, any passive hand, a linear H of the sampled position with whole ticks of delay",
        "passivity",
    ),
    _soft: Bound(
        "Gil et al. 2009",
        "J. J. Gil, E. Sanchez, T. Hulin, C. Preusche, G. Hirzinger: Stability boundary for haptic rendering: "
        "influence of damping and delay. J. Computing and Information Science in Engineering 9(1), 2009",
        "K < (b + B) / (T/2 + td)",
        "a rigid mass with damping b, virtual damping B of backward differences, and soft walls",
        "stability",
    ),
    _at_once: Bound(
        "Exact, no delay",
        "Jury's criterion on the exact flow of a mass under held forces",
        "K < min((1 - E) / g0, 2 (1 + E) / (g1 - g0)), E = e^(-b T/m), g0 = ((m/b)(1 - E) - T E) / b, "
        "g1 = (T - (m/b)(1 - E)) / b",
        "a rigid mass with damping b, a wall alone, no delay, no spring in the hand",
        "stability",
    ),
    _over_an_encoder: Bound(
        "Abbott & Okamura 2005",
        "J. J. Abbott, A. M. Okamura: Effects of position quantization and sampling rate on virtual-wall "
        "passivity. IEEE Transactions on Robotics 21(5), 2005",
        "K <= min(2 b / T, 2 fc / q)",
        "a mass with damping b and Coulomb friction fc, an encoder of resolution q, a wall alone, no delay",
        "passivity",
    ),
}
