"""What a page is told beside the pictures: where the run is, how it looks, who waits for whom, what can be changed."""

from __future__ import annotations

from typing import Any

from haploop.logger.summary import finite
from haploop.view.receive.run_session import Followed

WAITING = {"type": "state", "phase": "waiting", "why": "", "run": None, "options": None, "summary": None, "nodes": []}


def state(followed: Followed, status: dict[str, Any], options: dict[str, Any] | None) -> dict[str, Any]:
    """The state message of a run.

    Args:
        followed: the run.
        status: the clock's latest answer to ``status``, {} before the first.
        options: its latest answer to ``options``, None before the first.
    """
    history, time = followed.history, followed.time
    message = {
        "type": "state",
        "phase": followed.over or ("paused" if status.get("paused") else "running"),
        "why": followed.why,
        "run": followed.run.id,
        "title": followed.scene["title"],
        "out": str(followed.out),
        "tick": history.end_tick if history.over_tick is None else history.over_tick,
        "end_tick": time.ticks,
        "control_rate": time.control_rate,
        "plant_rate": time.plant_rate,
        "pace": status.get("pace"),
        "real_time_factor": followed.real_time_factor,
        "nodes": [] if followed.over else status.get("nodes", []),
        "skipped_ticks": followed.skipped_ticks,
        "first_s": (history.first_tick or 0) / time.control_rate,
        "options": None if followed.over else options,
        "elements": list(history.elements),
        "wall": dict(history.wall) if history.into_wall else None,
        "delay_s": followed.delay_s,
        "summary": followed.summary,
        **_looks(followed),
    }
    return finite(message)


def _looks(followed: Followed) -> dict[str, Any]:
    """Verdict and figures: of the summary once there is one, else as the logger sees them now."""
    if followed.summary:
        window, energy = followed.summary["window"], followed.summary["energy"]
        return {
            "verdict": followed.summary["verdict"],
            "verdict_rule": followed.summary["verdict_rule"],
            "oscillation_m": window["oscillation_m"],
            "displayed_stiffness_N_m": window["displayed_stiffness_N_m"],
            "residual_J": energy["residual_J"],
            "moved_J": energy["moved_J"],
        }
    names = ("verdict", "verdict_rule", "oscillation_m", "displayed_stiffness_N_m", "residual_J", "moved_J")
    return {name: followed.status.get(name) for name in names}
