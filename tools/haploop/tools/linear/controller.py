"""The controller in contact as a linear system, found by running the program's own controller on unit vectors."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from haploop.controller.controller_batch import ControllerArray
from haploop.launch.batch.object_state import replace_arrays
from haploop.plant.sensing.encoder import accelerometer_is_used
from haploop.protocol.ticks import Timebase
from haploop.tools.linear.linearity import Kinds

# A wall without stiffness that is never left: the elements act, and its own force is added where it is known.
_ALWAYS_INSIDE = {"position": 1e300, "stiffness": 0.0, "occupies": "below"}


class LinearController(NamedTuple):
    """c[k+1] = A c[k] + B y[k], force[k] = C c[k] + D y[k] for samples y = (x,) or (x, acceleration).

    c is all that estimators and elements remember, and the force that of the elements, without the wall's spring.

    Attributes:
        moved: (A B), shape (memory, memory + inputs).
        force: (C D), shape (memory + inputs,).
    """

    moved: np.ndarray
    force: np.ndarray

    @classmethod
    def of(cls, scene: dict[str, Any], kinds: Kinds) -> LinearController:
        """That of a resolved scene of which ``why_not_linear`` has nothing to say.

        By superposition: a controller for many loops is run until its memory has its full size. Then loop i is given
        a memory, or a sample, of 1 in place i and 0 elsewhere. One tick later the memory is A and B, row by row.
        """
        time, inputs = Timebase.from_clock(scene["clock"], scene["duration"]), 1 + accelerometer_is_used(scene)
        controller = ControllerArray({**scene, "wall": _ALWAYS_INSIDE}, time, dict(kinds))
        places = -1
        while places != (places := len(_memory(controller))):
            _tick(controller, np.zeros((inputs, 1)))
        units = np.eye(places + inputs)
        _remember(controller, list(units[:places]))
        force = _tick(controller, units[places:])
        return cls(np.array(_memory(controller)).reshape(places, -1), force)._without_what_is_not_used()

    def _without_what_is_not_used(self) -> LinearController:
        """What neither the force nor any other memory depends on is left out, until nothing of the kind remains."""
        moved, force = self
        memory = len(moved)
        used = (np.vstack([moved, force]) != 0.0).any(axis=0)[:memory]
        if used.all():
            return self
        columns = np.append(used, np.ones(len(force) - memory, bool))
        return LinearController(moved[used][:, columns], force[columns])._without_what_is_not_used()


def _tick(controller: ControllerArray, sample: np.ndarray) -> np.ndarray:
    """The force that answers a sample, a row for each of its inputs, a column for each loop."""
    force = controller.answer([tuple(sample)])[0]
    controller.recorder.take_rows()
    return np.asarray(force)


def _memory(controller: ControllerArray) -> list[np.ndarray]:
    """All that it remembers: its arrays of numbers over the loops, always in the same order."""
    found: list[np.ndarray] = []

    def take(array: np.ndarray) -> np.ndarray:
        if array.dtype == float:
            found.append(array)
        return array

    replace_arrays(controller, take)
    return found


def _remember(controller: ControllerArray, rows: list[np.ndarray]) -> None:
    left = iter(rows)
    replace_arrays(controller, lambda array: next(left) if array.dtype == float else array)
