"""Numbers and files that cannot be meant: refused with a sentence before anything is allocated."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from haploop.launch.plan.effects import notes
from haploop.launch.scene.file import load
from haploop.launch.scene.mistakes import SceneError
from haploop.protocol.quantity import MEANT, Quantity
from helpers.scenes.least import KINDS, LEAST, WALL, scene

SCENES = Path(__file__).parents[2] / "launch" / "scenes"
FIG6C = SCENES / "fig6c.toml"
BASE = f'extends = "{FIG6C}"\n'


def refused(path: Path, *overrides: str) -> str:
    with pytest.raises(SceneError) as caught:
        load(path, overrides)
    return str(caught.value)


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    [
        (["duration=1e300"], "It must be at most 1e+09 s, which is thirty years."),
        (["duration=1e9", "clock.control_rate=10000"], "duration must cover at most 10000000000 control ticks"),
        (["clock.round_trip_delay=1e6"], "It must be at most 10 s."),
        (["clock.plant_rate=1000000000000"], "It must be at most 1e+07 Hz."),
        (["clock.plant_rate=1000000", "clock.control_rate=10"], "at most 10000 times control_rate"),
        (
            ["clock.plant_rate=1000000", "clock.control_rate=1000000", "clock.round_trip_delay=1"],
            "at most 0.1 s at 1000000 Hz: all commands on their way are in memory at once",
        ),
        (["wall.stiffness=1e308"], "It must be at most 1e+09 N/m, which is a steel bar"),
        (["wall.position=-1e300"], "It must be at least -1e+06 m"),
        (["device.mass=1e-300"], "It must be at least 1e-09 kg"),
        (["encoder.resolution=1e-300"], "It must be at least 1e-15 m"),
        (["jitter.kind=gamma", "jitter.mean=1e-3", "jitter.deviation=1e300"], "It must be at most 10 s."),
        (["jitter.kind=uniform", "jitter.most=1e300"], "It must be at most 10 s."),
        (["event.0.at=1e308", "event.0.pause=true"], "It must be at most 1e+09 s"),
        (["event.0.at=0.5", 'event.0.set={"wall.stiffness"=1e308}'], "It must be at most 1e+09 N/m"),
        (["event.0.at=0.5", 'event.0.set={"clock.round_trip_delay"=1e6}'], "It must be at most 10 s."),
        (["velocity.estimator=window", "velocity.ticks=1000000000000"], "It must be at most 10000."),
        (["run.block_ticks=1000000000000"], "It must be at most 1e+06."),
        (["wall.stiffness=0x" + "f" * 5000], "is a number of thousands of digits."),
        (["x=" + "[" * 3000 + "]" * 3000], "x is not a key of a scene."),
        (["a." * 3000 + "b=1"], "It must have the form KEY=VALUE with a dotted key"),
    ],
)
def test_a_number_that_no_loop_has_is_refused_with_its_bound(overrides, sentence):
    assert sentence in refused(FIG6C, *overrides)


def test_a_number_that_hardly_any_loop_has_is_a_scene_and_asked_after():
    assert not notes(load(FIG6C))
    [slow] = notes(load(FIG6C, ["clock.round_trip_delay=5", "duration=20"]))
    assert slow.startswith("clock.round_trip_delay is 5 s; is that the unit you meant?")
    assert "No force takes effect within the run" in notes(load(FIG6C, ["clock.round_trip_delay=5"]))[1]
    [soft] = notes(load(FIG6C, ["wall.stiffness=0.15"]))
    assert soft.startswith("wall.stiffness is 0.15 N/m; is that the unit you meant?")
    assert not notes(load(FIG6C, ["wall.stiffness=0.15 N/mm"]))


@pytest.mark.parametrize("unit", MEANT)
def test_a_bound_by_unit_stands_in_where_a_quantity_declares_none_of_its_own(unit):
    most, _, least = MEANT[unit]
    bare, positive, own = Quantity(unit), Quantity(unit, above=0), Quantity(unit, at_least=-1e300, at_most=1e300)
    assert [bare.complaint(value) for value in (most, -most, 0.0, least / 2)] == [None] * 4
    assert "at most" in str(bare.complaint(2 * most))
    assert "in the other direction" in str(bare.complaint(-2 * most))
    assert positive.complaint(least) is None
    assert "with less, numbers in a loop overflow" in str(positive.complaint(least / 2))
    assert own.complaint(2 * most) is own.complaint(-2 * most) is None


def test_every_shipped_scene_keeps_within_the_bounds():
    for path in SCENES.rglob("*.toml"):
        assert not [note for note in notes(load(path)) if "was meant" in note]


def test_tables_lists_and_files_deep_in_one_another_are_refused(tmp_path):
    deep = tmp_path / "deep.toml"
    for text in (
        "[" + ".".join("a" * 3000) + "]\n",
        "x = " + "[" * 3000 + "]" * 3000,
        "x = " + "{a=" * 50 + "1" + "}" * 50,
    ):
        deep.write_text(f"{BASE}{text}\n")
        assert "nested at most 32 deep" in refused(deep)
    for number in range(1500):
        (tmp_path / f"{number}.toml").write_text(f'extends = "{number + 1}.toml"\n')
    (tmp_path / "1500.toml").write_text(BASE)
    assert "At most 32 files may extend one another" in refused(tmp_path / "0.toml")
    assert load(tmp_path / "1480.toml").duration == 3.0


def test_files_that_each_extend_the_next_one_twice_are_not_read_a_million_times(tmp_path):
    for number in range(25):
        (tmp_path / f"{number}.toml").write_text(f'extends = ["{number + 1}.toml", "{number + 1}.toml"]\n')
    (tmp_path / "25.toml").write_text(BASE)
    assert "100 in all" in refused(tmp_path / "0.toml")


def test_a_circle_is_told_through_links_too(tmp_path):
    (tmp_path / "here").symlink_to(".")
    (tmp_path / "a.toml").write_text('extends = "here/b.toml"\n')
    (tmp_path / "b.toml").write_text('extends = "here/here/a.toml"\n')
    assert "A scene cannot extend itself" in refused(tmp_path / "a.toml")
    (tmp_path / "c.toml").symlink_to("d.toml")
    (tmp_path / "d.toml").symlink_to("c.toml")
    (tmp_path / "e.toml").write_text('extends = "c.toml"\n')
    assert "Too many levels of symbolic links" in refused(tmp_path / "e.toml")


def test_a_pipe_or_a_device_is_no_scene_and_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for name in (str(tmp_path / "pipe"), "/dev/zero"):
        (tmp_path / "a.toml").write_text(f'extends = "{name}"\n')
        assert "It is a pipe or a device, not a file." in refused(tmp_path / "a.toml")
        assert "It is a pipe or a device" in refused(FIG6C, "hand.force.kind=trace", f"hand.force.file={name}")
    (tmp_path / "a.toml").write_text('extends = "a\\u0000b"\n')
    assert "It must be the path of a scene file" in refused(tmp_path / "a.toml")


def test_the_same_mistake_in_many_entries_of_a_list_is_told_once_and_in_a_few_each_time() -> None:
    def told(forces: list[str]) -> list[str]:
        trace = '{ kind = "trace", time = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5], force = [' + ", ".join(forces) + "] }"
        return refused(FIG6C, f"hand.force={trace}").splitlines()

    [mistake] = told(["0.0", *["nan"] * 5])
    assert "hand.force.force.1 is nan. It must be a finite number of N. The same is wrong with 4 more" in mistake
    assert len(told(["0.0", "0.0", "0.0", *["nan"] * 3])) == 3
    assert len(told(["nan"] * 3 + ['"a"'] * 3)) == 6


def test_of_thousands_of_mistakes_fifty_are_told(tmp_path):
    path = tmp_path / "many.toml"
    path.write_text(BASE + "\n".join(f"k{number} = 1" for number in range(1000)))
    told = refused(path).splitlines()
    assert (len(told), told[-1]) == (51, "... and 950 more mistakes.")
    path.write_text(BASE + "\n".join(f"k{number} = 1" for number in range(20_000)))
    assert "There are 20001 keys, but at most 2000 were expected." in refused(path)


def test_what_stands_after_an_element_that_limits_is_noted_and_nothing_else_is() -> None:
    bounding, damping = {"kind": "force-bounding"}, {"kind": "damping", "damping": 1.0}
    thrown = {"wall": WALL, "device": LEAST["device"] | {"velocity": -1.0}}
    assert not notes(scene(**thrown, dissipation=[damping, bounding]), KINDS)
    [note] = notes(scene(**thrown, dissipation=[bounding, damping]), KINDS)
    assert note.startswith("dissipation.0 (force-bounding) changes the force of the wall")
    assert "dissipation.1 (damping) comes after it" in note


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ('encoder = { bits = 4096, range = "0.2 m" }', "is 4096. It must be at most 64. 4096 counts are 12 bits."),
        ('encoder = { bits = 4000, range = "0.2 m" }', '4000 counts over 0.2 m are resolution = "0.2 m / 4000".'),
        ('wall.stiffness = "1 n/mm"', '"n/mm" is not a unit; did you mean N/mm?'),
        ('wall.stiffness = "1 N/mm^2"', "N/mm^2 is a pressure; a stiffness was expected, such as N/m."),
        ('clock.round_trip_delay = "1.55 ms"', 'is "1.55 ms". The round_trip_delay must be a whole number'),
        ('clock.round_trip_delay = "1.55 ms"', "With clock.plant_rate = 20000 it is 31 of them."),
        ('event = [{ at = 0.5, swap = "damping" }]', 'a table, such as { kind = "damping", damping = 0.8 }.'),
        (
            'event = [{ at = 0.5, set = { "hand.stiffnes" = 3 } }]',
            "cannot be set. Nothing in [hand] changes during a run.",
        ),
        ("actuator.continuous = 3.0", "the continuous force for walls that are pressed for long"),
    ],
)  # fmt: skip
def test_a_mistake_is_quoted_as_it_was_written_with_what_would_do(tmp_path, wrong, told):
    (tmp_path / "a.toml").write_text(f"{BASE}{wrong}\n")
    with pytest.raises(SceneError) as caught:
        load(tmp_path / "a.toml")
    assert told in str(caught.value)


def test_a_word_that_is_hardly_alike_is_not_offered(tmp_path):
    (tmp_path / "a.toml").write_text(f'{BASE}event = [{{ at = 0.5, swap = {{ kind = "spring" }} }}]\n')
    with pytest.raises(SceneError, match=r'swap\.kind is "spring"\. Allowed'):
        load(tmp_path / "a.toml")
