"""The JSON messages to a page: the state of the run on show, and the events that changed it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from haploop.logger.summary import finite
from haploop.protocol.changes import KINDS, describe
from haploop.view.receive.run_session import RunSession

# A page lists no more events than these, the newest.
_MOST_EVENTS = 1000
WAITING = {"type": "state", "phase": "waiting", "why": "", "run": None, "options": None, "summary": None, "nodes": []}


def state(session: RunSession, status: dict[str, Any], options: dict[str, Any] | None) -> dict[str, Any]:
    """Returns the state message of a run.

    Args:
        session: the run.
        status: the clock's latest answer to ``status``, {} before the first.
        options: its latest answer to ``options``, None before the first.
    """
    history, time = session.history, session.time
    message = {
        "type": "state",
        "phase": session.outcome or ("paused" if status.get("paused") else "running"),
        "why": session.why,
        "run": session.run.id,
        "title": session.scene["title"],
        "out": str(session.out),
        "tick": history.end_tick if history.stop_tick is None else history.stop_tick,
        "end_tick": time.ticks,
        "control_rate": time.control_rate,
        "plant_rate": time.plant_rate,
        "pace": status.get("pace"),
        "real_time_factor": session.real_time_factor,
        "nodes": [] if session.outcome else status.get("nodes", []),
        "skipped_ticks": session.skipped_ticks,
        "first_s": (history.first_tick or 0) / time.control_rate,
        "options": None if session.outcome else options,
        "elements": list(history.elements),
        "wall": dict(history.wall) if history.inward else None,
        "delay_s": session.delay_s,
        "summary": session.summary,
        **_figures(session),
    }
    return finite(message)


def _figures(session: RunSession) -> dict[str, Any]:
    """Returns verdict and figures, from the summary once there is one, else from the newest status of the logger."""
    if session.summary:
        window, energy = session.summary["window"], session.summary["energy"]
        return {
            "verdict": session.summary["verdict"],
            "verdict_rule": session.summary["verdict_rule"],
            "oscillation_m": window["oscillation_m"],
            "displayed_stiffness_N_m": window["displayed_stiffness_N_m"],
            "residual_J": energy["residual_J"],
            "moved_J": energy["moved_J"],
        }
    names = ("verdict", "verdict_rule", "oscillation_m", "displayed_stiffness_N_m", "residual_J", "moved_J")
    return {name: session.status.get(name) for name in names}


def event_lines(
    events: Iterable[tuple[int, dict[str, Any]]], rate: int, options: dict[str, Any] | None
) -> list[dict[str, Any]]:
    """Returns tick, time in s, kind and text of each event.

    Args:
        events: (tick, event) in order.
        rate: ticks per second, Hz.
        options: what the run lets people choose, for units; None before it is known.
    """
    units = _units(options or {})
    lines = []
    for tick, event in events:
        kind = next((kind for kind in KINDS if kind in event), None)
        if kind:
            lines.append({"tick": tick, "t_s": tick / rate, "kind": kind, "text": describe(event, units)})
    return lines[-_MOST_EVENTS:]


def _units(options: dict[str, Any]) -> dict[str, str]:
    """Returns units by parameter of a kind (``damping.damping``) and by settable key."""
    kinds = options.get("kinds", {})
    units = {f"{kind}.{name}": p["unit"] for kind, about in kinds.items() for name, p in about["parameters"].items()}
    return units | {key: about["unit"] for key, about in options.get("settable", {}).items()}
