"""The one description of a run: the scene, where it is written to, and how it is carried out; and its failure."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haploop.protocol.scene.scene import Scene
from haploop.protocol.transport import Transport

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element


class RunFailed(Exception):
    """A run that could not go on; the message names the node and the last common tick."""


@dataclass(frozen=True)
class RunSpec:
    """A scene ready to run: checked, with its directory made; ``dataclasses.replace`` gives one with other options.

    Attributes:
        scene: the resolved scene.
        kinds: element kinds by name; a plugin reloaded in mid-run adds its kinds.
        out: the run's directory, made.
        attachments: text files for the log, by name.
        plugins: plugin files within ``out`` that the controller loads.
        plugin_sources: kind -> the user's file it came from, for reloading.
        pace: simulated seconds per wall second; infinite for as fast as possible. For processes only.
        transport: addresses and keys of the sockets. For processes only.
        on_progress: called now and then with the logger's status.
        on_started: called once with the run's id, and the clock's address where that is one of TCP. For processes
            only.
        start_gate: given the pids of all nodes that are ready, returns whether the first tick may be worked on. It is
            asked again until it says so; for a process that is to be there from the start. For processes only.
    """

    scene: Scene
    kinds: dict[str, type[Element]]
    out: Path
    attachments: dict[str, str] = field(default_factory=dict)
    plugins: list[Path] = field(default_factory=list)
    plugin_sources: dict[str, Path] = field(default_factory=dict)
    pace: float = math.inf
    transport: Transport = field(default_factory=Transport)
    on_progress: Callable[[dict[str, Any]], None] = lambda status: None
    on_started: Callable[[str], None] = lambda run_id: None
    start_gate: Callable[[set[int]], bool] = lambda ready: True
