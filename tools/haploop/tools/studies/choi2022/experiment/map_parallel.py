"""Many calls, or many runs, on as many cores as a figure may use, with a bar that moves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from haploop.tools.executor.executors import make_executor, map_parallel
from haploop.tools.executor.pool import Pool
from haploop.tools.studies.choi2022.work import Work

Item = TypeVar("Item")
Answer = TypeVar("Answer")


def many(work: Work, name: str, call: Callable[[Item], Answer], items: Sequence[Item]) -> list[Answer]:
    """What a function that can be imported makes of each item, in their order."""
    with make_executor(work.workers) as executor:
        return map_parallel(executor, call, items, work.stage(name, len(items)))


def runs(work: Work, name: str, scenes: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The results of scenes without their energy books, in their order."""
    advance = work.stage(name, len(scenes))
    found: dict[int, dict[str, Any]] = {}
    with Pool(work.workers) as pool:
        for index, result in pool.results(scenes, energy=False):
            found[index] = result
            advance()
    return [found[index] for index in range(len(scenes))]


def is_steady(result: dict[str, Any]) -> bool:
    """No unwanted vibration: the summary's verdict over the last 0.5 s of the press, by which less than an encoder step
    to either side is none (Choi et al. 2022, V.B.3, say no more than "no unwanted vibration").
    """
    return result.get("verdict") == "steady"
