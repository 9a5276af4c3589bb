"""The modules of the plant that effects bring, by what they are for."""

from __future__ import annotations

# What moves bodies in a row, or one under forces that change between ticks, in place of ``plant.motion.one_mass``.
HISTORY = tuple(f"haploop.plant.chain.{name}" for name in ("history", "chain", "sensed_acceleration", "transition"))
_EXACT = tuple(f"haploop.plant.chain.{name}" for name in ("motion",))
CHAIN = (*_EXACT, *HISTORY)
_EXACT_RUBBING = tuple(f"haploop.plant.friction.{name}" for name in ("motion", "substeps"))
RUBBING = _EXACT_RUBBING
# And where another integrator than the exact flow moves them, with friction or without.
METHODS = "haploop.plant.integrators"
STEPWISE = (*(f"{METHODS}.{name}" for name in ("stepwise", "linear_rates")), *HISTORY)
_STEPWISE_RUBBING = (f"{METHODS}.stepwise_friction",)
_DOP853_RUBBING = (f"{METHODS}.dop853_friction",)
DRAWN = ("haploop.plant.random.streams",)
NOISY = ("haploop.plant.sensing.noise", *DRAWN)
COUNTED = ("haploop.plant.counters",)
LINE = ("haploop.plant.line.lossy", *DRAWN, *COUNTED, *CHAIN)


def moved_by(integrator: str, modules: tuple[str, ...], rubs: bool) -> tuple[str, ...]:
    """Returns the modules under an integrator, which has its own in place of those that move bodies exactly.

    Args:
        rubs: whether they are those of friction.
    """
    if integrator == "exact":
        return modules
    rubbing = _DOP853_RUBBING if integrator == "dop853" else _STEPWISE_RUBBING
    kept = tuple(module for module in modules if module not in (*_EXACT, *_EXACT_RUBBING))
    return kept + (rubbing if rubs else ())
