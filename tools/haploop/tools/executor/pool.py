"""Many scenes on many cores: batches in parts that workers share, in bounded memory and without a lost scene."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from pathlib import Path
from typing import Any, NamedTuple, Self

from haploop.controller.dissipation import load_plugin
from haploop.launch.batch.stacking import is_batchable, structure
from haploop.launch.runs.in_batch import FEWEST
from haploop.logger.summary import Summary
from haploop.protocol.files import read_text
from haploop.protocol.scene.scene import Scene
from haploop.tools.executor.executors import make_executor
from haploop.tools.executor.work import Work

# Asked whether to stop, with the number of items under way.
Stop = Callable[[int], bool]

_POLL_S = 0.3
DIED = "The process that ran it died: it was killed, ran out of memory or crashed in compiled code."
# Most items in a part, and how much longer the next may be than any before.
MOST, GROWTH = 1024, 8
# An array costs much the same for one scene and for some two hundred: the first part, and the least later on.
FIRST, LEAST = 64, 256
# Seconds that a part should take: at least, at most at the beginning, and at most ever.
LEAST_S, SHORT_S, LONG_S = 0.2, 2.0, 60.0
# A part may take this fraction of the time gone by, so that a long sweep does not leave a heap of small files.
FRACTION = 0.02


class Group(NamedTuple):
    """Items to be run together if possible, or known to be run one by one; ``items`` may be a range."""

    items: Sequence[Any]
    together: bool


class Sizes:
    """Finds how many items the next part should have: few first, so that progress shows, then what their time allows.

    Args:
        count: number of all items, so that no worker has to wait long for another at the end; None if it is not known.
        most: most items of a part; memory is proportional to it.
    """

    def __init__(self, workers: int, count: int | None = None, most: int = MOST) -> None:
        self._workers, self._left, self._most = workers, count, most
        # For parts run together, and one by one: the most items the next may have, and the seconds an item took.
        self._largest, self._each_s = {True: FIRST, False: 1}, {True: 0.0, False: 0.0}
        self._began = time.monotonic()

    def next(self, together: bool) -> int:
        """Returns the size of the next part, at least 1."""
        each_s = self._each_s[together]
        size = min(self._most, self._largest[together])
        if each_s:
            target_s = min(LONG_S, max(SHORT_S, FRACTION * (time.monotonic() - self._began)))
            size = min(size, int(target_s / each_s))
        if self._left is not None:
            worthwhile = int(LEAST_S / each_s) if each_s else 0
            share = math.ceil(self._left / (2 * self._workers))
            size = min(size, max(share, worthwhile, LEAST if together else 1))
        return max(1, size)

    def taken(self, items: int) -> None:
        if self._left is not None:
            self._left = max(0, self._left - items)

    def took(self, part: Group, seconds: float) -> None:
        """Records the seconds a part took; the next may be longer."""
        self._each_s[part.together] = seconds / len(part.items)
        self._largest[part.together] = max(self._largest[part.together], len(part.items) * GROWTH)


def cut(groups: Iterable[Group], sizes: Sizes) -> Iterator[Group]:
    for items, together in groups:
        together = together and len(items) >= FEWEST
        first = 0
        while first < len(items):
            part = items[first : first + sizes.next(together)]
            sizes.taken(len(part))
            yield Group(part, together)
            first += len(part)


def grouped(
    items: Iterable[Any], key: Callable[[Any], Hashable], window: int = 4 * MOST
) -> Iterator[tuple[Any, list[Any]]]:
    """Yields each key with its items, looking ``window`` items ahead."""
    source = iter(items)
    while block := list(itertools.islice(source, window)):
        groups: dict[Hashable, list[Any]] = {}
        for item in block:
            groups.setdefault(key(item), []).append(item)
        yield from groups.items()


class Pool:
    """Workers as of ``make_executor`` that are kept for several calls; a context manager."""

    def __init__(self, workers: int | None = None, dask: str | None = None) -> None:
        self._executor = make_executor(workers, dask)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: Any) -> None:
        self._executor.__exit__(*error)

    @property
    def count(self) -> int:
        return self._executor.count

    def results(
        self, scenes: Iterable[Scene], plugins: Sequence[Path] = (), *, energy: bool = True, trajectories: bool = False
    ) -> Iterator[tuple[int, Summary]]:
        """Yields the index of each resolved scene and its result, in the order in which they come in.

        Scenes are taken a few thousand at a time; one that fails, or kills its worker, has a result with its reason.
        ``energy`` and ``trajectories`` are as in ``haploop.launch.runs.in_batch.batch_results``.

        Raises:
            PluginError, ExecutorError: a plugin cannot be used, or no worker can be started.
        """
        work = Work(make=_second, sources=read_sources(plugins), energy=energy, trajectories=trajectories)
        count = len(scenes) if isinstance(scenes, Sequence) else None
        shapes = grouped(enumerate(scenes), lambda item: structure(item[1]) if is_batchable(item[1]) else None)
        groups = (Group(items, together=shape is not None) for shape, items in shapes)
        for part in self.parts(work, groups, count):
            for (index, _), result in part:
                yield index, result

    def parts(
        self, work: Work, groups: Iterable[Group], count: int | None = None, stop: Stop = lambda _: False
    ) -> Generator[list[tuple[Any, Any]]]:
        """Does some work on items, part by part; no more than two parts a worker are under way.

        When a worker dies, it is not known which of the parts under way killed it. So each of them is then run alone,
        and one that kills its worker again is halved until the culprit stands alone.

        Args:
            groups: groups of items that belong together; taken when there is room for them.
            stop: asked before each part, with the number of items under way; True ends the work after these.

        Yields:
            For each finished part, its items, each with what is kept of it.

        Raises:
            PluginError, ExecutorError: a plugin does not load in a worker, or no worker can be started.
        """
        sizes = Sizes(self.count, count)
        source = cut(groups, sizes)
        flying: dict[Future[Any], Group] = {}
        try:
            while True:
                while not stop(_items(flying)) and len(flying) < self._executor.room and (part := next(source, None)):
                    flying[self._submitted(work, part.items)] = part
                if not flying:
                    return
                done = wait(flying, _POLL_S, FIRST_COMPLETED).done  # now and then to ask whether to stop
                if not all(map(self._outcome, done)):
                    done = wait(flying).done  # the others under way have died with it, or will soon be done
                suspects: list[Group] = []
                for future in done:
                    part = flying.pop(future)
                    if outcome := self._outcome(future):
                        sizes.took(part, outcome[0])
                        yield list(zip(part.items, outcome[1], strict=True))
                    else:
                        suspects.append(part)
                for part in suspects:
                    yield from self._by_itself(work, part.items, stop)
        finally:
            for future in flying:
                future.cancel()

    def _by_itself(self, work: Work, items: Sequence[Any], stop: Stop) -> Iterator[list[tuple[Any, Any]]]:
        self._executor.renew()
        if stop(0):
            return
        if outcome := self._outcome(self._submitted(work, items)):
            yield list(zip(items, outcome[1], strict=True))
        elif len(items) == 1:
            yield [(items[0], work.lost(items[0], DIED))]
        else:
            middle = len(items) // 2
            for half in (items[:middle], items[middle:]):
                yield from self._by_itself(work, half, stop)

    def _submitted(self, work: Work, items: Sequence[Any]) -> Future[Any]:
        try:
            return self._executor.submit(work.run, items)
        except self._executor.worker_died as error:
            future: Future[Any] = Future()
            future.set_exception(error)
            return future

    def _outcome(self, future: Future[Any]) -> tuple[float, list[Any]] | None:
        """Waits for a part; returns its seconds and answers, None if its worker died."""
        try:
            return future.result()
        except self._executor.worker_died:
            return None


def read_sources(plugins: Iterable[Path]) -> tuple[tuple[str, str], ...]:
    """Reads plugin files for workers, which have none of their own, as (path, text); PluginError if one is unusable."""
    for path in plugins:
        load_plugin(path)
    return tuple((str(path), read_text(path)) for path in map(Path, plugins))


def _items(flying: Mapping[Any, Group]) -> int:
    return sum(len(part.items) for part in flying.values())


def _second(item: tuple[int, Scene]) -> Scene:
    return item[1]
