"""The plant's end of the loop: sends samples to the controller and takes its forces. Imports nothing of haploop."""

import select
import time

import msgpack
import zmq
from sockets import VERSION, pack

HELLO, SAMPLES, COMMANDS, LAST = range(20, 24)
SAY_MS = 200


class SeatError(Exception):
    """A failure described in a sentence, which is reported to the clock as its reason."""


class Loop:
    """A ROUTER that recognises the controller by the run's secret; calls `idle` while the controller is silent."""

    def __init__(self, sockets, secret, idle):
        self._socket, self._secret, self._idle = sockets.open(zmq.ROUTER), secret, idle
        self._socket.router_mandatory = True
        self._socket.sndhwm = self._socket.rcvhwm = 0  # a plant that owns the time keeps sending while answers are late
        self.address, self._partner = sockets.bind(self._socket, "loop"), None

    def greet(self):
        """Awaits the controller's HELLO, and answers it."""
        while self._partner is None:
            sender, frame = self._hear()
            if frame == [VERSION, HELLO, self._secret]:
                self._partner = sender
                self.send(HELLO, self._secret)

    def ready_by(self, when):
        """Waits for a message until ``when``, s of time.monotonic(), to less than a ms; tells whether there is one."""
        while not self._socket.getsockopt(zmq.EVENTS) & zmq.POLLIN:
            if (left := when - time.monotonic()) <= 0.0:
                return False
            select.select([self._socket], [], [], left)
        return True

    def send(self, *message):
        try:
            self._socket.send_multipart([self._partner, pack(*message)])
        except zmq.ZMQError:  # the controller is gone; the clock notices this, too
            self._idle()

    def answer(self, tick):
        """Returns the force that answers the sample of a tick, N; None for a message from a stranger."""
        sender, frame = self._hear()
        if sender != self._partner:
            return None
        match frame:
            case [int() as version, int() as code, int() as of, [int() | float() as force]]:
                if (version, code, of) == (VERSION, COMMANDS, tick):
                    return float(force)
        raise SeatError(f"A command of tick {tick} was expected from the controller, but {str(frame)[:80]} came.")

    def _hear(self):
        while not self._socket.poll(SAY_MS):
            self._idle()
        sender, *frames = self._socket.recv_multipart()
        try:
            return sender, msgpack.unpackb(frames[-1])
        except Exception:  # anything may come from a stranger
            return sender, None
