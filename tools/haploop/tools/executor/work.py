"""The work of a worker on a part of a sweep: make its scenes, run them together, keep what is asked for."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

from haploop.controller.dissipation import Element
from haploop.logger.summary import Summary
from haploop.protocol.scene.scene import Scene
from haploop.protocol.transport.prints import unheard

Sources = tuple[tuple[str, str], ...]
Results = Callable[[list[Scene]], Iterator[tuple[int, Summary]]]


def _whole_result(_item: Any, _scene: Scene | None, result: Summary) -> Summary:
    return result


@dataclass(frozen=True)
class Work:
    """A job that is sent to workers with every part: nothing but values and importable functions.

    Attributes:
        make: from an item to its resolved scene; an error that it raises is the reason why the item is refused.
        keep: from an item, its scene (None if it was refused) and its result to what is sent back: by default all.
        sources: plugin files as (name, text); a worker on another machine has no files of this one.
    """

    make: Callable[[Any], Scene]
    keep: Callable[[Any, Scene | None, Summary], Any] = _whole_result
    sources: Sources = ()
    energy: bool = True
    trajectories: bool = False
    compiled: bool = False

    def run(self, items: Sequence[Any]) -> tuple[float, list[Any]]:
        """Runs the items; returns the seconds that took in all, and what is kept of every item.

        Raises:
            PluginError: a plugin does not load here.
            ImportError: JAX is asked for and not installed here.
        """
        began = time.perf_counter()
        with unheard() if self.sources else nullcontext():
            results = self._results()
            scenes, kept = self._made(items)
            for index, result in _safely(results, scenes, list(scenes)):
                kept[index] = self.keep(items[index], scenes[index], result)
        return time.perf_counter() - began, [kept[index] for index in range(len(items))]

    def lost(self, item: Any, why: str) -> Any:
        scenes, kept = self._made([item])
        return self.keep(item, scenes[0], _failed(scenes[0], why)) if scenes else kept[0]

    def _made(self, items: Sequence[Any]) -> tuple[dict[int, Scene], dict[int, Any]]:
        scenes, kept = {}, {}
        for index, item in enumerate(items):
            try:
                scenes[index] = self.make(item)
            except Exception as error:
                kept[index] = self.keep(item, None, {"ended": "refused", "why": str(error)})
        return scenes, kept

    def _results(self) -> Results:
        kinds = load_kinds(self.sources)
        if self.compiled:
            import jax  # noqa: F401 (an error raised here is no fault of a scene)

            from haploop.launch.runs.in_jax import compiled_results

            return partial(compiled_results, kinds=kinds, energy=self.energy)
        from haploop.launch.runs.in_batch import batch_results

        return partial(batch_results, kinds=kinds, energy=self.energy, trajectories=self.trajectories)


def _safely(results: Results, scenes: dict[int, Scene], left: list[int]) -> Iterator[tuple[int, Summary]]:
    """Yields every result; if a scene raises, those without a result are run in halves until it stands alone."""
    done: set[int] = set()
    try:
        for place, result in results([scenes[index] for index in left]):
            done.add(place)
            yield left[place], result
    except Exception as error:
        rest = [index for place, index in enumerate(left) if place not in done]
        if len(rest) == 1:
            yield rest[0], _failed(scenes[rest[0]], f"{type(error).__name__}: {error}")
        else:
            yield from _safely(results, scenes, rest[: len(rest) // 2])
            yield from _safely(results, scenes, rest[len(rest) // 2 :])


@lru_cache(maxsize=8)
def load_kinds(sources: Sources) -> dict[str, type[Element]]:
    """Loads the element kinds at hand, the installed ones and those of these sources, once in this process.

    Raises PluginError if one does not load.
    """
    from haploop.controller.dissipation import registry
    from haploop.controller.dissipation.registry import load_source

    kinds = registry()
    for name, source in sources:
        kinds |= load_source(source, name)
    return kinds


def _failed(scene: Scene, why: str) -> Summary:
    return {"title": scene.title, "seed": scene.seed, "ended": "failed", "why": why}
