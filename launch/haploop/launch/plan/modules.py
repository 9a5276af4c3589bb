"""The modules of the plant that effects bring, by what they are for."""

from __future__ import annotations

from haploop.plant.integrators.registry import find_integrator

# What moves bodies in a row, or one under forces that change between ticks, in place of ``plant.motion.one_mass``.
HISTORY = tuple(f"haploop.plant.chain.{name}" for name in ("history", "chain", "sensed_acceleration", "transition"))
_EXACT = ("haploop.plant.chain.motion",)
CHAIN = (*_EXACT, *HISTORY)
_EXACT_RUBBING = tuple(f"haploop.plant.friction.{name}" for name in ("motion", "substeps"))
RUBBING = _EXACT_RUBBING
# What the one-step methods share.
LINEAR_RATES = ("haploop.plant.integrators.linear_rates",)
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
    kept = tuple(module for module in modules if module not in (*_EXACT, *_EXACT_RUBBING))
    return (*kept, find_integrator(integrator).motions[1].partition(":")[0]) if rubs else kept
