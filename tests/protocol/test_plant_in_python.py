"""Plants in Python on the seat of examples/, which imports nothing of haploop: in lockstep, and by their own time."""

import importlib
import os
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import haploop.logger
from haploop.launch.clock.device_time import DELAY_STAYS, GOES_ON, PLANT, REFUSED, lateness_told
from haploop.launch.foreign import read_programs
from haploop.launch.processes.run_directory import CommandRefused
from haploop.launch.runs.start import prepare, run
from haploop.launch.spec import OutputError, RunFailed
from haploop.protocol.transport.keys import make_keys
from haploop.protocol.transport.sockets import Transport
from helpers.live.launched import BRIEF, HAPLOOP
from helpers.live.live_run import going
from helpers.live.waiting import PATIENCE_S, wait_for

HOUSE = Path(__file__).parents[2]
SCENE = HOUSE / "launch/scenes/fig6b.toml"
PLAIN = HOUSE / "tests/oracles/own_plant.py", "rk4"
BY_PLANT = {"clock": "plant"}
# An element that keeps the controller for 30 ms at a tick: no answer of then comes within the delay of 2 ms.
SLEEPER = """
import time
from haploop.controller.dissipation import Element

ticks = []

class Sleeper(Element):
    "0.1 N, at once but for one tick."

    kind = "sleeper"

    def force(self, motion):
        ticks.append(motion)
        if len(ticks) == ASLEEP:
            time.sleep(0.2)
        return 0.1
"""
TOLD = {"ticks": 3, "late_ticks": 1, "median_s": 1e-4, "percent_99_s": 1e-3, "percent_99_9_s": 1e-3, "most_s": 2e-3}
TOLD |= {"late_s": 2e-3, "lost_s": 0}


def plant(*script: Path | str) -> dict[str, Any]:
    return {"programs": read_programs([f"plant={shlex.join([sys.executable, *map(str, script or PLAIN)])}"], [])}


def last(held: Path) -> float:
    """The force that a device was given last, N."""
    lines = held.read_text().splitlines() if held.exists() else []
    return float(lines[-1]) if lines and lines[-1] else 0.0


def ran(out: Path, *overrides: str, plugins: tuple[Path, ...] = (), **options: Any) -> tuple[dict[str, Any], Any]:
    """The summary and the log of figure 6(b), 1 s of it, by window."""
    spec = prepare(SCENE, ("run.verdict=window", "duration=1", *overrides), plugins, out=out)
    return run(spec, **options), haploop.logger.read(out)


def test_a_plant_in_python_moves_as_the_runs_own_and_its_books_close(tmp_path: Path) -> None:
    summary, log = ran(tmp_path / "foreign", **plant())
    _, own = ran(tmp_path / "own", in_process=True)
    assert np.abs(log["/plant"]["x"] - own["/plant"]["x"]).max() < 1e-9
    assert abs(summary["energy"]["residual_J"]) < 1e-9 * summary["energy"]["moved_J"]


@pytest.mark.slow
def test_a_delay_set_in_mid_run_reaches_a_plant_in_python(tmp_path: Path) -> None:
    shorter = "encoder.resolution=1e-9", 'event=[{at=0.95, set={"clock.round_trip_delay"=0.0007}}]'
    _, log = ran(tmp_path / "foreign", *shorter, **plant())
    _, own = ran(tmp_path / "own", *shorter, in_process=True)
    _, longer = ran(tmp_path / "longer", shorter[0], in_process=True)
    assert np.abs(log["/plant"]["force"] - own["/plant"]["force"]).max() < 1e-5
    assert np.abs(longer["/plant"]["force"] - own["/plant"]["force"]).max() > 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(
    "keys",
    [["friction.kinetic=0.1"], ["noise.deviation=1e-6", "noise.cutoff=100"], ['acceleration.source="accelerometer"']],
)
def test_a_scene_beyond_the_seat_is_refused_by_name(tmp_path: Path, keys: list[str]) -> None:
    with pytest.raises(Exception, match=r"no (friction|noise|accelerometer); leave it out"):
        ran(tmp_path / "out", *keys, **plant())


