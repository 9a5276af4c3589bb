"""Frames: the messages of the table in msgpack, checked when decoded; nothing in them is ever executed."""

from __future__ import annotations

from typing import Any, NamedTuple

import msgpack

from haploop.protocol.transport.messages import BY_CODE, MESSAGES, VERSION, complaint

# A frame larger than this is refused by the socket itself.
MAX_FRAME_BYTES = 64 * 1024 * 1024


# The fields of a message by name, and what is nested in them; the table in messages.py says which they are.
Message = dict[str, Any]


class WireError(ValueError):
    """Raised for a frame that is not a message of this version; its text says what is wrong."""


class Frame(NamedTuple):
    """A decoded message: its name and its fields in the order of the table, None for those left out."""

    name: str
    fields: list[Any]

    def as_dict(self) -> Message:
        return {name: value for (name, _), value in zip(MESSAGES[self.name].fields, self.fields, strict=True)}


# Half a surrogate pair, which a plugin's error may hold, is not UTF-8; the text is sent with its code in its place.
_packer = msgpack.Packer(autoreset=True, unicode_errors="backslashreplace")


def encode(name: str, *fields: Any) -> bytes:
    """Returns a message as bytes; ``fields`` in the order of the table."""
    return _packer.pack((VERSION, MESSAGES[name].code, *fields))


def decode(data: bytes) -> Frame:
    """Returns the message in a frame.

    Raises WireError where it is not msgpack, has another version or an unknown code, or has missing or wrong fields.
    """
    try:
        items = msgpack.unpackb(data, strict_map_key=False)
    except Exception as error:  # msgpack raises many kinds, RecursionError among them
        raise WireError(f"A frame of {len(data)} bytes is not msgpack: {type(error).__name__}.") from error
    if not isinstance(items, list) or len(items) < 2:
        raise WireError(f"A frame must be an array [version, code, fields...], but is {type(items).__name__}.")
    version, code, *fields = items
    if type(version) is not int or version != VERSION:
        raise WireError(
            f"This is protocol version {VERSION}, but a frame of version {_describe(version)} was received."
        )
    name = BY_CODE.get(code) if type(code) is int else None
    if name is None:
        raise WireError(f"No message has the code {_describe(code)}.")
    wrong = complaint(name, fields)
    if wrong:
        raise WireError(wrong + ".")
    left_out = len(MESSAGES[name].fields) - len(fields)
    return Frame(name, fields + [None] * left_out if left_out else fields)


def _describe(value: Any) -> str:
    """Returns a number as text, anything else as its type: it may be huge, or nested deeper than Python can print."""
    return str(value) if isinstance(value, int | float) else f"({type(value).__name__})"
