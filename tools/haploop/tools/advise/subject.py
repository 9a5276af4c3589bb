"""The subject of an advice: a device that comes with haploop, or a scene, with its hand, delay and estimator."""

from __future__ import annotations

import contextlib
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from haploop.controller.dissipation import Element
from haploop.launch.scene.bundled import bundled, found, like
from haploop.launch.scene.file import resolved
from haploop.launch.scene.reading.layers import Layers, read_layers
from haploop.protocol.amounts import amount
from haploop.protocol.changes import Change, at_work
from haploop.protocol.names import nearest
from haploop.protocol.scene.scene import Scene
from haploop.protocol.walls.registry import class_of
from haploop.tools.advise.families import STABILIZERS
from haploop.tools.advise.walls.cases import MOST_DELAY_S, hold_N, make_loop

# The only measured hand there is, along the axis of Choi et al. 2022.
DEFAULT_HAND = "fu_cavusoglu_y"
# What each estimator needs beside its name. The windows are short enough for a contact at 1 kHz.
ESTIMATORS: dict[str, dict[str, dict[str, Any]]] = {
    "difference": {"velocity": {"estimator": "difference"}, "acceleration": {"source": "encoder"}},
    "window": {"velocity": {"estimator": "window", "ticks": 5}},
    "foaw": {"velocity": {"estimator": "foaw", "ticks": 15}},
    "kalman": {"velocity": {"estimator": "kalman", "jerk_density": 100.0}, "acceleration": {"source": "kalman"}},
    "accelerometer": {"acceleration": {"source": "accelerometer"}},
}
_TOO_LATE = (
    "The round-trip delay is {0:g} s; advice is given up to {1:g} s. A number without a unit is in seconds: write "
    '"{0:g} ms" for milliseconds.'
)

_TAKEN = "The hand is {0}, a pen-like grip (Fu and Cavusoglu 2012){1}; --hand names another."
_CHANGED = ", except for {0} as set"
_NO_SPRING = (
    "The scene's wall is of the kind {0}, but advice tries springs only. Remove wall.kind to get advice on a spring."
)
_NOT_TRIED = (
    "{} not tried here: only haploop's own elements are. A sweep over a parameter of an element and wall.stiffness "
    "tries any element (haploop scenes demo_damping prints one to start from)."
)
_STUCK = (
    "Dry friction of {0} holds the device against the hand's {1}: it would not press on the wall, and any wall would "
    "seem safe. Give the actual friction, in N, or a hand that presses harder (hand.force)."
)

# How a device file marks its assumed numbers.
_MARK = re.compile(r"\bassum(?:ption|ptions|ed)\b[:,]?\s*", re.IGNORECASE)
_TABLE = re.compile(r"\[+\s*([\w.]+)\s*\]+")
_VALUE = re.compile(r"([\w]+)\s*=\s*[^#]*(?:#\s*(.*))?$")
# What decides how stiff a wall may be; the hand is tried in its own corners.
_DELAY = "clock.round_trip_delay"
_STARTS = ("device.position", "device.velocity")
_TABLES = ("device", "friction", "encoder", "transmission", "clock")


class InvalidRequest(ValueError):
    """A device, hand or estimator that does not exist, or gets no advice; the message says what is allowed."""


@dataclass(frozen=True)
class Assumed:
    """An unpublished number: its dotted key, and what the file says about it."""

    key: str
    words: str


@dataclass(frozen=True)
class Subject:
    """A scene to advise on.

    Attributes:
        scene: resolved; events that change it are taken as done from the start.
        has_task: whether it came with a task of its own; a device alone, without a wall, has none.
        notes: what was chosen or left out, one sentence each.
        assumed: numbers of the device that its file assumes and the arguments do not give.
    """

    name: str
    scene: Scene
    has_task: bool
    notes: tuple[str, ...]
    assumed: tuple[Assumed, ...] = ()


