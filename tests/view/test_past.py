"""Recorded runs on the page: found, opened, drawn over another, and refused by a sentence where they are not there."""

import asyncio
import json
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from haploop.api import load, run
from haploop.launch.runs.run_files import recorded_scene
from haploop.logger.cause import likely_cause
from haploop.protocol.scene.scene import ElementTable, Wall
from haploop.protocol.transport.clock_client import Aborted
from haploop.tools.cli.live_runs import LiveRuns
from haploop.view.draw.messages import event_lines, state
from haploop.view.draw.snapshot import Viewport, snapshot
from haploop.view.receive.past_session import PastSession
from haploop.view.receive.runs import CommandFailed
from haploop.view.viewer import Viewer
from helpers.live.browsing import NoRuns, decode, to_its_end


@pytest.fixture
def recorded(tmp_path, monkeypatch):
    """Two recorded runs in ./runs, the second of a softer wall and with a swap; what came of the second."""
    monkeypatch.chdir(tmp_path)
    scene = load("fig6c").set({"duration": 1.5})
    run(scene, out="runs/first")
    return run(scene.set({"wall.stiffness": 100.0}).swap("damping", at="1.2 s", damping=0.8), out="runs/second")


def test_a_recorded_run_is_opened_with_its_numbers_events_and_verdict(recorded):
    found = {past.id: past for past in LiveRuns().past()}
    assert found.keys() == {"first", "second"}
    session = PastSession(found["second"])
    told = state(session)
    assert (told["phase"], told["run"], told["tick"]) == ("ended", "second", 1500)
    assert told["summary"]["trajectory_sha256"] == recorded.summary["trajectory_sha256"]
    assert told["verdict"] == recorded.summary["verdict"]
    assert [tick for tick, event in session.events if "swap" in event] == [1200]
    (swap,) = event_lines(session.events, 1000, session.clock.units)
    assert swap["text"] == "element 0 becomes damping (damping 0.8 N s/m)"
    set_keys = found["first"].units(session.scene, ["wall.stiffness", "dissipation.0.mass", "dissipation.7.mass"])
    assert set_keys.items() >= {"wall.stiffness": "N/m", "dissipation.0.mass": "kg"}.items()
    assert "dissipation.7.mass" not in set_keys
    shown = decode(snapshot(session.history, Viewport(0.2, 2000, 1.0), session.changes))
    x = shown["tables"]["position"]["values"]["x"]
    assert np.array_equal(x, recorded["/plant"]["x"][8000:10000].astype(np.float32))
    longer = decode(snapshot(session.history, Viewport(10.0, 2000), session.changes))
    assert (longer["from_s"], longer["to_s"]) == (0.0, 1.501)  # the end of the last tick is drawn, too


@pytest.mark.parametrize(
    ("force", "moves"),
    [
        ({"kind": "sine", "amplitude": 0.1, "frequency": 5.0, "offset": -0.5}, True),
        ({"kind": "ramp", "value": -0.5, "rise_time": 0.2}, False),
        ({"kind": "ramp", "value": -0.5, "rise_time": 0.9}, True),
    ],
)
def test_a_hand_that_still_moves_is_told_beside_what_is_seen(tmp_path, monkeypatch, force, moves):
    monkeypatch.chdir(tmp_path)
    scene = load("fig6c", {"duration": 1.0, "hand.force": force, "run.verdict": "window"})
    run(scene, out="runs/one")
    assert state(PastSession(next(iter(LiveRuns().past()))))["hand_moves"] is moves


@pytest.mark.parametrize(("most_N", "told"), [(0.2, False), (5.0, True)])
def test_no_stiffness_is_displayed_where_the_actuator_cannot_give_the_force(tmp_path, monkeypatch, most_N, told):
    """A wall of 2 N/mm behind an actuator of 0.3 N was said to display 2 N/mm, and displayed 0.6 N/mm."""
    monkeypatch.chdir(tmp_path)
    run(load("premium_press", {"actuator.saturation": most_N, "run.verdict": "window"}), out="runs/one")
    now = state(PastSession(next(iter(LiveRuns().past()))))
    assert (now["displayed_stiffness_N_m"] is not None) == told == (now["sight"]["stiffness_N_m"] is not None)


@pytest.mark.parametrize(
    ("stiffness", "word", "why"), [(3000.0, "limit-cycle", "Likely cause: round-trip delay."), (300.0, "steady", "")]
)
def test_of_a_run_that_swings_the_page_tells_the_cause_first_in_short_then_as_the_report_does(
    tmp_path, monkeypatch, stiffness, word, why
):
    monkeypatch.chdir(tmp_path)
    result = run(load("demo", {"event": [], "wall.stiffness": stiffness}), out="runs/one")
    now = state(PastSession(next(iter(LiveRuns().past()))))
    assert (now["verdict"], now["why"]) == (word, why)
    assert now["cause"] == (likely_cause(result.summary) if why else "")
    assert now["cause"].startswith(why)


