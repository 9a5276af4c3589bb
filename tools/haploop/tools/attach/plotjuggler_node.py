"""``haploop attach plotjuggler``: a node that passes every sample of one run after the other on to PlotJuggler."""

from __future__ import annotations

import sys
from typing import Any

from haploop.launch.processes.run_directory import LiveRun, RunNotFound
from haploop.logger.books.buffers import as_float64
from haploop.logger.log.channels import Channels
from haploop.logger.log.columns import motion_columns
from haploop.protocol.clock_client import Refused
from haploop.protocol.ticks import Timebase
from haploop.protocol.wire import Frame
from haploop.tools.attach.following import Following, runs_to_come
from haploop.tools.attach.plotjuggler import Batches, Outlet, PortTaken
from haploop.tools.cli.exit_codes import WRONG_USE, leave

ROLE = "plotjuggler"
# How much wall time goes into one message of each topic.
BATCH_S = 0.015


def attach_plotjuggler(run_id: str | None, port: int) -> None:
    """Publish runs until Ctrl-C; a run that was named, until it ends."""
    try:
        outlet = Outlet(port)
    except PortTaken as error:
        leave(str(error), WRONG_USE)
    print(f"publishing on {outlet.address}, for PlotJuggler's ZMQ Subscriber; Ctrl-C ends", file=sys.stderr)
    try:
        for run in runs_to_come(run_id):
            try:
                publish(run, outlet)
            except (RunNotFound, Refused) as error:
                print(error, file=sys.stderr)
    except KeyboardInterrupt:
        return
    finally:
        outlet.close()


def publish(run: LiveRun, outlet: Outlet) -> None:
    """Publish a run from wherever it is to its end.

    Raises:
        RunNotFound: it has ended already.
        Refused: it does not let the node join.
    """
    with Following(run, ROLE) as following:
        print(f"run {run.id}: {run.title}", file=sys.stderr)
        stream = Stream(Timebase(**following.observer.welcome["timebase"]))
        try:
            for frames in following.frames(BATCH_S):
                for role, frame in frames:
                    stream.take(role, frame)
                outlet.listen()
                for topic, payload in stream.batches.take(outlet.is_heard):
                    outlet.send(topic, payload)
        finally:
            print(f"run {run.id}: {following.skipped_ticks} ticks skipped", file=sys.stderr)
    print(f"run {run.id} is over" + (f": {following.failure}" if following.failure else ""), file=sys.stderr)


class Stream:
    """Telemetry as the samples that the log has, under the same names; the state at the end comes once.

    Attributes:
        batches: takes them.
    """

    def __init__(self, time: Timebase) -> None:
        self.batches = Batches()
        self._channels = Channels(self.batches, time, every_step=True)
        self._reached: tuple[int, dict[str, Any]] | None = None

    def take(self, role: str, frame: Frame) -> None:
        """Take a message of a publisher in."""
        block = frame.as_dict()
        if frame.name == "PLANT_BLOCK":
            motion = motion_columns({name: as_float64(data) for name, data in block["columns"].items()})
            first, ticks = block["from_tick"], block["ticks"]
            self._channels.plant(first, ticks, motion)
            self._reached = first + ticks, {name: column[-1:] for name, column in motion.items()}
        elif frame.name == "CONTROLLER_BLOCK":
            self._channels.controller(block)
        elif frame.name == "ENERGY_BLOCK":
            books = {name: as_float64(data) for name, data in block["columns"].items()}
            self._channels.energy(block["from_tick"], books)
        elif frame.name == "END" and role == "plant" and self._reached and self._reached[0] == block["tick"]:
            self._channels.plant_end(*self._reached)
