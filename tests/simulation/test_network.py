"""The simulated sockets against those of ZeroMQ: the same conversation, the same words."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import zmq

from haploop.protocol.transport.sockets import has_message, open_socket
from simulation.computer.machine import Disk, SimMachine
from simulation.computer.sockets import SimContext
from simulation.computer.world import Process, World
from simulation.watch import Watch

Conversation = Callable[[Any, str, Callable[[], None]], list[Any]]


def errno_of(act: Callable[[], object]) -> int:
    try:
        act()
    except zmq.ZMQError as error:
        return error.errno or 0
    return 0


def strangers_and_answers(context: Any, address: str, settle: Callable[[], None]) -> list[Any]:
    """A ROUTER answers who has spoken, in order; who is unknown, or has gone, cannot be reached."""
    router, first, second = (open_socket(context, kind) for kind in (zmq.ROUTER, zmq.DEALER, zmq.DEALER))
    first.connect(address)
    first.send(b"before anyone listens")
    router.bind(address)
    settle()
    sender, *said = router.recv_multipart()
    router.send_multipart([sender, b"one"])
    router.send_multipart([sender, b"two"])
    second.connect(address)
    second.send_multipart([b"a", b"b"])
    settle()
    heard = [first.recv(), first.recv()]
    other = router.recv()
    pieces = [router.recv(), router.rcvmore, router.recv(), router.rcvmore]
    unknown = errno_of(lambda: router.send_multipart([b"nobody", b"?"]))
    second.close(0)
    settle()
    nothing_more = has_message(router)
    gone = errno_of(lambda: router.send_multipart([other, b"are you there"]))
    return [said, heard, sender == other, pieces, unknown, gone, nothing_more, first.poll(0)]


def what_is_left(context: Any, address: str, settle: Callable[[], None]) -> list[Any]:
    """What was sent before a socket closed with time to linger is read to the end, also when the sender has gone."""
    router, dealer = open_socket(context, zmq.ROUTER), open_socket(context, zmq.DEALER)
    router.bind(address)
    dealer.connect(address)
    settle()
    for number in range(5):
        dealer.send(b"%d" % number)
    dealer.close(linger=1000)
    settle()
    return [router.recv_multipart()[1:] for _ in range(5)]


def no_answer(context: Any, address: str, settle: Callable[[], None]) -> list[Any]:
    """Waiting ends when nothing comes, and a closed socket says so."""
    dealer = open_socket(context, zmq.DEALER)
    dealer.setsockopt(zmq.RCVTIMEO, 30)
    dealer.connect(address)
    waited = [errno_of(dealer.recv), dealer.poll(20), has_message(dealer)]
    dealer.close(0)
    return [*waited, errno_of(lambda: dealer.send(b"x"))]


def subscriptions(context: Any, address: str, settle: Callable[[], None]) -> list[Any]:
    """An XPUB hears of every subscription and of the last that leaves; each gets what it asked for."""
    publisher, plant, every = (open_socket(context, kind) for kind in (zmq.XPUB, zmq.SUB, zmq.SUB))
    publisher.bind(address)
    plant.connect(address)
    plant.subscribe(b"plant")
    settle()
    publisher.send_multipart([b"plant", b"1"])
    publisher.send_multipart([b"other", b"2"])
    every.connect(address)
    every.subscribe(b"")
    settle()
    publisher.send_multipart([b"plant", b"3"])
    settle()
    asked = [publisher.recv(), publisher.recv(), has_message(publisher)]
    heard = [plant.recv_multipart(), plant.recv_multipart(), every.recv_multipart(), plant.poll(0), every.poll(0)]
    plant.close(0)
    settle()
    return [*asked, *heard, publisher.recv(), has_message(publisher)]


def strangers_at_a_publisher(context: Any, address: str, settle: Callable[[], None]) -> list[Any]:
    """An XPUB hands on what is no subscription."""
    publisher, stranger = open_socket(context, zmq.XPUB), context.socket(zmq.XSUB)
    publisher.bind(address)
    stranger.linger = 0
    stranger.connect(address)
    stranger.send(b"\1plant")
    stranger.send(b"junk")
    settle()
    return [publisher.recv(), publisher.recv(), has_message(publisher)]


CONVERSATIONS: list[Conversation] = [
    strangers_and_answers, what_is_left, no_answer, subscriptions, strangers_at_a_publisher
]  # fmt: skip


@contextmanager
def real() -> Iterator[Any]:
    """A context of ZeroMQ, and every socket that it has opened until they are closed together."""
    context: Any = zmq.Context()
    opened, open_one = [], context.socket

    def socket(kind: int) -> Any:
        opened.append(open_one(kind))
        return opened[-1]

    context.socket = socket
    try:
        yield context
    finally:
        context.destroy(linger=0)


def simulated(conversation: Conversation, address: str, seed: int) -> list[Any]:
    """What comes of a conversation on simulated sockets, each of a process of its own as far as it matters."""
    world = World(seed)
    watch = Watch(0)

    def work() -> list[Any]:
        context = SimContext(world, process, watch, SimMachine(process, watch, Disk()))
        return conversation(context, address, lambda: process.sleep(0.15))

    process = Process(world, "all", work)
    world.run(lambda: not process.alive, lambda: world.now + 10.0)
    if process.error:
        raise process.error
    return process.result


@pytest.mark.parametrize("conversation", CONVERSATIONS)
def test_simulated_sockets_say_what_those_of_zeromq_say(conversation: Conversation, live_runs_here: Path) -> None:
    heard = [simulated(conversation, f"ipc://{live_runs_here}/{seed}", seed) for seed in range(20)]
    said = None
    for settled_s in (0.15, 1.0, 4.0):  # threads of ZeroMQ may wait for a processor
        with real() as context:
            said = conversation(context, f"ipc://{live_runs_here}/{settled_s}", partial(time.sleep, settled_s))
        if said == heard[0]:
            break
    assert heard == [said] * 20
