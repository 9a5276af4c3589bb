"""A plant's seat in a run: all of protocol/README.md that a device in Python needs. Imports nothing of haploop.

A device is a function from the force held over a plant step, N, to position and velocity after it, m and m/s:

    seat = take_seat("my device", "1.0")
    seat.run(step, x, v)
"""

import gc
import json
import math
import os
import select
import sys
import threading
import time
from collections import deque
from pathlib import Path

import msgpack
import zmq
from schedule import Schedule
from sockets import VERSION, Sockets, pack
from telemetry import BLOCK_S, LONG_BLOCK_S, Telemetry

JOIN, WELCOME, REFUSED, READY, GRANT, PROGRESS, WAITING, ENDED, DONE, FAILED, ABORT = range(1, 12)
HELLO, SAMPLES, COMMANDS, LAST = range(20, 24)
# What of a scene is not the plant's, or needs no more of it than one force in and one position out.
KNOWN = {"title", "duration", "seed", "diverged_beyond", "clock", "device", "hand", "encoder", "run"}
KNOWN |= {"wall", "velocity", "acceleration", "dissipation", "event"}
DELAY = "clock.round_trip_delay"
SAY_MS = 200
# A controller that has not answered for so long does not lead a device any more.
PATIENCE_S = 1.0


class SeatError(Exception):
    """What is wrong, in a sentence; reported to the clock as the reason of the failure."""


def take_seat(name, version):
    """Starts as a node of a run is started, joins it, and returns the seat.

    The last argument is the directory for sockets, and stdin brings a line of JSON (--node); or it is the file
    external-plant.json that a run with --external plant has written.
    """
    if len(sys.argv) < 2:
        raise SystemExit(f'This is started by: haploop run SCENE --node plant="python {sys.argv[0]} ..."')
    last = sys.argv.pop()
    is_external = last.endswith(".json")
    start = json.loads(Path(last).read_text(encoding="utf-8") if is_external else sys.stdin.readline())
    program = {"name": name[:200], "version": version, "command": " ".join(sys.argv)[:200]}
    seat = Seat(start["directory"] if is_external else last, start, program, is_external)
    if not is_external:
        threading.Thread(target=_end_with_launcher, args=(seat,), daemon=True).start()
    return seat


def _end_with_launcher(seat):
    sys.stdin.read()
    seat.hold(0.0)
    os._exit(1)


