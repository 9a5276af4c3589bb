"""Sockets of a run: local files, or TCP with CURVE keys; with options by which nothing is lost, hangs or grows."""

from __future__ import annotations

import ipaddress
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zmq

from haploop.protocol.transport.wire import MAX_FRAME_BYTES

SERVER, CLIENT, CLIENTS = "server", "client", "clients"
# A subscriber this many blocks behind starts to lose blocks; the grant window keeps lossless ones far below.
TELEMETRY_BACKLOG_BLOCKS = 256
# What comes in at sockets that are bound, where anyone may connect, is small: reports and commands, subscriptions to a
# role. (A large scene goes out, from there to sockets that connect.)
_LARGEST: dict[int, int] = {zmq.ROUTER: 4 * 1024 * 1024, zmq.XPUB: 1024}
_OPTIONS: dict[int, tuple[tuple[int, int], ...]] = {
    zmq.ROUTER: ((zmq.ROUTER_MANDATORY, 1),),
    zmq.XPUB: ((zmq.SNDHWM, TELEMETRY_BACKLOG_BLOCKS), (zmq.XPUB_VERBOSE, 1)),
    zmq.SUB: ((zmq.RCVHWM, TELEMETRY_BACKLOG_BLOCKS),),
}
# The kernel's limit on the path of an ipc socket.
_LONGEST_PATH = 107


class TransportError(ValueError):
    """Raised for an address or keys that cannot be used; the message says what to do."""


@dataclass(frozen=True)
class Transport:
    """The address at which sockets are bound, and the CURVE keys that guard them.

    Attributes:
        host: address that TCP sockets are bound to, each at a port of its own; None for local (ipc) sockets.
        keys: directory of CURVE keys (``server.key_secret``, ``client.key_secret``, public keys of those who may
            connect in ``clients/``), or None for none.
    """

    host: str | None = None
    keys: Path | None = None

    @classmethod
    def from_options(cls, host: str | None, keys: Path | None) -> Transport:
        """Makes the transport that a command's options ask for, and keys where the directory has none.

        Raises:
            TransportError: a host that others can reach without keys, no address at all, or keys without TCP.
        """
        if host is None:
            if keys:
                raise TransportError("Keys guard TCP; name the address to bind as well, or leave out the keys.")
            return cls()
        try:
            is_local = host == "localhost" or ipaddress.ip_address(host).is_loopback
        except ValueError as error:
            raise TransportError(
                f"A numeric address such as 127.0.0.1 was expected for TCP, but {host!r} came."
            ) from error
        if not is_local and keys is None:
            raise TransportError(
                f"Anyone who reaches {host} could steer the loop: give a directory of keys as well, or use 127.0.0.1."
            )
        if keys:
            _make_missing_keys(keys)
        return cls("127.0.0.1" if host == "localhost" else host, keys and keys.resolve())

    def as_dict(self) -> dict[str, str | None]:
        return {"host": self.host, "keys": str(self.keys) if self.keys else None}

    @classmethod
    def from_dict(cls, values: dict[str, str | None]) -> Transport:
        keys = values.get("keys")
        return cls(values.get("host"), Path(keys) if keys else None)

    def guard(self, socket: zmq.Socket[bytes], binds: bool) -> None:
        """Sets the keys of a socket that will be bound, or connected."""
        if self.keys is None:
            return
        from zmq.auth import load_certificate

        own, secret = load_certificate(self.keys / f"{SERVER if binds else CLIENT}.key_secret")
        socket.curve_publickey, socket.curve_secretkey = own, secret
        if binds:
            socket.curve_server = True
        else:
            socket.curve_serverkey = load_certificate(self.keys / f"{SERVER}.key")[0]


class SecureContext(zmq.Context[zmq.Socket[bytes]]):
    """A ZeroMQ context whose sockets all use one transport; stops its authenticator when it is destroyed."""

    transport: Transport = Transport()
    _authenticator: Any = None

    @classmethod
    def from_transport(cls, transport: Transport) -> SecureContext:
        """Makes a context; with keys, only peers that hold one of those in ``clients/`` can connect to its sockets."""
        context = cls()
        context.transport = transport
        if transport.keys and transport.host:
            from zmq.auth.thread import ThreadAuthenticator

            context._authenticator = ThreadAuthenticator(context)
            context._authenticator.start()
            context._authenticator.configure_curve(domain="*", location=str(transport.keys / CLIENTS))
        return context

    def destroy(self, linger: int | None = None) -> None:
        """Stops the authenticator, closes all sockets and ends the context."""
        if self._authenticator:
            self._authenticator.stop()
            self._authenticator = None
        super().destroy(linger)


def open_socket(context: zmq.Context[zmq.Socket[bytes]], kind: int) -> zmq.Socket[bytes]:
    """Opens a socket of a type such as ``zmq.DEALER`` with the options every socket of a run has."""
    socket = context.socket(kind)
    socket.linger = 0
    _transport(context).guard(socket, binds=kind in _LARGEST)
    socket.setsockopt(zmq.MAXMSGSIZE, _LARGEST.get(kind, MAX_FRAME_BYTES))
    socket.setsockopt(zmq.RECONNECT_IVL, 20)
    for option, value in _OPTIONS.get(kind, ()):
        socket.setsockopt(option, value)
    return socket


def bare_send(socket: zmq.Socket[bytes]) -> Callable[..., Any]:
    """Returns ``socket.send`` without pyzmq's checks of options that the loop does not use, a third of its time."""
    return super(zmq.Socket, socket).send if isinstance(socket, zmq.Socket) else socket.send


def _transport(context: zmq.Context[zmq.Socket[bytes]]) -> Transport:
    return context.transport if isinstance(context, SecureContext) else Transport()


def has_message(socket: zmq.Socket[bytes]) -> bool:
    """Tells whether a message is there to be taken."""
    return bool(int(socket.get(zmq.EVENTS)) & zmq.POLLIN)


def bind(socket: zmq.Socket[bytes], directory: Path, name: str) -> str:
    """Binds in the run's directory of sockets, or to a free port of the transport's TCP host; returns the address.

    Raises OSError where the path is longer than the kernel allows, or is taken.
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


def _make_missing_keys(keys: Path) -> None:
    from zmq.auth import create_certificates

    try:
        keys.mkdir(mode=0o700, parents=True, exist_ok=True)
        (keys / CLIENTS).mkdir(mode=0o700, exist_ok=True)
        for name in (SERVER, CLIENT):
            if not (keys / f"{name}.key_secret").exists():
                public, secret = create_certificates(keys, name)
                Path(secret).chmod(0o600)
                if name == CLIENT:
                    (keys / CLIENTS / f"{CLIENT}.key").write_bytes(Path(public).read_bytes())
    except OSError as error:
        raise TransportError(f"Keys could not be made in {keys}: {error.strerror}.") from error
