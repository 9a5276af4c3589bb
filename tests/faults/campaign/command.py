"""``make faults``: seeded faults against real processes; what docs/reliability.md promises is checked each time."""

from __future__ import annotations

import functools
import json
import os
import random
import re
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import redirect_stdout
from pathlib import Path

from faults.campaign.strikes import STRIKES, Played

from haploop.controller.dissipation import registry
from haploop.launch.processes import private_directory, run_directory
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.runs.replay import replay
from haploop.launch.scene.file import load
from haploop.logger import read
from haploop.logger.log.recording import Recording
from helpers.live.launched import SCENE, Run, same_bits
from helpers.live.system import processes_of
from helpers.live.waiting import wait_for

TICKS = 3000
_SETS = (f"duration={TICKS / 1000:g}", "run.verdict=window")
_PLUGIN = """
import os, sys, time
from haploop.controller.dissipation import Element
class Idle(Element):
    kind = "idle"
    def __post_init__(self):
        self.tick = -1
    def force(self, motion):
        self.tick += 1
        if self.tick == {tick}:
            {at_tick}
        return 0.0
"""
_ELEMENTS = 'dissipation=[{kind="unidirectional-inertia", mass=0.01, acts="in-contact"}, {kind="idle", acts="always"}]'
_NO_FORCE = r"Element 1 \(idle\) gave no force at tick \d+: "
_SPOILT = {  # what the plugin does at one tick, and as what the run may then fail
    "plugin prints": ("print('x' * 5000)", "(?!)"),
    "plugin raises": ("1 / 0", f"{_NO_FORCE}ZeroDivisionError"),
    "plugin exits": ("sys.exit(3)", f"{_NO_FORCE}SystemExit"),
    "plugin ends its process": ("os._exit(3)", "The controller (ended|exited|was|has)"),
    "plugin hangs": ("time.sleep(1e6)", f"{_NO_FORCE}DeadlineOver|The controller has not answered"),
}
_FULL = "a disk that is full"
KINDS = (*STRIKES, *_SPOILT, _FULL)


@functools.cache
def _undisturbed() -> tuple[Recording, str]:
    kinds = registry()
    with tempfile.TemporaryDirectory() as out:
        digest = run_in_process(load(SCENE, _SETS, kinds), kinds, out=Path(out))["trajectory_sha256"]
        return read(out), digest


def _check(played: Played) -> None:
    """What is promised of a run that has ended, however it was struck."""
    run = played.run
    wait_for("the end of the run", lambda: not run.is_there())
    with redirect_stdout(None):
        said, status = run.end(run.status), run.status
    wait_for("the end of all processes", lambda: not processes_of(Path(os.environ["XDG_RUNTIME_DIR"])))
    if status == -signal.SIGKILL and "the launcher killed" in played.kinds:
        run_directory.live_runs()  # the next command clears up
    elif status:
        sentences = [line for line in run.stderr.splitlines() if line.endswith(".")]
        told = any(re.search(excuse, line) for excuse in played.excuses for line in sentences)
        assert told, f"status {status} with no excuse"
    left = list(private_directory.base_directory().rglob("*"))
    assert not left, f"left: {left}"
    own = [line for line in run.stderr.splitlines() if not line.startswith("controller, tick ")]  # not the plugin's
    assert "Traceback" not in "".join(own)
    if not (run.out_directory / "log.mcap").exists():
        assert status, "there is no log"
        return
    log = read(run.out_directory)
    rows = len(log["/controller"]["x"]) if "/controller" in log else 0
    changed = any("set" in event or "swap" in event for event in log["/events"]) if "/events" in log else False
    if not changed:
        same_bits(log, _undisturbed()[0])
    if rows and "plugin hangs" not in played.kinds:
        with redirect_stdout(None):  # the plugin prints again
            assert replay(run.out_directory).differences == []
    if status == 0:
        summary, kept = json.loads(said), json.loads((run.out_directory / "summary.json").read_text())
        assert all(kept[key] == summary[key] for key in ("ticks", "ended", "final", "lost", "verdict"))
        assert (rows, log.truncated, summary["lost"]["telemetry_gaps"]) == (summary["ticks"], False, 0)
        assert rows == TICKS or summary["ended"] == "stopped"
        assert changed or rows < TICKS or summary["trajectory_sha256"] == _undisturbed()[1]