@pytest.mark.slow
def test_the_loop_of_a_run_that_has_ended_goes_to_its_end_and_no_further(tmp_path, monkeypatch):
    """The row of its end state is filled with numbers that are none, of which a wall's curve would be, too."""
    monkeypatch.chdir(tmp_path)
    damped = {"duration": 0.6, "wall.position": 0.001, "wall.kind": "kelvin-voigt", "wall.damping": 1.0}
    run(load("fig6c").set(damped), out="runs/damped")
    session = PastSession(next(past for past in LiveRuns().past() if past.id == "damped"))
    loop = decode(snapshot(session.history, Viewport(0.2, 2000), session.changes))["tables"]["loop"]
    assert all(np.isfinite(values).all() for values in loop["values"].values())
    assert len(loop["values"]["force"]) == 2000 - 10
    assert np.isfinite(loop["curve"]).all()


def test_a_viewer_shows_one_recorded_run_and_draws_another_over_it(recorded):
    async def play():
        viewer = Viewer(LiveRuns(), None, from_start=True)
        assert [past["id"] for past in viewer.listing()["past"]] == ["second", "first"]
        await viewer.open("second")
        assert viewer.listing()["overlay_end_s"] is None
        assert await viewer.lay_over("first") == "Run first is drawn over it, to its end at 1.5 s."
        assert (viewer.listing()["shown"], viewer.listing()["overlay"]) == ("second", "first")
        assert viewer.listing()["overlay_diverged"] is False
        assert viewer.listing()["overlay_end_s"] == 1.5
        assert viewer.overlay
        viewer.overlay.summary = {**(viewer.overlay.summary or {}), "verdict": "diverged"}
        assert viewer.listing()["overlay_diverged"] is True
        for wrong in ("", "third", "../first", "/etc"):
            with pytest.raises(CommandFailed, match="no run"):
                await viewer.open(wrong)
        return viewer.session, viewer.overlay

    session, overlay = to_its_end(play())
    assert session
    assert overlay
    tables = decode(snapshot(session.history, Viewport(0.2, 2000, 1.2), None, overlay.history))["tables"]
    own, other = (tables[name]["values"]["x"] for name in ("position", "overlay_position"))
    assert own.shape == other.shape
    assert not np.array_equal(own, other), "the walls are not alike"
    late = decode(snapshot(session.history, Viewport(0.2, 2000, None), None, None))["tables"]
    assert "overlay_position" not in late


def test_recorded_runs_are_listed_by_name_verdict_and_date_and_one_that_cannot_be_read_by_its_folder(
    recorded, tmp_path
):
    runs = LiveRuns()
    first, second = (next(past for past in runs.past() if past.id == name) for name in ("first", "second"))
    assert second.title == recorded.summary["title"]
    assert second.told.startswith(f"{recorded.summary['verdict']}, ")
    (tmp_path / "runs/first/summary.json").write_text("{")
    damaged = next(past for past in runs.past() if past.id == "first")
    assert (first.title, damaged.title) == (recorded.summary["title"], "first")
    whole = {name: value for name, value in recorded.summary.items() if name != "checksum"}
    for odd in ({"stability": None}, {"stability": {"provisos": None}}, {"verdict": 3}, {"title": []}):
        (tmp_path / "runs/first/summary.json").write_text(json.dumps(whole | odd))
        assert [past.id for past in LiveRuns().past()].count("first") == 1, odd
    (tmp_path / "runs/first/scene.toml").unlink()
    assert [past.id for past in LiveRuns().past()] == ["second"], "what has no scene, as a sweep, is no run"
    assert next(past for past in runs.past() if past.id == "second") is second, "it is read once"


def test_a_run_that_has_ended_is_listed_once_as_the_recorded_one_that_it_is(recorded):
    async def play():
        viewer = Viewer(LiveRuns(), None, from_start=True)
        viewer.listing()
        session = PastSession(LiveRuns().past()[0])
        followed: Any = SimpleNamespace(id="f1cd5e", title="second run")
        session.run = followed
        viewer.session = viewer._followed = session
        assert viewer.listing()["shown"] == "second"
        await viewer.open("first")
        await viewer.open("second")
        assert viewer.session is session, "what was received of it is shown still"

    to_its_end(play())


class Live(NoRuns):
    """Live runs that come and go as a test wants."""

    def __init__(self, *names: str) -> None:
        super().__init__()
        self.names = [*names]

    def live(self) -> list[Any]:
        return [SimpleNamespace(id=name, title=f"run {name}") for name in self.names]


