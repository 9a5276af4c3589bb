"""Scenes and runs from Python: the same bits as the command line, scenes that never change, results with units."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest

from haploop.api import Scene, load, run
from haploop.controller.dissipation import Element, ElementError, Motion, PluginError, Quantity, where
from haploop.launch.scene.mistakes import SceneError
from haploop.launch.spec import OutputError
from haploop.logger import read
from haploop.logger.log.recording import Recording

SCENES = Path(__file__).parents[1] / "launch/scenes"
FIG6C = SCENES / "fig6c.toml"
# Begins inside the wall and on the way in.
SHORT = {"duration": 0.3, "device.position": -0.0605, "device.velocity": -0.2}


class Brake(Element):
    """A force of constant size against the motion, on the way in only."""

    kind = "brake"
    force_N: Annotated[float, Quantity("N", at_least=0)] = 0.05

    def force(self, motion: Motion):
        return where(motion.v * motion.into_wall > 0, self.force_N * -motion.into_wall, 0.0)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load(FIG6C, SHORT)


def same(one: Recording, other: Recording) -> None:
    """Every channel, column, unit and bit."""
    assert list(one) == list(other)
    for topic, rows in one.items():
        if isinstance(rows, list):
            assert rows == other[topic]
        else:
            assert (list(rows), rows.units) == (list(other[topic]), other[topic].units)
            assert all(rows[name].tobytes() == other[topic][name].tobytes() for name in rows), topic


@pytest.mark.parametrize("log", ["steps", "ticks"])
def test_a_run_in_memory_gives_what_the_log_of_one_with_files_gives_bit_for_bit(
    scene: Scene, log: str, tmp_path: Path
) -> None:
    scene = scene.set({"run.log": log, "run.block_ticks": 64}).swap("damping", at=0.1, element=1, damping=0.8)
    kept, left = run(scene), run(scene, tmp_path / "out")
    assert kept.directory is None
    assert left.directory == tmp_path / "out"
    assert kept.summary["trajectory_sha256"] == left.summary["trajectory_sha256"]
    same(kept.log, left.log)
    same(left.log, read(tmp_path / "out"))
    assert kept.log.attachments == left.log.attachments
    assert ("/plant" in kept.log) == (log == "steps")


def test_processes_give_the_same_bits_and_leave_nothing_unless_asked_to(scene: Scene, tmp_path: Path) -> None:
    scene = scene.set({"wall.stiffness": 400}, at="0.2 s")
    here, there = run(scene), run(scene, processes=True)
    same(here.log, there.log)
    assert there.directory is None
    assert (
        run(scene, tmp_path / "out", processes=True).summary["trajectory_sha256"] == (here.summary["trajectory_sha256"])
    )
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"log.mcap", "scene.toml", "summary.json"}


def test_values_are_numbers_in_si_units_text_pint_and_numpy_quantities_or_words_of_the_command_line() -> None:
    import pint

    units = pint.get_application_registry()
    given = [
        {"wall.stiffness": 200},
        {"wall.stiffness": "0.2 N/mm"},
        {"wall.stiffness": np.float64(200.0)},
        {"wall.stiffness": units.Quantity(0.2, "N/mm")},
        {"wall.stiffness": units.Quantity(np.float64(0.2), "kN/m")},
        {"wall.stiffness": units.Quantity(200.0, "kg/s**2")},
        ["wall.stiffness=200"],
        ["wall.stiffness=0.2 N/mm"],
    ]
    assert [load(FIG6C, values)["wall"]["stiffness"] for values in given] == [200.0] * len(given)
    scene = load(FIG6C)
    assert [scene.set(values)["wall"]["stiffness"] for values in given] == [200.0] * len(given)
    assert scene.set({"encoder": {"resolution": "5 um"}})["encoder"] == {"resolution": 5e-6, "rounding": "nearest"}


def test_a_change_gives_a_new_scene_and_leaves_the_old_one_as_it_was(scene: Scene) -> None:
    before = str(scene)
    stiffer = scene.set({"wall.stiffness": 999})
    swapped = stiffer.swap(at="0.2 s", element=0, kind="damping", damping="0.8 N s/m").set(
        {"wall.stiffness": 1}, at=0.1
    )
    assert str(scene) == before
    assert (stiffer["wall"]["stiffness"], "event" in stiffer) == (999.0, False)
    assert [event["at"] for event in swapped["event"]] == [0.1, 0.2]
    swapped["event"].clear()
    swapped.tables["wall"]["stiffness"] = 0.0
    assert (len(swapped["event"]), swapped["wall"]["stiffness"]) == (2, 999.0)
    assert [event["at"] for event in swapped.swap("none", at=0.15)["event"]] == [0.1, 0.15, 0.2]


def test_another_kind_of_element_drops_the_parameters_of_the_one_before(scene: Scene) -> None:
    damped = scene.set({"dissipation.0.kind": "damping", "dissipation.0.damping": 0.8})
    assert damped["dissipation"] == [{"kind": "damping", "acts": "in-contact", "damping": 0.8}]


def test_a_scene_prints_as_a_file_that_runs_to_the_same_end(scene: Scene, tmp_path: Path) -> None:
    (tmp_path / "again.toml").write_text(str(scene), encoding="utf-8")
    assert run(tmp_path / "again.toml").summary["trajectory_sha256"] == run(scene).summary["trajectory_sha256"]


def test_mistakes_are_the_sentences_of_the_command_line_all_at_once(scene: Scene) -> None:
    with pytest.raises(SceneError) as wrong:
        scene.set({"wall.stifness": 3, "device.mass": "-1 kg"})
    assert "did you mean stiffness?" in str(wrong.value)
    assert "device.mass" in str(wrong.value)
    with pytest.raises(SceneError, match="did you mean damping"):
        scene.swap("dampin", at=0.1)
    with pytest.raises(SceneError, match="It must be at most"):
        scene.swap("damping", at="9 s", damping=0.8)
    with pytest.raises(SceneError, match="cannot be set"):
        scene.set({"device.mass": 1.0}, at=0.1)
    with pytest.raises(KeyError, match=r"no walls in this scene \(did you mean wall\?\); it holds title"):
        scene["walls"]
    with pytest.raises(ValueError, match="A pace of 1 needs the clock of a run in processes"):
        run(scene, pace=1)


def test_a_value_is_had_by_its_dotted_key(scene: Scene) -> None:
    assert scene["wall.stiffness"] == scene["wall"]["stiffness"]
    assert scene["dissipation.0.kind"] == "unidirectional-inertia"
    assert "wall.stiffness" in scene
    assert "dissipation.1" not in scene
    with pytest.raises(KeyError, match=r"no stifness in wall \(did you mean stiffness\?\); it holds position"):
        scene["wall.stifness"]
    with pytest.raises(KeyError, match=r"no x in wall\.stiffness\."):
        scene["wall.stiffness.x"]


@pytest.mark.parametrize("at", [None, 0.1, 3])
def test_values_that_are_not_given_by_key_are_refused_with_the_form_to_write(scene: Scene, at) -> None:
    with pytest.raises(TypeError, match=r'Values are set by key: set\(\{"wall.stiffness": 200\}\)'):
        scene.set("wall.stiffness", at)
    with pytest.raises(TypeError, match="Values are set by key"):
        load(FIG6C, "wall.stiffness=3")


def test_a_directory_that_holds_something_is_refused(scene: Scene, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(OutputError, match="must be new or empty"):
        run(scene, tmp_path)


def test_an_element_may_be_given_as_a_class_at_once_or_in_mid_run(scene: Scene) -> None:
    braked = load(FIG6C, {**SHORT, "dissipation.0.kind": "brake"}, elements=[Brake])
    assert run(braked).summary["energy"]["elements"][0]["true_J"] > 0
    swapped = run(scene.swap(Brake, at=0.1, force_N=0.1))
    assert [one["kind"] for one in swapped.summary["energy"]["elements"]] == ["unidirectional-inertia", "brake"]
    with pytest.raises(PluginError, match=r"The element brake was given as a class.*plugins=\[\"brake\.py\"\]"):
        run(braked, processes=True)


def test_an_element_in_a_file_runs_as_processes_too(tmp_path: Path) -> None:
    source = Path(__file__).read_text(encoding="utf-8")
    head = (
        "from typing import Annotated\nfrom haploop.controller.dissipation import Element, Motion, Quantity, where\n\n"
    )
    body = source[source.index("class Brake") : source.index("@pytest.fixture")]
    (tmp_path / "brake.py").write_text(head + body, encoding="utf-8")
    scene = load(FIG6C, {**SHORT, "dissipation.0.kind": "brake"}, plugins=[tmp_path / "brake.py"])
    same(run(scene).log, run(scene, processes=True).log)


def test_what_is_no_usable_element_is_refused(scene: Scene) -> None:
    class Nameless(Element):
        """No kind."""

        def force(self, motion: Motion):
            return 0.0

    class Picky(Brake):
        """Refuses what its declaration allows."""

        kind = "picky"

        def __post_init__(self):
            raise ValueError("not today")

    with pytest.raises(PluginError, match="Nameless in Nameless has no kind"):
        load(FIG6C, elements=[Nameless])
    with pytest.raises(ElementError, match="not today"):
        scene.swap(Picky, at=0.1)


def test_numbers_of_the_summary_come_with_their_units(scene: Scene) -> None:
    result = run(scene)
    assert result.verdict == result.summary["verdict"]
    assert result.quantity("window.oscillation_m").to("mm").magnitude == (
        1e3 * result.summary["window"]["oscillation_m"]
    )
    expected = {
        "window.displayed_stiffness_N_m": "N/m",
        "window.growth_1_s": "1/s",
        "final.v_m_s": "m/s",
        "extremes.force_max_N": "N",
        "energy.elements.0.true_J": "J",
        "energy.elements.0.parameters.mass": "kg",
        "duration_s": "s",
        "real_time_factor": "",
    }
    for key, unit in expected.items():
        assert result.quantity(key).is_compatible_with(unit or "dimensionless"), key
    with pytest.raises(KeyError):
        result.quantity("window.nonsense_m")
    for name, key in (("force_max", "extremes.force_max_N"), ("Oscillation_m", "window.oscillation_m")):
        with pytest.raises(KeyError, match=f"did you mean {key}"):
            result.quantity(name)
    with pytest.raises(TypeError, match=r"A scene is a file, or a name that haploop scenes lists, but 3 was given."):
        run(3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"out must be a directory, .* to change a scene, use load\(scene\).set"):
        run(scene, {"wall.stiffness": 300.0})  # pyright: ignore[reportArgumentType]
    assert repr(result).startswith(f"<{result.verdict}: ")


def test_a_run_that_was_not_pushed_is_never_called_steady() -> None:
    scene = load(SCENES / "fig6b.toml", {"duration": 2.5, "wall.stiffness": "30 N/m"})
    seen, pushed = run(scene.set({"run.verdict": "window"})), run(scene)
    assert (seen.verdict, pushed.verdict) == ("no-swing-seen", "steady")
    assert repr(seen).startswith("<no-swing-seen: ")
    assert (seen.provisos, pushed.provisos) == ((), ())


def test_a_number_that_a_run_does_not_come_to_is_nan() -> None:
    result = run(load(FIG6C, {"duration": 0.01}))
    assert result.summary["window"]["displayed_stiffness_N_m"] is None
    assert np.isnan(result.quantity("window.displayed_stiffness_N_m").magnitude)


def test_a_scene_that_logs_nothing_gives_its_summary_and_says_so_of_the_rest(scene: Scene) -> None:
    result = run(scene.set({"run.log": "none"}))
    assert result.summary["ticks"] == 300
    with pytest.raises(KeyError, match="its channels are none"):
        result["/plant"]


def test_importing_the_package_imports_nothing_else() -> None:
    code = "import sys, haploop.launch; print({'numpy', 'pydantic', 'zmq', 'mcap', 'pint'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "set()\n"


def test_what_can_hardly_be_meant_is_told_of_a_scene_as_check_tells_it(scene: Scene) -> None:
    [far] = scene.set({"wall.position": "-60 m"}).notes
    assert far.startswith("The wall is at -60 m; a run ends as diverged beyond 1 m")
    assert scene.notes == []