@pytest.mark.slow
def test_without_late_answers_a_run_by_the_devices_time_has_the_bits_of_any_run(tmp_path: Path) -> None:
    summary, log = ran(tmp_path / "timed", **BY_PLANT, **plant())
    _, free = ran(tmp_path / "free", **plant())
    late = summary["lateness"]
    assert late["ticks"] > 900
    assert late["clock"] == PLANT
    same = [
        np.array_equal(log["/plant"][name], free["/plant"][name])
        for name in (
            "x",
            "v",
            "force",
        )
    ]
    assert all(same) or late["late_ticks"], "only a late answer can change a bit"


@pytest.mark.slow
@pytest.mark.parametrize(("asleep", "least"), [(500, 100), (990, 7)], ids=["in the middle", "to the end"])
def test_an_answer_that_is_late_is_counted_and_the_device_is_without_force_for_that_period(
    asleep: int, least: int, tmp_path: Path
) -> None:
    """Those that were due before the end of the run, and came after it, too."""
    (tmp_path / "sleeper.py").write_text(SLEEPER.replace("ASLEEP", str(asleep)))
    alone = 'dissipation=[{kind="sleeper", acts="always"}]', "wall.stiffness=0"
    summary, log = ran(tmp_path / "out", *alone, plugins=(tmp_path / "sleeper.py",), **BY_PLANT, **plant())
    late, forces = summary["lateness"]["late_ticks"], np.asarray(log["/plant"]["force"])[20:-1]
    assert late >= least
    assert set(forces) == {0.0, 0.1}
    assert np.count_nonzero(forces == 0.0) == 10 * late, "what comes after the end is late for nothing"


@pytest.mark.slow
def test_a_devices_time_is_neither_held_nor_hurried(tmp_path: Path) -> None:
    with going(tmp_path, "duration=600", **BY_PLANT, **plant()) as live:
        for verb in REFUSED:
            with pytest.raises(CommandRefused, match=GOES_ON):
                live.ask(verb, **({"pace": "free"} if verb == "pace" else {}))
        with pytest.raises(CommandRefused, match=DELAY_STAYS):
            live.ask("set", set={"clock.round_trip_delay": 0.0})
        live.ask("set", set={"wall.stiffness": 100.0})
        live.ask("stop")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("role", "fault"),
    [
        ("controller", signal.SIGSTOP),
        ("controller", signal.SIGKILL),
        ("logger", signal.SIGKILL),
        ("logger", signal.SIGSTOP),
    ],
)
def test_a_device_is_given_no_force_when_the_rest_of_its_run_fails(tmp_path: Path, role: str, fault: int) -> None:
    held = tmp_path / "held"
    with going(tmp_path, "wall.position=0.1", "duration=600", BRIEF, **BY_PLANT, **plant(*PLAIN, "0", held)) as live:
        wait_for("a force", lambda: last(held) != 0.0)
        pids = {node["role"]: node["pid"] for node in live.ask("status")[1]["nodes"]}
        os.kill(pids[role], fault)
        with suppress(RunFailed):
            live.result()
    assert last(held) == 0.0


@pytest.mark.slow
def test_a_device_is_given_no_force_when_the_launcher_is_killed(tmp_path: Path) -> None:
    held = tmp_path / "held"
    words = [*HAPLOOP, "run", str(SCENE), "--clock", "plant", "--set", "wall.position=0.1", "--set", "duration=30"]
    command = shlex.join([sys.executable, *map(str, PLAIN), "0", str(held)])
    words += ["--out", str(tmp_path / "out"), "--node", f"plant={command}"]
    launcher = subprocess.Popen(words, stderr=subprocess.DEVNULL)
    try:
        wait_for("a force", lambda: last(held) != 0.0)
    finally:
        launcher.kill()
        launcher.wait()
    wait_for("no force", lambda: last(held) == 0.0)


@pytest.mark.slow
def test_who_attaches_and_hangs_does_not_hold_a_device_up(tmp_path: Path) -> None:
    observer = HOUSE / "tests/oracles/plain_observer.py"
    with going(tmp_path, "duration=6", "run.deadline=5", "run.window_blocks=20", **BY_PLANT, **plant()) as live:
        command = [sys.executable, str(observer), str(live.run_json), "--dwell"]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL) as attached:
            try:
                assert live.result()["ticks"] == 6000
            finally:
                attached.kill()


