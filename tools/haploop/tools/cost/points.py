"""One method at one plant rate: how far its run is from the reference, or why it failed, and how much it executes."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.controller.dissipation import ElementError, registry
from haploop.tools.cost.data import Errors
from haploop.tools.operations import operations
from haploop.tools.reference.nearest import Reference, statistics
from haploop.tools.trajectory import Trajectory, trajectory

if TYPE_CHECKING:
    from haploop.tools.cost.grid import Candidate


@dataclass(frozen=True)
class Outcome:
    """The outcome of one candidate, in one run that is not timed.

    Attributes:
        error: against the reference; None where it failed.
        failure: why it did, as a sentence.
        ticks: that the run had; 0 for one that could not be run at all.
        instructions_per_tick: bytecode instructions of plant and controller.
    """

    error: Errors | None
    failure: str | None
    ticks: int
    instructions_per_tick: float | None


def outcome(candidate: Candidate, reference: Reference) -> Outcome:
    """Runs a candidate and compares it; a failure is an outcome like any other."""
    if candidate.scene is None:
        return Outcome(None, candidate.refusal, 0, None)
    try:
        # A method that blows up overflows on the way; that is said once, as the reason of the failure.
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore", RuntimeWarning)
            ran = trajectory(candidate.scene)
    except (ElementError, ArithmeticError, np.linalg.LinAlgError) as error:
        return Outcome(None, f"Could not go on: {error}", 0, None)
    ticks = ran.summary["ticks"]
    if failure := _failure(ran, reference):
        return Outcome(None, failure, ticks, None)
    counted = operations(candidate.scene, registry()).per_tick
    return Outcome(errors(ran, candidate.scene, reference), None, ticks, counted)


def _failure(ran: Trajectory, reference: Reference) -> str | None:
    """Returns why a run cannot be compared, or None."""
    if ran.summary["ended"] in ("diverged", "failed"):
        return f"Diverged: {ran.summary['why']}."
    if not np.isfinite(ran.x_m).all():
        return "Not finite: a position is no number."
    if len(ran.x_m) != len(reference.x_m):
        return f"Ended after {len(ran.x_m) - 1} ticks, the reference after {len(reference.x_m) - 1}."
    return None


def errors(ran: Trajectory, scene: dict[str, Any], reference: Reference) -> Errors:
    """Compares a run that went to its end.

    Positions are compared at the ticks after the start and at the end: sqrt(mean((x - x_ref)^2)) and the like. Where a
    chaotic reference forbids that, the swings in the verdict's window are: |a - a_ref| / |a_ref|.
    """
    verdict = ran.summary["verdict"]
    common = {"residual": _residual(ran), "verdict": verdict, "verdict_right": verdict == reference.verdict}
    if reference.pointwise:
        off = np.abs(ran.x_m - np.asarray(reference.x_m))[1:]
        rms_m = math.sqrt(np.mean(off**2))
        return Errors(final_m=float(off[-1]), rms_m=rms_m, max_m=float(off.max()), **common)
    theirs, ours = reference.statistics, statistics(scene, ran.x_m, ran.v_m_s)
    off_by = {name: _apart(ours[name], theirs[name]) for name in theirs}
    return Errors(
        amplitude=_share(off_by["amplitude_m"], theirs["amplitude_m"]),
        frequency=_share(off_by["frequency_Hz"], theirs["frequency_Hz"]),
        energy_per_cycle=_share(off_by["energy_per_cycle_J"], theirs["energy_per_cycle_J"]),
        amplitude_m=off_by["amplitude_m"],
        **common,
    )


def _residual(ran: Trajectory) -> float | None:
    """Returns the energy residual over the energy moved in total."""
    energy = ran.summary["energy"]
    return _share(_apart(energy["residual_J"], 0.0), energy["moved_J"])


def _apart(value: float | None, reference: float | None) -> float | None:
    """Returns the distance of two values; None where there is nothing to compare."""
    return None if value is None or reference is None else abs(value - reference)


def _share(off_by: float | None, reference: float | None) -> float | None:
    return off_by / abs(reference) if off_by is not None and reference else None
