"""Meanings of the entries of ``summary.json`` that the logger writes itself, by dotted key.

N stands for a place in a list, NAME for a name that the scene or the machine gives. Entries with a type of their own,
such as ``window``, are explained there.
"""

from __future__ import annotations

from collections.abc import Mapping

from haploop.logger.books.meanings import BOOKS

_BESIDE = {f"energy.{name}_J": BOOKS[name] for name in BOOKS if name.endswith(("_work", "_heat")) or name == "actuator"}

RUN: Mapping[str, str] = {
    "title": "title of the scene",
    "seed": "seed of all random numbers of the run",
    "duration_s": "simulated time that was booked",
    "ticks": "ticks of the controller that were booked",
    "steps": "plant steps that were booked",
    "from_tick": "first tick that was booked; 0 except for a second logger, which joined later",
    "ended": "how the run ended: `done`, at its full duration; `stopped`, earlier, by an order; `diverged`, by the "
    "plant, such as when the device leaves `diverged_beyond`; `failed`, an element or a process could not continue",
    "why": "why the run diverged or failed, a sentence; empty otherwise",
    "final.x_m": "position at the end of the first body: the device, or the motor if there is a cable",
    "final.v_m_s": "velocity of the same body at the end",
    "lost.telemetry_gaps": "ticks of plant or controller whose telemetry did not reach the logger",
    "trajectory_sha256": "hash of positions and velocities of the first body at all plant steps; equal if two "
    "trajectories agree in every bit",
    "versions.NAME": "version of Python, or of a package, that the run was made with",
    "wall_s": "real time that the run took",
    "real_time_factor": "simulated time over real time; above 1: faster than real time",
    "verdict": "the verdict, a word such as `steady`, `limit-cycle` or `undecided`",
    "verdict_rule": "reason for the verdict, one or more sentences with numbers",
}
ENERGY: Mapping[str, str] = {
    "energy.elements.N.kind": "kind of the element; a swap or a set of a parameter opens a new book",
    "energy.elements.N.parameters.NAME": "parameter of the element, in SI units, and when it `acts`",
    "energy.elements.N.from_tick": "first tick at which the element was at work with these parameters",
    "energy.elements.N.to_tick": "first tick at which it no longer was, or the end of the run",
    "energy.elements.N.sampled_J": BOOKS["ELEMENT.sampled"].replace("wall.sampled", "energy.wall.sampled_J"),
    "energy.elements.N.true_J": BOOKS["ELEMENT.true"].replace("wall.true", "energy.wall.true_J"),
    "energy.wall.sampled_J": BOOKS["wall.sampled"],
    "energy.wall.true_J": BOOKS["wall.true"],
    "energy.wall.ideal_J": "energy that an ideal wall, continuous and without delay, would hold at the end, less what "
    "it held at the start",
    "energy.wall.changes_J": "of that, what changes of the wall in contact have put into it; negative: taken out of it",
    "energy.wall.dissipated_J": BOOKS["dissipated"],
    "energy.wall.leak.total_J": "the leak: what the wall took out of the device, `energy.wall.true_J`, beyond what an "
    "ideal one would have stored and dissipated on the same motion; negative: the wall generated energy",
    "energy.wall.leak.sampling_and_hold_J": "part of the leak caused by sampling at ticks and holding the force",
    "energy.wall.leak.quantisation_J": "part of the leak caused by using the measured position (counts, noise) "
    "and the estimated velocity in place of the true ones",
    "energy.wall.leak.delay_J": "part of the leak caused by the delay of the line, including jitter and loss",
    **_BESIDE,
    "energy.stored_at_start_J": "kinetic energy of all bodies, and energy in the hand's spring, cable and "
    "grip, at the start",
    "energy.stored_J": "kinetic energy of all bodies, and energy in the hand's spring, cable and grip, at the end",
    "energy.moved_J": "all energy that was stored at the start or changed its place since: the measure of the residual",
    "energy.residual_J": "what the books leave unexplained, in magnitude: rounding, the error of an integrator, or "
    "what a foreign plant loses or invents; null with an unmodelled hand",
    "energy.balance": "a sentence on what a residual above a thousandth of the energy moved means; absent otherwise",
}
PARTS: Mapping[str, str] = {
    "not_made.N": "a change that was refused or taken back, and why, a sentence; absent if there was none",
    "programs.NAME.name": "name that the plant or the controller reports",
    "programs.NAME.version": "version that it reports",
    "programs.NAME.command": "command that started it, empty if unknown",
    "programs.NAME.own": "whether it is haploop's own",
    "checksum": "CRC-32 of all other entries, only in the file: a file that was damaged or edited is refused",
}
