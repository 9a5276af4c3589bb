"""One tick of a controller: a function of its parameters, its state and a sample, for floats, NumPy and JAX alike."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from haploop.controller.active_elements import ActiveElement
from haploop.controller.asked import Declared, Told, answer_of, first_memory
from haploop.controller.dissipation.element import ElementError, Motion, as_number, raised
from haploop.controller.estimators.base import Estimator, Sample
from haploop.protocol.arrays import where
from haploop.protocol.walls.wall import Wall

# The entries in the row of a tick before the forces of the elements.
MOTION_COLUMNS = ("x", "v", "a", "wall")


@dataclass(frozen=True, slots=True)
class ControllerParams:
    """Everything that a tick depends on except state and sample; replaced by another one when something changes.

    Attributes:
        velocity, acceleration: from x_m[k] to v[k], and from an input to a[k].
        input: that input: "encoder": v[k]; "accelerometer": the reading; "kalman": what the velocity's filter found.
        elements: the active elements, in the order in which their forces are added.
        motion: what elements are given; overwritten at every tick.
        declared: what the scene says about device and delay, for elements that ask.
    """

    velocity: Estimator
    acceleration: Estimator
    input: str
    wall: Wall
    elements: tuple[ActiveElement, ...]
    books: int
    motion: Motion
    declared: Declared


class ControllerState(NamedTuple):
    """Everything that a controller remembers from tick to tick; a tree of numbers (``haploop.protocol.trees``).

    Attributes:
        a_before: a of the tick before, m/s^2; 0 before the first.
        elements: memory of every active element; None for one without memory.
    """

    velocity: Any
    acceleration: Any
    a_before: Any
    elements: tuple[Any, ...]


# A ControllerState without the names of its fields: naming them at every tick would take a fifth of the tick's time.
StateTuple = tuple[Any, Any, Any, tuple[Any, ...]]


class NoForce(Exception):
    """An element gave no force; ``index`` is its place among the active ones. Raised from what it raised."""

    def __init__(self, index: int) -> None:
        super().__init__(index)
        self.index = index

    def __str__(self) -> str:
        return f"Element {self.index} gave no force."

    def sentence(self, params: ControllerParams, tick: int) -> str:
        """Returns what happened at this tick, with the element's kind and what it raised."""
        element, cause = params.elements[self.index].element, self.__cause__
        what = raised(cause, type(element))
        return f"Element {self.index} ({element.kind}) gave no force at tick {tick}: {what}."


def demand_finite(params: ControllerParams, row: list[Any], since: int) -> None:
    """Checks whether an element that a swap at or after tick ``since`` brought makes the total of a row non-finite.

    Raises:
        NoForce: its force is the first entry of the row that is not a finite number.
        ElementError: the total is not finite for a member of a batch.
    """
    is_finite = abs(row[-2]) < math.inf
    if is_finite is True or (is_finite is not False and is_finite.all()):
        return
    if getattr(is_finite, "ndim", 0):
        raise ElementError("A force of a member is not a finite number.")
    place = next((place for place, value in enumerate(row[:-2]) if not math.isfinite(value)), 0) - len(MOTION_COLUMNS)
    if place >= 0 and (swapped := params.elements[place].swapped) and swapped[0] >= since:
        raise NoForce(place) from ValueError(
            f"it returned {row[len(MOTION_COLUMNS) + place]}, and a force must be a finite number"
        )


def initial_state(params: ControllerParams, sample: Sample) -> ControllerState:
    """Returns the state before the first tick, whose sample is given: at rest at that position."""
    velocity, x = params.velocity, sample[0]
    memory = velocity.start(x, sample)
    if params.input == "encoder":
        u = 0.0 * x
    else:
        u = sample[1] if params.input == "accelerometer" else velocity.acceleration(velocity.step(memory, x, sample)[0])
    elements = tuple([first_memory(active.element, params.declared) for active in params.elements])
    return ControllerState(memory, params.acceleration.start(u, sample), 0.0, elements)


def tick(params: ControllerParams, state: StateTuple, sample: Sample) -> tuple[StateTuple, list[Any]]:
    """Returns the next state, and the row of this tick: x, v, a, the wall's force, every element's, total, contact.

    f_d[k] = f_wall[k] + sum of the elements' forces[k], in the order of the scene's list. The state is not changed.

    Raises:
        NoForce: an element raised, or gave something that is not a number.
    """
    of_velocity, of_acceleration, a_before, memories = state
    x = sample[0]
    of_velocity, v = params.velocity.step(of_velocity, x, sample)
    u = v
    if params.input != "encoder":
        u = sample[1] if params.input == "accelerometer" else params.velocity.acceleration(of_velocity)
    of_acceleration, a = params.acceleration.step(of_acceleration, u, sample)
    contact, total = params.wall.contact(x, v)
    row = [x, v, a, total]
    motion, index = params.motion, 0
    motion.x, motion.v, motion.a, motion.a_before, motion.contact = x, v, a, a_before, contact
    one_loop = contact is False or contact is True
    try:
        for active in params.elements:
            memory = memories[index]
            if memory is None:
                force = active.element.force(motion)
            else:
                if memory.__class__ is Told:
                    force, memory = answer_of(active, memory, motion, row, total, params.wall, params.declared)
                else:
                    force, memory = active.element.force(motion, memory)
                memories = (*memories[:index], memory, *memories[index + 1 :])
            if one_loop:
                if not contact and active.acts != "always":
                    force = 0.0
                elif force.__class__ is not float:
                    force = as_number(force)
            else:
                force = 1.0 * (force if active.acts == "always" else where(contact, force, 0.0))
            row.append(force)
            total = total + force
            index += 1
    except (Exception, SystemExit) as error:
        raise NoForce(index) from error
    row += (total, contact)
    return (of_velocity, of_acceleration, a, memories), row
