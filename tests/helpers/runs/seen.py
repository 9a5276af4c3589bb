"""Measures of a motion as a page that received it computes them."""

import numpy as np

from haploop.protocol.scene.scene import Wall
from haploop.protocol.ticks import Timebase
from haploop.view.look.sight import see
from haploop.view.store.history import AtWork, History

TIME = Timebase(10_000, 1_000, 0, 100_000)
COUNT_M = 1e-5


def history_of(x, force, wall_m: float | None = 0.0):
    """A history over 3 s of positions and forces, functions of time in s, sampled at plant steps."""
    history, ticks = History(TIME, 0), 3000
    t = np.arange(ticks * 10) / 1e4
    history.append_steps(0, {"x": x(t) + 0.0 * t, "force": force(t) + 0.0 * t})
    now = np.arange(ticks) / 1e3
    columns = {"x": x(now) + 0.0 * now, "v": 0.0 * now, "wall": 0.0 * now, "total": force(now) + 0.0 * now}
    history.append_ticks(0, columns, AtWork((), None if wall_m is None else Wall(position=wall_m, stiffness=100.0)))
    return history


def seen(x, force=lambda t: 0.1, since=0, end=3000, wall_m: float | None = 0.0):
    found = see(history_of(x, force, wall_m), since, end, COUNT_M)
    assert found
    return found


def deep(t):
    return -1e-3 + 0.0 * t


def sine(f, size):
    return lambda t: -5e-3 + size * np.sin(2 * np.pi * f * t)
