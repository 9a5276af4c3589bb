"""Measurement of the prices: books, log, effects, processes, delay and control rate, and the gain of each in words."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from haploop.controller.dissipation import registry
from haploop.launch.plan.effects import EFFECTS
from haploop.tools.ablation import AGAIN, NONE, WHOLE
from haploop.tools.cost import times
from haploop.tools.cost.data import Price, PriceGroup, Spread, price
from haploop.tools.cost.prices.jobs import price_jobs
from haploop.tools.cost.store import Store
from haploop.tools.cost.times import IN_PROCESS, PROCESSES, Job
from haploop.tools.linear.stiffness_limit import StiffnessLimit, stiffness_limit
from haploop.tools.machine import machine, source_digest, versions
from haploop.tools.operations import operations
from haploop.tools.render.progress import Stage
from haploop.tools.render.units import spring

_PACKAGES = ("haploop.protocol", "haploop.plant", "haploop.controller", "haploop.logger", "haploop.launch")
_FILES = (
    "ablation.py",
    "cost/prices/jobs.py",
    "cost/times.py",
    "linear/one_tick.py",
    "linear/stiffness_limit.py",
    "operations.py",
)
_LIMIT, _INSTRUCTIONS = "stiffness limit", "instructions"
_WITH_LIMIT, _COUNTED = ("delay", "control rate"), ("effects", "delay", "control rate")
_WALL = "fig6a.toml without delay"
# Group -> title, unit, way, how it was measured.
_GROUPS = {
    "books": ("Energy books of every plant step", "µs per tick", IN_PROCESS, f"one process, {_WALL}, no log"),
    "log": ("What is logged", "µs per tick", PROCESSES, f"three processes, {_WALL}"),
    "effects": ("Each effect", "µs per tick", IN_PROCESS, "one process, all_effects.toml with one effect left out"),
    "processes": ("Processes", "µs per tick", PROCESSES, f"{_WALL}, no log"),
    "delay": ("Delay as lookahead", "µs per tick", PROCESSES, "three processes, fig6a.toml, every step logged"),
    "control rate": ("Control rate", "ms per simulated second", IN_PROCESS, f"one process, {_WALL}, no log"),
}
_BUYS = {
    "without": "forces and motion, but no energy and no verdict",
    "with": "where every joule goes, exactly, the residual that proves it, and the verdict",
    "none": "the summary alone",
    "ticks": "what the controller saw and did, to be drawn and replayed",
    "steps": "the motion between the ticks as well",
    "one process": "the same bits, as fast as it goes",
    "three processes": "swaps, viewers and loggers while it runs, nodes in any language, on other machines",
    WHOLE: "a loop as real as it gets",
    AGAIN: "nothing: how far it is from the row above is chance",
    NONE: "the mass, the hand and the wall that are left without any effect",
}


class Prices:
    """Measures what is missing in a store, and puts together what is there.

    Args:
        scenes: the folder of the scenes that come with haploop.
        store: where measurements are kept, open.
        repeats: of each time, by way; prices of a way with 0 repeats are left out.
    """

    def __init__(self, scenes: Path, store: Store, repeats: Mapping[str, int]) -> None:
        here = Path(__file__).parents[2]
        sources = source_digest(_PACKAGES, [here / name for name in _FILES])
        jobs = price_jobs(scenes, [machine(), versions(), sources])
        self._store, self._repeats = store, repeats
        self._jobs = {
            name: members for name, members in jobs.items() if all(repeats[job.way] for job in members.values())
        }

    def measure(self, stage: Stage) -> None:
        """Makes every measurement that is missing: limits and counts first, since they do not depend on the hour."""
        self._limits_and_counts(stage)
        every = {job.key: job for members in self._jobs.values() for job in members.values()}
        for way, repeats in self._repeats.items():
            jobs = [job for job in every.values() if job.way == way]
            if count := times.missing(self._store, jobs, repeats):
                advance = stage(f"other prices, {way}", count)
                times.measure(self._store, jobs, repeats, advance)

    def _limits_and_counts(self, stage: Stage) -> None:
        kinds = registry()
        makers = {
            (_LIMIT, _WITH_LIMIT): lambda scene: dataclasses.asdict(stiffness_limit(scene, kinds)),
            (_INSTRUCTIONS, _COUNTED): lambda scene: operations(scene, kinds).per_tick,
        }
        for (what, groups), make in makers.items():
            jobs = {job.key: job for name in groups for job in self._jobs.get(name, {}).values()}
            left = [job for job in jobs.values() if not self._store.has(what, job.key)]
            advance = stage(f"other prices, {what}", len(left)) if left else None
            for job in left:
                self._store.add(what, job.key, make(job.scene))
                if advance:
                    advance()

    def groups(self) -> list[PriceGroup]:
        """Returns the groups of which every time is known."""
        return [self._group(name) for name, jobs in self._jobs.items() if all(map(self._times, jobs.values()))]

    def _times(self, job: Job) -> list[float]:
        """Returns the times of a job in µs per tick, as far as there are any; none for a run that failed."""
        values = self._store.all(job.way, job.key, self._repeats[job.way])
        return [] if None in values else values

    def _group(self, name: str) -> PriceGroup:
        title, unit, way, how = _GROUPS[name]
        prices: list[Price] = []
        for what, job in self._jobs[name].items():
            scale = job.scene["clock"]["control_rate"] / 1000.0 if name == "control rate" else 1.0
            baseline: Spread | None = prices[0].time if prices else None
            limit = self._limit(name, job)
            more: dict[str, Any] = {"stiffness": limit}
            if name in _COUNTED:
                more["instructions_per_tick"] = self._store.get(_INSTRUCTIONS, job.key)
            words = _BUYS.get(what) or (_steady_up_to(limit) if limit else _does(what))
            found_us = [value * scale for value in self._times(job)]
            prices.append(price(what, found_us, baseline, words, is_left_out=name == "effects", **more))
        return PriceGroup(name, title, unit, self._repeats[way], how, prices)

    def _limit(self, name: str, job: Job) -> StiffnessLimit | None:
        found = self._store.get(_LIMIT, job.key) if name in _WITH_LIMIT else None
        return StiffnessLimit(**found) if found else None


def _steady_up_to(limit: StiffnessLimit) -> str:
    """Returns the stiffness that a delay or a control rate allows, in words."""
    if limit.confirmed:
        return f"a wall of up to {spring(limit.stiffness_N_m)} stays steady"
    ran = f"but runs at 0.97 and 1.03 of it were {limit.below} and {limit.above}"
    return f"in theory a wall of up to {spring(limit.stiffness_N_m)} stays steady, {ran}"


def _does(effect: str) -> str:
    """Returns what an effect does, as the table of effects says it."""
    return next(found.does for found in EFFECTS if found.name == effect)
