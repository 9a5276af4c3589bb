"""Batches that are booked by loops of machine code have the bits of NumPy, and do without numba where there is none."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np
import pytest

from haploop.controller.dissipation import registry
from haploop.launch.batch import batch
from haploop.launch.runs.in_batch import run_batch
from haploop.logger.books import work
from haploop.logger.books.work import BatchSums
from haploop.plant.where_it_pays import WhereItPays
from haploop.protocol.machine_code import MADE, MachineCode
from haploop.protocol.scene.scene import Scene
from haploop.tools.sweep.sweep_file import load
from helpers.live.launched import PATIENT
from helpers.runs.batches import alone, diverging, pressed, together
from helpers.scenes.varied_scenes import drawn_base, varied

SWEEPS = sorted((Path(__file__).parents[2] / "launch/sweeps").glob("*.toml"))
# What comes of a scene and its variations as numba compiles for the processor that is named to it.
BARE = "import test_loops as t; t.batch.LOOPS.pays = 0; print(t.batch.LOOPS.module() is not None, t.digest_of(7))"


@pytest.fixture
def by_loops(monkeypatch: pytest.MonkeyPatch) -> None:
    """Loops from the first batch on; where numba is there they must work, and nothing else does in their place."""
    pytest.importorskip("numba")
    monkeypatch.setattr(batch.LOOPS, "pays", 0)
    loops = batch.LOOPS.module()
    assert loops is not None
    monkeypatch.setattr(loops, "SUMS", BatchSums(loops.displacement, loops.energies, loops.add_ticks))
    monkeypatch.setattr(loops, "fill", loops.filled)


def damaged(*_of: Any) -> None:
    raise EOFError("Ran out of input")


def drawn(seed: int, count: int = 20) -> list[Scene]:
    rng, base = np.random.default_rng(seed), drawn_base(seed)
    return [varied(base, rng) for _ in range(count)]


def digest_of(seed: int) -> str:
    return hashlib.sha256(json.dumps(together(drawn(seed))).encode()).hexdigest()


def cells(path: Path) -> list[Scene]:
    """Scenes from all over a shipped sweep, for a short while."""
    sweep = load(path)
    return [replace(sweep.scene(cell), duration=0.2) for cell in range(0, sweep.count, -(-sweep.count // 10))]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_a_scene_out_of_a_batch_with_loops_has_every_bit_of_the_scene_alone(seed: int, by_loops: None) -> None:
    scenes = drawn(seed, 6)
    assert together(scenes) == [alone(each) for each in scenes]


@pytest.mark.slow
def test_so_have_loops_that_diverge_and_those_that_stay(by_loops: None) -> None:
    scenes = diverging()
    assert together(scenes) == [alone(each) for each in scenes]


@pytest.mark.slow
def test_a_loop_that_leaves_out_what_rounding_left_is_seen(by_loops: None, monkeypatch: pytest.MonkeyPatch) -> None:
    from haploop.launch.batch import loops

    def shorter(x: np.ndarray, x_low: np.ndarray, *of: Any) -> Any:
        return loops.displacement(x, 0.0 * x_low, *of)

    monkeypatch.setattr(loops, "SUMS", loops.SUMS._replace(displacement=shorter))
    scenes = drawn(7)
    assert together(scenes) != [alone(each) for each in scenes]


@pytest.mark.slow
@pytest.mark.parametrize("path", SWEEPS, ids=lambda path: path.stem)
def test_a_shipped_sweep_has_the_same_results_with_loops_and_without(
    path: Path, by_loops: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenes, kinds = cells(path), registry()
    found = run_batch(scenes, kinds, trajectories=True, fewest=2)
    monkeypatch.setattr(batch.LOOPS, "pays", float("inf"))
    assert run_batch(scenes, kinds, trajectories=True, fewest=2) == found


@pytest.mark.slow
def test_compiled_for_any_processor_the_loops_have_the_same_bits(by_loops: None) -> None:
    generic = {**os.environ, "NUMBA_CPU_NAME": "generic", "PYTHONPATH": os.pathsep.join(sys.path)}
    here = Path(__file__).parent
    said = subprocess.run(
        [sys.executable, "-c", BARE], cwd=here, env=generic, capture_output=True, text=True, check=True
    )
    assert said.stdout.split() == ["True", digest_of(7)]


@pytest.mark.slow
def test_a_loop_that_cannot_be_loaded_in_mid_run_is_done_by_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    loops = pytest.importorskip("haploop.launch.batch.loops")
    monkeypatch.setattr(batch.LOOPS, "pays", 0)
    batch.LOOPS.module()  # tried while they are whole: damaged ones would be taken from the cache of all processes
    for name in ("_ways", "_energies", "_add", "_fill"):
        monkeypatch.setattr(loops, name, damaged)
    scenes = drawn(7)
    assert together(scenes) == [alone(each) for each in scenes]


@pytest.mark.slow
def test_machine_code_that_is_damaged_is_made_anew_by_the_next_process(
    by_loops: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from haploop.launch.batch import loops

    (tmp_path / "kept").mkdir()
    monkeypatch.setattr(loops._code, "kept", str(tmp_path / "kept"))
    monkeypatch.setattr(loops, "_ways", damaged)
    with pytest.raises(EOFError):
        loops.try_out()
    assert list(tmp_path.iterdir()) == []


def test_machine_code_of_other_formulas_is_not_taken_for_that_of_these(tmp_path: Path) -> None:
    there, source = tmp_path / "work.py", Path(str(work.__file__)).read_text(encoding="utf-8")
    found = []
    for formula in ("dx = end - start", "dx = start - end", "dx = end - start"):
        there.write_text(source.replace("dx = end - start", formula), encoding="utf-8")
        found.append(MachineCode(str(there), (work,)).kept)
    assert found[0] == found[2] != found[1]


def test_where_several_would_compile_at_once_one_does_and_the_others_load_what_it_made(tmp_path: Path) -> None:
    pytest.importorskip("numba")
    (tmp_path / "work.py").touch()
    code = MachineCode(str(tmp_path / "work.py"), ())
    compiles, looked, loaded, found = Event(), Event(), Event(), []

    def compiling() -> None:
        compiles.set()
        looked.wait()
        loaded.wait(0.3)  # who does not wait loads meanwhile

    def loading() -> None:
        found.append(code.is_made())
        loaded.set()

    first = Thread(target=code.try_out, args=(compiling,))
    first.start()
    compiles.wait()
    made_before = code.is_made()
    looked.set()
    code.try_out(loading)
    first.join()
    assert (made_before, found) == (False, [True])


def test_without_numba_a_batch_is_booked_by_numpy(monkeypatch: pytest.MonkeyPatch, machine_code: None) -> None:
    scenes = [pressed(wall={"position": -0.002, "stiffness": 300.0 + i}) for i in range(3)]
    monkeypatch.setattr(batch.LOOPS, "pays", 0)
    monkeypatch.setitem(sys.modules, "numba", None)
    monkeypatch.delitem(sys.modules, "haploop.launch.batch.loops", raising=False)
    batch.LOOPS.forget()
    try:
        assert batch.LOOPS.module_for(0) is None
        assert together(scenes) == [alone(each) for each in scenes]
    finally:
        batch.LOOPS.forget()


def test_loops_are_loaded_once_enough_was_asked_of_a_process_and_no_sooner(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, machine_code: None
) -> None:
    (tmp_path / "loops_that_count.py").write_text("tried = []\ndef try_out(): tried.append(1)\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    loops = WhereItPays("loops_that_count", 10)
    monkeypatch.setattr(WhereItPays, "may_wait", True)
    found = [loops.module_for(4) for _ in range(4)]
    assert found[:2] == [None, None]
    assert found[2] is found[3]
    assert found[2].tried == [1]


def test_a_process_that_others_wait_for_loads_only_loops_that_were_made_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, machine_code: None
) -> None:
    module = "made = False\ndef is_made(): return made\ndef try_out(): assert made\n"
    (tmp_path / "loops_that_wait.py").write_text(module, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(WhereItPays, "may_wait", False)
    loops = WhereItPays("loops_that_wait", 10)
    assert loops.module_for(20) is None
    assert "loops_that_wait" not in sys.modules  # its import would take a second for nothing
    of_others = tmp_path / "__pycache__/loops_that_wait-0" / f"{MADE}for another processor"
    of_others.parent.mkdir(parents=True)
    of_others.touch()
    assert loops.module_for(0) is None
    vars(sys.modules["loops_that_wait"])["made"] = True
    assert loops.module_for(0) is sys.modules["loops_that_wait"]


@pytest.mark.slow
def test_machine_code_is_made_once_it_was_tried_out_and_for_this_processor_alone(by_loops: None) -> None:
    from haploop.launch.batch import loops

    assert loops.is_made()
    asks = "from haploop.launch.batch import loops; print(loops.is_made())"
    environment = {**os.environ, "NUMBA_CPU_NAME": "core2"}
    said = subprocess.run([sys.executable, "-c", asks], env=environment, capture_output=True, text=True, check=True)
    assert said.stdout == "False\n"


@pytest.mark.slow
def test_the_nodes_of_a_long_run_load_the_loops_that_were_made_and_keep_its_bits(tmp_path: Path) -> None:
    """A run of 20 s with friction, in one process, where they are made if need be, and as processes."""
    pytest.importorskip("numba")
    sets = ["--set", "duration=20", "--set", "run.log=none", "--set", "run.verdict=window", "--set", PATIENT, "--json"]
    words = [str(Path(sys.executable).with_name("haploop")), "run", "all_effects", *sets]
    loads = {**os.environ, "PYTHONVERBOSE": "1"}
    hashes, said = [], ""
    for name, option, environment in (("one", ["--in-process"], None), ("three", [], loads)):
        out = tmp_path / name
        ran = subprocess.run(
            [*words, *option, "--out", str(out)], env=environment, capture_output=True, text=True, check=True
        )
        hashes.append(json.loads(ran.stdout)["trajectory_sha256"])
        said = ran.stderr + "".join(path.read_text() for path in out.glob("prints*"))
    assert hashes[0] == hashes[1]
    assert "import 'haploop.plant.friction.course'" in said
    assert "import 'haploop.logger.books.loops'" in said
