"""The page of a real run: it shows what was logged, what it asks for is done or refused, and the run does not mind."""

import asyncio
import os
import signal
import threading

import numpy as np
import pytest

from haploop.launch.spec import RunFailed
from haploop.launch.stability.decide import Finding
from haploop.logger import read
from haploop.logger.summary import read as read_summary
from haploop.tools.cli.view import LiveRuns
from haploop.view.receive.run_session import RunSession
from helpers.live.browsing import site, to_its_end
from helpers.live.followed import follow, has_logged, same, stands, whole
from helpers.live.launched import first_and_slowly
from helpers.live.live_run import going, undisturbed


def test_every_sample_of_the_snapshot_is_the_logs(tmp_path):
    """Joined in mid-run: what came before it joined is there as well, bit for bit as float32."""

    async def play(run, tab, here):
        await stands(run, 600)
        log = await has_logged(run, 600)
        snapshot = await whole(tab, run, 600)
        tables = snapshot["tables"]
        assert [name for name, table in tables.items() if table["envelope"]] == ["overview"]
        position, force, energy = (tables[name]["values"] for name in ("position", "force", "energy"))
        assert (tables["position"]["t0_s"], tables["position"]["rows"]) == (0.0, 6000)
        same(position["x"], log["/plant"]["x"])
        same(position["x_measured"], np.repeat(log["/controller"]["x"], 10))
        assert (position["wall"] == np.float32(-0.001)).all()
        same(force["wall"], log["/controller"]["wall"])
        same(force["total"], log["/controller"]["total"])
        same(force["element.0.unidirectional-inertia"], log["/controller"]["dissipation.0"])
        same(energy["wall"], log["/energy"]["wall.true"])
        same(energy["unidirectional-inertia"], log["/energy"]["unidirectional-inertia.true"])
        same(energy["residual"], log["/energy"]["residual"])
        units = {column["name"]: column["unit"] for table in tables.values() for column in table["columns"]}
        assert (units["x"], units["total"], units["residual"], units["v"]) == ("m", "N", "J", "m/s")

        loop, momentum = tables["loop"], tables["momentum"]
        first = round(1000 * loop["t0_s"])  # two periods of its swing of about 13 Hz
        assert 400 < first < 500
        t, x, f = (log["/plant"][name][10 * first :] for name in ("t", "x", "force"))
        assert (loop["t0_s"], loop["dt_s"], loop["stiffness"]) == (t[0], 1e-4, 150.0)
        same(loop["values"]["penetration"], (x + 0.001) * -1.0)
        same(loop["values"]["force"], f)
        v, f = (log["/controller"][name][first:] for name in ("v", "dissipation.0"))
        same(momentum["values"]["v"], v[:-1])
        same(momentum["values"]["p.0"], np.where(f != 0.0, 0.01, 0.0)[:-1] * v[1:])

    follow(play, tmp_path, pauses=(600,))


def test_a_long_view_is_an_envelope_that_touches_every_extreme(tmp_path):
    async def play(run, tab, here):
        await stands(run, 3000)
        log = await has_logged(run, 3000)
        snapshot = await whole(tab, run, 3000, points=200)
        table = snapshot["tables"]["position"]
        assert table["envelope"]
        assert table["rows"] <= 2 * 200
        buckets = table["rows"] // 2
        ticks = round(table["dt_s"] * 2000)
        assert table["t0_s"] == pytest.approx(ticks / 4000)
        x = np.full(buckets * ticks * 10, np.nan)
        x[:30_000] = log["/plant"]["x"]
        x = x.reshape(buckets, -1).astype(np.float32)
        pairs = np.sort(table["values"]["x"].reshape(-1, 2))
        np.testing.assert_array_equal(pairs[:, 0], np.nanmin(x, axis=1))
        np.testing.assert_array_equal(pairs[:, 1], np.nanmax(x, axis=1))

    follow(play, tmp_path, pauses=(3000,))


def test_the_window_is_what_the_page_watches(tmp_path):
    """The last seconds, seconds further back, and nothing where nothing is."""

    async def play(run, tab, here):
        await stands(run, 1000)
        log = await has_logged(run, 1000)
        await whole(tab, run, 1000)
        recent = await tab.watch(span_s=0.2, points=1000)
        assert (recent["from_s"], recent["to_s"]) == (0.8, 1.0)
        same(recent["tables"]["position"]["values"]["x"], log["/plant"]["x"][8000:])
        back = await tab.watch(span_s=0.1, points=1000, end_s=0.5)
        assert (back["from_s"], back["to_s"]) == (0.4, 0.5)
        same(back["tables"]["position"]["values"]["x"], log["/plant"]["x"][4000:5000])
        same(back["tables"]["force"]["values"]["total"], log["/controller"]["total"][400:500])
        same(back["tables"]["loop"]["values"]["force"], log["/plant"]["force"][4000:5000])
        nothing = await tab.watch(span_s=1.0, end_s=1000.0)
        assert nothing["tables"] == {}
        early = await tab.watch(span_s=5.0)
        assert (early["from_s"], early["to_s"]) == (0.0, 5.0)

    follow(play, tmp_path, pauses=(1000,))


