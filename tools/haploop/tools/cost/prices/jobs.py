"""Jobs that are timed for the prices: one loop with one thing more or less, or one number changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from haploop.controller.controller import Controller
from haploop.controller.dissipation import registry
from haploop.launch.scene.file import load
from haploop.plant.plant import Plant
from haploop.protocol.block_length import BlockLength
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.tools.ablation import ablations
from haploop.tools.cost.grid import digest
from haploop.tools.cost.times import IN_PROCESS, PROCESSES, Job, loop_us, run_us, timed_s

DELAYS_S = (0.0, 0.001, 0.002, 0.005, 0.010)
CONTROL_RATES_HZ = (1_000, 500, 2_000, 5_000, 10_000)
LOGS = ("none", "ticks", "steps")
# Held long enough that a time is no accident; a scene that swings apart runs to its end all the same.
_IN_PROCESS_S, _EFFECTS_S, _PROCESSES_S = 4.0, 0.5, 2.0
_FREE = "diverged_beyond=1e9"


# Group -> what -> job; jobs of the same key are the same and timed once.
Jobs = dict[str, dict[str, Job]]


def price_jobs(scenes: Path, made_with: Sequence[Any]) -> Jobs:
    """Makes every job of every group, baselines first.

    Args:
        scenes: the folder of the scenes: the paper's wall, fig6a.toml, without delay, and all_effects.toml.
        made_with: what the times depend on beside the scenes, as JSON can hold it.
    """
    wall, everything = scenes / "fig6a.toml", scenes / "all_effects.toml"

    def in_process(settings: Sequence[str] = ()) -> Job:
        return _in_process(load(wall, [f"duration={_IN_PROCESS_S}", _FREE, _prompt(), "run.log=none", *settings]))

    def as_processes(settings: Sequence[str]) -> Job:
        return _as_processes(wall, [f"duration={_PROCESSES_S}", _FREE, _prompt(), *settings])

    effects = load(everything, [f"duration={_EFFECTS_S}", _FREE, "run.log=none"])
    jobs = {
        "books": {"without": _bare(in_process().scene), "with": in_process()},
        "log": {log: as_processes([f"run.log={log}"]) for log in LOGS},
        "effects": {name: _in_process(scene, name) for name, scene in ablations(effects).items()},
        "processes": {"one process": in_process(), "three processes": as_processes(["run.log=none"])},
        "delay": {f"{s * 1e3:g} ms": as_processes(["run.log=steps", _prompt(s)]) for s in DELAYS_S},
        "control rate": {f"{hz / 1e3:g} kHz": in_process([f"clock.control_rate={hz}"]) for hz in CONTROL_RATES_HZ},
    }
    return {group: _keyed(members, made_with) for group, members in jobs.items()}


def _prompt(delay_s: float = 0.0) -> str:
    return f"clock.round_trip_delay={delay_s}"


def _keyed(jobs: Mapping[str, Job], made_with: Sequence[Any]) -> dict[str, Job]:
    """Returns the same jobs, with keys made of all that their times depend on."""
    return {what: replace(job, key=digest([job.key, job.scene, *made_with])) for what, job in jobs.items()}


def _in_process(scene: dict[str, Any], name: str = "") -> Job:
    """Makes a job of plant, controller and books in one process; a name keeps equal jobs apart."""
    return Job(IN_PROCESS, f"books {name}", f"books {name}", scene, lambda: loop_us(scene))


def _as_processes(path: Path, overrides: Sequence[str]) -> Job:
    scene = load(path, overrides)
    return Job(PROCESSES, "", "processes", scene, lambda: run_us(path, overrides, _ticks(scene)))


def _bare(scene: dict[str, Any]) -> Job:
    """Makes a job of plant and controller alone: their telemetry is made and thrown away."""
    return Job(IN_PROCESS, "bare", "bare", scene, lambda: bare_us(scene))


def bare_us(scene: dict[str, Any]) -> float:
    """Returns the time of a tick of plant and controller in this process without any books, µs.

    In blocks as in a run, the first of them not counted either where there are more.
    """
    time = Timebase.from_scene(scene)
    plant, controller = Plant(scene, time), Controller(Scene.from_dict(scene), time, registry())
    length = BlockLength(scene["run"]["block_ticks"])

    def block() -> None:
        until = min(plant.tick + length.ticks, time.ticks)
        plant.run_until(until, lambda _, samples: [float(force) for force in controller.answer(samples)])
        plant.take_block()
        controller.recorder.take()
        length.next()

    def finish() -> None:
        while plant.tick < time.ticks and plant.stop_reason is None:
            block()

    took_s, first = timed_s(block), plant.tick
    if first < time.ticks:
        return timed_s(finish) / (plant.tick - first) * 1e6
    return took_s / first * 1e6


def _ticks(scene: dict[str, Any]) -> int:
    return Timebase.from_scene(scene).ticks
