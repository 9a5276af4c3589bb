"""The controller as a process: answers every sample, reports what it did, changes when the clock says so."""

from __future__ import annotations

import sys
from linecache import getline
from pathlib import Path

import zmq

from haploop.controller.controller import Controller
from haploop.controller.deadline import heed_deadline
from haploop.controller.dissipation import ElementError, registry
from haploop.controller.dissipation.element import places_of
from haploop.protocol.changes import Event, is_change, refusals_as_status
from haploop.protocol.plugin_file import raised_in_file
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.protocol.ticks import BlockLength, Timebase
from haploop.protocol.transport.clock_client import REPORT_MS, Aborted, ClockClient
from haploop.protocol.transport.loop import IDLE_MS, ControllerEnd, LoopError, check_samples
from haploop.protocol.transport.machine import machine_of
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.node import NodeError, run_node
from haploop.protocol.transport.prints import mark_ticks
from haploop.protocol.transport.sockets import bind
from haploop.protocol.transport.telemetry import Publisher
from haploop.protocol.transport.wire import Message

ROLE = "controller"


class ControllerNode:
    """Follows the plant, sample by sample, no further than granted."""

    def __init__(self, client: ClockClient, context: zmq.Context[zmq.Socket[bytes]], directory: Path) -> None:
        self._client = client
        self._publisher = Publisher(context, ROLE, self._state)
        address = bind(self._publisher.socket, directory, PROCESSES[ROLE].binds["telemetry"])
        welcome = client.join({"telemetry": address})
        scene = Scene.from_dict(welcome["scene"])
        told = welcome["context"]
        self._installed: dict[str, str] = told["elements"]
        named = {table.name for table in scene.dissipation}
        kinds = registry([Path(path) for path in told["plugins"]], self._places(named))
        time = Timebase(**welcome["timebase"])
        self._controller = Controller(scene, time, kinds)
        mark_ticks(lambda: self._controller.tick)
        self._block = BlockLength(time.block_ticks(scene.run), machine_of(context).now)
        self._reported = self._idle_ms = 0
        self._secret = told["secret"]
        is_foreign = not told.get("programs", {}).get("plant", {"own": True})["own"]
        self._checked_values = 1 + accelerometer_is_used(scene) if is_foreign else 0
        self._loop = ControllerEnd(context, welcome["endpoints"]["plant"], self._idle)

    def _places(self, names: set[str]) -> dict[str, str]:
        """Returns the places of the installed kinds that are named; the others are not loaded."""
        return {name: place for name, place in self._installed.items() if name in names}

    def _schedule(self, events: list[tuple[int, Event]]) -> None:
        for tick, event in events:
            if is_change(event):
                if kind := (event.get("swap") or {}).get("kind"):
                    self._controller.learn(registry(places=self._places({kind})))
                self._controller.schedule(tick, event)

    def _state(self) -> tuple[int, Message]:
        return self._controller.tick, {"history": self._controller.recorder.history}

    def connect(self) -> None:
        """Greets the plant and waits for the logger."""
        self._loop.greet(self._secret)
        self._publisher.await_subscriber(lambda: self._wait("logger"))
        self._client.ready(0)

    def run(self) -> tuple[int, Message]:
        """Answers until the plant ends the run; returns the number of ticks answered.

        What has been answered is published even if the run fails, here or elsewhere.
        """
        try:
            return self._run()
        except Exception as error:
            if isinstance(error, Aborted | ElementError | LoopError) or raised_in_file(error):
                self._flush()
            raise

    def _run(self) -> tuple[int, Message]:
        controller, client, loop = self._controller, self._client, self._loop
        checked_values, tick = self._checked_values, controller.tick
        while (samples := loop.samples(tick)) is not None:
            if checked_values:
                check_samples(tick, samples, checked_values)
            end = tick + len(samples)
            while client.until < end:
                client.wait(tick)
            if client.events:
                self._schedule(client.take_events())
            loop.answer(tick, controller.answer(samples))
            client.keep_in_touch(end, "plant")
            tick, held = end, end - self._reported
            if held >= self._block.ticks or (end >= client.until and self._block.is_worth_it(held)):
                self._flush()
                client.poll()
        self._flush()
        trouble = controller.recorder.trouble
        self._publisher.publish("END", tick, "", trouble)
        return tick, {"strangers": self._publisher.unknown_peers, "trouble": trouble}

    def _flush(self) -> None:
        recorder = self._controller.recorder
        for block in recorder.take():
            fields = (block[name] for name in ("from_tick", "ticks", "columns", "elements", "wall"))
            self._publisher.publish("CONTROLLER_BLOCK", *fields)
        self._publisher.serve()
        self._reported = self._controller.tick
        self._client.progress(self._reported, refusals_as_status(*recorder.take_told()))
        self._block.next()

    def _wait(self, on: str) -> None:
        self._client.waiting(self._controller.tick, on)
        self._client.poll()

    def _idle(self) -> None:
        """Publishes what was held back, reports now and then that no sample comes, and serves those who subscribe."""
        if self._controller.tick > self._reported:
            self._flush()
        self._idle_ms += IDLE_MS
        if self._idle_ms >= REPORT_MS:
            self._idle_ms = 0
            self._wait("plant")
        self._publisher.serve()


def work(client: ClockClient, context: zmq.Context[zmq.Socket[bytes]], directory: Path) -> tuple[int, Message]:
    try:
        node = ControllerNode(client, context, directory)
        node.connect()
        return node.run()
    except ElementError as error:
        for file, line in places_of(error.__cause__):
            print(f'  File "{file}", line {line}: {getline(file, line).strip()}', file=sys.stderr)
        raise NodeError(str(error)) from error


if __name__ == "__main__":
    heed_deadline()
    run_node(ROLE, work)
