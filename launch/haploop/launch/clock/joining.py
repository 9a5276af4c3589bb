"""The rules by which a JOIN is accepted."""

from __future__ import annotations

from typing import Any

from haploop.launch.clock.roster import Roster
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.wire import Message

_LONGEST_ROLE = 40
_PROGRAM_KEYS, _LONGEST_TEXT = ("name", "version", "command"), 200


def what_joins(request: Message) -> dict[str, Any]:
    """Returns name, version and command of the program that asks to join, as far as it states them."""
    told = request["program"] or {}
    return {key: told[key] for key in _PROGRAM_KEYS if key in told}


def why_refused(request: Message, program: Message, secret: str, roster: Roster, has_begun: bool) -> str:
    """Returns why a JOIN is refused, a sentence; "" if it is accepted.

    Args:
        request: the fields of the JOIN by name.
        program: name, version and command in it, which tell people what joins.
        secret: the secret of the run, known to its own processes and the programs in their places.
        has_begun: whether all of these processes and programs have joined.
    """
    role, endpoints = request["role"], request["endpoints"]
    binds = PROCESSES[role].binds if role in PROCESSES else None
    if binds is not None and request["secret"] != secret:
        return f"JOIN as {role}, a role of the run's own processes, came with a wrong secret; join as an observer."
    if binds is not None and roster.own(role):
        return f"The role {role} is taken."
    if binds is None and not has_begun:
        return "The run has not begun; try again in a moment."
    if not (role.isprintable() and 0 < len(role) <= _LONGEST_ROLE):
        return f"JOIN.role must be a printable name of at most {_LONGEST_ROLE} characters."
    if not all(isinstance(text, str) for pair in endpoints.items() for text in pair):
        return "JOIN.endpoints must be a map from channel to address."
    if missing := [channel for channel in binds or () if not _is_address(endpoints.get(channel))]:
        names = " and ".join(sorted(missing))
        return f"JOIN.endpoints of the {role} must hold the ipc:// or tcp:// address of its {names} socket."
    if not all(isinstance(v, str) and v.isprintable() and len(v) <= _LONGEST_TEXT for v in program.values()):
        keys = ", ".join(_PROGRAM_KEYS)
        return f"JOIN.program must hold printable texts of at most {_LONGEST_TEXT} characters: {keys}."
    return ""


def _is_address(text: str | None) -> bool:
    return text is not None and text.startswith(("ipc://", "tcp://"))
