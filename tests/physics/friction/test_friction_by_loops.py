"""Friction moved and booked by loops of machine code has the bits of Python and NumPy, alone and in a batch."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from haploop.logger.books import segments
from haploop.plant.friction import motion
from haploop.protocol.scene.effects import Friction
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import Scene
from helpers.runs.batches import alone, together, with_stiffness
from helpers.scenes.effect_tables import creeping, tap

pytestmark = pytest.mark.slow
STRIBECK = {"kinetic": 0.03, "breakaway": 0.05, "stribeck_velocity": 0.01}
SCENES: dict[str, dict[str, Any]] = {
    "one mass": {},
    "as many states as there can be": {"also": ("transmission", "grip", "bandwidth", "accelerometer")},
    "a cable and a grip": {"also": ("transmission", "grip")},
    "breakaway": {"friction": {"kinetic": 0.03, "breakaway": 0.06}},
    "Stribeck": {"friction": STRIBECK, "also": ("transmission", "bandwidth")},
    "steps cut into parts": {"also": ("transmission",), "stiffness_N_m": 2e6},
    "a creep to rest": {"scene": creeping()},
    "jitter": {"also": ("transmission", "grip", "jitter", "loss")},
}


@pytest.fixture
def loops(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The loops, which must work where numba is there."""
    pytest.importorskip("numba")
    found = motion.LOOPS.module()
    assert found is not None
    assert segments.LOOPS.module() is not None
    return found


def scene_of(name: str) -> Scene:
    of = SCENES[name]
    if "scene" in of:
        return of["scene"]
    tables = {"friction": of["friction"]} if "friction" in of else {}
    scene = tap(("friction", *of.get("also", ())), duration=0.12, **tables)
    return with_value(scene, "transmission.stiffness", of["stiffness_N_m"]) if "stiffness_N_m" in of else scene


def by(pays: float, monkeypatch: pytest.MonkeyPatch, scenes: list[Scene], *, batch: bool = False) -> list[Any]:
    for loops in (motion.LOOPS, segments.LOOPS):
        monkeypatch.setattr(loops, "pays", pays)
    return together(scenes) if batch else [alone(scene) for scene in scenes]


@pytest.mark.parametrize("name", SCENES)
def test_a_run_by_loops_has_every_bit_of_the_run_without(name: str, loops: Any, monkeypatch: pytest.MonkeyPatch):
    scene = [scene_of(name)]
    assert by(0, monkeypatch, scene) == by(np.inf, monkeypatch, scene)


@pytest.mark.parametrize("room", [None, 40, 1])
def test_so_has_a_batch_whatever_room_there_is_for_the_pieces(
    room: int | None, loops: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    base = scene_of("a cable and a grip")
    scenes = [
        replace(with_stiffness(base, k), seed=i, friction=Friction(kinetic=0.04 - 0.01 * i, breakaway=0.05 + 0.01 * i))
        for i, k in enumerate((60.0, 700.0, 2900.0))
    ]
    expected = by(np.inf, monkeypatch, scenes)
    assert all(result["energy"]["friction_heat_J"] > 1e-5 for result in expected)
    if room:
        monkeypatch.setattr(loops.loops, "_PIECES", room)
    assert by(0, monkeypatch, scenes, batch=True) == expected
    assert by(0, monkeypatch, scenes) == expected


@pytest.mark.parametrize("room", [None, 40])
def test_so_has_a_batch_of_several_devices(room: int | None, loops: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    base = scene_of("as many states as there can be")
    scenes = [
        with_stiffness(with_value(base, "device.mass", mass_kg), k)
        for mass_kg, k in ((0.05, 60.0), (0.08, 700.0), (0.05, 2900.0), (0.03, 700.0))
    ]
    expected = by(np.inf, monkeypatch, scenes)
    if room:
        monkeypatch.setattr(loops.loops, "_PIECES", room)
    assert by(0, monkeypatch, scenes, batch=True) == expected


def test_so_have_batches_that_creep_to_rest(loops: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    scenes = [replace(creeping(), friction=Friction(kinetic=kinetic)) for kinetic in (0.043, 0.03)]
    expected = by(np.inf, monkeypatch, scenes)
    assert by(np.inf, monkeypatch, scenes, batch=True) == expected
    assert by(0, monkeypatch, scenes, batch=True) == expected


def test_a_step_that_there_is_no_room_for_is_never_taken_for_done(loops: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last place for a piece may be taken by the first of a step that has more."""
    scene = [scene_of("steps cut into parts")]
    expected = by(np.inf, monkeypatch, scene)
    for room in range(2, 34):
        monkeypatch.setattr(loops.loops, "_PIECES", room)
        assert by(0, monkeypatch, scene) == expected, room


def test_a_rate_in_the_books_that_is_off_by_its_last_bit_is_seen(loops: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, books = [scene_of("a cable and a grip")], segments.LOOPS.module()
    expected, made = by(np.inf, monkeypatch, scene), books.books_by_tick
    off = lambda device: [*device[:3], np.nextafter(device[3], 1.0), *device[4:]]  # noqa: E731
    monkeypatch.setattr(books, "books_by_tick", lambda device, *of: made(off(device), *of))
    assert by(0, monkeypatch, scene) != expected


def test_a_transition_that_is_off_by_its_last_bit_is_seen(loops: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, made = [scene_of("one mass")], loops.Loops
    expected = by(np.inf, monkeypatch, scene)
    monkeypatch.setattr(loops, "Loops", lambda *of: made(*of[:3], np.nextafter(of[3], 1.0), of[4]))
    assert by(0, monkeypatch, scene) != expected
