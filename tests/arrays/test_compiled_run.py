"""The compiled way: the loops of arrays, within a stated tolerance, whatever becomes of the others."""

from __future__ import annotations

import copy
import math
import os
import sys
from typing import Annotated, Any

import numpy as np
import pytest
from array_makers import PUSH, Stiffening, alone, pressed
from physics.varied_scenes import drawn_base, varied
from scene_makers import KINDS

from haploop.controller.controller_array import Row
from haploop.controller.dissipation import Element, Motion, Quantity, where
from haploop.launch.array_loop import LoopArray
from haploop.launch.array_run import run_array
from haploop.launch.compiled_run import compiling, results_of_compiled
from haploop.protocol.ticks import Timebase

jax = pytest.importorskip("jax")

# Of the largest excursion of each loop.
TOLERANCE = 1e-11


def compiled(scenes: list[dict[str, Any]], kinds: dict[str, type[Element]] = KINDS, **options: Any) -> list[Any]:
    results = dict(results_of_compiled(scenes, kinds, fewest=1, least=0, most=16, **options))
    return [results[index] for index in range(len(scenes))]


def loops_of(scenes: list[dict[str, Any]], by_program: bool) -> LoopArray:
    """All loops run to their ends, none dropped."""
    if not by_program:
        loops = LoopArray(scenes, KINDS)
        loops._drop_ended = lambda: None
        loops.run()
        return loops
    from haploop.launch import compiled_programs
    from haploop.launch.compiled_loop import CompiledLoops

    compiled_programs.most()
    with compiled_programs.in_double():
        loops = CompiledLoops(scenes, KINDS, energy=True, size=len(scenes), programs=compiled_programs.PROGRAMS)
        loops.run()
    return loops


def positions(loops: LoopArray, ticks: int) -> np.ndarray:
    return loops._logger._window._x[: ticks * loops._time.steps_per_tick]


def nudged(scene: dict[str, Any], by: float) -> dict[str, Any]:
    """The scene with the device's start moved by a last digit."""
    beside = copy.deepcopy(scene)
    beside["device"]["position"] += by
    return beside


def check_motion(seed: int) -> None:
    """Every position of a run of 0.2 s, which the window holds whole, and the energies at its end."""
    rng = np.random.default_rng(1000 + seed)
    base = drawn_base(seed)
    scenes = [base, *(varied(base, rng) for _ in range(15))]
    found, expected = loops_of(scenes, True), loops_of(scenes, False)
    ticks = min(result["ticks"] for result in expected.results if result)
    x, truth = (positions(loops, ticks) for loops in (found, expected))
    scale = np.abs(truth).max(axis=0)
    steady = np.ones(len(scenes), bool)
    for nudge in (1e-16, -1e-16):
        other = positions(loops_of([nudged(each, nudge) for each in scenes], False), ticks)
        steady &= np.abs(other - truth).max(axis=0) < 1e-12 * scale
    assert np.count_nonzero(steady) >= 8, "few of these loops can be compared; the test needs another scene"
    away = np.abs(x - truth).max(axis=0)[steady] / scale[steady]
    # Whether a window of FOAW's passes may be a tie between whole counts, which the last digit decides.
    ties = any(base.get(table, {}).get("estimator") == "foaw" for table in ("velocity", "acceleration"))
    assert away.max() < (1e-2 if ties else TOLERANCE)
    assert np.median(away) < TOLERANCE
    for loop in np.flatnonzero(steady):
        result, by_array = found.results[loop], expected.results[loop]
        assert result
        assert by_array
        assert (result["verdict"], result["ticks"], result["why"]) == tuple(
            by_array[key] for key in ("verdict", "ticks", "why")
        )
        energy, exact = result["energy"], by_array["energy"]
        assert energy["residual_J"] < 1e-12 * energy["moved_J"]
        if ties:
            continue
        assert [account["true_J"] for account in energy["elements"]] == pytest.approx(
            [account["true_J"] for account in exact["elements"]], rel=1e-9, abs=1e-11 * exact["moved_J"]
        )
        assert energy["wall"]["leak"] == pytest.approx(exact["wall"]["leak"], rel=1e-9, abs=1e-11 * exact["moved_J"])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_drawn_loops_move_as_in_arrays(seed: int) -> None:
    """Noise, estimators, actuators, changes while the loop runs."""
    check_motion(seed)


def many(count: int, **tables: Any) -> list[dict[str, Any]]:
    """Loops that differ in their walls alone; one program serves all of this structure."""
    return [pressed(wall={"position": -0.002, "stiffness": 200.0 + i}, **tables) for i in range(count)]


def agree(found: Any, expected: Any, within: float = 1e-9) -> bool:
    """Whether two results say the same, numbers to within a relative error, or what is nothing beside 1."""
    if isinstance(expected, dict):
        return found.keys() == expected.keys() and all(agree(found[key], expected[key], within) for key in expected)
    if isinstance(expected, list):
        return len(found) == len(expected) and all(map(agree, found, expected))
    if isinstance(expected, float):
        return math.isclose(found, expected, rel_tol=within, abs_tol=1e-11)
    return found == expected


