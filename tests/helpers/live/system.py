"""What the operating system tells of processes, and a full disk for one of them."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

Row = tuple[int, int, str, str]


def processes() -> list[Row]:
    """(pid, parent, state, command line) of every process; with ``-ww`` no line is cut at a terminal's width."""
    listing = subprocess.run(
        ["ps", "-A", "-ww", "-o", "pid=,ppid=,stat=,args="], capture_output=True, text=True, check=True
    )
    rows = (line.split(maxsplit=3) for line in listing.stdout.splitlines())
    return [(int(row[0]), int(row[1]), row[2], row[3]) for row in rows if len(row) == 4]


def alive(pids: Sequence[int]) -> list[int]:
    """Returns those of these processes that still exist; one that only waits to be reaped does not count."""
    return [pid for pid, _, state, _ in processes() if pid in pids and not state.startswith("Z")]


def processes_of(place: Path) -> list[int]:
    """Returns the processes whose environment names this directory for live runs (Linux)."""
    found, mark = [], f"XDG_RUNTIME_DIR={place}\0".encode()
    for path in Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):
            found += [int(path.parent.name)] if mark in path.read_bytes() else []
    return found


def pending(pid: int) -> bool:
    """Tells whether a signal is waiting for the process to get processor time (Linux)."""
    status = Path(f"/proc/{pid}/status")
    lines = status.read_text(encoding="utf-8").splitlines() if status.exists() else []
    return any(int(line.split()[1], 16) for line in lines if line.startswith(("SigPnd", "ShdPnd")))


def where(pid: int) -> str:
    """Returns what each thread of a process waits for, and its pending and ignored signals (Linux)."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines()
    threads = [f"{task.name}: {(task / 'wchan').read_text()}" for task in Path(f"/proc/{pid}/task").iterdir()]
    return "\n".join([*threads, *(line for line in status if line.startswith(("State", "Sig", "Shd")))])


def on_a_disk_of(size_bytes: int, command: list[str]) -> list[str]:
    """The command as on a disk that is full after ``size_bytes``: every write beyond fails, in its children too."""
    limit = "import os, resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)"
    return [sys.executable, "-c", f"{limit}; os.execv(sys.argv[2], sys.argv[2:])", str(size_bytes), *command]
