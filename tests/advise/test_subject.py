"""The subject of an advice: names, hands, delays, what a device file assumes, absurd numbers."""

from contextlib import nullcontext
from pathlib import Path

import pytest

from haploop.launch.scene.bundled import bundled
from haploop.launch.scene.file import load
from haploop.launch.scene.mistakes import SceneError
from haploop.protocol.scene.paths import value_at
from haploop.tools.advise.subject import DEFAULT_HAND, InvalidRequest, apply_events, assumptions, make_subject
from helpers.scenes.least import KINDS
from helpers.scenes.presets import SCENES


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("premum15", None, None, None), "did you mean premium15?"),
        (("touch", "choi", None, None), "did you mean choi2022?"),
        (("touch", None, None, "kalmann"), "did you mean kalman?"),
    ],
)
def test_a_wrong_name_is_answered_with_the_nearest(arguments, words):
    device, hand, delay, estimator = arguments
    with pytest.raises(InvalidRequest, match=words.replace("?", r"\?")):
        make_subject(device, hand, delay, estimator, (), KINDS)


@pytest.mark.parametrize("delay", ["2", "600 ms"])
def test_a_delay_that_no_task_outlasts_is_refused_and_a_forgotten_unit_is_suspected(delay):
    with pytest.raises(InvalidRequest, match=r'advice is given up to 0.5 s.*write "[0-9.]+ ms" for milliseconds'):
        make_subject("touch", None, delay, None, [], KINDS)


def test_a_preset_gets_a_hand_and_says_so():
    asked = make_subject("touch", None, "1 ms", None, [], KINDS)
    assert not asked.has_task
    assert DEFAULT_HAND in asked.notes[0]
    assert asked.scene.clock.round_trip_delay == 0.001


@pytest.mark.parametrize(
    ("overrides", "words"), [(["hand.mass=0.05"], ", except for hand.mass as set;"), ([], "2012);")]
)
def test_a_hand_taken_with_other_numbers_is_said_to_have_them(overrides, words):
    assert words in make_subject("touch", None, "1 ms", None, overrides, KINDS).notes[0]


def test_another_hand_keeps_the_force_of_the_scene():
    asked = make_subject(str(SCENES / "fig6a.toml"), "fu_cavusoglu_x", None, None, [], KINDS)
    assert value_at(asked.scene, "hand.grip.stiffness") == 379.5
    assert value_at(asked.scene, "hand.force.value") == -0.65


def test_what_the_events_of_a_scene_change_is_changed_from_the_start():
    done = apply_events(load(SCENES / "swap.toml"))
    assert [table.name for table in done.dissipation] == ["unidirectional-inertia"]
    assert not done.event


def test_what_a_device_file_assumes_is_known_and_what_a_file_built_on_it_measures_is_not():
    files = bundled("devices")
    assert {of.key for of in assumptions(files["omega3"])} == {"device.mass", "device.damping", "friction.kinetic"}
    assert {of.key for of in assumptions(files["falcon"])} == {"device.mass", "device.damping", "friction.kinetic"}
    assert not assumptions(files["premium15"])
    of_cable = {of.key for of in assumptions(files["premium15_cable"])}
    assert {"transmission.stiffness", "transmission.motor_mass"} <= of_cable
    assert "friction.kinetic" not in of_cable


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("mass = 0.3  # kg. ASSUMPTION: weighed with its arm", "weighed with its arm"),
        ("mass = 0.3  # kg, assumption: a guess", "a guess"),
        ("mass = 0.3  # kg. Assumed, never measured", "never measured"),
        ("# ASSUMPTION: a guess,\n# since its drawing is lost\nmass = 0.3  # kg", "a guess, since its drawing is lost"),
        ("# ASSUMPTION: a guess\nmass = 0.3", "a guess"),
        ("mass = 0.3  # ASSUMPTION", "ASSUMPTION"),
    ],
)
def test_a_number_is_assumed_that_its_comment_or_the_lines_above_say_is(tmp_path, line, words):
    mine = tmp_path / "mine.toml"
    mine.write_text(f"# all of this is an assumption\n\n[device]\n{line}\ndamping = 0.1  # N s/m, measured\n")
    assert [(of.key, of.words) for of in assumptions(mine)] == [("device.mass", words)]


