"""A controller written from protocol/README.md alone: it imports nothing of haploop.

usage: plain_controller.py [--seat FILE] [--nameless] [--changes make|refuse] [--misbehave HOW --at TICK] [DIRECTORY]

Takes the controller's place in a run: a wall and one element of unidirectional inertia in contact (Choi et al. 2022,
eq. 9 and 12), both derivatives as backward differences. When haploop starts it, stdin holds a line of JSON; --seat
names the file of a run that waits for it instead.
--nameless: JOIN ends before the map that says what joins, as in the first version of the protocol's page.
--changes: what it does with a set of the wall's stiffness; without this option, it ignores every change silently.
--misbehave: from that tick on: die, exit, hang, silent (stops answering, but reports), nan, text (a force
  that is not a number), garbage (bytes in place of forces), mute (no telemetry), cut (a telemetry column
  too short), unfinished (no END).
"""

import argparse
import json
import math
import os
import signal
import struct
import sys
import threading
from pathlib import Path

import msgpack
import zmq

VERSION = 1
JOIN, WELCOME, REFUSED, READY, GRANT, PROGRESS, WAITING, DONE, FAILED, ABORT = 1, 2, 3, 4, 5, 6, 7, 9, 10, 11
HELLO, SAMPLES, COMMANDS, LAST = 20, 21, 22, 23
STATE, CONTROLLER_BLOCK, END = 30, 32, 34
COLUMNS = ("x", "v", "a", "wall", "dissipation.0", "total", "in_contact")
BLOCK = 100
_pack = msgpack.Packer(autoreset=True).pack


class Law:
    """f = k (x_w - x) inside the wall, and -m a[k] there where v[k] a[k-1] >= 0."""

    def __init__(self, scene, period):
        self.period = period
        self.position, self.stiffness = scene["wall"]["position"], scene["wall"]["stiffness"]
        (self.element,) = scene["dissipation"]
        self.x = self.v = self.a = None

    def force(self, x):
        before, a_before = (x, 0.0) if self.x is None else (self.x, self.a)
        v = (x - before) / self.period
        a = (v - (0.0 if self.v is None else self.v)) / self.period
        out = self.position - x
        contact = out > 0.0
        wall = self.stiffness * out if contact else 0.0
        inertia = -self.element["mass"] * a if contact and v * a_before >= 0.0 else 0.0
        self.x, self.v, self.a = x, v, a
        return x, v, a, wall, inertia, wall + inertia, float(contact)


