"""A plant's seat in a run: all of protocol/README.md that a device in Python needs. Imports nothing of haploop.

A device is a function from the force held over a plant step, N, to position and velocity after it, m and m/s:

    seat = take_seat("my device", "1.0")
    seat.run(step, x, v)
"""

import json
import math
import os
import sys
import threading
import time
from array import array
from bisect import bisect_right
from collections import deque

import msgpack
import zmq

VERSION = 1
JOIN, WELCOME, REFUSED, READY, GRANT, PROGRESS, WAITING, ENDED, DONE, FAILED, ABORT = range(1, 12)
HELLO, SAMPLES, COMMANDS, LAST = range(20, 24)
STATE, PLANT_BLOCK, END = 30, 31, 34
# What of a scene is not the plant's, or needs no more of it than one force in and one position out.
KNOWN = {"title", "duration", "seed", "diverged_beyond", "clock", "device", "hand", "encoder", "run"}
KNOWN |= {"wall", "velocity", "acceleration", "dissipation", "event"}
DELAY = "clock.round_trip_delay"
BLOCK_S, SAY_MS = 0.01, 200


class SeatError(Exception):
    """What is wrong, in a sentence; reported to the clock as the reason of the failure."""


def take_seat(name, version):
    """Starts as a node of a run is started, joins it, and returns the seat.

    The last argument is the directory for sockets and stdin brings a line of JSON: address, secret, transport, cores.
    """
    directory, start = sys.argv.pop(), json.loads(sys.stdin.readline())
    threading.Thread(target=_end_with_launcher, daemon=True).start()
    if start.get("cores"):
        os.sched_setaffinity(0, start["cores"])
    return Seat(directory, start, {"name": name, "version": version, "command": " ".join(sys.argv)})


def _end_with_launcher():
    sys.stdin.read()
    os._exit(1)


