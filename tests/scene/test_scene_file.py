"""Scene files: what extends what, who said what, and files that cannot be read."""

import pickle
import re
import tomllib

import pytest

from haploop.controller.tick import NoForce
from haploop.launch.scene.bundled import bundled_folder
from haploop.launch.scene.file import load
from haploop.launch.scene.mistakes import Mistake, SceneError
from haploop.launch.scene.reading.lines import outline
from haploop.protocol.scene.hand_force import Constant, Sine
from haploop.protocol.scene.scene import Device, Hand, Wall
from haploop.tools.sweep.points import AxisError
from helpers.scenes.least import LEAST_TOML, file_mistakes


def test_the_title_is_the_name_of_the_file_unless_given(files):
    assert load(files(tap=LEAST_TOML)).title == "tap"
    assert load(files(tap=f'title = "A tap"\n{LEAST_TOML}')).title == "A tap"


def test_extends_merges_key_by_key_and_the_file_itself_wins(files):
    path = files(
        top='extends = ["one.toml", "two.toml"]\n[wall]\nstiffness = 3.0\n',
        one='extends = "base.toml"\n[wall]\nposition = 1.0\nstiffness = 1.0\n',
        two='[wall]\nstiffness = 2.0\noccupies = "above"\n[device]\nposition = 0.5\n',
        base=LEAST_TOML,
    )
    scene = load(path)
    assert scene.wall == Wall(position=1.0, stiffness=3.0, occupies="above")
    assert scene.device == Device(mass=0.01, damping=0.1, position=0.5, velocity=0.0)
    assert scene.others == {}


def test_lists_of_tables_are_replaced_whole(files):
    element = '[[dissipation]]\nkind = "{}"\n{} = 1.0\n'
    path = files(
        top='extends = "base.toml"\n' + element.format("bidirectional-inertia", "mass"),
        base=LEAST_TOML + 2 * element.format("damping", "damping"),
    )
    assert [element.name for element in load(path).dissipation] == ["bidirectional-inertia"]


def test_a_table_of_another_kind_keeps_nothing_of_the_old_one(files):
    path = files(
        top='extends = "base.toml"\n[hand.force]\nkind = "constant"\nvalue = 2.0\n',
        base=LEAST_TOML + '[hand.force]\nkind = "ramp"\nvalue = 1.0\nrise_time = 1.0\n',
    )
    assert load(path).hand == Hand(force=Constant(value=2.0))
    sine = ["hand.force.amplitude=1", "hand.force.kind=sine", "hand.force.frequency=1"]
    assert load(path, sine).hand == Hand(force=Sine(amplitude=1.0, frequency=1.0, offset=0.0, phase=0.0))


def test_a_mistake_names_the_file_that_made_it(files, tmp_path):
    (tmp_path / "devices").mkdir()
    (tmp_path / "scenes").mkdir()
    (tmp_path / "devices/base.toml").write_text(LEAST_TOML + "[encoder]\nresolution = -1.0\n[wall]\nposition = 0.0\n")
    path = files(**{"scenes/top": 'extends = "../devices/base.toml"\n[wall]\nstiffness = "soft"\n'})
    assert [line.split(" is ")[0] for line in file_mistakes(path, "wall.occupies=no")] == [
        "devices/base.toml:6: encoder.resolution",
        "scenes/top.toml:3: wall.stiffness",
        "--set: wall.occupies",
    ]


def test_a_table_given_twice_is_one_mistake_whatever_its_keys(files):
    again = LEAST_TOML + "[wall]\nposition = 0.0\nstiffness = 1.0\n[wall]\nposition = 0.1\nstiffness = 2.0\n"
    [mistake] = file_mistakes(files(twice=again))
    assert "wall is given again, after line" in mistake


def test_every_mistake_has_its_line_and_keys_given_twice_do_not_hide_the_others(files):
    path = files(
        top="""duration = 1.0
duration = 2.0  # again
extends = 3

[device]
damping = 0.1
"mass" = -1.0
[hand.force]
kind = "trace"
time = [
  0.0,
  1.0, # not the end ]
]
force = [ [ 0.0 ],
  1.0 ]
[[dissipation]]
kind = "damping"
damping = 1.0
[[dissipation]]
kind = "damping"
[device]
velocity = "1 m"
[wall]
occupies = \"\"\"
left\"\"\"
position = 0.0
"""
    )
    assert [told.split(" is ")[0] for told in file_mistakes(path)] == [
        "top.toml:2: duration",
        "top.toml:3: extends",
        "top.toml:21: device",
    ]
    path.write_text(path.read_text().replace("extends = 3", ""))
    assert sorted(told.split(" is ")[0] for told in file_mistakes(path)) == sorted(
        [
            "top.toml:2: duration",
            "top.toml:21: device",
            "top.toml:7: device.mass",
            "top.toml:22: device.velocity",
            "top.toml:14: hand.force.force.0",
            "top.toml:19: dissipation.1.damping",
            "top.toml:23: wall.stiffness",
            "top.toml:24: wall.occupies",
        ]
    )


