"""Elements that remember: a declared memory works in batches and compiled; attributes of their own work alone."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from typing import Annotated, Any, ClassVar

import numpy as np
import pytest

from haploop.controller import active_elements
from haploop.controller.dissipation import Element, ElementError, Motion, Quantity
from haploop.launch.runs.in_batch import run_batch
from haploop.protocol.scene.scene import ElementTable, EventTable, Scene
from helpers.runs.batches import alone, diverging, pressed, together, with_element
from helpers.scenes.least import KINDS


class Fading(Element):
    """Damping that fades with the way gone, which it remembers."""

    kind = "fading"
    memory = 0.0
    damping: Annotated[float, Quantity("N s/m", at_least=0)]

    def force(self, motion: Motion, memory: Any) -> tuple[Any, Any]:
        way = memory + abs(motion.v) * motion.period_s
        return -self.damping / (1.0 + 300.0 * way) * motion.v, way


class Hoarding(Element):
    """The same with the way in an attribute."""

    kind = "fading"
    damping: Annotated[float, Quantity("N s/m", at_least=0)]

    def __post_init__(self) -> None:
        self.way = 0.0

    def force(self, motion: Motion) -> Any:
        self.way = self.way + float(np.sum(abs(motion.v))) * motion.period_s
        return -self.damping / (1.0 + 300.0 * self.way) * motion.v


class Late(Hoarding):
    """The same with an attribute that is not there at first."""

    def __post_init__(self) -> None:
        """Nothing yet."""

    def force(self, motion: Motion) -> Any:
        self.way = getattr(self, "way", 0.0)
        return super().force(motion)


class Shared(Element):
    """One with a list that the class holds."""

    kind = "fading"
    damping: Annotated[float, Quantity("N s/m", at_least=0)]
    ways: ClassVar[list[float]] = []

    def force(self, motion: Motion) -> Any:
        return -self.damping * motion.v


def scenes() -> list[Scene]:
    return [with_element(pressed(), "fading", damping=0.2 + 0.05 * i) for i in range(4)]


def with_events() -> list[Scene]:
    swap = ElementTable(name="fading", parameters={"damping": 0.25})
    events = EventTable(at=0.04, set={"dissipation.0.damping": 0.3}), EventTable(at=0.08, element=0, swap=swap)
    return [replace(one, event=events) for one in scenes()]


@pytest.mark.parametrize("made", [scenes(), with_events()], ids=["as it is", "set and swapped"])
def test_a_declared_memory_has_the_bits_alone_and_in_a_batch(made: list[Scene]) -> None:
    kinds = KINDS | {"fading": Fading}
    expected = [alone(each, kinds) for each in made]
    assert together(made, kinds) == expected
    forgetful = KINDS | {"fading": type("Forgetful", (Fading,), {"force": lambda *of: (Fading.force(*of)[0], 0.0)})}
    assert together(made, forgetful) != expected


def test_a_declared_memory_follows_its_members_when_others_are_dropped() -> None:
    fading = ElementTable(name="fading", acts="always", parameters={"damping": 0.1})
    made = [replace(one, dissipation=(*one.dissipation, fading)) for one in diverging()]
    kinds = KINDS | {"fading": Fading}
    expected = [alone(each, kinds) for each in made]
    assert {"diverged", "done"} == {result["ended"] for result in expected}
    assert together(made, kinds) == expected


@pytest.mark.slow
@pytest.mark.skipif(not importlib.util.find_spec("jax"), reason="needs jax")
@pytest.mark.parametrize("made", [scenes(), with_events()], ids=["as it is", "set and swapped"])
def test_a_declared_memory_compiles(made: list[Scene]) -> None:
    from haploop.launch.runs.in_jax import compiling
    from helpers.runs.compiled import agree, compiled

    before, kinds = compiling()[0], KINDS | {"fading": Fading}
    for result, exact in zip(compiled(made, kinds), [alone(each, kinds) for each in made], strict=True):
        del exact["trajectory_sha256"]
        assert agree(result, exact)
    assert compiling()[0] > before


@pytest.mark.parametrize("element", [Hoarding, Late])
def test_attributes_of_its_own_make_a_batch_run_one_by_one_and_nothing_else_would_do(
    element: type[Element], monkeypatch: pytest.MonkeyPatch
) -> None:
    kinds = KINDS | {"fading": element}
    expected = [alone(each, kinds) for each in scenes()]
    assert run_batch(scenes(), kinds, trajectories=True, fewest=1) == expected
    with pytest.raises(ElementError, match="attributes of its own"):
        together(scenes(), kinds)
    monkeypatch.setattr(active_elements, "keeps_attributes", lambda _: False)
    monkeypatch.setattr(active_elements.Unchanged, "check", lambda _: None)
    assert run_batch(scenes(), kinds, trajectories=True, fewest=1) != expected


def test_a_container_of_the_class_is_such_an_attribute() -> None:
    with pytest.raises(ElementError, match="attributes of its own"):
        together(scenes(), KINDS | {"fading": Shared})
