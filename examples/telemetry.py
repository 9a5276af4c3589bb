"""The blocks that a plant publishes: where the device was, and under which force, at every plant step."""

import time
from array import array

from sockets import pack

STATE, PLANT_BLOCK, END = 30, 31, 34
NAMES = ("x", "v", "force", "command")
# Wall time, s, whose ticks make a block, unless the scene's limit comes first; it is longer if the plant owns the time,
# since the logger may then be behind by a whole window of blocks.
BLOCK_S, LONG_BLOCK_S = 0.01, 0.05


class Telemetry:
    """A plant's stream of blocks, on an XPUB; `state` returns the present tick, x, v, held force and its command."""

    def __init__(self, socket, most_ticks, state, block_s):
        self._socket, self._most_ticks, self._state, self._block_s = socket, most_ticks, state, block_s
        self.begin()

    def begin(self):
        """Begins a block at the present tick."""
        self.first, self._began = self._state()[0], time.monotonic()
        self._rows = [array("d") for _ in NAMES]

    def note(self):
        """Records the state at the beginning of a plant step."""
        for column, value in zip(self._rows, self._state()[1:], strict=True):
            column.append(value)

    def is_due(self):
        """Tells whether the recorded steps make a block."""
        return self._state()[0] - self.first >= self._most_ticks or time.monotonic() - self._began > self._block_s

    def flush(self):
        """Publishes the steps since the last block and the state at their end; tells whether there were any."""
        first, ticks = self.first, self._state()[0] - self.first
        if ticks:
            self.note()
            columns = {name: column.tobytes() for name, column in zip(NAMES, self._rows, strict=True)}
            self._publish(PLANT_BLOCK, first, ticks, columns | {"x_low": bytes(len(columns["x"]))})
        self.begin()
        self.serve()
        return ticks > 0

    def serve(self, wait_ms=0):
        """Answers new subscriptions with the state, only between two blocks; tells whether there was one."""
        asked = False
        while self._socket.poll(wait_ms):
            request, wait_ms = self._socket.recv(), 0
            asked |= request[:1] == b"\x01" and b"plant".startswith(request[1:])
        if asked:
            state = dict(zip(("tick", *NAMES), self._state(), strict=True))
            self._publish(STATE, state["tick"], state)
        return asked

    def end(self, tick, reason):
        self._publish(END, tick, reason, None)

    def _publish(self, *message):
        self._socket.send_multipart([b"plant", pack(*message)])
