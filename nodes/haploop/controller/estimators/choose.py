"""The register of estimators; makes those of v[k] and a[k] that a scene names."""

from __future__ import annotations

import math
from typing import Any

from haploop.controller.estimators.base import Difference, Estimator, LowPass, Unchanged
from haploop.protocol.arrays import each
from haploop.protocol.installed import cached_until_brought
from haploop.protocol.register import Register
from haploop.protocol.scene.estimators import Acceleration
from haploop.protocol.scene.scene import Scene

# Every estimator by the name that a scene gives it: the class, or "module:class", which is imported where it is used.
ESTIMATORS: dict[str, str | type[Estimator]] = {
    "difference": Difference,
    "window": "haploop.controller.estimators.windows:WindowDifference",
    "foaw": "haploop.controller.estimators.windows:EndFit",
    "kalman": "haploop.controller.estimators.kalman:Kalman",
}
_REGISTER: Register[Estimator] = Register("estimator", Estimator.group, ESTIMATORS)


def estimator_class(name: str) -> type[Estimator]:
    """Returns the estimator with this name; raises UnknownKind if there is none."""
    return _REGISTER.find(name)


@cached_until_brought
def estimators_for(table: str) -> dict[str, type[Estimator]]:
    """Returns the estimators that a table of the scene ("velocity", "acceleration") may name; all are imported."""
    return {name: kind for name, kind in _REGISTER.all().items() if table in kind.tables}


def make_estimators(scene: Scene, period_s: float) -> tuple[Estimator, Estimator, str]:
    """Makes the estimators that a scene's ``[velocity]`` and ``[acceleration]`` name, for the control period T.

    Returns:
        The estimator of v from x_m, that of a from its input, and that input: "encoder": v as filtered;
        "accelerometer": the reading; "kalman": the acceleration that the velocity's filter found.
    """
    acceleration = scene.acceleration or Acceleration()
    raw = _make(scene, "acceleration", period_s) if acceleration.source == "encoder" else Unchanged()
    velocity = _filtered(_make(scene, "velocity", period_s), scene.estimate("velocity").cutoff, period_s)
    return velocity, _filtered(raw, acceleration.cutoff, period_s), acceleration.source


def _make(scene: Scene, of: str, period_s: float) -> Estimator:
    return estimator_class(scene.estimate(of).estimator or "difference").from_scene(scene, of, period_s)


def _filtered(raw: Estimator, cutoff_hz: Any, period_s: float) -> Estimator:
    return raw if cutoff_hz is None else LowPass(raw, 1.0 - each(math.exp, -2.0 * math.pi * cutoff_hz * period_s))
