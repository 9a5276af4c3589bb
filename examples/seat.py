"""A plant's seat in a run: everything in protocol/README.md that a device in Python needs. Imports nothing of haploop.

A device is a function from the force held over a plant step, N, to position and velocity after it, m and m/s:

    seat = take_seat("my device", "1.0")
    seat.run(step, x, v)
"""

import gc
import json
import math
import os
import sys
import threading
from collections import deque
from pathlib import Path

import zmq
from clock import DONE, ENDED, FAILED, PROGRESS, READY, Clock
from loop import LAST, SAMPLES, SAY_MS, Loop, SeatError
from schedule import Schedule
from sockets import Sockets
from telemetry import BLOCK_S, LONG_BLOCK_S, Telemetry

# Tables of a scene that do not concern the plant, or that need no more than one force in and one position out.
KNOWN = {"title", "duration", "seed", "diverged_beyond", "clock", "device", "hand", "encoder", "run"}
KNOWN |= {"wall", "velocity", "acceleration", "dissipation", "event"}
# A controller that has not answered for this long, s, no longer commands a device.
PATIENCE_S = 1.0


def take_seat(name, version):
    """Joins the run as the node that this process was started as, and returns the seat.

    The last word of the command line is the directory for sockets, with a line of JSON on stdin (--node); or it is the
    file external-plant.json that a run with --external plant has written.
    """
    if len(sys.argv) < 2:
        raise SystemExit(f'Start this program by: haploop run SCENE --node plant="python {sys.argv[0]} ..."')
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
    seat.hold_nothing()
    os._exit(1)


