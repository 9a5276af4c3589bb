"""The compiled way: the loops of arrays, within a stated tolerance, whatever becomes of the others."""

from __future__ import annotations

import math
import os
import sys
from typing import Annotated, Any

import numpy as np
import pytest

from haploop.controller.dissipation import Element, Motion, Quantity, where
from haploop.launch.runs.in_batch import run_batch
from haploop.launch.runs.in_jax import compiled_results, compiling
from helpers.runs.batches import PUSH, Stiffening, alone, pressed, with_element
from helpers.runs.compiled import agree, compiled, many
from helpers.scenes.least import KINDS
from helpers.slowly import first_and_slowly


@pytest.mark.slow
def test_results_are_those_of_arrays_but_for_the_last_digits() -> None:
    scenes = many(13)
    assert agree(compiled(scenes), run_batch(scenes, KINDS))
    assert not agree(compiled(scenes), run_batch(many(14)[1:], KINDS))


@pytest.mark.slow
def test_a_program_serves_all_scenes_of_its_structure_and_jax_stays_as_it_was() -> None:
    import jax

    compiled(many(16))
    count = compiling()[0]
    others = many(29, device={"mass": 0.02, "damping": 0.2})
    assert agree(compiled(others), run_batch(others, KINDS))
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
@pytest.mark.slow
def test_loops_show_nothing_of_those_whose_memory_they_take_over(duration: float, diverged_beyond: float) -> None:
    """Few ticks, the last half second, a divergence; the memory comes full of what is no number."""
    import jax

    from haploop.launch.batch.jax.programs import PROGRAMS, in_double

    scenes = many(16, duration=duration, diverged_beyond=diverged_beyond)
    PROGRAMS.spare = None
    expected = compiled(scenes)
    assert PROGRAMS.spare
    with in_double():
        PROGRAMS.spare = left = jax.tree.map(lambda ring: ring * math.nan, PROGRAMS.spare)
    assert compiled(scenes) == expected
    assert left.x.is_deleted()


@pytest.mark.slow
def test_put_together_for_a_gpu_the_loops_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its program is another, and all of it has a form for CUDA; where there is no GPU, the CPU runs it."""
    import jax

    from haploop.launch.batch.jax import programs

    class Programs(programs.Programs):
        def compiled(self, run: Any, args: Any) -> Any:
            lowered = jax.jit(run).trace(*args).lower(lowering_platforms=("cuda",))
            assert "stablehlo.case" not in lowered.as_text()
            return super().compiled(run, args)

    programs.most()  # what jax is told first, it is told of the device there is
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    monkeypatch.setattr(programs, "PROGRAMS", Programs())
    scenes = many(13)
    assert agree(compiled(scenes), run_batch(scenes, KINDS))
    assert compiling()[0] == 1


@pytest.mark.slow
@pytest.mark.parametrize("of_the_user", [None, "true"])
def test_workers_share_the_memory_of_a_gpu_unless_the_user_says_otherwise(
    monkeypatch: pytest.MonkeyPatch, of_the_user: str | None
) -> None:
    """jax reads the variable when it first looks for a GPU; outside that moment the environment is the user's."""
    import jax

    from haploop.launch.batch.jax import programs

    name, seen = "XLA_PYTHON_CLIENT_PREALLOCATE", []
    monkeypatch.delenv(name, raising=False)
    if of_the_user:
        monkeypatch.setenv(name, of_the_user)
    monkeypatch.setattr(jax, "default_backend", lambda: seen.append(os.environ[name]) or "gpu")
    before = dict(os.environ)
    assert programs.most.__wrapped__() == 16384
    assert seen == [of_the_user or "false"]
    assert dict(os.environ) == before


@pytest.mark.slow
def test_what_is_not_asked_for_is_left_out() -> None:
    scenes = many(16)
    for result, whole in zip(compiled(scenes, energy=False), compiled(scenes), strict=True):
        assert agree(result, {key: value for key, value in whole.items() if key != "energy"})


def test_scenes_too_few_to_be_worth_it_are_run_in_arrays_to_the_same_bits() -> None:
    count, scenes = compiling()[0], many(16, duration=0.149)
    assert list(compiled_results(scenes, KINDS)) == list(enumerate(run_batch(scenes, KINDS)))
    assert compiling()[0] == count


class Gripping(Element):
    """Written for arrays; remembers how far it went."""

    kind = "gripping"
    memory = 0.0
    force_N: Annotated[float, Quantity("N", at_least=0)] = 0.05

    def force(self, motion: Motion, memory: Any) -> tuple[Any, Any]:
        total = memory + abs(motion.v)
        return where(total > 1.0, -self.force_N * motion.v, 0.0), total


class Counting(Element):
    """Acts at every third tick."""

    kind = "counting"
    force_N: Annotated[float, Quantity("N", at_least=0)] = 0.05

    def __post_init__(self) -> None:
        self.tick = 0

    def force(self, motion: Motion) -> Any:
        self.tick += 1
        return motion.v * (-self.force_N if self.tick % 3 == 0 else 0.0)


@pytest.mark.parametrize("element", first_and_slowly(Stiffening, Gripping, Counting))
def test_an_element_of_any_kind_comes_to_what_it_comes_to_alone(element: type[Element]) -> None:
    """One that cannot be compiled, or whose code goes another way at every tick, is run by arrays or alone."""
    kinds, count = KINDS | {element.kind: element}, compiling()[0]
    made = pressed(duration=0.1)
    forces = (0.1, 0.2, 0.3)
    scenes = [with_element(made, element.kind, force_N=f) for f in forces]
    for result, exact in zip(compiled(scenes, kinds), [alone(each, kinds) for each in scenes], strict=True):
        del exact["trajectory_sha256"]
        assert agree(result, exact)
    assert (compiling()[0] > count) == (element is Gripping)


@pytest.mark.slow
@pytest.mark.parametrize(
    "own",
    [{"kind": "hunt-crossley", "damping_factor": 2.0}, {"kind": "texture", "ridge_force": 0.2, "ridge_spacing": 1e-4}],
)
def test_walls_that_are_no_springs_compile_with_the_books_of_what_their_law_takes(own: dict[str, Any]) -> None:
    count, clock = compiling()[0], {"plant_rate": 2000, "round_trip_delay": 0.0015}
    walls = [{"position": -0.002, "stiffness": 200.0 + i, **own} for i in range(3)]
    scenes = [pressed(duration=0.1, clock=clock, wall=wall) for wall in walls]
    assert agree(compiled(scenes), run_batch(scenes, KINDS))
    assert compiling()[0] > count


@pytest.mark.slow
def test_bodies_in_a_row_go_their_own_way_to_the_same_bits() -> None:
    scenes = many(2, friction={"kinetic": 0.01}, hand=PUSH)
    assert compiled(scenes) == run_batch(scenes, KINDS)


def test_without_jax_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "haploop.launch.batch.jax.programs", None)
    with pytest.raises(ImportError, match=r"pip install 'haploop\[jax\]'"):
        list(compiled_results(many(16), KINDS))
