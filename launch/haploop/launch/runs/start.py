"""Running a scene file: read it, make its directory, run it one way or the other, say how it went."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from haploop.controller.dissipation import Element, load_plugin, registry
from haploop.launch.output import keep_plugin, make_output, write_scene
from haploop.launch.scene.elements import elements_of, try_out
from haploop.launch.scene.file import load
from haploop.protocol.transport import Transport


@dataclass
class Prepared:
    """A scene ready to run: resolved, with its kinds, its directory and what goes into the log."""

    scene: dict[str, Any]
    kinds: dict[str, type[Element]]
    out: Path
    attachments: dict[str, str]
    plugins: list[Path]
    plugin_sources: dict[str, Path]


def prepare(
    scene_path: Path, overrides: Sequence[str] = (), plugins: Sequence[Path] = (), out: Path | None = None
) -> Prepared:
    """Read and check everything; only when all is well is anything written.

    Raises:
        SceneError: the scene has mistakes.
        PluginError: a plugin does not load.
        ElementError: an element's own code does not take the parameters it is given.
        OutputError: the directory cannot be used.
    """
    kinds = registry()
    sources: dict[str, Path] = {}
    for plugin in plugins:
        for kind, element in load_plugin(plugin).items():
            kinds[kind], sources[kind] = element, plugin
    scene = load(scene_path, overrides, kinds)
    try_out(elements_of(scene), kinds)
    return lay_out(scene, kinds, make_output(out, scene_path), plugins, sources)


def lay_out(
    scene: dict[str, Any],
    kinds: dict[str, type[Element]],
    directory: Path,
    plugins: Sequence[Path] = (),
    sources: dict[str, Path] | None = None,
) -> Prepared:
    """Put a resolved scene and its plugin files into the directory of its run.

    Raises:
        OutputError: a file cannot be written.
    """
    attachments = {"scene.toml": write_scene(scene, directory)}
    kept = [keep_plugin(plugin, directory) for plugin in plugins]
    attachments |= {f"plugins/{path.name}": path.read_text(encoding="utf-8") for path in kept}
    return Prepared(scene, kinds, directory, attachments, kept, sources or {})


def run(
    prepared: Prepared,
    *,
    in_process: bool = False,
    pace: float = math.inf,
    transport: Transport | None = None,
    progress: Callable[[dict[str, Any]], None] = lambda status: None,
    announced: Callable[[str], None] = lambda run_id: None,
    held: Callable[[set[int]], bool] = lambda ready: False,
) -> dict[str, Any]:
    """Run a prepared scene and return its summary.

    The first SIGINT or SIGTERM ends the run in order, with a summary of what ran; the second at once.

    Raises:
        RunFailed: a process was killed, hung or could not go on, or an element raised.
        LogError: the log could not be written (in one process).
        KeyboardInterrupt: the second signal came.
    """
    p = prepared
    if in_process:
        from haploop.launch.processes.interrupts import interrupts
        from haploop.launch.runs.in_process import run_in_process

        with interrupts(usual_from=2) as received:
            return run_in_process(
                p.scene,
                p.kinds,
                out=p.out,
                attachments=p.attachments,
                progress=progress,
                stop=lambda: bool(received),
            )
    from haploop.launch.processes.supervisor import RunRequest, run_processes

    request = RunRequest(
        p.scene,
        p.kinds,
        p.out,
        p.attachments,
        p.plugins,
        p.plugin_sources,
        pace,
        transport or Transport(),
        progress,
        announced,
        held,
    )
    return run_processes(request)
