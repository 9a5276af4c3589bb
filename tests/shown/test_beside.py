"""Runs beside one another: the overlay of their figures, and the table of what they differ in."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from haploop.launch.runs.start import prepare, run
from haploop.launch.scene.bundled import of_name
from haploop.protocol.scene.paths import with_value
from haploop.tools.cli.app import app
from haploop.tools.cli.runs_beside import difference_table, parting_words
from haploop.tools.figure.data import RunData
from haploop.tools.figure.difference import Parting, difference, unlike_keys
from haploop.tools.figure.overlay import MOST_RUNS, make_overlay
from haploop.tools.figure.run_labels import labels
from haploop.tools.figure.run_names import run_names, shortened
from helpers.shown import artists, row, shown

PNG = b"\x89PNG"


def made(directory: Path, *overrides: str) -> Path:
    scene = of_name("fig6c", "scenes")
    assert scene
    quick = ["duration=2", 'run.verdict="window"']
    run(prepare(scene, [*quick, *overrides], out=directory), in_process=True)
    return directory


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    base = tmp_path_factory.mktemp("runs")
    found = {
        "a": made(base / "a"),
        "again": made(base / "again", "title=again"),
        "swapped": made(base / "swapped", "title=[swapped]", "event.0.at=1", "event.0.set={'wall.stiffness'=90.0}"),
        "bare": made(base / "bare", "dissipation=[]"),
        "slow": made(base / "slow", "clock.control_rate=500", "clock.round_trip_delay=0"),
    }
    log = (found["a"] / "log.mcap").read_bytes()
    found["killed"] = base / "killed"
    found["killed"].mkdir()
    (found["killed"] / "log.mcap").write_bytes(log[: len(log) * 8 // 10])
    return found


def data(runs: dict[str, Path], *names: str) -> list[RunData]:
    return [RunData.from_directory(runs[name]) for name in names]


def haploop(*words: object):
    return CliRunner().invoke(app, [str(word) for word in words])


def test_two_runs_of_one_scene_do_not_part_and_differ_in_their_names_alone(runs):
    found = difference(*data(runs, "a", "again"))
    assert (found.parting, found.ticks, found.scene) == (None, 2000, {})
    assert found.names[1] == "again"
    assert all(first == second for first, second in found.results.values())
    assert all(first == second for first, second in found.energies_J.values())


def test_runs_part_at_the_first_tick_in_contact_after_their_only_event(runs):
    found = difference(*data(runs, "a", "swapped"))
    assert list(found.scene) == ["event.0.at", "event.0.set.wall.stiffness"]
    first, second = data(runs, "a", "swapped")
    contact = 1000 + int(np.argmax(first.controller["in_contact"][1000:]))
    assert found.parting == Parting(contact, contact / 1000.0, "wall")
    assert np.array_equal(first.controller["total"][:contact], second.controller["total"][:contact])
    assert found.results["trajectory_sha256"][0] != found.results["trajectory_sha256"][1]


def test_what_was_changed_in_one_of_two_live_runs_is_told_though_their_scenes_are_the_same(runs):
    first, second = data(runs, "a", "again")
    live = {"timestamp": 0.25, "tick": 250, "swap": {"kind": "damping", "damping": 0.8}, "element": 0}
    found = difference(first, replace(second, events=[live]))
    assert (found.scene, found.events[0]) == ({}, [])
    words = "at 0.25 s: element 0 becomes damping (damping 0.8 N s/m)"
    assert row(shown(difference_table(found), 200), "what happened") == ["–", words]
    assert "what happened" not in shown(difference_table(difference(first, second)), 200)


def test_a_title_that_both_runs_have_is_no_row_of_what_they_differ_in(runs):
    told = shown(difference_table(difference(*data(runs, "a", "bare"))), 140)
    assert not any(line.strip().startswith("title") for line in told.splitlines())
    assert row(shown(difference_table(difference(*data(runs, "a", "again"))), 200), "title")[1] == "again"


def test_an_event_that_a_run_has_not_is_told_as_one_difference_and_that_one_has_in_words(runs):
    given = data(runs, "a", "swapped")
    assert [label.rpartition(" (")[2] for label in labels(given, "ab")] == [
        "without event 0)",
        "at 1 s set wall.stiffness = 90 N/m)",
    ]


def test_the_heads_of_diff_are_the_directories_however_they_are_named_and_reached(runs, monkeypatch):
    twice = haploop("diff", runs["a"], runs["a"]).stdout.split("\n", 2)[1].split("  ")
    assert [*filter(None, map(str.strip, twice))] == ["a", "a (2)"]
    odd = runs["a"].parent / "[bold]x"
    odd.symlink_to(runs["again"])
    assert run_names([runs["a"] / ".." / "a", odd]) == ["a", "[bold]x"]
    monkeypatch.chdir(runs["a"])
    assert haploop("diff", ".", runs["bare"]).stdout.split("\n", 2)[1].split() == ["a", "bare"]
    table = difference_table(replace(difference(*data(runs, "a", "again")), runs=("[bold]x", "y")))
    assert "[bold]x" in shown(table, 140), "brackets are no markup"


@pytest.mark.parametrize(
    ("paths", "names"),
    [
        (["one/run", "two/run", "three/other"], ["one/run", "two/run", "three/other"]),
        (["x/one/run", "y/one/run"], ["x/one/run", "y/one/run"]),
        (["a", "b", "a", "a"], ["a", "b", "a (2)", "a (3)"]),
        (
            ["2026-11-26_premium15_cable_of_two_metres_K1", "2026-11-26_premium15_cable_of_two_metres_K2", "a"],
            ["…K1", "…K2", "a"],
        ),
        (
            ["l" * 30 + "1" + "r" * 30, "l" * 30 + "2" + "r" * 30],
            ["l" * 30 + "1" + "r" * 30, "l" * 30 + "2" + "r" * 30],
        ),
    ],
)
def test_a_run_is_named_by_as_much_of_its_path_as_tells_it_apart(paths, names):
    assert shortened(run_names([Path("/") / path for path in paths])) == names


def test_of_a_killed_run_the_ticks_that_are_there_are_compared_and_no_energies(runs):
    found = difference(*data(runs, "a", "killed"))
    assert found.parting is None
    assert 0 < found.ticks < 2000
    assert found.results["ended"] == ("done", "killed")
    assert {second for _, second in found.energies_J.values()} == {None}


def test_ticks_of_unlike_clocks_are_not_compared(runs):
    found = difference(*data(runs, "a", "slow"))
    assert found.parting is None
    assert found.why_not == "Ticks are not compared: one run has 1000 a second, the other 500."


def test_runs_that_part_at_their_first_tick_have_no_bits_that_are_the_same(runs):
    found = replace(difference(*data(runs, "a", "swapped")), parting=Parting(0, 0.0, "wall"))
    assert parting_words(found) == (
        "They part at their first tick, where the force of the wall (column wall) differs first."
    )


def test_diff_tells_it_as_a_table_and_as_one_json_object(runs):
    told = haploop("diff", runs["a"], runs["swapped"])
    assert told.exit_code == 0
    assert re.search(r"They part at tick (1\d\d\d), at 1.\d+ s: up to there every bit is the same, then", told.stdout)
    assert "the force of the wall (column wall) differs first." in " ".join(told.stdout.split())
    heads = told.stdout.split("\n", 2)[1].split()
    assert heads == ["a", "swapped"], "the directories tell the runs apart"
    rows = [line.split("  ")[0].strip() for line in told.stdout.splitlines()]
    assert {"commanded force, peak to peak", "pushed, it swings by", "wall and elements together"} <= {
        *map(str.strip, rows)
    }
    assert "[swapped]" in told.stdout, "brackets are no markup"
    assert re.search(r"event.0.at +– +1 s", told.stdout)
    assert re.search(r"event.0.set.wall.stiffness +– +90", told.stdout)
    bare = haploop("diff", runs["a"], runs["bare"]).stdout
    assert re.search(r"dissipation.0.mass +0.01 kg +–", bare)
    assert json.loads(haploop("diff", runs["a"], runs["swapped"], "--json").stdout)["parting"]["column"] == "wall"
    assert "holds no log.mcap" in haploop("diff", runs["a"], runs["a"].parent).stderr


def test_an_overlay_draws_every_run_with_its_name_and_what_differs(runs):
    given = data(runs, "a", "swapped", "killed", "slow")
    names = ["a", "swapped", "killed", "slow"]
    figure = make_overlay(given, names)
    assert len(artists(figure, "position")) == 2 * len(given), "the close view is where the killed one is, too"
    told = [text.get_text() for text in artists(figure, "label")]
    # What has no room is cut off.
    assert all(full.startswith(seen.rstrip(" …")) for full, seen in zip(labels(given, names), told, strict=True))
    assert all(label.startswith(f"{name}: ") for label, name in zip(told, names, strict=True))
    assert "clock.control_rate 500 Hz" in told[3]
    assert not any("–" in label for label in labels(given, names)), "a key that a run has not is not told of it"
    assert labels(data(runs, "a", "a"), ["a", "a (2)"]) == ["a", "a (2)"], "nothing differs but the name"
    assert labels(data(runs, "a", "again"), ["a", "again"])[1] == "again", "a title that is the name is not told twice"
    with_one, without = data(runs, "a", "bare")
    assert labels([with_one, without], ["a", "bare"]) == [
        "a: with unidirectional-inertia (mass 0.01 kg)",
        "bare: without unidirectional-inertia",
    ]
    titles = artists(make_overlay([with_one, without], ["a", "bare"]), "title")
    assert [text.get_text() for text in titles] == [without.scene.title]
    beside = difference(with_one, without).energies_J
    assert None not in beside["together"], "of one book, that is all of it"
    assert beside["together"][1] == beside["wall"][1]
    assert list(unlike_keys([given[0].scene, given[3].scene])) == ["clock.control_rate", "clock.round_trip_delay"]
    drawn = artists(figure, "energy")[0].get_ydata()
    taken_J = given[0].books()[-1].true_J
    assert drawn[-1] / drawn.min() == pytest.approx(taken_J[-1] / taken_J.min())


def test_the_close_view_of_runs_of_unlike_length_is_where_all_of_them_are(runs, tmp_path):
    short = made(tmp_path / "short", "duration=1.2")
    given = [RunData.from_directory(short), *data(runs, "a")]
    assert given[1].close_s()[1] > given[0].span_s[1], "the last of the longer is beyond the end of the shorter"
    closer = next(
        ax for ax in make_overlay(given, "ab").get_axes() if ax.get_title(loc="left") == "Position, close view"
    )
    assert closer.get_xlim()[1] <= given[0].span_s[1] + 0.01
    assert len(artists(closer, "position")) == 2


@pytest.mark.slow
def test_below_an_overlay_the_notes_of_each_run_stand_with_its_name_and_shared_ones_once(runs):
    plain, odd = data(runs, "a", "bare")
    soft = replace(odd, scene=with_value(odd.scene, "wall.stiffness", 15.0))

    def below(*given: RunData) -> list[str]:
        return [text.get_text() for text in artists(make_overlay(given, "abcde"[: len(given)]), "note")]

    note = "A note on its scene: wall.stiffness is 15 N/m; is that the unit you meant?"
    assert below(plain, plain) == []
    assert [line.partition(" Haptic")[0] for line in below(plain, soft)] == [f"b: {note}"]
    assert [line.partition(" Haptic")[0] for line in below(soft, plain, soft)] == [f"a, c: {note}"]
    assert [line.partition(" Haptic")[0] for line in below(soft, soft)] == [f"all runs: {note}"]
    failed = replace(plain, summary=plain.summary | {"ended": "failed", "why": "The plant failed: " + "x y " * 60})
    lines = below(*[soft] * 4, failed)
    assert lines[1].startswith("e: The plant failed: x y")
    assert max(map(len, lines)) < 200


@pytest.mark.slow
def test_each_overlay_has_a_file_of_its_own_in_the_first_directory(runs):
    for other in ("again", "bare"):
        assert haploop("plot", runs["a"], runs[other]).stdout.strip() == str(runs["a"] / f"with_{other}.png")


def test_beside_a_verdict_its_provisos_are_told_in_full_in_overlay_and_table(runs):
    held, other = data(runs, "a", "swapped")
    found = {"stability": {"provisos": ["only friction holds it"]}}
    held = replace(held, every_step=False, summary=held.summary | found)
    numbers = [text.get_text() for text in artists(make_overlay([held, other], "ab"), "numbers")]
    assert numbers[0].startswith("only friction holds it; oscillation")
    assert [text.endswith("; position as measured") for text in numbers] == [True, False]
    table = shown(difference_table(difference(held, other)), 140)
    assert row(table, "provisos") == ["only friction holds it", "–"]
    assert len(row(table, "trajectory hash")[0]) == 16


def test_of_a_run_that_was_not_pushed_no_swing_after_a_push_is_told(runs):
    held, other = data(runs, "a", "swapped")
    untouched = replace(other, summary=other.summary | {"stability": {"push_N": None, "width_m": None}})
    pushed = replace(held, summary=held.summary | {"stability": {"push_N": 0.3, "width_m": 2e-3}})
    table = shown(difference_table(difference(pushed, untouched)), 140)
    assert row(table, "pushed, it swings by") == ["2.00 mm", "–"]


@pytest.mark.slow
def test_plot_of_several_runs_writes_one_figure_and_refuses_what_it_cannot_draw(runs, tmp_path):
    done = haploop("plot", runs["a"], runs["again"], "--out", tmp_path / "both.png")
    assert done.exit_code == 0
    assert (tmp_path / "both.png").read_bytes().startswith(PNG)
    many = haploop("plot", *[runs["a"]] * (MOST_RUNS + 1))
    assert many.exit_code == 2
    assert "At most 6 runs can be told apart in one figure, but 7 were given; draw fewer." in many.stderr
