"""The yardstick of arrays of scenes: figure 6's loop with its books, written by hand for a compiler (needs numba)."""

from __future__ import annotations

from typing import Any

import numba  # pyright: ignore[reportMissingImports]
import numpy as np

from haploop.plant.flow import HeldFlow, motion_integrals, natural_rate
from haploop.plant.linear_motion import LinearMotion
from haploop.plant.mechanics import Mechanics
from haploop.protocol.ticks import Timebase

BOOKS = 11


@numba.njit(cache=False, fastmath=False)
def _loops(  # pragma: no cover
    stiffness, damping, position, resolution, period, ticks, lookahead, held, response, tau, square, lag, m, b, k,
    dampers, scale, with_books, out, trace,
):  # fmt: skip
    n = held.shape[0] - 1
    window = trace.shape[0] - 1
    forces = np.zeros((lookahead + 1, 3))
    books, errors, added = np.zeros(BOOKS), np.zeros(BOOKS), np.zeros(BOOKS)
    for cell in range(len(stiffness)):
        books[:], errors[:], forces[:] = 0.0, 0.0, 0.0
        x = v = x_low = v_low = 0.0
        measured_before, least, most, strongest = 0.0, 0.0, 0.0, 0.0
        steps = 0
        trace[0] = x
        for tick in range(ticks):
            measured = resolution * np.rint(x / resolution)
            speed = (measured - measured_before) / period
            measured_before = measured
            inside = position - measured
            wall = damper = 0.0
            if inside > 0.0:
                wall = stiffness[cell] * inside
                damper = -damping[cell] * speed
            slot = tick % (lookahead + 1)
            forces[slot, 0], forces[slot, 1], forces[slot, 2] = wall + damper, wall, damper
            acting = (tick - lookahead) % (lookahead + 1)
            force, wall_acting, damper_acting = 0.0, 0.0, 0.0
            if tick >= lookahead:
                force, wall_acting, damper_acting = forces[acting, 0], forces[acting, 1], forces[acting, 2]
            strongest = max(strongest, abs(force))
            depth = stiffness[cell] * max(0.0, position - x)
            from_x, from_v, from_low = x, v, x_low
            to_x, to_v, to_low, dv = x, v, x_low, 0.0
            added[:] = 0.0
            for step in range(1, n + 1):
                dx = held[step, 0] * x + held[step, 1] * v + held[step, 2] * force + x_low + response[tick, step, 0]
                dv = held[step, 3] * x + held[step, 4] * v + held[step, 5] * force + v_low + response[tick, step, 1]
                to_x, to_v = x + dx, v + dv
                to_low = dx - (to_x - x)
                least, most = min(least, to_x), max(most, to_x)
                steps += 1
                trace[steps % (window + 1)] = to_x
                if with_books:
                    at = tick * n + step - 1
                    way, change = (to_x - from_x) + (to_low - from_low), to_v - from_v
                    rise = tau[at + 1] - tau[at]
                    net = force + tau[at] - b * from_v - k * from_x
                    w0, w1, w2 = from_v, net * scale, rise * scale
                    speed2 = (
                        square[0, 0] * w0 * w0 + 2.0 * square[0, 1] * w0 * w1 + 2.0 * square[0, 2] * w0 * w2
                        + square[1, 1] * w1 * w1 + 2.0 * square[1, 2] * w1 * w2 + square[2, 2] * w2 * w2
                    )  # fmt: skip
                    lagged = lag[0] * w0 + lag[1] * w1 + lag[2] * w2
                    work = (tau[at] + rise / 2.0) * way + rise * lagged
                    heat0, heat1 = dampers[0] * speed2, dampers[1] * speed2
                    kinetic = m * change * (from_v + change / 2.0)
                    spring = k * way * (from_x + way / 2.0)
                    true0, true1 = -wall_acting * way, -damper_acting * way
                    before, after = max(0.0, position - from_x), max(0.0, position - to_x)
                    added[0] += work
                    added[1] += heat0
                    added[2] += heat1
                    added[3] += kinetic
                    added[4] += spring
                    added[5] += true0
                    added[6] += true1
                    added[7] += (
                        abs(work) + abs(heat0) + abs(heat1) + abs(kinetic) + abs(spring) + abs(true0) + abs(true1)
                    ) / 2.0
                    added[8] += stiffness[cell] * (after - before) * (after + before) / 2.0
                    added[9] += -depth * way
                    added[10] += -wall * way
                    from_x, from_v, from_low = to_x, to_v, to_low
            x, v_before, v = to_x, v, to_v
            x_low, v_low = to_low, dv - (to_v - v_before)
            if with_books:
                for book in range(BOOKS):
                    before_sum = books[book]
                    after_sum = before_sum + added[book]
                    part = after_sum - before_sum
                    errors[book] += (before_sum - (after_sum - part)) + (added[book] - part)
                    books[book] = after_sum
            if not abs(x) <= 1.0:
                break
        low, high = np.inf, -np.inf
        for value in trace:
            low, high = min(low, value), max(high, value)
        out[cell, 0], out[cell, 1], out[cell, 2], out[cell, 3] = least, most, strongest, high - low
        out[cell, 4 : 4 + BOOKS] = books + errors


def run_kernel(scenes: list[dict[str, Any]], energy: bool) -> np.ndarray:
    """Least, greatest position, greatest force, width of the last half second and the books; shape (scenes, 15)."""
    first = scenes[0]
    time = Timebase.of(first["clock"], first["duration"])
    m, n = Mechanics.of(first), time.steps_per_tick
    motion = LinearMotion(first, time)
    held = HeldFlow.of(m.mass_kg, m.damping, m.stiffness, time.step_s, n).coefficients
    pieces = [motion._responses(piece) for piece in range(-(-time.ticks // 256))]
    square, lag = motion_integrals(m.mass_kg, m.damping, m.stiffness, time.step_s)
    out = np.zeros((len(scenes), 4 + BOOKS))
    _loops(
        np.array([scene["wall"]["stiffness"] for scene in scenes]),
        np.array([scene["dissipation"][0]["damping"] for scene in scenes]),
        first["wall"]["position"],
        first["encoder"]["resolution"],
        time.period_s,
        time.ticks,
        time.lookahead_ticks,
        held,
        np.concatenate(pieces),
        motion._tau.at_steps(0, time.ticks * n + 1),
        square.astype(float),
        lag.astype(float),
        m.mass_kg,
        m.damping,
        m.stiffness,
        np.array(list(m.dampers.values())),
        1.0 / (m.mass_kg * natural_rate(m.mass_kg, m.stiffness, time.step_s)),
        energy,
        out,
        np.zeros(min(time.plant_rate // 2, time.ticks * n) + 1),
    )
    return out