@pytest.mark.slow
@pytest.mark.parametrize(("tcp", "guarded"), [(None, False), ("127.0.0.1", False), ("127.0.0.1", True)])
def test_a_plant_in_python_takes_a_seat_that_waits_for_it(tmp_path: Path, tcp: str | None, guarded: bool) -> None:
    if guarded:
        make_keys(tmp_path / "keys")
    transport = Transport.from_options(tcp, tmp_path / "keys" if guarded else None)
    with going(tmp_path, "duration=1", programs=read_programs([], ["plant"]), transport=transport) as live:
        told = live.run_json.with_name("external-plant.json")
        wait_for("the seat", lambda: told.exists() and told.read_text().rstrip().endswith("}"))
        subprocess.run([sys.executable, *map(str, PLAIN), str(told)], check=True, timeout=PATIENCE_S)
        summary = live.result()
    assert summary["ticks"] == 1000
    assert abs(summary["energy"]["residual_J"]) < 1e-9 * summary["energy"]["moved_J"]


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (lambda: BY_PLANT, "own plant does not keep time"),
        (lambda: BY_PLANT | plant() | {"pace": 1.0}, "leave out one of them"),
    ],
)
def test_time_is_left_to_the_plant_only_where_one_can_keep_it(
    tmp_path: Path, options: Callable[[], dict[str, Any]], why: str
) -> None:
    with pytest.raises(OutputError, match=why):
        ran(tmp_path / "out", **options())
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("event", "why"),
    [("pause=true", "pauses; a device does not pause"), ('set={"clock.round_trip_delay"=0.001}', DELAY_STAYS)],
)
def test_a_scene_that_changes_a_devices_time_is_not_run(tmp_path: Path, event: str, why: str) -> None:
    with pytest.raises(OutputError, match=why):
        ran(tmp_path / "out", f"event=[{{at=0.5, {event}}}]", **BY_PLANT, **plant())


@pytest.mark.slow
def test_a_delay_of_no_whole_periods_is_refused_by_a_plant_that_owns_the_time(tmp_path: Path) -> None:
    with pytest.raises(Exception, match="whole control periods"):
        ran(tmp_path / "out", "clock.round_trip_delay=0.0015", **BY_PLANT, **plant())


def test_a_plant_that_owns_the_time_makes_up_for_20_ms_and_what_is_beyond_is_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(HOUSE / "examples")
    schedule = importlib.import_module("schedule")
    now = 100.0
    monkeypatch.setattr(schedule, "time", SimpleNamespace(monotonic=lambda: now))
    subject = schedule.Schedule(0.001, 0.002)
    subject.begin(0)
    now = 100.015
    subject.begin(1)
    assert subject.due(2) == pytest.approx(100.002), "made up for"
    now = 100.051
    subject.begin(1)
    subject.answered(1, True)
    assert subject.due(2) == pytest.approx(100.032)
    told = subject.figures()
    assert told["lost_s"] == pytest.approx(0.03)
    assert told["most_s"] == pytest.approx(0.02)
    assert (told["ticks"], told["late_ticks"], told["late_s"]) == (1, 1, 0.002)
    assert lateness_told({"lateness": told}) == {**told, "clock": PLANT}


@pytest.mark.parametrize("key", sorted(TOLD))
@pytest.mark.parametrize("value", [None, "1", float("nan"), float("inf"), -1, True, [1]])
def test_figures_of_lateness_that_are_none_are_not_shown(key: str, value: Any) -> None:
    assert lateness_told({"lateness": TOLD}) == {**TOLD, "clock": PLANT}
    assert lateness_told({"lateness": TOLD | {key: value}}) == lateness_told({}) == {"clock": PLANT}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("integrator", "most_m", "residual"),
    [("rk4", 1e-8, (1e-9, 1e-7)), ("euler", 3e-5, (1e-5, 2e-4)), ("implicit", 3e-5, (1e-5, 2e-4))],
)
@pytest.mark.parametrize("device", ["slider", "arm"])
def test_the_books_tell_mujocos_integrators_apart(
    tmp_path: Path, integrator: str, device: str, most_m: float, residual: tuple[float, float]
) -> None:
    pytest.importorskip("mujoco")
    options = ("--integrator", integrator, "--device", device)
    summary, log = ran(tmp_path / "foreign", "duration=3", **plant(HOUSE / "examples/mujoco_plant.py", *options))
    _, own = ran(tmp_path / "own", "duration=3", in_process=True)
    assert np.abs(log["/plant"]["x"] - own["/plant"]["x"]).max() < most_m
    low, high = residual
    assert low < summary["energy"]["residual_J"] / summary["energy"]["moved_J"] < high
