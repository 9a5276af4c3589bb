"""Snapshots as the server of the live page sends them, written from the description of the format alone."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Sequence
from typing import Any

Column = tuple[str, str, str, Sequence[float]]


def table(name: str, t0_s: float, dt_s: float, *columns: Column, envelope: bool = False) -> dict[str, Any]:
    """A table of columns (name, unit, label, values)."""
    return {"name": name, "t0_s": t0_s, "dt_s": dt_s, "columns": columns, "envelope": envelope}


def snapshot(from_s: float, to_s: float, *tables: dict[str, Any], **more: Any) -> bytes:
    """Length and header, then each table's columns as little-endian 32-bit floats, padded to a multiple of 8 bytes."""
    rows = [len(t["columns"][0][3]) for t in tables]
    described = [
        {
            **t,
            "rows": count,
            "columns": [{"name": name, "unit": unit, "label": label} for name, unit, label, _ in t["columns"]],
        }
        for t, count in zip(tables, rows, strict=True)
    ]
    header = json.dumps({"from_s": from_s, "to_s": to_s, "tables": described, **more}).encode()
    header += b" " * (-(4 + len(header)) % 8)
    body = b""
    for t, count in zip(tables, rows, strict=True):
        for *_, values in t["columns"]:
            body += struct.pack(f"<{count}f", *values)
        body += bytes(-len(body) % 8)
    return struct.pack("<I", len(header)) + header + body


def contact(from_s: float = 0.0, to_s: float = 2.0, rows: int = 1000, wall_m: float = -0.06) -> bytes:
    """A limit cycle at a wall with one damping element and one virtual inertia, as a real run looks."""
    dt = (to_s - from_s) / (rows - 1)
    t = [from_s + i * dt for i in range(rows)]
    x = [wall_m - 0.002 + 0.0026 * math.sin(70 * s) for s in t]
    v = [0.0026 * 70 * math.cos(70 * s) for s in t]
    spring = [max(0.0, 150 * (wall_m - here)) for here in x]
    brake = [-0.4 * speed * (force > 0) for speed, force in zip(v, spring, strict=True)]
    inertia = [0.01 * 70 * 70 * 0.0026 * math.sin(70 * s + 0.4) * (f > 0) for s, f in zip(t, spring, strict=True)]
    total = [sum(parts) for parts in zip(spring, brake, inertia, strict=True)]
    recent = slice(-200, None)
    depth = [wall_m - here for here in x][recent]
    loop = table("loop", from_s, dt, ("penetration", "m", "penetration", depth), ("force", "N", "force", total[recent]))
    return snapshot(
        from_s,
        to_s,
        table(
            "position", from_s, dt,
            ("x", "m", "position", x),
            ("wall", "m", "wall", [wall_m] * rows),
            ("x_measured", "m", "measured", [round(here / 1e-5) * 1e-5 for here in x]),
        ),
        table(
            "force", from_s, dt,
            ("wall", "N", "wall", spring),
            ("element.0.damping", "N", "element 0: damping", brake),
            ("element.1.unidirectional-inertia", "N", "element 1: unidirectional-inertia", inertia),
            ("total", "N", "total", total),
        ),
        table(
            "energy", from_s, dt,
            ("wall", "J", "wall", [-2e-4 * s for s in t]),
            ("damping", "J", "damping", [1.5e-4 * s for s in t]),
            ("unidirectional-inertia", "J", "unidirectional-inertia", [0.7e-4 * s for s in t]),
            ("residual", "J", "residual", [1e-18] * rows),
        ),
        loop | {"stiffness": 150.0},
        table(
            "momentum", from_s, dt,
            ("v", "m/s", "velocity", v[recent]),
            ("p.1", "kg m/s", "element 1: unidirectional-inertia", [0.01 * speed for speed in v[recent]]),
        ),
    )  # fmt: skip


def positions(x, wall=None):
    """Returns a snapshot of 2 s of position, m, and of a fixed wall."""
    columns = [("x", "m", "position", x)]
    if wall:
        columns.append(("wall", "m", "wall", [wall] * len(x)))
    return snapshot(0.0, 2.0, table("position", 0.0, 2.0 / (len(x) - 1), *columns))
