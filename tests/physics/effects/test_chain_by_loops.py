"""Chains that nothing rubs have the same bits by a loop of machine code as by NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from haploop.plant.chain import motion
from haploop.protocol.scene.scene import Scene
from helpers.runs.batches import alone
from helpers.scenes.effect_tables import subsets, tap

pytestmark = pytest.mark.slow
EFFECTS = ("transmission", "grip", "bandwidth", "jitter", "loss")


@pytest.fixture
def loops() -> Any:
    """The loop, which must work where numba is there."""
    pytest.importorskip("numba")
    found = motion.LOOPS.module()
    assert found is not None
    return found


def by(pays: float, monkeypatch: pytest.MonkeyPatch, scene: Scene) -> Any:
    monkeypatch.setattr(motion.LOOPS, "pays", pays)
    return alone(scene)


@pytest.mark.parametrize("effects", [*subsets(1, 2, EFFECTS), (*EFFECTS, "accelerometer")], ids="+".join)
def test_a_run_by_the_loop_has_every_bit_of_the_run_without(
    effects: tuple[str, ...], loops: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = tap(effects)
    assert by(0, monkeypatch, scene) == by(np.inf, monkeypatch, scene)


def test_a_transition_that_is_off_by_its_last_bit_is_seen(loops: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, follow = tap(("transmission",)), loops.follow
    expected = by(np.inf, monkeypatch, scene)
    monkeypatch.setattr(loops, "follow", lambda held, *of: follow(np.nextafter(held, 1.0), *of))
    assert by(0, monkeypatch, scene) != expected
