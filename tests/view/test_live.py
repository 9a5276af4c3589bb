"""The page of a real run: it shows what was logged, what it asks for is done or refused, and the run does not mind."""

import asyncio
from typing import Any

import aiohttp
import numpy as np
import pytest

from haploop.view.serve.page import Drawn, Page
from helpers.live.browsing import site, to_its_end
from helpers.live.followed import follow, has_logged, same, stands, whole
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


@pytest.mark.slow
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


@pytest.mark.slow
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
            await asyncio.sleep(0.7)  # longer than it takes to read a log
            await late.until("fifty ticks", lambda: late.snapshot["tables"].get("position", {}).get("rows") == 500)
            assert late.state["first_s"] == 0.5
            snapshot = await late.watch(span_s=None, points=1000)
            assert (snapshot["from_s"], snapshot["to_s"]) == (0.5, 0.55)
            assert snapshot["tables"]["position"]["rows"] == 500

    follow(play, tmp_path, pauses=(500,))


async def listen(stream, heard):
    async for message in stream:
        heard.append(message.type)


@pytest.mark.slow
def test_pages_that_come_go_and_say_nothing_leave_the_bits_of_the_run_alone(tmp_path):
    """Snapshots all the while, one page that reads nothing, one that draws nothing, one that leaves without a word."""

    async def play(run, tab, here):
        await tab.phase("paused")
        deaf = await here.stream()
        deaf._response.connection.transport.pause_reading()
        hidden, heard = await here.stream(), []
        reading = asyncio.create_task(listen(hidden, heard))
        rude = await here.tab()
        await rude.socket.send_json({"type": "watch", "span_s": None, "points": 8000})
        await tab.ask("pace", pace=0.05)
        await tab.ask("resume")
        await rude.until("snapshots", lambda: rude.snapshots > 3)
        rude.reading.cancel()
        rude.socket._response.connection.transport.abort()
        await tab.until("ten snapshots", lambda: tab.snapshots > 10)
        await tab.until("four unanswered ones", lambda: heard.count(aiohttp.WSMsgType.BINARY) == 4)
        await tab.ask("pace", pace="free")
        await tab.phase("ended")
        reading.cancel()
        assert heard.count(aiohttp.WSMsgType.BINARY) == 4, "no more than four before the page says that it has drawn"
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
        seen = -1
        for _ in range(50):  # what was on its way comes first
            seen = tab.snapshots
            for _ in range(2):
                state = tab.state
                await tab.until("another state", lambda told=state: tab.state is not told)
            if tab.snapshots == seen:
                break
        assert tab.snapshots == seen
        await tab.watch(span_s=0.1)
        assert tab.snapshots == seen + 1

    follow(play, tmp_path, pauses=(300,))


@pytest.mark.slow
def test_what_stands_beside_the_charts_comes_with_every_fourth_picture_at_least_and_the_last(tmp_path):
    async def play(run, tab, here):
        came = []
        for _ in range(30):
            seen = tab.snapshots
            await tab.until("another picture", lambda before=seen: tab.snapshots > before)
            if tab.snapshots == seen + 1:
                came.append(tab.is_whole)
            else:
                came.append(None)
        seen = [four for four in zip(came, came[1:], came[2:], came[3:], strict=False) if None not in four]
        assert seen
        assert all(any(four) and four[:2] != (True, True) for four in seen)
        await asyncio.to_thread(run.ask, "pause")
        await tab.phase("paused")
        await whole(tab, run, 1)
        assert tab.snapshot["tables"].keys() >= {"position", "overview", "loop"}

    follow(play, tmp_path, pace=1.0)


def test_a_page_that_draws_four_pictures_late_gets_none_of_them_twice():
    """An answer makes room for a picture, while there may be nothing new yet."""
    shown, sent = iter(range(9)), []

    class Socket:
        async def send_bytes(self, data):
            sent.append(data)

    class Shows:
        now = (next(shown),)

        def snapshot(self, viewport, beside):
            return self.now, bytes(self.now)

    async def play():
        viewer = Shows()
        stands_in: Any = Page
        page = stands_in(Socket(), viewer, None)
        for answered in (1, 0, 0, 0, 0):
            await page._send_snapshot()
            viewer.now = (next(shown),)
            if answered:
                await page._take(Drawn(answered))
        for _ in range(2):
            await page._take(Drawn(1))
        assert sent == [bytes((number,)) for number in range(6)]
        for _ in range(2):  # nothing new comes: the last one, which had nothing beside it, comes whole
            await page._send_snapshot()
            await page._take(Drawn(1))

    to_its_end(play())
    assert sent == [bytes((number,)) for number in (*range(6), 5)]


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
