"""A history of measured speed, a line of JSON a run, and what has become slower since an earlier one.

What is compared is the ratio to a yardstick that was measured in turn with it, where there is one: a machine is not as
fast at every hour. Only runs on the same processor, under the same Python, are compared.
"""

from __future__ import annotations

import json
import platform
import statistics
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console
from rich.table import Table

from haploop.tools.machine import commit, machine

HISTORY = Path(__file__).parents[2] / "runs" / "bench.jsonl"
# What is slower by so much, and by more than the noise, is marked.
MARKED = 0.10

# Values of every repeat by what was measured.
Seen = Mapping[str, list[float]]


class Change(NamedTuple):
    """What became of one figure: medians then and now, and how far repeats of both let the change be by chance."""

    then: float
    now: float
    noise: float

    @property
    def is_slower(self) -> bool:
        return self.now / self.then - 1.0 >= max(MARKED, self.noise)


def changes(then: Seen, now: Seen, yardsticks: Mapping[str, str]) -> dict[str, Change]:
    """Returns the change of all that both have measured, in units of its yardstick where ``yardsticks`` names one."""
    found = {}
    for name in now:
        of = yardsticks.get(name, "")
        if all(name in seen and (not of or of in seen) for seen in (then, now)):
            before, after = (_in_yardsticks(seen, name, of) for seen in (then, now))
            noise = _spread(before) + _spread(after)
            found[name] = Change(statistics.median(before), statistics.median(after), noise)
    return found


def _in_yardsticks(seen: Seen, name: str, of: str) -> list[float]:
    return [value / unit for value, unit in zip(seen[name], seen[of], strict=True)] if of else list(seen[name])


def _spread(repeats: list[float]) -> float:
    """Half the distance of the quartiles, as a part of the median; 0 for one repeat."""
    if len(repeats) < 2:
        return 0.0
    low, median, high = statistics.quantiles(repeats, n=4, method="inclusive")
    return (high - low) / 2 / median


def keep(script: str, seen: Seen, yardsticks: Mapping[str, str], compare: Path | None) -> None:
    """Adds a run to the history, and compares it with the last like it in the file ``compare``, if one is named."""
    record = {"script": script, "machine": machine(), "python": platform.python_version()}
    earlier = compare.read_text(encoding="utf-8").splitlines() if compare and compare.exists() else []
    at = datetime.now(UTC).isoformat(timespec="seconds")
    HISTORY.parent.mkdir(exist_ok=True)
    with HISTORY.open("a", encoding="utf-8") as file:
        file.write(json.dumps({**record, "at": at, "commit": commit(), "seen": seen}) + "\n")
    alike = [run for run in map(json.loads, earlier) if record.items() <= run.items()]
    if alike:
        _show(alike[-1], seen, yardsticks)
    elif compare:
        print(f"Nothing to compare with: {compare} holds no {script} of this processor and Python.")


def _show(then: Mapping[str, Any], seen: Seen, yardsticks: Mapping[str, str]) -> None:
    table = Table(title=f"against {then['at']}, commit {then['commit']}", title_justify="left")
    for heading in ("what", "in", "then", "now", "now / then", "noise", ""):
        table.add_column(heading, justify="left" if heading in ("what", "in") else "right")
    for name, change in changes(then["seen"], seen, yardsticks).items():
        ratio, noise = f"{change.now / change.then:.2f}", f"{100 * change.noise:.0f} %"
        mark = ("machine" if name in yardsticks.values() else "SLOWER") if change.is_slower else ""
        figures = f"{change.then:.3g}", f"{change.now:.3g}", ratio, noise
        table.add_row(name, yardsticks.get(name, "") or "itself", *figures, mark)
    Console(width=120).print(table)
