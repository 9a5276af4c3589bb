"""Judges the end of a run: the loop is held still, pushed, and watched until there is a verdict."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element
from haploop.launch.plan.rules import has_friction
from haploop.launch.scene.events import scene_events
from haploop.launch.stability.between_ticks import BETWEEN_TICKS, rings_between_ticks
from haploop.launch.stability.causes import with_causes
from haploop.launch.stability.finding import Finding
from haploop.launch.stability.looks import (
    BESIDE,
    BLOWS,
    LOOKS_S,
    PATIENT_S,
    SMALLER,
    is_struck,
    moved_beside,
    parts,
    push_of,
)
from haploop.launch.stability.still_hand import End, StillHand, deeper_holds, harder_hold, hold_of
from haploop.launch.stability.watch import moves_on, watch
from haploop.logger.summary import Summary, finite, write_summary
from haploop.logger.verdict.measures import window_span
from haploop.logger.verdict.window import keep_steps
from haploop.plant.plant import Plant
from haploop.protocol.changes import Event, at_work, changes_of, is_change, refusal
from haploop.protocol.scene.effects import Friction
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase


def judge_scene(
    scene: Scene,
    kinds: Mapping[str, type[Element]],
    events: Sequence[tuple[int, Event]] | None = None,
    looks_s: Sequence[float] = PATIENT_S,
    *,
    blows: Sequence[float] = BLOWS,
    thorough: bool = False,
    causes: bool = False,
    on_exchange: Callable[[], object] = lambda: None,
) -> Finding:
    """Runs a resolved scene to its end and judges that end.

    Args:
        scene: the resolved scene.
        kinds: available element kinds.
        events: (tick, event) in order; the scene's own when None.
        looks_s: times since the push at which the loop is looked at until it tells.
        blows: what one that rests is struck with, as shares of its push.
        thorough: whether one that rests is tried without its friction and elsewhere within an encoder's count, too.
        causes: whether one that swings is tried without each of its parts, see ``with_causes``.
        on_exchange: called whenever the plant asks for commands.

    Raises:
        ElementError: an element raised.
        ArithmeticError: the plant's arithmetic failed.
    """
    end = end_of(scene, kinds, events, on_exchange)
    found = judge(end, looks_s, blows=blows, thorough=thorough)
    return with_causes(end, found) if causes else found


def end_of(
    scene: Scene,
    kinds: Mapping[str, type[Element]],
    events: Sequence[tuple[int, Event]] | None = None,
    on_exchange: Callable[[], object] = lambda: None,
) -> End:
    """Returns the end of a run."""
    time = Timebase.from_scene(scene)
    plant, controller, ticks = Plant(scene, time), Controller(scene, time, dict(kinds)), time.ticks
    events = scene_events(scene, time) if events is None else events
    for tick, event in events:
        if is_change(event):
            controller.schedule(tick, event)
            plant.schedule(tick, event)
        elif event.get("stop"):
            ticks = min(ticks, tick)

    def exchange(_: int, samples: list[tuple[float, ...]]) -> list[float]:
        on_exchange()
        return [float(force) for force in controller.answer(samples)]

    plant.run_until(ticks, exchange)
    plant.take_block()
    rows = b"".join(block["columns"]["in_contact"] for block in controller.recorder.take())
    refused, restored = controller.recorder.take_told()
    told = [(plant.tick, event) for event in (*map(refusal, refused), *restored)]
    n = time.steps_per_tick
    window = window_span(plant.reached * n, keep_steps(time.plant_rate), n)
    inside = np.frombuffer(rows)[plant.reached - window.ticks : plant.reached] > 0.0
    return end_at(scene, plant, controller, inside, [*events, *told], on_exchange)


def end_at(
    scene: Scene,
    plant: Plant,
    controller: Controller,
    inside: np.ndarray,
    events: Sequence[tuple[int, Event]],
    on_exchange: Callable[[], object] = lambda: None,
) -> End:
    """Returns the end of a run whose blocks have been taken.

    Args:
        scene: what the run began with.
        plant, controller: in their state at the end.
        inside: whether each of the last ticks was in contact, shape (ticks,).
        events: (tick, event) of the run, with those that tell which changes were refused or taken back.
        on_exchange: called whenever a plant that continues from there asks for commands.
    """
    time, told = Timebase.from_scene(scene), None
    if plant.stop_reason:
        told = Finding("diverged", "diverged", detail=plant.stop_reason)
    elif not inside.any():
        told = Finding("no-contact", "no contact")
    held = inside if inside.any() else ~inside
    hold_N = hold_of(scene, time, plant.reached, held) if held.any() else 0.0  # a run may diverge in its first tick
    now = at_work(scene, [change for change in changes_of(events) if change.tick < plant.tick])
    return End(now, time, plant, controller, hold_N, told, on_exchange)


def is_watched(scene: Scene, summary: Summary) -> bool:
    """Tells whether a run is judged by pushing it: its scene asks for that, and it came to its end in order."""
    return scene.run.verdict == "pushed" and summary["ended"] in ("done", "stopped") and summary["ticks"] > 0


def with_verdict(scene: Scene, summary: Summary, find: Callable[[], Finding], out: Path | None = None) -> Summary:
    """Returns the summary of a run with the verdict that its scene asks for, and writes it into the run's directory.

    Args:
        find: returns the finding on the end of the run; not called if the run failed or kept off the wall.

    Raises:
        LogError: the summary could not be written.
    """
    if is_watched(scene, summary):
        untouched = summary["verdict"] == "no-contact"
        finding = Finding("no-contact", "no contact") if untouched else find()
    elif scene.run.verdict == "pushed" and summary["ended"] == "diverged":
        finding = Finding("diverged", "diverged", detail=summary["why"], without=find().without)
    else:
        return summary
    window = summary["window"]
    summary = finite(summary | entries_of(finding, scene, window["from_s"], *seen_in(window)))
    if out:
        write_summary(summary, out)
    return summary


def seen_in(window: Summary) -> tuple[float | None, float | None]:
    """Returns how far the run itself swung in its last window, m, and its command there, N; None where unknown.

    What a window shows of a loop that was changed within it is not the loop that is judged.
    """
    if window.get("changed_s") is not None:
        return None, None
    return window.get("oscillation_m"), window.get("force_ripple_N")


def entries_of(
    finding: Finding, scene: Scene, from_s: float, seen_m: float | None = None, ripple_N: float | None = None
) -> dict[str, Any]:
    """Returns the entries of a finding in a summary, with the provisos that follow from the run and its scene.

    Args:
        from_s: when the run's last window began.
        seen_m, ripple_N: how far the run itself swung there, and its command, see ``Finding.entries``.
    """
    told = finding.entries(seen_m, moved_beside(scene, from_s), ripple_N)
    if finding.word in ("steady", "limit-cycle") and rings_between_ticks(scene):
        told["stability"]["provisos"] += [BETWEEN_TICKS]
    return told


def judge(
    end: End, looks_s: Sequence[float] = PATIENT_S, *, blows: Sequence[float] = BLOWS, thorough: bool = False
) -> Finding:
    """Returns whether a loop, continued from the end of a run, forgets its start; a run out of contact is not pushed.

    The hand is held still with the mean force of its last contacts, noise is switched off, and two copies of the loop
    are pushed, one ten times as hard as the other. Any motion a second later is the loop's own. Most loops show their
    verdict within a second or two; slow ones are watched to the last look. This takes as long as simulating that time
    twice. A loop that comes to rest is also struck, into the wall and off it, which takes as long again, and left alone
    if it still moved: a swing that a push ends may go on without one. Friction stops
    small swings of an unstable loop, but not wide ones: if ``thorough``, a loop that rests is also pushed without its
    friction, and one that rests without friction also where it lies a third and two thirds of an encoder's count
    deeper. A loop that rests at the last hold of a moving hand is also judged at that hand's hardest hold.
    """
    if end.told:
        return end.told
    push_N = push_of(end.hold_N, end.scene.hand, end.wall_m)
    pushes_N = push_N * SMALLER, push_N
    found, x = watch(end, pushes_N, looks_s)
    if found.word == "limit-cycle":
        beside = StillHand(end, push_N * (1.0 + BESIDE))
        beside.go_to(found.watched_s)
        return replace(found, chaotic=parts(x, beside.x, found.width_m))
    for blow in blows:
        if is_struck(found):
            found = found.after_blow(watch(end, (push_N * blow,), looks_s)[0])
    if is_struck(found) and moves_on(end):
        found = found.left_alone(watch(end, (0.0,), looks_s)[0])
    harder_N = None
    if found.word == "steady":
        harder_N = harder_hold(end.scene, end.time, end.plant.reached, end.hold_N, end.wall_m)
    if harder_N is not None:
        found = found.held_harder(harder_N, judge(replace(end, hold_N=harder_N), looks_s, blows=blows))
    return _elsewhere(end, pushes_N, found) if thorough and is_struck(found) else found


def _elsewhere(end: End, pushes_N: tuple[float, ...], found: Finding) -> Finding:
    """Returns the finding of a loop that rests, with what it does without its friction and elsewhere within a count."""
    if end.scene.friction:
        rubs, end = has_friction(end.scene), replace(end, scene=replace(end.scene, friction=Friction(kinetic=0.0)))
        found = found.without_friction(watch(end, pushes_N, LOOKS_S)[0]) if rubs else found
    for hold_N in deeper_holds(end.scene, end.controller.params.wall, end.hold_N):
        if found.rests_freely:
            push_N = push_of(hold_N, end.scene.hand, end.wall_m)
            there = watch(replace(end, hold_N=hold_N), (push_N * SMALLER, push_N), LOOKS_S)[0]
            found = found.held_deeper(hold_N - end.hold_N, there)
    return found
