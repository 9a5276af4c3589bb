"""The comparison of all stabilizers on a loop and on similar ones: what is asked, kept on disk, and found."""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import Actuator, Scene
from haploop.tools.advise.families import FORCE_BOUNDING, STABILIZERS, Family, Values
from haploop.tools.advise.walls.rendered import Rendered, Trying
from haploop.tools.advise.walls.store import Failure
from haploop.tools.compare.bench import Effort, Job, Row, alone, bench
from haploop.tools.executor.executors import Executor
from haploop.tools.render.progress import Stage

DESCRIBED = "as described"
# Blocks of seeds whose results are shown, and against which rankings are checked: tuning and trial have others.
TOLD, AGAIN = 1, 2
# An element that holds less than this share of what is held without one hides every wall.
_SHOWS = 0.1
_LATER_S, _FINER, _DRIVE_HZ = 1e-3, 0.25, 100.0


@dataclass(frozen=True)
class OfLoop:
    """All stabilizers on one loop.

    Attributes:
        delay_s: the round-trip delay.
        alone_N_m: roughly the stiffest wall without any, from which the searches begin.
        rows: the results under the seeds shown.
        again: the results under the others.
    """

    name: str
    delay_s: float
    alone_N_m: float
    rows: tuple[Row, ...]
    again: tuple[Row, ...]


@dataclass(frozen=True)
class Comparison:
    """What ``haploop compare`` found.

    Attributes:
        effort: the effort on the loop as described, the first of the loops.
        beside: the effort on each of the other loops.
        task: what every wall has to bear, in words.
    """

    name: str
    task: str
    notes: tuple[str, ...]
    effort: Effort
    beside: Effort
    loops: tuple[OfLoop, ...]


def variants(loop: Scene) -> dict[str, Scene]:
    """Returns the loop and those with another delay, sensor and drive, by name; only what changes something."""
    clock, actuator = loop.clock, loop.actuator or Actuator()
    found = {DESCRIBED: loop}
    later = clock.round_trip_delay + _LATER_S
    found[f"{_LATER_S * 1e3:g} ms more delay"] = with_value(loop, "clock.round_trip_delay", later)
    if step := value_at(loop, "encoder.resolution"):
        found["encoder four times as fine"] = with_value(loop, "encoder.resolution", step * _FINER)
    if actuator.bandwidth is None or actuator.bandwidth > _DRIVE_HZ:
        slow = replace(loop, actuator=replace(actuator, bandwidth=_DRIVE_HZ))
        found[f"drive of {_DRIVE_HZ:g} Hz"] = slow
    return found


class Kept:
    """Rows found earlier, by a key made of everything that decides them; one line each in a file."""

    def __init__(self, file: Path) -> None:
        self._file, self._known = file, dict[str, Any]()
        text = file.read_text(encoding="utf-8", errors="replace") if file.exists() else ""
        for line in text.splitlines():
            with contextlib.suppress(ValueError):
                key, found = json.loads(line)
                self._known[key] = found

    def get(self, key: str) -> Any:
        """Returns what is kept by this key, or None."""
        return self._known.get(key)

    def add(self, key: str, found: Any) -> None:
        """Keeps what was found, on disk at once."""
        self._known[key] = json.loads(json.dumps(found))
        with self._file.open("a", encoding="utf-8") as file:
            file.write("\n" + json.dumps([key, found]) + "\n")


def key_of(*told: object) -> str:
    return hashlib.sha256(repr((version("haploop"), *told)).encode()).hexdigest()[:24]


def compare(
    loops: dict[str, Scene], effort: Effort, beside: Effort, kept: Kept, executor: Executor, stage: Stage
) -> tuple[OfLoop, ...]:
    """Tunes and tries every stabilizer on every loop, except what is kept already, each under two sets of seeds.

    Args:
        effort: the effort on the first loop, in the whole box of parameters.
        beside: the effort on each of the others, around what is best on the first.
    """
    found: dict[tuple[str, str], tuple[Row, ...]] = {}
    alone_N_m = _each(alone, loops, kept, executor, stage, "walls without any element", float)
    main, *others = loops
    families = [family for family in STABILIZERS if plays(family, loops[main], alone_N_m[main])]
    for names, of in (([main], effort), *([(others, beside)] if others else [])):
        jobs = {
            (name, family.name): Job(
                loops[name], family.name, alone_N_m[name], _starts(found.get((main, family.name))), of
            )
            for name in names
            for family in families
        }
        found |= _each(bench, jobs, kept, executor, stage, f"stabilizers ({', '.join(names)})", _as_rows)
    return tuple(
        OfLoop(
            name,
            loop.clock.round_trip_delay,
            alone_N_m[name],
            *(
                tuple(row for (of, _), rows in found.items() if of == name for row in rows if row.block == block)
                for block in (TOLD, AGAIN)
            ),
        )
        for name, loop in loops.items()
    )


def plays(family: Family, loop: Scene, alone_N_m: float) -> bool:
    """Tells whether a family can hold as much as compares with a wall without an element: force bounding may not."""
    return family is not FORCE_BOUNDING or bounded_N_m(loop) > _SHOWS * alone_N_m


def bounded_N_m(loop: Scene) -> float:
    """Returns what force bounding holds of any stiffer wall that is pressed slowly, N/m: E' = f and f^2 = 4 b E / T
    have f = (2 b / T) x, b the damping that the device declares."""
    return 2.0 * loop.device.damping * loop.clock.control_rate


def _starts(rows: tuple[Row, ...] | None) -> tuple[tuple[int, Values | None], ...]:
    return tuple((row.block, row.values) for row in rows) if rows else ((TOLD, None), (AGAIN, None))


def _each(
    call: Callable[[Any], Any], items: Mapping[Any, Any], kept: Kept, executor: Executor, stage: Stage, words: str,
    read: Callable[[Any], Any],
) -> dict[Any, Any]:  # fmt: skip
    """Calls a function on each item without a kept answer, and returns all answers by name; keeps them as they come."""
    keys = {name: key_of(call.__name__, item) for name, item in items.items()}
    new = {keys[name]: item for name, item in items.items() if kept.get(keys[name]) is None}
    advance = stage(words, len(items))
    for _ in range(len(items) - len(new)):
        advance()
    under_way: dict[Future[Any], str] = {}
    while new or under_way:
        while new and len(under_way) < executor.count:
            key = next(iter(new))
            under_way[executor.submit(call, new.pop(key))] = key
        for future in wait(under_way, return_when=FIRST_COMPLETED).done:
            answer = future.result()
            kept.add(under_way.pop(future), answer if isinstance(answer, float) else [asdict(row) for row in answer])
            advance()
    return {name: read(kept.get(key)) for name, key in keys.items()}


def _as_rows(data: Sequence[dict[str, Any]]) -> tuple[Row, ...]:
    return tuple(map(_as_row, data))


def _as_row(data: dict[str, Any]) -> Row:
    """Returns a row from its form in JSON, by way of ``asdict``."""
    read: dict[str, Any] = {name: tuple(data[name]) for name in ("values", "at_edge", "parameter", "device")}
    read["seeds"] = tuple(map(_as_trying, data["seeds"]))
    return Row(**data | read)


def _as_trying(data: Sequence[Any]) -> Trying:
    limit_N_m, wall_N_m, shown, fails_N_m, failure = data
    return Trying(limit_N_m, wall_N_m, Rendered(*shown), fails_N_m, Failure.from_data(failure) if failure else None)
