"""The table of solvers of other programs: its numbers are those of the runs, and what is not there is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from haploop.tools.cost.solvers import SOLVERS, Measured, Solver, measure, section
from helpers.runs.captured import run
from helpers.scenes.least import scene
from oracles.own_plant import OnePart

ORACLES = Path(__file__).parents[1] / "oracles"
THROWN = """
duration = 0.2
clock = { plant_rate = 1000 }
device = { mass = 0.02, damping = 0.0, velocity = -0.2 }
wall = { position = -0.002, stiffness = 300.0 }
"""
TABLES = {
    "duration": 0.2,
    "clock": {"plant_rate": 1000},
    "device": {"mass": 0.02, "damping": 0.0, "velocity": -0.2},
    "wall": {"position": -0.002, "stiffness": 300.0},
}


def around(method: str) -> np.ndarray:
    """Positions of a plant of that method before the wall, whose spring acts at every tick and step alike."""
    plant, wall = OnePart(scene(**TABLES).as_dict(), 1e-3, method), (-0.002, 300.0)
    x = [plant.x]
    for _ in range(200):
        x.append(plant.step(max(0.0, wall[1] * (wall[0] - x[-1])))[0])
    return np.array(x)


def test_a_solver_is_measured_by_its_distance_from_the_exact_flow_and_by_the_books(tmp_path: Path):
    file = tmp_path / "thrown.toml"
    file.write_text(THROWN, encoding="utf-8")
    solvers = [Solver(name, "json", f"own_plant.py {name}") for name in ("exact", "euler")]
    exact, euler = measure(file, solvers, ORACLES, tmp_path)
    far = np.abs(around("euler") - run(scene(**TABLES)).plant["x"]).max()
    assert exact.farthest_m is not None
    assert exact.farthest_m < 1e-12
    assert exact.words == ""
    assert euler.farthest_m == pytest.approx(far, rel=1e-9)
    assert euler.words.startswith("This plant invents ")


def test_what_is_not_installed_or_not_there_is_told_and_left_out(tmp_path: Path):
    absent = Solver("one", "no_such_module", "one.py")
    fileless = Solver("two", "json", "two.py", file="two.fmu")
    broken = Solver("three", "json", "three.py")
    file = tmp_path / "thrown.toml"
    file.write_text(THROWN, encoding="utf-8")
    one, two, three = measure(file, [absent, fileless, broken], tmp_path, tmp_path)
    assert one == Measured("one", words="not measured: no_such_module is not installed")
    assert two == Measured("two", words="not measured: there was no two.fmu")
    assert three.words.startswith("not measured: The plant (")
    assert "| two | – | – | not measured: there was no two.fmu |" in section([one, two])[1]


def test_the_page_tells_what_each_solver_makes_of_the_energy_and_has_no_table_of_nothing():
    rows = [
        Measured("good", "1.2", 1.1e-9, 1.75e-8),
        Measured("bad", "", 165e-6, 1.6e-3, "This plant invents 0.16 % of the energy"),
    ]
    title, table, about = section(rows)
    assert title == "## Solvers of other programs, judged by the books"
    assert "| good (1.2) | 1.1 nm | 1.8e-08 | nothing, being below a thousandth |" in table
    assert "| bad | 165 µm | 1.6e-03 | This plant invents 0.16 % of the energy |" in table
    assert "examples/" in about
    assert section([]) == []


def test_every_solver_of_the_table_is_an_example_that_is_there():
    examples = Path(__file__).parents[2] / "examples"
    named = {solver.command.split(" ", 1)[0] for solver in SOLVERS}
    assert named - {path.name for path in examples.iterdir()} <= {"fmu_plant.py"}
