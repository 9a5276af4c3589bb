"""Talking to a running loop from another terminal."""

from __future__ import annotations

from typing import Any

import zmq

from haploop.launch.processes.run_directory import LiveRun, RunNotFound, is_live
from haploop.protocol.sockets import open_socket
from haploop.protocol.wire import WireError, decode, encode

_ANSWER_MS = 5000
_LOOK_MS = 250


class CommandRefused(Exception):
    """The run did not do what was asked; the message says why."""


def ask(run: LiveRun, verb: str, **arguments: Any) -> tuple[str, dict[str, Any]]:
    """Sends a command to a live run; returns its answer, a sentence and data.

    Raises:
        CommandRefused: it was refused; nothing has changed.
        RunNotFound: the run does not answer, or has ended.
    """
    context = run.make_context()
    socket = open_socket(context, zmq.DEALER)
    try:
        socket.connect(run.clock)
        socket.send(encode("COMMAND", verb, arguments))
        _await_answer(socket, run)
        frame = decode(socket.recv())
    except WireError as error:
        raise RunNotFound(f"Run {run.id} answered with something else: {error}") from error
    finally:
        context.destroy(linger=0)
    if frame.name == "REFUSED":
        raise CommandRefused(frame.fields[0])
    ok, text, data = frame.fields
    if not ok:
        raise CommandRefused(text)
    return text, data


def _await_answer(socket: zmq.Socket[bytes], run: LiveRun) -> None:
    for _ in range(_ANSWER_MS // _LOOK_MS):
        if socket.poll(_LOOK_MS):
            return
        if not is_live(run):
            raise RunNotFound(f"Run {run.id} ({run.title}) has ended.")
    raise RunNotFound(f"Run {run.id} ({run.title}) has not answered for {_ANSWER_MS // 1000} s.")
