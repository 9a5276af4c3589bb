"""A node written from protocol/README.md alone: it imports nothing of haploop.

usage: plain_observer.py RUN_JSON [--viewer] [--ticks N] [--dwell]

Attaches to the run that RUN_JSON announces, prints one JSON line when it has the state of plant and controller, reads
on for N ticks or to the end of the run, leaves, and prints a second JSON line with everything it saw.
--viewer: join no clock and report nothing, so that the run does not wait; missed ticks are counted. Whenever everything
  received has been read, a JSON line says how far.
--dwell: after attaching, report and stay, but take no more blocks (for tests that end this process).
"""

import argparse
import base64
import json
import os
import signal
import struct
import time
from pathlib import Path

import msgpack
import zmq

VERSION = 1
JOIN, WELCOME, REFUSED, READY, GRANT, PROGRESS, WAITING, ABORT, LEAVE = 1, 2, 3, 4, 5, 6, 7, 11, 12
STATE, PLANT_BLOCK, CONTROLLER_BLOCK, END = 30, 31, 32, 34
ROLES = ("plant", "controller")


class Stream:
    """One publisher's blocks: checks that ticks follow each other, and counts those that are missing."""

    def __init__(self, context, role, address):
        self.role = role
        self.socket = context.socket(zmq.SUB)
        self.socket.linger = 0
        self.socket.setsockopt(zmq.RCVHWM, 256)
        self.socket.connect(address)
        self.socket.subscribe(role.encode())
        self.tick = -1
        self.state = None
        self.gap_ticks = 0
        self.columns = {}
        self.ended = None

    def take(self, data):
        version, code, tick, *fields = msgpack.unpackb(data, strict_map_key=False)
        assert version == VERSION, version
        if code == STATE:
            if self.state is None:
                self.state, self.tick, self.first = fields[0], tick, tick
        elif self.state is None or tick < self.tick:
            pass  # from before our state
        else:
            self.gap_ticks += tick - self.tick
            if code == END:
                self.tick, self.ended = tick, fields
            else:
                self.block(code, tick, *fields)

    def block(self, code, tick, ticks, columns, *_):
        columns = {name: struct.unpack(f"<{len(column) // 8}d", column) for name, column in columns.items()}
        follows = tick == self.tick
        for name, column in columns.items():
            kept = self.columns.setdefault(name, [])
            if code == PLANT_BLOCK:  # blocks overlap by one state
                if follows and kept and name in ("x", "v"):
                    assert kept[-1] == column[0], f"{name} at tick {tick}: {kept[-1]}, then {column[0]}"
                if follows and kept:
                    del kept[-1]
            else:
                assert len(column) == ticks, f"{ticks} ticks, but {len(column)} rows of {name}"
            kept.extend(column)
        self.tick = tick + ticks


class Clock:
    """The conversation with the clock; a viewer has none."""

    def __init__(self, context, address):
        self.socket = context.socket(zmq.DEALER)
        self.socket.linger = 1000
        self.socket.connect(address)
        self.granted = 0

    def say(self, code, *fields):
        self.socket.send(msgpack.packb([VERSION, code, *fields]))

    def join(self):
        while True:
            self.say(JOIN, "plain observer", "", os.getpid(), {}, True)  # it may leave out who it is
            code, *fields = self.hear()
            if code == WELCOME:
                return dict(zip(("run", "scene", "timebase", "endpoints", "granted", "context"), fields, strict=True))
            assert code == REFUSED, code
            time.sleep(0.05)  # the run has not begun

    def hear(self):
        version, code, *fields = msgpack.unpackb(self.socket.recv(), strict_map_key=False)
        assert version == VERSION, version
        return code, *fields

    def listen(self):
        while self.socket.poll(0):
            code, *fields = self.hear()
            if code == GRANT:
                self.granted = fields[0]
            elif code == ABORT:
                raise SystemExit(f"aborted: {fields[0]}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("run", type=Path)
    parser.add_argument("--viewer", action="store_true")
    parser.add_argument("--dwell", action="store_true")
    parser.add_argument("--ticks", type=int)
    options = parser.parse_args()
    signal.alarm(600)  # so that it is never left behind
    entry = json.loads(options.run.read_text(encoding="utf-8"))
    context = zmq.Context()
    clock = None if options.viewer else Clock(context, entry["clock"])
    if clock:
        endpoints = clock.join()["endpoints"]
        addresses = {role: endpoints[role]["telemetry"] for role in ROLES}
    else:
        addresses = {role: f"ipc://{options.run.parent}/{role}.sock" for role in ROLES}
    streams = [Stream(context, role, addresses[role]) for role in ROLES]
    poller = zmq.Poller()
    for stream in streams:
        poller.register(stream.socket, zmq.POLLIN)
    if clock:
        poller.register(clock.socket, zmq.POLLIN)

    ready, reported, last, quiet = False, -1, None, -1
    while not all(stream.ended for stream in streams):
        heard = dict(poller.poll(200))
        for stream in streams:
            while stream.socket in heard and stream.socket.poll(0) and not (ready and options.dwell):
                stream.take(stream.socket.recv_multipart()[1])
        if clock:
            clock.listen()
        if any(stream.state is None for stream in streams):
            continue
        done = min(stream.tick for stream in streams)
        if not ready:
            ready, last = True, None if options.ticks is None else done + options.ticks
            if clock:
                clock.say(READY, done)
            print(json.dumps({"first": {s.role: s.first for s in streams}, "state": streams[0].state}), flush=True)
        elif clock and done > reported:
            clock.say(PROGRESS, done, {})
        elif clock:
            clock.say(WAITING, done, "plant")
        elif not heard and done > quiet:
            quiet = done
            print(json.dumps({"quiet": quiet}), flush=True)
        reported = done
        if last is not None and done >= last:
            break
    if clock:
        clock.say(LEAVE, reported)
    print(json.dumps({s.role: seen(s) for s in streams}), flush=True)
    context.destroy(linger=1000)


def seen(stream):
    columns = {n: base64.b64encode(struct.pack(f"<{len(c)}d", *c)).decode() for n, c in stream.columns.items()}
    return {
        "first": stream.first,
        "tick": stream.tick,
        "gap_ticks": stream.gap_ticks,
        "ended": stream.ended,
        "columns": columns,
    }


if __name__ == "__main__":
    main()
