"""Any FMU as a plant, by examples/fmu_plant.py: moved by its own solver or ours, and judged by the books."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import haploop.logger
from haploop.launch.foreign import read_programs
from haploop.launch.runs.start import prepare, run
from haploop.launch.spec import RunFailed
from haploop.tools.fmu.package import host_platform
from helpers.runs.fmus import compiler, needs_fmus

HOUSE = Path(__file__).parents[2]
SCENE = """
duration = 0.5
[device]
mass = 0.05
damping = 0.3
velocity = -0.05
[hand]
mass = 0.03
damping = 0.4
[hand.force]
kind = "sine"
amplitude = -0.3
frequency = 3
[wall]
position = -0.001
stiffness = 200
[run]
verdict = "window"
"""
NAMES = ["T", "PUSH", "PLACE", "SPEED", "PLACE_RATE", "SPEED_RATE", "MASS", "DAMPING"]
VARIABLE = '<Float64 name="{name}" valueReference="{at}" {rest}/>'
ROLES = {
    "T": 'causality="independent" variability="continuous"',
    "PUSH": 'causality="input" start="0"',
    "PLACE": 'causality="output" initial="exact" start="0"',
    "SPEED": 'causality="output" initial="exact" start="0"',
    "PLACE_RATE": 'causality="local" derivative="2"',
    "SPEED_RATE": 'causality="local" derivative="3"',
    "MASS": 'causality="parameter" variability="fixed" start="1"',
    "DAMPING": 'causality="parameter" variability="fixed" start="0"',
}
DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="mass" instantiationToken="one">
<ModelExchange modelIdentifier="mass"/><CoSimulation modelIdentifier="mass"/>
<ModelVariables>{variables}</ModelVariables>
<ModelStructure><Output valueReference="2"/><Output valueReference="3"/>
<ContinuousStateDerivative valueReference="4"/><ContinuousStateDerivative valueReference="5"/>
<InitialUnknown valueReference="4"/><InitialUnknown valueReference="5"/></ModelStructure>
</fmiModelDescription>
"""
NAMED = ("--force", "PUSH", "--position", "PLACE", "--velocity", "SPEED")
AS_THE_SCENE = ("--set", "MASS=0.08", "--set", "DAMPING=0.7", "--set", "SPEED=-0.05")


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A mass with damping, compiled here."""
    needs_fmus()
    import fmpy

    folder, headers = tmp_path_factory.mktemp("mass"), Path(str(fmpy.__file__)).parent / "c-code"
    source = (HOUSE / "tests/helpers/outside/mass.c").read_text(encoding="utf-8")
    declared = re.findall(r"fmi3\w+TYPE\s+(fmi3\w+);", (headers / "fmi3Functions.h").read_text(encoding="utf-8"))
    lacking = [name for name in declared if f" {name}(" not in source]
    (folder / "stubs.c").write_text("".join(f"int {name}(void) {{ return 3; }}\n" for name in lacking))
    (folder / "mass.c").write_text(source, encoding="utf-8")
    machine, suffix = host_platform()
    flags = ["-O2", "-fPIC", "-shared", f"-I{headers}", "-o", f"mass{suffix}"]
    subprocess.run([compiler(), *flags, "mass.c", "stubs.c"], cwd=folder, check=True)
    variables = "".join(VARIABLE.format(name=name, at=at, rest=ROLES[name]) for at, name in enumerate(NAMES))
    with zipfile.ZipFile(folder / "mass.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION.format(variables=variables))
        archive.write(folder / f"mass{suffix}", f"binaries/{machine}/mass{suffix}")
    return folder / "mass.fmu"


def ran(out: Path, *words: str | Path, **options: Any) -> tuple[dict[str, Any], np.ndarray]:
    """Returns the summary of a run whose plant is an FMU, and its positions."""
    scene = out.parent / "scene.toml"
    scene.write_text(SCENE, encoding="utf-8")
    if words:
        command = [sys.executable, str(HOUSE / "examples/fmu_plant.py"), *map(str, words)]
        options["programs"] = read_programs([f"plant={shlex.join(command)}"], [])
    summary: Any = run(prepare(scene, (), (), out=out), **options)
    return summary, haploop.logger.read(out)["/plant"]["x"]


def residual(summary: dict[str, Any]) -> float:
    return abs(summary["energy"]["residual_J"]) / summary["energy"]["moved_J"]


@pytest.mark.slow
def test_an_fmu_moves_as_the_scene_s_device_and_the_books_tell_one_solver_and_one_mass_from_another(
    fmu: Path, tmp_path: Path
) -> None:
    _, own = ran(tmp_path / "own", in_process=True)
    exact, x = ran(tmp_path / "me", fmu, *NAMED, *AS_THE_SCENE, "--interface", "me")
    assert np.abs(x - own).max() < 1e-10
    assert residual(exact) < 1e-9
    euler, x = ran(tmp_path / "cs", fmu, *NAMED, *AS_THE_SCENE)
    assert 1e-7 < np.abs(x - own).max() < 1e-4
    assert 1e-6 < residual(euler) < 1e-2
    heavier, x = ran(tmp_path / "heavier", fmu, *NAMED, *AS_THE_SCENE, "--set", "MASS=0.1", "--interface", "me")
    assert np.abs(x - own).max() > 1e-4
    assert residual(heavier) > 1e-2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--position", "PLACE[2]", "--force", "PUSH"), "PLACE has 1 elements, counted from 1"),
        (("--position", "place", "--force", "PUSH"), "The FMU has no variable place; it has T, PUSH, PLACE"),
    ],
)
def test_a_name_that_the_fmu_does_not_have_ends_the_run_with_those_it_has(
    fmu: Path, tmp_path: Path, words: tuple[str, ...], told: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(RunFailed):
        ran(tmp_path / "out", fmu, *words)
    assert told in capfd.readouterr().err + (tmp_path / "out" / "prints.txt").read_text(encoding="utf-8")
