"""The exchange of a tick by co-simulation frameworks: a sample one way, a force back, with nothing computed.

usage: python tests/bench/cosimulation.py [TICKS]. HELICS (core zmq) and mosaik (simulators over TCP), their two sides
processes pinned as plant and controller of a run are, beside the bare ping-pong and haploop's run, which computes,
books and logs as well; without delay, and with delay that is lookahead where a framework has that (HELICS: its output
delay). What is not installed is left out, with a word.
"""

from __future__ import annotations

import importlib.util
import os
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial

from rich.console import Console
from rich.table import Table
from yardsticks import loop_us, ping_pong_us

from haploop.launch.processes.children import share_cores
from haploop.tools.machine import machine

REPEATS, PERIOD_S = 3, 1e-3
# haploop's runs are so many times as long: their start takes as much processor time as thousands of ticks.
LONGER = 30


def helics_federate(role: str, ticks: int, one_way: int) -> None:
    """One side: the plant publishes at every tick, the controller answers half a tick later, or after a delay.

    Args:
        one_way: delay of either way in ticks; 0: an answer within the tick.
    """
    import helics as h  # pyright: ignore[reportMissingImports]

    broker = h.helicsCreateBroker("zmq", "", "-f 2") if role == "plant" else None
    info = h.helicsCreateFederateInfo()
    h.helicsFederateInfoSetCoreTypeFromString(info, "zmq")
    h.helicsFederateInfoSetCoreInitString(info, "--federates=1")
    h.helicsFederateInfoSetTimeProperty(info, h.HELICS_PROPERTY_TIME_PERIOD, PERIOD_S)
    if one_way:
        h.helicsFederateInfoSetTimeProperty(info, h.HELICS_PROPERTY_TIME_OUTPUT_DELAY, (one_way - 1e-6) * PERIOD_S)
    elif role == "controller":
        h.helicsFederateInfoSetTimeProperty(info, h.HELICS_PROPERTY_TIME_OFFSET, PERIOD_S / 2)
    federate = h.helicsCreateValueFederate(role, info)
    other = {"plant": "controller", "controller": "plant"}[role]
    said = h.helicsFederateRegisterGlobalPublication(federate, role, h.HELICS_DATA_TYPE_DOUBLE, "")
    heard = h.helicsFederateRegisterSubscription(federate, other, "")
    h.helicsFederateEnterExecutingMode(federate)
    value, began = 0.0, time.perf_counter()
    for tick in range(ticks):
        if role == "plant":
            h.helicsPublicationPublishDouble(said, tick + 0.5)
            h.helicsFederateRequestTime(federate, (tick + 1) * PERIOD_S)
            value = h.helicsInputGetDouble(heard)
        else:
            h.helicsFederateRequestTime(federate, (tick + (1 if one_way else 0.5)) * PERIOD_S)
            h.helicsPublicationPublishDouble(said, h.helicsInputGetDouble(heard))
    took = time.perf_counter() - began
    if role == "plant":
        answered = ticks - max(1, 2 * one_way) + 0.5
        assert value == answered, f"the last force answered {value}, not {answered}"
        print(took / ticks * 1e6)
    h.helicsFederateDestroy(federate)
    if broker:
        h.helicsBrokerWaitForDisconnect(broker, 5000)
        h.helicsCloseLibrary()


def helics_us(ticks: int, one_way: int = 0) -> float:
    sides = [
        subprocess.Popen(
            [sys.executable, __file__, "helics", role, str(ticks), str(one_way)], stdout=subprocess.PIPE, text=True
        )
        for role in ("plant", "controller")
    ]
    for side in sides:
        _pin(side.pid)
    said = [side.communicate(timeout=300)[0] for side in sides]
    return float(said[0].split()[0])


def mosaik_simulator(address: str) -> None:
    """Serves one side: it holds a value, and answers what it is given at every step."""
    import mosaik_api_v3  # pyright: ignore[reportMissingImports]

    class Side(mosaik_api_v3.Simulator):
        def __init__(self) -> None:
            model = {"public": True, "params": [], "attrs": ["given", "said"]}
            super().__init__({"api_version": "3.0", "type": "time-based", "models": {"Side": model}})
            self.value = 0.5

        def create(self, num: int, model: str) -> list[dict[str, str]]:
            return [{"eid": "side", "type": model}]

        def step(self, time: int, inputs: dict, max_advance: int) -> int:
            for value in inputs.get("side", {}).get("given", {}).values():
                self.value = value
            return time + 1

        def get_data(self, outputs: dict) -> dict:
            return {"side": {"said": self.value}}

    sys.argv = [sys.argv[0], address]
    mosaik_api_v3.start_simulation(Side())


