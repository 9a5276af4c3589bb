"""Answers to elements that ask, from an arithmetic of its own; its bits alone, in batches and compiled."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest

from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element, Motion, PluginError, Quantity, load_plugin
from haploop.controller.dissipation.element import ASKABLE
from haploop.launch.spec import RunFailed
from haploop.protocol.scene.scene import ElementTable, EventTable, Scene
from haploop.protocol.ticks import Timebase
from haploop.tools.linear.linearity import why_not_linear
from helpers.runs.batches import alone, diverging, pressed, together, with_element
from helpers.scenes.least import KINDS

T, TICKS = 1e-3, 200


class Hearing(Element):
    """A weak force that depends on all there is to ask for."""

    kind = "hearing"
    asks = ASKABLE
    memory = 0.0
    gain: Annotated[float, Quantity("N s/m", at_least=0)]

    def force(self, motion: Motion, memory: Any) -> tuple[Any, Any]:
        forces = motion.force + motion.force_before + motion.output_before + motion.total_before + motion.acted
        energies = motion.wall_energy + motion.own_energy + motion.output_energy + motion.total_energy
        rest = motion.wall_force + motion.wall_position + 1e-3 * motion.wall_stiffness + motion.device_damping
        heard = forces + 100.0 * (energies + motion.wall_stored) + rest + motion.device_mass
        return -self.gain * motion.way / T * (1.0 + abs(heard)) + 1e-3 * memory, -self.gain * motion.v


class Keeping(Element):
    """Keeps what it is told, and pushes a little against the motion."""

    kind = "keeping"
    asks = ASKABLE

    def __post_init__(self) -> None:
        self.told: list[list[float]] = []

    def force(self, motion: Motion) -> float:
        self.told.append([getattr(motion, name) for name in ASKABLE])
        return -0.3 * motion.v


def scenes(kind: str, values: dict[str, list[float]], events: tuple[EventTable, ...] = ()) -> list[Scene]:
    """Pressed walls with a damper, the element, and a damper that always acts after it."""
    members = len(next(iter(values.values()), [0.0]))
    last = ElementTable(name="damping", acts="always", parameters={"damping": 0.05})
    made = []
    for i in range(members):
        asking = ElementTable(name=kind, parameters={name: each[i] for name, each in values.items()})
        whole = pressed(wall={"position": -0.002, "stiffness": 1200.0 + 10 * i})
        made.append(replace(whole, dissipation=(*whole.dissipation, asking, last), event=events))
    return made


@pytest.mark.parametrize("delay_steps", [0, 7, 10, 23])
def test_an_element_is_told_forces_and_energies_as_the_rows_of_the_run_give_them(delay_steps: int) -> None:
    (scene,) = scenes("keeping", {})
    scene = replace(scene, clock=replace(scene.clock, round_trip_delay=delay_steps * T / 10))
    controller = Controller(scene, Timebase.from_scene(scene), KINDS | {"keeping": Keeping})
    x = -0.003 + 0.002 * np.cos(0.07 * np.arange(TICKS))
    controller.answer([(place,) for place in x.tolist()])
    (block,) = controller.recorder.take()
    row = {name: np.frombuffer(column) for name, column in block["columns"].items()}
    element: Any = controller.params.elements[1].element
    told = dict(zip(ASKABLE, np.array(element.told).T, strict=True))
    way = np.diff(x, prepend=x[0])
    before = row["wall"] + row["dissipation.0"]

    def ago(force: np.ndarray, ticks: int = 1) -> np.ndarray:
        return np.append(np.zeros(ticks), force)[:TICKS]

    def book(force: np.ndarray) -> np.ndarray:
        return np.cumsum(-ago(force) * way)

    whole, late = divmod(delay_steps, 10)
    newer, older = (ago(row["total"], ticks) for ticks in (whole + 1, whole + 2))
    expected = {
        "force": before,
        "wall_force": row["wall"],
        "wall_stored": np.where(row["wall"] != 0.0, 1200.0 / 2 * (x + 0.002) ** 2, 0.0),
        "way": way,
        "force_before": ago(row["dissipation.1"]),
        "output_before": ago(before + row["dissipation.1"]),
        "total_before": ago(row["total"]),
        "acted": (10 - late) / 10 * newer + late / 10 * older,
        "wall_energy": book(row["wall"]),
        "own_energy": book(row["dissipation.1"]),
        "output_energy": book(before + row["dissipation.1"]),
        "total_energy": book(row["total"]),
        "device_mass": np.full(TICKS, scene.device.mass),
        "device_damping": np.full(TICKS, scene.device.damping),
        "wall_position": np.full(TICKS, -0.002),
        "wall_stiffness": np.full(TICKS, 1200.0),
    }
    assert row["in_contact"].any()
    assert not row["in_contact"].all()
    for name in ASKABLE:
        assert told[name] == pytest.approx(expected[name], rel=1e-12, abs=1e-18), name


SWAPPED = (
    EventTable(at=0.03, set={"dissipation.1.gain": 0.02}),
    EventTable(at=0.06, element=0, swap=ElementTable(name="none")),
    EventTable(at=0.09, element=0, swap=ElementTable(name="hearing", parameters={"gain": 0.04})),
)
STABILIZERS = {
    "hearing": {"gain": [0.03, 0.04, 0.05]},
    "passivity-controller": {"damping": [2.0, 5.0, 9.0]},
    "passivity-controller-reset": {"damping": [2.0, 5.0, 9.0]},
    "passivity-controller-reference": {"damping": [2.0, 5.0, 9.0]},
    "adaptive-inertia": {"mass": [0.002, 0.004, 0.008], "damping": [0.1, 0.2, 0.3]},
    "force-bounding": {"share": [0.8, 0.9, 1.0]},
    "force-rate": {"time": [0.0004, 0.0005, 0.0006]},
    "virtual-coupling": {
        "stiffness": [200.0, 300.0, 400.0],
        "damping": [0.01, 0.02, 0.03],
        "mass": [0.01, 0.02, 0.03],
        "world_ticks": [3, 3, 3],
    },
}
KNOWN = KINDS | {"hearing": Hearing}


@pytest.mark.parametrize("kind", STABILIZERS)
def test_members_of_a_batch_have_the_bits_of_each_alone(kind: str) -> None:
    made = scenes(kind, STABILIZERS[kind])
    expected = [alone(each, KNOWN) for each in made]
    assert all(result["energy"]["elements"][1]["sampled_J"] for result in expected)
    assert together(made, KNOWN) == expected


def test_after_swaps_too_and_the_new_one_begins_with_books_of_its_own() -> None:
    made = scenes("hearing", {"gain": [0.03, 0.04]}, SWAPPED)
    assert together(made, KNOWN) == [alone(each, KNOWN) for each in made]


@pytest.mark.slow
@pytest.mark.skipif(not importlib.util.find_spec("jax"), reason="needs jax")
@pytest.mark.parametrize("kinds", [tuple(STABILIZERS)[:4], tuple(STABILIZERS)[4:], "swapped"], ids=str)
def test_they_compile(kinds: tuple[str, ...] | str) -> None:
    """Four in a row, each of which finds something to do; and what is swapped."""
    from haploop.launch.runs.in_jax import compiling
    from helpers.runs.compiled import agree, compiled

    before = compiling()[0]
    made = scenes("hearing", {"gain": [0.03, 0.04]}, SWAPPED)
    if kinds != "swapped":
        rows = zip(*(scenes(kind, STABILIZERS[kind]) for kind in kinds), strict=True)
        made = [replace(row[0], dissipation=tuple(one.dissipation[1] for one in row)) for row in rows]
    for result, exact in zip(compiled(made, KNOWN), [alone(each, KNOWN) for each in made], strict=True):
        del exact["trajectory_sha256"]
        assert kinds == "swapped" or all(element["sampled_J"] for element in exact["energy"]["elements"])
        assert agree(result, exact)
    assert compiling()[0] > before


def test_what_it_is_told_follows_its_members_when_others_are_dropped() -> None:
    hearing = ElementTable(name="hearing", acts="always", parameters={"gain": 0.001})
    made = [replace(one, dissipation=(*one.dissipation, hearing)) for one in diverging()]
    expected = [alone(each, KNOWN) for each in made]
    assert {"diverged", "done"} == {result["ended"] for result in expected}
    assert together(made, KNOWN) == expected


@pytest.mark.parametrize("after_steps", [0, 4, 35])
def test_the_force_that_acted_is_told_by_the_delay_that_was_set(after_steps: int) -> None:
    """From where every command that acts was given after the change on."""
    (scene,) = scenes("keeping", {})
    controller = Controller(scene, Timebase.from_scene(scene), KNOWN | {"keeping": Keeping})
    controller.schedule(50, {"set": {"clock.round_trip_delay": after_steps * T / 10}})
    controller.answer([(place,) for place in (-0.003 + 0.002 * np.cos(0.07 * np.arange(TICKS))).tolist()])
    total = np.concatenate([np.frombuffer(each["columns"]["total"]) for each in controller.recorder.take()])
    element: Any = controller.params.elements[1].element
    acted = np.array(element.told)[:, ASKABLE.index("acted")]
    whole, late = divmod(after_steps, 10)
    ticks = np.arange(60, TICKS)
    expected = (10 - late) / 10 * total[ticks - 1 - whole] + late / 10 * total[ticks - 2 - whole]
    assert acted[ticks] == pytest.approx(expected, rel=1e-12)


def test_what_an_element_does_not_ask_for_it_is_not_told_and_the_error_says_how_to_ask() -> None:
    class Curious(Element):
        """Reads what it did not ask for."""

        kind = "curious"
        asks = ("way",)

        def force(self, motion: Motion) -> Any:
            return -motion.way * motion.wall_force

    with pytest.raises(RunFailed, match=r'its class asks for: asks = \("wall_force",\)'):
        alone(with_element(pressed(), "curious"), KINDS | {"curious": Curious})


def test_a_name_that_nobody_knows_is_refused_with_those_that_are_known(tmp_path: Path) -> None:
    lines = ["from haploop.controller.dissipation import Element", "class Own(Element):", '    kind = "own"']
    plugin = tmp_path / "own.py"
    plugin.write_text("\n".join([*lines, '    asks = ("energy",)', "    def force(self, motion): return 0.0"]))
    with pytest.raises(PluginError, match=r"asks for 'energy', which is not known.*output_energy"):
        load_plugin(plugin)


def test_a_linear_law_of_forces_is_in_no_linear_map_as_that_has_the_walls_force_beside_it() -> None:
    class Lead(KINDS["force-rate"]):
        """Linear in what it is told."""

        linear = True

    scene = with_element(pressed(), "force-rate", time=0.001)
    assert "the element force-rate" in why_not_linear(scene, KINDS | {"force-rate": Lead})
