"""Messages from a page, checked: the interval it shows, and commands to the run."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

from haploop.view.draw.snapshot import Viewport

FEWEST_POINTS, MOST_POINTS = 50, 8000
# Commands that a page may send; the clock answers more.
VERBS = ("pause", "resume", "step", "stop", "swap", "set", "pace")
_LONGEST_S = 1e9


class BadMessage(ValueError):
    """Raised where a page sent no valid message; the text says what was expected."""


@dataclass(frozen=True)
class Command:
    """A command of a page: number of the message, token, verb and arguments."""

    id: int
    token: str
    verb: str
    arguments: dict[str, Any]


def parse_message(text: str) -> Viewport | Command:
    """Returns the message in a text: ``watch`` as a viewport, ``command`` as a command.

    Raises:
        BadMessage: it is neither of the two.
    """
    try:
        message = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadMessage(f"A message must be JSON: {error}.") from error
    if not isinstance(message, dict):
        raise BadMessage("A message must be a JSON object with a type.")
    match message.get("type"):
        case "watch":
            return _watch(message)
        case "command":
            return _command(message)
    raise BadMessage("The type of a message must be watch or command.")


def _watch(message: dict[str, Any]) -> Viewport:
    span_s, end_s = _seconds(message, "span_s"), _seconds(message, "end_s")
    points = message.get("points", Viewport.points)
    if span_s is not None and span_s <= 0.0:
        raise BadMessage("watch.span_s must be above 0, or null.")
    if isinstance(points, bool) or not isinstance(points, int | float) or not math.isfinite(points):
        raise BadMessage("watch.points must be a number.")
    return Viewport(span_s, int(min(max(points, FEWEST_POINTS), MOST_POINTS)), end_s)


def _seconds(message: dict[str, Any], key: str) -> float | None:
    value = message.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= _LONGEST_S:
        raise BadMessage(f"watch.{key} must be a number of seconds from 0 to {_LONGEST_S:g}, or null.")
    return float(value)


def _command(message: dict[str, Any]) -> Command:
    number, token = message.get("id"), message.get("token")
    verb, arguments = message.get("verb"), message.get("arguments", {})
    if not isinstance(number, int) or not isinstance(verb, str) or not isinstance(arguments, dict):
        raise BadMessage("A command must have a whole number as id, a verb, and a table of arguments.")
    return Command(number, token if isinstance(token, str) else "", verb, arguments)
