"""An exported controller as importers treat it: valid, whole, refusing in sentences, several at once, going back."""

from __future__ import annotations

import math
import re
import subprocess
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haploop.tools.fmu.package import make_fmu
from helpers.runs.fmus import Stepped, compiler, forces_of, made, needs_fmus, recorded, stepped
from helpers.scenes.least import WALL, scene

LOOP: dict[str, Any] = {
    "duration": 0.1,
    "device": {"mass": 0.05, "damping": 0.3, "position": -0.055, "velocity": -0.2},
    "wall": WALL,
    "clock": {"plant_rate": 10_000, "control_rate": 1_000, "round_trip_delay": 0.001},
    "encoder": {"resolution": 1e-5},
    "velocity": {"estimator": "window", "ticks": 4},
    "dissipation": [{"kind": "unidirectional-inertia", "mass": 0.01, "acts": "always"}],
}
ACCELEROMETER = {"acceleration": {"source": "accelerometer"}, "accelerometer": {"range": 30}}
EVERY_VARIABLE = {**LOOP, **ACCELEROMETER, "actuator": {"resolution": 1e-3, "saturation": 4}}
NASTY = "a \"wall\" <of> '0.1' & 0.2\nN/mm \u00e9 \U0001f600 \x01 ]]> --> %s"


@pytest.fixture(autouse=True)
def fmus() -> None:
    needs_fmus()


@pytest.mark.slow
@pytest.mark.parametrize(
    "tables",
    [LOOP, EVERY_VARIABLE, {}, {**LOOP, "title": NASTY}, {**LOOP, "clock": {"round_trip_delay": 0.0}}],
    ids=["a loop", "every variable", "the least scene", "a nasty title", "no delay"],
)
def test_fmpy_finds_nothing_wrong_with_it(tables: dict[str, Any], tmp_path: Path) -> None:
    import fmpy
    from fmpy.validation import validate_fmu
    from lxml.etree import XMLSchema, fromstring

    path = made(scene(**tables), tmp_path, "2 a-b")
    assert validate_fmu(str(path)) == []
    schema = XMLSchema(file=str(Path(str(fmpy.__file__)).parent / "schema" / "fmi3" / "fmi3BuildDescription.xsd"))
    schema.assertValid(fromstring(zipfile.ZipFile(path).read("sources/buildDescription.xml")))


def test_it_says_what_it_takes_gives_and_is_made_of(tmp_path: Path) -> None:
    from fmpy import read_model_description

    description = read_model_description(str(made(scene(**{**EVERY_VARIABLE, "title": NASTY}), tmp_path)))
    found = {v.name: (v.causality, v.variability, v.unit, v.start) for v in description.modelVariables}
    assert found == {
        "time": ("independent", "continuous", "s", None),
        "force": ("output", "discrete", "N", None),
        "position": ("input", "continuous", "m", "-0.055"),
        "acceleration": ("input", "continuous", "m/s2", "0.0"),
        "encoder.resolution": ("parameter", "tunable", "m", "1e-05"),
        "wall.position": ("parameter", "tunable", "m", "-0.06"),
        "wall.stiffness": ("parameter", "tunable", "N/m", "150.0"),
        "actuator.resolution": ("parameter", "tunable", "N", "0.001"),
        "actuator.saturation": ("parameter", "tunable", "N", "4.0"),
        "dissipation.0.mass": ("parameter", "tunable", "kg", "0.01"),
    }
    assert description.modelName == NASTY.replace("\x01", "\ufffd")
    assert description.coSimulation
    assert description.coSimulation.fixedInternalStepSize == "0.001"
    assert description.outputs[0].dependencies == []


def test_the_same_scene_gives_the_same_bytes_and_another_one_another_token(tmp_path: Path) -> None:
    def token(path: Path) -> str:
        text = zipfile.ZipFile(path).read("modelDescription.xml").decode()
        return re.findall('instantiationToken="([^"]+)"', text)[0]

    first = made(scene(**LOOP), tmp_path)
    assert first.read_bytes() == make_fmu(scene(**LOOP), "controller")
    other = made(scene(**{**LOOP, "wall": {**WALL, "stiffness": 150.00000000000003}}), tmp_path, "other")
    assert token(first) != token(other)


def test_its_c_agrees_with_the_headers_of_the_standard_and_defines_every_function(tmp_path: Path) -> None:
    import fmpy

    headers = Path(str(fmpy.__file__)).parent / "c-code"
    with zipfile.ZipFile(made(scene(**LOOP), tmp_path)) as archive:
        archive.extractall(tmp_path)
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wno-unused-parameter", "-Wno-strict-prototypes", "-Werror"]
    checked = [
        compiler(),
        *strict,
        "-DFMI3_HEADERS",
        f"-I{headers}",
        "-fsyntax-only",
        str(tmp_path / "sources" / "fmi3.c"),
    ]
    assert subprocess.run(checked, capture_output=True, text=True).stderr == ""
    declared = set(re.findall(r"fmi3\w+TYPE\s+(fmi3\w+);", (headers / "fmi3Functions.h").read_text()))
    assert len(declared) > 70
    [library] = (tmp_path / "binaries").rglob("controller.*")
    import ctypes

    loaded = ctypes.CDLL(str(library))
    assert [name for name in declared if not hasattr(loaded, name)] == []


def refused(one: Stepped, *words: str) -> None:
    """Checks that the last sentence told has these words."""
    assert one.said, "nothing was told"
    assert [word for word in words if word not in one.said[-1]] == [], one.said[-1]


