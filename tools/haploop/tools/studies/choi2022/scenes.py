"""Scenes of the paper's figures that are runs of the program, and the frequencies at which a run swings."""

from __future__ import annotations

import copy
from functools import cache
from typing import Any

import numpy as np

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.logger.log.recording import MemoryLog, Recording
from haploop.tools.cost.grid import scenes_folder

SPEED_M_S = 0.1
_LAST_S = 0.5


@cache
def _resolved(name: str) -> dict[str, Any]:
    return load(scenes_folder() / name)


def fig6(panel: str) -> dict[str, Any]:
    """Returns the scene of a panel of Fig. 6, "a", "b" or "c", in our interpretation. Not to be changed: copy it."""
    return _resolved(f"fig6{panel}.toml")


def single_contact(title: str, **tables: Any) -> dict[str, Any]:
    """Returns a scene in which the device, hand attached but slack, coasts at 0.1 m/s into 0.15 N/mm and out again.

    It is without encoder and delay unless ``tables``, laid over the scene, say so.
    """
    scene = copy.deepcopy(fig6("b"))
    for table in ("encoder", "noise", "dissipation", "velocity", "acceleration"):
        scene.pop(table, None)
    position = scene["wall"]["position"]
    scene["title"], scene["duration"] = title, 0.1
    scene["clock"] |= {"round_trip_delay": tables.pop("delay_s", 0.0)}
    scene["device"] |= {"position": position + 0.0004, "velocity": -SPEED_M_S, "damping": 0.0}
    scene["hand"] = {**scene["hand"], "stiffness": 0.0, "damping": 0.0}
    scene["hand"].pop("force")
    return scene | tables


def pushed_and_braked(**tables: Any) -> dict[str, Any]:
    """Returns a scene of device and hand in the open, pushed for 24 ms and braked for as long, without any damping."""
    scene = single_contact("Pushed, then braked")
    scene.pop("wall")
    scene["duration"] = 0.06
    scene["device"] |= {"position": 0.0, "velocity": 0.0}
    scene["hand"]["force"] = {
        "kind": "trace",
        "time": [0.0, 0.012, 0.024, 0.036, 0.048],
        "force": [0.0, 0.25, 0.0, -0.25, 0.0],
    }
    return scene | tables


def run(scene: dict[str, Any]) -> tuple[dict[str, Any], Recording]:
    """Runs a resolved scene in this process; returns its summary, and its log by channel."""
    memory = MemoryLog()
    summary = run_in_process(scene, registry(), memory=memory)
    return summary, memory.recording()


def spectrum(log: Any) -> tuple[np.ndarray, np.ndarray]:
    """Returns frequencies in Hz and amplitudes in m of the position in the last half second, its trend taken out."""
    t, x = np.asarray(log["/plant"]["t"]), np.asarray(log["/plant"]["x"])
    last = t >= t[-1] - _LAST_S
    t, x = t[last], x[last]
    x = x - np.polyval(np.polyfit(t - t[0], x, 1), t - t[0])
    window = np.hanning(len(x))
    amplitudes = np.abs(np.fft.rfft(x * window)) / window.sum() * 2.0 * np.sqrt(2.0 / 3.0)
    return np.fft.rfftfreq(len(x), t[1] - t[0]), amplitudes


def strongest_Hz(log: Any) -> float:
    """Returns the frequency of the largest swing."""
    frequencies, amplitudes = spectrum(log)
    return float(frequencies[np.argmax(amplitudes[1:]) + 1])


def faster_m(log: Any, frequency_Hz: float) -> float:
    """Returns the root mean square of what of the position is faster than a frequency."""
    frequencies, amplitudes = spectrum(log)
    return float(np.sqrt((amplitudes[frequencies > frequency_Hz] ** 2).sum() / 2.0))
