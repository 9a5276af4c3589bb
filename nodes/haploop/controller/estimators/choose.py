"""Which estimators a scene asks for: the one register of them, and what makes v[k] and a[k] of its tables."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from haploop.controller.estimators.base import Difference, Estimator, LowPass, Unchanged

# Every estimator by the name that a scene gives it: the class, or "module:class", which is imported where it is used.
ESTIMATORS: dict[str, str | type[Estimator]] = {
    "difference": Difference,
    "window": "haploop.controller.estimators.window:WindowDifference",
    "foaw": "haploop.controller.estimators.foaw:EndFit",
    "kalman": "haploop.controller.estimators.kalman:Kalman",
}


def estimator_class(name: str) -> type[Estimator]:
    """Returns the estimator of a name; its module is imported here.

    Raises:
        KeyError: there is none of this name.
    """
    found = ESTIMATORS[name]
    if isinstance(found, str):
        module, _, attribute = found.partition(":")
        return getattr(import_module(module), attribute)
    return found


def make_estimators(scene: dict[str, Any], period_s: float) -> tuple[Estimator, Estimator, str]:
    """Makes those that a scene's ``[velocity]`` and ``[acceleration]`` name, for the control period T.

    Returns:
        What estimates v of x_m, what estimates a of its input, and that input: "encoder": v as it is filtered;
        "accelerometer": the reading; "kalman": what the velocity's filter found.
    """
    source = scene.get("acceleration", {}).get("source", "encoder")
    acceleration = _make(scene, "acceleration", period_s) if source == "encoder" else Unchanged()
    return (
        _filtered(_make(scene, "velocity", period_s), scene.get("velocity", {}), period_s),
        _filtered(acceleration, scene.get("acceleration", {}), period_s),
        source,
    )


def _make(scene: dict[str, Any], of: str, period_s: float) -> Estimator:
    name = scene.get(of, {}).get("estimator") or "difference"
    return estimator_class(name).from_scene(scene, of, period_s)


def _filtered(raw: Estimator, table: dict[str, Any], period_s: float) -> Estimator:
    return LowPass.over(raw, table["cutoff"], period_s) if "cutoff" in table else raw
