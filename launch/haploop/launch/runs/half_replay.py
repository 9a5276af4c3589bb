"""Repeats the half of a run that was haploop's own, if a foreign program took the place of the other half."""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Iterator, Mapping

import numpy as np

from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element, ElementError
from haploop.launch.foreign import described
from haploop.launch.runs.run_files import holds_readings
from haploop.launch.spec import PROGRAMS
from haploop.logger.books.buffers import as_float64
from haploop.logger.log import LogError
from haploop.logger.log.channels import Channels, motion_columns
from haploop.logger.log.recording import MemoryLog, Recording
from haploop.logger.log.table import Floats
from haploop.logger.summary import misfit
from haploop.plant.plant import Plant
from haploop.protocol.changes import Event, changes_of, is_change
from haploop.protocol.scene.scene import Scene, accelerometer_is_used, hand_is_unmodelled
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.wire import Message

_SAME = "Haploop's own {} would have done the same in its place, bit for bit."
_OTHER_FORCES = (
    "Haploop's own controller would have answered the same samples with forces that differ by up to {:.3g} N, "
    "first at {:g} s."
)
_OTHER_WAY = "Haploop's own plant would have deviated by up to {:.3g} m under the same commands."
_NO_PROGRAMS = f"The attachment {PROGRAMS} in the log is not that of a run: it should name the programs by role."
_UNKNOWN: Message = {"name": "", "version": "", "command": ""}
_PROGRAM = {"name": str, "version": str, "command": str, "own": bool}


def foreign_programs(recorded: Recording, scene: Scene) -> dict[str, Message]:
    """Returns the foreign programs that took the place of plant or controller by role, as the log of a run names them.

    The plant of a scene with an unmodelled hand was not haploop's, whatever the log says.

    Raises LogError if what the log holds in their place is something else.
    """
    try:
        programs = json.loads(recorded.attachments.get(PROGRAMS, b"{}"))
    except (ValueError, RecursionError) as error:
        raise LogError(_NO_PROGRAMS) from error
    if not isinstance(programs, dict) or misfit(programs, dict.fromkeys(programs, _PROGRAM)):
        raise LogError(_NO_PROGRAMS)
    unknown = {"plant": _UNKNOWN} if hand_is_unmodelled(scene) else {}
    return unknown | {role: program for role, program in programs.items() if not program["own"]}


def named(foreign: Mapping[str, Message]) -> str:
    """Returns which programs had these roles, for people: "the plant was Bench 2.1 (./bench --fast)"."""
    return " and ".join(f"the {role} was {described(program)}" for role, program in foreign.items())


def repeat_controller(
    scene: Scene, kinds: Mapping[str, type[Element]], events: list[tuple[int, Event]], recorded: Recording
) -> Recording:
    """Runs haploop's controller again on the recorded samples and returns what it would have logged.

    If an element gives no force, the recording ends there.
    """
    rows, time = recorded["/controller"], Timebase.from_scene(scene)
    controller, memory = Controller(scene, time, dict(kinds)), MemoryLog()
    for tick, event in events:
        if is_change(event):
            controller.schedule(tick, event)
    columns = (rows["x"], rows["a"]) if accelerometer_is_used(scene) else (rows["x"],)
    samples, channels = np.stack(columns, axis=1), Channels(memory, time, every_step=False)
    with contextlib.suppress(ElementError):  # then ticks are missing, and the comparison says so
        for part in _blocks(scene, len(samples)):
            controller.answer(samples[part].tolist())
            _log(channels, controller)
    _log(channels, controller)
    return memory.recording()


def beside_own(
    role: str, scene: Scene, kinds: Mapping[str, type[Element]], events: list[tuple[int, Event]], recorded: Recording
) -> str:
    """Returns a sentence on how far the foreign program in a role departed from what haploop's own would have done.

    Refused changes are left out; "" if the log does not hold the input that haploop's own would need.
    """
    refused = iter(change.refused is not None for change in changes_of(events))
    made = [(tick, event) for tick, event in events if not (is_change(event) and next(refused))]
    if role == "plant":
        if hand_is_unmodelled(scene):
            return ""
        topic, name = "/plant" if "/plant" in recorded else "/controller", "x"
        own = repeat_plant(scene, made, recorded)[0]
    else:
        if accelerometer_is_used(scene) and not holds_readings(scene):
            return ""
        topic, name, own = "/controller", "total", repeat_controller(scene, kinds, made, recorded)
    theirs, ours = recorded[topic][name], own[topic][name]
    count = min(len(theirs), len(ours))
    theirs, ours = theirs[:count], ours[:count]
    is_same = (theirs == ours) | (np.isnan(theirs) & np.isnan(ours))
    with np.errstate(invalid="ignore"):
        apart = np.where(is_same, 0.0, np.nan_to_num(np.abs(theirs - ours), nan=np.inf))
    if not apart.any():
        return _SAME.format(role)
    most, first = float(apart.max()), float(recorded[topic]["timestamp"][np.argmax(apart != 0.0)])
    return _OTHER_WAY.format(most) if role == "plant" else _OTHER_FORCES.format(most, first)


def _log(channels: Channels, controller: Controller) -> None:
    for block in controller.recorder.take():
        channels.controller(block, 0)


def _blocks(scene: Scene, ticks: int) -> Iterator[slice]:
    for first in range(0, ticks, scene.run.block_ticks):
        yield slice(first, min(first + scene.run.block_ticks, ticks))


def repeat_plant(
    scene: Scene, events: list[tuple[int, Event]], recorded: Recording
) -> tuple[dict[str, dict[str, Floats]], str]:
    """Moves haploop's plant again under the recorded commands, up to the end of the controller's log.

    Returns:
        What it would have logged, with its samples as ``x`` of ``/controller``; and the SHA-256 of the trajectory.
    """
    commands, time = recorded["/controller"]["total"].tolist(), Timebase.from_scene(scene)
    plant, memory, samples = Plant(scene, time), MemoryLog(), []
    for tick, event in events:
        if is_change(event):
            plant.schedule(tick, event)

    def exchange(tick: int, sent: list[tuple[float, ...]]) -> list[float]:
        samples.extend(sample[0] for sample in sent)
        return commands[tick : tick + len(sent)]

    channels, digest = Channels(memory, time, every_step="/plant" in recorded), hashlib.sha256()
    reached, end = 0, dict[str, Floats]()
    with contextlib.suppress(ArithmeticError):  # then steps are missing
        for part in _blocks(scene, len(commands)):
            plant.run_until(part.stop, exchange)
            first, ticks, columns = plant.take_block()
            motion = {name: as_float64(data) for name, data in columns.items()}
            logged, reached = motion_columns(motion), first + ticks
            channels.plant(first, ticks, logged)
            states = np.stack([logged["x"], logged["v"]], axis=1)
            digest.update(states[bool(first) :].tobytes())
            end = {name: column[-1:] for name, column in logged.items()}
            if plant.stop_reason:
                break
        channels.plant_end(reached, end)
    seen = {"timestamp": np.arange(len(samples)) / time.control_rate, "x": np.array(samples)}
    return {**memory.recording(), "/controller": seen}, digest.hexdigest()