def mosaik_us(ticks: int) -> float:
    said = subprocess.run(
        [sys.executable, __file__, "mosaik", "world", str(ticks)], capture_output=True, text=True, check=True
    )
    return float(said.stdout.split()[-1])


def mosaik_world(ticks: int) -> None:
    import mosaik  # pyright: ignore[reportMissingImports]

    _pin(0)  # with all that it starts
    command = f"%(python)s {__file__} mosaik %(addr)s"
    with mosaik.World({"Side": {"cmd": command}}, time_resolution=PERIOD_S) as world:
        plant, controller = (world.start("Side").Side.create(1)[0] for _ in range(2))
        world.connect(plant, controller, ("said", "given"))
        world.connect(controller, plant, ("said", "given"), time_shifted=True, initial_data={"said": 0.5})
        began = time.perf_counter()
        world.run(until=ticks, print_progress=False)
        print((time.perf_counter() - began) / ticks * 1e6)


def _pin(pid: int) -> None:
    if cores := share_cores(0)[0]:
        os.sched_setaffinity(pid, cores)


FRAMEWORKS: dict[str, dict[str, Callable[[int], float]]] = {
    "helics": {
        "HELICS, no delay": helics_us,
        "HELICS, 2 ms of delay": partial(helics_us, one_way=1),
        "HELICS, 10 ms of delay": partial(helics_us, one_way=5),
    },
    "mosaik": {"mosaik, no delay": mosaik_us},
}


def used_s() -> float:
    """Processor time of this process and of all that it has waited for, s."""
    own, children = (resource.getrusage(of) for of in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime


def measured(by: Callable[[int], float], ticks: int) -> tuple[float, float]:
    """Returns (time on the clock, processor time of all processes) per tick, us; starting and ending taken out."""
    used, clock_us = [], 0.0
    for count in (ticks, 3 * ticks):
        before = used_s()
        clock_us = by(count)
        used.append(used_s() - before)
    return clock_us, (used[1] - used[0]) / (2 * ticks) * 1e6


def main() -> None:
    """Measures in turn, repeats, prints medians and ratios to haploop's run with the same delay."""
    ticks = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    own = {"no delay": 0.0, "2 ms of delay": 2e-3, "10 ms of delay": 1e-2}
    rows: dict[str, Callable[[int], float]] = {"ping-pong": lambda count: ping_pong_us(LONGER * count)}
    for delay, delay_s in own.items():
        rows[f"haploop, {delay}"] = lambda count, of=delay_s: loop_us(of, "steps", LONGER * count * PERIOD_S)()
    for name, measures in FRAMEWORKS.items():
        if importlib.util.find_spec(name):
            rows |= measures
        else:
            print(f"Left out, since it is not installed: {name}.")
    seen: dict[str, list[tuple[float, float]]] = {name: [] for name in rows}
    for _ in range(REPEATS):
        for name, by in rows.items():
            clock_us, used_us = measured(by, ticks)
            seen[name].append((clock_us, used_us / LONGER if name.startswith(("ping", "haploop")) else used_us))
    medians = {name: [statistics.median(of) for of in zip(*values, strict=True)] for name, values in seen.items()}
    table = Table(title=f"medians of {REPEATS} interleaved repeats; {machine()}", title_justify="left")
    for heading in ("a tick by", "µs on the clock", "× haploop", "µs of processors", "× haploop"):
        table.add_column(heading)
    for name, row in medians.items():
        delay = name.partition(", ")[2] or "no delay"
        ratios = [value / ours for value, ours in zip(row, medians[f"haploop, {delay}"], strict=True)]
        table.add_row(name, f"{row[0]:.3g}", f"{ratios[0]:.2f}", f"{row[1]:.3g}", f"{ratios[1]:.2f}")
    Console(width=100).print(table)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["helics", role, count, one_way]:
            helics_federate(role, int(count), int(one_way))
        case ["mosaik", "world", count]:
            mosaik_world(int(count))
        case ["mosaik", address, *_]:
            mosaik_simulator(address)
        case _:
            main()
