"""Arguments of commands: refused if the command does not take them, or if they would hold up time."""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from typing import Any

from haploop.launch.clock.clock import ClockError
from haploop.launch.scene.units import is_exotic
from haploop.protocol.transport.wire import Message

# What one command may carry, so that none holds up time: keys and values, nested tables, characters of a text.
_MOST_VALUES, _DEEPEST, _LONGEST = 64, 3, 200
_UNITS = "Hz, J, N, Pa, W, g, m, min, rad, s and %, with n, u, m, c, k or M before them"


def check_names(verb: str, act: Callable[..., Any], arguments: Message) -> None:
    """Raises ClockError if the command does not take an argument, or if one that it needs is missing."""
    taken = signature(act).parameters
    needed = [name for name, one in taken.items() if one.default is one.empty and name not in arguments]
    if needed or not arguments.keys() <= taken.keys():
        names = f"it takes {', '.join(taken)}" if taken else "it takes none"
        lacks = f", and {' and '.join(needed)} must be given" if needed else ""
        raise ClockError(f"The arguments of {verb} cannot be used: {names}{lacks}.")


def check_burden(arguments: Message) -> None:
    """Raises ClockError if a command carries more than can be checked in a moment, or keys that are not texts."""
    left: list[tuple[Any, int]] = [(arguments, 0)]
    seen = 0
    while left:
        value, depth = left.pop()
        inner = [*value, *value.values()] if isinstance(value, dict) else value if isinstance(value, list) else []
        seen += len(inner)
        if seen > _MOST_VALUES or depth > _DEEPEST:
            raise ClockError(
                f"A command carries at most {_MOST_VALUES} keys and values, {_DEEPEST} tables deep; this one has more."
            )
        if isinstance(value, str | bytes) and len(value) > _LONGEST:
            raise ClockError(f"A text in a command has at most {_LONGEST} characters, but one has {len(value)}.")
        if isinstance(value, str) and is_exotic(value):
            raise ClockError(f"{value!r} has a unit that a running loop does not know; it knows {_UNITS}.")
        if isinstance(value, dict) and (odd := [key for key in value if not isinstance(key, str)]):
            raise ClockError(f"The keys in a command must be texts, but {odd[0]!r} was given as one.")
        left += [(one, depth + 1) for one in inner]