class Seat:
    """The plant of a run, but for its device.

    Attributes:
        scene: the resolved scene, tables as dicts, SI units.
        step_s: the plant step h, s.
    """

    def __init__(self, directory, start, program):
        self._context, self._program = zmq.Context(), program
        self._clock = self._socket(zmq.DEALER)
        self._clock.connect(start["address"])
        self._loop, self._telemetry = self._socket(zmq.ROUTER), self._socket(zmq.XPUB)
        self._loop.router_mandatory, self._telemetry.xpub_verbose, self._telemetry.sndhwm = True, True, 256
        endpoints = {"loop": f"ipc://{directory}/loop.sock", "telemetry": f"ipc://{directory}/plant.sock"}
        self._loop.bind(endpoints["loop"])
        self._telemetry.bind(endpoints["telemetry"])
        self._until, self._last, self._events, self._secret = 0, False, [], start["secret"]
        self._say(JOIN, "plant", self._secret, os.getpid(), endpoints, True)
        _, self.scene, timebase, _, _, self._told = self._welcome()
        self._ticks, self._delay = timebase["ticks"], timebase["delay_steps"]
        self._n, self.step_s = timebase["plant_rate"] // timebase["control_rate"], 1.0 / timebase["plant_rate"]

    def _socket(self, kind):
        socket = self._context.socket(kind)
        socket.linger = 1000
        return socket

    # The clock

    def _say(self, code, *fields):
        self._clock.send(msgpack.packb([VERSION, code, *fields]))

    def _welcome(self):
        while True:
            if not self._clock.poll(20_000):
                raise SystemExit("The clock did not answer within 20 s.")
            _, code, *fields = msgpack.unpackb(self._clock.recv(), strict_map_key=False)
            if code == WELCOME:
                return fields
            if code in (REFUSED, ABORT):
                raise SystemExit(fields[0])

    def _listen(self, wait_ms=0):
        """Takes what the clock has sent, waits for the first message for at most so long; tells whether any came."""
        heard = False
        while self._clock.poll(wait_ms):
            _, code, *fields = msgpack.unpackb(self._clock.recv(), strict_map_key=False)
            if code == GRANT:
                until, self._last, events = fields
                self._until = max(self._until, until)
                self._events += [(tick, event["set"][DELAY]) for tick, event in events if DELAY in event.get("set", {})]
            elif code == ABORT:
                raise SystemExit(fields[0])
            wait_ms, heard = 0, True
        return heard

    def _await_grant(self):
        if self._tick >= self._until and not self._last:
            self._say(PROGRESS, self._tick, {})
        while self._tick >= self._until and not self._last:
            if not self._listen(SAY_MS if self._tick == self._first else int(BLOCK_S * 1000)):
                self._flush()
                self._idle("clock")

    def _idle(self, on):
        self._say(WAITING, self._tick, on)
        self._listen()

    # The run

    def run(self, step, x, v):
        """Goes through the run with a device at x, v (m, m/s) and reports to the clock how that ended."""
        try:
            if asked := _beyond(self.scene):
                raise SeatError(f"This plant has one force in and one position out, but no {asked}; leave it out.")
            self._work(step, float(x), float(v))
        except Exception as error:
            self._say(FAILED, -1, str(error) if isinstance(error, SeatError) else f"{type(error).__name__}: {error}")
            self._context.destroy(linger=1000)
            raise SystemExit(1) from error
        self._say(DONE, self._tick, {})
        self._context.destroy(linger=1000)

    def _work(self, step, x, v):
        self._tick, self._x, self._v, self._force, self._command = 0, x, v, 0.0, -1
        self._begin_block()
        self._greet()
        self._serve_first()
        self._say(READY, 0)
        coming, reason = deque(), ""  # (step of effect, force, tick) of the commands on their way
        while not reason:
            self._await_grant()
            if self._tick >= self._until:
                break
            tick, effect = self._tick, self._tick * self._n + self._delay_at(self._tick)
            force = self._exchange(tick, self._measured())
            while coming and coming[-1][0] > effect:
                coming.pop()
            coming.append((effect, force, tick))
            reason = self._interval(step, coming)
            if self._tick - self._first >= self.scene["run"]["block_ticks"] or time.monotonic() - self._began > BLOCK_S:
                self._flush()
                self._listen()
        self._send(LAST, self._tick)
        self._flush()
        self._publish(END, self._tick, reason, None)
        if reason:
            self._say(ENDED, self._tick, reason)

    def _delay_at(self, tick):
        while self._events and self._events[0][0] <= tick:
            self._delay = round(self._events.pop(0)[1] / self.step_s)
        return self._delay

    def _measured(self):
        if not (encoder := self.scene.get("encoder")):
            return self._x
        whole = round if encoder["rounding"] == "nearest" else math.floor
        return encoder["resolution"] * whole(self._x / encoder["resolution"])

    def _interval(self, step, coming):
        """Moves the device from this tick to the next; returns why the run has to end there, "" where it need not."""
        limit, at = self.scene["diverged_beyond"], self._tick * self._n
        for effect, force, command in coming:
            if effect < at + self._n and not math.isfinite(force):
                return f"command {command} was {force}, which no device can apply, at tick {self._tick}"
        for now in range(at, at + self._n):
            while coming and coming[0][0] <= now:
                _, self._force, self._command = coming.popleft()
            self._note()
            self._x, self._v = step(self._force)
        self._tick += 1
        if -limit <= self._x <= limit:
            return ""
        return f"the device was at {self._x:g} m, beyond the limit of {limit:g} m, at tick {self._tick}"

    # The controller

    def _greet(self):
        self._partner = None
        while self._partner is None:
            sender, frame = self._hear()
            if frame == [VERSION, HELLO, self._secret]:
                self._partner = sender
                self._send(HELLO, self._secret)

    def _hear(self):
        while not self._loop.poll(SAY_MS):
            self._idle("controller")
        sender, *frames = self._loop.recv_multipart()
        try:
            return sender, msgpack.unpackb(frames[0])
        except ValueError:
            return sender, None

    def _send(self, *message):
        try:
            self._loop.send_multipart([self._partner, msgpack.packb([VERSION, *message])])
        except zmq.ZMQError:  # the controller has gone, which the clock sees too
            self._idle("controller")

    def _exchange(self, tick, measured):
        self._send(SAMPLES, tick, [[measured]])
        sender, frame = self._hear()
        while sender != self._partner:
            sender, frame = self._hear()
        if not (isinstance(frame, list) and frame[:3] == [VERSION, COMMANDS, tick] and len(frame[3]) == 1):
            raise SeatError(f"A command of tick {tick} was expected of the controller, but {str(frame)[:80]} came.")
        return float(frame[3][0])

    # Telemetry

    def _publish(self, *message):
        self._telemetry.send_multipart([b"plant", msgpack.packb([VERSION, *message])])

    def _serve(self):
        """Answers new subscriptions with the present state; only between two blocks."""
        asked = False
        while self._telemetry.poll(0):
            request = self._telemetry.recv()
            asked |= request[:1] == b"\x01" and b"plant".startswith(request[1:])
        if asked:
            names = ("tick", "x", "v", "force", "command")
            state = self._tick, self._x, self._v, self._force, self._command
            self._publish(STATE, self._tick, dict(zip(names, state, strict=True)))
        return asked

    def _serve_first(self):
        while not self._serve():
            self._telemetry.poll(SAY_MS)
            self._idle("logger")

    def _begin_block(self):
        self._first, self._began = self._tick, time.monotonic()
        self._rows = {name: array("d") for name in ("x", "v", "force", "command")}

    def _note(self):
        rows, state = self._rows, (self._x, self._v, self._force, self._command)
        for column, value in zip(rows.values(), state, strict=True):
            column.append(value)

    def _flush(self):
        """Publishes the steps since the last block and the state at their end, and reports the progress."""
        if ticks := self._tick - self._first:
            self._note()
            columns = {name: column.tobytes() for name, column in self._rows.items()}
            self._publish(PLANT_BLOCK, self._first, ticks, columns | {"x_low": bytes(len(columns["x"]))})
            self._say(PROGRESS, self._tick, {})
        self._begin_block()
        self._serve()


