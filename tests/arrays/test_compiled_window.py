"""Windows of the compiled way."""

from __future__ import annotations

import numpy as np
import pytest

from haploop.protocol.scene.scene import Clock
from haploop.protocol.ticks import Timebase
from helpers.runs.compiled import agree


@pytest.mark.slow
def test_windows_read_by_a_program_show_what_they_show_by_themselves() -> None:
    """Of signals that drift, rest and swing, in and out of contact, whatever the place in the rings where they end."""
    from haploop.launch.batch.jax.block import Rings
    from haploop.launch.batch.jax.programs import in_double
    from haploop.launch.batch.jax.window import CompiledWindow

    time = Timebase.from_clock(Clock(control_rate=200, plant_rate=800), 10.0)
    rng = np.random.default_rng(5)
    for ticks in (101, 150, 317):
        window = CompiledWindow(time, np.array([0.0, 1e-5, 1e-4, 1e-3] * 4), 16, spare_ticks=40)
        t = np.arange(ticks * 4 + 1)[:, None] / 800
        size, rate = 10.0 ** rng.uniform(-6, -2, 16), rng.uniform(-3.0, 3.0, 16)
        x = size * np.exp(rate * t) * np.sin(rng.uniform(5.0, 200.0, 16) * t) + rng.normal(size=16) * 1e-3 * t
        x[:, 3] = 0.0
        for first in range(0, ticks, 10):
            last = min(first + 10, ticks)
            columns = {
                "x": x[::4],
                "total": 100.0 * x[::4],
                "in_contact": 1.0 * (x[::4] < 0.0),
                "wall_position": 0 * x[::4],
            }
            rows = {name: column[first:last] for name, column in columns.items()}
            window.add(x[first * 4 : last * 4 + 1], x[first * 4 : last * 4 + 1], rows)
        by_itself = list(window.measures(range(16)))
        with in_double():
            window.take(Rings(window.state.x.reshape(-1, 4, 16), dict(window.state.rows)), writable=False)
            by_program = list(window.measures(range(16)))
        for one, other in zip(by_itself, by_program, strict=True):
            assert (one.window.touched, one.window.crossings) == (other.window.touched, other.window.crossings)
            assert agree(one.window.figures._asdict(), other.window.figures._asdict(), 1e-9)
            assert one.window.growth == pytest.approx(other.window.growth, rel=1e-9)
            assert (one.extremes, one.swing_m) == (other.extremes, other.swing_m)
        assert any(one.window.crossings > 3 for one in by_itself)
        assert not by_program[3].window.touched
