"""The direct connection of plant and controller: what is no answer is named, and a stranger changes nothing."""

import math
import tempfile
from collections.abc import Iterator
from pathlib import Path

import msgpack
import pytest
import zmq

from haploop.protocol.transport.loop import ControllerEnd, LoopError, PlantEnd
from haploop.protocol.transport.sockets import bind
from helpers.live.attacks import junk, pack

SECRET = "s" * 32
HELLO, SAMPLES, COMMANDS, LAST = 20, 21, 22, 23
NO_ANSWERS = [
    *junk(),
    pack(1, COMMANDS, 5, ["1.0"]),
    pack(1, COMMANDS, 5, [None]),
    pack(1, COMMANDS, 5, [[1.0]]),
    pack(1, COMMANDS, 5, ["x" * 10_000]),
    pack(1, COMMANDS, 5, "1"),
    pack(1, COMMANDS, 5, {1.0: 2.0}),
    pack(1, COMMANDS, 5, 1.0),
    pack(1, COMMANDS, 5, [1.0, 2.0]),
    pack(1, COMMANDS, 5, []),
    pack(1, COMMANDS, 4, [1.0]),
    pack(1, COMMANDS, 5),
    pack(1, COMMANDS, 5.0, [1.0]),
    pack(True, COMMANDS, 5, [1.0]),
    pack(1, COMMANDS, 5, [True]),
    pack(2, COMMANDS, 5, [1.0]),
    pack(1, HELLO, SECRET),
    pack(1, LAST, 5),
    b"\x94\x01\x16\x05" + b"\x91" * 1000 + b"\x01",
    # As long as a frame of one force, and as it begins.
    b"\x94\x01\x16\xce" + bytes([0, 0, 0, 4]) + b"\x91\xcb" + bytes(8),
    b"\x94\x01\x16\xce" + bytes([0, 0, 0, 5]) + b"\x91\xa8" + b"a text!.",
    b"\x94\x02\x16\xce" + bytes([0, 0, 0, 5]) + b"\x91\xcb" + bytes(8),
]


class Plant:
    """The plant's end, greeted by a DEALER that speaks as the controller."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="hl", dir="/tmp")
        self.context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self.end = PlantEnd(self.context, lambda: None)
        self.address = bind(self.end.socket, Path(self._folder.name), "loop")
        self.partner = self.dealer()
        self.partner.send(pack(1, HELLO, SECRET))
        self.end.greet(SECRET)
        self.partner.recv()

    def dealer(self) -> zmq.Socket[bytes]:
        socket = self.context.socket(zmq.DEALER)
        socket.linger = 0
        socket.connect(self.address)
        return socket

    def close(self) -> None:
        self.context.destroy(linger=0)
        self._folder.cleanup()


@pytest.fixture
def plant() -> Iterator[Plant]:
    made = Plant()
    yield made
    made.close()


def test_whatever_the_partner_sends_in_place_of_forces_is_a_named_error(plant: Plant) -> None:
    for data in NO_ANSWERS:
        if data:  # an empty frame alone is that of an unknown peer
            plant.partner.send(data)
            with pytest.raises(
                LoopError, match=r"In the loop, commands from tick 5, 1 of them, were expected, but .* was received\."
            ):
                plant.end.exchange(5, [(0.0,)])
    plant.partner.send(pack(1, COMMANDS, 5, [1.5]))
    assert plant.end.exchange(5, [(0.0,)]) == [1.5]


@pytest.mark.parametrize("tick", [0, 5, 300, 2**32 - 1, 2**32])
@pytest.mark.parametrize("values", [(-0.0,), (0.1, 0.2)])
def test_a_frame_of_one_number_is_the_message_that_msgpack_makes_of_it(
    plant: Plant, tick: int, values: tuple[float, ...]
) -> None:
    peer = plant.context.socket(zmq.DEALER)
    peer.bind("inproc://loop")
    controller = ControllerEnd(plant.context, {"loop": "inproc://loop"}, lambda: None)
    for force in (-0.0, 1):
        controller.answer(tick, [force])
        answer = peer.recv()
        assert msgpack.unpackb(answer) == [1, COMMANDS, tick, [force]]
        plant.partner.send(answer)
        answered = plant.end.exchange(tick, [values])
        assert (answered, math.copysign(1.0, answered[0])) == ([force], math.copysign(1.0, force))
        sample = plant.partner.recv()
        assert msgpack.unpackb(sample) == [1, SAMPLES, tick, [list(values)]]
        peer.send(sample)
        assert controller.samples(tick) == [list(values)]
    controller.socket.close()
    peer.close()


def test_what_a_stranger_sends_is_counted_and_dropped_and_the_answer_is_the_partners(plant: Plant) -> None:
    stranger = plant.dealer()
    for data in NO_ANSWERS:
        stranger.send(data)
    stranger.send_multipart(NO_ANSWERS)
    exchanged = 0
    while plant.end.unknown_peers <= len(NO_ANSWERS):
        plant.partner.send(pack(1, COMMANDS, 5, [1.5]))
        assert plant.end.exchange(5, [(0.0,)]) == [1.5]
        exchanged += 1
        assert exchanged < 10_000
    stranger.close()


NO_SAMPLES = [
    *junk(),
    *(pack(1, SAMPLES, 5, wrong) for wrong in ("x", None, {1: 2})),
    pack(1, LAST, "x"),
    pack(1, SAMPLES, 5.0, [[0.0]]),
    pack(1, LAST, 5.0),
]


def test_whatever_comes_in_place_of_samples_is_a_named_error() -> None:
    with zmq.Context() as context, context.socket(zmq.PAIR) as plant:
        controller = ControllerEnd(context, {"loop": "inproc://loop"}, lambda: None)
        controller.socket.close()
        controller.socket = context.socket(zmq.PAIR)
        plant.bind("inproc://pair")
        controller.socket.connect("inproc://pair")
        for data in NO_SAMPLES:
            plant.send(data)
            with pytest.raises(
                LoopError, match=r"In the loop, samples from tick 5 were expected, but .* was received\."
            ):
                controller.samples(5)
        plant.send(pack(1, SAMPLES, 5, [[0.25]]))
        assert controller.samples(5) == [[0.25]]
        plant.send(pack(1, LAST, 5))
        assert controller.samples(6) is None
        controller.socket.close()
