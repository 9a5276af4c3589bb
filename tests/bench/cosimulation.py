"""The exchange of a tick by co-simulation frameworks: a sample one way, a force back, with nothing computed.

usage: python tests/bench/cosimulation.py [TICKS]. HELICS (core zmq) and mosaik (simulators over TCP), their two sides
processes pinned as plant and controller of a run are, beside the bare ping-pong and haploop's run without delay, ten
times as long, which computes, books and logs as well. What is not installed is left out, with a word.
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

from rich.console import Console
from rich.table import Table
from yardsticks import loop_us, ping_pong_us

from haploop.launch.processes.children import share_cores
from haploop.tools.machine import machine

REPEATS, PERIOD_S = 3, 1e-3


def helics_federate(role: str, ticks: int) -> None:
    """One side: the plant publishes at every tick, the controller answers half a tick later."""
    import helics as h  # pyright: ignore[reportMissingImports]

    broker = h.helicsCreateBroker("zmq", "", "-f 2") if role == "plant" else None
    info = h.helicsCreateFederateInfo()
    h.helicsFederateInfoSetCoreTypeFromString(info, "zmq")
    h.helicsFederateInfoSetCoreInitString(info, "--federates=1")
    h.helicsFederateInfoSetTimeProperty(info, h.HELICS_PROPERTY_TIME_PERIOD, PERIOD_S)
    if role == "controller":
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
            h.helicsFederateRequestTime(federate, (tick + 0.5) * PERIOD_S)
            h.helicsPublicationPublishDouble(said, h.helicsInputGetDouble(heard))
    took = time.perf_counter() - began
    if role == "plant":
        assert value == ticks - 0.5, f"the last force answered {value}"
        print(took / ticks * 1e6)
    h.helicsFederateDestroy(federate)
    if broker:
        h.helicsBrokerWaitForDisconnect(broker, 5000)
        h.helicsCloseLibrary()


def helics_us(ticks: int) -> float:
    sides = [
        subprocess.Popen([sys.executable, __file__, "helics", role, str(ticks)], stdout=subprocess.PIPE, text=True)
        for role in ("plant", "controller")
    ]
    for side in sides:
        _pin(side.pid)
    said = [side.communicate(timeout=300)[0] for side in sides]
    return float(said[0].split()[-1])


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


FRAMEWORKS: dict[str, Callable[[int], float]] = {"helics": helics_us, "mosaik": mosaik_us}


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
    """Measure in turn, repeat, print medians and ratios."""
    ticks = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    rows: dict[str, Callable[[int], float]] = {
        "ping-pong": lambda count: ping_pong_us(10 * count),
        "haploop, no delay": lambda count: loop_us(0.0, "steps", 10 * count * PERIOD_S)(),
    }
    for name, measure in FRAMEWORKS.items():
        if importlib.util.find_spec(name):
            rows[name] = measure
        else:
            print(f"Left out, since it is not installed: {name}.")
    seen: dict[str, list[tuple[float, float]]] = {name: [] for name in rows}
    for _ in range(REPEATS):
        for name, by in rows.items():
            clock_us, used_us = measured(by, ticks)
            seen[name].append((clock_us, used_us if name in FRAMEWORKS else used_us / 10))
    medians = {name: [statistics.median(of) for of in zip(*values, strict=True)] for name, values in seen.items()}
    table = Table(title=f"medians of {REPEATS} interleaved repeats; {machine()}", title_justify="left")
    for heading in ("a tick by", "µs on the clock", "/ haploop's", "µs of processors", "/ haploop's"):
        table.add_column(heading)
    for name, row in medians.items():
        ratios = [value / own for value, own in zip(row, medians["haploop, no delay"], strict=True)]
        table.add_row(name, f"{row[0]:.3g}", f"{ratios[0]:.2f}", f"{row[1]:.3g}", f"{ratios[1]:.2f}")
    Console(width=100).print(table)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["helics", role, count]:
            helics_federate(role, int(count))
        case ["mosaik", "world", count]:
            mosaik_world(int(count))
        case ["mosaik", address, *_]:
            mosaik_simulator(address)
        case _:
            main()
