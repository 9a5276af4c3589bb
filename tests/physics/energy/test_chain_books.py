"""The books of a chain of bodies are exact for motions made another way and close on those of the plant."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from haploop.controller.controller import Controller
from haploop.logger.books.buffers import PIECES
from haploop.logger.books.chain import ChainBooks
from haploop.logger.logger import Logger
from haploop.plant.plant import Plant
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from helpers.runs.captured import run
from helpers.scenes.effect_tables import slowly
from helpers.scenes.least import KINDS, scene
from oracles.chain_by_hand import MOST_N, Made, chain_scene, make

CASES = [
    "friction",
    "friction saturation",
    "bandwidth",
    "grip",
    "cable",
    "cable grip",
    "cable bandwidth saturation",
    "cable grip friction",
    "cable grip bandwidth saturation friction",
]


def books_of(resolved: Scene) -> ChainBooks:
    return ChainBooks(resolved, Timebase.from_scene(resolved))


@cache
def made(case: str) -> tuple[Scene, Made]:
    rng = np.random.default_rng(CASES.index(case))
    resolved = chain_scene(rng, case)
    return resolved, make(resolved, rng)


def booked(case: str) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """What every step adds to each book, and to the true books of those who commanded; shape (steps,) each, J."""
    resolved, motion = made(case)
    books, way = books_of(resolved), np.diff(motion.columns["x"])
    flows = np.stack(list(books.by_step(0, motion.columns, way, motion.commanded)))
    return dict(zip(books.names, flows, strict=True)), -(motion.commanded[0] + motion.commanded[1]) * way


def unexplained(flows: dict[str, np.ndarray], true: np.ndarray, wrong: str = "") -> float:
    """The residual over what moved; with one book of the wrong sign, if named."""
    signs = {name: (1.0 if name == "hand_work" else -1.0) * (-1.0 if name == wrong else 1.0) for name in flows}
    residual = math.fsum([*-true, *(part for name, flow in flows.items() for part in signs[name] * flow)])
    return abs(residual) / (np.abs([*flows.values(), true]).sum() / 2.0)


# Motions made by hand


@pytest.mark.parametrize("case", [*[*CASES][::2], *slowly([*CASES][1::2])])
def test_every_heat_and_work_of_every_step_is_its_integral_along_a_motion_made_another_way(case):
    flows, _ = booked(case)
    energies = made(case)[1].energies
    assert energies.keys() == flows.keys() - {"kinetic", "spring"}
    for name, expected in energies.items():
        assert flows[name] == pytest.approx(expected, rel=0, abs=1e-12 * np.abs(expected).max()), name


@pytest.mark.parametrize("case", [*[*CASES][::2], *slowly([*CASES][1::2])])
def test_the_books_close_on_it_and_with_one_of_the_wrong_sign_they_do_not(case):
    flows, true = booked(case)
    assert unexplained(flows, true) < 1e-13
    assert unexplained(flows, -true) > 1e-3
    for name in flows:
        assert unexplained(flows, true, wrong=name) > 1e-6, name


def test_the_motions_made_by_hand_hold_pieces_of_all_sorts():
    _, motion = made("cable grip bandwidth saturation friction")
    columns = motion.columns
    assert set(columns["pieces.level"]) >= {1.0, 2.0, 3.0}
    assert set(columns["pieces.stuck"]) == set(columns["stuck"]) == {0.0, 1.0}
    assert np.count_nonzero(columns["pieces.snap_J"]) > 5
    assert np.count_nonzero(np.abs(columns["force"]) == MOST_N) > 5


def test_energy_that_friction_took_in_stopping_a_body_is_missed_without_its_book():
    resolved, motion = made("cable grip friction")
    books, forgetful = books_of(resolved), motion.columns | {"pieces.snap_J": 0.0 * motion.columns["pieces.snap_J"]}
    flows = np.stack(list(books.by_step(0, forgetful, np.diff(motion.columns["x"]), motion.commanded)))
    _, true = booked("cable grip friction")
    assert unexplained(dict(zip(books.names, flows, strict=True)), true) > 1e-3


def block_of(columns: dict[str, np.ndarray], first: int, end: int) -> dict[str, np.ndarray]:
    """The telemetry of some steps."""
    of_piece = columns.get(f"{PIECES}step", np.zeros(0))
    inside, rows = (of_piece >= first) & (of_piece < end), slice(first, end + 1)
    return {name: column[inside if name.startswith(PIECES) else rows] for name, column in columns.items()}


@pytest.mark.parametrize("case", CASES)
def test_blocks_of_any_size_add_the_same_bits(case):
    resolved, motion = made(case)
    flows, _ = booked(case)
    books, way = books_of(resolved), np.diff(motion.columns["x"])
    parts = []
    for first, end in pairwise([0, 1, 2, 7, 8, 30, 59, len(way)]):
        commanded = [force[first:end] for force in motion.commanded]
        parts.append(
            np.stack(list(books.by_step(first, block_of(motion.columns, first, end), way[first:end], commanded)))
        )
    assert np.array_equal(np.concatenate(parts, axis=1), np.stack(list(flows.values())))


# Motions of the plant

MOTION = {"velocity": -0.3, "mass": 0.05, "damping": 0.1}
HAND = {"mass": 0.1, "damping": 0.5, "stiffness": 50.0, "force": {"kind": "sine", "amplitude": 1.0, "frequency": 7.0}}
GRIP = HAND | {"grip": {"stiffness": 500.0, "damping": 3.0}}
CABLE = {"motor_mass": 0.03, "stiffness": 2e4, "damping": 0.5, "motor_damping": 0.1}
RUBBING = {"kinetic": 0.1, "breakaway": 0.15, "stribeck_velocity": 0.01}
LATE = {"jitter": {"kind": "uniform", "most": 0.002}, "loss": {"probability": 0.9}}
LIMITED = {"bandwidth": 100.0, "saturation": 0.5, "resolution": 0.01}
SCENES: dict[str, dict[str, Any]] = {
    "saturation alone": {"hand": HAND, "actuator": {"saturation": 0.5, "resolution": 0.01}},
    "bandwidth": {"hand": HAND, "actuator": LIMITED},
    "cable": {"hand": HAND, "transmission": CABLE},
    "stiff cable, light motor": {"hand": HAND, "transmission": CABLE | {"motor_mass": 1e-3, "stiffness": 1e7}},
    "grip": {"hand": GRIP},
    "friction": {"hand": HAND, "friction": RUBBING},
    "late and lost": {"hand": HAND, **LATE},
    "everything": {"hand": GRIP, "transmission": CABLE, "friction": RUBBING, "actuator": LIMITED, **LATE},
    "at rest under load": {
        "device": MOTION | {"velocity": 0.0, "position": 0.5},
        "hand": GRIP | {"rest": 0.5, "stiffness": 1e4},
        "transmission": CABLE,
    },
}


def resolved_of(name: str) -> Scene:
    tables = {"device": MOTION, "wall": {"position": -1e-3, "stiffness": 300.0}, "duration": 0.3} | SCENES[name]
    return scene(**tables, dissipation=[{"kind": "damping", "damping": 0.5}], clock={"round_trip_delay": 0.0007})


@pytest.mark.parametrize("name", SCENES)
def test_the_books_of_the_plant_close_to_1e_12(name):
    ran = run(resolved_of(name))
    assert ran.energy["moved_J"] > 0
    assert ran.relative_residual < 1e-12
    heats = [value for key, value in ran.energy.items() if key.endswith("_heat_J")]
    assert len(heats) >= 2
    assert min(heats) >= 0.0
    assert ("actuator_J" in ran.energy) == (resolved_of(name).actuator is not None)


def test_what_the_actuator_cannot_give_is_booked_as_what_the_elements_asked_for_less_what_it_gave():
    """From the records: the commanded total at the tick in effect, the force held, the way."""
    ran = run(resolved_of("saturation alone"))
    plant, command = ran.plant, ran.plant["command"][:-1].astype(int)
    asked = np.where(command >= 0, ran.controller["total"][command], 0.0)
    expected = math.fsum((asked - plant["force"][:-1]) * np.diff(plant["x"]))
    assert np.abs(plant["force"]).max() == 0.5 < np.abs(asked).max()
    assert ran.energy["actuator_J"] == pytest.approx(expected, rel=1e-9)
    assert abs(expected) > 1e-3 * ran.energy["moved_J"]


@pytest.mark.parametrize("name", ["friction", *slowly(["everything"])])
def test_friction_never_gives_heat_back_in_any_step(name):
    resolved = resolved_of(name)
    plant, books = run(resolved).plant, books_of(resolved)
    way = np.diff(plant["x"]) + np.diff(plant["x_low"])
    heat = list(books.by_step(0, plant, way, [plant["force"][:-1]]))[books.names.index("friction_heat")]
    assert len(plant["pieces.step"]) > 10
    assert heat.min() > -1e-15 * heat.max()


@pytest.mark.parametrize("name", ["late and lost", "cable", pytest.param("everything", marks=pytest.mark.slow)])
def test_a_logger_that_joins_begins_where_it_knows_every_command_and_its_books_close(name):
    """Where nine of ten commands are lost, the one in effect is often older than what the controller hands over."""
    resolved = replace(resolved_of(name), duration=0.2)
    time = Timebase.from_scene(resolved)
    plant, controller = Plant(resolved, time), Controller(resolved, time, KINDS)
    joining: list[Logger] = []
    waited = []
    for until in range(10, time.ticks + 1, 10):
        plant.run_until(until, lambda _, samples: [float(force) for force in controller.answer(samples)])
        first, ticks, columns = plant.take_block()
        blocks = controller.recorder.take()
        for logger in joining:
            logger.plant_block({"from_tick": first, "ticks": ticks, "columns": columns})
            for block in blocks:
                logger.controller_block(block)
        joining.append(Logger(resolved, time, None))
        joining[-1].start(plant.state(), controller.recorder.history)
    for at, logger in enumerate(joining[:-2], start=1):
        summary = logger.summary("", None, None, 0)
        waited.append(summary["from_tick"] - 10 * at)
        assert summary["energy"]["residual_J"] < 1e-12 * summary["energy"]["moved_J"], at
    assert min(waited) == 0
    assert (max(waited) > 0) == (resolved.loss is not None)
