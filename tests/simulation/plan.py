"""Plan that a seed draws: the scene, the temper of the network, what happens when; and how little of it still fails.

A failing plan is shortened by delta debugging (Zeller & Hildebrandt 2002).
"""

from __future__ import annotations

import errno
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from random import Random
from typing import Any, TypeVar

from helpers.live.attacks import SOCKETS, impossible_commands, junk, pack
from simulation.faults import (
    ALL,
    OPERATIONS,
    OWN,
    DiskFull,
    Fault,
    Garble,
    Kill,
    KillLauncher,
    Late,
    LateStart,
    Refuse,
    Signals,
    Slow,
    SlowDisk,
    Stop,
    When,
)
from simulation.plugins import BROKEN, SOUND, Reload
from simulation.reference import NAMES
from simulation.visitors import Commands, Impostor, Listener, Rival, SecondLogger, Stranger

Part = TypeVar("Part")

_TICKS = 70
_STAYS = ("stays", 0.0)
# A pace at which a run lasts so long, in virtual time, that its log is flushed forty times.
_LONG = 0.004
_ASKED = ("ask", "pause", "step", "pace", "stop", "set", "set", "swap", "swap", "impossible", "limit")
# Commands at the limits of what one may carry, and beyond: unknown keys (3000 in a frame of 21 KB), letters, changes.
_KEYS, _LETTERS, _WAITING = (31, 3000, 3000, 10_000), (200, 201, 30_000), 101
# Those that ``ask`` can send.
_IMPOSSIBLE = [
    (verb, arguments)
    for verb, arguments in impossible_commands()
    if isinstance(arguments, dict) and all(type(key) is str and key != "self" for key in arguments)
]
_FORCES = ("1 N", None, [0.0], {"force": 1.0})
_GARBLED = [*junk(), *(pack(1, code, tick, [force]) for code in (21, 22) for tick in (0, 20, 40) for force in _FORCES)]


@dataclass(frozen=True)
class Plan:
    """A history before it happens: the same plan always gives the same history.

    Attributes:
        seed: of the network and of who runs when.
        jumpiness, latency_s: as of ``World``.
        pace: simulated seconds a second.
        starts_s: what each process takes to start, by role.
    """

    seed: int
    scene: str
    jumpiness: float
    latency_s: float
    pace: float
    starts_s: dict[str, float]
    faults: tuple[Fault, ...]


def draw(seed: int) -> Plan:
    """Draws the plan of a seed: the scene, the network, and up to six faults; one in twelve has none."""
    dice = Random(f"plan {seed}")
    faults = tuple(_fault(dice) for _ in range(dice.choice((0, 1, 1, 1, 1, 2, 2, 2, 3, 3, 4, 6))))
    return Plan(
        seed,
        dice.choice(NAMES),
        dice.choice((0.0, 0.01, 0.05, 0.2)),
        dice.choice((20e-6, 100e-6, 400e-6)),
        dice.choice((math.inf, math.inf, math.inf, 1.0, 0.1, 0.03)) if dice.random() < 0.98 else _LONG,
        {role: dice.uniform(0.01, 0.6) for role in OWN},
        faults,
    )


def _when(dice: Random) -> When:
    if dice.random() < 0.25:
        return When(-1, dice.uniform(0.0, 0.7))
    soon_s = dice.expovariate(1e3)
    return When(dice.randint(0, _TICKS), dice.choice((0.0, soon_s, soon_s, dice.random(), 3.0 * dice.random())))


def _fate(dice: Random) -> tuple[str, float]:
    return dice.choice(("stays", "stays", "leaves", "killed", "stopped", "held")), dice.expovariate(20.0)


def _fault(dice: Random) -> Fault:
    """Draws one fault; what ends a run is rarer than what it must go through."""
    make, weight = zip(*_KINDS.items(), strict=True)
    return dice.choices(make, weight)[0](dice)


def _commands(dice: Random) -> Commands:
    commands: list[tuple[str, dict[str, Any], float]] = []
    for _ in range(dice.randint(1, 3)):
        match dice.choice(
            ("ask", "pause", "step", "pace", "stop", "set", "set", "swap", "swap", "impossible", "limit")
        ):
            case "ask":
                commands.append((dice.choice(("status", "options")), {}, dice.expovariate(100.0)))
            case "pause":
                commands += [("pause", {}, dice.expovariate(2.0)), ("resume", {}, 0.0)]
            case "step":
                steps = [("step", {"ticks": dice.randint(1, 30)}, dice.expovariate(10.0)) for _ in range(2)]
                commands += [*steps, ("resume", {}, 0.0)]
            case "pace":
                commands.append(("pace", {"pace": dice.choice(("free", 0.1, 3.0, 40.0))}, dice.expovariate(10.0)))
            case "stop":
                commands.append(("stop", {}, 0.0))
            case "set":
                key, value = dice.choice(
                    (
                        ("wall.stiffness", dice.uniform(0.0, 900.0)),
                        ("wall.position", dice.uniform(-0.02, 0.0)),
                        ("dissipation.0.damping", dice.uniform(0.0, 1.0)),
                        ("clock.round_trip_delay", dice.randint(0, 60) / 10_000),
                    )
                )
                at = {"at": dice.uniform(0.0, 0.08)} if dice.random() < 0.4 else {}
                commands.append(("set", {"set": {key: value}, **at}, dice.expovariate(100.0)))
            case "swap":
                kind = dice.choice(({"kind": "none"}, {"kind": "damping", "damping": dice.random()}))
                arguments = {"swap": kind, "element": dice.randint(0, 1)}
                commands.append(("swap", arguments, dice.expovariate(100.0)))
                if arguments["element"]:
                    commands.append(("undo", {}, 0.003))
            case "limit":
                commands += _at_a_limit(dice)
            case _:
                commands.append((*dice.choice(_IMPOSSIBLE), 0.0))
    return Commands(_when(dice), _STAYS, tuple(commands))


