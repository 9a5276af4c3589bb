"""Meaning of every book, by its name in the log, the summary and their reference."""

from __future__ import annotations

from collections.abc import Mapping

# Running sums in J from the start of the run. Capitals stand for what a scene names: an element by its kind, with a
# number from the second of a kind on; and the table of a constant force that another package brings.
BOOKS: Mapping[str, str] = {
    "hand_work": "work of the hand's voluntary force on the body that it acts on; positive: given to the mechanism",
    "unmodelled_work": "work of an unmodelled hand on the device, in place of `hand_work`: the remainder that closes "
    "the balance; positive: given to the device",
    "FORCE_work": "work of a constant force from an installed package, which is not part of `hand_work`; positive: "
    "given to the mechanism",
    "device_heat": "heat in `device.damping`, at the tip if there is a cable; never negative",
    "motor_heat": "heat in `transmission.motor_damping`; never negative",
    "hand_heat": "heat in `hand.damping`; never negative",
    "cable_heat": "heat in the cable's damping, `transmission.damping`; never negative",
    "grip_heat": "heat in the grip's damping, `hand.grip.damping`; never negative",
    "friction_heat": "heat of dry friction at the first body, the motor if there is a cable; never negative",
    "kinetic": "change of the kinetic energy of all bodies since the start; positive: there is more",
    "spring": "change of the energy in the hand's spring, cable and grip since the start; positive: there is more",
    "actuator": "work that the commanded forces would have done, less the work of the force that the device felt: kept "
    "back by saturation, steps of force and bandwidth; negative: the device was given more than was commanded",
    "ideal": "energy that the wall of the scene holds at the true penetration, by the continuous law, less what it "
    "held at the start; changes of the wall are left out",
    "sampled_and_held": "energy that the wall would have taken out of the device had its force been that of the true "
    "position and velocity at each tick, held for the tick, without delay",
    "quantised": "energy that the wall would have taken out of the device had its force, as the controller computed it "
    "from the measured position, been held for its own tick, without delay",
    "dissipated": "energy that the law of the wall takes in continuous time in addition to what it stores; only for "
    "walls with a damper; positive: taken out of the device",
    "moved": "energy that changed its place: half of the sum of the magnitudes of all changes in the books of the "
    "balance, tick by tick; it only grows",
    "wall.sampled": "energy that the wall took out of the device as far as the controller knows, -f[k-1] (x_m[k] - "
    "x_m[k-1]) summed over the ticks; negative: given to it",
    "wall.true": "energy that the wall's commanded force, held from when it takes effect, took out of the device along "
    "its exact motion; negative: given to it",
    "ELEMENT.sampled": "as `wall.sampled`, for the force of an element",
    "ELEMENT.true": "as `wall.true`, for the force of an element",
    "residual": "what the books leave unexplained: work less heat, `kinetic`, `spring`, `actuator` and every `.true`; "
    "positive: energy was lost, negative: it came from nowhere; none with an unmodelled hand",
}
