"""Marks of ``make bench COMPARE=FILE`` at what is slower."""

import json
from pathlib import Path

import pytest
from bench import history
from bench.history import changes, keep

YARDSTICKS = {"loop": "yardstick"}
THEN = {"yardstick": [10.0, 20.0, 10.0], "loop": [13.0, 26.0, 13.0]}


def test_an_hour_in_which_the_machine_is_slow_makes_nothing_slower_than_its_yardstick() -> None:
    slow = {name: [2.0 * value for value in values] for name, values in THEN.items()}
    found = changes(THEN, slow, YARDSTICKS)
    assert not found["loop"].is_slower
    assert found["yardstick"].is_slower


@pytest.mark.parametrize(("factor", "is_slower"), [(1.09, False), (1.11, True), (0.5, False)])
def test_a_tenth_is_marked(factor: float, is_slower: bool) -> None:
    now = THEN | {"loop": [factor * value for value in THEN["loop"]]}
    assert changes(THEN, now, YARDSTICKS)["loop"].is_slower is is_slower


def test_what_the_repeats_differ_by_among_themselves_is_not_marked() -> None:
    now = {"loop": [1.0, 1.15, 1.4]}
    assert not changes({"loop": [0.8, 1.0, 1.2]}, now, {})["loop"].is_slower


def test_only_the_last_run_of_the_same_processor_and_python_is_compared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(history, "HISTORY", tmp_path / "bench.jsonl")
    other = tmp_path / "other.jsonl"
    keep("bench", THEN, YARDSTICKS, other)
    assert "Nothing to compare with" in capsys.readouterr().out
    (mine,) = map(json.loads, history.HISTORY.read_text(encoding="utf-8").splitlines())
    other.write_text(json.dumps(mine | {"machine": "another"}) + "\n", encoding="utf-8")
    keep("bench", THEN, YARDSTICKS, other)
    assert "Nothing to compare with" in capsys.readouterr().out
    keep("bench", THEN | {"loop": [26.0, 52.0, 26.0]}, YARDSTICKS, history.HISTORY)
    assert "SLOWER" in capsys.readouterr().out
