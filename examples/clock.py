"""A plant's conversation with the clock of a run: joins, hears what is granted, reports. Imports nothing of haploop."""

import math
import os
import time

import msgpack
import zmq
from sockets import pack

JOIN, WELCOME, REFUSED, READY, GRANT, PROGRESS, WAITING, ENDED, DONE, FAILED, ABORT = range(1, 12)
DELAY = "clock.round_trip_delay"


class Clock:
    """What is granted so far, and the delays set on the way, [tick, s] each."""

    def __init__(self, sockets, address):
        self._socket = sockets.open(zmq.DEALER)
        self._socket.sndtimeo = 20_000  # one that the clock's keys turn away is connected to nothing
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
        """Has this process end when nothing was heard of the clock for so long, where no end of stdin would tell."""
        self._silence_s = silence_s

    def listen(self, wait_ms=0):
        """Takes what the clock has sent, waits for the first message for at most so long; tells whether any came."""
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
        """Says that this is alive and waits for another."""
        self.say(WAITING, tick, on)
        self.listen()
        if time.monotonic() - self._heard > self._silence_s:
            raise SystemExit(f"Nothing was heard of the clock for {self._silence_s:g} s; is the run still there?")
