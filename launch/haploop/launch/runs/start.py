"""Runs a scene file: reads it, makes its directory, runs it one way or the other, says how it went."""

from __future__ import annotations

from collections.abc import MutableMapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haploop.controller.dissipation import Element, load_plugin, registry
from haploop.launch.scene.events import elements_of, try_out
from haploop.launch.scene.file import load
from haploop.launch.spec import RunFailed, RunSpec, discard, keep_plugin, make_output, write_scene
from haploop.protocol.files import read_text
from haploop.protocol.plugin_file import bring_file
from haploop.protocol.scene.scene import Scene

if TYPE_CHECKING:
    from haploop.launch.processes.early import Started
    from haploop.launch.stability.finding import Finding
    from haploop.logger.summary import Summary
    from haploop.protocol.changes import Event

_NOT_OURS = "By its window alone, since {} not haploop's own and cannot be run again here."
_NOT_REPEATED = "By its window alone, since the run is longer than {:g} s (haploop judge runs it again)."


def prepare(
    scene_path: Path,
    overrides: Sequence[str] = (),
    plugins: Sequence[Path] = (),
    out: Path | None = None,
    *,
    any_hand: bool = False,
) -> RunSpec:
    """Reads and checks everything; writes only if all is well.

    With ``any_hand`` the scene's hand may be unmodelled, which only a foreign plant can move.
    Plugins are tried in processes of their own; ``kinds`` in the result holds stand-ins for their elements, and only a
    file that brings more than elements is also run in this process.

    Raises:
        SceneError: the scene has mistakes.
        PluginError: a plugin does not load.
        ElementError: an element's own code does not take the parameters it is given.
        OutputError: the directory cannot be used.
    """
    scene, kinds, sources = load_tried(scene_path, overrides, plugins, any_hand)
    is_new = out is None or not out.exists()
    return lay_out(scene, kinds, make_output(out, scene_path), plugins, sources, is_new)


def load_tried(
    scene_path: Path, overrides: Sequence[str], plugins: Sequence[Path], any_hand: bool
) -> tuple[Scene, dict[str, type[Element]], dict[str, Path]]:
    """Returns what ``prepare`` reads: the scene, every kind by name, and the file of each that has one, all tried.

    Raises SceneError, PluginError or ElementError as ``prepare`` does.
    """
    if plugins:
        return _with_plugins(scene_path, overrides, plugins, any_hand)
    kinds = registry()
    scene = load(scene_path, overrides, kinds, any_hand=any_hand)
    try_out(elements_of(scene), kinds)
    return scene, kinds, {}


def _with_plugins(
    scene_path: Path, overrides: Sequence[str], plugins: Sequence[Path], any_hand: bool
) -> tuple[Scene, dict[str, type[Element]], dict[str, Path]]:
    """Returns the scene, every kind by name and the file of each that has one, all of them tried."""
    from haploop.launch.clock.plugin_trial import PluginTrial, read_source

    kinds, sources = registry(), {}
    with ExitStack() as open_trials:
        trials = {path: open_trials.enter_context(PluginTrial(read_source(path), str(path))) for path in plugins}
        for plugin, trial in trials.items():
            for kind, element in trial.wait(trial.load()).items():
                kinds[kind], sources[kind] = element, plugin
            if trial.brings:  # for what else it brings, the checks ask the class itself
                bring_file(plugin)
        scene = load(scene_path, overrides, kinds, any_hand=any_hand)
        elements = elements_of(scene)
        try_out([element for element in elements if element.name not in sources], kinds)
        for plugin, trial in trials.items():
            trial.wait(trial.make([element for element in elements if sources.get(element.name) == plugin]))
    return scene, kinds, sources


def _with_code(spec: RunSpec) -> dict[str, type[Element]]:
    """Returns the kinds with the elements that the run's plugin files define; this process then runs the files.

    Raises PluginError if one does not load.
    """
    loaded = {kind: element for file in spec.plugins for kind, element in load_plugin(file).items()}
    return spec.kinds | {kind: element for kind, element in loaded.items() if kind in spec.plugin_files}


