"""Memory of every process, which is to stay flat from one to ten simulated minutes; part two of ``make bench``."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

from haploop.launch.runs.start import prepare, run

SCENE = Path(__file__).parents[2] / "launch" / "scenes" / "fig6b.toml"
FIRST_TICK, LAST_TICK = 60_000, 600_000


def resident_MB(pid: int) -> float:
    """Resident memory of a process (Linux)."""
    pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="utf-8").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def processes_of() -> dict[str, int]:
    """Role -> pid of the processes of this launcher's run, itself among them (Linux)."""
    found = {"launcher": os.getpid()}
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        words = path.read_bytes().decode(errors="replace").split("\0")
        parent = path.with_name("stat").read_text(encoding="utf-8").rpartition(")")[2].split()[1]
        if "-m" in words and int(parent) == os.getpid():
            found[words[words.index("-m") + 1].split(".")[1]] = int(path.parent.name)
    return found


def main() -> None:
    """Run ten simulated minutes and print what each process held after one minute, near the end, and the growth."""
    seen: dict[str, dict[str, float]] = {}

    def look(status: dict[str, Any]) -> None:
        tick = status.get("t_s", 0.0) * 1000
        when = "one minute" if tick < FIRST_TICK * 1.5 else "ten minutes"
        if when not in seen and (FIRST_TICK <= tick < FIRST_TICK * 1.5 or tick > 0.95 * LAST_TICK):
            seen[when] = {role: resident_MB(pid) for role, pid in processes_of().items()}

    with tempfile.TemporaryDirectory() as folder:
        run(prepare(SCENE, ["duration=600"], out=Path(folder, "out")), on_progress=look)
    for role, before in seen["one minute"].items():
        after = seen["ten minutes"][role]
        print(f"{role:<12}{before:8.1f} MB after one minute {after:8.1f} MB after ten {after - before:+7.2f} MB")


if __name__ == "__main__":
    main()
