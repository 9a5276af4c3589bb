"""Sockets whose options are such that nothing is lost, nothing hangs at the end and nothing grows without bound."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import zmq

from haploop.protocol.transport import SecureContext, Transport
from haploop.protocol.wire import MAX_FRAME_BYTES

# A subscriber this many blocks behind starts to lose blocks; the grant window keeps lossless ones far below.
TELEMETRY_BACKLOG_BLOCKS = 256
# What comes in where anyone may connect is small: reports and commands, subscriptions to a role. (A large scene goes
# out, from there to sockets that connect.)
_LARGEST: dict[int, int] = {zmq.ROUTER: 4 * 1024 * 1024, zmq.XPUB: 1024}
_BINDING = (zmq.ROUTER, zmq.XPUB)
# The kernel's limit on the path of an ipc socket.
_LONGEST_PATH = 107


def open_socket(context: zmq.Context[zmq.Socket[bytes]], kind: int) -> zmq.Socket[bytes]:
    """Opens a socket of a type such as ``zmq.DEALER`` with the options every socket of a run has."""
    socket = context.socket(kind)
    socket.linger = 0
    _transport(context).guard(socket, binds=kind in _BINDING)
    socket.setsockopt(zmq.MAXMSGSIZE, _LARGEST.get(kind, MAX_FRAME_BYTES))
    socket.setsockopt(zmq.RECONNECT_IVL, 20)
    if kind == zmq.ROUTER:
        socket.setsockopt(zmq.ROUTER_MANDATORY, 1)
    if kind == zmq.XPUB:
        socket.setsockopt(zmq.SNDHWM, TELEMETRY_BACKLOG_BLOCKS)
        socket.setsockopt(zmq.XPUB_VERBOSE, 1)
    if kind == zmq.SUB:
        socket.setsockopt(zmq.RCVHWM, TELEMETRY_BACKLOG_BLOCKS)
    return socket


def bare_send(socket: zmq.Socket[bytes]) -> Callable[..., Any]:
    """Returns ``socket.send`` without pyzmq's checks of options that the loop does not use, a third of its time."""
    return super(zmq.Socket, socket).send


def _transport(context: zmq.Context[zmq.Socket[bytes]]) -> Transport:
    return context.transport if isinstance(context, SecureContext) else Transport()


def has_message(socket: zmq.Socket[bytes]) -> bool:
    """Tells whether a message is there to be taken."""
    return bool(int(socket.get(zmq.EVENTS)) & zmq.POLLIN)


def bind(socket: zmq.Socket[bytes], directory: Path, name: str) -> str:
    """Binds in the run's directory of sockets, or to a free port of the transport's TCP host; returns the address.

    Raises:
        OSError: the path is longer than the kernel allows, or is taken.
    """
    host = _transport(socket.context).host
    if host:
        socket.bind(f"tcp://{host}:*")
        return bytes(socket.getsockopt(zmq.LAST_ENDPOINT)).rstrip(b"\0").decode()
    path = directory / f"{name}.sock"
    if len(os.fsencode(path)) > _LONGEST_PATH:
        raise OSError(
            f"The socket path {path} has {len(os.fsencode(path))} bytes, but the system allows {_LONGEST_PATH}; "
            "set XDG_RUNTIME_DIR to a shorter directory."
        )
    if path.exists():
        raise OSError(f"The socket {path} is there already; another process of this run has bound it.")
    address = f"ipc://{path}"
    socket.bind(address)
    return address
