"""A swap to an element of a plugin: its file is tried in a process of its own first, and only then taken up."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haploop.launch.clock.clock import Clock, ClockError
from haploop.launch.processes.plugin_trial import PluginTrial, read_source
from haploop.launch.spec import keep_plugin
from haploop.protocol.changes import Event
from haploop.protocol.scene.scene import ElementTable

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element
    from haploop.launch.spec import RunSpec


def swap_plugin(
    clock: Clock, spec: RunSpec, change: Event, at_s: float | None, reload: bool
) -> Generator[None, None, tuple[int, Sequence[ElementTable]]]:
    """Schedules the swap once its element has been made and has given a force at rest, elsewhere.

    Returns the tick and the elements before it.

    Yields while the trial goes on, so that time does. Whatever becomes of the trial, this process has not run the file;
    where anything fails, nothing has changed.

    Args:
        change: ``{"swap": {...}, "element": i}``, of a kind that came from a file.
        reload: whether to take up the user's file as it is now, instead of the copy at work.

    Raises:
        PluginError, ElementError: the file does not load, or the element does not take its parameters.
        ClockError, SceneError, OutputError: the file defines no such kind, the swap does not fit, no copy can be kept.
    """
    kind = change["swap"]["kind"]
    source = spec.plugin_sources[kind]
    text = read_source(source if reload else spec.plugin_files[kind])
    with PluginTrial(text, str(source)) as trial:
        found = yield from trial.load()
        if kind not in found:
            raise ClockError(f"{source} no longer defines {kind}, but {', '.join(found)}; the old element stays.")
        if taken := [each for each in found if each in spec.kinds and spec.plugin_sources.get(each) != source]:
            why = f"{source} defines {taken[0]} now, a kind that the run has from elsewhere; give it a name of its own"
            raise ClockError(f"{why}. The old element stays.")
        _, event = clock.resolved(change, at_s, {**spec.kinds, **found} if reload else spec.kinds)
        assert event.swap
        yield from trial.make([event.swap])
    before = clock.scene_at(clock.tick_at(at_s)).dissipation
    if not reload:
        return clock.change(change, at_s), before
    return _taken_up(clock, spec, change, at_s, (source, text, found)), before


def _taken_up(
    clock: Clock, spec: RunSpec, change: Event, at_s: float | None, tried: tuple[Path, str, dict[str, type[Element]]]
) -> int:
    source, text, found = tried
    before: dict[str, Any] = dict(spec.kinds)
    there = set(spec.plugin_files.values())
    kept = keep_plugin(source, spec.out, text.encode())
    spec.kinds.update(found)
    try:
        tick = clock.change(change, at_s, plugin=str(kept.resolve()))
    except Exception:
        spec.kinds.clear()
        spec.kinds.update(before)
        if kept not in there:
            kept.unlink(missing_ok=True)
        raise
    for each in found:
        spec.plugin_sources[each], spec.plugin_files[each] = source, kept
    return tick
