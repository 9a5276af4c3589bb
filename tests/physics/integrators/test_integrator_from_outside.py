"""An integrator of another package: one file and one line of an entry point."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

METHOD = '''
from haploop.plant.integrators.linear_rates import LinearRates, Rows, moved
from haploop.plant.integrators.registry import Integrator


class Kutta38:
    """The 3/8 rule (Kutta 1901)."""

    def __init__(self, rates: LinearRates, step_s: float) -> None:
        self._rates, self._h = rates, step_s

    def step(self, z: Rows, begin: Rows, middle: Rows, end: Rows) -> Rows:
        h, third = self._h, [(2.0 * b + e) / 3.0 for b, e in zip(begin, end)]
        two_thirds = [(b + 2.0 * e) / 3.0 for b, e in zip(begin, end)]
        k1 = self._rates.at(z, begin)
        k2 = self._rates.at(moved(z, h / 3.0, k1), third)
        k3 = self._rates.at(moved(moved(z, -h / 3.0, k1), h, k2), two_thirds)
        k4 = self._rates.at(moved(moved(moved(z, h, k1), -h, k2), h, k3), end)
        return moved(z, h, [(a + 3.0 * (b + c) + d) / 8.0 for a, b, c, d in zip(k1, k2, k3, k4)])


KUTTA_3_8 = Integrator("kutta-3-8", "one of the 3/8 rule, order 4", 4, Kutta38, evaluations=4)
'''
SCENE = """
title = "A swing driven by a hand"
duration = 0.1
[device]
mass = 0.1
damping = 0.5
position = 0.01
[hand]
stiffness = 1000.0
[hand.force]
kind = "sine"
amplitude = 2.0
frequency = 10.0
[clock]
integrator = "kutta-3-8"
"""
RUN = """
import json, sys
from haploop.launch.plan.plan import plan
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
planned = plan(load(sys.argv[1]))
found = {"modules": planned.modules["plant"], "does": [step.what for step in planned.plant_step]}
for method in ("kutta-3-8", "dop853"):
    for rate in (1000, 2000):
        scene = load(sys.argv[1], [f"clock.integrator={method}", f"clock.plant_rate={rate}"])
        found[f"{method} {rate}"] = run_in_process(scene, {})["final"]["x_m"]
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict:
    """What a fresh interpreter makes of a scene with the method, with the package on its path."""
    where = tmp_path_factory.mktemp("outside")
    (where / "kutta38.py").write_text(METHOD, encoding="utf-8")
    metadata = where / "kutta38-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: kutta38\nVersion: 1.0\n", encoding="utf-8")
    line = "[haploop.integrators]\nkutta-3-8 = kutta38:KUTTA_3_8\n"
    (metadata / "entry_points.txt").write_text(line, encoding="utf-8")
    (where / "scene.toml").write_text(SCENE, encoding="utf-8")
    path = os.pathsep.join([str(where), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-c", RUN, str(Path(where / "scene.toml"))]
    ran = subprocess.run(
        command, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, check=False, timeout=120
    )
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout.splitlines()[-1])


def test_a_method_of_another_package_moves_the_bodies_with_its_own_order(found: dict) -> None:
    """An error of order 4 falls to a sixteenth with half the step; the load of each rate is that of its own steps."""
    coarse, fine = (abs(found[f"kutta-3-8 {rate}"] - found[f"dop853 {rate}"]) for rate in (1000, 2000))
    assert fine > 1e-13
    assert coarse / fine == pytest.approx(16.0, rel=0.15)


def test_the_plan_names_it(found: dict) -> None:
    assert "kutta38" in found["modules"]
    assert any("3/8 rule" in what for what in found["does"])
