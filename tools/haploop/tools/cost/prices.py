"""The prices of books, log, effects, processes, delay and control rate: what is timed, and the gain of each in words.

Each job is one loop with one thing more or less, or with one number changed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from haploop.controller.controller import Controller
from haploop.controller.dissipation import registry
from haploop.launch.plan.effects import EFFECTS, effects_of
from haploop.launch.scene.bundled import bundled_folder
from haploop.launch.scene.file import load
from haploop.plant.plant import Plant
from haploop.protocol.scene.effects import Accelerometer
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import BlockLength, Timebase
from haploop.tools.cost.data import Price, PriceGroup, Spread
from haploop.tools.cost.findings import AGAIN
from haploop.tools.cost.grid import digest, times_made_with
from haploop.tools.cost.reference import difference_m
from haploop.tools.cost.times import IN_PROCESS, PROCESSES, Job, Store, loop_us, measure, run_us, tick_us
from haploop.tools.linear.stiffness_limit import StiffnessLimit, stiffness_limit
from haploop.tools.operations import NONE, WHOLE, operations
from haploop.tools.render.progress import Stage
from haploop.tools.render.units import spring
from haploop.tools.trajectory import trajectory

_DELAYS_S = (0.0, 0.001, 0.002, 0.005, 0.010)
_CONTROL_RATES_HZ = (1_000, 500, 2_000, 5_000, 10_000)
_LOGS = ("none", "ticks", "steps")
# Run long enough that a time is no accident; a scene that diverges nevertheless runs to its end.
_IN_PROCESS_S, _EFFECTS_S, _PROCESSES_S = 1.0, 0.5, 2.0
_FREE, _PROMPT = "diverged_beyond=1e9", "clock.round_trip_delay=0.0"
# A hand of 10 kg that swings by 30 mm through a soft wall, whatever else is in the loop: so an effect that is added
# leaves the motion as it is, and each runs with the values that it has in all_effects.toml.
_LED = ("hand.mass=10.0", "hand.force.offset=0.0", "hand.force.amplitude=15.8", "hand.force.phase=270 deg",
        "wall.stiffness=50.0", 'dissipation.0={kind="damping", damping=0.05}')  # fmt: skip
_LIMIT, _INSTRUCTIONS, _MOVES = "stiffness limit", "instructions", "moves"
_WITH_LIMIT, _COUNTED = ("delay", "control rate"), ("effects",)
_WALL = "fig6a.toml without delay"
_LED_MASS = "a mass in a hand that leads the motion"
_READ = "acceleration.source = accelerometer"
# Group -> title, unit, way, how it was measured.
_GROUPS = {
    "books": ("Energy books of every plant step", "a tick", IN_PROCESS, f"one process, {_WALL}, no log"),
    "log": ("What is logged", "a tick", PROCESSES, f"three processes, {_WALL}"),
    "effects": ("Each effect alone", "a tick", IN_PROCESS, f"one process, added to {_LED_MASS}"),
    "processes": ("Processes", "a tick", PROCESSES, f"{_WALL}, no log"),
    "delay": ("Delay as lookahead", "a tick", PROCESSES, "three processes, fig6a.toml, every step logged"),
    "control rate": ("Control rate", "a simulated ms", IN_PROCESS, f"one process, {_WALL}, no log"),
}
_BUYS = {
    "without": "forces and motion, but no energy and no verdict",
    "with": "where every joule goes, exactly, the residual that proves it, and the verdict",
    "none": "the summary alone",
    "ticks": "what the controller saw and did, to be drawn and replayed",
    "steps": "the motion between the ticks as well",
    "one process": "the same bits, as fast as it goes",
    "three processes": "swaps, viewers and loggers while it runs, nodes in any language, on other machines",
    NONE: "the mass, the hand and the wall that are left without any effect",
    AGAIN: "nothing: what it adds is chance",
    WHOLE: "a loop as real as it gets",
}


# The cost of a run is asked for, not that of its verdict.
_BY_WINDOW = ("run.verdict=window",)
# Group -> what -> job; jobs of the same key are the same and timed once.
Jobs = dict[str, dict[str, Job]]


def price_jobs(depends_on: Sequence[Any]) -> Jobs:
    """Makes every job of every group, baselines first; its key is made of all that its time depends on.

    They are runs of the paper's wall, fig6a.toml, without delay, and of all_effects.toml in a hand that leads it;
    ``depends_on`` is what times depend on beside the scenes, as JSON can hold it.
    """
    scenes = bundled_folder("scenes")
    wall = scenes / "fig6a.toml"

    def in_process(*settings: str) -> Job:
        overrides = [f"duration={_IN_PROCESS_S}", _FREE, _PROMPT, "run.log=none", *_BY_WINDOW, *settings]
        return _in_process(load(wall, overrides))

    def as_processes(*settings: str) -> Job:
        overrides = [f"duration={_PROCESSES_S}", _FREE, _PROMPT, *_BY_WINDOW, *settings]
        scene = load(wall, overrides)
        ticks = Timebase.from_scene(scene).ticks
        return Job(PROCESSES, "", "processes", scene, lambda: run_us(wall, overrides, ticks))

    with_books = in_process()
    # Plant and controller alone: their telemetry is made and thrown away.
    bare = Job(IN_PROCESS, "bare", "bare", with_books.scene, lambda: bare_us(with_books.scene))
    whole = load(scenes / "all_effects.toml", [f"duration={_EFFECTS_S}", _FREE, "run.log=none", *_BY_WINDOW, *_LED])
    # The effect that others are read through comes first.
    names = sorted((effect.name for effect in effects_of(whole)), key=lambda name: name != _READ)
    effects = {NONE: alone(whole), AGAIN: alone(whole), **{name: alone(whole, name) for name in names}}
    jobs = {
        "books": {"without": bare, "with": with_books},
        "log": {log: as_processes(f"run.log={log}") for log in _LOGS},
        "effects": {name: _in_process(scene, name) for name, scene in {**effects, WHOLE: whole}.items()},
        "processes": {"one process": with_books, "three processes": as_processes("run.log=none")},
        "delay": {f"{s * 1e3:g} ms": as_processes("run.log=steps", f"clock.round_trip_delay={s}") for s in _DELAYS_S},
        "control rate": {f"{hz / 1e3:g} kHz": in_process(f"clock.control_rate={hz}") for hz in _CONTROL_RATES_HZ},
    }
    return {
        group: {what: replace(job, key=digest([job.key, job.scene, *depends_on])) for what, job in members.items()}
        for group, members in jobs.items()
    }


def alone(scene: Scene, name: str = "") -> Scene:
    """Returns a scene with none of its effects but this one, and what that is read through."""
    table, kept = scene.accelerometer, {name, _READ} if _is_read(name) else {name}
    keys = [key for effect in effects_of(scene) if effect.name == name for key in effect.left_out or (effect.key,)]
    while others := [effect for effect in effects_of(scene) if effect.name not in kept]:
        scene = others[0].without(scene)
    if not (table and _is_read(name)):
        return scene
    # The table of the accelerometer went with the first of its effects.
    own = {key.rpartition(".")[2]: value_at(table, key.rpartition(".")[2]) for key in keys}
    return replace(scene, accelerometer=Accelerometer(**own))


def _is_read(name: str) -> bool:
    return name.startswith("accelerometer")


def _in_process(scene: Scene, name: str = "") -> Job:
    return Job(IN_PROCESS, f"books {name}", f"books {name}", scene, lambda: loop_us(scene))


def bare_us(scene: Scene) -> float | None:
    """Returns the time of a tick of plant and controller in this process without books, µs, in blocks as in a run."""
    time = Timebase.from_scene(scene)
    plant, controller = Plant(scene, time), Controller(scene, time, registry())
    length = BlockLength(time.block_ticks(scene.run))

    def block() -> bool:
        until = min(plant.tick + length.ticks, time.ticks)
        plant.run_until(until, lambda _, samples: [float(force) for force in controller.answer(samples)])
        plant.take_block()
        controller.recorder.take()
        length.next()
        return plant.tick < time.ticks and plant.stop_reason is None

    return tick_us(block, lambda: plant.tick)


class Prices:
    """Measures what is missing in an open store, and puts together what is there.

    ``repeats`` is how often each time is measured, by way; prices of a way with 0 repeats are left out.
    """

    def __init__(self, store: Store, repeats: Mapping[str, int]) -> None:
        jobs = price_jobs(times_made_with())
        self._store, self._repeats = store, repeats
        self._jobs = {
            name: members for name, members in jobs.items() if all(repeats[job.way] for job in members.values())
        }

    def measure(self, stage: Stage) -> None:
        """Makes every missing measurement: limits and counts first, since they do not depend on when they are made."""
        kinds, groups = registry(), self._jobs.items()
        makers = {
            (_LIMIT, _WITH_LIMIT): lambda scene: dataclasses.asdict(stiffness_limit(scene, kinds)),
            (_INSTRUCTIONS, _COUNTED): lambda scene: operations(scene, kinds).per_tick,
            (_MOVES, _COUNTED): lambda scene: difference_m(trajectory(scene).x_m, plain_x_m),
        }
        plain_x_m = trajectory(self._jobs["effects"][NONE].scene).x_m
        for (what, names), make in makers.items():
            jobs = {job.key: job for name, members in groups if name in names for job in members.values()}
            if left := [job for job in jobs.values() if not self._store.has(what, job.key)]:
                advance = stage(f"other prices, {what}", len(left))
                for job in left:
                    self._store.add(what, job.key, make(job.scene))
                    advance()
        every = {job.key: job for _, members in groups for job in members.values()}
        for way, repeats in self._repeats.items():
            jobs = [job for job in every.values() if job.way == way]
            measure(self._store, jobs, repeats, f"other prices, {way}", stage)

    def groups(self) -> list[PriceGroup]:
        """Returns the groups of which every time is known."""
        return [self._group(name) for name, jobs in self._jobs.items() if all(map(self._times, jobs.values()))]

    def _times(self, job: Job) -> list[float]:
        """Returns the times of a job, as far as there are any; none for a run that failed."""
        values = self._store.all(job.way, job.key, self._repeats[job.way])
        return [] if None in values else values

    def _group(self, name: str) -> PriceGroup:
        title, unit, way, how = _GROUPS[name]
        buys = _BUYS | {effect.name: effect.does for effect in EFFECTS}
        prices: list[Price] = []
        for what, job in self._jobs[name].items():
            baseline = _READ if _is_read(what) else next(iter(self._jobs[name]))
            values, base = (self._scaled(name, self._jobs[name][each]) for each in (what, baseline))
            found = self._store.get(_LIMIT, job.key) if name in _WITH_LIMIT else None
            limit = StiffnessLimit(**found) if found else None
            adds = [value - other for value, other in zip(values, base, strict=False)] if prices else []
            added = Spread.from_values(adds) if adds else None
            gain = _steady_up_to(limit) if limit else buys[what]
            counted = (self._store.get(_MOVES, job.key), self._store.get(_INSTRUCTIONS, job.key))
            prices.append(Price(what, Spread.from_values(values), added, gain, *counted, limit))
        return PriceGroup(name, title, unit, self._repeats[way], how, prices)

    def _scaled(self, name: str, job: Job) -> list[float]:
        """Returns the times of a job in the unit of its group."""
        unit = job.scene.clock.control_rate / 1000.0 if name == "control rate" else 1.0
        return [value * unit for value in self._times(job)]


def _steady_up_to(limit: StiffnessLimit) -> str:
    if limit.confirmed:
        return f"a wall of up to {spring(limit.stiffness_N_m)} stays steady"
    ran = f"but runs at 0.97 and 1.03 of it were {limit.below} and {limit.above}"
    return f"in theory a wall of up to {spring(limit.stiffness_N_m)} stays steady, {ran}"