def play(seed: int) -> tuple[list[str], str, tuple[float, float] | None]:
    """Returns the kinds of faults that struck the run of a seed, and the promise it broke, "" for none.

    And in s, where a node was killed, how long it took to name it and to end the run.
    """
    dice = random.Random(seed)
    kinds = dice.sample(KINDS, dice.choice((1, 2)))
    options, sets, excuses = list(dice.choice(((), ("--pace", "3")))), list(_SETS), list[str]()
    deadline_s = dice.choice((0.7, 5.0)) if any("stopped" in kind or "hangs" in kind for kind in kinds) else 30.0
    if deadline_s < 2.0:  # on a busy machine anybody may be silent for so long
        excuses.append(f"has not answered for {deadline_s:g} s")
    disk_bytes = dice.randint(10_000, 1_500_000) if _FULL in kinds else None
    with tempfile.TemporaryDirectory(prefix="hl") as folder:
        os.environ["XDG_RUNTIME_DIR"] = folder
        for statement, excuse in (_SPOILT[kind] for kind in kinds[:2] if kind in _SPOILT):
            path = Path(folder, "idle.py")
            path.write_text(_PLUGIN.format(tick=dice.randrange(TICKS), at_tick=statement))
            options += ["--plugin", str(path)]
            sets.append(_ELEMENTS)
            excuses.append(excuse)
        if disk_bytes:
            excuses.append("Writing the log .* failed|The (log|summary|scene|run).* (cannot be made|not be written)")
        run = Run(
            Path(folder, "out"), *options, sets=(*sets, f"run.deadline={deadline_s}"), pace=(), disk_bytes=disk_bytes
        )
        played = Played(run, deadline_s, excuses, [kind for kind in kinds if kind not in STRIKES])

        def strike(kind: str, after_s: float) -> None:
            if kind in STRIKES and (live := played.live()):
                time.sleep(after_s)
                if run.is_there():
                    played.kinds.append(kind)
                    STRIKES[kind](played, random.Random(f"{seed} {kind}"), live)

        try:
            times = [dice.choice((0.0, dice.uniform(0, 1.5))) for _ in kinds]
            with ThreadPoolExecutor() as threads:
                list(threads.map(strike, kinds, times))
            _check(played)
        except Exception as error:
            where = traceback.extract_tb(error.__traceback__)[-1].line
            return played.kinds, f"{where}: {error!r:.600}\n{run.stderr[-600:]}", None
        finally:
            run.nodes |= {str(pid): pid for pid in processes_of(Path(folder))}
            run.clear_away()
        return played.kinds, "", played.took_s


def main(first: int, count: int) -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores Ctrl-C
    seeds, tried, broken = range(first, first + count), Counter[str](), Counter[str]()
    times: list[tuple[float, float]] = []
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for seed, (kinds, why, took_s) in zip(seeds, pool.map(play, seeds), strict=True):
            tried.update(kinds)
            broken.update(kinds if why else ())
            times += [took_s] if took_s else []
            if why:
                print(f"seed {seed} ({', '.join(kinds)}) breaks a promise: {why}", flush=True)
                print(f"again: make faults N=1 FROM={seed}", flush=True)
    print("| fault | tried | broken |\n| --- | ---: | ---: |")
    print("\n".join(f"| {kind} | {tried[kind]} | {broken[kind]} |" for kind in KINDS))
    if times:
        named_s, ended_s = (sorted(column) for column in zip(*times, strict=True))
        for what, column in (("named", named_s), ("and the run ended", ended_s)):
            print(f"{what} {column[len(column) // 2]:.2f} s (median) to {column[-1]:.2f} s after a node was killed")
    sys.exit(bool(broken))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
