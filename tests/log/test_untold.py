"""The word for a run that failed, or was changed so late that no window shows the loop as it is."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_batch import run_batch
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.runs.start import prepare, run
from haploop.launch.scene.bundled import of_name
from haploop.launch.spec import RunFailed
from haploop.logger.summary import read
from haploop.logger.verdict.changes_made import ChangesMade
from haploop.protocol.changes import Change, refusal, restoration
from haploop.tools.figure.data import RunData
from haploop.tools.figure.run_figure import key_numbers, make_figure
from haploop.tools.render.report import summary_table
from haploop.view.receive.run_session import RunSession
from helpers.scenes.brake import source
from helpers.shown import shown, words

SCENE = of_name("fig6b", "scenes") or Path()


def changed(at_s: float, out: Path | None = None, duration_s: float = 1.5):
    events = [f"event.0.at={at_s}", "event.0.set={'wall.stiffness'=60.0}"]
    return prepare(SCENE, [f"duration={duration_s}", 'run.verdict="window"', *events], out=out)


def test_a_window_that_spans_a_change_bears_no_word_and_shows_no_stiffness(tmp_path):
    """Alone, in a batch, in the report and in the figure; one that begins with the change does."""
    late, early = run(changed(1.4, tmp_path / "late"), in_process=True), run(changed(1.0), in_process=True)
    assert (late["verdict"], late["window"]["displayed_stiffness_N_m"]) == ("undecided", None)
    assert "The loop was changed at 1.4 s, within the window from 1 s on" in late["verdict_rule"]
    assert early["verdict"] == "no-swing-seen"
    assert early["window"]["displayed_stiffness_N_m"] is not None
    text = shown(summary_table(late))
    assert text.startswith("undecided")
    assert "displayed stiffness" not in text
    data = RunData.from_directory(tmp_path / "late")
    assert words(make_figure(data), "verdict") == ["undecided"]
    assert not any("displayed" in number for number in key_numbers(data))
    spec = changed(1.4)
    for one in run_batch([spec.scene] * 2, spec.kinds):
        assert (one["verdict"], one["window"]) == (late["verdict"], late["window"])


def test_a_loop_that_is_judged_at_its_end_may_have_been_changed_just_before():
    scene = prepare(SCENE, ["duration=1.5", "event.0.at=1.4", "event.0.set={'wall.stiffness'=60.0}"])
    assert run(scene, in_process=True)["verdict"] == "steady"


def test_a_run_that_fails_is_undecided_in_its_summary_report_and_page_and_failed_in_its_figure(tmp_path):
    """Even at rest for long before: the same run without the fault is steady."""
    plugin, out = tmp_path / "brake.py", tmp_path / "run"
    for fault, word in (("pass", "no-swing-seen"), ("if self.tick > 1400: raise ValueError('deep')", "undecided")):
        plugin.write_text(source(at_force=fault))
        overrides = ["duration=1.5", 'run.verdict="window"', "dissipation=[{kind='brake', damping=0.8}]"]
        spec = prepare(SCENE, overrides, plugins=[plugin], out=out / word)
        kinds = registry([plugin])
        if word == "no-swing-seen":
            assert run_in_process(spec.scene, kinds)["verdict"] == word
            continue
        with pytest.raises(RunFailed, match="deep"):
            run_in_process(spec.scene, kinds, out=out / word, attachments=spec.attachments)
    summary = read(out / "undecided/summary.json")
    assert (summary["ended"], summary["verdict"]) == ("failed", "undecided")
    assert summary["verdict_rule"].startswith("The run failed, and nothing shows how it would have continued. From ")
    assert shown(summary_table(summary)).startswith("undecided")
    assert words(make_figure(RunData.from_directory(out / "undecided")), "verdict") == ["failed"]
    session = cast(Any, SimpleNamespace(summary=summary, scene=spec.scene, outcome="failed"))
    assert cast(Any, RunSession.verdict_is).fget(session) == "judged", "the page has the word of the summary"


def test_changes_that_were_refused_are_none_and_those_taken_back_are():
    made = ChangesMade()
    for tick in (10, 20):
        made.note(tick, {"set": {"wall.stiffness": 2.0 * tick}})
    made.note(22, refusal(Change(20, set={"wall.stiffness": 40.0}).refuse(ValueError("no"))))
    made.note(25, {"pause": True})
    assert made.last_within(0, 100) == 10
    made.note(40, restoration(Change(30, set={"wall.stiffness": 1.0}), "It failed."))
    assert made.last_within(0, 100) == 30
    assert made.last_within(30, 100) is None, "a window may begin with it"
    assert made.last_within(0, 30) == 10, "what comes after the last tick moved nothing"


def test_a_run_without_a_tick_has_no_word():
    events: list[tuple[int, Any]] = [(0, {"stop": True})]
    spec = prepare(SCENE, [])
    summary = run_in_process(spec.scene, spec.kinds, events=events)
    assert (summary["ticks"], summary["verdict"], summary["verdict_rule"]) == (
        0,
        "undecided",
        "The run ended before its first tick was done.",
    )