@pytest.mark.parametrize(
    ("point_s", "size_s"),
    [(0.0, 0.002), (0.0, 0.00015), (0.0, 0.0), (0.0, -0.001), (0.0, math.nan), (0.0, math.inf), (0.0, 1e300)],
)
def test_a_step_that_would_pass_over_a_tick_or_end_between_plant_steps_is_refused(
    point_s: float, size_s: float, tmp_path: Path
) -> None:
    from fmpy.fmi1 import FMICallException

    loop = scene(**LOOP)
    run = recorded(loop)
    with stepped(made(loop, tmp_path)) as one:
        with pytest.raises(FMICallException):
            one.slave.doStep(point_s, size_s)
        refused(one, "whole number of plant steps of 0.0001 s", "next tick, 0.001 s on")
        forces = forces_of(one, loop, run.true_m)  # nothing has changed
    assert forces.tobytes() == run.force_N.tobytes()


def test_a_step_that_begins_elsewhere_is_refused_and_rounding_of_times_is_not(tmp_path: Path) -> None:
    from fmpy.fmi1 import FMICallException

    with stepped(made(scene(**LOOP), tmp_path), start_s=5.0) as one:
        t = 5.0
        for _ in range(2_000):
            one.slave.doStep(t, 0.001)
            t += 0.001  # as importers add
        assert t != 7.0
        with pytest.raises(FMICallException):
            one.slave.doStep(t + 0.001, 0.001)
        refused(one, "must begin at 7 s", "7.001 s")
        assert one.slave.getFloat64([one.references["time"]]) == [7.0]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e7])
def test_a_position_that_is_no_number_or_cannot_be_meant_is_refused_and_changes_nothing(
    value: float, tmp_path: Path
) -> None:
    from fmpy.fmi1 import FMICallException

    loop = scene(**LOOP)
    run = recorded(loop)
    with stepped(made(loop, tmp_path)) as one:
        head = forces_of(one, loop, run.true_m[:50])
        with pytest.raises(FMICallException):
            one.set_named({"wall.stiffness": 1.0, "position": value})
        refused(one, "position must be a finite number from -1e+06 to 1e+06", "stays")
        tail = forces_of(one, loop, run.true_m[50:], first=50)
    assert np.concatenate([head, tail]).tobytes() == run.force_N.tobytes()


@pytest.mark.parametrize(("name", "value"), [("wall.stiffness", -1.0), ("dissipation.0.mass", -1e-9), ("force", 1.0)])
def test_a_parameter_beyond_its_bounds_and_what_is_no_input_are_refused(
    name: str, value: float, tmp_path: Path
) -> None:
    from fmpy.fmi1 import FMICallException

    with stepped(made(scene(**LOOP), tmp_path)) as one:
        with pytest.raises(FMICallException):
            one.set_named({name: value})
        refused(one, "No variable that can be set" if name == "force" else name)
        with pytest.raises(FMICallException):
            one.slave.getFloat64([99])
        refused(one, "no variable with the reference 99")


def test_no_step_is_done_before_initialization_or_after_the_end(tmp_path: Path) -> None:
    from fmpy.fmi1 import FMICallException

    with stepped(made(scene(**LOOP), tmp_path)) as one:
        for leave, words in ((one.slave.terminate, "after the end"), (one.slave.reset, "before initialization")):
            one.said.clear()
            leave()
            with pytest.raises(FMICallException):
                one.slave.doStep(0.0, 0.001)
            refused(one, words)


def test_two_instances_at_once_know_nothing_of_each_other(tmp_path: Path) -> None:
    loop = scene(**LOOP)
    run = recorded(loop)
    path = made(loop, tmp_path)
    with stepped(path) as one, stepped(path) as other:
        other.set_named({"wall.stiffness": 7.0})
        forces = []
        for tick, x in enumerate(run.true_m):
            other.set(position=-0.1 * tick)
            other.slave.doStep(tick / 1000, 0.001)
            forces.append(forces_of(one, loop, [x], first=tick))
    assert np.concatenate(forces).tobytes() == run.force_N.tobytes()


def test_after_a_reset_it_begins_anew_with_the_values_it_was_exported_with(tmp_path: Path) -> None:
    loop = scene(**LOOP)
    run = recorded(loop)
    with stepped(made(loop, tmp_path)) as one:
        one.set_named({"wall.stiffness": 7.0})
        forces_of(one, loop, run.true_m[::-1])
        one.slave.reset()
        one.slave.enterInitializationMode(startTime=0.0)
        one.slave.exitInitializationMode()
        forces = forces_of(one, loop, run.true_m)
    assert forces.tobytes() == run.force_N.tobytes()


def test_a_state_that_was_kept_is_gone_back_to_whole(tmp_path: Path) -> None:
    loop = scene(**LOOP)
    run = recorded(loop)
    with stepped(made(loop, tmp_path)) as one:
        head = forces_of(one, loop, run.true_m[:37])
        kept = one.slave.getFMUState()
        forces_of(one, loop, run.true_m[::-1][:40], first=37)
        one.set_named({"wall.stiffness": 7.0})
        one.slave.setFMUState(kept)
        tail = forces_of(one, loop, run.true_m[37:], first=37)
        one.slave.freeFMUState(kept)
    assert np.concatenate([head, tail]).tobytes() == run.force_N.tobytes()


def test_a_binary_of_another_scene_is_refused_by_its_token(tmp_path: Path) -> None:
    from fmpy import extract
    from fmpy.fmi3 import FMU3Slave

    folder = extract(str(made(scene(**LOOP), tmp_path)), unzipdir=str(tmp_path / "x"))
    said: list[str] = []
    slave = FMU3Slave(guid="{other}", unzipDirectory=folder, modelIdentifier="controller", instanceName="one")
    with pytest.raises(Exception, match="nstantiate"):
        slave.instantiate(logMessage=lambda _environment, _status, _category, text: said.append(text.decode()))
    assert "{other} was given" in said[0]
