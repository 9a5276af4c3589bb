"""The columns that a sweep records: dotted keys of a run's summary, checked on a run of two ticks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from haploop.launch.runs.in_process import run_in_process
from haploop.launch.runs.result import unit_of
from haploop.launch.scene.events import scene_events
from haploop.launch.spec import RunFailed
from haploop.launch.stability.finding import Finding
from haploop.logger.summary import OF_THE_MACHINE, Summary
from haploop.protocol.changes import at_work, changes_of
from haploop.protocol.names import nearest
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.tools.sweep.table import ENDED, NUMBER, PROVISOS, TEXT, TRUTH, WHY, Column

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element
    from haploop.tools.sweep.cells import Sweep

VERDICT = "verdict"
# Without the books, which take most of a run's time.
_USUAL = (VERDICT, "window.oscillation_m", "window.displayed_stiffness_N_m", "extremes.force_max_N")
TICKS = 2
Complain = Callable[[int, str, str | None], None]


def usual(base: Scene) -> list[str]:
    """Returns the keys that are recorded unless others are asked for."""
    return [*_USUAL, *(["stability.width_m", "stability.frequency_Hz"] if _is_pushed(base) else [])]


def _is_pushed(scene: Scene) -> bool:
    return scene.run.verdict == "pushed"


def make_columns(
    names: Sequence[str], sweep: Sweep, kinds: Mapping[str, type[Element]], complain: Complain
) -> list[Column]:
    """Makes a column for each key; the verdict is always among them, and what it rests on.

    Args:
        sweep: what will be run; the first and the last of its cells that can be run are sampled.
        complain: called with the place of a key that does not belong to a number, word or truth value, a sentence about
            it, and the nearest key.
    """
    known: Summary = {}
    for cell in _samples(sweep):
        known |= _leaves(_short_run(cell, kinds))
    without_places = set(map(_without_places, known))
    for place, name in enumerate(names):
        if not known or _without_places(name) in without_places:
            continue
        if inner := [key for key in known if key.startswith(f"{name}.")]:
            complain(place, f"It is a table; name one of {', '.join(inner[:8])}.", None)
        else:
            complain(place, "It must be a dotted key of a run's summary.", nearest(name, known))
    conditions = [PROVISOS] if _is_pushed(sweep.base) else []
    wanted = dict.fromkeys((VERDICT, *names, *conditions))
    return [Column(name, _kind(name, known.get(name)), unit_of(name)) for name in wanted if name not in (ENDED, WHY)]


def wants_energy(columns: Sequence[Column]) -> bool:
    """Tells whether the books must be kept."""
    return any(column.name.split(".")[0] == "energy" for column in columns)


def wants_trajectories(columns: Sequence[Column]) -> bool:
    """Tells whether every trajectory must be hashed."""
    return any(column.name == "trajectory_sha256" for column in columns)


def _samples(sweep: Sweep) -> list[Scene]:
    """Returns the scenes of the first and last cell, as they begin and as their events leave them.

    Returns the base where neither of them can be run.
    """
    found: list[Scene] = []
    for cell in (0, sweep.count - 1):
        with suppress(Exception):  # the cell will be a row that says why
            found.append(scene := sweep.scene(cell))
            if scene.event:
                changes = changes_of(scene_events(scene, Timebase.from_scene(scene)))
                found.append(at_work(replace(scene, event=()), changes))
    return found or [sweep.base]


def _short_run(scene: Scene, kinds: Mapping[str, type[Element]]) -> Summary:
    try:
        summary = run_in_process(replace(scene, duration=TICKS / scene.clock.control_rate), dict(kinds))
    except RunFailed:
        return {}
    return {key: value for key, value in summary.items() if key not in OF_THE_MACHINE}


def _leaves(value: Any, key: str = "") -> Summary:
    listed = isinstance(value, list) and any(isinstance(entry, dict) for entry in value)
    inner = value.items() if isinstance(value, dict) else enumerate(value) if listed else None
    if inner is None:
        return {key: value}
    found: Summary = {}
    for name, entry in inner:
        found |= _leaves(entry, f"{key}.{name}".lstrip("."))
    return found


def _without_places(name: str) -> str:
    """Returns a key with every index of a list as 0: an element that is swapped in later makes the list longer."""
    return ".".join("0" if part.isdecimal() else part for part in name.split("."))


def _kind(name: str, value: Any) -> str:
    """Returns the kind of a column from one of its values; for None, as some are after two ticks, as it is declared."""
    if value is None:
        declared = Finding.__annotations__.get(name.removeprefix("stability."), "")
        return TEXT if "str" in declared else TRUTH if "bool" in declared else NUMBER
    return TRUTH if isinstance(value, bool) else TEXT if isinstance(value, str | list) else NUMBER
