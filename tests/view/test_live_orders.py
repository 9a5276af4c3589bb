"""Orders of the page to a real run: done at their tick and told, or refused in a sentence."""

import asyncio
import json
from types import SimpleNamespace

import numpy as np
import pytest

from haploop.protocol.transport.clock_client import Aborted
from haploop.tools.cli.live_runs import LiveRuns
from helpers.live.followed import follow, has_logged, same, stands, whole


@pytest.mark.slow
def test_commands_of_the_page_reach_the_run_and_what_took_effect_is_told_with_its_tick(tmp_path):
    async def play(run, tab, here):
        await stands(run, 500)
        state = await tab.phase("paused")
        back = "swap unidirectional-inertia acts=in-contact mass=0.01"
        assert await tab.ask("swap", swap={"kind": "damping", "damping": "0.8 N s/m"}, element=0) == (
            True,
            f"element 0 becomes damping at tick 500 (0.5 s); to go back: {back}",
        )
        assert (await tab.ask("set", set={"wall.stiffness": 200, "clock.round_trip_delay": "1 ms"}))[0]
        assert (await tab.ask("step", ticks=7))[0]
        await stands(run, 507)
        assert (await tab.ask("pace", pace=0.5))[0]
        assert (await tab.ask("resume"))[0]
        state = await tab.phase("running")
        assert (await tab.ask("pause"))[0]
        state = await tab.phase("paused")
        await tab.until("the delay", lambda: tab.state["delay_s"] == 0.001)
        await tab.until("the wall", lambda: tab.state["wall"]["stiffness"] == 200.0)
        state = tab.state
        assert state["pace"] == 0.5
        assert [element["kind"] for element in state["elements"]] == ["damping"]
        await tab.until("all events", lambda: [event["kind"] for event in tab.events][-1:] == ["pause"])
        told = [(event["tick"], event["kind"], event["text"]) for event in tab.events]
        assert told[:4] == [
            (500, "pause", "paused"),
            (500, "swap", "element 0 becomes damping (damping 0.8 N s/m)"),
            (500, "set", "set wall.stiffness = 200 N/m, clock.round_trip_delay = 0.001 s"),
            (500, "step", "7 ticks on"),
        ]
        assert tuple(kind for _, kind, _ in told[4:6]) == ("pace", "resume")

        tick = state["tick"]
        log = await has_logged(run, min(tick, 600))
        await whole(tab, run, 507, span_s=0.02, end_s=0.507)
        await tab.until("all 20 ticks", lambda: len(tab.snapshot["tables"]["force"]["values"]["total"]) == 20)
        snapshot = tab.snapshot
        force = snapshot["tables"]["force"]["values"]
        assert np.isnan(force["element.0.damping"][:13]).all()
        assert np.isnan(force["element.0.unidirectional-inertia"][13:]).all()
        same(force["element.0.damping"][13:], log["/controller"]["dissipation.0"][500:507])
        assert {"damping", "unidirectional-inertia"} <= snapshot["tables"]["energy"]["values"].keys()
        assert (await tab.ask("stop"))[0]
        await tab.phase("ended")

    follow(play, tmp_path, pauses=(500,))


def at_work(state):
    """The one element with its mass, and the stiffness of the wall."""
    (element,) = state["elements"]
    return element["kind"], element["parameters"]["mass"], state["wall"]["stiffness"]


REFUSED = [
    ("swap", {"swap": {"kind": "dampng", "damping": 0.8}}, "damping"),
    ("swap", {"swap": {"kind": "damping", "damping": -1}}, "at least 0"),
    ("swap", {"swap": {"kind": "damping", "damping": "0.8 N/m"}}, "N/m"),
    ("swap", {"swap": {"kind": "damping", "damping": 1}, "element": 9}, "element"),
    ("swap", {"swap": 5}, "must be a table"),
    ("swap", {"surprise": 1}, "cannot be used"),
    ("set", {"set": {"wall.stiffness": -1}}, "wall.stiffness"),
    ("set", {"set": {"clock.round_trip_delay": 0.00015}}, "whole number"),
    ("step", {"ticks": 0}, "whole number of ticks"),
    ("pace", {"pace": -1}, "pace"),
    ("pace", {"pace": 10**30}, "does not fit into 64 bits"),
    ("pause", {"verb": "stop"}, "cannot be used"),
    ("pause", {"run": 1}, "cannot be used"),
]


@pytest.mark.slow
def test_what_is_refused_comes_back_as_a_sentence_and_changes_nothing(tmp_path):
    async def play(run, tab, here):
        await stands(run, 300)
        before = await tab.phase("paused")
        for verb, arguments, reason in REFUSED:
            ok, text = await tab.send(verb, arguments, tab.token)
            assert not ok, text
            assert reason in text
        assert not (await tab.send("stop", {}, "guess"))[0]
        await stands(run, 300)
        assert [at_work(tab.state), at_work(before)] == [("unidirectional-inertia", 0.01, 150.0)] * 2
        assert [event["kind"] for event in tab.events] == ["pause"]
        assert (await tab.ask("resume"))[0]
        await asyncio.to_thread(run.result)

    with_events = ("wall.position=-0.001", "duration=0.5")
    follow(play, tmp_path, *with_events, pauses=(300,))
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["ended"] == "done"
    assert [element["kind"] for element in summary["energy"]["elements"]] == ["unidirectional-inertia"]


class Vanishing(LiveRuns):
    """The live runs, and one beside them that is gone as soon as somebody knocks."""

    def __init__(self):
        super().__init__()
        self.other = []

    def appear(self):
        self.other = [SimpleNamespace(id="other", title="short", is_here=True, make_context=self.vanish)]

    def vanish(self):
        self.other = []
        raise Aborted

    def has_launcher(self, run):
        return run.id != "other" and super().has_launcher(run)

    def record_of(self, run):
        return None

    def live(self):
        return [*super().live(), *self.other]


@pytest.mark.slow
def test_where_an_opened_run_has_gone_that_is_said_and_the_one_before_is_followed_on(tmp_path):
    runs = Vanishing()

    async def play(run, tab, here):
        await tab.phase("paused")
        runs.appear()
        ok, text = await tab.ask("open", run="other")
        assert (ok, text) == (False, 'Run other, "short", ended before its first tick; its terminal says why.')
        assert (await tab.ask("step", ticks=50))[0]
        await tab.until("the step", lambda: tab.state["phase"] == "paused" and tab.state["tick"] >= 250)
        await tab.ask("resume")
        await tab.phase("ended")

    follow(play, tmp_path, "duration=0.3", "wall.position=-0.001", pauses=(200,), options={"runs": runs})