class Seat:
    """The plant of a run, without its device.

    Attributes:
        scene: the resolved scene, tables as dicts, SI units.
        step_s: the plant step h, s.
    """

    def __init__(self, directory, start, program, is_external):
        self._sockets, self._device_holds = Sockets(directory, start["transport"]), lambda force: None
        self._holding = threading.Lock()
        self._clock = Clock(self._sockets, start["address"])
        self._loop = Loop(self._sockets, start["secret"], lambda: self._clock.wait(self._tick, "controller"))
        self._publisher = self._sockets.open(zmq.XPUB)
        self._publisher.xpub_verbose, self._publisher.sndhwm = True, 256
        endpoints = {
            "loop": self._loop.address,
            "telemetry": self._sockets.bind(self._publisher, "plant"),
        }
        _, self.scene, timebase, _, _, self._told = self._clock.join(start["secret"], endpoints, program)
        if is_external:
            self._clock.give_up_after(self.scene["run"]["deadline"])
        self._delay = timebase["delay_steps"]
        self._n, self.step_s = timebase["plant_rate"] // timebase["control_rate"], 1.0 / timebase["plant_rate"]

    def _await_grant(self):
        if self._tick < self._clock.until or self._clock.last:
            return
        self._clock.say(PROGRESS, self._tick, {})
        if self._owns_time and self._tick:
            self._clock.listen()
            if self._tick >= self._clock.until and not self._clock.last:
                raise SeatError(f"Tick {self._tick} was not granted in time; set run.window_blocks to more.")
        while self._tick >= self._clock.until and not self._clock.last:
            if not self._clock.listen(SAY_MS if self._tick == self._telemetry.first else int(BLOCK_S * 1000)):
                self._flush()
                self._clock.wait(self._tick, "clock")

    def hold_nothing(self):
        """Gives the device no force from now on, whatever the thread of the run still computes."""
        self._holding.acquire()  # and never released
        self._device_holds(0.0)

    def _hold(self, force):
        with self._holding:
            self._device_holds(force)

    # The run

    def run(self, step, x, v, hold=lambda force: None):
        """Runs to the end with a device that starts at x, v (m, m/s), and reports to the clock how the run ended.

        Args:
            hold: called at every tick of a run whose plant owns the time, with the force from now on, N; and with 0
                at the end, however the run ends.
        """
        self._device_holds = hold
        try:
            if asked := _beyond(self.scene):
                raise SeatError(f"This plant has one force in and one position out, but no {asked}; leave it out.")
            try:
                self._work(step, float(x), float(v))
            finally:
                self._hold(0.0)  # first of all
        except Exception as error:
            self.fail(str(error) if isinstance(error, SeatError) else f"{type(error).__name__}: {error}")
        self._clock.say(DONE, self._tick, {"lateness": self._schedule.figures()} if self._owns_time else {})
        self._sockets.close()

    def fail(self, why):
        """Reports to the clock why the run cannot continue, and ends this process."""
        self._clock.say(FAILED, -1, why)
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
        self._loop.greet()
        self._serve_first()
        self._clock.say(READY, 0)
        gc.freeze()
        reason = ""
        while not reason:
            self._await_grant()
            if self._tick >= self._clock.until:
                break
            self._sample()
            reason = self._unusable() or (self._tick_in_time() if self._owns_time else self._await_answer())
            reason = reason or self._interval(step)
            if self._telemetry.is_due():
                self._flush()
                self._clock.listen()
        if self._owns_time:  # answers that were due before the end and have not come
            for tick in range(self._answered, self._tick - self._delay // self._n):
                self._schedule.answered(tick, True)
        self._loop.send(LAST, self._tick)
        self._flush()
        self._telemetry.end(self._tick, reason)
        if reason:
            self._clock.say(ENDED, self._tick, reason)

    def _delay_at(self, tick):
        while self._clock.delays and self._clock.delays[0][0] <= tick:
            self._delay = round(self._clock.delays.pop(0)[1] / self.step_s)
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
        """Holds the command that takes effect at a plant step; if its answer has not come, the safe force, 0."""
        while self._coming and self._coming[0][0] <= now:
            _, force, command = self._coming.popleft()
            self._force, self._command = (0.0, -1) if force is None else (force, command)

    def _interval(self, step):
        """Moves the device from this tick to the next; returns why the run has to end there, or "" if it need not."""
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
        while self._loop.ready_by(0.0):
            self._take_answer()
        if self._tick - self._answered > PATIENCE_S / (self._n * self.step_s):
            return f"the controller had not answered for {PATIENCE_S:g} s, at tick {self._tick}"
        if reason := self._unusable():
            return reason
        self._take_due(self._tick * self._n)
        self._hold(self._force)
        while self._loop.ready_by(self._schedule.due(self._tick + 1)):
            self._take_answer()
        return ""

    # The controller

    def _sample(self):
        tick, effect = self._tick, self._tick * self._n + self._delay_at(self._tick)
        while self._coming and self._coming[-1][0] > effect:
            self._coming.pop()
        self._coming.append([effect, None, tick])
        self._loop.send(SAMPLES, tick, [[self._measured()]])

    def _await_answer(self):
        while self._answered <= self._tick:
            self._take_answer()
        return self._unusable()

    def _take_answer(self):
        tick = self._answered
        force = self._loop.answer(tick)
        if force is None:  # a stranger's
            return
        self._answered += 1
        awaited = [command for command in self._coming if command[2] == tick]
        if awaited:
            awaited[0][1] = force
        if self._owns_time:
            self._schedule.answered(tick, not awaited)

    # Telemetry

    def _state(self):
        return self._tick, self._x, self._v, self._force, self._command

    def _serve_first(self):
        while not self._telemetry.serve(SAY_MS):
            self._clock.wait(self._tick, "logger")

    def _flush(self):
        """Publishes the steps since the last block, and reports them to the clock."""
        if self._telemetry.flush():
            status = {"lateness": self._schedule.figures()} if self._owns_time and self._schedule.says_so() else {}
            self._clock.say(PROGRESS, self._tick, status)


def _beyond(scene):
    """Returns the first key of a scene that needs more than this seat offers, None if there is none."""
    if extra := sorted(scene.keys() - KNOWN):
        return extra[0]
    if "grip" in (scene.get("hand") or {}):
        return "hand.grip"
    by_sensor = (scene.get("acceleration") or {}).get("source") == "accelerometer"
    return "accelerometer" if by_sensor or (scene.get("velocity") or {}).get("accelerometer") else None
