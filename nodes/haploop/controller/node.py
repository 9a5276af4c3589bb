"""The controller as a process: answers every sample, tells what it did, changes when the clock says so."""

from __future__ import annotations

import traceback
from pathlib import Path
from typing import Any

import zmq

from haploop.controller.controller import Controller
from haploop.controller.dissipation import ElementError, PluginError, registry
from haploop.protocol.block_length import BlockLength
from haploop.protocol.loop import ControllerEnd
from haploop.protocol.member import Member
from haploop.protocol.node import NodeError, run_node
from haploop.protocol.processes import PROCESSES
from haploop.protocol.sockets import bind
from haploop.protocol.telemetry import Publisher
from haploop.protocol.ticks import Timebase

ROLE = "controller"


class ControllerNode:
    """Follows the plant, sample by sample, no further than granted."""

    def __init__(self, member: Member, context: zmq.Context[zmq.Socket[bytes]], directory: Path) -> None:
        self._member = member
        self._publisher = Publisher(context, ROLE, self._state)
        address = bind(self._publisher.socket, directory, PROCESSES[ROLE].binds["telemetry"])
        welcome = member.join({"telemetry": address})
        scene = welcome["scene"]
        kinds = registry([Path(path) for path in welcome["context"]["plugins"]])
        self._controller = Controller(scene, Timebase(**welcome["timebase"]), kinds)
        self._block = BlockLength(scene["run"]["block_ticks"])
        self._reported = 0
        self._secret = welcome["context"]["secret"]
        self._loop = ControllerEnd(context, welcome["endpoints"]["plant"]["loop"], self._await_plant)

    def _state(self) -> tuple[int, dict[str, Any]]:
        return self._controller.tick, {"history": self._controller.recorder.history}

    def connect(self) -> None:
        """Greet the plant and wait for the logger."""
        self._loop.greet(self._secret)
        self._publisher.await_subscriber(lambda: self._wait("logger"))
        self._member.ready(0)

    def run(self) -> tuple[int, dict[str, Any]]:
        """Answer until the plant ends the run; returns the number of ticks answered."""
        controller, member, loop = self._controller, self._member, self._loop
        while (samples := loop.samples(controller.tick)) is not None:
            end = controller.tick + len(samples)
            while member.until < end:
                member.wait(controller.tick)
            if member.events:
                self._schedule()
            try:
                loop.answer(controller.tick, controller.answer(samples))
            except ElementError:
                self._flush()
                raise
            if end - self._reported >= self._block.ticks or end >= member.until:
                self._flush()
                member.poll()
        return self._end()

    def _schedule(self) -> None:
        for tick, event in self._member.take_events():
            if "swap" in event or "set" in event:
                self._controller.schedule(tick, event)

    def _end(self) -> tuple[int, dict[str, Any]]:
        self._flush()
        tick, trouble = self._controller.tick, self._controller.recorder.trouble
        self._publisher.publish("END", tick, "", trouble)
        return tick, {"strangers": self._publisher.strangers, "trouble": trouble}

    def _flush(self) -> None:
        """Publish what was answered, answer new subscribers, report."""
        recorder = self._controller.recorder
        for block in recorder.take():
            fields = (block[name] for name in ("from_tick", "ticks", "columns", "elements", "wall"))
            self._publisher.publish("CONTROLLER_BLOCK", *fields)
        self._publisher.serve()
        self._reported = self._controller.tick
        refused, recorder.refused = recorder.refused, []
        self._member.progress(self._reported, {"refused": refused} if refused else None)
        self._block.next()

    def _await_plant(self) -> None:
        self._wait("plant")

    def _wait(self, on: str) -> None:
        """Nothing came for a while: say so, and serve whoever subscribes to a loop that stands still."""
        self._member.waiting(self._controller.tick, on)
        self._member.poll()
        if self._controller.recorder.is_empty:
            self._publisher.serve()


def work(member: Member, context: zmq.Context[zmq.Socket[bytes]], directory: Path) -> tuple[int, dict[str, Any]]:
    """Run the controller as a member of a run."""
    try:
        node = ControllerNode(member, context, directory)
        node.connect()
        return node.run()
    except PluginError as error:
        raise NodeError(str(error)) from error
    except ElementError as error:
        traceback.print_exc()  # where in the element's own code
        raise NodeError(str(error)) from error


if __name__ == "__main__":
    run_node(ROLE, work)
