"""States of books and of windows are trees of numbers: packed mid-run and unpacked elsewhere, they go on to the bit."""

from __future__ import annotations

from typing import Any

import msgpack
import numpy as np
import pytest

from haploop.logger.books.books import Books
from haploop.logger.verdict.window import Window
from haploop.protocol.scene.effects import Grip
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_leaves, tree_select, tree_unflatten
from helpers.runs.batches import together
from helpers.runs.captured import run
from helpers.scenes.least import scene

SCENES: dict[str, dict[str, Any]] = {
    "one mass": {},
    "a chain with friction": {"friction": {"kinetic": 0.05, "breakaway": 0.08, "stribeck_velocity": 0.01}},
}


def busy(tables: dict[str, Any]) -> Scene:
    """A tap on a wall whose stiffness changes, with an element that is put in on the way."""
    push = {"kind": "ramp", "value": -1.0, "rise_time": 0.1}
    return scene(
        duration=0.4,
        clock={"round_trip_delay": 0.0013},
        device={"mass": 0.01, "damping": 0.3},
        hand={"mass": 0.01, "damping": 0.2, "stiffness": 50.0, "force": push},
        encoder={"resolution": 1e-5},
        wall={"position": -0.005, "stiffness": 100.0},
        event=[
            {"at": 0.15, "set": {"wall.stiffness": 150.0}},
            {"at": 0.17, "swap": {"kind": "damping", "damping": 0.2}},
        ],
        **tables,
    )


def through_bytes(state: Any) -> Any:
    """The same state from the bytes of its leaves."""

    def encoded(leaf: Any) -> Any:
        return [leaf.dtype.str, leaf.shape, leaf.tobytes()] if isinstance(leaf, np.ndarray) else leaf

    def decoded(leaf: Any) -> Any:
        return np.frombuffer(leaf[2], leaf[0]).reshape(leaf[1]).copy() if isinstance(leaf, list) else leaf

    packed = msgpack.packb([encoded(leaf) for leaf in tree_leaves(state)])
    return tree_unflatten(state, map(decoded, msgpack.unpackb(packed)))


def bits(state: Any) -> list[Any]:
    return [leaf.tobytes() if isinstance(leaf, np.ndarray) else leaf for leaf in tree_leaves(state)]


def calls_of(monkeypatch: pytest.MonkeyPatch, kind: type, name: str) -> list[tuple[Any, ...]]:
    """What a method of a class is called with from now on, and the object."""
    method, calls = getattr(kind, name), list[tuple[Any, ...]]()
    monkeypatch.setattr(kind, name, lambda *of: (calls.append(of), method(*of))[1])
    return calls


@pytest.mark.parametrize("tables", SCENES.values(), ids=SCENES)
@pytest.mark.parametrize("of_batch", [False, True], ids=["one run", "a batch"])
def test_books_go_on_from_a_packed_state_to_the_same_bits(
    tables: dict[str, Any], of_batch: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    resolved, name = busy(tables), "book_batch" if of_batch else "book"
    made, calls = calls_of(monkeypatch, Books, "__init__"), calls_of(monkeypatch, Books, name)
    if of_batch:
        together([with_value(resolved, "wall.stiffness", 100.0 + i) for i in range(2)])
    else:
        run(resolved)
    monkeypatch.undo()
    (_, *arguments), half = made[0], len(calls) // 2
    one, other, forgetful = (Books(*arguments) for _ in range(3))
    one.start(calls[0][2])
    other.start(calls[0][2])
    for _, *block in calls[:half]:
        getattr(one, name)(*block)
    other.state = through_bytes(one.state)
    for _, *block in calls[half:]:
        for books in (one, other, forgetful):
            getattr(books, name)(*block)
    assert bits(other.state) == bits(one.state) == bits(calls[0][0].state)
    assert "0.true" in one.names
    assert bits(forgetful.state) != bits(one.state)


@pytest.mark.parametrize("grip", [None, Grip(stiffness=500.0, damping=3.0)], ids=["one mass", "a chain"])
def test_books_of_the_members_that_are_kept_have_the_bits_they_have_when_none_is_dropped(
    grip: Grip | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, calls = calls_of(monkeypatch, Books, "__init__"), calls_of(monkeypatch, Books, "book_batch")
    resolved, kept = busy({}), np.array([True, False, False, True, True, False])
    members = []
    for i in range(len(kept)):
        member = with_value(resolved, "hand.grip", grip)
        for key, value in (("device.mass", 0.01 + 0.001 * i), ("hand.force.value", -1.0 - 0.1 * i)):
            member = with_value(member, key, value)
        members.append(with_value(member, "wall.stiffness", 100.0 + i))
    together(members)
    monkeypatch.undo()
    (_, *arguments), half = made[0], len(calls) // 2
    dropped = Books(*arguments)
    dropped.start(calls[0][2])
    for at, (_, tick, plant, commanded) in enumerate(calls):
        if at == half:
            dropped.select(kept)
        if at >= half:
            commands = {"command": plant["command"]}
            plant = tree_select({name: plant[name] for name in plant.keys() - commands.keys()}, kept) | commands
            commanded = tree_select(commanded, kept)
        dropped.book_batch(tick, plant, commanded)
    assert bits(dropped.state) == bits(tree_select(calls[0][0].state, kept))
    assert dropped.state.sums.sums.shape == (len(dropped.names), 3)


@pytest.mark.parametrize("members", [1, 7])
@pytest.mark.parametrize("ticks", [40, 900])
def test_a_window_goes_on_from_a_packed_state_to_the_same_measures(members: int, ticks: int) -> None:
    rng, time = np.random.default_rng(members), Timebase(10_000, 1_000, 0, ticks)
    x = np.cumsum(rng.normal(size=(ticks * 10 + 1, members)), axis=0) * 1e-5
    rows = dict.fromkeys(("x", "total"), x[:-1:10])
    rows |= {"in_contact": 1.0 * (x[:-1:10] < 0.0), "wall_position": np.zeros((ticks, members))}
    half, one, other = ticks // 2, Window(time, 1e-6, members), Window(time, 1e-6, members)

    def add(window: Window, first: int, end: int) -> None:
        window.add(x[first * 10 : end * 10 + 1], x[first * 10 : end * 10], {n: c[first:end] for n, c in rows.items()})

    add(one, 0, half)
    other.state = through_bytes(one.state)
    for window in (one, other):
        add(window, half, ticks)
    assert bits(other.state) == bits(one.state)
    assert list(other.measures(range(members))) == list(one.measures(range(members)))