def test_results_are_those_of_arrays_but_for_the_last_digits() -> None:
    scenes = many(13)
    assert agree(compiled(scenes), run_array(scenes, KINDS))
    assert not agree(compiled(scenes), run_array(many(14)[1:], KINDS))


def test_a_program_serves_all_scenes_of_its_structure_and_jax_stays_as_it_was() -> None:
    compiled(many(16))
    count = compiling()[0]
    others = many(29, device={"mass": 0.02, "damping": 0.2})
    assert agree(compiled(others), run_array(others, KINDS))
    assert compiling()[0] == count
    assert jax.numpy.zeros(1).dtype == np.float32


@pytest.mark.parametrize(
    ("duration", "diverged_beyond"),
    [
        (0.006, 1.0),
        pytest.param(1.2, 1.0, marks=pytest.mark.slow),
        pytest.param(1.2, 0.0021, marks=pytest.mark.slow),
    ],
)
def test_loops_show_nothing_of_those_whose_memory_they_take_over(duration: float, diverged_beyond: float) -> None:
    """Few ticks, the last half second, a divergence; the memory comes full of what is no number."""
    from haploop.launch.compiled_programs import PROGRAMS, in_double

    scenes = many(16, duration=duration, diverged_beyond=diverged_beyond)
    PROGRAMS.spare = None
    expected = compiled(scenes)
    assert PROGRAMS.spare
    with in_double():
        PROGRAMS.spare = left = jax.tree.map(lambda ring: ring * math.nan, PROGRAMS.spare)
    assert compiled(scenes) == expected
    assert left.x.is_deleted()


def test_put_together_for_a_gpu_the_loops_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its program is another, and all of it has a form for CUDA; where there is no GPU, the CPU runs it."""
    from haploop.launch import compiled_programs

    class Programs(compiled_programs.Programs):
        def compiled(self, key: Any, block: Any, args: Any) -> Any:
            lowered = jax.jit(block.run).trace(*args).lower(lowering_platforms=("cuda",))
            assert "stablehlo.case" not in lowered.as_text()
            return super().compiled(key, block, args)

    compiled_programs.most()  # what jax is told first, it is told of the device there is
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    monkeypatch.setattr(compiled_programs, "PROGRAMS", Programs())
    scenes = many(13)
    assert agree(compiled(scenes), run_array(scenes, KINDS))
    assert compiling()[0] == 1


@pytest.mark.parametrize("of_the_user", [None, "true"])
def test_workers_share_the_memory_of_a_gpu_unless_the_user_says_otherwise(
    monkeypatch: pytest.MonkeyPatch, of_the_user: str | None
) -> None:
    """jax reads the variable when it first looks for a GPU; outside that moment the environment is the user's."""
    from haploop.launch import compiled_programs

    name, seen = "XLA_PYTHON_CLIENT_PREALLOCATE", []
    monkeypatch.delenv(name, raising=False)
    if of_the_user:
        monkeypatch.setenv(name, of_the_user)
    monkeypatch.setattr(jax, "default_backend", lambda: seen.append(os.environ[name]) or "gpu")
    before = dict(os.environ)
    assert compiled_programs.most.__wrapped__() == 16384
    assert seen == [of_the_user or "false"]
    assert dict(os.environ) == before


def test_what_is_not_asked_for_is_left_out() -> None:
    scenes = many(16)
    for result, whole in zip(compiled(scenes, energy=False), compiled(scenes), strict=True):
        assert agree(result, {key: value for key, value in whole.items() if key != "energy"})


def test_scenes_too_few_to_be_worth_it_are_run_in_arrays_to_the_same_bits() -> None:
    count, scenes = compiling()[0], many(16, duration=0.149)
    assert list(results_of_compiled(scenes, KINDS)) == list(enumerate(run_array(scenes, KINDS)))
    assert compiling()[0] == count


@pytest.mark.parametrize(
    ("damping", "duration", "diverged_beyond"),
    [
        pytest.param((1.0, 12.0), 0.6, 0.05, marks=pytest.mark.slow, id="soon"),
        pytest.param((6.3, 6.58), 2.0, 0.9, id="late"),
    ],
)
def test_loops_that_diverge_stand_still_where_they_did(
    damping: tuple[float, float], duration: float, diverged_beyond: float
) -> None:
    """Each at its time, within blocks and across them, its last half second as it was; those that stay disturb none."""
    scenes = [
        pressed(
            duration=duration,
            diverged_beyond=diverged_beyond,
            clock={"round_trip_delay": 0.004},
            dissipation=[{"kind": "damping", "damping": each, "acts": "always"}],
        )
        for each in np.linspace(*damping, 16).tolist()
    ]
    expected = run_array(scenes, KINDS)
    ends = {result["ticks"] for result in expected}
    assert len(ends) > 5
    if duration > 1.0:  # the first has run for longer than what is kept of it
        assert min(ends) > 700
    for result, exact in zip(compiled(scenes), expected, strict=True):
        assert {key: result[key] for key in ("ticks", "steps", "ended", "verdict")} == {
            key: exact[key] for key in ("ticks", "steps", "ended", "verdict")
        }
        assert agree(result["final"], exact["final"], 1e-6)
        assert agree(result["window"], exact["window"], 1e-6)
        assert result["energy"]["residual_J"] < 1e-12 * result["energy"]["moved_J"]
        assert result["energy"]["moved_J"] == pytest.approx(exact["energy"]["moved_J"], rel=1e-6)


