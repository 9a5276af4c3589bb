"""Width, begin and end of a recorded buzz, and the power that a force gave to it, against what is known of each."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from haploop.api import read
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.bundled import bundled
from haploop.launch.scene.file import resolved
from haploop.launch.scene.reading.layers import read_layers
from haploop.launch.scene.toml_writer import to_toml
from haploop.tools.dissipate.recording.samples import Floats, Samples
from haploop.tools.dissipate.swing.buzz import Buzz
from haploop.tools.dissipate.swing.finder import BuzzFinder
from helpers.data.recordings import outcome, write
from helpers.scenes.effect_tables import slowly
from helpers.scenes.least import KINDS

K_N_M = 1000.0


def found(t: Floats, x: Floats, force: Floats, delay_s: float = 0.0) -> Buzz:
    """Returns the buzz of positions in pieces without a gap."""
    finder = BuzzFinder(float(t[1] - t[0]), delay_s)
    for at in range(0, len(t), 700):
        some = slice(at, at + 700)
        finder.add(Samples(t[some], x[some], None, None, x[some], None, at == 0, force_N=force[some]))
    buzz = finder.buzz()
    assert buzz
    return buzz


@pytest.mark.parametrize("seed", [*range(5), *slowly(range(5, 25))])
def test_width_times_and_power_are_those_of_a_drawn_sine_on_a_drift_that_begins_at_once_or_late(seed: int) -> None:
    """A spring that is d + T/2 late gives K A^2 w sin(w (d + T/2)) / 2, less by sinc(w T/2) for its steps."""
    random = np.random.default_rng(seed)
    period_s, late_s = 1.0 / random.choice([1e3, 2e3, 4e3, 1e4]), float(random.choice([0.0, 1.5e-3]))
    seconds = random.uniform(1.3, 5.0)
    begins_s = random.choice([0.0, random.uniform(0.0, seconds - 1.3)])
    w, amplitude_m = 2.0 * np.pi * random.uniform(16.0, 160.0), 10.0 ** random.uniform(-4.0, -3.0)
    count_m = random.choice([0.0, 1e-6, 11e-6])
    t = np.arange(0.0, seconds, period_s)
    drift = random.choice([0.0, 2e-3]) * np.sin(2.0 * np.pi * random.uniform(0.1, 1.0) * t) + 1e-3 * t
    swing = amplitude_m * np.sin(w * t + random.uniform(0.0, 6.0)) * (t >= begins_s)
    x = np.round((drift + swing) / count_m) * count_m if count_m else drift + swing
    buzz = found(t, x, -K_N_M * (drift + swing), late_s)
    half = 0.5 * w * period_s
    power_W = 0.5 * K_N_M * amplitude_m**2 * w * np.sin(w * late_s + half) * np.sin(half) / half
    for width_m in (buzz.width_m, buzz.first_m, buzz.last_m):
        assert width_m == pytest.approx(2.0 * amplitude_m, rel=0.01, abs=0.1 * count_m)
    assert abs(buzz.fed_W - power_W) < 0.02 * buzz.moved_W
    [(from_s, to_s)] = buzz.stretches
    assert from_s == pytest.approx(begins_s, abs=0.2)
    assert to_s == pytest.approx(t[-1], abs=0.125)


def test_of_a_swing_that_stops_in_a_recording_the_end_is_told_within_an_eighth_of_a_second() -> None:
    t = np.arange(6000.0) * 1e-3
    for ends_s in np.arange(2.0, 3.0, 0.07):
        x = 3e-4 * np.sin(2.0 * np.pi * 43.0 * t) * (t < ends_s)
        assert found(t, x, -x).stretches[-1][1] == pytest.approx(ends_s, abs=0.125)


def test_the_power_given_to_a_swing_counts_the_overtones_that_shape_it() -> None:
    """Each of them gets what a sine of its own width and frequency would."""
    t, w, half = np.arange(4000.0) * 1e-3, 2.0 * np.pi * 31.0, 0.5e-3
    widths_m = {1: 1e-3, 2: 1.5e-4}
    x = sum((width / 2.0 * np.sin(k * w * t + k) for k, width in widths_m.items()), np.zeros(len(t)))
    power_W = sum(
        0.125 * K_N_M * width**2 * k * w * np.sin(k * w * half) ** 2 / (k * w * half) for k, width in widths_m.items()
    )
    assert found(t, x, -K_N_M * x).fed_W == pytest.approx(power_W, rel=0.01)


@pytest.mark.slow
def test_a_buzz_in_a_run_and_in_its_positions_as_text_is_as_wide_as_the_device_swings(tmp_path: Path) -> None:
    layers = read_layers(bundled("scenes")["demo"])
    layers.data.pop("event")
    own = resolved(layers, ["run.log=steps", "wall.stiffness=2.5 N/mm"], KINDS)
    run_in_process(own, KINDS, out=tmp_path, attachments={"scene.toml": to_toml(own.as_dict())})
    plant, controller = (read(tmp_path)[name] for name in ("/plant", "/controller"))
    turns = np.array_split(plant["x"][len(plant["x"]) // 2 :], 15)
    width_m = float(np.median([np.ptp(turn) for turn in turns]))
    text = write(tmp_path / "run.csv", {"t (s)": controller["timestamp"], "x (m)": controller["x"]})
    for buzz in (outcome(tmp_path).buzz, outcome(text).buzz):
        assert buzz
        assert buzz.width_m == pytest.approx(width_m, rel=0.02)
