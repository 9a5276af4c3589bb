"""Many scenes on many cores: batches in parts that workers share, in bounded memory and without a lost scene."""

from __future__ import annotations

from collections.abc import Callable, Generator, Hashable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from pathlib import Path
from typing import Any, Self

from haploop.controller.dissipation import load_plugin
from haploop.launch.batch.stacking import is_batchable, structure
from haploop.logger.summary import Summary
from haploop.protocol.scene.scene import Scene
from haploop.tools.executor.executors import make_executor
from haploop.tools.executor.parts import Group, Sizes, cut, grouped
from haploop.tools.executor.work import Work

_POLL_S = 0.3
DIED = "The process that ran it died: it was killed, ran out of memory or crashed in compiled code."


class Pool:
    """Workers that stay for several calls, as of ``make_executor``; a context manager."""

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
        ``energy`` and ``trajectories`` are as of ``haploop.launch.batch.run.batch_results``.

        Raises:
            PluginError, ExecutorError: a plugin cannot be used, or no worker can be started.
        """
        work = Work(make=_second, sources=read_sources(plugins), energy=energy, trajectories=trajectories)
        count = len(scenes) if isinstance(scenes, Sequence) else None
        by_structure = grouped(enumerate(scenes), _structure)
        groups = (Group(items, together=shape is not None) for shape, items in by_structure)
        for part in self.parts(work, groups, count):
            for (index, _), result in part:
                yield index, result

    def parts(
        self, work: Work, groups: Iterable[Group], count: int | None = None, stop: Callable[[], bool] = lambda: False
    ) -> Generator[list[tuple[Any, Any]]]:
        """Does some work on items, part by part; no more than two parts a worker are under way.

        When a worker dies, nobody knows which of the parts under way killed it. So each of them is then run by
        itself, and one that kills its worker again is halved until the culprit stands alone.

        Args:
            groups: of items that belong together; taken when there is room for them.
            stop: asked before each part; True ends the work after those under way.

        Yields:
            Each item of a part that is done with what is kept of it.

        Raises:
            PluginError, ExecutorError: a plugin does not load in a worker, or no worker can be started.
        """
        sizes = Sizes(self.count, count)
        source = cut(groups, sizes)
        flying: dict[Future[Any], Group] = {}
        try:
            while True:
                while not stop() and len(flying) < self._executor.room and (part := next(source, None)):
                    flying[self._submitted(work, part.items)] = part
                if not flying:
                    return
                done = wait(flying, _POLL_S, FIRST_COMPLETED).done  # now and then to ask whether to stop
                if not all(map(self._outcome, done)):
                    done = wait(flying).done  # what else is under way has died with it, or will soon be done
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

    def _by_itself(self, work: Work, items: Sequence[Any], stop: Callable[[], bool]) -> Iterator[list[tuple[Any, Any]]]:
        self._executor.renew()
        if stop():
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
    """Reads plugin files for workers, which have none of their own, as (path, text); PluginError for one of no use."""
    for path in plugins:
        load_plugin(path)
    return tuple((str(path), path.read_text(encoding="utf-8")) for path in map(Path, plugins))


def _second(item: tuple[int, Scene]) -> Scene:
    return item[1]


def _structure(item: tuple[int, Scene]) -> Hashable:
    """Returns the structure that scenes in one array share; None for all that run alone."""
    return structure(item[1]) if is_batchable(item[1]) else None
