"""``haploop join``: haploop's own plant or controller for a run that waits for one, on this or another host."""

from __future__ import annotations

import json
import sys
import tempfile
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from haploop.tools.command.options import FAILED, WRONG_USE, leave


def join(
    file: Annotated[Path, typer.Argument(help="external-ROLE.json of a run with --external ROLE", show_default=False)],
) -> None:
    """Join a run that waits with --external. This process is its plant or controller until the run ends."""
    from haploop.protocol.transport.messages import PROCESSES
    from haploop.protocol.transport.node import take_part
    from haploop.protocol.transport.sockets import SecureContext, Transport

    try:
        told = json.loads(file.read_text(encoding="utf-8"))
        role, directory = told["role"], told["directory"]
        if not all(isinstance(told[key], str) for key in ("address", "secret", "run", "directory")):
            raise ValueError
        work = import_module(PROCESSES[role].module).work
        context = SecureContext.from_transport(Transport.from_dict(told["transport"]))
    except OSError as error:
        leave(f"{file} cannot be read: {error.strerror}.", WRONG_USE)
    except (ValueError, LookupError, TypeError):
        leave(f"{file} is not a file that haploop run --external ROLE writes.", WRONG_USE)
    with tempfile.TemporaryDirectory() as own:
        sockets = Path(own if context.transport.host else directory)
        print(f"joining run {told['run']} as its {role}", file=sys.stderr)
        if take_part(context, role, work, told, sockets, lambda why: print(why, file=sys.stderr)):
            raise SystemExit(FAILED)
