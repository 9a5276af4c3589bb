"""The yardstick of arrays of scenes: figure 6's loop with its books, written by hand for a compiler (needs numba)."""

from __future__ import annotations

import numba  # pyright: ignore[reportMissingImports]
import numpy as np

from haploop.logger.books.one_mass import as_squares
from haploop.plant.motion.one_mass import Mechanics, OneMassMotion
from haploop.plant.motion.transition import make_zoh_transitions, motion_integrals, natural_rate
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

BOOKS: tuple[str, ...] = (
    "hand_work", "device_heat", "hand_heat", "kinetic", "spring", "wall.true", "damping.true", "moved",
    "ideal", "sampled_and_held", "quantised", "wall.sampled", "damping.sampled",
)  # fmt: skip
FIGURES = 9


@numba.njit(cache=False, fastmath=False)
def _judge(trace, steps, measured, totals, ticks, position, swing, out):  # pragma: no cover
    """Width, crossings and growth of the swings about the trend line, and the measures of the ticks in contact."""
    kept, rows = min(steps, len(trace) - 1) + 1, min(ticks, len(measured))
    first = (steps + 1 - kept) % len(trace)
    low, high, mean = np.inf, -np.inf, 0.0
    for i in range(kept):
        value = trace[(first + i) % len(trace)]
        low, high, mean = min(low, value), max(high, value), mean + value
    mean /= kept
    slope, square = 0.0, 0.0
    for i in range(kept):
        t = i - (kept - 1) / 2.0
        slope, square = slope + t * (trace[(first + i) % len(trace)] - mean), square + t * t
    slope /= square
    crossings, side = 0, 0
    lows, highs = np.full(2, np.inf), np.full(2, -np.inf)
    for i in range(kept):
        offset = trace[(first + i) % len(trace)] - mean - slope * (i - (kept - 1) / 2.0)
        half = int(i >= kept // 2)
        lows[half], highs[half] = min(lows[half], offset), max(highs[half], offset)
        if abs(offset) > swing:
            now = 1 if offset > 0.0 else -1
            crossings += side == -now
            side = now
    inside, real, stiffness, depths = 0, 0, 0.0, 0.0
    for i in range(rows):
        depth = position - measured[i]
        if depth > 0.0:
            inside, depths = inside + 1, depths + depth
            if depth > 1e-12 * abs(position):
                real, stiffness = real + 1, stiffness + totals[i] / depth
    out[0], out[1] = high - low, crossings
    out[2] = (highs[1] - lows[1]) / (highs[0] - lows[0]) if highs[0] > lows[0] else 0.0
    out[3] = 1.0 - inside / rows
    out[4], out[5] = stiffness / max(real, 1), depths / max(inside, 1)


@numba.njit(cache=False, fastmath=False)
def _loops(  # pragma: no cover
    stiffness, damping, position, resolution, period, ticks, lookahead, held, response, tau, square, lag, m, b, k,
    dampers, with_books, out, trace, measured_in, totals_in,
):  # fmt: skip
    n = held.shape[0] - 1
    window, rows = trace.shape[0] - 1, len(measured_in)
    forces = np.zeros((lookahead + 1, 3))
    books, errors, added = np.zeros(len(BOOKS)), np.zeros(len(BOOKS)), np.zeros(len(BOOKS))
    for cell in range(len(stiffness)):
        books[:], errors[:], forces[:] = 0.0, 0.0, 0.0
        x = v = x_low = v_low = 0.0
        measured_before, least, most, strongest = 0.0, 0.0, 0.0, 0.0
        wall = damper = 0.0
        steps = 0
        trace[0] = x
        for tick in range(ticks):
            measured = resolution * np.rint(x / resolution)
            seen = measured - measured_before
            speed = seen / period
            measured_before = measured
            added[11], added[12] = -wall * seen, -damper * seen
            inside = position - measured
            wall = damper = 0.0
            if inside > 0.0:
                wall = stiffness[cell] * inside
                damper = -damping[cell] * speed
            measured_in[tick % rows], totals_in[tick % rows] = measured, wall + damper
            slot = tick % (lookahead + 1)
            forces[slot, 0], forces[slot, 1], forces[slot, 2] = wall + damper, wall, damper
            acting = (tick - lookahead) % (lookahead + 1)
            force, wall_acting, damper_acting = 0.0, 0.0, 0.0
            if tick >= lookahead:
                force, wall_acting, damper_acting = forces[acting, 0], forces[acting, 1], forces[acting, 2]
            strongest = max(strongest, abs(force))
            before = max(0.0, position - x)
            from_x, from_v, from_low = x, v, x_low
            to_x, to_v, to_low, dv = x, v, x_low, 0.0
            work = speed2 = way = 0.0
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
                    moved = (to_x - from_x) + (to_low - from_low)
                    rise = tau[at + 1] - tau[at]
                    net = force + tau[at] - b * from_v - k * from_x
                    first = from_v + square[1] * net + square[2] * rise
                    second = net + square[4] * rise
                    speed2 += square[0] * first * first + square[3] * second * second + square[5] * rise * rise
                    lagged = lag[0] * from_v + lag[1] * net + lag[2] * rise
                    work += (tau[at] + rise * 0.5) * moved + rise * lagged
                    way += moved
                    from_x, from_v, from_low = to_x, to_v, to_low
            if with_books:
                change, after = to_v - v, max(0.0, position - to_x)
                added[0] = work
                added[1], added[2] = dampers[0] * speed2, dampers[1] * speed2
                added[3] = m * change * (v + change * 0.5)
                added[4] = k * way * (x + way * 0.5)
                added[5], added[6] = -wall_acting * way, -damper_acting * way
                added[7] = 0.0
                for book in range(7):
                    added[7] += abs(added[book])
                added[7] *= 0.5
                added[8] = 0.5 * stiffness[cell] * (after - before) * (after + before)
                added[9] = -stiffness[cell] * before * way
                added[10] = -wall * way
            x, v_before, v = to_x, v, to_v
            x_low, v_low = to_low, dv - (to_v - v_before)
            if with_books:
                for book in range(len(BOOKS)):
                    before_sum = books[book]
                    after_sum = before_sum + added[book]
                    part = after_sum - before_sum
                    errors[book] += (before_sum - (after_sum - part)) + (added[book] - part)
                    books[book] = after_sum
            if not abs(x) <= 1.0:
                break
        out[cell, 0], out[cell, 1], out[cell, 2] = least, most, strongest
        _judge(trace, steps, measured_in, totals_in, steps // n, position, resolution, out[cell, 3:FIGURES])
        out[cell, FIGURES:] = books + errors


def run_kernel(scenes: list[Scene], energy: bool) -> np.ndarray:
    """Extremes, measures of the window and ``BOOKS``, as in a summary; shape (scenes, FIGURES + books)."""
    first = scenes[0]
    time = Timebase.from_scene(first)
    m, n = Mechanics.from_scene(first), time.steps_per_tick
    motion = OneMassMotion(first, time)
    held = make_zoh_transitions(m.mass_kg, m.damping, m.stiffness, time.step_s, n)
    square, lag = motion_integrals(m.mass_kg, m.damping, m.stiffness, time.step_s)
    push = 1.0 / (m.mass_kg * natural_rate(m.mass_kg, m.stiffness, time.step_s))
    scales = np.array([1.0, push, push])
    out, kept = np.zeros((len(scenes), FIGURES + len(BOOKS))), min(time.control_rate // 2, time.ticks)
    _loops(
        np.array([value_at(scene, "wall.stiffness") for scene in scenes]),
        np.array([value_at(scene, "dissipation.0.damping") for scene in scenes]),
        value_at(first, "wall.position"),
        value_at(first, "encoder.resolution"),
        time.period_s,
        time.ticks,
        time.lookahead_ticks,
        held,
        motion.response.between(0, time.ticks).transpose(2, 1, 0).copy(),
        motion.response.tau.at_steps(0, time.ticks * n + 1),
        as_squares(square * np.outer(scales, scales)).astype(float),
        (lag * scales).astype(float),
        m.mass_kg,
        m.damping,
        m.stiffness,
        np.array(list(m.dampers.values())),
        energy,
        out,
        np.zeros(min(time.plant_rate // 2, time.ticks * n) + 1),
        *np.zeros((2, kept)),
    )
    return out
