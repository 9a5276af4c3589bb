"""The messages to a page: snapshots packed into bytes, the state of the run and the events that changed it as JSON."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple, TypedDict

import numpy as np

from haploop.logger.cause import SWINGS, cause_in_short, likely_cause
from haploop.logger.summary import finite
from haploop.protocol.changes import KINDS, Event, describe, happened_at
from haploop.protocol.scene.hand_force import constant_from_s
from haploop.protocol.scene.scene import Scene, hand_is_unmodelled
from haploop.protocol.transport.wire import Message
from haploop.view.receive.run_session import RunSession

# A page lists at most this many events, the newest.
_MOST_EVENTS = 1000
WAITING = {"type": "state", "phase": "waiting", "why": "", "run": None, "options": None, "summary": None, "nodes": []}
# What the page says where a run has ended without a verdict.
_NO_VERDICT = {
    "awaited": "It is run again, held still and pushed at its end, for its verdict. That "
    "takes a few seconds, longer for a device with a cable, a grip or friction.",
    "abandoned": "Its launcher has ended without judging it: haploop judge can do that.",
    "unjudged": "It was too long to be judged automatically: haploop judge can do that.",
    "foreign": "Parts of it were foreign, so nothing can hold it still and push it: this is what was seen.",
    "unknown": "Its summary cannot be read from here, so its verdict is not known.",
}
# Entries of the summary, of its window and of its energy; the logger's status has them side by side.
_JUDGED = (
    ("verdict", "verdict_rule"),
    ("oscillation_m", "displayed_stiffness_N_m"),
    ("residual_J", "moved_J", "balance"),
)


# Kept, since json.dumps makes a new one for every header.
_COMPACT = json.JSONEncoder(separators=(",", ":"), allow_nan=False)


class Column(NamedTuple):
    """The header entry of a column: its short name, its SI unit and its label in the legend."""

    name: str
    unit: str
    label: str


@dataclasses.dataclass(frozen=True)
class Table:
    """One table of a snapshot: columns of equal length at equal steps of time.

    Attributes:
        t0_s, dt_s: row i is at ``t0_s + i dt_s``, s.
        values: shape (columns, rows).
        envelope: whether each pair of rows holds the extremes of one interval of time, instead of samples.
        last: the newest values of the columns, all of one tick; empty where they are not known.
        more: further numbers of the header.
    """

    name: str
    t0_s: float
    dt_s: float
    columns: Sequence[Column]
    values: np.ndarray
    envelope: bool = False
    last: Sequence[float] = ()
    more: dict[str, Any] = dataclasses.field(default_factory=dict)


@lru_cache(maxsize=64)
def _named(columns: tuple[Column, ...]) -> str:
    """Returns the entries of columns as JSON, encoded once: they are most of a header, and seldom change."""
    return _COMPACT.encode([column._asdict() for column in columns])


def _entry(table: Table) -> str:
    """Returns the entry of a table in the header, as JSON."""
    numbers = {
        "name": table.name,
        "t0_s": table.t0_s,
        "dt_s": table.dt_s,
        "rows": table.values.shape[1],
        "envelope": table.envelope,
        "last": finite(table.last),
        **finite(table.more),
    }
    return f'{{"columns":{_named(tuple(table.columns))},{_COMPACT.encode(numbers)[1:]}'


def encode(from_s: float, to_s: float, tables: Sequence[Table], **more: Any) -> bytes:
    """Returns the snapshot of an interval of time as bytes.

    uint32 length of the header | header in JSON, padded with spaces | of each table its columns one by one as 32-bit
    floats, padded with zeros; all little-endian. Header and tables each begin at a multiple of 8 bytes, so that a
    browser reads the columns in place. ``more`` are further entries of the header.
    """
    entries = ",".join(_entry(table) for table in tables)
    numbers = {"from_s": from_s, "to_s": to_s, **finite(more)}
    head = f'{{"tables":[{entries}],{_COMPACT.encode(numbers)[1:]}'.encode()
    head += b" " * (-(4 + len(head)) % 8)
    parts = [len(head).to_bytes(4, "little"), head]
    with np.errstate(over="ignore", invalid="ignore"):  # beyond a float32: infinite, as on the screen
        for table in tables:
            data = table.values.astype("<f4").tobytes()
            parts += [data, bytes(-len(data) % 8)]
    return b"".join(parts)


def state(session: RunSession) -> Message:
    history, time, summary, status = session.history, session.time, session.summary, session.clock.status
    elements, wall = history.at_work
    session.changes.note(history, session.events)
    sight = session.changes.sight(history)
    swung = summary if summary and summary["verdict"] in SWINGS else None
    why = session.why or _NO_VERDICT.get(session.verdict_is, "")
    message: Message = {
        "type": "state",
        "phase": session.outcome or ("paused" if status.get("paused") else "running"),
        "why": why or (cause_in_short(swung) if swung else ""),
        "verdict_is": session.verdict_is,
        "run": session.run.id,
        "title": session.scene.title,
        "out": str(session.out),
        "tick": session.end_tick,
        "end_tick": time.ticks,
        "control_rate": time.control_rate,
        "plant_rate": time.plant_rate,
        "pace": status.get("pace"),
        "real_time_factor": session.real_time_factor,
        "was_paused": any("pause" in event for _, event in session.events),
        "lateness": (summary or status).get("lateness") or None,
        "nodes": [] if session.outcome else status.get("nodes", []),
        "skipped_ticks": session.skipped_ticks,
        "first_s": (history.first_tick or 0) / time.control_rate,
        "elements": [{"kind": one.name, "parameters": {**one.parameters, "acts": one.acts}} for one in elements],
        "own": bool(history.own),
        "wall": wall
        and {
            "position": wall.position,
            "stiffness": wall.stiffness,
            "into_wall": history.at_work.into_wall,
            **({"kind": wall.kind} if wall.kind else {}),
        },
        "delay_s": session.delay_s,
        "limit_N_m": None if isinstance(session.clock.limit, str) else session.clock.limit,
        "no_limit": session.clock.limit if isinstance(session.clock.limit, str) else "",
        "summary": summary,
        "cause": likely_cause(swung) if swung else "",
        "sight": sight and dataclasses.asdict(sight),
        "hand_moves": sight is not None and _hand_moves(session.scene, sight.from_s),
    }
    # Verdict and figures are those of the summary once there is one, else of the newest status of the logger.
    judged = (summary, summary["window"], summary["energy"]) if summary else (session.status,) * 3
    for entry, names in zip(judged, _JUDGED, strict=True):
        message |= {name: entry.get(name) for name in names}
    if sight and sight.stiffness_N_m is None:
        message["displayed_stiffness_N_m"] = None
    # Options are by far the largest part, and have been fit for JSON since they came.
    return {**finite(message), "options": None if session.outcome else session.clock.options}


def _hand_moves(scene: Scene, from_s: float) -> bool:
    """Tells whether the hand's own force may change after a time in s, so that what moves then may be its motion."""
    force = scene.hand.force if scene.hand else None
    return hand_is_unmodelled(scene) or from_s < constant_from_s(force)


class EventLine(TypedDict):
    """A line of the page's list of events: its tick and time in s, which kind of event it is, and what it says."""

    tick: int
    t_s: float
    kind: str
    text: str


def event_lines(events: Iterable[tuple[int, Event]], rate: int, units: Mapping[str, str]) -> list[EventLine]:
    """Returns the newest of these events as lines; ``units`` as in :func:`haploop.protocol.changes.describe`."""
    lines: list[EventLine] = []
    for on_record, event in events:
        if kind := next((kind for kind in KINDS if kind in event), None):
            tick = happened_at(on_record, event)
            lines.append({"tick": tick, "t_s": tick / rate, "kind": kind, "text": describe(event, units)})
    return lines[-_MOST_EVENTS:]