@pytest.mark.slow
def test_since_now_shows_nothing_older(tmp_path):
    async def play(run, tab, here):
        await stands(run, 500)
        async with site(from_start=False) as other:
            late = await other.tab()
            await late.phase("paused")
            await asyncio.to_thread(run.ask, "step", ticks=50)
            await late.until("the step", lambda: late.state["tick"] >= 550)
            await asyncio.sleep(1.0)  # longer than it takes to read a log
            assert late.state["first_s"] == 0.5
            snapshot = await late.watch(span_s=None, points=1000)
            assert (snapshot["from_s"], snapshot["to_s"]) == (0.5, 0.55)
            assert snapshot["tables"]["position"]["rows"] == 500

    follow(play, tmp_path, pauses=(500,))


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
        assert (await later.ask("pause"))[1].endswith("is over; nothing about it can change any more.")

    follow(play, tmp_path, "duration=0.5", "wall.position=-0.001", pauses=(200,))


@pytest.mark.parametrize("is_judged", first_and_slowly(True, False), ids=["judged", "abandoned"])
def test_the_verdict_comes_when_the_launcher_has_judged_the_run_and_until_then_it_is_awaited(
    tmp_path, monkeypatch, is_judged
):
    may_judge, launcher = threading.Event(), [True]

    def waits(*given):
        assert may_judge.wait(20)
        return Finding("steady", "rest", push_N=0.2)

    class Launched(LiveRuns):
        def stiffness_limit(self, scene):
            return None

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
            for _ in range(2000):
                if (tab.state or {}).get("run") == run.live.id:
                    break
                run.stands_at(100)
            run.ask("resume")
            run.result()

    to_its_end(scenario())


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


@pytest.mark.slow
def test_pages_that_come_go_and_say_nothing_leave_the_bits_of_the_run_alone(tmp_path):
    """Snapshots all the while, one page that reads nothing, one that leaves without a word."""

    async def play(run, tab, here):
        await tab.phase("paused")
        deaf = await here.stream()
        deaf._response.connection.transport.pause_reading()
        rude = await here.tab()
        await rude.socket.send_json({"type": "watch", "span_s": None, "points": 8000})
        await tab.ask("pace", pace=2)
        await tab.ask("resume")
        await rude.until("snapshots", lambda: rude.snapshots > 3)
        rude.reading.cancel()
        rude.socket._response.connection.transport.abort()
        await tab.phase("ended")
        assert tab.snapshots > 10
        return tab.state["skipped_ticks"]

    with going(tmp_path, "duration=3", pauses=(100,)) as run:

        async def scenario():
            async with site() as here:
                return await play(run, await here.tab(), here)

        assert to_its_end(scenario()) == 0
        summary = run.result()
        assert summary["trajectory_sha256"] == undisturbed(run.prepared)["trajectory_sha256"]
        assert summary["lost"]["telemetry_gaps"] == 0


@pytest.mark.slow
def test_a_paused_run_sends_its_snapshot_once(tmp_path):
    """Nothing new is nothing sent; a change of what is watched is answered at once."""

    async def play(run, tab, here):
        await stands(run, 300)
        await whole(tab, run, 300)
        await asyncio.sleep(0.7)
        seen = tab.snapshots
        states = tab.state
        await asyncio.sleep(1.0)
        assert tab.snapshots == seen
        assert tab.state is not states
        await tab.watch(span_s=0.1)
        assert tab.snapshots == seen + 1

    follow(play, tmp_path, pauses=(300,))


def test_who_waits_for_whom_and_what_can_be_chosen_is_told(tmp_path):
    async def play(run, tab, here):
        await stands(run, 300)
        state = await tab.until(
            "options and nodes", lambda: tab.state if tab.state["options"] and tab.state["nodes"] else 0
        )
        assert {node["role"] for node in state["nodes"]} == {"plant", "controller", "logger", "view"}
        assert all(not node["lossless"] for node in state["nodes"] if node["role"] == "view")
        assert state["options"]["settable"]["wall.stiffness"]["value"] == 150.0
        assert "damping" in state["options"]["kinds"]
        assert state["elements"][0]["kind"] == "unidirectional-inertia"
        assert (state["wall"]["stiffness"], state["wall"]["into_wall"]) == (150.0, -1.0)
        assert (state["end_tick"], state["control_rate"], state["plant_rate"]) == (600_000, 1000, 10_000)
        assert state["real_time_factor"] is None
        assert state["run"] == run.live.id

    follow(play, tmp_path, pauses=(300,))