@pytest.mark.parametrize("comment", ["", "  # weighed", "  # as measured, without assumptions"])
def test_a_number_of_ones_own_in_place_of_an_assumed_one_is_not_assumed(tmp_path, comment):
    mine = tmp_path / "mine.toml"
    mine.write_text(f'extends = "devices/omega3.toml"\n[device]\nmass = 0.3{comment}\n')
    is_said = "assumptions" in comment
    assert ("device.mass" in {of.key for of in assumptions(mine)}) == is_said


def test_a_device_of_ones_own_is_taken_as_the_presets_are_and_a_scene_with_a_wall_as_a_task(tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text('extends = "omega3.toml"\n[device]\nmass = 0.3  # weighed\n')
    (tmp_path / "omega3.toml").write_text(bundled("devices")["omega3"].read_text())
    asked = make_subject(str(mine), None, None, None, [], KINDS)
    assert not asked.has_task
    assert asked.scene.device.mass == 0.3
    assert {of.key for of in asked.assumed} == {"device.damping", "friction.kinetic"}
    assert make_subject("fig6c", None, None, None, [], KINDS).has_task


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ("[device]\nmass = 0.0", "device.mass is 0.0. It must be above 0 kg"),
        ("[device]\nmass = -0.1", "device.mass is -0.1. It must be above 0 kg"),
        ("[device]\nmass = 1e308", "device.mass is 1e\\+308. It must be at most"),
        ("[device]\nmass = 0.1\n[friction]\nkinetic = 1e308", "friction.kinetic is 1e\\+308. It must be at most"),
        ("[device]\nmass = 0.1\n[encoder]\nresolution = nan", "encoder.resolution is nan. It must be a finite number"),
    ],
)
def test_a_device_of_absurd_numbers_is_refused_with_what_was_expected(tmp_path, tables, words):
    (tmp_path / "mine.toml").write_text(tables)
    with pytest.raises(SceneError, match=words):
        make_subject(str(tmp_path / "mine.toml"), None, None, None, [], KINDS)


@pytest.mark.parametrize(("friction", "refused"), [("kinetic = 0.9", False), ("kinetic = 1.0", True),
                                                   ("kinetic = 0.1\nbreakaway = 50.0", True)])  # fmt: skip
def test_a_device_that_friction_holds_against_the_hand_is_refused_since_any_wall_would_seem_safe(
    tmp_path, friction, refused
):
    (tmp_path / "mine.toml").write_text(f"[device]\nmass = 0.1\ndamping = 0.05\n[friction]\n{friction}\n")
    refusal = pytest.raises(InvalidRequest, match=r"Dry friction of .* holds the device against the hand's 1.00 N")
    with refusal if refused else nullcontext():
        make_subject(str(tmp_path / "mine.toml"), None, None, None, [], KINDS)


@pytest.mark.parametrize(
    ("delay", "overrides", "assumed"),
    [
        (None, [], ["clock.round_trip_delay"]),
        ("2 ms", [], []),
        (None, ["clock.round_trip_delay=2 ms"], []),
        (None, ["clock.control_rate=2000"], ["clock.round_trip_delay"]),
    ],
)
def test_a_number_that_the_command_gives_is_not_assumed_any_more(delay, overrides, assumed):
    subject = make_subject("demo", None, delay, None, ["event=[]", *overrides], KINDS)
    assert [each.key for each in subject.assumed] == assumed


def test_an_element_that_is_none_of_those_tried_is_named_with_what_tries_it() -> None:
    own = {**KINDS, "mine": KINDS["damping"]}
    [*_, note] = make_subject("touch", None, None, None, [], own).notes
    assert note.startswith("The element mine is not tried here")
    assert "A sweep over a parameter" in note
    assert not any("not tried here" in each for each in make_subject("touch", None, None, None, [], KINDS).notes)


def test_a_directory_does_not_hide_the_device_of_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "touch").mkdir()
    assert make_subject("touch", None, None, None, [], KINDS).name == "touch"
