"""The compiled way moves every loop as arrays do, within its tolerance, to where it ends or diverges."""

from __future__ import annotations

import numpy as np
import pytest

from haploop.launch.batch.batch import Batch
from haploop.launch.runs.in_batch import run_batch
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import Scene
from helpers.runs.batches import pressed
from helpers.runs.compiled import agree, compiled
from helpers.scenes.least import KINDS
from helpers.scenes.varied_scenes import drawn_base, varied

# Of the largest excursion of each loop.
TOLERANCE = 1e-11
# Of the first 40, so that every estimator, element, hand force, limit of an actuator and kind of change comes.
SEEDS = [3, 8, 13, 18, 31, 33, 36, 38]


def loops_of(scenes: list[Scene], by_program: bool) -> Batch:
    """All loops run to their ends, none dropped."""
    if not by_program:
        loops = Batch(scenes, KINDS)
        loops._drop_ended = lambda: None
        loops.run()
        return loops
    from haploop.launch.batch.jax import programs as compiled_programs
    from haploop.launch.batch.jax.batch import CompiledBatch

    compiled_programs.most()
    with compiled_programs.in_double():
        loops = CompiledBatch(scenes, KINDS, energy=True, size=len(scenes), programs=compiled_programs.PROGRAMS)
        loops.run()
    return loops


def positions(loops: Batch, ticks: int) -> np.ndarray:
    return loops._logger.window.state.x[: ticks * loops._time.steps_per_tick]


def nudged(scene: Scene, by: float) -> Scene:
    """The scene with the device's start moved by a last digit."""
    return with_value(scene, "device.position", scene.device.position + by)


def check_motion(seed: int) -> None:
    """Every position of a run of 0.2 s, which the window holds whole, and the energies at its end."""
    rng = np.random.default_rng(1000 + seed)
    base = drawn_base(seed)
    scenes = [base, *(varied(base, rng) for _ in range(15))]
    found = loops_of(scenes, True)
    expected = loops_of([nudged(each, nudge) for nudge in (0.0, 1e-16, -1e-16) for each in scenes], False)
    ticks = min(result["ticks"] for result in expected.results if result)
    x, (truth, *others) = positions(found, ticks), np.split(positions(expected, ticks), 3, axis=1)
    scale = np.abs(truth).max(axis=0)
    steady = np.ones(len(scenes), bool)
    for other in others:
        steady &= np.abs(other - truth).max(axis=0) < 1e-12 * scale
    assert np.count_nonzero(steady) >= 8, "few of these loops can be compared; the test needs another scene"
    away = np.abs(x - truth).max(axis=0)[steady] / scale[steady]
    # Whether a window of FOAW's passes may be a tie between whole counts, which the last digit decides.
    ties = any(base.estimate(of).estimator == "foaw" for of in ("velocity", "acceleration"))
    assert away.max() < (1e-2 if ties else TOLERANCE)
    assert np.median(away) < TOLERANCE
    for loop in np.flatnonzero(steady):
        result, by_array = found.results[loop], expected.results[loop]
        assert result
        assert by_array
        assert (result["verdict"], result["ticks"], result["why"]) == tuple(
            by_array[key] for key in ("verdict", "ticks", "why")
        )
        energy, exact = result["energy"], by_array["energy"]
        assert energy["residual_J"] < 1e-14 * energy["moved_J"]
        if ties:
            continue
        assert [account["true_J"] for account in energy["elements"]] == pytest.approx(
            [account["true_J"] for account in exact["elements"]], rel=1e-9, abs=1e-11 * exact["moved_J"]
        )
        assert energy["wall"]["leak"] == pytest.approx(exact["wall"]["leak"], rel=1e-9, abs=1e-11 * exact["moved_J"])


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_drawn_loops_move_as_in_arrays(seed: int) -> None:
    """Noise, estimators, actuators, changes while the loop runs."""
    check_motion(seed)


@pytest.mark.parametrize(
    ("damping", "duration", "diverged_beyond"),
    [((1.0, 12.0), 0.6, 0.05), ((6.3, 6.58), 2.0, 0.9)],
    ids=["soon", "late"],
)
@pytest.mark.slow
def test_loops_that_diverge_stand_still_where_they_did(
    damping: tuple[float, float], duration: float, diverged_beyond: float
) -> None:
    """Each at its time, within blocks and across them, its last half second as it was; those that stay disturb none."""
    scenes = [
        pressed(
            duration=duration,
            diverged_beyond=diverged_beyond,
            clock={"round_trip_delay": 0.004},
            dissipation=[{"kind": "damping", "damping": each, "acts": "always"}],
        )
        for each in np.linspace(*damping, 16).tolist()
    ]
    expected = run_batch(scenes, KINDS)
    ends = {result["ticks"] for result in expected}
    assert len(ends) > 5
    if duration > 1.0:  # the first has run for longer than what is kept of it
        assert min(ends) > 700
    for result, exact in zip(compiled(scenes), expected, strict=True):
        assert {key: result[key] for key in ("ticks", "steps", "ended", "verdict")} == {
            key: exact[key] for key in ("ticks", "steps", "ended", "verdict")
        }
        assert agree(result["final"], exact["final"], 1e-6)
        assert agree(result["window"], exact["window"], 1e-6)
        assert result["energy"]["residual_J"] < 1e-14 * result["energy"]["moved_J"]
        assert result["energy"]["moved_J"] == pytest.approx(exact["energy"]["moved_J"], rel=1e-6)
