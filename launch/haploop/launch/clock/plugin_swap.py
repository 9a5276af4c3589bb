"""A swap to an element of a plugin: the file is first tried in a separate process, and only then used."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import TYPE_CHECKING

from haploop.launch.clock.clock import Clock, ClockError
from haploop.launch.clock.plugin_trial import PluginTrial, read_source
from haploop.launch.clock.reloads import Code, Reloads
from haploop.launch.spec import keep_plugin
from haploop.protocol.changes import Event
from haploop.protocol.scene.scene import ElementTable

if TYPE_CHECKING:
    from haploop.launch.spec import RunSpec


def swap_plugin(
    clock: Clock, spec: RunSpec, reloads: Reloads, change: Event, at_s: float | None, reload: bool
) -> Generator[None, None, tuple[int, Sequence[ElementTable], Code | None]]:
    """Schedules the swap once its element has been made, and has given a force at rest, in another process.

    Returns the tick, the elements before the swap and, after a reload, the former code of its kinds.

    Yields during the trial, so that time goes on. Whatever the outcome of the trial, this process has not run the file;
    if anything fails, nothing has changed.

    Args:
        change: ``{"swap": {...}, "element": i}``, of a kind that came from a file.
        reload: whether to use the user's file as it is now, instead of the copy in use.

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
            why = f"{source} now defines {taken[0]}, a kind that the run has from another source; give it another name"
            raise ClockError(f"{why}. The old element stays.")
        _, event = clock.resolved(change, at_s, {**spec.kinds, **found} if reload else spec.kinds)
        assert event.swap
        yield from trial.make([event.swap])
    before = clock.scene_at(clock.tick_at(at_s)).dissipation
    if not reload:
        return clock.change(change, at_s), before, None
    there = set(spec.plugin_files.values())
    kept = keep_plugin(source, spec.out, text.encode())
    try:
        code: Code = {each: (element, source, kept) for each, element in found.items()}
        tick, former = reloads.change(change, at_s, code, kept)
    except Exception:
        if kept not in there:
            kept.unlink(missing_ok=True)
        raise
    return tick, before, former
