"""Arrays of scenes: each scene comes to what it comes to alone, bit for bit, whatever becomes of the others."""

from __future__ import annotations

import copy
import math
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
import pytest

from haploop.controller.dissipation import Element, Motion, Quantity, where
from haploop.launch.batch import batch
from haploop.launch.batch.batch import Batch
from haploop.launch.batch.stacking import is_batchable, stacked, structure, structures
from haploop.launch.runs import in_batch as array_run
from haploop.launch.runs.in_batch import run_batch
from haploop.logger.batch import BatchLogger
from haploop.logger.verdict.window import Window
from haploop.plant import choose
from haploop.plant.motion.one_mass import OneMassMotion
from haploop.protocol.scene.effects import Friction
from haploop.protocol.scene.estimators import Velocity
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import ElementTable, EventTable, Scene
from helpers.runs.batches import PUSH, Stiffening, alone, diverging, pressed, together, with_element, with_stiffness
from helpers.scenes.effect_tables import slowly
from helpers.scenes.least import KINDS
from helpers.scenes.varied_scenes import drawn_base, varied


@pytest.mark.parametrize("seed", [*range(6), *slowly(range(6, 40))])
def test_a_scene_out_of_an_array_has_every_bit_of_the_scene_alone(seed: int) -> None:
    rng = np.random.default_rng(1000 + seed)
    base = drawn_base(seed)
    scenes = [base, *(varied(base, rng) for _ in range(4))]
    assert is_batchable(base)
    assert len({structure(each) for each in scenes}) == 1
    assert together(scenes) == [alone(each) for each in scenes]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 10])
def test_so_has_one_of_many_in_blocks_of_few_ticks(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batch, "BLOCK", 3_000)
    rng = np.random.default_rng(seed)
    base = drawn_base(seed)
    scenes = [varied(base, rng) for _ in range(77)]
    assert together(scenes) == [alone(each) for each in scenes]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_so_has_one_of_very_few(count: int) -> None:
    """What NumPy makes of axes of length 1 is its own."""
    scenes = [pressed(wall={"position": -0.002, "stiffness": 300.0 + i}) for i in range(count)]
    assert together(scenes) == [alone(each) for each in scenes]


def test_one_number_by_one_bit_is_another_trajectory() -> None:
    made = pressed()
    other = with_stiffness(made, math.nextafter(300.0, math.inf))
    first, second, third = (result["trajectory_sha256"] for result in together([made, other, made]) if result)
    assert first == third != second


def test_how_the_loops_are_cut_into_blocks_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    base = drawn_base(7)
    scenes = [base, varied(base, np.random.default_rng(1))]
    results = []
    for block in (1, 2_000, 10**9):
        monkeypatch.setattr(batch, "BLOCK", block)
        results.append(together(scenes))
    assert results[0] == results[1] == results[2]


def test_loops_that_diverge_leave_with_their_results_and_disturb_no_other() -> None:
    scenes = diverging()
    expected = [alone(each) for each in scenes]
    ends = {result["ticks"] for result in expected}
    assert {"diverged", "done"} == {result["ended"] for result in expected}
    assert len(ends) > 5
    assert together(scenes) == expected


def test_windows_are_read_with_the_buffers_of_a_loop_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """NumPy before 2.3 lets the bits of a sum depend on them; while loops run they are shorter."""
    shown, book, seen = Window.measures, BatchLogger.book, {"shown": set[int](), "booked": set[int]()}
    monkeypatch.setattr(Window, "measures", lambda *of: seen["shown"].add(np.getbufsize()) or shown(*of))
    monkeypatch.setattr(BatchLogger, "book", lambda *of: seen["booked"].add(np.getbufsize()) or book(*of))
    usual = np.getbufsize()
    together(diverging())
    assert seen["shown"] == {usual} == {np.getbufsize()}
    assert usual not in seen["booked"]