def test_windows_read_by_a_program_show_what_they_show_by_themselves() -> None:
    """Of signals that drift, rest and swing, in and out of contact, whatever the place in the rings where they end."""
    from haploop.launch.compiled_block import Rings
    from haploop.launch.compiled_programs import in_double
    from haploop.launch.compiled_window import CompiledWindow

    time = Timebase.of({"control_rate": 200, "plant_rate": 800, "round_trip_delay": 0.0}, 10.0)
    rng = np.random.default_rng(5)
    for ticks in (101, 150, 317):
        window = CompiledWindow(time, np.array([0.0, 1e-5, 1e-4, 1e-3] * 4), 16, spare_ticks=40)
        t = np.arange(ticks * 4 + 1)[:, None] / 800
        size, rate = 10.0 ** rng.uniform(-6, -2, 16), rng.uniform(-3.0, 3.0, 16)
        x = size * np.exp(rate * t) * np.sin(rng.uniform(5.0, 200.0, 16) * t) + rng.normal(size=16) * 1e-3 * t
        x[:, 3] = 0.0
        for first in range(0, ticks, 10):
            last = min(first + 10, ticks)
            columns = {
                "x": x[::4],
                "total": 100.0 * x[::4],
                "in_contact": 1.0 * (x[::4] < 0.0),
                "wall_position": 0 * x[::4],
            }
            rows = [Row({name: column[k] for name, column in columns.items()}, {}, []) for k in range(first, last)]
            window.add(x[first * 4 : last * 4 + 1], x[first * 4 : last * 4 + 1], rows)
        by_itself = list(window.shown(range(16)))
        with in_double():
            window.take(Rings(window._x.reshape(-1, 4, 16), dict(window._ticks)), writable=False)
            by_program = list(window.shown(range(16)))
        for one, other in zip(by_itself, by_program, strict=True):
            assert (one.seen.touched, one.seen.crossings) == (other.seen.touched, other.seen.crossings)
            assert agree(one.seen.figures, other.seen.figures, 1e-9)
            assert one.seen.growth == pytest.approx(other.seen.growth, rel=1e-9)
            assert (one.extremes, one.swing_m) == (other.extremes, other.swing_m)
        assert any(one.seen.crossings > 3 for one in by_itself)
        assert not by_program[3].seen.touched


class Gripping(Element):
    """Written for arrays; remembers how far it went."""

    kind = "gripping"
    force_N: Annotated[float, Quantity("N", at_least=0)] = 0.05

    def __post_init__(self) -> None:
        self.sums: list[Any] = [0.0]

    def force(self, motion: Motion) -> Any:
        self.sums[0] = self.sums[0] + abs(motion.v)
        return where(self.sums[0] > 1.0, -self.force_N * motion.v, 0.0)


class Counting(Element):
    """Acts at every third tick."""

    kind = "counting"
    force_N: Annotated[float, Quantity("N", at_least=0)] = 0.05

    def __post_init__(self) -> None:
        self.tick = 0

    def force(self, motion: Motion) -> Any:
        self.tick += 1
        return motion.v * (-self.force_N if self.tick % 3 == 0 else 0.0)


@pytest.mark.parametrize("element", [Gripping, Stiffening, Counting])
def test_an_element_of_any_kind_comes_to_what_it_comes_to_alone(element: type[Element]) -> None:
    """One that cannot be compiled, or whose code goes another way at every tick, is run by arrays or alone."""
    kinds, count = KINDS | {element.kind: element}, compiling()[0]
    made = pressed(duration=0.1)
    forces = (0.1, 0.2, 0.3)
    scenes = [{**made, "dissipation": [{"kind": element.kind, "force_N": f, "acts": "always"}]} for f in forces]
    for result, exact in zip(compiled(scenes, kinds), [alone(each, kinds) for each in scenes], strict=True):
        del exact["trajectory_sha256"]
        assert agree(result, exact)
    assert (compiling()[0] > count) == (element is Gripping)


def test_bodies_in_a_row_go_their_own_way_to_the_same_bits() -> None:
    scenes = many(2, friction={"kinetic": 0.01}, hand=PUSH)
    assert compiled(scenes) == run_array(scenes, KINDS)


def test_without_jax_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "haploop.launch.compiled_programs", None)
    with pytest.raises(ImportError, match=r"pip install 'haploop\[jax\]'"):
        list(results_of_compiled(many(16), KINDS))
