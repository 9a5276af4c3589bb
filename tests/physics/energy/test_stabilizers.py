"""Every element on taps against 2000 N/m, beside a program of its law."""

from __future__ import annotations

from typing import Any

import pytest

from haploop.controller.dissipation import registry
from helpers.runs.batches import alone
from helpers.scenes.least import scene
from oracles.element_laws import Law, Tap, bounded, coupled, leading, observed, resisting, tap

T, MASS, SPEED, HEIGHT, STIFFNESS, TICKS = 1e-3, 0.05, 0.2, 0.0101, 2000.0, 120


def law_of(kind: str) -> tuple[dict[str, float], Law]:
    """Parameters of an element and an independent program of it."""
    match kind:
        case "passivity-controller":
            return {"damping": 12.0}, observed(12.0, period=T)
        case "passivity-controller-reset":
            return {"damping": 12.0}, observed(12.0, reset=True, period=T)
        case "passivity-controller-reference":
            return {"damping": 12.0}, observed(12.0, reference=STIFFNESS, period=T)
        case "adaptive-inertia":
            return {"damping": 0.5, "mass": 0.004}, observed(0.5, inertia=0.004, period=T)
        case "damping" | "unidirectional-damping":
            return {"damping": 2.5}, resisting(2.5, one_way=kind != "damping", period=T)
        case "bidirectional-inertia" | "unidirectional-inertia":
            return {"mass": 0.007}, resisting(mass=0.007, one_way=kind[0] == "u", period=T)
        case "force-bounding":
            return {"share": 0.8}, bounded(0.8 * 0.2, period=T)
        case "force-rate":
            return {"time": 1.2e-3}, leading(1.2e-3, period=T)
        case _:
            stiffness, ticks = (800.0, 2) if "slow" in kind else (1500.0, 1)
            values = {"stiffness": stiffness, "damping": 0.4, "mass": 0.006}
            return values | {"world_ticks": ticks}, coupled(**values, ticks=ticks, wall=STIFFNESS, period=T)


KINDS = [
    "damping",
    "unidirectional-damping",
    "bidirectional-inertia",
    "unidirectional-inertia",
    "passivity-controller",
    "passivity-controller-reset",
    "passivity-controller-reference",
    "adaptive-inertia",
    "force-bounding",
    "force-rate",
    "virtual-coupling",
    "virtual-coupling with a slow world",
]


def both(kind: str, late: int) -> tuple[dict[str, Any], Tap]:
    """The summary of a run, and the tap of the independent program."""
    values, law = law_of(kind)
    name = kind.partition(" ")[0]
    acts = "always" if name in ("force-rate", "virtual-coupling") else "in-contact"
    # Without damping the sign of the acceleration in free flight is that of rounding, which the inertia would heed.
    damping = 0.2 if kind in ("force-bounding", "unidirectional-inertia") else 0.0
    made = scene(
        duration=TICKS * T,
        clock={"round_trip_delay": late * T},
        device={"mass": MASS, "damping": damping, "position": HEIGHT, "velocity": -SPEED},
        wall={"position": 0.0, "stiffness": STIFFNESS},
        dissipation=[{"kind": name, "acts": acts, **values}],
    )
    fall = {"mass": MASS, "damping": damping, "stiffness": STIFFNESS, "height": HEIGHT, "speed": SPEED}
    return alone(made), tap(law, **fall, period=T, ticks=TICKS, late=late, always=acts == "always")


def test_no_element_of_the_package_is_left_out() -> None:
    assert {kind.partition(" ")[0] for kind in KINDS} == registry().keys()


@pytest.mark.parametrize("late", [0, 1])
@pytest.mark.parametrize("kind", KINDS)
def test_a_tap_ends_at_the_speed_and_with_the_energies_of_another_program_of_its_law(kind: str, late: int) -> None:
    summary, by_hand = both(kind, late)
    spring_J, added_J = by_hand.taken_J()
    (element,) = summary["energy"]["elements"]
    assert max(by_hand.depth) > 5e-4
    assert abs(added_J) > 1e-5
    assert summary["final"]["v_m_s"] == pytest.approx(by_hand.speed, rel=1e-9)
    assert summary["energy"]["wall"]["sampled_J"] == pytest.approx(spring_J, rel=1e-9)
    assert element["sampled_J"] == pytest.approx(added_J, rel=1e-9)
