"""Files that come with haploop are found by their names wherever one is, one's own first."""

import json
import re
import resource
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from haploop.launch.scene.bundled import FOLDERS, about, bundled, own_file
from haploop.launch.scene.file import load
from haploop.launch.scene.mistakes import SceneError
from haploop.launch.scene.reading.layers import read_layers
from haploop.protocol.scene.hand_force import Ramp, Sine
from haploop.tools.advise.subject import assumptions
from haploop.tools.cli.app import app
from haploop.tools.command.options import complete
from haploop.tools.sweep import sweep_file
from helpers.scenes.least import LEAST_TOML

OWN = 'title = "my own"\n' + LEAST_TOML


def call(*arguments: str):
    return CliRunner().invoke(app, arguments)


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """Every test is somewhere else, where no file of haploop is."""
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", ["fig6c", "fig6c.toml", "scenes/fig6c.toml", "launch/scenes/fig6c.toml"])
def test_a_scene_that_comes_with_haploop_is_found_by_its_name(name):
    assert load(name) == load(bundled("scenes")["fig6c"])


@pytest.mark.parametrize("name", ["fig6c", "fig6c.toml"])
def test_ones_own_file_is_taken_before_that_of_the_same_name(name):
    Path("fig6c.toml").write_text(OWN)
    assert load(name).title == "my own"


def test_a_directory_of_that_name_is_no_file_of_ones_own():
    Path("fig6c").mkdir()
    assert load("fig6c") == load(bundled("scenes")["fig6c"])


@pytest.mark.parametrize("nowhere", ["", ".", "..", "/"])
@pytest.mark.parametrize("command", ["check", "explain", "sweep", "advise"])
def test_a_directory_in_place_of_a_file_is_a_sentence_even_where_its_path_has_no_name(command, nowhere):
    told = call(command, nowhere)
    assert told.exit_code == 2
    assert "This is a directory; a s" in told.output


def test_a_scene_extends_what_comes_with_haploop_and_what_lies_beside_it_comes_first():
    folder = Path("deep", "devices")
    folder.mkdir(parents=True)
    scene = Path("deep", "mine.toml")
    scene.write_text('extends = ["devices/premium15.toml", "hands/fu_cavusoglu_y"]\nduration = 1.0\n')
    taken = load(scene)
    assert taken.hand
    assert (taken.device.mass, taken.hand.stiffness) == (0.0525, 105.3)
    (folder / "premium15.toml").write_text(OWN)
    assert load(scene).device.mass == 0.01


def test_what_a_device_assumes_is_known_to_a_scene_that_names_it():
    Path("mine.toml").write_text('extends = "devices/omega3.toml"\nduration = 1.0\n')
    assert assumptions(Path("mine.toml")) == assumptions(bundled("devices")["omega3"])
    assert assumptions(Path("mine.toml"))


def test_a_sweep_is_found_by_its_name_and_names_its_scene_so():
    assert sweep_file.load(Path("elements")).title == "Elements against stiffness, with a noisy position"
    Path("mine.toml").write_text('scene = "fig6b"\n[axes]\n"wall.stiffness" = [100, 200]\n')
    assert sweep_file.load(Path("mine.toml")).base.title.startswith("Fig. 6(b)")


def test_a_sweep_that_is_taken_for_a_scene_is_said_to_be_one_and_nothing_else_is():
    Path("mine.toml").write_text('scene = "fig6b"\n[axes]\n"wall.stiffness" = [100, 200]\n')
    said, rest = call("run", "mine.toml").stderr.splitlines()
    assert rest == "1 mistake; nothing was started."
    assert said == (
        "mine.toml:2: axes is a key of a sweep, not of a scene. A sweep is run by haploop sweep mine.toml; it names a "
        "scene and says what is varied in it."
    )