def lay_out(
    scene: Scene,
    kinds: dict[str, type[Element]],
    directory: Path,
    plugins: Sequence[Path] = (),
    sources: dict[str, Path] | None = None,
    is_new: bool = False,
) -> RunSpec:
    """Puts a resolved scene and its plugin files into the directory of its run.

    Raises OutputError if that fails; then nothing is left in the directory, nor the directory itself if it ``is_new``.
    """
    try:
        attachments = {"scene.toml": write_scene(scene, directory)}
        kept = [keep_plugin(plugin, directory) for plugin in plugins]
        attachments |= {f"plugins/{path.name}": read_text(path) for path in kept}
    except BaseException:
        discard(directory, is_new)
        raise
    sources = sources or {}
    copies = dict(zip(plugins, kept, strict=True))
    files = {kind: copies[source] for kind, source in sources.items()}
    return RunSpec(scene, kinds, directory, attachments, kept, sources, files, is_new=is_new)


def run(
    spec: RunSpec, *, in_process: bool = False, early: MutableMapping[str, Started] | None = None, **options: Any
) -> Summary:
    """Runs a scene and returns its summary.

    The first SIGINT or SIGTERM ends the run in order, with a summary of what ran; the second at once.

    Args:
        spec: the run, as prepared.
        in_process: everything in this process; otherwise plant, controller and logger in one process each.
        early: such processes that have already been started, by role; those used are removed.
        options: fields of ``RunSpec`` that replace those of ``spec``.

    Raises:
        NeverBegan: a program that somebody else was to start did not join.
        RunFailed: a process was killed, hung or could not go on, or an element raised.
        OutputError: the run's sockets cannot be made, or its plant cannot own the time.
        LogError: the log could not be written (in one process).
        KeyboardInterrupt: the second signal came.
    """
    spec = replace(spec, **options)
    if not in_process:
        try:
            from haploop.launch.clock.device_time import check_owner
            from haploop.launch.processes.children import start_children
            from haploop.launch.processes.supervisor import run_processes

            check_owner(spec)
            made = run_processes(spec, start_nodes=partial(start_children, early=early))
        except RunFailed:
            raise
        except BaseException:
            discard(spec.out, spec.is_new)  # if it never began
            raise
        return _judged(spec, *made)
    from haploop.launch.processes.children import heeded, interrupts
    from haploop.launch.runs.in_process import run_in_process

    with interrupts(usual_from=2, patience_s=spec.scene.run.deadline) as received:

        def stop() -> bool:
            if received:
                heeded()
            return bool(received)

        return run_in_process(
            spec.scene,
            _with_code(spec),
            out=spec.out,
            attachments=spec.attachments,
            on_progress=spec.on_progress,
            stop=stop,
            causes=True,
        )


def _named(spec: RunSpec) -> str:
    roles = list(spec.programs)
    return f"the {roles[0]} was" if len(roles) == 1 else f"{' and '.join(sorted(roles, reverse=True))} were"


def _judged(spec: RunSpec, summary: Summary, events: list[tuple[int, Event]]) -> Summary:
    """Returns the summary of a run of processes with the verdict it asks for, from repeating the run without books.

    A run of foreign programs, or longer than ``REPEATED_S``, keeps the verdict of its window.
    """
    if spec.scene.run.verdict == "window":
        return summary
    from haploop.logger.summary import REPEATED_S, write_summary

    if spec.programs or summary["duration_s"] > REPEATED_S:
        why = _NOT_OURS.format(_named(spec)) if spec.programs else _NOT_REPEATED.format(REPEATED_S)
        summary["verdict_rule"] = f"{why} {summary['verdict_rule']}"
        write_summary(summary, spec.out)
        return summary
    from haploop.launch.runs.judging import find, judge_elsewhere
    from haploop.launch.stability.judge import with_verdict

    def judged() -> Finding:
        spec.on_judging()
        if spec.plugins:
            return judge_elsewhere(spec.scene, spec.plugins, events)
        return find(spec.scene, spec.kinds, events)

    return with_verdict(spec.scene, summary, judged, spec.out)
