"""Judging in a process of its own, where the code of a plugin may do anything."""

from __future__ import annotations

from pathlib import Path

import pytest

from haploop.controller.dissipation import registry
from haploop.launch.runs.judging import judge_elsewhere
from haploop.launch.scene.check import resolve
from haploop.launch.scene.reading.layers import Layers
from helpers.scenes.least import LEAST
from helpers.scenes.pressed import pressed

# The run itself takes 300 ticks; what comes later is the judging.
LATER = """
import os, time
from haploop.controller.dissipation import Element

class Late(Element):
    kind = "late"
    memory = 0.0

    def force(self, motion, ticks):
        if ticks == 350.0:
            {at_350}
        return 0.0, ticks + 1.0
"""


@pytest.mark.parametrize(
    ("at_350", "deadline_s", "word", "says"),
    [
        ("pass", 30, "steady", ""),
        ("time.sleep(1000)", 0.2, "undecided", "its plugins did not return within 0.8 s"),
        ("os._exit(3)", 30, "undecided", "ended with status 3"),
        ("raise ValueError('enough')", 30, "undecided", "ValueError: enough"),
    ],
)
def test_code_that_hangs_dies_or_raises_while_it_is_judged_leaves_the_verdict_undecided_and_says_why(
    tmp_path: Path, at_350: str, deadline_s: float, word: str, says: str
) -> None:
    path = tmp_path / "late.py"
    path.write_text(LATER.format(at_350=at_350))
    tables = LEAST | pressed(duration=0.3, run={"deadline": deadline_s}, dissipation=[{"kind": "late"}])
    found = judge_elsewhere(resolve(Layers(tmp_path / "scene.toml", tables), registry([path])), [path], [])
    assert found.word == word
    assert says in found.detail
