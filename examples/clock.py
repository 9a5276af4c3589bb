"""A plant's conversation with the clock of a run: joins, receives grants, reports. Imports nothing of haploop."""

import math
import os
import time

import msgpack
import zmq
from sockets import pack

JOIN, WELCOME, REFUSED, READY, GRANT, PROGRESS, WAITING, ENDED, DONE, FAILED, ABORT = range(1, 12)
DELAY = "clock.round_trip_delay"


class Clock:
    """The ticks granted so far, and the delays set during the run, [tick, s] each."""

    def __init__(self, sockets, address):
        self._socket = sockets.open(zmq.DEALER)
        self._socket.sndtimeo = 20_000  # a socket that the clock's keys reject is connected to nothing
        sockets.connect(self._socket, address)
        self.until, self.last, self.delays = 0, False, []
        self._heard, self._silence_s = time.monotonic(), math.inf

    def say(self, code, *fields):
        self._socket.send(pack(code, *fields))

    def join(self, secret, endpoints, program):
        """Asks to take part; returns the fields of WELCOME."""
        self.say(JOIN, "plant", secret, os.getpid(), endpoints, True, program)
        while True:
            if not self._socket.poll(20_000):
                raise SystemExit("The clock did not answer within 20 s.")
            _, code, *fields = msgpack.unpackb(self._socket.recv(), strict_map_key=False)
            if code == WELCOME:
                self._heard = time.monotonic()
                return fields
            if code in (REFUSED, ABORT):
                raise SystemExit(fields[0])

    def give_up_after(self, silence_s):
        """Makes this process end after such a silence of the clock, for runs in which no end of stdin would show it."""
        self._silence_s = silence_s

    def listen(self, wait_ms=0):
        """Takes the messages of the clock, waiting at most ``wait_ms`` for the first; tells whether any came."""
        heard = False
        while self._socket.poll(wait_ms):
            _, code, *fields = msgpack.unpackb(self._socket.recv(), strict_map_key=False)
            if code == GRANT:
                until, self.last, events = fields
                self.until = max(self.until, until)
                self.delays += [(tick, event["set"][DELAY]) for tick, event in events if DELAY in event.get("set", {})]
            elif code == ABORT:
                raise SystemExit(fields[0])
            wait_ms, heard, self._heard = 0, True, time.monotonic()
        return heard

    def wait(self, tick, on):
        """Reports that this node is alive and waits for another; takes what the clock has sent."""
        self.say(WAITING, tick, on)
        self.listen()
        if time.monotonic() - self._heard > self._silence_s:
            raise SystemExit(f"Nothing was heard from the clock for {self._silence_s:g} s; is the run still there?")
