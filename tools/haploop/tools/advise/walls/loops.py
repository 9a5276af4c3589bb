"""Many loops side by side, watched as they run: positions and commands at ticks, no books and no logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element
from haploop.controller.recorder import BatchRecorder
from haploop.launch.batch.loop import BatchLoop
from haploop.launch.batch.stacking import is_batchable, stacked, structures
from haploop.plant.friction.projected import ProjectedFrictionMotion
from haploop.plant.plant import Plant
from haploop.plant.where_it_pays import WhereItPays
from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.protocol.ticks import Timebase

Kinds = Mapping[str, type[Element]]
# Elements without a memory and their parameter, where 0 means no element: walls with any of them move as one array.
_PLAIN = {"damping": "damping", "bidirectional-inertia": "mass", "unidirectional-inertia": "mass"}
# The parts of a scene that the motion of its bodies does not depend on.
_OF_A_WALL = ("title", "seed", "wall", "dissipation")


class Seen(NamedTuple):
    """What loops did over some ticks, shape (ticks, members).

    Attributes:
        x: position of the body with the encoder, m.
        measured: the same as the controller reads it, m.
        command: the command, N.
        gone: whether a member is beyond the scene's limit, or not a number, shape (members,).
    """

    x: np.ndarray
    measured: np.ndarray
    command: np.ndarray
    gone: np.ndarray


class Loops(BatchLoop):
    """Scenes of one structure, moved together; friction is projected, see ``ProjectedFrictionMotion``."""

    def __init__(self, scenes: Sequence[Scene], kinds: Kinds) -> None:
        scene, rows = stacked([replace(one, friction=None) for one in _alike(scenes)]), BatchRecorder()
        time = Timebase.from_scene(scene)
        super().__init__(scene, time, Controller(scene, time, dict(kinds), rows), rows, len(scenes))
        if scenes[0].friction is not None:
            WhereItPays.may_wait = True
            self._motion = ProjectedFrictionMotion.of(scenes, scene, time)
        self._limit_m, self._tick = scene.diverged_beyond, 0

    def go_on(self, ticks: int) -> Seen:
        """Runs for this many more ticks."""
        x = np.empty((ticks, len(np.atleast_1d(self._motion.x))))
        with np.errstate(all="ignore"):
            for row in range(ticks):
                x[row] = self._motion.x
                self._work(self._tick + row)
        columns = [row.columns for row in self._rows.take_rows()]
        self._motion.forget_record()
        self._tick += ticks
        measured, command = (
            np.array([np.broadcast_to(each[name], x.shape[1:]) for each in columns]) for name in ("x", "total")
        )
        gone = ~(np.abs(x) <= self._limit_m).all(axis=0) | ~np.isfinite(command).all(axis=0)
        return Seen(x, measured, command, np.asarray(gone))

    def select(self, kept: np.ndarray) -> None:
        """Continues with these members alone; ``kept`` has a truth value for each."""
        self._select(kept)


class LoneLoop:
    """One loop that cannot run in arrays, with the plant and the controller of a run; used as ``Loops`` is."""

    def __init__(self, scene: Scene, kinds: Kinds) -> None:
        self._time = Timebase.from_scene(scene)
        self._plant, self._controller = Plant(scene, self._time), Controller(scene, self._time, dict(kinds))

    def go_on(self, ticks: int) -> Seen:
        """Runs for this many more ticks."""
        self._plant.run_until(
            self._plant.tick + ticks, lambda _, samples: [float(force) for force in self._controller.answer(samples)]
        )
        _, done, columns = self._plant.take_block()
        x = np.frombuffer(columns["x"])[: done * self._time.steps_per_tick : self._time.steps_per_tick]
        blocks = self._controller.recorder.take()
        told = (np.frombuffer(b"".join(block["columns"][name] for block in blocks)) for name in ("x", "total"))
        shown, measured, command = (np.resize(values, (ticks, 1)) for values in (x, *told))
        return Seen(shown, measured, command, np.array([self._plant.stop_reason is not None]))

    def select(self, kept: np.ndarray) -> None:
        """Does nothing: there are no other members to leave out."""


def is_plain(elements: Sequence[ElementTable]) -> bool:
    """Tells whether these are plain elements, each once and in their order, or none."""
    names = [each.name for each in elements]
    return names == [name for name in _PLAIN if name in names] and all(each.acts == "in-contact" for each in elements)


def make_loops(scenes: Sequence[Scene], kinds: Kinds) -> list[tuple[list[int], Loops | LoneLoop]]:
    """Returns the indices of the scenes that move together, with their loops."""
    groups: dict[Any, list[int]] = {}
    known: dict[tuple[int, ...], bool] = {}  # by the parts of a scene: walls that are tried in one case share them
    for index, shape in enumerate(structures([_shape(scene) for scene in scenes])):
        bodies = tuple(id(part) for key, part in vars(scenes[index]).items() if key not in _OF_A_WALL)
        if bodies not in known:
            known[bodies] = is_batchable(replace(scenes[index], friction=None))
        smooth = known[bodies]
        groups.setdefault((shape, scenes[index].friction is None) if smooth else index, []).append(index)
    return [(group, LoneLoop(scenes[key], kinds) if isinstance(key, int) else Loops([scenes[i] for i in group], kinds))
            for key, group in groups.items()]  # fmt: skip


def _shape(scene: Scene) -> Scene:
    """Returns the scene without what need not be alike: friction, and plain elements."""
    return replace(scene, friction=None, dissipation=() if is_plain(scene.dissipation) else scene.dissipation)


def _alike(scenes: Sequence[Scene]) -> list[Scene]:
    """Returns the scenes of a group with the same plain elements, some of which do nothing: forces keep their bits."""
    names = [name for name in _PLAIN if any(each.name == name for scene in scenes for each in scene.dissipation)]
    if not names or not is_plain(scenes[0].dissipation):
        return list(scenes)
    nothing = {name: ElementTable(name=name, parameters={_PLAIN[name]: 0.0}) for name in names}
    return [
        replace(scene, dissipation=tuple((nothing | {each.name: each for each in scene.dissipation}).values()))
        for scene in scenes
    ]
