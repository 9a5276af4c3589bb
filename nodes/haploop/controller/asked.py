"""Answers to an element that asks, at a tick, and the memory that these answers need."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from haploop.controller.active_elements import ActiveElement
from haploop.controller.dissipation.element import Element, ElementError, Motion, as_number
from haploop.protocol.arrays import where
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.walls.wall import Wall


class Declared(NamedTuple):
    """What a scene declares besides the wall, for elements that ask.

    Attributes:
        mass, damping: of the device alone, kg and N s/m.
        whole_ticks, late_steps, steps: whole ticks and further steps of the round-trip delay; plant steps in a tick.
    """

    mass: Any
    damping: Any
    whole_ticks: int
    late_steps: int
    steps: int

    @classmethod
    def from_scene(cls, scene: Scene) -> Declared:
        time = Timebase.from_scene(scene)
        return cls(scene.device.mass, scene.device.damping, 0, 0, time.steps_per_tick).delayed(time.delay_steps)

    def delayed(self, steps: int) -> Declared:
        whole, late = divmod(steps, self.steps)
        return self._replace(whole_ticks=whole, late_steps=late)


# The names by which an element asks for the energies that ``Told`` keeps, in the same order.
ENERGIES = ("wall_energy", "own_energy", "output_energy", "total_energy")


class Told(NamedTuple):
    """Memory of an element that asks: its own, and what is kept for it; a tree of numbers.

    Attributes:
        own: the memory that it declares.
        row: row of the tick before: x first, the wall's force fourth, the total last but one; None at the first tick.
        force, output: the element's force at the tick before, and its sum with that of the wall and all before it, N.
        energies: energies of wall, element, output and total, each E += -f[k-1] (x_m[k] - x_m[k-1]), J.
        commands: totals before that of ``row``, newest first, N; as many as may act.
    """

    own: Any
    row: list[Any] | None = None
    force: Any = 0.0
    output: Any = 0.0
    energies: tuple[Any, ...] = (0.0, 0.0, 0.0, 0.0)
    commands: tuple[Any, ...] = ()


def first_memory(element: Element, declared: Declared) -> Any:
    """Returns the memory of an element before its first tick."""
    if not element.asks:
        return element.memory
    commands = (0.0,) * (declared.whole_ticks + 1) if "acted" in element.asks else ()
    return Told(element.memory, commands=commands)


def shown(memory: Any, names: Sequence[str]) -> list[float]:
    """Returns what an element shows in the log besides its force: fields of its memory.

    Raises ElementError if they are not numbers.
    """
    own = memory.own if memory.__class__ is Told else memory
    try:
        return [float(getattr(own, name)) for name in names]
    except (AttributeError, TypeError, ValueError) as error:
        what = f"{type(error).__name__}: {error}"
        raise ElementError(
            f"The log shows {' and '.join(names)} of its memory, which must be numbers; {what}."
        ) from error


def answer_of(
    active: ActiveElement,
    told: Told,
    now: Motion,
    row: list[Any],
    force: Any,
    wall: Wall,
    declared: Declared,
) -> tuple[Any, Told]:
    """Returns the force of an element that asks, and its memory for the next tick.

    Args:
        now: what every element is told.
        row: row of this tick, complete up to this element; the memory keeps it, and it is complete by the next tick.
        force: force of the wall and of all elements before this one, N.
    """
    own, before, force_before, output_before, (wall_J, own_J, output_J, total_J), commands = told
    x, wall_force, total_before, way = now.x, row[3], 0.0, 0.0 * now.x
    if before is not None:
        way, total_before = x - before[0], before[-2]
        wall_J = wall_J - before[3] * way
        own_J = own_J - force_before * way
        output_J = output_J - output_before * way
        total_J = total_J - total_before * way
    known = {
        "force": force, "wall_force": wall_force, "way": way,
        "wall_position": wall.position, "wall_stiffness": wall.stiffness,
        "force_before": force_before, "output_before": output_before, "total_before": total_before,
        "wall_energy": wall_J, "own_energy": own_J, "output_energy": output_J, "total_energy": total_J,
        "device_mass": declared.mass, "device_damping": declared.damping,
    }  # fmt: skip
    if "wall_stored" in active.element.asks:
        depth = where(now.contact, (x - wall.position) * wall.inward, 0.0 * x)
        known["wall_stored"] = wall.stored(depth)
    if commands:
        known["acted"] = _acted((total_before, *commands), declared)
        commands = (total_before, *commands)[: declared.whole_ticks + 1]
    motion = now.telling(known, active.element.asks)
    if own is None:
        answer = active.element.force(motion)
    else:
        answer, own = active.element.force(motion, own)
    commanded = answer if active.acts == "always" else where(now.contact, answer, 0.0)
    try:
        output = force + commanded
    except TypeError:
        as_number(answer)  # which says what it is
        raise
    return answer, Told(own, row, commanded, output, (wall_J, own_J, output_J, total_J), commands)


def _acted(commands: tuple[Any, ...], declared: Declared) -> Any:
    """Returns the mean force held over the last period: c[k-1-L] from its step ``late`` on, c[k-2-L] before that.

    If a longer delay has just been set, the oldest known command stands for those before it.
    """
    oldest = len(commands) - 1
    newer, older = (commands[min(declared.whole_ticks + ago, oldest)] for ago in (0, 1))
    late, steps = declared.late_steps, declared.steps
    return ((steps - late) * newer + late * older) / steps
