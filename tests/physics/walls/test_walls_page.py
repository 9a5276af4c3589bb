"""The page on walls: its table of taps and its wall of one's own, from the text as it stands."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import scipy

from haploop.protocol.walls.registry import WALLS
from helpers.runs.batches import alone
from helpers.scenes.least import scene
from oracles.wall_laws import leaving_speed

PAGE = (Path(__file__).parents[3] / "docs/walls.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `([\w-]+)`(.*?) \| (0\.\d+) \| (-?\d+) \| (\d+) \| (-?\d+) \|$", PAGE, re.MULTILINE)
KEYS = {"N s/m": "damping", "s/m": "damping_factor", "N every": "ridge_force", "mm": "ridge_spacing"}


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0] + row[1])
def test_a_tap_ends_as_the_table_says(row: tuple[str, ...]) -> None:
    kind, words, leaves, *energies = row
    found = re.findall(r"([\d.]+) (N s/m|s/m|N every|mm)", words)
    own = {KEYS[unit]: float(number) * (1e-3 if unit == "mm" else 1.0) for number, unit in found}
    device = {"mass": 0.05, "damping": 0.0, "position": 0.002, "velocity": -0.2}
    table: dict[str, Any] = {"kind": kind, "position": 0.0, "stiffness": 2000.0, **own}
    summary = alone(scene(duration=0.12, device=device, wall=table))
    of_wall = summary["energy"]["wall"]
    told = [of_wall["true_J"], of_wall.get("dissipated_J", 0.0), of_wall["leak"]["total_J"]]
    assert f"{summary['final']['v_m_s']:.3f}" == leaves
    assert [f"{1e6 * one:.0f}".replace("-0", "0") for one in told] == energies


def test_the_table_has_all_walls_and_the_speed_that_it_says_is_that_of_continuous_time() -> None:
    assert {row[0] for row in ROWS} == set(WALLS)
    assert f"at {leaving_speed(0.2, 1.5):.3f} m/s" in PAGE
    assert all(f"\n| `{kind}` | " in PAGE for kind in WALLS)


def test_the_pages_own_wall_is_one_whose_potential_is_that_of_its_force() -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    found: dict[str, Any] = {}
    exec(compile(code, "walls.md", "exec", dont_inherit=True), found)
    wall = found["Bumper"](0.0, 500.0, -1.0, 0.004)
    assert wall.stored(0.003) == pytest.approx(scipy.integrate.quad(wall.held, 0.0, 0.003)[0], rel=1e-12)
    assert wall.contact(-0.003, 0.0) == (True, pytest.approx(500.0 * 0.003 * (1 + 0.75**2)))
    assert wall.values() == {"position": 0.0, "stiffness": 500.0, "hardens_at": 0.004}
