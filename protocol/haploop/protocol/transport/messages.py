"""The two tables of a run: its processes, and the messages between them, each with its code and fields.

Every frame is a msgpack array ``[VERSION, code, field, field, ...]``; the table of messages is the whole grammar. Encoding,
checking and the documentation in ``protocol/README.md`` derive from it.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

VERSION = 1

# Field types: what msgpack must have unpacked. "number" is an int or a float. A type that ends in "?" may be nil and, at
# the end of a frame, may be left out, so that a field can be added without a new version.
_TYPES: dict[str, tuple[type, ...]] = {
    "int": (int,),
    "number": (int, float),
    "text": (str,),
    "bool": (bool,),
    "bytes": (bytes,),
    "map": (dict,),
    "list": (list,),
    "text?": (str, type(None)),
    "map?": (dict, type(None)),
}


class Process(NamedTuple):
    """One row of the table of processes.

    Attributes:
        role: its name in messages, logs and errors.
        binds: channel -> file name of the socket it binds, ``.sock`` in the run's directory of sockets.
        on_loop_core: whether it exchanges messages at every tick, and so shares one core with its partner.
    """

    role: str
    module: str
    binds: dict[str, str]
    on_loop_core: bool


PROCESSES: dict[str, Process] = {
    process.role: process
    for process in (
        Process("plant", "haploop.plant.node", {"loop": "loop", "telemetry": "plant"}, on_loop_core=True),
        Process("controller", "haploop.controller.node", {"telemetry": "controller"}, on_loop_core=True),
        Process("logger", "haploop.logger.node", {"telemetry": "logger"}, on_loop_core=False),
    )
}

# Attached nodes join under this role, or any other that is not in the table.
OBSERVER = "observer"


class Message(NamedTuple):
    """One row of the table of messages.

    Attributes:
        channel: the socket it travels on (``CHANNELS``).
        fields: (name, type) in order.
    """

    code: int
    channel: str
    sender: str
    receiver: str
    fields: tuple[tuple[str, str], ...]
    meaning: str


CHANNELS = {
    "clock": "ROUTER bound by the clock; every node and every command line connects a DEALER",
    "loop": "ROUTER bound by the plant; the controller connects a DEALER",
    "telemetry": "XPUB bound by plant, controller and logger, one each; every listener connects a SUB",
}


def _message(code: int, channel: str, sender: str, receiver: str, fields: str, meaning: str) -> Message:
    pairs = tuple((name, kind) for name, _, kind in (field.partition(":") for field in fields.split()))
    return Message(code, channel, sender, receiver, pairs, meaning)


MESSAGES: dict[str, Message] = {
    # Joining
    "JOIN": _message(1, "clock", "node", "clock", "role:text secret:text pid:int endpoints:map lossless:bool program:map?",
                     "A node asks to take part. endpoints: channel -> address of each socket it has bound. "
                     "program: name, version and command of what joins, as far as given."),
    "WELCOME": _message(2, "clock", "clock", "node", "run:text scene:map timebase:map endpoints:map granted:int context:map",
                        "The node is part of the run: the resolved scene, its time base, every address, the tick granted."),
    "REFUSED": _message(3, "clock", "clock", "any", "reason:text", "The frame before could not be used, and why."),
    "READY": _message(4, "clock", "node", "clock", "tick:int", "All the node's connections stand; it starts from this tick."),
    # Time
    "GRANT": _message(5, "clock", "clock", "node", "until:int last:bool events:list",
                      "Ticks before `until` may be worked on; `last`: none will follow. events: [tick, event] in order."),
    "PROGRESS": _message(6, "clock", "node", "clock", "tick:int status:map", "Every tick before this one is done."),
    "WAITING": _message(7, "clock", "node", "clock", "tick:int on:text", "The node is alive and waits for another."),
    # Ending
    "ENDED": _message(8, "clock", "plant", "clock", "tick:int reason:text", "The plant ended the run on its own at this tick."),
    "DONE": _message(9, "clock", "node", "clock", "tick:int result:map", "The node has finished and leaves."),
    "FAILED": _message(10, "clock", "node", "clock", "tick:int reason:text", "The node cannot go on, and why."),
    "ABORT": _message(11, "clock", "clock", "node", "reason:text", "The run failed elsewhere: save what there is and leave."),
    "LEAVE": _message(12, "clock", "node", "clock", "tick:int", "An attached node leaves; the run continues."),
    # Commands from people
    "COMMAND": _message(13, "clock", "client", "clock", "verb:text arguments:map", "status, options, pause, resume, step, pace, stop, swap, set, undo."),
    "REPLY": _message(14, "clock", "clock", "client", "ok:bool text:text data:map", "The result of the command."),
    # The loop itself
    "HELLO": _message(20, "loop", "controller", "plant", "secret:text", "The controller presents itself; answered with HELLO."),
    "SAMPLES": _message(21, "loop", "plant", "controller", "tick:int samples:list",
                        "Measured samples of consecutive ticks from `tick` on, [x_m] or [x_m, acceleration] each."),
    "COMMANDS": _message(22, "loop", "controller", "plant", "tick:int forces:list", "Forces in N that answer the same ticks."),
    "LAST": _message(23, "loop", "plant", "controller", "tick:int", "No sample follows: the run ends at this tick."),
    # Telemetry; every frame follows a topic frame with the publisher's role
    "STATE": _message(30, "telemetry", "publisher", "subscriber", "tick:int state:map",
                      "Answer to a new subscription: where the publisher is; its blocks from `tick` on follow without a gap."),
    "PLANT_BLOCK": _message(31, "telemetry", "plant", "subscriber", "from_tick:int ticks:int columns:map",
                            "x, v, x_low, force, command at each of ticks * n plant steps and at the end of the last one; "
                            "effects add columns."),
    "CONTROLLER_BLOCK": _message(32, "telemetry", "controller", "subscriber",
                                 "from_tick:int ticks:int columns:map elements:list wall:map",
                                 "What the controller saw and did at each tick; one dissipation column per element."),
    "ENERGY_BLOCK": _message(33, "telemetry", "logger", "subscriber", "from_tick:int ticks:int columns:map status:map",
                             "The energy books at each tick, and the verdict so far."),
    "END": _message(34, "telemetry", "publisher", "subscriber", "tick:int reason:text trouble:text?", "Nothing follows: the stream ends at this tick."),
}  # fmt: skip

BY_CODE: dict[int, str] = {message.code: name for name, message in MESSAGES.items()}


@cache
def required(name: str) -> int:
    """Returns the least number of fields of a message: all up to the last that may not be nil."""
    fields = MESSAGES[name].fields
    return max((place for place, (_, kind) in enumerate(fields, 1) if not kind.endswith("?")), default=0)


def complaint(name: str, fields: list[object]) -> str | None:
    """Returns what is wrong with the fields of a message, or None."""
    expected = MESSAGES[name].fields
    if not required(name) <= len(fields) <= len(expected):
        return f"{name} has {len(expected)} fields ({', '.join(n for n, _ in expected)}), but {len(fields)} came"
    for value, (field, kind) in zip(fields, expected, strict=False):
        if type(value) not in _TYPES[kind]:  # True is no int here
            return f"{name}.{field} must be of type {kind}, but {type(value).__name__} came"
    return None
