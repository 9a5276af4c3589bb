"""``judge`` for many loops: the members of a batch are pushed and watched together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from haploop.launch.batch.batch import BatchEnd
from haploop.launch.plan.rules import has_friction
from haploop.launch.stability.finding import Finding
from haploop.launch.stability.looks import (
    BESIDE,
    BLOWS,
    LOOKS_S,
    SMALLER,
    failed,
    findings,
    is_struck,
    left_limit,
    parts,
    push_of,
    watch_times,
)
from haploop.launch.stability.memory_drift import may_act
from haploop.launch.stability.still_batch import StillBatch
from haploop.launch.stability.still_hand import deeper_holds, harder_hold, hold_of
from haploop.launch.stability.swing import REST_M
from haploop.launch.stability.watch import GLANCE_S
from haploop.protocol.scene.effects import Friction
from haploop.protocol.trees import tree_member, tree_take
from haploop.protocol.walls.wall import Wall

# The most members of a batch that are judged together.
MOST = 1024


def judge_batch(end: BatchEnd, looks_s: Sequence[float] = LOOKS_S) -> list[Finding]:
    """Returns the finding of ``judge`` on each member at the end of a batch, which has at least two.

    Raises:
        ElementError: an element raised; it is not known for which member.
    """
    found = [Finding("no-contact", "no contact") for _ in end.scenes]
    touching = np.flatnonzero(end.inside.any(axis=1))
    hold_N = np.array([hold_of(end.scenes[i], end.time, end.tick, end.inside[i]) for i in touching])
    for first in range(0, len(touching), MOST):
        some, held_N = touching[first : first + MOST], hold_N[first : first + MOST]
        judged = _elsewhere(end, some, held_N, _judge_some(end, some, held_N, looks_s))
        for place, finding in zip(some, judged, strict=True):
            found[place] = finding
    return found


def _judge_some(end: BatchEnd, members: np.ndarray, hold_N: np.ndarray, looks_s: Sequence[float]) -> list[Finding]:
    """Judges members that touch the wall."""
    push_N = _pushes(end, members, hold_N)
    found, asked = _watched(end, members, hold_N, push_N, (SMALLER, 1.0), looks_s)
    for blow in BLOWS:
        if struck := [place for place, each in enumerate(found) if is_struck(each)]:
            blows, _ = _watched(end, members[struck], hold_N[struck], push_N[struck] * blow, (1.0,), looks_s)
            for place, of_blow in zip(struck, blows, strict=True):
                found[place] = found[place].after_blow(of_blow)
    if struck := [place for place, each in enumerate(found) if is_struck(each)]:
        moving = [
            place for place, moves in zip(struck, _move_on(end, members[struck], hold_N[struck]), strict=True) if moves
        ]
        if moving:
            alone, _ = _watched(end, members[moving], hold_N[moving], np.zeros(len(moving)), (1.0,), looks_s)
            for place, there in zip(moving, alone, strict=True):
                found[place] = found[place].left_alone(there)
    rests = [place for place, each in enumerate(found) if each.word == "steady"]
    hardest = {place: _harder(end, members[place], float(hold_N[place])) for place in rests}
    harder_N = {place: hold for place, hold in hardest.items() if hold is not None}
    if harder_N:
        at_hardest = _judge_some(end, members[[*harder_N]], np.array([*harder_N.values()]), looks_s)
        for (place, harder), there in zip(harder_N.items(), at_hardest, strict=True):
            found[place] = found[place].held_harder(harder, there)
    return _with_chaos(end, members, hold_N, push_N, found, asked)


def _move_on(end: BatchEnd, members: np.ndarray, hold_N: np.ndarray) -> list[bool]:
    """Tells which members move on, left alone from the end of their runs."""
    copies = StillBatch(end, members, hold_N, np.zeros(len(members)))
    copies.go_to(GLANCE_S)
    moves = np.ones(len(members), bool)
    moves[copies.copy] = np.ptp(copies.positions(), axis=1) >= REST_M
    return moves.tolist()


def _pushes(end: BatchEnd, members: np.ndarray, hold_N: np.ndarray) -> np.ndarray:
    holds = zip(members.tolist(), hold_N.tolist(), strict=True)
    return np.array([push_of(hold, end.scenes[i].hand, _wall_m(end, i)) for i, hold in holds])


def _harder(end: BatchEnd, member: int, hold_N: float) -> float | None:
    return harder_hold(end.scenes[member], end.time, end.tick, hold_N, _wall_m(end, member))


def _elsewhere(end: BatchEnd, members: np.ndarray, hold_N: np.ndarray, found: list[Finding]) -> list[Finding]:
    """Returns the findings; for each loop that rests, with what it does without its friction and within a count."""
    found, rests = list(found), [place for place, each in enumerate(found) if is_struck(each)]
    if rests and end.scenes[0].friction:
        held = {place: float(hold_N[place]) for place in rests if has_friction(end.scenes[members[place]])}
        end = end._replace(scenes=[replace(scene, friction=Friction(kinetic=0.0)) for scene in end.scenes])
        for place, free in _pushed(end, members, held).items():
            found[place] = found[place].without_friction(free)
    deeper = {place: _deeper(end, members[place], float(hold_N[place])) for place in rests}
    for nth in range(max(map(len, deeper.values()), default=0)):
        holds = {place: deeper[place][nth] for place in rests if found[place].rests_freely and deeper[place]}
        for place, there in _pushed(end, members, holds).items():
            found[place] = found[place].held_deeper(holds[place] - float(hold_N[place]), there)
    return found


def _deeper(end: BatchEnd, member: int, hold_N: float) -> list[float]:
    return deeper_holds(end.scenes[member], tree_member(end.params.wall, member), hold_N)


def _pushed(end: BatchEnd, members: np.ndarray, holds_N: dict[int, float]) -> dict[int, Finding]:
    """Returns the findings after both pushes at the holds of some places, by place."""
    if not holds_N:
        return {}
    some, hold_N = members[[*holds_N]], np.array([*holds_N.values()])
    found, _ = _watched(end, some, hold_N, _pushes(end, some, hold_N), (SMALLER, 1.0), LOOKS_S)
    return dict(zip(holds_N, found, strict=True))


def _watched(
    end: BatchEnd, members: np.ndarray, hold_N: np.ndarray, push_N: np.ndarray, shares: tuple[float, ...],
    looks_s: Sequence[float],
) -> tuple[list[Finding], list[tuple[int, np.ndarray]]]:  # fmt: skip
    """Watches copies for each share of the pushes, the hardest last; copy ``i + n count`` has member i and share n.

    Returns:
        The finding on each member, and (its place, the last copy's positions) for every limit cycle.
    """
    count = len(members)
    found = [failed(push, 0.0, "") for push in push_N.tolist()]
    pushes_N = np.concatenate([push_N * share for share in shares])
    copies = StillBatch(end, np.tile(members, len(shares)), np.tile(hold_N, len(shares)), pushes_N)
    cycles: list[tuple[int, np.ndarray]] = []
    times_s = watch_times(end.time, end.time.delay_steps, looks_s)
    for seconds in times_s:
        for copy, x in copies.go_to(seconds):
            place = copy % count
            if not found[place].tells:
                found[place] = left_limit(push_N[place], seconds, _wall_of(end, members[place]), x)
        _keep(copies, found, count)
        here = copies.copy[: len(copies.copy) // len(shares)]
        if not len(here):
            break
        x, command = copies.positions(), copies.commands()
        pushed = [x[: len(here)], x[-len(here) :], command[-len(here) :]]
        scenes = [end.scenes[place] for place in members[here]]
        wall = _wall_of(end, members[here])
        last, looks = seconds == times_s[-1], [numbers[:, -len(here) :] for numbers in copies.memory()]
        told = findings(pushed, end.time, wall, scenes, push_N[here], last=last)
        for at, (place, finding) in enumerate(zip(here.tolist(), told, strict=True)):
            found[place] = finding
            if finding.word == "steady":
                acts = may_act([numbers[:, at] for numbers in looks], finding.width_m >= REST_M, seconds, last=last)
                found[place] = replace(finding, memory_drifts=bool(acts))
            if finding.word == "limit-cycle":
                cycles.append((place, pushed[1][at]))
        _keep(copies, found, count)
    return found, cycles


def _keep(copies: StillBatch, found: list[Finding], count: int) -> None:
    copies.keep(np.array([not found[copy % count].tells for copy in copies.copy], bool))


def _with_chaos(
    end: BatchEnd, members: np.ndarray, hold_N: np.ndarray, push_N: np.ndarray, found: list[Finding],
    asked: Sequence[tuple[int, np.ndarray]],
) -> list[Finding]:  # fmt: skip
    """Returns the findings; for each limit cycle, given by its place and large trace, also whether it is chaotic."""
    for watched_s in sorted({found[place].watched_s for place, _ in asked}):
        some = [(place, x) for place, x in asked if found[place].watched_s == watched_s]
        places = np.array([place for place, _ in some])
        beside = StillBatch(end, members[places], hold_N[places], push_N[places] * (1.0 + BESIDE))
        gone = dict(beside.go_to(watched_s))
        traces = dict(zip(beside.copy.tolist(), beside.positions(), strict=True)) if len(beside.copy) else {}
        for copy, (place, x) in enumerate(some):
            other = traces.get(copy, gone.get(copy, x[:0]))
            found[place] = replace(found[place], chaotic=parts(x, other, found[place].width_m))
    return found


def _wall_m(end: BatchEnd, member: int) -> float:
    """Returns the position of a member's wall, which an event may have moved, m."""
    return float(np.ravel(_wall_of(end, member).position)[0])


def _wall_of(end: BatchEnd, place: int | np.ndarray) -> Wall:
    """Returns the wall of a member, or of several."""
    return tree_take(end.params.wall, np.atleast_1d(place))
