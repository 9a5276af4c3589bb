"""The report of a run on the terminal: its numbers, in units, at any width."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Annotated, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from haploop.controller.dissipation import Element, Motion, registry
from haploop.launch.plan.meant.rule import Note
from haploop.launch.runs.start import prepare, run
from haploop.protocol.amounts import amount, fixed
from haploop.protocol.quantity import Quantity
from haploop.tools.render.listings import plugins_table, status_table
from haploop.tools.render.progress import ProgressLine
from haploop.tools.render.report import how_often, leak_rows, summary_table
from haploop.tools.render.terminal import told
from helpers.shown import row, shown

SCENES = Path(__file__).parents[2] / "launch/scenes"
STATUS = {"t_s": 1.25, "verdict": "limit-cycle", "oscillation_m": 1.23e-3, "residual_J": 3e-18}


@pytest.mark.parametrize("width", [80, 100, 140])
def test_the_summary_table_holds_every_book_and_the_residual(swap: dict[str, Any], width: int) -> None:
    text, energy = shown(summary_table(swap), width), swap["energy"]
    damping, inertia = energy["elements"]
    books = text[text.index("taken out of the device") :]
    assert row(books, "wall") == [amount(energy["wall"][side], "J") for side in ("true_J", "sampled_J")]
    books = [amount(damping["true_J"], "J"), amount(damping["sampled_J"], "J")]
    assert row(text, "damping (damping 0.8)") == ["0–1.5 s", *books]
    books = [amount(inertia["true_J"], "J"), amount(inertia["sampled_J"], "J")]
    assert row(text, "unidirectional-inertia (mass 0.01)") == ["1.5–3 s", *books]
    window = swap["window"]
    swing, ripple = (amount(window[key], "N") for key in ("force_swing_N", "force_ripple_N"))
    assert row(text, "commanded force") == [f"{swing} peak to peak at its end"]
    assert f"{ripple} peak to peak, above about 30 Hz only" in " ".join(text.split())
    assert row(text, "leak by delay") == [amount(energy["wall"]["leak"]["delay_J"], "J")]
    assert row(text, "work of the hand") == [amount(energy["hand_work_J"], "J")]
    assert row(text, "heat in the device") == [amount(energy["device_heat_J"], "J")]
    share = f"residual, {energy['residual_J'] / energy['moved_J']:.1e} of what moved"
    assert row(text, share) == [amount(energy["residual_J"], "J")]
    assert max(map(len, text.splitlines())) <= width


@pytest.mark.parametrize(
    ("seen_Hz", "pushed_Hz", "told"),
    [
        (30.0, 30.2, ""),
        (9.0, 9.37, ""),
        (20.0, 9.37, ", at about 20 Hz"),
        (20.2, None, ", at about 20 Hz"),
        (None, 9.37, ""),
    ],
)
def test_the_frequency_of_a_run_is_told_where_it_is_not_that_of_its_pushed_loop(
    seen_Hz: float | None, pushed_Hz: float | None, told: str
) -> None:
    assert how_often({"window": {"frequency_Hz": seen_Hz}, "stability": {"frequency_Hz": pushed_Hz}}) == told


def test_a_stiffness_that_the_actuator_did_not_give_is_said_to_be_commanded(tmp_path: Path) -> None:
    """A wall of 2 N/mm behind an actuator of 0.3 N was said to display 2 N/mm, and displayed 0.6 N/mm."""
    sets = ["duration=0.6", "actuator.saturation=0.3", "hand.force.value=-0.9"]
    of = run(prepare(SCENES / "premium_press.toml", sets, out=tmp_path / "o"), in_process=True)
    assert of["actuator"]["saturated_commands"]
    rests = {**of, "verdict": "steady", "window": of["window"] | {"displayed_stiffness_N_m": 2000.0}}
    assert "of the command: the actuator gave less at times" in " ".join(shown(summary_table(rests), 140).split())
    whole = rests | {"actuator": {"saturated_commands": 0}}
    assert "the actuator gave less" not in shown(summary_table(whole), 140)


def test_changes_of_the_wall_have_a_row_so_that_the_rows_of_the_wall_sum_to_it(tmp_path: Path) -> None:
    softer = "event=[{at=0.4, set={'wall.stiffness'=900.0}}]"
    of = run(prepare(SCENES / "premium_press.toml", ["duration=0.6", softer], out=tmp_path / "o"), in_process=True)
    wall = of["energy"]["wall"]
    rows = leak_rows(wall)
    assert rows["changes of the wall in contact"] == -wall["changes_J"] != 0.0
    assert sum(filter(None, rows.values())) == pytest.approx(wall["true_J"], rel=1e-9)
    assert "changes of the wall in contact" in shown(summary_table(of))


def test_the_report_ends_with_the_verdict_and_the_first_of_the_notes_and_without_notes_with_its_books(
    swap: dict[str, Any],
) -> None:
    two = [Note("The wall is soft.", "wall"), Note("The run is long.", "duration")]
    ends = [shown(summary_table(swap, two[:count]), 200).strip().splitlines()[-1] for count in (1, 2)]
    word = swap["verdict"]
    assert ends[0] == f"Verdict: {word}. A note on its scene: The wall is soft."
    assert ends[1] == f"Verdict: {word}. 2 notes on its scene; the first: The wall is soft."
    assert shown(summary_table(swap), 200) in shown(summary_table(swap, two), 200), "all else is as it was"


def test_why_there_is_no_contact_stands_at_the_verdict_of_a_run_without(swap: dict[str, Any]) -> None:
    note = Note("The wall is never reached.", "wall", keeps_off=True)
    assert shown(summary_table({**swap, "verdict": "no-contact"}, [note]), 200).count("never reached") == 2
    assert shown(summary_table(swap, [note]), 200).count("never reached") == 1


def test_the_summary_table_begins_with_the_verdict_and_what_was_seen(swap: dict[str, Any]) -> None:
    first, second = shown(summary_table(swap), 200).splitlines()[:2]
    assert first.split() == [swap["verdict"], *swap["title"].split()]
    assert swap["verdict_rule"].startswith(second.strip().rstrip("."))


def test_a_run_that_was_not_judged_is_told_by_what_was_seen_also_by_a_summary_of_an_earlier_version(
    swap: dict[str, Any],
) -> None:
    unjudged = {key: value for key, value in swap.items() if key != "stability"}
    words = ("steady", "no-swing-seen", "limit-cycle", "swinging", "undecided", "no-contact")
    assert [told({**unjudged, "verdict": word}) for word in words] == [
        "no swing seen", "no swing seen", "swinging", "swinging", "undecided", "no-contact",
    ]  # fmt: skip
    short = [told({**unjudged, "verdict": word, "duration_s": 0.2}) for word in words[:4]]
    assert short == ["too short to see", "too short to see", "swinging", "swinging"]
    assert told({**swap, "verdict": "steady", "duration_s": 0.2}) == "steady"
    assert row(shown(summary_table({**swap, "ticks": 1}), 100), "ran")[0].startswith("3 s, 1 tick, in")


def test_a_scene_without_wall_or_hand_shows_no_wall_and_an_early_end_is_said(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text("duration = 0.1\n[device]\nmass = 0.1\ndamping = 0.5\n", encoding="utf-8")
    summary = run(prepare(scene, out=tmp_path / "run"), in_process=True)
    text = shown(summary_table(summary))
    assert text.startswith("no-contact")
    assert "leak" not in text
    assert "heat in the hand" not in text
    assert "ended early" not in text
    assert "ended early: stopped" in shown(summary_table({**summary, "ended": "stopped"}))


def test_a_number_that_the_summary_does_not_have_is_a_dash(swap: dict[str, Any]) -> None:
    energy = {**swap["energy"], "residual_J": None, "hand_work_J": None}
    assert row(shown(summary_table({**swap, "energy": energy})), "work of the hand") == ["–"]


def test_lost_commands_are_told_and_only_then(swap: dict[str, Any]) -> None:
    lost = {"commands_dropped": 0, "commands_lost": 7, "telemetry_gaps": 0}
    assert "7 commands lost" in shown(summary_table({**swap, "lost": lost}))
    assert "lost" not in shown(summary_table(swap))


LATE = {
    "median_s": 0.00049,
    "percent_99_s": 0.0028,
    "most_s": 1.0115,
    "late_ticks": 12,
    "late_s": 0.001,
    "ticks": 3000,
    "lost_s": 0.98,
}
WORDS = "490 µs (median), 2.80 ms (99 %), 1.01 s at most; 12 of 3000 by more than 1.00 ms; 980 ms of real time lost"


def test_how_late_the_ticks_of_a_paced_run_were_is_told_and_of_no_other_run(swap: dict[str, Any]) -> None:
    assert "late" not in shown(summary_table(swap))
    told = " ".join(shown(summary_table(swap | {"lateness": LATE}), 80).split())
    assert f"ticks late by {WORDS} oscillation" in told
    assert "lost" not in shown(summary_table(swap | {"lateness": LATE | {"lost_s": 0.0}}))


def test_the_progress_line_is_silent_without_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    with ProgressLine("title", 3.0) as line:
        line.update(STATUS)
        line.update({})
        line.judging()
    assert capsys.readouterr() == ("", "")


def test_the_progress_line_shows_time_verdict_oscillation_and_residual_on_a_terminal() -> None:
    screen = io.StringIO()
    with ProgressLine("title", 3.0, Console(file=screen, force_terminal=True, width=100)) as line:
        line.announce("a1b2c3")
        line.update({})
        line.update(STATUS)
        line.judging()
    for words in ("a1b2c3", "1.25/3 s", "swinging", "1.23 mm", "residual 3e-18 J", "to be judged"):
        assert words in screen.getvalue()


@pytest.mark.parametrize("width", [40, 80, 100])
def test_the_progress_line_keeps_to_one_line(width: int) -> None:
    line = ProgressLine("title", 1e4)
    line.announce("a1b2c3")
    text = line.line({**STATUS, "t_s": 9999.0}, 123.4, width)
    assert text.cell_len <= width
    assert "\n" not in text.plain


def test_the_bar_fills_with_the_share_of_the_run_that_is_done() -> None:
    line = ProgressLine("title", 2.0)
    bars = [line.line({**STATUS, "t_s": t}, 0.0, 100).plain for t in (0.0, 1.0, 2.0)]
    assert [bar.count("━") for bar in bars] == [0, 12, 24]


@pytest.mark.parametrize("width", [80, 120])
def test_the_status_table_tells_of_every_node_its_tick_its_lag_whom_it_waits_for_and_what_it_skipped(
    width: int,
) -> None:
    node = {"pid": 11, "tick": 1210, "behind_ticks": 0, "waits_for": "", "lossless": True, "skipped_ticks": 0}
    nodes = [
        {**node, "role": "plant"},
        {**node, "role": "controller", "tick": 1209, "behind_ticks": 1},
        {**node, "role": "logger", "tick": 1200, "behind_ticks": 10, "waits_for": "plant"},
        {**node, "role": "plotjuggler", "pid": 4194303, "tick": 10, "behind_ticks": 1200, "lossless": False},
        {**node, "role": "view", "lossless": False, "skipped_ticks": 6000},
    ]
    data = {
        "run": "a1b2c3", "title": "a tap", "tick": 1200, "end": 3000, "control_rate": 1000, "paused": True, "pace": 0.5,
        "nodes": nodes, "status": STATUS,
    }  # fmt: skip
    text = shown(status_table(data), width)
    assert "paused  1.2 s of 3 s, tick 1200 of 3000, at pace 0.5" in text
    assert "swinging in its last half second, oscillation 1.23 mm" in text
    assert row(text, "plant") == ["11", "1210", "–", "–", "–"]
    assert row(text, "controller") == ["11", "1209", "1 tick, 1.00 ms", "–", "–"]
    assert row(text, "logger") == ["11", "1200", "10 ticks, 10.0 ms", "plant", "–"]
    assert row(text, "plotjuggler") == ["4194303", "10", "1200 ticks, 1.20 s", "–", "0 ticks"]
    assert row(text, "view") == ["11", "1210", "–", "–", "6000 ticks"]
    assert max(map(len, text.splitlines())) <= width
    going = shown(status_table({**data, "paused": False, "pace": "free", "status": {}}))
    assert "paused" not in going
    settling = shown(status_table({**data, "status": {**STATUS, "verdict": "undecided"}}), width)
    assert "settling, oscillation 1.23 mm" in settling
    assert "tick 1200 of 3000, as fast as it goes" in going


def test_the_plugins_table_tells_kind_meaning_unit_bounds_and_default() -> None:
    class Glue(Element):
        """Sticks to what it touches.

        A second paragraph.
        """

        kind = "glue"
        grip: Annotated[float, Quantity("N", above=0, at_most=5)] = 2.5

        def force(self, motion: Motion) -> float:
            return -self.grip * motion.v

    text = shown(plugins_table({"glue": Glue}), 120)
    assert row(text, "glue") == ["Sticks to what it touches.", "grip (N), above 0, at most 5, default 2.5"]
    assert "second" not in text
    listed = shown(plugins_table(registry()), 100)
    assert all(kind in listed for kind in registry())
    assert "v[k] a[k-1]" in listed  # brackets are no markup


@given(st.floats(min_value=1e-9, max_value=9e5) | st.floats(min_value=-9e5, max_value=-1e-9))
def test_an_amount_means_the_number_it_was_made_of(value: float) -> None:
    """Read back, it differs by half of its last digit at most."""
    number, unit = amount(value, "J").replace("−", "-").split()
    factor = {"kJ": 1e3, "J": 1.0, "mJ": 1e-3, "µJ": 1e-6, "nJ": 1e-9}[unit]
    assert float(number) * factor == pytest.approx(value, rel=0.00501)


def test_amounts_that_no_prefix_suits_or_that_are_none() -> None:
    assert amount(2.75e-18, "J") == "2.75e−18 J"
    assert amount(0.0, "J") == "0 J"
    assert amount(9.997e-5, "J") == "100 µJ"  # three digits, as rounded
    assert amount(None, "J") == "–"
    assert amount(float("inf"), "J") == "inf J"
    assert [fixed(value) for value in (12345.6, 1.0, -0.5, 0.0)] == ["12346", "1.00", "−0.500", "0"]


def test_the_report_of_a_run_says_what_it_does_when_it_is_pushed(
    swap: dict[str, Any],
) -> None:
    found = {
        "rate_1_s": -1.5, "error_1_s": 0.0149, "frequency_Hz": 40.0, "width_m": 2e-3, "spread_m": 1e-4, "felt": True,
        "chaotic": True, "force_ripple_N": 0.4, "watched_s": 2.0, "own_share": 0.93,
    }  # fmt: skip
    told = shown(summary_table({**swap, "stability": found}), 200)
    assert "2.00 mm +- 100 µm peak to peak, at 40.0 Hz, felt, chaotic" in told
    assert "400 mN peak to peak" in told
    assert "-1.5 +- 0.015 1/s, watched for 2 s" in told
    assert "93 % is the loop's own; the rest is" in told
    unknown = shown(summary_table({**swap, "stability": {**found, "own_share": None}}), 200)
    assert "its own" not in unknown
    rests = shown(
        summary_table({**swap, "stability": {**found, "width_m": 2e-18, "felt": False, "chaotic": None}}), 200
    )
    assert row(rests, "held still and pushed, it swings") == ["less than 1 nm peak to peak, not felt"]
    without = {name: value for name, value in swap.items() if name != "stability"}
    assert "held still and pushed, it swings" not in shown(summary_table(without), 200)
