"""Real runs that a page of a server follows, and the data that the page receives of them."""

import asyncio

import numpy as np

from helpers.live.browsing import site, to_its_end
from helpers.live.launched import log_so_far
from helpers.live.live_run import going
from helpers.live.waiting import wait_for

TOUCHING = ("wall.position=-0.001", "duration=600")


def follow(play, tmp_path, *overrides, options=None, **how):
    """Starts a run, a server, and a page, and plays a scenario with them: ``play(run, tab, site)``."""

    async def scenario(run):
        async with site(**(options or {})) as here:
            return await play(run, await here.tab(), here)

    with going(tmp_path, *(overrides or TOUCHING), **how) as run:
        return to_its_end(scenario(run))


async def stands(run, tick):
    """Waits until the run stands still at a tick."""
    await asyncio.to_thread(run.stands_at, tick)


async def has_logged(run, ticks):
    """Waits until ``ticks`` ticks can be read from the log."""

    def look():
        log = log_so_far(run.prepared.out)
        return log if len(log.get("/energy", {}).get("timestamp", ())) >= ticks else None

    return await asyncio.to_thread(wait_for, f"tick {ticks} in the log", look)


def same(column, truth):
    """Asserts that a column holds, for every logged number, the nearest float32, and nothing else."""
    np.testing.assert_array_equal(column, np.asarray(truth, np.float32))


async def whole(tab, run, ticks, **watch):
    """A snapshot of everything since the start, once all three of its streams are there."""
    begins = {"position": "x", "force": "total", "energy": "residual"}
    await tab.until("the end", lambda: tab.state and tab.state.get("tick", 0) >= ticks)
    await tab.watch(**{"span_s": None, "points": 8000} | watch)

    def is_whole():
        tables, from_start = tab.snapshot["tables"], "span_s" in watch or tab.snapshot["from_s"] == 0.0
        return (tab.is_whole and from_start and tables.keys() >= begins.keys()) and all(
            np.isfinite(tables[name]["values"][column][0]) for name, column in begins.items()
        )

    await tab.until("the start", is_whole)
    return tab.snapshot
