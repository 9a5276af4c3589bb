"""Judging the end of a run: the loop is held still, pushed, and watched until it tells."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element, ElementError
from haploop.controller.tick import Wall
from haploop.launch.batch.batch import BatchEnd
from haploop.launch.scene.events import scene_events
from haploop.launch.stability.decide import Finding, Pushed, decide, measure
from haploop.launch.stability.still_batch import StillBatch
from haploop.launch.stability.still_hand import End, StillHand, hold_of
from haploop.logger.session import write_summary
from haploop.logger.summary import Summary, finite
from haploop.plant.plant import Plant
from haploop.protocol.changes import Event, is_change
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_take

# The larger push, as a share of what the hand holds the wall with, and the smaller one, as a share of it.
PUSH, SMALLER = 0.3, 0.1
# Times since the push at which the loop is looked at, in s: of a run as part of it, and where somebody asks.
LOOKS_S = (1.0, 2.0, 4.0, 8.0, 16.0)
PATIENT_S = (*LOOKS_S, 32.0, 64.0)
_LEAST_LOAD_N = 1e-3
# A loop is watched for so many ticks at least.
_LEAST_TICKS = 240
# Members of a batch that are judged together.
MOST = 1024
# A third copy, pushed harder by this share, shows whether the swing is chaotic: whether it ends apart from the second
# by this share of the width.
_BESIDE, _APART = 1e-3, 0.2


def judge_scene(
    scene: Scene,
    kinds: Mapping[str, type[Element]],
    events: Sequence[tuple[int, Event]] | None = None,
    looks_s: Sequence[float] = PATIENT_S,
) -> Finding:
    """Runs a resolved scene to its end and judges that end.

    Args:
        scene: the resolved scene.
        kinds: element kinds at hand.
        events: (tick, event) in order; the scene's own when None.
        looks_s: times since the push at which the loop is looked at until it tells.

    Raises:
        ElementError: an element raised.
        ArithmeticError: the plant's arithmetic failed.
    """
    end = end_of(scene, kinds, events)
    return judge(end, looks_s) if isinstance(end, End) else end


def end_of(
    scene: Scene, kinds: Mapping[str, type[Element]], events: Sequence[tuple[int, Event]] | None = None
) -> End | Finding:
    """Returns the end of a run, or what is found of one that diverged or ended out of contact."""
    time = Timebase.from_scene(scene)
    plant, controller, ticks = Plant(scene, time), Controller(scene, time, dict(kinds)), time.ticks
    for tick, event in scene_events(scene, time) if events is None else events:
        if is_change(event):
            controller.schedule(tick, event)
            plant.schedule(tick, event)
        elif event.get("stop"):
            ticks = min(ticks, tick)
    plant.run_until(ticks, lambda _, samples: [float(force) for force in controller.answer(samples)])
    plant.take_block()
    if plant.stop_reason:
        return Finding("diverged", "diverged", detail=plant.stop_reason)
    rows = b"".join(block["columns"]["in_contact"] for block in controller.recorder.take())
    return end_at(
        scene, plant, controller, np.frombuffer(rows)[max(ticks // 2, ticks - time.control_rate // 2) :] > 0.0
    )


def end_at(scene: Scene, plant: Plant, controller: Controller, inside: np.ndarray) -> End | Finding:
    """Returns the end of a run whose blocks have been taken.

    Args:
        scene: what was run.
        plant, controller: as they stand there.
        inside: whether each of the last ticks was in contact, shape (ticks,).
    """
    if plant.stop_reason:
        return Finding("diverged", "diverged", detail=plant.stop_reason)
    if not inside.any():
        return Finding("no-contact", "no contact")
    time = Timebase.from_scene(scene)
    return End(scene, time, plant, controller, hold_of(scene, time, plant.reached, inside))


def is_watched(scene: Scene, summary: Summary) -> bool:
    """Tells whether a run is judged by pushing it: its scene asks for that, and it came to an end by itself."""
    return scene.run.verdict == "pushed" and summary["ended"] in ("done", "stopped") and summary["ticks"] > 0


def with_verdict(scene: Scene, summary: Summary, find: Callable[[], Finding], out: Path | None = None) -> Summary:
    """Returns the summary of a run with the verdict that its scene asks for, and writes it into the run's directory.

    Args:
        find: returns what is found of the end of the run; not called for one that failed or diverged.

    Raises:
        LogError: it could not be written.
    """
    if is_watched(scene, summary):
        finding = find()
    elif scene.run.verdict == "pushed" and summary["ended"] == "diverged":
        finding = Finding("diverged", "diverged", detail=summary["why"])
    else:
        return summary
    summary = finite(summary | finding.entries())
    if out:
        write_summary(summary, out)
    return summary


def watch_times(time: Timebase, delay_steps: int, looks_s: Sequence[float]) -> list[float]:
    """Returns when to look, s: not before what is commanded has gone round eight times, and at ticks enough to tell."""
    least_s = max(8.0 * delay_steps / time.plant_rate, _LEAST_TICKS / time.control_rate)
    return sorted({max(least_s, look_s) for look_s in looks_s})


def judge(end: End, looks_s: Sequence[float] = PATIENT_S) -> Finding:
    """Returns whether a loop forgets its start, from the end of a run in contact on.

    The hand is held still with the mean force of its last contacts, noise is switched off, and two copies of the loop
    are pushed, one ten times as hard as the other. Whatever moves a second later is the loop's own. Most loops tell
    within a second or two; slow ones are watched to the last look. It takes as long as simulating that time twice.
    """
    push_N = _push_N(end.hold_N)
    small, large = StillHand(end, push_N * SMALLER), StillHand(end, push_N)
    wall, found = end.controller.params.wall, _failed(push_N, 0.0, "")
    delay_steps = end.plant.checkpoint().delay_steps
    times_s = watch_times(end.time, end.time.delay_steps if delay_steps is None else delay_steps, looks_s)
    for seconds in times_s:
        try:
            small.go_to(seconds)
            large.go_to(seconds)
        except (ArithmeticError, ElementError) as error:
            return _failed(push_N, seconds, str(error))
        gone = [each for each in (small, large) if each.stop_reason]
        if gone:
            return _left(push_N, seconds, wall, min((each.x for each in gone), key=len))
        pushed = (each[None] for each in (small.x, large.x, large.command))
        [found] = _found([*pushed], end.time, wall, [end.scene], np.array([push_N]), last=seconds == times_s[-1])
        if found.word != "undecided":
            break
    if found.word == "limit-cycle":
        beside = StillHand(end, push_N * (1.0 + _BESIDE))
        beside.go_to(found.watched_s)
        found = replace(found, chaotic=parts(large.x, beside.x, found.width_m))
    return found


def judge_batch(end: BatchEnd, looks_s: Sequence[float] = LOOKS_S) -> list[Finding]:
    """Returns what ``judge`` finds of each member at the end of a batch, two members at least.

    Raises:
        ElementError: an element raised; it is not known for which member.
    """
    found = [Finding("no-contact", "no contact") for _ in end.scenes]
    touching = np.flatnonzero(end.inside.any(axis=1))
    hold_N = np.array([hold_of(end.scenes[i], end.time, end.tick, end.inside[i]) for i in touching])
    for first in range(0, len(touching), MOST):
        some = touching[first : first + MOST]
        for place, finding in zip(some, _judge_some(end, some, hold_N[first : first + MOST], looks_s), strict=True):
            found[place] = finding
    return found


def _judge_some(end: BatchEnd, members: np.ndarray, hold_N: np.ndarray, looks_s: Sequence[float]) -> list[Finding]:
    """Judges members that touch the wall; copy i is of member i pushed little, copy count + i the same pushed hard."""
    count, push_N = len(members), np.array([_push_N(hold) for hold in hold_N])
    found = [_failed(push, 0.0, "") for push in push_N.tolist()]
    copies = StillBatch(end, np.tile(members, 2), np.tile(hold_N, 2), np.append(push_N * SMALLER, push_N))
    asked: list[tuple[int, np.ndarray]] = []
    times_s = watch_times(end.time, end.time.delay_steps, looks_s)
    for seconds in times_s:
        for copy, x in copies.go_to(seconds):
            place = copy % count
            if found[place].word == "undecided":
                found[place] = _left(push_N[place], seconds, _wall_of(end, members[place]), x)
        _keep(copies, found, count)
        here = copies.copy[: len(copies.copy) // 2]
        if not len(here):
            break
        x, command = copies.positions(), copies.commands()
        pushed = [x[: len(here)], x[len(here) :], command[len(here) :]]
        scenes = [end.scenes[place] for place in members[here]]
        wall = _wall_of(end, members[here])
        findings = _found(pushed, end.time, wall, scenes, push_N[here], last=seconds == times_s[-1])
        for at, (place, finding) in enumerate(zip(here.tolist(), findings, strict=True)):
            found[place] = finding
            if finding.word == "limit-cycle":
                asked.append((place, pushed[1][at]))
        _keep(copies, found, count)
    return _with_chaos(end, members, hold_N, push_N, found, asked)


def _keep(copies: StillBatch, found: list[Finding], count: int) -> None:
    copies.keep(np.array([found[copy % count].word == "undecided" for copy in copies.copy], bool))


def _with_chaos(
    end: BatchEnd, members: np.ndarray, hold_N: np.ndarray, push_N: np.ndarray, found: list[Finding],
    asked: Sequence[tuple[int, np.ndarray]],
) -> list[Finding]:  # fmt: skip
    """Returns the findings; of each limit cycle, given by its place and large trace, also whether it is chaotic."""
    for watched_s in sorted({found[place].watched_s for place, _ in asked}):
        some = [(place, x) for place, x in asked if found[place].watched_s == watched_s]
        places = np.array([place for place, _ in some])
        beside = StillBatch(end, members[places], hold_N[places], push_N[places] * (1.0 + _BESIDE))
        gone = dict(beside.go_to(watched_s))
        traces = dict(zip(beside.copy.tolist(), beside.positions(), strict=True)) if len(beside.copy) else {}
        for copy, (place, x) in enumerate(some):
            other = traces.get(copy, gone.get(copy, x[:0]))
            found[place] = replace(found[place], chaotic=parts(x, other, found[place].width_m))
    return found


def parts(one: np.ndarray, other: np.ndarray, width_m: float) -> bool:
    """Tells whether two copies that began together end apart by a fifth of their swing or more.

    One that is shorter left the limit, and has parted.
    """
    if len(one) != len(other):
        return True
    apart = np.abs(one - other)
    eighth = len(apart) // 8
    return bool(apart[:eighth].min() < 0.01 * width_m and apart[-2 * eighth :].max() > _APART * width_m)


def _push_N(hold_N: float) -> float:
    return PUSH * max(abs(hold_N), _LEAST_LOAD_N) * (1.0 if hold_N > 0.0 else -1.0)


def _failed(push_N: float, seconds: float, detail: str) -> Finding:
    return Finding("undecided", "failed", abs(push_N), seconds, detail=detail)


def _left(push_N: float, seconds: float, wall: Wall, x: np.ndarray) -> Finding:
    """Returns what is found of a loop of which a copy left the limit, at whose ticks it was at x (m)."""
    if not _is_inside(wall, x[None, len(x) // 2 :])[0]:
        return Finding("undecided", "leaves the wall", abs(push_N))
    return Finding("growing", "leaves the limit", abs(push_N), seconds)


def _wall_of(end: BatchEnd, place: int | np.ndarray) -> Wall:
    """Returns the wall of a member, or of some."""
    return tree_take(end.params.wall, np.atleast_1d(place))


def _is_inside(wall: Wall, x: np.ndarray, reduce: Callable[..., np.ndarray] = np.any) -> np.ndarray:
    """Tells which loops touched their wall at any (or all) of the ticks where they were at x (m), (loops, ticks)."""
    position = np.reshape(wall.position, (-1, 1))
    return reduce(wall.inward * (x - position) > 0.0, axis=1)


def _found(
    traces: list[np.ndarray], time: Timebase, wall: Wall, scenes: Sequence[Scene], push_N: np.ndarray, *, last: bool
) -> list[Finding]:
    """Returns what is found so far, of traces of position after both pushes and of the command, (loops, ticks)."""
    small, large, command = traces
    quarter = -(-large.shape[1] // 4)
    half = large.shape[1] // 2
    inside = _is_inside(wall, small[:, -quarter:]) & _is_inside(wall, large[:, -quarter:])
    stays = _is_inside(wall, small[:, half:], np.all) & _is_inside(wall, large[:, half:], np.all)
    count_m = np.array([scene.encoder.resolution if scene.encoder else 0.0 for scene in scenes])
    smooth = np.array([_is_smooth(scene) for scene in scenes])
    pushed = Pushed(small, large, command, np.abs(push_N), count_m, inside, stays, smooth)
    swings = measure(pushed, time.control_rate)
    return [decide(swing, last=last) for swing in swings]


def _is_smooth(scene: Scene) -> bool:
    """Tells whether nothing but the encoder rounds, nothing saturates, and no estimator filters small swings more."""
    limits = [
        (table.resolution, getattr(table, "saturation", None))
        for table in (scene.actuator, scene.accelerometer)
        if table
    ]
    return not any(map(any, limits)) and scene.estimate("velocity").estimator != "foaw"
