"""The machine, the versions and the sources with which something was measured."""

from __future__ import annotations

import hashlib
import importlib
import os
import platform
import subprocess
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path

_ROOTS = ("protocol", "nodes", "launch", "tools")


def machine() -> str:
    """Returns processor, cores and operating system, for the record."""
    path = Path("/proc/cpuinfo")
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    cpu = next(iter(names), platform.processor())
    return f"{cpu or platform.machine()}, {cores()} cores, {platform.system()}"


def cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def versions() -> dict[str, str]:
    """Returns the versions of haploop, of Python and of the libraries that a run is computed with."""
    from haploop.logger.summary import versions

    return {**versions(), "scipy": version("scipy")}


def commit() -> str:
    """Returns the commit of these sources' checkout, with ``+changes`` if they differ from it; "" outside of one."""
    try:
        _git("ls-files", "--error-unmatch", Path(__file__).name)
        changed = _git("status", "--porcelain", "--untracked-files=no", "--", *(f":/{root}" for root in _ROOTS))
        return _git("rev-parse", "--short=12", "HEAD") + ("+changes" if changed else "")
    except (OSError, subprocess.CalledProcessError):
        return ""


def _git(*words: str) -> str:
    command = ["git", *words]
    return subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=True).stdout.strip()


def source_digest(packages: Iterable[str], files: Iterable[Path] = ()) -> str:
    """Returns a hash of the Python sources of some packages, and of some files.

    Unlike the commit it stays the same when only the documentation changes, and differs when sources are edited.
    """
    digest = hashlib.sha256()
    for package in packages:
        for folder in importlib.import_module(package).__path__:
            for path in sorted(Path(folder).rglob("*.py")):
                digest.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    for path in files:
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]
