"""End of a real run, as its page tells it: summary, verdict, failure, and the run that comes next."""

import asyncio
import os
import signal
import threading

import numpy as np
import pytest

from haploop.launch.spec import RunFailed
from haploop.launch.stability.finding import Finding
from haploop.logger import read
from haploop.logger.summary import read as read_summary
from haploop.tools.cli.live_runs import LiveRuns
from haploop.view.receive.run_session import RunSession
from helpers.live.browsing import site, to_its_end
from helpers.live.followed import follow, same, whole
from helpers.live.live_run import going
from helpers.live.waiting import PATIENCE_S, wait_for
from helpers.slowly import first_and_slowly


@pytest.mark.slow
def test_the_end_is_told_with_the_summary_and_what_was_seen_can_still_be_looked_at(tmp_path):
    async def play(run, tab, here):
        await tab.phase("paused")
        await tab.ask("resume")
        state = await tab.phase("ended")
        summary = read_summary(tmp_path / "out" / "summary.json")
        assert state["summary"] == summary
        assert (state["verdict"], state["verdict_rule"]) == (summary["verdict"], summary["verdict_rule"])
        assert state["residual_J"] == summary["energy"]["residual_J"]
        snapshot = await whole(tab, run, 500)
        log = read(tmp_path / "out")
        x = snapshot["tables"]["position"]["values"]["x"]
        same(x[:5001], log["/plant"]["x"])  # the end state is there too
        assert np.isnan(x[5001:]).all()
        later = await here.tab()
        await later.phase("ended")
        assert (await later.ask("pause"))[1].endswith("is over; nothing in it can be changed any more.")

    follow(play, tmp_path, "duration=0.5", "wall.position=-0.001", pauses=(200,))


@pytest.mark.parametrize("is_judged", first_and_slowly(True, False), ids=["judged", "abandoned"])
def test_the_verdict_comes_when_the_launcher_has_judged_the_run_and_until_then_it_is_awaited(
    tmp_path, monkeypatch, is_judged
):
    may_judge, launcher = threading.Event(), [True]

    def waits(*given, **named):
        assert may_judge.wait(PATIENCE_S)
        return Finding("steady", "rest", push_N=0.2)

    class Launched(LiveRuns):
        def stiffness_limit(self, scene):
            return "not asked for"

        def past(self):
            return []

        def has_launcher(self, run):
            return launcher[0] and super().has_launcher(run)

    async def play(run, tab, here):
        await tab.phase("paused")
        assert tab.state["verdict_is"] == "seen"
        await tab.ask("resume")
        state = await tab.until("the end", lambda: tab.state if tab.state["verdict_is"] == "awaited" else None)
        assert state["phase"] == "ended"
        assert "stability" not in state["summary"]
        if is_judged:
            may_judge.set()
            state = await tab.until("the verdict", lambda: tab.state if tab.state["verdict_is"] == "judged" else None)
            assert state["summary"] == await asyncio.to_thread(run.result)
            assert (state["verdict"], state["why"]) == ("steady", "")
            assert "stability" in state["summary"]
        else:
            launcher[0] = False
            state = await tab.until("its word", lambda: tab.state if tab.state["verdict_is"] == "abandoned" else None)
            assert "without judging it" in state["why"]
            may_judge.set()

    monkeypatch.setattr("haploop.launch.runs.judging.judge_scene", waits)
    sets = ("duration=0.5", "wall.position=-0.001", "run.verdict=pushed")
    follow(play, tmp_path, *sets, pauses=(200,), options={"runs": Launched()})


@pytest.mark.slow
def test_the_verdict_of_a_run_whose_summary_cannot_be_read_is_not_known(tmp_path, monkeypatch):
    """As on another machine."""
    monkeypatch.setattr(RunSession, "read_summary", lambda self: None)

    async def play(run, tab, here):
        await tab.phase("paused")
        await tab.ask("resume")
        state = await tab.phase("ended")
        assert (state["verdict_is"], state["summary"]) == ("unknown", None)
        assert "cannot be read from here" in state["why"]

    follow(play, tmp_path, "duration=0.5", "wall.position=-0.001", pauses=(200,))


@pytest.mark.slow
def test_the_next_run_is_taken_up_and_the_first_stays_on_show_until_then(tmp_path):
    async def scenario():
        async with site() as here:
            tab = await here.tab()
            await tab.phase("waiting")
            for name in ("first", "second"):
                await asyncio.to_thread(one_run, tab, tmp_path / name, f"title={name}")
                state = await tab.phase("ended")
                assert state["title"] == name
                await tab.until("its snapshot", lambda: tab.snapshot["tables"])

    def one_run(tab, directory, title):
        with going(directory, "duration=0.3", "wall.position=-0.001", title, pauses=(100,)) as run:
            wait_for("the page", lambda: (tab.state or {}).get("run") == run.live.id)
            run.stands_at(100)
            run.ask("resume")
            run.result()

    to_its_end(scenario())


@pytest.mark.slow
def test_a_failed_run_says_why(tmp_path):
    async def play(run, tab, here):
        state = await tab.until("the nodes", lambda: tab.state if (tab.state or {}).get("nodes") else None)
        os.kill(next(node["pid"] for node in state["nodes"] if node["role"] == "plant"), signal.SIGKILL)
        state = await tab.phase("failed")
        assert "The plant was killed by SIGKILL" in state["why"]
        state = await tab.until("the summary", lambda: tab.state if tab.state["summary"] else None)
        assert state["summary"]["ended"] == "failed"
        with pytest.raises(RunFailed):
            await asyncio.to_thread(run.result)

    follow(play, tmp_path, pauses=(100,))
