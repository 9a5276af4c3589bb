"""Ingestion of telemetry into a history: blocks without a gap between them are taken at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from haploop.protocol.wire import Frame
from haploop.view.store.history import TRUE, History

# Columns from which positions and forces of the plant are made, and those of the controller that are shown.
_OF_PLANT = ("x", "v", "force", "actuator", "cable.stretch", "cable.rate", "grip.stretch", "grip.rate")
_OF_CONTROLLER = ("x", "v", "wall", "total")
_STATE_BYTES = 8


def ingest(history: History, frames: Sequence[tuple[str, Frame]]) -> dict[str, Any]:
    """Appends the blocks of these messages to a history; returns the newest status of the logger, {} for none."""
    blocks: dict[str, list[dict[str, Any]]] = {}
    status: dict[str, Any] = {}
    ends = [frame.fields[0] for role, frame in frames if (role, frame.name) == ("plant", "END")]
    for role, frame in frames:
        if frame.name == "STATE":
            history.begin(role, frame.fields[0])
            status = _note_state(history, role, frame.fields[1]) or status
        elif frame.name.endswith("_BLOCK"):
            blocks.setdefault(frame.name, []).append(block := frame.as_dict())
            status = block.get("status") or status
    for name, take in _BY_MESSAGE.items():
        for group in _contiguous(blocks.get(name, [])):
            take(history, group)
    for tick in ends:
        history.end(tick)
    return status


def _note_state(history: History, role: str, state: dict[str, Any]) -> dict[str, Any]:
    """Notes elements and wall from a STATE, all there is of a run that stands still; returns the logger's status."""
    if role == "controller" and state["history"]:
        block = state["history"][-1]
        history.set_active(block["elements"], block["wall"])
    return state if role == "logger" else {}


def _contiguous(blocks: list[dict[str, Any]]) -> list[list[dict[str, Any]]]:
    """Groups blocks that follow each other without a gap and have the same columns, elements and wall."""
    runs: list[list[dict[str, Any]]] = []
    for block in blocks:
        if runs and _follows(runs[-1][-1], block):
            runs[-1].append(block)
        else:
            runs.append([block])
    return runs


def _follows(one: dict[str, Any], other: dict[str, Any]) -> bool:
    return (
        other["from_tick"] == one["from_tick"] + one["ticks"]
        and other["columns"].keys() == one["columns"].keys()
        and other.get("elements") == one.get("elements")
        and other.get("wall") == one.get("wall")
    )


def _joined(run: list[dict[str, Any]], names: Iterable[str]) -> dict[str, np.ndarray]:
    return {name: np.frombuffer(b"".join([block["columns"][name] for block in run]), "<f8") for name in names}


def _plant(history: History, run: list[dict[str, Any]]) -> None:
    """Joins blocks of the plant; two neighbours share the state between them, so all but the last leave it out."""
    columns = {}
    for name in _OF_PLANT:
        if name in run[0]["columns"]:
            parts = [block["columns"][name] for block in run]
            parts[:-1] = [part[:-_STATE_BYTES] for part in parts[:-1]]
            columns[name] = np.frombuffer(b"".join(parts), "<f8")
    history.append_plant_block(run[0]["from_tick"], columns)


def _controller(history: History, run: list[dict[str, Any]]) -> None:
    elements = run[0]["elements"]
    names = [*_OF_CONTROLLER, *(f"dissipation.{place}" for place in range(len(elements)))]
    history.append_ticks(run[0]["from_tick"], _joined(run, names), elements, run[0]["wall"])


def _energy(history: History, run: list[dict[str, Any]]) -> None:
    names = [name for name in run[0]["columns"] if name == "residual" or name.endswith(TRUE)]
    history.append_energy(run[0]["from_tick"], _joined(run, names))


_BY_MESSAGE = {"PLANT_BLOCK": _plant, "CONTROLLER_BLOCK": _controller, "ENERGY_BLOCK": _energy}


def elements_as_telemetry(scene: dict[str, Any]) -> list[dict[str, Any]]:
    """Returns kind and parameters of each element of a resolved scene, as CONTROLLER_BLOCK has them."""
    return [
        {"kind": table["kind"], "parameters": {name: value for name, value in table.items() if name != "kind"}}
        for table in scene.get("dissipation", [])
    ]


def wall_as_telemetry(scene: dict[str, Any]) -> dict[str, float]:
    """Returns position in m, stiffness in N/m and direction into the wall, all 0 without one, as CONTROLLER_BLOCK."""
    if "wall" not in scene:
        return {"position": 0.0, "stiffness": 0.0, "into_wall": 0.0}
    wall = scene["wall"]
    into_wall = 1.0 if wall.get("occupies") == "above" else -1.0
    return {"position": wall["position"], "stiffness": wall["stiffness"], "into_wall": into_wall}