def test_the_outline_of_every_shipped_scene_is_what_toml_reads():
    for path in bundled_folder("scenes").parent.rglob("*.toml"):
        text = path.read_text(encoding="utf-8")
        found = outline(text)
        assert found
        assert found.data == tomllib.loads(text)
        assert not found.doubled
        for key, line in found.at.items():
            assert re.search(rf"\b{re.escape(str([part for part in key if isinstance(part, str)][-1]))}\b",
                             text.splitlines()[line - 1]), (path, key)  # fmt: skip


def test_what_is_no_toml_has_no_outline_and_its_own_words():
    assert outline("a = \n[b]\nb = 1\n") is None
    assert outline("a = 1\n[a.b]\n") is None
    windows = outline("a = 1\r\nb = [\r\n1]\r\nc = 2\r\n")
    assert windows
    assert windows.at == {("a",): 1, ("b",): 2, ("c",): 4}
    doubled = outline("a = 1\na = 2\n")
    assert doubled
    assert doubled.doubled == [(("a",), 1, 2)]


def test_a_scene_that_extends_itself_is_told_the_circle(files, tmp_path):
    files(a='extends = "b.toml"\n', b='extends = "c.toml"\n', c='extends = "./b.toml"\n')
    [mistake] = file_mistakes(tmp_path / "a.toml")
    assert mistake == "c.toml: A scene cannot extend itself: b.toml extends c.toml extends b.toml."


def test_two_paths_to_one_base_are_no_circle(files):
    path = files(a='extends = ["b.toml", "c.toml"]\n', b='extends = "d.toml"\n', c='extends = "d.toml"\n', d=LEAST_TOML)
    assert load(path).duration == 1.0


@pytest.mark.parametrize("extends", ["3", '["x.toml", 3]', '""', "{}"])
def test_extends_is_a_path_or_a_list_of_them(files, extends):
    [mistake] = file_mistakes(files(a=f"extends = {extends}\n"))
    assert mistake.endswith("It must be the path of a scene file, or a list of them.")


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, "There is no such file."),
        (b"", "The file is empty; a scene needs at least a duration and a [device]."),
        (b"# nothing but this\n", "The file is empty; a scene needs at least a duration and a [device]."),
        (b'# a\ntitle = "\xff"\n', ":2: A scene must be UTF-8 text, but this line is not; save the file as UTF-8."),
        (b"a = 1\nb = = 2\n", ":2: This is not valid TOML: Invalid value (at line 2, column 5)."),
        (
            b"a = 1\nkind = ramp\n",
            ':2: This is not valid TOML: Invalid value (at line 2, column 8). Text stands in quotes: "ramp".',
        ),
        (b"a = 1\nb = [2,\n", ":2: This is not valid TOML: "),
        (b"seed = " + 5000 * b"9", "This is not valid TOML: "),
        (b"a = " + 5000 * b"[", "Tables and lists may be nested at most 32 deep."),
    ],
)
def test_a_file_that_cannot_be_read_says_why(tmp_path, monkeypatch, content, sentence):
    monkeypatch.chdir(tmp_path)
    if content is not None:
        (tmp_path / "x.toml").write_bytes(content)
    [mistake] = file_mistakes(tmp_path / "x.toml")
    assert mistake.startswith(f"x.toml{sentence}" if sentence[0] == ":" else f"x.toml: {sentence}")


def test_a_directory_is_no_scene(tmp_path):
    assert file_mistakes(tmp_path) == [f"{tmp_path}: This is a directory; a scene is a TOML file."]


def test_all_files_that_cannot_be_read_are_reported_at_once(files):
    found = file_mistakes(files(a='extends = ["gone.toml", "bad.toml"]\n', bad="x"))
    assert [line.split(":")[0] for line in found] == ["a.toml", "bad.toml"]


@pytest.mark.parametrize(
    ("name", "meant"),
    [("devices/premuim15.toml", "devices/premium15.toml"), ("mine/fu_cavusoglu_y.toml", "hands/fu_cavusoglu_y.toml"),
     ("base2.toml", "base.toml"), ("zzzzzzzz", None)],
)  # fmt: skip
def test_a_name_in_extends_that_is_no_file_is_told_with_its_line_and_the_one_that_was_meant(files, name, meant):
    [mistake] = file_mistakes(files(top=f'duration = 1.0\nextends = "{name}"\n', base=LEAST_TOML))
    assert mistake.startswith(f'top.toml:2: extends names "{name}", but there is no such file')
    assert (f"; did you mean {meant}?" in mistake) if meant else ("did you mean" not in mistake)