def test_a_scene_that_could_not_be_written_whole_is_not_left_behind():
    """As on a disk that is full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, before[1]))
    try:
        refused = call("new", "first.toml", "--device", "premium15")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert refused.exit_code == 1
    assert "first.toml cannot be written: " in refused.stderr
    assert not Path("first.toml").exists()
    assert call("new", "first.toml", "--device", "premium15").exit_code == 0


def test_a_scene_that_cannot_be_made_leaves_the_file_that_is_there_as_it_is():
    Path("mine.toml").write_text("duration = 1", encoding="utf-8")
    refused = call("new", "mine.toml", "--device", "d" * 300)
    assert refused.exit_code == 2
    assert refused.stderr.endswith("cannot be read: File name too long.\n")
    assert call("new", "mine.toml", "--device", "premium15").exit_code == 2
    assert Path("mine.toml").read_text(encoding="utf-8") == "duration = 1"


@pytest.mark.parametrize(
    ("name", "told"),
    [
        (
            "premium_tip",
            "There is no such file, and no scene of that name comes with haploop; did you mean premium_tap?",
        ),
        (
            "premium15",
            "no scene of that name comes with haploop. premium15 is a device: haploop advise "
            "premium15 says which walls it can hold, haploop new NAME.toml --device premium15 writes a scene with it.",
        ),
        ("elements", "comes with haploop. elements is a sweep: haploop sweep elements."),
        ("some/fig6c.toml", "There is no such file; did you mean fig6c?"),
        ("../scenes/fig6c.toml", "There is no such file; did you mean fig6c?"),
        ("x" * 5000, "The file cannot be read: File name too long."),
    ],
)
def test_a_name_that_is_none_is_told_with_the_nearest(name, told):
    with pytest.raises(SceneError) as caught:
        load(name)
    assert str(caught.value).endswith(told)


def test_all_that_comes_with_haploop_is_listed_with_what_it_is():
    listed = call("scenes")
    assert listed.exit_code == 0
    for folder in FOLDERS:
        for name, path in bundled(folder).items():
            assert name in listed.stdout
            assert len(about(path)) > 20


def test_what_comes_with_haploop_is_printed_by_its_name_and_can_be_copied():
    for folder in FOLDERS:
        for name, path in bundled(folder).items():
            assert call("scenes", f"{folder}/{name}").stdout == path.read_text()
    assert call("scenes", "premium15").stdout == bundled("devices")["premium15"].read_text()
    unknown = call("scenes", "premium16")
    assert unknown.exit_code == 2
    assert "premium16 does not come with haploop (did you mean premium15?); haploop scenes lists" in unknown.stderr


COPIED = [(folder, name) for folder in FOLDERS for name in bundled(folder)]


@pytest.mark.parametrize(("folder", "name"), COPIED, ids=map("/".join, COPIED))
def test_a_copy_of_every_file_is_read_anywhere_as_the_original(folder, name):
    copy = Path("copy.toml")
    copy.write_text(call("scenes", f"{folder}/{name}").stdout)
    original = bundled(folder)[name]
    if folder == "sweeps":
        assert sweep_file.load(copy) == sweep_file.load(original)
    else:
        assert read_layers(copy).data == read_layers(original).data


def test_a_file_of_ones_own_that_a_bare_name_stands_for_is_noted():
    own = "Note: demo is your own demo.toml, used in place of the one that comes with haploop.\n"
    assert own not in call("check", "demo").stderr
    Path("demo.toml").write_text(OWN)
    for command in ("check", "explain"):
        assert own in call(command, "demo").stderr
        assert own not in call(command, "demo.toml").stderr
    answered = call("check", "demo", "--json")
    assert json.loads(answered.stdout)["title"] == "my own"
    assert own in answered.stderr


def test_files_of_ones_own_are_listed_and_no_others():
    assert "your own" not in call("scenes").stdout
    Path("fig6a.toml").write_text(OWN)
    assert re.search(r"fig6a +your own file is used here: fig6a.toml", call("scenes").stdout)
    assert own_file("fig6b", "scenes") is None


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_word_is_completed_by_names_and_by_files_of_ones_own(folder):
    Path("folder").mkdir()
    Path("fork.toml").touch()
    Path("form.txt").touch()
    assert complete(folder)("") == [*bundled(folder), "folder/", "fork.toml"]
    assert complete(folder)("fork") == ["fork.toml"]


@pytest.mark.parametrize("device", bundled("devices"))
@pytest.mark.parametrize("hand", bundled("hands"))
def test_a_new_scene_of_every_device_and_hand_can_be_run_and_asks_for_the_wall_it_was_made_for(device, hand):
    made = call("new", "my.toml", "--device", device, "--hand", hand, "--wall", "0.25 N/mm")
    assert made.exit_code == 0
    scene = load("my.toml")
    assert scene.wall
    assert scene.hand
    assert (scene.wall.stiffness, scene.hand.force) == (250.0, Ramp(value=-1.0, rise_time=0.3))
    assert scene.hand.stiffness * -scene.wall.position < 1.0, "a stiff hand kept the device off a wall 5 mm away"


def test_a_hand_of_any_stiffness_reaches_the_wall_of_its_new_scene():
    given = ((10.0, -0.005), (100.0, -0.005), (500.0, -0.001), ("2 N/mm", -0.00025))
    for number, (stiffness, place_m) in enumerate(given):
        Path("hand.toml").write_text(f"[hand]\nmass = 0.1\nstiffness = {stiffness!r}\n")
        assert call("new", f"{number}.toml", "--device", "touch", "--hand", "hand.toml").exit_code == 0
        wall = load(f"{number}.toml").wall
        assert wall
        assert wall.position == pytest.approx(place_m)


def test_a_new_scene_takes_a_device_and_a_hand_of_ones_own_wherever_they_are():
    Path("mine").mkdir()
    Path("mine/device.toml").write_text("[device]\nmass = 0.123\ndamping = 0.5\n")
    Path("hand.toml").write_text("[hand]\nmass = 0.2\n")
    made = call("new", "mine/scene.toml", "--device", "mine/device.toml", "--hand", "hand.toml")
    assert made.exit_code == 0, made.output
    assert 'extends = ["device.toml", "../hand.toml"]' in Path("mine/scene.toml").read_text()
    scene = load("mine/scene.toml")
    assert scene.hand
    assert (scene.device.mass, scene.hand.mass) == (0.123, 0.2)
    refused = call("new", "other.toml", "--device", "nowhere.toml")
    assert refused.exit_code == 2
    assert "'nowhere.toml' is not a file, and none of that name comes with haploop" in refused.stderr


def test_a_new_scene_says_nothing_anew_that_a_file_of_ones_own_says():
    Path("beneath.toml").write_text('[clock]\nround_trip_delay = "1 ms"\n')
    Path("device.toml").write_text(
        'extends = "beneath.toml"\nduration = 5\n[device]\nmass = 0.1\ndamping = 0.1\n[wall]\nstiffness = 700\n'
        '[hand.force]\nkind = "sine"\namplitude = "1 N"\nfrequency = "2 Hz"\n'
    )
    assert call("new", "my.toml", "--device", "device.toml").exit_code == 0
    scene = load("my.toml")
    assert scene.wall
    assert scene.hand
    assert (scene.clock.round_trip_delay, scene.duration, scene.wall.stiffness) == (1e-3, 5.0, 700.0)
    assert scene.hand.force == Sine(amplitude=1.0, frequency=2.0)
    assert '# round_trip_delay = "1 ms"  # from beneath.toml' in Path("my.toml").read_text()
    call("new", "asked.toml", "--device", "device.toml", "--wall", "2 N/mm")
    asked = load("asked.toml")
    assert asked.wall
    assert (asked.clock.round_trip_delay, asked.wall.stiffness) == (1e-3, 2000.0)


def test_what_its_comments_offer_can_be_run_too():
    call("new", "my.toml")
    text = Path("my.toml").read_text()
    Path("my.toml").write_text(
        "".join(f"{line.removeprefix('# ') if _is_toml(line[2:]) else line}\n" for line in text.splitlines())
    )
    scene = load("my.toml")
    assert (len(scene.dissipation), len(scene.event)) == (1, 1)


def _is_toml(line: str) -> bool:
    try:
        return bool(tomllib.loads(line))
    except tomllib.TOMLDecodeError:
        return False


def test_a_new_scene_never_takes_the_place_of_a_file_and_a_mistake_leaves_none():
    Path("kept.toml").write_text("kept")
    assert call("new", "kept.toml").exit_code == 2
    assert Path("kept.toml").read_text() == "kept"
    for wall in ("stiff", "3", "3 kg", "-1 N/mm"):
        refused = call("new", "my.toml", "--wall", wall)
        assert refused.exit_code == 2
        assert f'--wall is "{wall}". It must be a stiffness with its unit' in refused.stderr
        assert not Path("my.toml").exists()
    refused = call("new", "my.toml", "--device", "premium")
    assert refused.exit_code == 2
    assert "did you mean premium15?" in refused.stderr
