"""Blocks and processes of a run: how it is cut, and whether one process or four work on it, changes no bit of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from haploop.launch.runs.start import prepare
from haploop.launch.runs.start import run as run_prepared
from haploop.launch.scene.file import load
from helpers.runs.captured import in_blocks, of_the_scene
from helpers.scenes.effect_tables import slowly
from helpers.scenes.random_scenes import drawn

SCENES = sorted((Path(__file__).parents[3] / "launch/scenes").glob("*.toml"))


@pytest.mark.parametrize("seed", [6, *slowly([11, 24, 25, 29])])
def test_blocks_and_windows_of_any_size_give_the_same_summary_of_drawn_scenes(seed):
    scene, _ = drawn(seed)
    usual = in_blocks(scene, 100, 4)
    for block_ticks, window_blocks in ((1, 1), (3, 1), (7, 3), (1000, 1)):
        assert in_blocks(scene, block_ticks, window_blocks) == usual


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "delay"),
    [(path, delay) for index, path in enumerate(SCENES) for delay in (13, (0, 3, 10, 20, 50)[index % 5])],
    ids=lambda value: value.stem if isinstance(value, Path) else None,
)
def test_blocks_of_any_size_give_the_same_summary_of_every_shipped_scene(path, delay):
    """At 1.8 s all are in contact, and the swap is 0.3 s past. Each size is tried of every scene, not at each delay."""
    scene = load(path, [f"clock.round_trip_delay={delay / 10_000}"])
    scene = replace(scene, duration=min(scene.duration, 1.8))
    usual = in_blocks(scene, 100)
    for block_ticks in (1, 1000) if delay == 13 else (7,):
        assert in_blocks(scene, block_ticks) == usual


@pytest.mark.slow
@pytest.mark.parametrize("delay", [13, *slowly([0, 10, 50])])
def test_processes_with_small_blocks_and_the_least_window_give_the_bits_of_one_process(delay, tmp_path):
    """A swap in mid-contact, half a second after it, with commands in flight."""
    summaries = []
    for name, cut in (("one", []), ("many", ["run.block_ticks=7", "run.window_blocks=1", "run.log=none"])):
        overrides = [f"clock.round_trip_delay={delay / 10_000}", "duration=1.8", *cut]
        prepared = prepare(SCENES[0].with_name("swap.toml"), overrides, out=tmp_path / name)
        summaries.append(of_the_scene(run_prepared(prepared, in_process=name == "one")))
    assert summaries[0] == summaries[1]