def test_no_file_is_taken_to_have_meant_itself(files):
    [mistake] = file_mistakes(files(top='extends = "topp.toml"\nduration = 1.0\n'))
    assert "did you mean top.toml" not in mistake


def test_beside_a_file_that_is_absent_the_mistakes_of_the_others_are_told_and_no_key_that_it_may_hold(files):
    wrong = 'extends = ["gone.toml", "below.toml"]\nduraton = 1.0\n[hand.force]\nvalue = 1.0\n'
    found = file_mistakes(files(top=wrong, below='duration = "1 m"\n[wall]\nstiffnes = 3\n'))
    assert sorted(line.split()[0] for line in found) == ["below.toml:1:", "below.toml:3:", "top.toml:1:", "top.toml:2:"]
    assert [word for line in found if (word := "is missing") in line] == []


def test_mistakes_come_whole_out_of_another_process():
    refused = SceneError([Mistake("a.toml", "wall.stifness", "is not a key of [wall]", "", "stiffness", 3)])
    again = pickle.loads(pickle.dumps(refused))
    assert (str(again), again.mistakes) == (str(refused), refused.mistakes)
    for error in (NoForce(1), AxisError("It must be so.", "is not", "that", 2)):
        again = pickle.loads(pickle.dumps(error))
        assert (str(again), vars(again)) == (str(error), vars(error))


@pytest.mark.parametrize("value", ['"3 N/mm', "'3 N/mm", '["a", "b]', '"""3'])
def test_a_quotation_mark_that_is_not_closed_is_told_in_words(files, value):
    [mistake] = file_mistakes(files(top=f"title = {value}\nseed = 1\n"))
    assert mistake.endswith(" A quotation mark is not closed. Other mistakes are reported once it is.")


def test_a_byte_order_mark_is_no_mistake(tmp_path):
    (tmp_path / "x.toml").write_text(LEAST_TOML, encoding="utf-8-sig")
    assert load(tmp_path / "x.toml").duration == 1.0


def test_the_error_is_a_value_error_with_one_line_a_mistake(files):
    with pytest.raises(SceneError) as error:
        load(files(top="seed = -1\n"))
    assert len(str(error.value).splitlines()) == len(error.value.mistakes) == 3


COUNTED = LEAST_TOML + '[encoder]\nbits = 14\nrange = "0.2 m"\n'


def test_bits_and_range_of_an_encoder_are_its_resolution_whichever_is_said_last(files):
    path = files(top=COUNTED, over='extends = "top.toml"\n[encoder]\nresolution = 1e-6\n')

    def count_m(name, *overrides):
        return load(path.parent / f"{name}.toml", overrides).as_dict()["encoder"]["resolution"]

    assert count_m("top") == 0.2 / 2**14 == count_m("top", "encoder.resolution=0.2 m / 16384")
    assert count_m("top", "encoder.bits=10") == 0.2 / 1024
    assert count_m("over") == 1e-6
    assert count_m("over", "encoder.range=1", "encoder.bits=2") == 0.25


def test_an_encoder_has_its_resolution_or_both_bits_and_range(files):
    path = files(top=COUNTED)
    assert file_mistakes(path, "encoder.bits=0.5")[0].startswith("--set: encoder.bits is 0.5. It must be at least 1.")
    assert file_mistakes(path, "encoder.range=-1")[0].startswith("--set: encoder.range is -1. It must be above 0 m.")
    path.write_text(COUNTED.replace("bits = 14\n", ""))
    assert file_mistakes(path) == [
        "top.toml:6: encoder.bits is missing. An encoder has its resolution, or both bits and range."
    ]
    said = file_mistakes(path, "encoder.counts=4096")
    assert any('counts over 0.2 m are bits = 12 and range = "0.2 m"' in each for each in said)
    path.write_text(COUNTED + "resolution = 1e-6\n")
    assert file_mistakes(path)[0].startswith("top.toml:8: encoder.resolution is given as well as bits or range.")


def test_mistakes_come_by_line_and_a_wrong_duration_hides_none_of_the_clock(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(
        'duration = "3 m"\n[device]\nmass = 0.1\ndampin = 1\n[wall]\nposition = 0\nstiffness = -1\n'
        '[clock]\nplant_rate = 10000\ncontrol_rate = 3333\nround_trip_delay = "0.15 ms"\n'
    )
    assert [told.split(" is ")[0].removeprefix(f"{path}:") for told in file_mistakes(path)] == [
        "1: duration", "4: device.dampin", "7: wall.stiffness", "10: clock.control_rate", "11: clock.round_trip_delay",
    ]  # fmt: skip
