"""Yardsticks of speed: the bare ping-pong of the transport, the bare loop of the arithmetic; and a run as processes."""

from __future__ import annotations

import math
import multiprocessing
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import msgpack
import zmq

from haploop.launch.processes.children import share_cores
from haploop.launch.runs.start import prepare, run
from haploop.plant.motion.transition import make_foh_transition

SCENE = Path(__file__).parents[2] / "launch" / "scenes" / "fig6c.toml"
_pack = msgpack.Packer(autoreset=True).pack


def _echo(address: str, ticks: int) -> None:
    """The other side of the ping-pong: one force for one sample."""
    socket = zmq.Context().socket(zmq.DEALER)
    socket.connect(address)
    socket.send(b"")
    for _ in range(ticks):
        message = msgpack.unpackb(socket.recv())
        socket.send(_pack([1, 2, message[2], [0.25]]))
    socket.close(linger=1000)


def _ping_pong(address: str, ticks: int, result: str, cores: set[int] | None) -> None:
    import os

    if cores:
        os.sched_setaffinity(0, cores)
    socket = zmq.Context().socket(zmq.DEALER)
    socket.bind(address)
    echo = multiprocessing.get_context("spawn").Process(target=_echo, args=(address, ticks))
    echo.start()
    if cores and echo.pid:
        os.sched_setaffinity(echo.pid, cores)
    socket.recv()
    began = time.perf_counter()
    for tick in range(ticks):
        socket.send(_pack([1, 1, tick, [[0.5]]]))
        msgpack.unpackb(socket.recv())
    Path(result).write_text(str((time.perf_counter() - began) / ticks * 1e6), encoding="utf-8")
    echo.join()


def ping_pong_us(ticks: int = 10_000) -> float:
    """µs per tick of a DEALER/DEALER ping-pong over ipc with msgpack, both processes pinned as the nodes are."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = (f"ipc://{folder}/p.sock", ticks, f"{folder}/result", share_cores(0)[0])
        process = multiprocessing.get_context("spawn").Process(target=_ping_pong, args=arguments)
        process.start()
        process.join()
        return float(Path(folder, "result").read_text(encoding="utf-8"))


def plain_loop_us(ticks: int = 20_000) -> float:
    """µs per tick of figure 6c's arithmetic in one plain Python function: no classes, no books, no log, no checks."""
    flow = make_foh_transition(0.02, 0.11, 10.0, 1e-4)
    a, b, f, g = 1.0 + flow.x_x, flow.x_v, flow.x_force, flow.x_slope
    c, d, h, i = flow.v_x, 1.0 + flow.v_v, flow.v_force, flow.v_slope
    period, resolution = 1e-3, 1e-5
    x = v = x_before = v_before = a_before = 0.0
    forces = [0.0, 0.0, 0.0]
    xs: list[float] = []
    began = time.perf_counter()
    for tick in range(ticks):
        measured = resolution * round(x / resolution)
        speed = (measured - x_before) / period
        acceleration = (speed - v_before) / period
        force = 0.0
        if measured < -0.06:
            force = 150.0 * (-0.06 - measured)
            if speed * a_before >= 0.0:
                force -= 0.01 * acceleration
        x_before, v_before, a_before = measured, speed, acceleration
        forces.append(force)
        held = forces[tick + 1]
        for step in range(10):
            tau = -0.65 * min(1.0, (tick * 10 + step) * 1e-4)
            total = held + tau
            x, v = a * x + b * v + f * total + g * -6.5e-5, c * x + d * v + h * total + i * -6.5e-5
            xs.append(x)
        if len(xs) > 1000:
            xs.clear()
    took = (time.perf_counter() - began) / ticks * 1e6
    assert math.isfinite(x)
    return took


def loop_us(delay_s: float, log: str, seconds: float) -> Callable[[], float]:
    """Wall time per tick of figure 6c, its wall softer, as processes, logged to disk."""

    def measure() -> float:
        with tempfile.TemporaryDirectory() as folder:
            settings = [
                f"clock.round_trip_delay={delay_s}",
                f"duration={seconds}",
                f"run.log={log}",
                "run.verdict=window",
                "wall.stiffness=5",  # which bears 10 ms of delay: a run that is thrown off ends early
            ]
            summary = run(prepare(SCENE, settings, out=Path(folder, "out")))
            return summary["wall_s"] / summary["ticks"] * 1e6

    return measure
