"""Wall, estimators and hand force of a plugin file, tried before anything depends on them."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from haploop.controller.estimators.base import Estimator
from haploop.controller.estimators.choose import make_estimators
from haploop.protocol.brought import is_of_file
from haploop.protocol.plugin_file import PluginError, raised_in_file
from haploop.protocol.scene.hand_force import HandForce
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.walls.registry import make_wall
from haploop.protocol.walls.wall import Wall

# Each may take this long, where it can be interrupted: in the main thread.
_LIMIT_S = 2.0
_DEPTHS_M, _TIMES_S = (0.0, 1e-4), (0.0, 0.5, 3.0)


def try_kinds(scene: Scene) -> None:
    """Makes everything that a scene names from a plugin file give a number at rest, as elements do when they are tried.

    Raises:
        PluginError: one raised, or gave no finite number; the message has the file and the line.
    """
    if scene.wall and is_of_file(Wall.group, scene.wall.kind):
        what = f"The wall {scene.wall.kind}"
        wall = _tried(what, "be made", lambda: make_wall(scene.wall))
        for depth in (*_DEPTHS_M, np.array(_DEPTHS_M)):  # as in the controller, and as in the books
            of = f"at {'an array of depths' if isinstance(depth, np.ndarray) else f'a depth of {depth:g} m'}"
            _tried(what, f"push {of}", lambda depth=depth: wall.push(depth, 0.0 * depth))
            _tried(what, f"give its stored energy {of}", lambda depth=depth: wall.stored(depth))
    for of in ("velocity", "acceleration"):
        if is_of_file(Estimator.group, name := scene.estimate(of).estimator):
            _tried(f"The estimator {name}", "estimate", lambda of=of: _estimate(scene, of))
    if scene.hand and scene.hand.force and is_of_file(HandForce.group, scene.hand.force.kind):
        _try_force(scene.hand.force)


def _estimate(scene: Scene, of: str) -> Any:
    velocity, acceleration, _ = make_estimators(scene, Timebase.from_scene(scene).period_s)
    made = velocity if of == "velocity" else acceleration
    return made.step(made.start(0.0, (0.0, 0.0)), 0.0, (0.0, 0.0))[1]


def _try_force(force: HandForce) -> None:
    what, t = f"The hand force {force.kind}", np.array(_TIMES_S)
    for times in (t, t[:, None]):  # as in a run, and as in a batch
        values = _tried(what, "give the force at an array of times", lambda times=times: force.force_at(times))
        if np.shape(values) != times.shape:
            raise PluginError(
                f"{what} gave an array of shape {np.shape(values)} for times of shape {times.shape}; force_at "
                "must return one force for each time."
            )


@contextmanager
def _in_time() -> Iterator[None]:
    """Raises TimeoutError in code that runs for longer than the limit."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(*_: object) -> None:
        raise TimeoutError(f"it did not finish within {_LIMIT_S:g} s")

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, _LIMIT_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _tried(what: str, do: str, call: Callable[[], Any]) -> Any:
    try:
        with _in_time():
            value = call()
        is_fine = isinstance(value, Wall) or bool(np.isfinite(np.asarray(value, float)).all())
    except Exception as error:
        why = raised_in_file(error) or f"{type(error).__name__}: {error}"
        raise PluginError(f"{what} could not {do} when it was tried: {why}.") from error
    if not is_fine:
        raise PluginError(f"{what} gave {value}, which is not a finite number, when it had to {do}.")
    return value
