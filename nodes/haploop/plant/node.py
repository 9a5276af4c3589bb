"""The plant as a process: samples out, commands in, telemetry alongside."""

from __future__ import annotations

from pathlib import Path

import zmq

from haploop.plant.plant import Plant
from haploop.protocol.plugin_file import bring_file
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import HELD_S, BlockLength, Timebase
from haploop.protocol.transport.clock_client import Aborted, ClockClient
from haploop.protocol.transport.loop import LoopError, PlantEnd
from haploop.protocol.transport.machine import machine_of
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.node import NodeError, run_node
from haploop.protocol.transport.sockets import bind, transport_of
from haploop.protocol.transport.telemetry import Publisher
from haploop.protocol.transport.wire import Message

ROLE = "plant"
_NO_FORCE = "the controller gave a force that is not a finite number"


class PlantNode:
    """Leads the loop: steps as far as granted, L + 1 samples a message, and ends the run for plant and controller."""

    def __init__(self, client: ClockClient, context: zmq.Context[zmq.Socket[bytes]], directory: Path) -> None:
        self._client = client
        self._loop = PlantEnd(context, lambda: self._wait("controller"))
        self._publisher = Publisher(context, ROLE, self._state)
        names = PROCESSES[ROLE].binds
        sockets = {"loop": self._loop.socket, "telemetry": self._publisher.socket}
        endpoints = {channel: bind(socket, directory, names[channel]) for channel, socket in sockets.items()}
        welcome = client.join(endpoints)
        for path in welcome["context"].get("brings", ()):
            bring_file(Path(path))
        scene = Scene.from_dict(welcome["scene"])
        timebase = Timebase(**welcome["timebase"])
        self._plant = Plant(scene, timebase)
        # Over a network a message takes time, however few samples it holds.
        least_ticks = timebase.lookahead_ticks + 1 if transport_of(context).host else 1
        self._block = BlockLength(timebase.block_ticks(scene.run), machine_of(context).now, least_ticks)
        self._flushed = 0
        self._secret = welcome["context"]["secret"]
        self._is_controller_foreign = not welcome["context"].get("programs", {}).get("controller", {"own": True})["own"]

    def _state(self) -> tuple[int, Message]:
        state = self._plant.state()
        return int(state["tick"]), state

    def connect(self) -> None:
        """Finds the controller and the logger; no tick is worked on before both listen."""
        self._loop.greet(self._secret)
        self._publisher.await_subscriber(lambda: self._wait("logger"))
        self._client.ready(0)

    def run(self) -> tuple[int, Message]:
        """Steps until the run ends; publishes what has been stepped even if the run fails, here or elsewhere."""
        try:
            return self._run()
        except (Aborted, ArithmeticError, LoopError):
            self._flush()
            raise

    def _run(self) -> tuple[int, Message]:
        client, plant = self._client, self._plant
        while plant.stop_reason is None and not (client.last and plant.tick >= client.until):
            for tick, event in client.take_events():
                plant.schedule(tick, event)
            plant.run_until(min(self._flushed + self._block.ticks, client.until), self._exchange)
            if self._block.is_worth_it(plant.reached - self._flushed):
                self._flush()
            else:
                client.progress(plant.reached)
            client.poll()
            while plant.tick >= client.until and not client.last and plant.stop_reason is None:
                if plant.reached == self._flushed:
                    client.wait(plant.tick)
                    self._publisher.serve()
                elif not client.hears(int(HELD_S * 1000)):
                    self._flush()
        return self._end()

    def _exchange(self, tick: int, samples: list[tuple[float, ...]]) -> list[float]:
        forces = self._loop.exchange(tick, samples)
        self._client.keep_in_touch(tick, "controller")  # where answers are slow, a block takes long
        return forces

    def _end(self) -> tuple[int, Message]:
        plant = self._plant
        self._loop.close(plant.reached)
        self._flush()
        trouble = _NO_FORCE if self._is_controller_foreign and plant.has_no_force else None
        self._publisher.publish("END", plant.reached, plant.stop_reason or "", trouble)
        if plant.stop_reason:
            self._client.ended(plant.reached, plant.stop_reason)
        return plant.reached, {"strangers": self._loop.unknown_peers + self._publisher.unknown_peers}

    def _flush(self) -> None:
        first, ticks, columns = self._plant.take_block()
        if ticks:
            self._publisher.publish("PLANT_BLOCK", first, ticks, columns)
        self._publisher.serve()
        self._flushed = self._plant.reached
        self._client.progress(self._flushed)
        self._block.next()

    def _wait(self, on: str) -> None:
        self._client.waiting(self._plant.tick, on)
        self._client.poll()


def work(client: ClockClient, context: zmq.Context[zmq.Socket[bytes]], directory: Path) -> tuple[int, Message]:
    node = PlantNode(client, context, directory)
    node.connect()
    try:
        return node.run()
    except ArithmeticError as error:
        raise NodeError(str(error)) from error


if __name__ == "__main__":
    run_node(ROLE, work)
