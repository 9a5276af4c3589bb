"""The cost of a scene, counted and not timed, effect by effect: bytecode instructions of the loop.

A count is the same on every machine with the same version of CPython. A call into NumPy counts as one instruction,
whatever the size of its arrays.
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Iterable
from dataclasses import dataclass, replace
from threading import get_ident
from types import CodeType, FrameType
from typing import TYPE_CHECKING, Any, Self

from haploop.controller.controller import Controller
from haploop.launch.plan.effect import Effect
from haploop.launch.plan.effects import effects_of
from haploop.launch.plan.plan import multiplications
from haploop.plant.plant import Plant
from haploop.plant.where_it_pays import WhereItPays
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

Kinds = dict[str, type["Element"]]
# The scenes of ``ablations`` that are not named by the effect that is left out.
WHOLE, AGAIN, NONE = "all effects", "all effects again", "no effect"
# Exchanges that are left out, since they build caches, and exchanges that are counted.
_FIRST, _COUNTED = 20, 101
# A tool number of ``sys.monitoring`` that nothing else has: a debugger, coverage and a profiler are 0 to 2.
_TOOL = 3


@dataclass(frozen=True)
class Operations:
    """Bytecode instructions per exchange of samples and commands, which covers L + 1 ticks: the median."""

    plant: int
    controller: int
    ticks: int

    @property
    def per_tick(self) -> float:
        """Instructions of both together, per tick."""
        return (self.plant + self.controller) / self.ticks


class _Counter:
    """Counts every instruction of this thread outside this file, while it is entered."""

    def __init__(self) -> None:
        self._count, self._thread = 0, get_ident()

    def __enter__(self) -> Self:
        self._before = sys.gettrace()
        if sys.version_info >= (3, 12):
            # A trace function would count code that it has seen before differently from new code.
            events = sys.monitoring
            events.use_tool_id(_TOOL, "haploop")
            events.register_callback(_TOOL, events.events.INSTRUCTION, self._note)
            events.set_events(_TOOL, events.events.INSTRUCTION)
        else:
            sys.settrace(self._trace)
        return self

    def __exit__(self, *_: object) -> None:
        if sys.version_info >= (3, 12):
            sys.monitoring.set_events(_TOOL, 0)
            sys.monitoring.register_callback(_TOOL, sys.monitoring.events.INSTRUCTION, None)
            sys.monitoring.free_tool_id(_TOOL)
        else:
            sys.settrace(self._before)

    def _note(self, code: CodeType, _offset: int) -> None:
        self._count += code.co_filename != __file__ and get_ident() == self._thread

    def _trace(self, frame: FrameType, event: str, _argument: Any) -> Any:
        if frame.f_code.co_filename == __file__:
            return None
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        self._count += event == "opcode"
        return self._trace

    def take(self) -> int:
        """Returns the count since the last call."""
        count, self._count = self._count, 0
        return count


def operations(scene: Scene, kinds: Kinds) -> Operations:
    """Runs the loop of a resolved scene in this process for some ticks and counts; events are left out.

    A shorter run is counted over its second half.
    """
    time = Timebase.from_scene(scene)
    with WhereItPays.none():  # machine code has no bytecode instructions
        plant, controller = Plant(scene, time), Controller(scene, time, kinds)
    counter = _Counter()
    counts: list[tuple[int, int]] = []

    def exchange(_tick: int, samples: list[tuple[float, ...]]) -> list[float]:
        by_plant = counter.take()
        answer = controller.answer(samples)
        counts.append((by_plant, counter.take()))
        return answer

    ticks = time.lookahead_ticks + 1
    end = min((_FIRST + _COUNTED) * ticks, time.ticks)
    with counter:
        plant.run_until(end, exchange)
    counted = counts[min(_FIRST, len(counts) // 2) :]
    by_plant, by_controller = (statistics.median_low(column) for column in zip(*counted, strict=True))
    return Operations(by_plant, by_controller, ticks)


@dataclass(frozen=True)
class Bill:
    """The cost of a scene, in bytecode instructions per tick.

    Attributes:
        whole: of the whole loop.
        effects: of each named effect: what the loop would save without it, by the effect's name.
        elements: the same of each dissipation element.
        multiplications: of the motion, in all; and saved by leaving out each effect, by name.
    """

    whole: Operations
    effects: dict[str, float]
    elements: list[float]
    multiplications: tuple[int, dict[str, int]]


def bill(scene: Scene, named: Iterable[Effect], kinds: Kinds) -> Bill:
    """Counts the loop as it is, then without each effect and each element in turn."""
    whole = operations(scene, kinds)

    def saved(other: Scene) -> float:
        return whole.per_tick - operations(other, kinds).per_tick

    elements = scene.dissipation
    others = {effect.name: effect.without(scene) for effect in named}
    moving = multiplications(scene)
    return Bill(
        whole,
        {name: saved(other) for name, other in others.items()},
        [saved(replace(scene, dissipation=elements[:i] + elements[i + 1 :])) for i in range(len(elements))],
        (moving, {name: moving - multiplications(other) for name, other in others.items()}),
    )


def ablations(scene: Scene) -> dict[str, Scene]:
    """Returns the resolved scene, twice; without each of its effects, by the effect's name; and with none left.

    Measured alike, the first two differ by chance alone, which is what a difference between others must exceed.
    """
    parts = {effect.name: effect.without(scene) for effect in effects_of(scene)}
    bare = scene
    while named := effects_of(bare):
        bare = named[0].without(bare)
    return {WHOLE: scene, AGAIN: scene, **parts, NONE: bare}
