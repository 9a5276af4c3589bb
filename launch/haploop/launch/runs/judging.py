"""Judges a run in a separate process, ``python -m haploop.launch.runs.judging``, in which the code of plugins runs."""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from haploop.controller.dissipation import Element, ElementError, registry
from haploop.launch.stability.finding import Finding
from haploop.launch.stability.judge import judge_scene
from haploop.launch.stability.looks import LOOKS_S
from haploop.protocol.changes import Event
from haploop.protocol.scene.scene import Scene

_DIED = "The process that judged the run ended with status {}."
_HANGS = "The code of its plugins did not return within {:g} s while the run was being judged."
# An exchange may take this many times the silence that a run tolerates in a node: nobody waits for its forces.
_PATIENCE = 4.0


def judge_elsewhere(scene: Scene, plugins: Sequence[Path], events: list[tuple[int, Event]]) -> Finding:
    """Returns the finding of a run with these plugin files and events; undecided if its process dies or hangs."""
    judging = subprocess.Popen(
        [sys.executable, "-m", "haploop.launch.runs.judging"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        process_group=0,
    )
    try:
        answer, _ = judging.communicate(pickle.dumps((scene.as_dict(), list(plugins), events)))
    finally:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(judging.pid, signal.SIGKILL)
    if judging.returncode == -signal.SIGALRM:
        return Finding("undecided", "failed", detail=_HANGS.format(_patience_s(scene)))
    if judging.returncode or not answer:
        return Finding("undecided", "failed", detail=_DIED.format(judging.returncode))
    return pickle.loads(answer)


def _patience_s(scene: Scene) -> float:
    return _PATIENCE * scene.run.deadline


def find(
    scene: Scene,
    kinds: Mapping[str, type[Element]],
    events: list[tuple[int, Event]],
    on_exchange: Callable[[], object] = lambda: None,
) -> Finding:
    """Judges a run in this process, with the code of these kinds; undecided if it fails."""
    try:
        return judge_scene(scene, kinds, events, LOOKS_S, thorough=True, causes=True, on_exchange=on_exchange)
    except (ElementError, ArithmeticError) as error:
        return Finding("undecided", "failed", detail=str(error))


def main() -> None:
    """Reads what is to be judged from stdin, writes the finding to the original stdout; what plugins print is dropped.

    SIGALRM ends the process if an exchange takes too long, whatever the code of a plugin does.
    """
    given, plugins, events = pickle.load(sys.stdin.buffer)
    with os.fdopen(os.dup(1), "wb") as answers:
        nowhere = os.open(os.devnull, os.O_RDWR)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 0)
        kinds = registry(plugins)
        scene = Scene.from_dict(given)  # which may name a hand force of a plugin
        finding = find(scene, kinds, events, lambda: signal.setitimer(signal.ITIMER_REAL, _patience_s(scene)))
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        pickle.dump(finding, answers)


if __name__ == "__main__":
    main()
    os._exit(0)  # a thread that a plugin has left behind would keep the process