class Controller:
    def __init__(self, start, options):
        self.options, self.context = options, zmq.Context()
        self.clock = self.socket(zmq.DEALER)
        self.clock.connect(start["address"])
        self.telemetry = self.socket(zmq.XPUB)
        self.telemetry.setsockopt(zmq.XPUB_VERBOSE, 1)
        address = f"ipc://{start['directory']}/controller.sock"
        self.telemetry.bind(address)
        program = {"name": "plain controller", "version": "1.5", "command": " ".join(sys.argv)}
        told = [] if options.nameless else [program]
        self.say(JOIN, "controller", start["secret"], os.getpid(), {"telemetry": address}, True, *told)
        self.until, self.last, self.events, self.rows, self.first = 0, False, [], [], 0
        self.history, self.refused = [], []
        _, self.scene, timebase, endpoints, _, told = self.welcome()
        self.law = Law(self.scene, 1.0 / timebase["control_rate"])
        self.plant = self.socket(zmq.DEALER)
        self.plant.connect(endpoints["plant"]["loop"])
        self.plant.send(_pack([VERSION, HELLO, told["secret"]]))

    def socket(self, kind):
        socket = self.context.socket(kind)
        socket.linger = 1000
        return socket

    def say(self, code, *fields):
        self.clock.send(_pack([VERSION, code, *fields]))

    def welcome(self):
        _, code, *fields = msgpack.unpackb(self.clock.recv(), strict_map_key=False)
        if code != WELCOME:
            raise SystemExit(f"not let in: {fields}")
        return fields

    def listen(self, wait_ms=0):
        while self.clock.poll(wait_ms):
            _, code, *fields = msgpack.unpackb(self.clock.recv(), strict_map_key=False)
            wait_ms = 0
            if code == GRANT:
                until, self.last, events = fields
                self.until = max(self.until, until)
                self.events += [(tick, event) for tick, event in events if "set" in event or "swap" in event]
            elif code == ABORT:
                raise SystemExit(f"aborted: {fields[0]}")

    def serve(self, wait_ms=0):
        """Answers new subscriptions; to be called only between two blocks. Tells whether there was one."""
        asked = False
        while self.telemetry.poll(wait_ms):
            request, wait_ms = self.telemetry.recv(), 0
            asked |= request[:1] == b"\x01" and b"controller".startswith(request[1:])
        if asked:
            self.publish(STATE, self.first, {"history": self.history})
        return asked

    def publish(self, *message):
        self.telemetry.send_multipart([b"controller", _pack([VERSION, *message])])

    def begin(self):
        while not self.plant.poll(200):
            self.say(WAITING, 0, "plant")
        assert msgpack.unpackb(self.plant.recv())[1] == HELLO
        while not self.serve(200):
            self.say(WAITING, 0, "logger")
        self.say(READY, 0)

    def flush(self):
        how = self.misbehaving(self.tick)
        if self.rows and how != "mute":
            columns = {
                name: struct.pack(f"<{len(self.rows)}d", *c)
                for name, c in zip(COLUMNS, zip(*self.rows, strict=True), strict=True)
            }
            if how == "cut":
                columns["wall"] = columns["wall"][:-8]
            law, element = self.law, self.law.element
            parameters = {"mass": element["mass"], "acts": element["acts"]}
            elements = [{"book": 0, "kind": element["kind"], "parameters": parameters, "from_tick": 0}]
            wall = {"position": law.position, "stiffness": law.stiffness, "into_wall": -1.0}
            block = {
                "from_tick": self.first,
                "ticks": len(self.rows),
                "columns": columns,
                "elements": elements,
                "wall": wall,
            }
            self.publish(CONTROLLER_BLOCK, *block.values())
            self.history = [*self.history[-3:], block]
        self.first, self.rows = self.tick, []
        refused, self.refused = self.refused, []
        keys = {"refused": [why for why, _ in refused], "refused_changes": [change for _, change in refused]}
        self.say(PROGRESS, self.tick, keys if refused else {})
        self.serve()

    def misbehaving(self, tick):
        return self.options.misbehave if tick >= self.options.at else None

    def run(self):
        self.tick = 0
        self.begin()
        while True:
            while not self.plant.poll(20):
                if self.rows:
                    self.flush()
                self.say(WAITING, self.tick, "plant")
                self.listen()
                self.serve()
            _, code, tick, *rest = msgpack.unpackb(self.plant.recv())
            if code == LAST:
                break
            (samples,) = rest
            while self.until < tick + len(samples):
                self.listen(200)
            self.answer(tick, [sample[0] for sample in samples])
            if len(self.rows) >= BLOCK:
                self.flush()
                self.listen()
        self.flush()
        if self.misbehaving(self.tick) != "unfinished":
            self.publish(END, self.tick, "", None)
        self.say(DONE, self.tick, {})

    def answer(self, tick, samples):
        forces = []
        for x in samples:
            while self.events and self.events[0][0] <= self.tick:
                self.change(*self.events.pop(0))
            self.rows.append(self.law.force(x))
            forces.append(self.rows[-1][5])
            self.tick += 1
        how = self.misbehaving(self.tick)
        if how == "die":
            os.kill(os.getpid(), signal.SIGKILL)
        elif how == "exit":
            os._exit(3)
        elif how == "hang":
            threading.Event().wait()
        elif how == "silent":
            while True:
                self.say(WAITING, tick, "plant")
                self.listen(200)
        forces = {"nan": [math.nan] * len(forces), "text": ["1.0"] * len(forces)}.get(how or "", forces)
        frame = _pack([VERSION, COMMANDS, tick, forces])
        self.plant.send(b"\xc1\xff\x00garbage" if how == "garbage" else frame)

    def change(self, tick, event):
        if self.options.changes == "refuse":
            self.refused.append((f"This controller changes nothing at tick {tick}.", {"tick": tick, **event}))
        elif self.options.changes == "make" and "wall.stiffness" in event.get("set", {}):
            self.flush()
            self.law.stiffness = event["set"]["wall.stiffness"]


def end_with_launcher():
    sys.stdin.read()
    os._exit(1)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("directory", nargs="?")
    parser.add_argument("--seat", type=Path)
    parser.add_argument("--nameless", action="store_true")
    parser.add_argument("--changes", choices=["make", "refuse"])
    parser.add_argument("--misbehave")
    parser.add_argument("--at", type=int, default=500)
    options = parser.parse_args()
    if options.seat:
        signal.alarm(120)  # so that it is never left behind
        start = json.loads(options.seat.read_text(encoding="utf-8"))
    else:
        start = {**json.loads(sys.stdin.readline()), "directory": options.directory}
        threading.Thread(target=end_with_launcher, daemon=True).start()
    controller = Controller(start, options)
    controller.run()
    controller.context.destroy(linger=1000)


if __name__ == "__main__":
    main()
