"""Exit statuses: errors a person can mend become one message on stderr and a status."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Iterator
from typing import Any, NoReturn

FAILED, WRONG_USE = 1, 2


def leave(message: str, status: int) -> NoReturn:
    """Prints a message for people and exits."""
    print(message, file=sys.stderr)
    raise SystemExit(status)


def print_json(data: Any) -> None:
    """Prints one JSON object on stdout; numbers that are not finite become null."""
    from haploop.logger.summary import finite

    print(json.dumps(finite(data)), flush=True)


@contextlib.contextmanager
def plain_errors() -> Iterator[None]:
    """Turns the errors of the packages below into messages: 2 for wrong use, 1 for a run that failed."""
    from haploop.controller.dissipation import ElementError, PluginError
    from haploop.launch.processes.run_directory import CommandRefused, RunNotFound
    from haploop.launch.scene.mistakes import SceneError
    from haploop.launch.spec import OutputError
    from haploop.logger.log import LogError

    try:
        yield
    except SceneError as error:
        count = len(error.mistakes)
        leave(f"{error}\n{count} mistake{'s' * (count != 1)}; nothing was started.", WRONG_USE)
    except (PluginError, ElementError, OutputError, CommandRefused, RunNotFound) as error:
        leave(str(error), WRONG_USE)
    except LogError as error:
        leave(str(error), FAILED)
