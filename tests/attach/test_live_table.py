"""The live table shows the newest of everything that was heard, with its units, and fits into a terminal."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from haploop.protocol.changes import describe
from haploop.protocol.transport.wire import Frame
from haploop.tools.attach.live_status import LiveStatus
from haploop.tools.attach.live_table import LinePrinter, end_sentence, live_line, live_table
from helpers.scenes.least import typed

WELCOME = {
    "scene": typed(title="a tap on a wall [of 0.15 N/mm]").as_dict(),
    "timebase": {"plant_rate": 10_000, "control_rate": 1_000, "delay_steps": 0, "ticks": 3000},
    "context": {"out": "/nowhere"},
}
DAMPING = {"book": 0, "kind": "damping", "parameters": {"damping": 0.8, "acts": "in-contact"}, "from_tick": 0}
BELOW = {"position": -0.06, "stiffness": 150.0, "into_wall": -1.0}
STATUS = {"t_s": 1.25, "verdict": "limit-cycle", "oscillation_m": 4.7e-3, "residual_J": 3e-18}


def columns(**values: float) -> dict[str, bytes]:
    """Two rows, of which the last one counts."""
    return {name.replace("__", "."): np.array([9.99, value]).tobytes() for name, value in values.items()}


def frames(
    x: float = -0.0612, wall: dict[str, float] = BELOW, elements: Any = (DAMPING,), to: int = 1250
) -> list[tuple[str, Frame]]:
    """One block of each publisher up to a tick."""
    forces = {f"dissipation__{index}": 0.03 for index in range(len(elements))}
    plant = columns(x=x, v=0.012, force=0.18) | {"pieces.step": b""}
    controller = columns(x=x, wall=0.15, total=0.18, **forces)
    books = columns(hand_work=1e-2, moved=2e-2, wall__sampled=-1.1e-2, wall__true=-1.23e-2) | columns(
        damping__sampled=0.5e-3, damping__true=0.6e-3, residual=3e-18
    )
    return [
        ("plant", Frame("PLANT_BLOCK", [to - 1, 1, plant])),
        ("controller", Frame("CONTROLLER_BLOCK", [to - 1, 1, controller, list(elements), wall])),
        ("logger", Frame("ENERGY_BLOCK", [to - 1, 1, books, STATUS])),
    ]


def live_status(**options: Any) -> LiveStatus:
    subject = LiveStatus("a1b2c3", WELCOME)
    subject.ingest([], 0.0)
    subject.ingest(frames(**options), 1.0)
    return subject


def shown(subject: LiveStatus, width: int = 80) -> str:
    terminal = Console(width=width, file=io.StringIO(), highlight=False)
    terminal.print(live_table(subject))
    return terminal.file.getvalue()  # pyright: ignore[reportAttributeAccessIssue]


def row(text: str, begins: str) -> str:
    """The line that begins with some words, without them."""
    [line] = [line for line in text.splitlines() if line.strip().startswith(begins)]
    return " ".join(line.strip().removeprefix(begins).split())


@pytest.mark.parametrize("width", [60, 80, 120])
def test_the_table_holds_the_last_value_of_everything(width: int) -> None:
    text = shown(live_status(), width)
    assert text.splitlines()[0].startswith("a1b2c3  a tap on a wall [of 0.15 N/mm]")
    assert "1.250 s of 3 s, tick 1250" in text
    assert row(text, "so far").startswith("swinging oscillation 4.70 mm")
    assert row(text, "position") == "−61.2 mm 1.20 mm inside the wall"
    assert row(text, "velocity") == "12.0 mm/s"
    assert row(text, "damping") == "600 µJ 500 µJ"
    assert row(text, "residual, 1.5e-16 of what moved") == "3.00e−18 J"
    assert row(text, "skipped") == "0 ticks"
    assert max(map(len, text.splitlines())) <= width


def test_the_force_is_told_in_its_parts() -> None:
    text = shown(live_status(elements=(DAMPING, DAMPING)), 140)
    assert row(text, "force") == "180 mN commanded: wall 150 mN, damping 30.0 mN, damping (1) 30.0 mN"


@pytest.mark.parametrize(
    ("x", "into_wall", "words"),
    [(-0.06, -1.0, "0 m outside"), (-0.048, -1.0, "12.0 mm outside"), (-0.048, 1.0, "12.0 mm inside")],
)
def test_the_wall_has_its_two_sides(x: float, into_wall: float, words: str) -> None:
    assert words in row(shown(live_status(x=x, wall={**BELOW, "into_wall": into_wall})), "position")


def test_without_a_wall_there_is_no_side_of_it_no_force_and_no_book() -> None:
    text = shown(live_status(wall={"position": 0.0, "stiffness": 0.0, "into_wall": 0.0}), 120)
    assert "wall" not in text.partition("\n")[2]


def test_a_run_that_stands_still_is_shown_from_what_its_publishers_say_on_joining() -> None:
    subject = LiveStatus("a1b2c3", WELCOME)
    _, (_, controller), _ = frames()
    state = {"tick": 500, "x": -0.061, "v": 0.0, "force": 0.1, "command": 499}
    subject.ingest(
        [
            ("plant", Frame("STATE", [500, state])),
            ("controller", Frame("STATE", [500, {"history": [controller.as_dict()]}])),
            ("logger", Frame("STATE", [500, STATUS])),
        ],
        0.0,
    )
    subject.note_event(500, {"at": 0.5, "pause": True})
    text = shown(subject)
    assert row(text, "paused").endswith("0.500 s of 3 s, tick 500")
    assert row(text, "position") == "−61.0 mm 1.00 mm inside the wall"
    assert row(text, "so far").startswith("swinging")
    subject.note_event(500, {"resume": True})
    assert "paused" not in shown(subject)


def test_before_anything_came_there_are_dashes_and_no_error() -> None:
    text = shown(LiveStatus("a1b2c3", WELCOME))
    assert row(text, "position") == "–"
    assert row(text, "waiting").endswith("0.000 s of 3 s, tick 0")


def test_the_real_time_factor_is_that_of_the_last_seconds() -> None:
    subject = LiveStatus("a1b2c3", WELCOME)
    for second in range(11):
        subject.ingest(frames(to=1000 + 50 * second), float(second))
    assert subject.factor == pytest.approx(0.05)
    for second in range(11, 21):
        subject.ingest(frames(to=1500 + 200 * (second - 10)), float(second))
    assert subject.factor == pytest.approx(0.2)
    for second in range(21, 31):
        subject.ingest([], float(second))
    assert subject.factor is None


def test_a_change_is_shown_with_its_time_and_tick_whatever_is_in_its_words() -> None:
    """Square brackets are no markup."""
    subject = live_status()
    subject.note_event(1200, {"refused": "swap of element 0 at tick 1200 was refused: ValueError: [red] is no number"})
    assert "[red] is no number, at 1.2 s (tick 1200)" in shown(subject, 200)


@pytest.mark.parametrize(
    ("event", "words"),
    [
        ({"swap": {"kind": "damping", "damping": 0.8}, "element": 0}, "element 0 becomes damping (damping 0.8)"),
        ({"swap": {"kind": "none"}, "element": 1}, "element 1 is removed"),
        ({"set": {"wall.stiffness": 200.0, "clock.round_trip_delay": 0.002}}, "set wall.stiffness = 200, clock.round"),
        ({"pace": 0.1}, "pace 0.1"),
        ({"pace": "free"}, "as fast as it goes"),
        ({"pause": True, "at": 0.5}, "paused"),
        ({"step": 10}, "10 ticks on"),
        ({"stop": True, "by": "signal"}, "stopped"),
    ],
)
def test_every_kind_of_event_has_its_words(event: dict[str, Any], words: str) -> None:
    assert describe(event).startswith(words)


def summary(**changes: Any) -> dict[str, Any]:
    ran = {"ended": "done", "why": "", "verdict": "steady", "stability": {}, "window": {"oscillation_m": 1e-6}}
    return ran | {"duration_s": 3.0, "energy": {"residual_J": 4e-18}} | changes


def window_alone(**changes: Any) -> dict[str, Any]:
    return {key: value for key, value in summary(**changes).items() if key != "stability"}


def test_at_the_end_the_verdict_is_that_of_the_summary() -> None:
    subject = live_status(to=3000)
    subject.end("", summary())
    assert row(shown(subject), "verdict").startswith("steady oscillation 1.00 µm")
    assert end_sentence(subject) == "Run a1b2c3 ended at tick 3000, 3 s."


@pytest.mark.parametrize(
    ("its_summary", "what", "word"),
    [
        (window_alone(), "verdict", "being judged"),
        (window_alone(duration_s=61.0), "seen", "no swing seen"),
        (window_alone(ended="failed"), "seen", "no swing seen"),
        (None, "seen", "swinging"),
    ],
)
def test_what_the_window_saw_of_a_run_that_has_ended_is_no_verdict(its_summary: Any, what: str, word: str) -> None:
    subject = live_status(to=3000)
    subject.end("", its_summary)
    assert row(shown(subject), what).startswith(f"{word} oscillation")


@pytest.mark.parametrize(
    ("failure", "its_summary", "words"),
    [
        ("", summary(ended="stopped"), "ended at tick 1250, 1.25 s (stopped)."),
        ("", summary(ended="diverged", why="the device was at 2 m."), "(diverged): the device was at 2 m."),
        ("The plant was killed by SIGKILL.", None, "(failed): The plant was killed by SIGKILL."),
        ("", None, "ended at tick 1250, 1.25 s."),
    ],
)
def test_how_it_ended_is_a_sentence(failure: str, its_summary: dict[str, Any] | None, words: str) -> None:
    subject = live_status()
    subject.end(failure, its_summary)
    assert end_sentence(subject).endswith(words)


def test_the_line_for_a_pipe_has_numbers_and_units_and_what_was_skipped() -> None:
    subject = live_status()
    words = "1.250 s  x −61.2 mm  force 180 mN  swinging  4.70 mm p-p  residual 3.00e−18 J"
    assert live_line(subject).startswith(words)
    assert "skipped" not in live_line(subject)
    subject.skipped_ticks = 400
    assert live_line(subject).endswith("skipped 400 ticks")


def test_into_a_pipe_go_lines_one_for_every_change_and_none_twice(capsys: pytest.CaptureFixture[str]) -> None:
    lines, subject = LinePrinter(), live_status()
    subject.note_event(1000, {"pause": True})
    lines.show(subject)
    lines.show(subject)
    first = capsys.readouterr().out.splitlines()
    subject.note_event(1250, {"resume": True})
    lines.show(subject)
    subject.end("", summary())
    lines.show(subject)
    rest = capsys.readouterr().out.splitlines()
    assert [line.split("  ")[:2] for line in first] == [["1.000 s", "paused"], ["1.250 s", "x −61.2 mm"]]
    assert [line.split("  ")[1] for line in rest] == ["resumed", "x −61.2 mm"]
    assert "steady" in rest[-1]