def _at_a_limit(dice: Random) -> list[tuple[str, dict[str, Any], float]]:
    """Commands that are just possible, or just no more."""
    match dice.choice(("keys", "keys", "letters", "step", "pace", "at", "waiting")):
        case "keys":
            return [("set", {"set": {f"k{i}": 1 for i in range(dice.choice(_KEYS))}}, 0.0)]
        case "letters":
            return [("swap", {"swap": {"kind": dice.choice("x1[") * dice.choice(_LETTERS)}}, 0.0)]
        case "step":
            return [("step", {"ticks": ticks}, 0.0) for ticks in (_TICKS + 1, _TICKS)] + [("resume", {}, 0.0)]
        case "pace":
            return [("pace", {"pace": pace}, dice.random()) for pace in (1e6, 1.1e6, 1e-6, 0.9e-6, "free")]
        case "at":
            return [("set", {"set": {"wall.stiffness": 1.0}, "at": at}, 0.0) for at in (1e9, 0.07, 0.0699)]
    change = {"set": {"wall.stiffness": 10.0}, "at": 0.068}
    return [("pause", {}, 0.0), *[("set", change, 0.0)] * _WAITING, ("resume", {}, 0.0)]


# Maker of a fault -> how often it is drawn.
_KINDS: dict[Callable[[Random], Fault], int] = {
    lambda dice: Kill(_when(dice), dice.choice(OWN)): 3,
    lambda dice: KillLauncher(_when(dice)): 1,
    lambda dice: Stop(_when(dice), dice.choice(ALL), dice.choice((0.05, 0.5, 3.0, 8.0))): 3,
    lambda dice: Slow(_when(dice), dice.choice(ALL), dice.choice((1e-4, 1e-3, 5e-3, 0.1))): 3,
    lambda dice: Late(_when(dice), dice.choice(ALL), dice.choice((1e-3, 0.02, 0.2)), dice.random()): 3,
    lambda dice: LateStart(When(-1, 0.0), dice.choice(OWN), dice.uniform(0.0, 10.0)): 2,
    lambda dice: DiskFull(_when(dice), dice.choice((0, dice.randint(0, 30_000)))): 1,
    lambda dice: Refuse(_when(dice), dice.choice(OPERATIONS), dice.choice((errno.EIO, errno.EROFS))): 1,
    lambda dice: SlowDisk(_when(dice)): 1,
    lambda dice: Garble(_when(dice), dice.choice(OWN[:2]), dice.choice(_GARBLED)): 1,
    lambda dice: Signals(_when(dice), dice.choice((1, 1, 2))): 2,
    _commands: 6,
    lambda dice: Listener(_when(dice), _fate(dice), dice.random() < 0.5, dice.choice((0.005, 0.03, 0.3))): 3,
    lambda dice: SecondLogger(_when(dice), _fate(dice)): 3,
    lambda dice: Stranger(_when(dice), _STAYS, dice.choice(SOCKETS), dice.choice((5, 30, 600)), dice.randrange(999)): 3,
    lambda dice: Impostor(_when(dice), _STAYS, dice.choice(OWN)): 1,
    lambda dice: Reload(_when(dice), _STAYS, tuple(dice.choices((*SOUND, *BROKEN), k=dice.randint(1, 3)))): 1,
    lambda dice: Rival(When(-1, dice.choice((0.0, dice.expovariate(1e4))))): 1,
}


def fewest(parts: Sequence[Part], fails: Callable[[tuple[Part, ...]], bool]) -> tuple[Part, ...]:
    """Returns a part of ``parts``, in order, that still fails and of which none can be left out."""
    kept, pieces = tuple(parts), 2
    while kept:
        size = math.ceil(len(kept) / pieces)
        rests = [kept[:first] + kept[first + size :] for first in range(0, len(kept), size)]
        smaller = next((rest for rest in rests if fails(rest)), None)
        if smaller is not None:
            kept, pieces = smaller, max(pieces - 1, 2)
        elif size == 1:
            break
        else:
            pieces = min(2 * pieces, len(kept))
    return kept


def shrink(plan: Plan, breaks: Callable[[Plan], bool]) -> Plan:
    """Returns the plan with the fewest faults, the calmest network and the least scene that still breaks a promise."""
    plan = replace(plan, faults=fewest(plan.faults, lambda faults: breaks(replace(plan, faults=faults))))
    for calmer in ({"pace": math.inf}, {"jumpiness": 0.0}, {"scene": "least"}):
        if breaks(candidate := replace(plan, **calmer)):
            plan = candidate
    return plan


def tell(plan: Plan) -> str:
    """Returns a plan in lines."""
    temper = f"scene {plan.scene}, pace {plan.pace:g}, latency {plan.latency_s:g} s, jumpiness {plan.jumpiness:g}"
    faults = [f"  {fault}" for fault in plan.faults] or ["  no fault at all"]
    return "\n".join([f"seed {plan.seed}: {temper}", *faults])