class Seat:
    """The plant of a run, but for its device.

    Attributes:
        scene: the resolved scene, tables as dicts, SI units.
        step_s: the plant step h, s.
    """

    def __init__(self, directory, start, program, is_external):
        self._sockets, self.hold = Sockets(directory, start["transport"]), lambda force: None
        self._clock = self._sockets.open(zmq.DEALER)
        self._sockets.connect(self._clock, start["address"])
        self._loop, self._publisher = self._sockets.open(zmq.ROUTER), self._sockets.open(zmq.XPUB)
        self._loop.router_mandatory, self._publisher.xpub_verbose, self._publisher.sndhwm = True, True, 256
        self._loop.sndhwm = self._loop.rcvhwm = 0  # a plant that owns the time sends on while answers are late
        endpoints = {
            "loop": self._sockets.bind(self._loop, "loop"),
            "telemetry": self._sockets.bind(self._publisher, "plant"),
        }
        self._until, self._last, self._events, self._secret = 0, False, [], start["secret"]
        self._say(JOIN, "plant", self._secret, os.getpid(), endpoints, True, program)
        _, self.scene, timebase, _, _, self._told = self._welcome()
        # The end of stdin tells of the end of a run; without it only silence does.
        self._heard, self._silence_s = time.monotonic(), self.scene["run"]["deadline"] if is_external else math.inf
        self._delay = timebase["delay_steps"]
        self._n, self.step_s = timebase["plant_rate"] // timebase["control_rate"], 1.0 / timebase["plant_rate"]

    # The clock

    def _say(self, code, *fields):
        self._clock.send(pack(code, *fields))

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
            wait_ms, heard, self._heard = 0, True, time.monotonic()
        return heard

    def _await_grant(self):
        if self._tick < self._until or self._last:
            return
        self._say(PROGRESS, self._tick, {})
        if self._owns_time and self._tick:
            self._listen()
            if self._tick >= self._until and not self._last:
                raise SeatError(f"Tick {self._tick} was not granted in time; set run.window_blocks to more.")
        while self._tick >= self._until and not self._last:
            if not self._listen(SAY_MS if self._tick == self._telemetry.first else int(BLOCK_S * 1000)):
                self._flush()
                self._idle("clock")

    def _idle(self, on):
        self._say(WAITING, self._tick, on)
        self._listen()
        if time.monotonic() - self._heard > self._silence_s:
            raise SystemExit(f"Nothing was heard of the clock for {self._silence_s:g} s; is the run still there?")

    # The run

    def run(self, step, x, v, hold=lambda force: None):
        """Goes through the run with a device at x, v (m, m/s) and reports to the clock how that ended.

        Args:
            hold: called at every tick of a run whose plant owns the time, with the force from now on, N; and with 0
                at the end, however that comes.
        """
        self.hold = hold
        try:
            if asked := _beyond(self.scene):
                raise SeatError(f"This plant has one force in and one position out, but no {asked}; leave it out.")
            try:
                self._work(step, float(x), float(v))
            finally:
                hold(0.0)  # first of all
        except Exception as error:
            self.fail(str(error) if isinstance(error, SeatError) else f"{type(error).__name__}: {error}")
        self._say(DONE, self._tick, {"lateness": self._schedule.figures()} if self._owns_time else {})
        self._sockets.close()

    def fail(self, why):
        """Tells the clock why there is no going on, and ends this process."""
        self._say(FAILED, -1, why)
        self._sockets.close()
        raise SystemExit(1)

    def _work(self, step, x, v):
        self._tick, self._x, self._v, self._force, self._command = 0, x, v, 0.0, -1
        self._coming, self._answered = deque(), 0  # [step of effect, force or None, tick] of the commands to come
        self._owns_time = self._told.get("clock") == "plant"
        if self._owns_time and (self._delay == 0 or self._delay % self._n):
            raise SeatError("A plant that owns the time needs clock.round_trip_delay of whole control periods, not 0.")
        self._schedule = Schedule(self._n * self.step_s, self._delay * self.step_s)
        block_s = LONG_BLOCK_S if self._owns_time else BLOCK_S
        self._telemetry = Telemetry(self._publisher, self.scene["run"]["block_ticks"], self._state, block_s)
        self._greet()
        self._serve_first()
        self._say(READY, 0)
        gc.freeze()
        reason = ""
        while not reason:
            self._await_grant()
            if self._tick >= self._until:
                break
            self._sample()
            reason = self._unusable() or (self._tick_in_time() if self._owns_time else self._await_answer())
            reason = reason or self._interval(step)
            if self._telemetry.is_due():
                self._flush()
                self._listen()
        self._send(LAST, self._tick)
        self._flush()
        self._telemetry.end(self._tick, reason)
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

    def _unusable(self):
        for effect, force, command in self._coming:
            if effect < (self._tick + 1) * self._n and force is not None and not math.isfinite(force):
                return f"command {command} was {force}, which no device can apply, at tick {self._tick}"
        return ""

    def _take_due(self, now):
        """Holds the command that takes effect at a plant step; where its answer has not come, the safe force, 0."""
        while self._coming and self._coming[0][0] <= now:
            _, force, command = self._coming.popleft()
            self._force, self._command = (0.0, -1) if force is None else (force, command)

    def _interval(self, step):
        """Moves the device from this tick to the next; returns why the run has to end there, "" where it need not."""
        limit, at = self.scene["diverged_beyond"], self._tick * self._n
        for now in range(at, at + self._n):
            self._take_due(now)
            self._telemetry.note()
            self._x, self._v = step(self._force)
        self._tick += 1
        if -limit <= self._x <= limit:
            return ""
        return f"the device was at {self._x:g} m, beyond the limit of {limit:g} m, at tick {self._tick}"

    def _tick_in_time(self):
        """Holds the force of this tick and takes answers until the next is due; returns why the run has to end here."""
        self._schedule.begin(self._tick)
        while self._ready_by(0.0):
            self._take_answer()
        if self._tick - self._answered > PATIENCE_S / (self._n * self.step_s):
            return f"the controller had not answered for {PATIENCE_S:g} s, at tick {self._tick}"
        if reason := self._unusable():
            return reason
        self._take_due(self._tick * self._n)
        self.hold(self._force)
        while self._ready_by(self._schedule.due(self._tick + 1)):
            self._take_answer()
        return ""

    def _ready_by(self, when):
        """Waits for a message of the loop up to a time, to less than a ms; tells whether there is one."""
        while not self._loop.getsockopt(zmq.EVENTS) & zmq.POLLIN:
            if (left := when - time.monotonic()) <= 0.0:
                return False
            select.select([self._loop], [], [], left)
        return True

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
            return sender, msgpack.unpackb(frames[-1])
        except Exception:  # anything may come from a stranger
            return sender, None

    def _send(self, *message):
        try:
            self._loop.send_multipart([self._partner, pack(*message)])
        except zmq.ZMQError:  # the controller has gone, which the clock sees too
            self._idle("controller")

    def _sample(self):
        tick, effect = self._tick, self._tick * self._n + self._delay_at(self._tick)
        while self._coming and self._coming[-1][0] > effect:
            self._coming.pop()
        self._coming.append([effect, None, tick])
        self._send(SAMPLES, tick, [[self._measured()]])

    def _await_answer(self):
        while self._answered <= self._tick:
            self._take_answer()
        return self._unusable()

    def _take_answer(self):
        sender, frame = self._hear()
        if sender != self._partner:
            return
        tick = self._answered
        match frame:
            case [version, code, of, [int() | float() as force]] if [version, code, of] == [VERSION, COMMANDS, tick]:
                pass
            case _:
                raise SeatError(f"A command of tick {tick} was expected of the controller, but {str(frame)[:80]} came.")
        self._answered += 1
        awaited = [command for command in self._coming if command[2] == tick]
        if awaited:
            awaited[0][1] = float(force)
        if self._owns_time:
            self._schedule.answered(tick, not awaited)

    # Telemetry

    def _state(self):
        return self._tick, self._x, self._v, self._force, self._command

    def _serve_first(self):
        while not self._telemetry.serve(SAY_MS):
            self._idle("logger")

    def _flush(self):
        """Publishes what was done since the last block, and reports it to the clock."""
        if self._telemetry.flush():
            status = {"lateness": self._schedule.figures()} if self._owns_time and self._schedule.says_so() else {}
            self._say(PROGRESS, self._tick, status)


def _beyond(scene):
    """Returns the first key of a scene that asks for more than this seat has, None where none does."""
    if extra := sorted(scene.keys() - KNOWN):
        return extra[0]
    if "grip" in (scene.get("hand") or {}):
        return "hand.grip"
    by_sensor = (scene.get("acceleration") or {}).get("source") == "accelerometer"
    return "accelerometer" if by_sensor or (scene.get("velocity") or {}).get("accelerometer") else None
