"""The state of a controller is a tree of numbers: packed at any tick and unpacked elsewhere, it goes on to the bit."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import msgpack
import numpy as np
import pytest

from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element, Motion, Quantity, where
from haploop.controller.tick import initial_state, tick
from haploop.protocol.scene.scene import accelerometer_is_used
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_leaves, tree_map, tree_unflatten
from helpers.runs.estimates import COUNT, ENCODER, FUSED, KALMAN
from helpers.scenes.least import KINDS, typed

TIME = Timebase(plant_rate=10_000, control_rate=1_000, delay_steps=0, ticks=1000)
TABLES: dict[str, dict[str, Any]] = {
    "difference": {},
    "low-passed": {"velocity": {"cutoff": 80.0}, "acceleration": {"source": "encoder", "cutoff": 50.0}},
    "accelerometer": {"acceleration": {"source": "accelerometer", "cutoff": 50.0}},
    "window": {"velocity": {"estimator": "window", "ticks": 6}, "acceleration": {"estimator": "window", "ticks": 3}},
    "foaw": {"velocity": {"estimator": "foaw", "ticks": 9}},
    "best": {"velocity": {"estimator": "foaw", "ticks": 9, "fit": "best"}},
    "kalman": {"velocity": KALMAN | {"cutoff": 300.0}, "acceleration": {"source": "kalman"}},
    "fused": {"velocity": FUSED, "acceleration": {"source": "kalman", "cutoff": 100.0}},
}


class Stuck(NamedTuple):
    """Where a bristle stands, and how often it has slipped."""

    x: Any
    slips: Any


class Bristle(Element):
    """A spring that slips beyond a stretch (Dahl)."""

    kind = "bristle"
    memory = Stuck(0.0, 0)
    stiffness: Annotated[float, Quantity("N/m", at_least=0)]

    def force(self, motion: Motion, memory: Stuck) -> tuple[Any, Stuck]:
        stretch = motion.x - memory.x
        slips = abs(stretch) > 3.0 * COUNT
        return -self.stiffness * stretch, Stuck(where(slips, motion.x, memory.x), memory.slips + slips)


SCENE = {
    "wall": {"position": 0.0, "stiffness": 100.0, "occupies": "below"},
    "encoder": ENCODER,
    "dissipation": [
        {"kind": "bristle", "stiffness": 30.0, "acts": "always"},
        {"kind": "unidirectional-inertia", "mass": 0.01},
    ],
}


def samples() -> list[tuple[float, ...]]:
    rng = np.random.default_rng(4)
    x = COUNT * np.cumsum(rng.integers(-3, 4, 120))
    return list(zip(x.tolist(), rng.normal(0.0, 2.0, 120).tolist(), strict=True))


@pytest.mark.parametrize("tables", TABLES.values(), ids=TABLES)
@pytest.mark.parametrize("at", [2, 5, 40])
def test_a_controller_goes_on_from_a_packed_state_to_the_same_bits(tables: dict[str, Any], at: int) -> None:
    scene, kinds = {**SCENE, **tables}, KINDS | {"bristle": Bristle}
    whole = [sample[: 1 + accelerometer_is_used(typed(**tables))] for sample in samples()]
    controller, other = Controller(typed(**scene), TIME, kinds), Controller(typed(**scene), TIME, kinds)
    controller.answer(whole[:at])
    packed = msgpack.packb(tree_leaves(controller.state))
    other.state = tree_unflatten(initial_state(other.params, whole[0]), msgpack.unpackb(packed))
    other.tick = at
    rest = controller.answer(whole[at:])
    assert other.answer(whole[at:]) == rest
    assert tree_leaves(other.state)[-1] > 0
    if at == 40:
        forgetful = Controller(typed(**scene), TIME, kinds)
        assert forgetful.answer(whole[at:]) != rest


@pytest.mark.parametrize("tables", TABLES.values(), ids=TABLES)
def test_a_tick_changes_neither_its_state_nor_the_structure_of_the_next(tables: dict[str, Any]) -> None:
    scene, kinds = {**SCENE, **tables}, KINDS | {"bristle": Bristle}
    params = Controller(typed(**scene), TIME, kinds).params
    state: Any = initial_state(params, samples()[0])
    for sample in samples()[:30]:
        before = repr(state)
        after, row = tick(params, state, sample)
        assert repr(state) == before
        assert repr(tick(params, state, sample)) == repr((after, row))
        tree_map(lambda old, new: None, tuple(state), after)
        state = after


def test_a_swap_gives_a_new_element_a_fresh_memory_and_a_set_leaves_it_as_it_is() -> None:
    scene, kinds = {**SCENE, "dissipation": SCENE["dissipation"][:1]}, KINDS | {"bristle": Bristle}
    table = {"kind": "bristle", "stiffness": 30.0, "acts": "always"}
    events = {"set": {"set": {"dissipation.0.stiffness": 30.0}}, "swap": {"swap": table, "element": 0}}
    found: dict[str, Any] = {}
    for name, event in {"none": {}, **events}.items():
        controller = Controller(typed(**scene), TIME, kinds)
        if event:
            controller.schedule(50, event)
        found[name] = controller.answer(samples())
        assert not controller.recorder.refused
    assert found["set"] == found["none"]
    assert found["swap"][:50] == found["none"][:50]
    assert found["swap"][50] != found["none"][50]
