"""Damaged files of real runs given to every command that reads them.

The claim: exit 0 with the numbers of the undamaged file, or with fewer ticks and a message about it; or another exit
status and a sentence. Never a traceback, a wrong number, a hang, or a write to the files that are read.

``PYTHONPATH=tests python -m helpers.data.damaged_run FIRST END`` tries some seeds and reports each that breaks it.
"""

from __future__ import annotations

import hashlib
import json
import random
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import haploop.logger.log.writer
from helpers.data.damage import damage
from helpers.live.in_process import ask

SCENE = Path(__file__).parents[3] / "launch" / "scenes" / "swap.toml"
_SHORT = ("duration=0.4", "event.0.at=0.2", "encoder.resolution=1e-5", "run.verdict=window")
# Keys of a summary that differ from run to run.
_OF_THE_MACHINE = ("wall_s", "real_time_factor", "versions", "figure")
# Words that say that less was read than there may have been.
_SAID = ("cut off", "damaged")

COMMANDS: dict[str, Callable[[Path, Path], list[str]]] = {
    "check": lambda run, out: ["check", f"{run}/scene.toml", "--json"],
    "explain": lambda run, out: ["explain", f"{run}/scene.toml", "--json"],
    "replay": lambda run, out: ["replay", f"{run}", "--json"],
    "judge": lambda run, out: ["judge", f"{run}", "--json"],
    "dissipate": lambda run, out: ["dissipate", f"{run}", "--damping", "0.5", "--json", "--out", f"{out}/d.png"],
    "plot": lambda run, out: ["plot", f"{run}"],
} | {
    to: lambda run, out, to=to: ["export", f"{run}", "--to", to, "--out", f"{out}/{to}"]
    for to in ("csv", "npz", "parquet", "json-mcap")
}  # fmt: skip


class DamagedRuns:
    """A short run with a swap in it and a log of many chunks, and what every command says about it undamaged."""

    def __init__(self, directory: Path) -> None:
        self._run, self._at = directory / "undamaged", directory / "tried"
        sets = [word for one in _SHORT for word in ("--set", one)]
        before, haploop.logger.log.writer._CHUNK_BYTES = haploop.logger.log.writer._CHUNK_BYTES, 20_000
        try:
            answer = ask("run", str(SCENE), *sets, "--in-process", "--out", str(self._run))
        finally:
            haploop.logger.log.writer._CHUNK_BYTES = before
        assert not answer.status, answer
        self._told: dict[str, Any] = {}

    def _ask(self, name: str) -> tuple[Any, Any]:
        """The answer to a command about a copy of the run, damaged or not, and its results, to be compared."""
        out = self._at / "out"
        out.mkdir(parents=True, exist_ok=True)
        run = self._at / "run"
        if not run.exists():
            shutil.copytree(self._run, run)
        answer = ask(*COMMANDS[name](run, out))
        given: Any = None
        if not answer.status and not answer.fault:
            if name == "csv":
                given = {
                    file.name: file.read_text().splitlines()
                    for file in sorted((out / "csv").iterdir())
                    if file.name != "events.csv"  # whose cells hold commas
                }
            elif "--json" in COMMANDS[name](run, out):
                given = {key: value for key, value in json.loads(answer.stdout).items() if key not in _OF_THE_MACHINE}
        shutil.rmtree(out)
        return answer, given

    def attempt(self, seed: int, names: tuple[str, ...] = tuple(COMMANDS)) -> tuple[str, str]:
        """Damages a file of a copy and asks one command; returns what was done, and what broke ("" for nothing)."""
        rng = random.Random(seed)
        name = rng.choice(names)
        shutil.rmtree(self._at, ignore_errors=True)
        if name not in self._told:
            self._told[name] = self._ask(name)[1]
            shutil.rmtree(self._at)
        shutil.copytree(self._run, self._at / "run")
        file = self._at / "run" / rng.choice(["log.mcap"] * 3 + ["scene.toml", "summary.json"])
        if file.name == "log.mcap" and rng.random() < 0.3:  # as of a killed run
            content = file.read_bytes()
            file.write_bytes(content[: rng.randrange(9, len(content))])
        how = damage(rng, file)
        before = _digests(self._at / "run")
        answer, given = self._ask(name)
        fault = answer.broken()
        if not fault and not answer.status:
            said = any(word in answer.stdout + answer.stderr for word in _SAID)
            fault = self._unlike(name, given, said, is_scene=file.name == "scene.toml")
        if not fault and _digests(self._at / "run") != before:
            fault = "it wrote to the run"
        return f"{name} with {file.name}: {how}", fault

    def _unlike(self, name: str, given: Any, said: bool, is_scene: bool) -> str:
        """What is wrong with an answer, compared with that for the undamaged run.

        A scene alone has no checksum: if it is changed, it is another scene.
        """
        whole = self._told[name]
        if given == whole or (is_scene and name in ("check", "explain")):
            return ""
        if name == "csv":
            for file, lines in given.items():
                found, known = _columns(lines), _columns(whole.get(file, [""]))
                for column, cells in found.items():
                    if cells and cells != known.get(column, [])[: len(cells)]:
                        return f"other numbers in {column} of {file}"
        return "" if said else f"{name} gives something else, without a word"


def _columns(lines: list[str]) -> dict[str, list[str]]:
    names, *rows = [line.split(",") for line in lines]
    return {name: [row[number] for row in rows] for number, name in enumerate(names)}


def _digests(directory: Path) -> dict[str, str]:
    """Digests of the files of a run; not of its figure, which is drawn into its directory."""
    files = (path for path in directory.rglob("*") if path.is_file() and path.name != "figure.png")
    return {path.name: "" if path.is_symlink() else hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def main(first: int, end: int) -> None:
    tried, broken = Counter[str](), Counter[str]()
    with tempfile.TemporaryDirectory() as directory:
        runs = DamagedRuns(Path(directory))
        for seed in range(first, end):
            what, fault = runs.attempt(seed)
            tried[what.split(": ")[1]] += 1
            if fault:
                broken[fault.strip().splitlines()[-1]] += 1
                print(f"seed {seed}, {what}:\n{fault}", flush=True)
    print(f"{tried.total()} tried of {len(tried)} kinds, {broken.total()} broken: {dict(broken)}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
