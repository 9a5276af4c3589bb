"""A loop that diverges ends at a named tick with a good log; that is a result, not a failure."""

import json

import numpy as np
import pytest

import haploop.logger
from haploop.launch.runs.replay import replay
from helpers.slowly import first_and_slowly

# A force -b v held over T on a free mass m turns v over and more than back when b T / m > 2.
UNSTABLE = ('dissipation=[{kind="damping", damping=60.0, acts="always"}]',)


@pytest.mark.slow
@pytest.mark.parametrize("options", [(), pytest.param(("--in-process",), marks=pytest.mark.slow)])
@pytest.mark.parametrize(("sets", "limit_m"), first_and_slowly(((), 1.0), (("diverged_beyond=0.03",), 0.03)))
def test_a_device_beyond_the_limit_ends_the_run_with_verdict_tick_and_a_whole_log(options, sets, limit_m, running):
    """1 m when the scene sets no limit."""
    run = running(*options, sets=(*UNSTABLE, "duration=30", *sets), pace=())
    summary = run.summary()
    end = summary["ticks"]
    assert (summary["ended"], summary["verdict"]) == ("diverged", "diverged")
    assert f"beyond the limit of {limit_m:g} m, at tick {end}" in summary["verdict_rule"]
    log = haploop.logger.read(run.out)
    assert not log.truncated
    x = log["/plant"]["x"]
    assert len(x) == summary["steps"] + 1 == 10 * end + 1
    assert np.abs(x[:-10]).max() <= limit_m < abs(x[-1])
    assert len(log["/controller"]["x"]) == end
    assert replay(run.out).differences == []
    assert summary["energy"]["residual_J"] <= 1e-12 * summary["energy"]["moved_J"]
    assert json.loads((run.out / "summary.json").read_text())["verdict"] == "diverged"


@pytest.mark.slow
def test_both_ways_to_run_it_diverge_at_the_same_bits(running):
    sets = (*UNSTABLE, "duration=30")
    digests = {running(*way, sets=sets, pace=()).summary()["trajectory_sha256"] for way in ((), ("--in-process",))}
    assert len(digests) == 1
