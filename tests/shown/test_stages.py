"""Bars of stages: a line a stage without a terminal, a bar that moves with one."""

from __future__ import annotations

import io
from typing import Any

import pytest
from rich.console import Console

from haploop.tools.render import progress
from haploop.tools.render.progress import bars


def test_without_a_terminal_a_stage_tells_what_is_done_ten_times_at_most(capsys: pytest.CaptureFixture[str]) -> None:
    with bars() as stage:
        advance = stage("runs", 2)
        advance()
        advance()
    shown = capsys.readouterr()
    assert (shown.out, shown.err) == ("", "runs: 0 of 2\nruns: 1 of 2\nruns: 2 of 2\n")
    with bars() as stage:
        advance = stage("runs", 1000)
        for _ in range(1000):
            advance()
    lines = capsys.readouterr().err.splitlines()
    assert (lines[0], lines[-1], len(lines)) == ("runs: 0 of 1000", "runs: 1000 of 1000", 11)


def test_on_a_terminal_a_bar_counts_the_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = io.StringIO()

    def terminal(**_: Any) -> Console:
        return Console(file=screen, force_terminal=True, width=80)

    monkeypatch.setattr(progress, "console", terminal)
    with bars() as stage:
        advance = stage("runs", 3)
        advance()
    assert "runs" in screen.getvalue()
    assert "1/3" in screen.getvalue()
