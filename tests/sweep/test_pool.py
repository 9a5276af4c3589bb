"""The pool: results as from arrays, whatever happens to the workers."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from haploop.controller.dissipation import PluginError
from haploop.launch.one_thread import THREADS, ask_for_one_thread
from haploop.launch.runs.in_batch import run_batch
from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.tools.executor.executors import make_executor, map_parallel
from haploop.tools.executor.pool import DIED, Group, Pool, Sizes, cut, grouped
from haploop.tools.executor.work import Work, load_kinds
from helpers.runs.workers import of_stiffness, pressed, threads
from helpers.scenes.least import KINDS

DEADLY = """
import math
import os
from typing import Annotated
from haploop.controller.dissipation import Element, Motion, Quantity


class Deadly(Element):
    \"\"\"Ends its process where it is strong.\"\"\"

    kind = "deadly"
    force_N: Annotated[float, Quantity("N", at_least=0)] = 0.1

    def __post_init__(self) -> None:
        if self.force_N > 0.5:
            os._exit(3)

    def force(self, motion: Motion):
        return -self.force_N * motion.v
"""


def results(
    scenes: list[Scene], plugins: Sequence[Path] = (), *, workers: int = 2, trajectories: bool = False
) -> list[tuple[int, dict[str, Any]]]:
    """Results of scenes as a pool of so many workers gives them."""
    with Pool(workers) as pool:
        return list(pool.results(scenes, plugins, trajectories=trajectories))


def of_many_structures() -> list[Scene]:
    """Some run in arrays, some alone, in no order."""
    effects: list[dict[str, Any]] = [
        {},
        {"friction": {"kinetic": 0.01}},
        {"noise": {"deviation": 1e-5, "cutoff": 200.0}},
    ]
    return [pressed(100.0 + 10.0 * k, **effects[k % 3], seed=k) for k in range(60)]


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_every_scene_comes_back_once_with_every_bit_it_has_in_one_array(workers: int) -> None:
    scenes = of_many_structures()
    came = results(scenes, workers=workers, trajectories=True)
    assert sorted(index for index, _ in came) == list(range(len(scenes)))
    expected = run_batch(scenes, KINDS, trajectories=True)
    assert [dict(came)[index] for index in range(len(scenes))] == expected


@pytest.fixture
def deadly(tmp_path: Path) -> Path:
    path = tmp_path / "deadly.py"
    path.write_text(DEADLY)
    return path


@pytest.mark.slow
def test_of_the_scenes_that_were_under_way_when_a_worker_died_only_the_culprits_have_no_result(deadly: Path) -> None:
    strengths = [0.1 + 0.001 * k for k in range(40)]
    strengths[5] = strengths[17] = 0.9
    elements = [ElementTable(name="deadly", parameters={"force_N": strength}) for strength in strengths]
    scenes = [replace(pressed(200.0), dissipation=(element,)) for element in elements]
    came = dict(results(scenes, [deadly], workers=2))
    assert [index for index in range(40) if came[index]["ended"] != "done"] == [5, 17]
    assert came[5] == {"title": "least", "seed": 0, "ended": "failed", "why": DIED}
    kinds = load_kinds(((str(deadly), DEADLY),))
    alone = [index for index in range(40) if index not in (5, 17)]
    assert [came[index] for index in alone] == run_batch([scenes[index] for index in alone], kinds)


def test_a_plugin_that_does_not_load_is_said_before_anything_is_started(tmp_path: Path) -> None:
    path = tmp_path / "broken.py"
    path.write_text("1 / 0")
    with pytest.raises(PluginError, match=r"broken\.py, line 1 does not load: ZeroDivisionError"):
        results([pressed(100.0)], [path])


def test_scenes_are_taken_as_there_is_room_for_them() -> None:
    taken: list[int] = []

    def endless() -> Iterator[Group]:
        for k in range(10**9):
            taken.append(k)
            yield Group([k], together=True)

    with Pool(1) as pool:
        done = pool.parts(Work(make=of_stiffness), endless())
        for _ in range(5):
            next(done)
        done.close()
    assert len(taken) <= 6


def test_an_item_that_cannot_be_made_is_a_result_with_its_reason() -> None:
    with Pool(1) as pool:
        came = dict(
            pair for part in pool.parts(Work(make=of_stiffness), [Group(range(4), together=True)]) for pair in part
        )
    assert came.keys() == {0, 1, 2, 3}
    assert came[2] == {"ended": "refused", "why": "no such scene"}
    assert [came[k]["ended"] for k in (0, 1, 3)] == ["done"] * 3


def test_a_scene_that_raises_costs_no_other_its_result() -> None:
    broken = replace(pressed(100.0), dissipation=(ElementTable(name="damping"),))
    scenes = [*(pressed(100.0 + k) for k in range(30)), broken]
    came = dict(results(scenes, workers=1))
    assert {index for index, result in came.items() if result["ended"] != "done"} == {30}
    assert "damping" in came[30]["why"]


def test_stopped_the_parts_under_way_are_still_told() -> None:
    stopped: list[bool] = []
    with Pool(1) as pool:
        done = pool.parts(
            Work(make=of_stiffness), [Group(range(3, 1000), together=False)], stop=lambda _: bool(stopped)
        )
        seen = [item for item, _ in next(done)]
        stopped.append(True)
        seen += [item for part in done for item, _ in part]
    assert seen == [3]


def test_parts_cover_every_item_once_and_grow_no_longer_than_they_may() -> None:
    sizes = Sizes(2, 5000, most=300)
    lengths = []
    seen: list[int] = []
    for part in cut([Group(range(2000), True), Group(range(2000, 5000), True)], sizes):
        items = part.items
        assert items[0] >= 2000 or items[-1] < 2000
        seen += items
        lengths.append(len(items))
        sizes.took(part, 1e-3 * len(items))
    assert seen == list(range(5000))
    assert lengths[:2] == [64, 300]
    assert max(lengths) == 300
    assert lengths[-1] < 300


def test_slow_items_come_in_small_parts() -> None:
    sizes = Sizes(2, 1000)
    assert sizes.next(together=False) == 1
    sizes.took(Group([0], together=False), 3.0)
    assert sizes.next(together=False) == 1
    sizes.took(Group([0] * 5, together=False), 0.5)
    assert sizes.next(together=False) == 20


def test_what_goes_into_arrays_is_not_cut_into_parts_too_small_for_them() -> None:
    sizes = Sizes(2, 600)
    lengths = []
    for part in cut([Group(range(600), together=True)], sizes):
        lengths.append(len(part.items))
        sizes.took(part, 0.3)
    assert lengths == [64, 256, 256, 24]


def test_items_of_one_key_are_side_by_side_within_a_window() -> None:
    groups = list(grouped(range(10), lambda item: item % 2, window=6))
    assert groups == [(0, [0, 2, 4]), (1, [1, 3, 5]), (0, [6, 8]), (1, [7, 9])]


def test_workers_use_one_thread_each_and_this_process_keeps_its_settings() -> None:
    before = dict(os.environ)
    with Pool(2) as pool:
        came = [
            kept
            for part in pool.parts(Work(make=of_stiffness, keep=threads), [Group(range(3, 9), together=False)])
            for _, kept in part
        ]
    assert set(came) == {"1"}
    assert dict(os.environ) == before


@pytest.mark.parametrize("workers", [1, 2])
def test_answers_come_in_the_order_of_the_items_and_each_is_told(workers: int) -> None:
    told: list[None] = []
    with make_executor(workers) as executor:
        assert map_parallel(executor, math.sqrt, [9.0, 4.0, 1.0], lambda: told.append(None)) == [3.0, 2.0, 1.0]
        assert map_parallel(executor, math.sqrt, []) == []
    assert len(told) == 3


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_in_a_call_is_raised_where_the_answers_are_waited_for(workers: int) -> None:
    with (
        make_executor(workers) as executor,
        pytest.raises(ValueError, match=r"math domain error|expected a nonnegative"),
    ):
        map_parallel(executor, math.sqrt, [1.0, -1.0])


def test_one_thread_is_asked_for_unless_the_user_asked_for_another_number() -> None:
    environment = {"OMP_NUM_THREADS": "4", "HOME": "here"}
    new = ask_for_one_thread(environment)
    assert environment == {"OMP_NUM_THREADS": "4", "HOME": "here"} | dict.fromkeys(new, "1")
    assert {*new, "OMP_NUM_THREADS"} == set(THREADS)
