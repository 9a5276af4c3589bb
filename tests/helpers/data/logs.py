"""Logs made in the tests: what a run with a swap in it leaves behind, with numbers that are hard to convert."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from haploop.logger.log.writer import Log

PLANT = {"timestamp": "s", "t": "s", "x": "m", "v": "m/s", "force": "N"}
BEFORE = {"timestamp": "s", "x": "m", "wall": "N", "dissipation.0": "N", "in_contact": ""}
AFTER = {"timestamp": "s", "x": "m", "wall": "N", "dissipation.0": "N", "dissipation.1": "N", "in_contact": ""}
SCENE = 'title = "µ"\n'.encode()
# Subnormal, negative zero, shortest at 17 digits, extreme, and not finite.
HARD = np.array([5e-324, -0.0, 0.1 + 0.2, 1.7976931348623157e308, -1e-7, 1e16, np.nan, np.inf, -np.inf])


def swapped_run(path: Path, ticks: int = 300, *, steps: int = 10, hard: bool = True, flush_ticks: int = 100) -> Path:
    """A log of /plant, /controller and /events in which an element is added at half time; returns its directory."""
    path.mkdir(exist_ok=True)
    rng = np.random.default_rng(7)
    half = ticks // 2
    with Log(path / "log.mcap") as log:
        log.attach("scene.toml", "text/plain", SCENE)
        events = log.channel("/events", {}, title="what changed the run, at its tick")
        plant = log.channel("/plant", PLANT, samples_per_message=steps, title="the plant at every step")
        last = log.channel("/plant", PLANT, samples_per_message=1, title="the plant at every step")
        for first in range(0, ticks, flush_ticks):
            number = np.arange(first, min(first + flush_ticks, ticks))
            step = np.arange(number[0] * steps, (number[-1] + 1) * steps)
            motion = rng.standard_normal((len(step), 3))
            if hard:
                motion[: len(HARD), 2] = HARD
            t = step / (1000 * steps)
            rows = np.column_stack((t, t, motion)).reshape(len(number), steps, len(PLANT))
            log.write(plant, number * 1_000_000, rows)
            for part, columns in ((number[number < half], BEFORE), (number[number >= half], AFTER)):
                if not len(part):
                    continue
                controller = log.channel("/controller", columns, title="the controller at every tick")
                forces = rng.standard_normal((len(part), len(columns) - 2))
                log.write(
                    controller, part * 1_000_000, np.column_stack((part / 1000, forces, part % 2)).astype(np.float64)
                )
            if half in number:
                swap = {
                    "timestamp": half / 1000,
                    "tick": half,
                    "swap": {"kind": "damping", "damping": 0.8},
                    "element": 1,
                }
                log.message(events, half * 1_000_000, swap)
            log.flush()
        end = np.array([[[ticks / 1000, ticks / 1000, 1.0, 2.0, 3.0]]])
        log.write(last, np.array([ticks * 1_000_000]), end)
    return path


def cut(run: Path, share: float) -> None:
    """Shorten a log, as a killed run would leave it."""
    log = run / "log.mcap"
    content = log.read_bytes()
    log.write_bytes(content[: int(share * len(content))])


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    """Tells whether two arrays of float64 agree in every bit; all NaNs count as equal."""
    a, b = np.ascontiguousarray(a), np.ascontiguousarray(b)
    equal = (a.view(np.uint64) == b.view(np.uint64)) | (np.isnan(a) & np.isnan(b))
    return a.dtype == b.dtype == np.float64 and a.shape == b.shape and bool(equal.all())