def test_what_all_loops_share_stays_whole_when_some_are_dropped() -> None:
    """A trace of as many points, and forms of as many rows, as there are loops."""
    trace = {"kind": "trace", "time": [0.0, 0.1, 0.2], "force": [-0.5, -2.0, -1.0]}
    scenes = [
        pressed(hand={**PUSH, "force": trace}, diverged_beyond=beyond, dissipation=[]) for beyond in (0.003, 0.5, 0.006)
    ]
    expected = [alone(each) for each in scenes]
    assert [result["ended"] for result in expected] == ["diverged", "done", "diverged"]
    assert together(scenes) == expected


def test_loops_that_have_ended_are_dropped_from_the_arrays(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = []

    class Spy(OneMassMotion):
        def advance(self, tick: int, holds: Any) -> Any:
            sizes.append(len(self.x))
            return super().advance(tick, holds)

    monkeypatch.setattr(choose, "OneMassMotion", Spy)
    scenes = diverging()
    together(scenes)
    assert sizes[0] == len(scenes)
    assert sizes[-1] <= len(scenes) / 2


class Counting(Element):
    """Remembers how far it went; refuses after many ticks where it is strong."""

    kind = "counting"
    memory = 0.0
    force_N: Annotated[float, Quantity("N", at_least=0)] = 0.05

    def force(self, motion: Motion, memory: Any) -> tuple[Any, Any]:
        total = memory + abs(motion.v)
        return where(total * self.force_N > 0.5, math.inf, -self.force_N * motion.v), total


def test_an_element_that_takes_no_arrays_is_run_loop_by_loop() -> None:
    kinds = KINDS | {"stiffening": Stiffening}
    made = pressed()
    scenes = [with_element(made, "stiffening", force_N=f) for f in (0.1, 0.2)]
    results = run_batch(scenes, kinds, trajectories=True, fewest=1)
    assert results == [alone(each, kinds) for each in scenes]


def test_a_loop_whose_force_is_no_finite_number_fails_as_it_does_alone() -> None:
    kinds = KINDS | {"counting": Counting}
    made = pressed()
    forces = (0.001, 0.002, 0.5, 0.003)
    scenes = [with_element(made, "counting", force_N=f) for f in forces]
    expected = [alone(each, kinds) for each in scenes]
    assert [result["ended"] for result in expected] == ["done", "done", "failed", "done"]
    assert [result is None for result in together(scenes, kinds)] == [False, False, True, False]
    assert run_batch(scenes, kinds, trajectories=True, fewest=1) == expected


def test_a_change_that_is_refused_for_one_loop_is_made_in_the_others() -> None:
    class Choosy(Element):
        """Refuses a number that its declaration allows."""

        kind = "choosy"
        force_N: Annotated[float, Quantity("N", at_least=0)]

        def __post_init__(self) -> None:
            if self.force_N > 0.25:
                raise ValueError("too strong")

        def force(self, motion: Motion) -> Any:
            return -self.force_N * motion.into_wall

    kinds = KINDS | {"choosy": Choosy}
    made = pressed()
    swaps = [ElementTable(name="choosy", acts="always", parameters={"force_N": f}) for f in (0.1, 0.2, 0.3)]
    scenes = [replace(made, event=(EventTable(at=0.05, element=0, swap=swap),)) for swap in swaps]
    results = run_batch(scenes, kinds, trajectories=True, fewest=1)
    assert results == [alone(each, kinds) for each in scenes]
    assert [len(result["energy"]["elements"]) for result in results] == [2, 2, 1]


def test_a_loop_that_cannot_go_on_is_a_result_with_its_reason() -> None:
    class Broken(Element):
        """Raises."""

        kind = "broken"

        def force(self, motion: Motion) -> Any:
            raise RuntimeError("out of order")

    made = pressed()
    first, second = run_batch([with_element(made, "broken"), made], KINDS | {"broken": Broken}, fewest=1)
    assert (first["ended"], second["ended"]) == ("failed", "done")
    assert "out of order" in first["why"]


def test_scenes_of_many_structures_come_back_in_their_order() -> None:
    effects: list[dict[str, Any]] = [
        {},
        {"friction": {"kinetic": 0.01}},
        {"jitter": {"kind": "uniform", "most": 0.001}},
        {"actuator": {"saturation": 0.3, "bandwidth": 200.0}},
        {"actuator": {"resolution": 0.01}},
        {"dissipation": []},
        {"clock": {"round_trip_delay": 0.0}},
        {"event": [{"at": 0.05, "stop": True}]},
        {"event": [{"at": 0.0, "stop": True}]},
        {"event": [{"at": 0.05, "set": {"clock.round_trip_delay": 0.003}}]},
    ]
    scenes = [
        pressed(device={"mass": mass, "damping": 0.1}, **tables, seed=3) for mass in (0.01, 0.02) for tables in effects
    ]
    assert run_batch(scenes, KINDS, trajectories=True, fewest=1) == [alone(each) for each in scenes]


def test_what_is_not_asked_for_is_left_out_and_all_else_stays() -> None:
    scenes = [pressed(), pressed(friction={"kinetic": 0.01})]
    whole = run_batch(scenes, KINDS, trajectories=True, fewest=1)
    for result, full in zip(run_batch(scenes, KINDS, energy=False, fewest=1), whole, strict=True):
        assert result == {key: value for key, value in full.items() if key not in ("energy", "trajectory_sha256")}


def test_chunks_cover_a_group_and_none_is_longer_than_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    scenes = [pressed(wall={"position": -0.002, "stiffness": k}) for k in np.linspace(100, 300, 11).tolist()]
    seen = []

    class Spy(Batch):
        def __init__(self, chunk: list[Scene], *args: Any, **kwargs: Any) -> None:
            seen.append(len(chunk))
            super().__init__(chunk, *args, **kwargs)

    monkeypatch.setattr(array_run, "Batch", Spy)
    results = run_batch(scenes, KINDS, trajectories=True, fewest=2, most=4)
    assert seen == [3, 4, 4]
    assert results == [alone(each) for each in scenes]


def test_only_numbers_and_titles_may_differ_within_a_structure() -> None:
    base = pressed(event=[{"at": 0.05, "set": {"wall.stiffness": 100.0}}])
    (event,) = base.event
    same = with_value(replace(base, title="another", seed=9), "device.mass", 2.0 * base.device.mass)
    same = replace(same, event=(replace(event, set={"wall.stiffness": 50.0}),))
    assert structure(base) == structure(same)
    for key, value in {
        "duration": 0.2,
        "wall.occupies": "above",
        "clock.round_trip_delay": 0.0,
        "event": (replace(event, at=0.06),),
        "device.damping": 0.0,
        "velocity": Velocity(cutoff=50.0),
    }.items():
        assert structure(base) != structure(with_value(base, key, value)), key


def test_the_structures_of_many_scenes_are_those_of_each_whatever_they_share() -> None:
    """Tables that go from scene to scene as one object, in all orders, with friction and without."""
    base, rng = pressed(), np.random.default_rng(3)
    device, wall = base.device, base.wall
    assert wall
    pools: dict[str, list[Any]] = {
        "device": [device, replace(device, damping=0.0), replace(device)],
        "wall": [wall, replace(wall, stiffness=7.0), replace(wall, occupies="above")],
        "friction": [None, Friction(kinetic=0.01), Friction(kinetic=0.02, breakaway=0.03)],
    }
    scenes = []
    for _ in range(200):
        scenes.append(replace(base, **{key: pool[rng.integers(len(pool))] for key, pool in pools.items()}))
    found = list(structures(scenes))
    assert found == [structure(copy.deepcopy(each)) for each in scenes]
    assert len(set(found)) > 10


def test_numbers_that_are_equal_stay_one_number() -> None:
    scenes = [pressed(wall={"position": -0.002, "stiffness": k}) for k in (100.0, 200.0)]
    made = stacked(scenes)
    assert made.wall
    assert np.asarray(made.wall.stiffness).tolist() == [100.0, 200.0]
    assert replace(made, wall=replace(made.wall, stiffness=100.0)) == scenes[0]