def test_a_page_that_stays_with_its_run_takes_up_another_only_where_it_is_chosen():
    async def play():
        runs = Live("other", "own")
        viewer = Viewer(runs, "own", from_start=True, stays=True)
        assert (await viewer._next_run())[0].id == "own"
        runs.names = ["other", "new"]
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(viewer._next_run(), 0.5)
        assert viewer.listing()["stays"]
        opening = asyncio.create_task(viewer.open("other"))
        run, joined = await viewer._next_run()
        assert run.id == "other"
        joined.set_result(True)
        assert await opening == "Run other is shown."

    to_its_end(play())


def test_of_a_run_that_ended_before_its_first_tick_the_page_says_so():
    async def play():
        runs = Live("own")
        viewer = Viewer(runs, None, from_start=True)
        own, _ = await viewer._next_run()
        runs.names = []
        assert await viewer._join(own) is None
        runs.names = ["later"]

        async def gone(run):
            runs.names = []

        viewer._join = gone
        following = asyncio.create_task(viewer.follow_runs())
        while not viewer.why:
            await asyncio.sleep(0.01)
        following.cancel()
        assert viewer.why == 'Run later, "run later", ended before its first tick; its terminal says why.'

    to_its_end(play())


def test_a_run_that_was_over_before_the_page_could_join_it_is_shown_and_one_without_a_record_is_told(recorded):
    """The page stayed with the run before it, as if nothing had happened."""

    async def play():
        runs = Short()
        viewer = Viewer(runs, None, from_start=True)
        await viewer.open("first")
        following = asyncio.create_task(viewer.follow_runs())
        runs.begin("quick", "runs/second")
        while viewer.session is None or viewer.session.run.id != "quick":
            await asyncio.sleep(0.01)
        assert state(viewer.session)["tick"] == 1500
        assert (viewer.listing()["shown"], viewer.listing()["missed"]) == ("second", "")
        await asyncio.sleep(0.3)
        runs.begin("lost", "runs/nowhere")
        while not viewer.why:
            await asyncio.sleep(0.01)
        assert viewer.listing()["missed"] == 'Run lost, "run lost", ended before its first tick; its terminal says why.'
        assert viewer.session.run.id == "quick"
        await asyncio.sleep(0.3)
        runs.begin("next", "runs/first")
        while viewer.session.run.id != "next":
            await asyncio.sleep(0.01)
        assert viewer.listing()["missed"] == ""
        following.cancel()

    to_its_end(play())


class Short(LiveRuns):
    """Runs that are over as soon as somebody tries to join them."""

    def __init__(self) -> None:
        super().__init__()
        self.present: list[Any] = []

    def begin(self, name: str, out: str) -> None:
        self.present = [SimpleNamespace(id=name, title=f"run {name}", out=out, is_here=True, make_context=self.end)]

    def end(self) -> Any:
        self.present = []
        raise Aborted

    def live(self) -> Any:
        return self.present

    def has_launcher(self, run: Any) -> bool:
        return False


def test_a_loop_with_an_element_that_is_not_installed_has_no_limit_of_stiffness(recorded):
    scene = recorded_scene(LiveRuns().past()[0].out, {})
    assert scene
    assert LiveRuns().stiffness_limit(replace(scene, dissipation=()))
    unknown = replace(scene, dissipation=(replace(scene.dissipation[0], name="of a plugin"),))
    missing = "which reads no plugin files"
    assert LiveRuns().stiffness_limit(unknown) == f"the element of a plugin is not known to this page, {missing}"
    named = replace(scene, dissipation=(), wall=Wall(kind="skin", position=0.0, stiffness=100.0))
    assert LiveRuns().stiffness_limit(named) == f'no wall of the kind "skin" is known to this page, {missing}'


def test_what_makes_a_loop_nonlinear_is_told_beside_an_element_that_is_not_installed():
    scene = load("fig6c").set({"jitter": {"kind": "gamma", "mean": 0.001, "deviation": 0.001}}).scene
    strange = replace(scene, dissipation=(ElementTable(name="of a plugin"),))
    assert LiveRuns().stiffness_limit(strange) == "not linear, because of [jitter]"


def test_of_a_loop_with_friction_the_limit_is_that_without_it():
    """Where `haploop explain demo` has it, too: the demo's wall, beyond it, buzzes."""
    scene = load("demo").scene
    assert scene.friction
    limit = LiveRuns().stiffness_limit(scene)
    assert isinstance(limit, float)
    assert limit == pytest.approx(1668.0, rel=1e-3)
    assert scene.wall
    assert scene.wall.stiffness > limit


def test_what_cannot_be_read_is_refused_and_what_was_shown_stays(recorded, tmp_path):
    (tmp_path / "runs/first/scene.toml").write_text("device = 3")
    (tmp_path / "runs/second/log.mcap").unlink()

    async def play():
        viewer = Viewer(LiveRuns(), None, from_start=True)
        for broken in ("first", "second"):
            with pytest.raises(CommandFailed, match="cannot be read"):
                await viewer.open(broken)
        return viewer.session

    assert to_its_end(play()) is None
