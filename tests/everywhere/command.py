"""``make everywhere``: bits of all shipped scenes and the tests, in every variant of machine and installation there is.

A variant that cannot be had is told, and is no failure; one that comes to other bits, or fails a test, is.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from everywhere.variants import CHOSEN, ROOT, Variant, of_installations, of_the_machine, python_of
from rich.console import Console
from rich.table import Table

_LIMIT_S = 3600.0


def bits_of(variant: Variant, python: Path, scenes: Sequence[str] = ()) -> dict[str, str]:
    """Returns the digests of shipped scenes in a variant; RuntimeError with its last words where it fails."""
    done = _run(variant, [str(python), "-m", "everywhere.bits", *scenes])
    if done.returncode:
        raise RuntimeError((done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1])
    return json.loads(done.stdout)


def tested(variant: Variant, python: Path, tests: Sequence[str]) -> tuple[bool, str]:
    """Returns whether the tests pass in a variant, and what pytest says in its last line."""
    options = ["-q", "-n", "auto", "--dist", "worksteal", "-p", "no:cacheprovider", "-m"]
    command = [str(python), "-m", "pytest", *options, "not slow", *tests]
    done = _run(variant, command)
    failed = re.findall(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
    last = (done.stdout.strip().splitlines() or [""])[-1].strip("= ")
    return done.returncode == 0, "\n".join([re.sub(r" in [\d.]+s.*", "", last), *failed[:5]])


def _run(variant: Variant, command: list[str]) -> subprocess.CompletedProcess[str]:
    inherited = {name: value for name, value in os.environ.items() if name not in CHOSEN}
    environment = {**inherited, **variant.environment, "PYTHONPATH": str(ROOT / "tests")}
    return subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False, timeout=_LIMIT_S
    )


def main() -> int:
    """Goes through the variants; returns the exit status."""
    parser = argparse.ArgumentParser(prog="make everywhere", description=__doc__)
    parser.add_argument("--only", default="", help="variants whose names have this in them")
    parser.add_argument("--no-tests", action="store_true", help="compare bits alone")
    parser.add_argument("tests", nargs="*", help="tests to run instead of those of each variant")
    options = parser.parse_args()
    folder = ROOT / "runs" / "everywhere"
    folder.mkdir(parents=True, exist_ok=True)
    first, expected = Variant("default"), {}
    table = Table("variant", "bits as by default", "tests", box=None, pad_edge=False)
    results: dict[str, dict[str, str]] = {}
    good = True
    expected = bits_of(first, Path(sys.executable))
    for variant in (each for each in (*of_the_machine(), *of_installations()) if options.only in each.name):
        print(f"{variant.name} ...", file=sys.stderr, flush=True)
        words = "–"
        try:
            python = python_of(variant, folder)
            if isinstance(python, str):
                results[variant.name] = {"bits": python, "tests": words}
                continue
            found = bits_of(variant, python)
            same = sum(found.get(name) == digest for name, digest in expected.items())
            bits, passed = f"{same} of {len(expected)}", same == len(expected)
            if not options.no_tests:
                is_passed, words = tested(variant, python, options.tests or variant.tests)
                passed &= is_passed
        except (RuntimeError, ValueError, subprocess.TimeoutExpired) as error:
            bits, passed = f"failed: {error}", False
        good &= passed
        results[variant.name] = {"bits": bits, "tests": words}
        (folder / "results.json").write_text(json.dumps(results, indent=1), encoding="utf-8")
    for name, row in results.items():
        table.add_row(name, row["bits"], row["tests"])
    Console().print(table)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