def make_subject(
    device: str,
    hand: str | None = None,
    delay: str | float | None = None,
    estimator: str | None = None,
    overrides: Sequence[str] = (),
    kinds: Mapping[str, type[Element]] | None = None,
) -> Subject:
    """Makes the scene that the arguments of the command name; elements are those installed where ``kinds`` is None.

    Raises InvalidRequest for an unknown name, SceneError if the scene cannot be run.
    """
    path = _device(device)
    layers, notes = read_layers(path), []
    has_task = "wall" in layers.data
    if hand is None and not has_task and "hand" not in layers.data:
        hand = DEFAULT_HAND
        set_keys = [key for each in overrides if (key := each.partition("=")[0].strip()).startswith("hand.")]
        notes.append(_TAKEN.format(hand, _CHANGED.format(", ".join(set_keys)) if set_keys else ""))
    if hand is not None:
        _lay_hand(layers, hand)
    if estimator is not None:
        _lay_estimator(layers, estimator)
    if not has_task:
        wall = {"position": 0.0, "stiffness": 1000.0}
        layers.lay({"title": path.stem, "duration": layers.data.get("duration", 1.0), "wall": wall}, str(path))
    if delay is not None:
        with contextlib.suppress(ValueError):
            delay = float(delay)
        layers.lay({"clock": {"round_trip_delay": delay}}, "--delay")
    scene = resolved(layers, overrides, kinds)
    if (delay_s := scene.clock.round_trip_delay) > MOST_DELAY_S:
        raise InvalidRequest(_TOO_LATE.format(delay_s, MOST_DELAY_S))
    if scene.event:
        scene = apply_events(scene)
        notes.append("What the scene's events change counts as changed from the start.")
    if (kind := class_of(scene.wall).kind) != "spring":
        raise InvalidRequest(_NO_SPRING.format(kind))
    rubs, presses_N = scene.friction, hold_N(make_loop(scene, has_task))
    if rubs and (most_N := max(rubs.kinetic, rubs.breakaway or 0.0)) >= presses_N:
        raise InvalidRequest(_STUCK.format(amount(most_N, "N"), amount(presses_N, "N")))
    if others := sorted((kinds or {}).keys() - {kind for family in STABILIZERS for kind, _ in family.parts}):
        are = f"The element {others[0]} is" if len(others) == 1 else f"The elements {', '.join(others)} are"
        notes.append(_NOT_TRIED.format(are))
    given = [f"{each.partition('=')[0].strip()}." for each in overrides] + [f"{_DELAY}."] * (delay is not None)
    assumed = tuple(each for each in assumptions(path) if not f"{each.key}.".startswith(tuple(given)))
    return Subject(path.stem, scene, has_task, tuple(notes), assumed)


def assumptions(path: Path) -> tuple[Assumed, ...]:
    """Returns the assumed numbers of a device file and of the files it extends, whose lines its own replace."""
    return tuple(found for found in _by_key(path).values() if found.words)


def _by_key(path: Path) -> dict[str, Assumed]:
    """Returns the numbers of a device file by key, with no words where they are not assumed."""
    text = path.read_text(encoding="utf-8")
    extends = tomllib.loads(text).get("extends", [])
    known: dict[str, Assumed] = {}
    for name in [extends] if isinstance(extends, str) else extends:
        known |= _by_key(found(Path(name), "scenes", path.parent))
    table, above = "", ""
    for line in text.splitlines():
        above, told_above = (f"{above} {line.lstrip('# ')}" if line.startswith("#") else ""), above
        if match := _TABLE.match(line):
            table = match[1]
        elif (match := _VALUE.match(line)) and table.split(".")[0] in _TABLES:
            key, comment = f"{table}.{match[1]}", match[2] or ""
            if key in _STARTS:
                continue
            told = next((of for of in (comment, told_above) if _MARK.search(of)), "")
            known[key] = Assumed(key, _MARK.split(told, maxsplit=1)[1].strip() or told.strip() if told else "")
    return known


def apply_events(scene: Scene) -> Scene:
    """Returns the scene with its swaps and sets made from the start, and without events."""
    changes = [
        Change(0, event.swap, event.element or 0, event.set or {}) for event in scene.event if event.swap or event.set
    ]
    return replace(at_work(scene, changes), event=())


def _device(name: str) -> Path:
    """Returns the file that a name means."""
    path, known = Path(name), bundled("devices") | bundled("scenes")
    if path.suffix == ".toml" or path.is_file() or (path.exists() and name not in known):
        return path
    if name not in known:
        meant = like(path.name, "devices", path.parent)
        raise InvalidRequest(
            _unknown("DEVICE", name, list(known), "the path of a file with a device or a scene", meant)
        )
    return known[name]


def _lay_hand(layers: Layers, name: str) -> None:
    """Replaces the hand by another; the force of its muscles and its rest position are kept."""
    before = layers.data.pop("hand", None)
    kept = {key: before[key] for key in ("force", "rest") if key in before} if isinstance(before, dict) else {}
    if name == "none":
        if kept:
            layers.lay({"hand": kept}, "--hand")
        return
    path, hands = Path(name), bundled("hands")
    if path.suffix != ".toml":
        if name not in hands:
            raise InvalidRequest(_unknown("--hand", name, [*hands, "none"], "the path of a file with a [hand]"))
        path = hands[name]
    tables = read_layers(path).data
    if not isinstance(tables.get("hand"), dict):
        raise InvalidRequest(f"--hand {name} holds no [hand] table.")
    layers.lay({"hand": {**tables["hand"], **kept}}, str(path))


def _lay_estimator(layers: Layers, name: str) -> None:
    if name not in ESTIMATORS:
        raise InvalidRequest(_unknown("--estimator", name, list(ESTIMATORS), ""))
    for table in ("velocity", "acceleration"):
        if name != "accelerometer" or table == "acceleration":
            layers.data.pop(table, None)
    layers.lay(ESTIMATORS[name], "--estimator")


def _unknown(what: str, name: str, allowed: list[str], other: str, meant: str | None = None) -> str:
    meant = meant or nearest(name, allowed)
    hint = f"; did you mean {meant}?" if meant else "."
    return f"{what} {name!r} is unknown{hint} Allowed: {', '.join(allowed)}{f', or {other}' if other else ''}."