def _beyond(scene):
    """Returns the first key of a scene that asks for more than this seat has, None where none does."""
    if extra := sorted(scene.keys() - KNOWN):
        return extra[0]
    if "grip" in (scene.get("hand") or {}):
        return "hand.grip"
    by_sensor = (scene.get("acceleration") or {}).get("source") == "accelerometer"
    return "accelerometer" if by_sensor or (scene.get("velocity") or {}).get("accelerometer") else None


def hand_force(scene):
    """Returns the force of the hand's muscles, N, as a function of the time in s, as [hand.force] of a scene has it."""
    table = (scene.get("hand") or {}).get("force") or {"kind": "constant", "value": 0.0}
    kind, value = table["kind"], table.get("value", 0.0)
    if kind == "constant":
        return lambda t: value
    if kind == "step":
        return lambda t: value if t >= table["at"] else 0.0
    if kind == "ramp":
        return lambda t: value * min(t / table["rise_time"], 1.0)
    if kind == "minimum-jerk":
        return lambda t: value * _minimum_jerk(min(t / table["rise_time"], 1.0))
    if kind == "sine":
        turn, phase = 2 * math.pi * table["frequency"], table.get("phase", 0.0)
        return lambda t: table.get("offset", 0.0) + table["amplitude"] * math.sin(turn * t + phase)
    if kind == "trace":
        times, forces = table["time"], table["force"]
        return lambda t: _between(t, times, forces)
    raise SeatError(f"A hand's force of kind {kind!r} is not known here.")


def _minimum_jerk(s):
    return s**3 * (10.0 + s * (6.0 * s - 15.0))


def _between(t, times, forces):
    after = bisect_right(times, t)
    if after in (0, len(times)):
        return forces[min(after, len(times) - 1)]
    share = (t - times[after - 1]) / (times[after] - times[after - 1])
    return forces[after - 1] + share * (forces[after] - forces[after - 1])
