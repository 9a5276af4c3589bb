"""Runs behind the figures, in this process, and the frequencies in their motion."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.bundled import bundled_folder
from haploop.launch.scene.file import load
from haploop.logger.log.recording import MemoryLog, Recording
from haploop.logger.summary import Summary
from haploop.logger.verdict.about_trend import about_trend
from haploop.protocol.scene.scene import Hand, Scene, Wall, by_window

_LAST_S = 0.5


@cache
def shipped(name: str) -> Scene:
    """Returns a scene that comes with haploop, by the name of its file."""
    return load(bundled_folder("scenes") / name)


def fig6(panel: str) -> Scene:
    """Returns the scene of a panel of Fig. 6, "a", "b" or "c", in our interpretation."""
    return shipped(f"fig6{panel}.toml")


def wall_of(scene: Scene) -> Wall:
    """Returns the wall of a scene that is known to have one."""
    assert scene.wall
    return scene.wall


def hand_of(scene: Scene) -> Hand:
    """Returns the hand of a scene that is known to have one."""
    assert scene.hand
    return scene.hand


class Run(NamedTuple):
    """A run in this process: its resolved scene, its summary, and its log by channel."""

    scene: Scene
    summary: Summary
    log: Recording


def run(scene: Scene) -> Run:
    """Runs a scene; its verdict is the cheap one, from the last half second alone."""
    memory = MemoryLog()
    summary = run_in_process(by_window(scene), registry(), memory=memory)
    return Run(scene, summary, memory.recording())


def spectrum(log: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Returns frequencies in Hz and amplitudes in m of the position in the last half second, its trend taken out."""
    t, x = log["/plant"]["t"], log["/plant"]["x"]
    last = t >= t[-1] - _LAST_S
    t, x = t[last], x[last]
    x = about_trend(x)
    window = np.hanning(len(x))
    amplitudes = np.abs(np.fft.rfft(x * window)) / window.sum() * 2.0 * np.sqrt(2.0 / 3.0)
    return np.fft.rfftfreq(len(x), t[1] - t[0]), amplitudes


def strongest_Hz(log: Recording) -> float:
    frequencies, amplitudes = spectrum(log)
    return float(frequencies[np.argmax(amplitudes[1:]) + 1])


def faster_m(log: Recording, frequency_Hz: float) -> float:
    """Returns the root mean square of the part of the position that is faster than a frequency."""
    frequencies, amplitudes = spectrum(log)
    return float(np.sqrt((amplitudes[frequencies > frequency_Hz] ** 2).sum() / 2.0))
