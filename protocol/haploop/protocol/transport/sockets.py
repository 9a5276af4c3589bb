"""Sockets of a run: local files, or TCP with CURVE keys; with options so that nothing is lost, hangs or grows."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import zmq

from haploop.protocol.transport.keys import CLOCK, Keys, read_keys
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.wire import MAX_FRAME_BYTES

# The sockets of a run in the order of their TCP ports.
_PORTS = (CLOCK, *(name for process in PROCESSES.values() for name in process.binds.values()))
# A subscriber this many blocks behind starts to lose blocks; the grant window keeps lossless ones far below.
TELEMETRY_BACKLOG_BLOCKS = 256
# Messages that arrive at bound sockets, where anyone may connect, are small: reports and commands, subscriptions to a
# role. (A large scene goes the other way, from bound sockets to those that connect.)
_LARGEST: dict[int, int] = {zmq.ROUTER: 4 * 1024 * 1024, zmq.XPUB: 1024}
_OPTIONS: dict[int, tuple[tuple[int, int], ...]] = {
    zmq.ROUTER: ((zmq.ROUTER_MANDATORY, 1),),
    zmq.XPUB: ((zmq.SNDHWM, TELEMETRY_BACKLOG_BLOCKS), (zmq.XPUB_VERBOSE, 1)),
    zmq.SUB: ((zmq.RCVHWM, TELEMETRY_BACKLOG_BLOCKS),),
}
# A peer that has connected must show its key within this time.
_HANDSHAKE_MS = 10_000
# A plain int: testing the bits of an enumeration takes as long as the query itself.
_POLLIN = int(zmq.POLLIN)
# The kernel's limit on the path of an ipc socket.
_LONGEST_PATH = 107


class BindError(OSError):
    """Raised for an address of this machine at which no socket can be bound."""


@dataclass(frozen=True)
class Transport:
    """The address at which sockets are bound, and the CURVE keys that guard them.

    Attributes:
        host: numeric address that TCP sockets are bound to; None for local (ipc) sockets.
        port: port of the clock; the other sockets of a run take those that follow. 0 for any free ports.
        keys: those of the program whose sockets these are; None for sockets that anyone may connect to.
        directory: directory of the keys of a whole run, for its launcher alone.
        patience_s: time without a sign of life after which a connection to another host is given up; 0 for never.
    """

    host: str | None = None
    port: int = 0
    keys: Keys | None = None
    directory: Path | None = None
    patience_s: float = 5.0

    @property
    def linger_s(self) -> float:
        """Returns how long the last messages are given to go out, s: a network may lose some of them at first."""
        return 5.0 if self.host else 1.0

    @classmethod
    def from_options(cls, tcp: str | None, keys: Path | None) -> Transport:
        """Makes the transport of a launcher that a command's options ask for: ADDRESS or ADDRESS:PORT, and keys.

        Raises:
            TransportError: a host that others can reach without keys, an address that is not of this machine, a port
                that is taken, or keys without TCP.
            KeysError: keys that are missing, incomplete, or open to others.
        """
        from haploop.protocol.transport.addresses import TransportError, address_to_bind

        if tcp is None:
            if keys:
                raise TransportError("Keys guard TCP; name the address to bind as well, or leave out the keys.")
            return cls()
        host, port = address_to_bind(tcp, len(_PORTS), is_guarded=keys is not None)
        directory = keys and keys.resolve()
        return cls(host, port, directory and read_keys(directory, CLOCK), directory)

    def of(self, role: str, elsewhere: bool = False) -> Transport:
        """Returns the transport of one of the run's processes: its own certificate, and an address on its host.

        Args:
            elsewhere: whether it is perhaps on another host, where any address will do; without keys it can only be
                on this one.

        Raises:
            KeysError: the certificate is gone.
        """
        any_host = "::" if ":" in (self.host or "") else "0.0.0.0"
        return replace(
            self,
            host=any_host if elsewhere and self.directory else self.host,
            keys=self.directory and read_keys(self.directory, role),
            directory=None,
        )

    def as_dict(self) -> dict[str, Any]:
        """Returns what a process is told at its start; the launcher's directory of keys is not part of it."""
        keys = self.keys and self.keys.as_dict()
        return {"host": self.host, "port": self.port, "keys": keys, "patience_s": self.patience_s}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Transport:
        return cls(**{**values, "keys": Keys(**values["keys"]) if values["keys"] else None})


class SecureContext(zmq.Context[zmq.Socket[bytes]]):
    """A ZeroMQ context whose sockets all use one transport; stops its authenticator when it is destroyed."""

    transport: Transport = Transport()
    _authenticator: Any = None
    _watched: tuple[zmq.Socket[bytes], ...] = ()

    @classmethod
    def from_transport(cls, transport: Transport) -> SecureContext:
        """Makes a context; with keys, only peers that hold a known key can connect to its bound sockets."""
        context = cls()
        context.transport = transport
        if transport.keys and transport.host:
            from zmq.auth.thread import ThreadAuthenticator

            context._authenticator = ThreadAuthenticator(context)
            context._authenticator.start()
            context._authenticator.configure_curve_callback(credentials_provider=_Known(transport.keys))
        return context

    def watch(self, socket: zmq.Socket[bytes], events: int) -> zmq.Socket[bytes]:
        """Returns a socket that reports events of the connections of ``socket``, (event, value) as 2 and 4 bytes."""
        self._watched = *(one for one in self._watched if not one.closed), socket
        return socket.get_monitor_socket(events)

    def destroy(self, linger: int | None = None) -> None:
        """Stops the authenticator, closes all sockets and ends the context."""
        for socket in self._watched:  # one that still reported events would wait for a receiver for ever
            if not socket.closed:
                socket.disable_monitor()
        self._watched = ()
        if self._authenticator:
            self._authenticator.stop()
            self._authenticator = None
        super().destroy(linger)


class _Known:
    """Answers the authenticator whether a key is known."""

    def __init__(self, keys: Keys) -> None:
        self._known = {public.encode() for public in keys.known.values()}

    def callback(self, domain: str, key: bytes) -> bool:
        return key in self._known


def open_socket(context: zmq.Context[zmq.Socket[bytes]], kind: int) -> zmq.Socket[bytes]:
    """Opens a socket of a type such as ``zmq.DEALER`` with the options every socket of a run has."""
    socket = context.socket(kind)
    socket.linger = 0
    transport = transport_of(context)
    if transport.keys:
        socket.curve_publickey, socket.curve_secretkey = transport.keys.public.encode(), transport.keys.secret.encode()
        socket.curve_server = kind in _LARGEST
        _watch_peers(socket, transport.patience_s)
    socket.setsockopt(zmq.MAXMSGSIZE, _LARGEST.get(kind, MAX_FRAME_BYTES))
    socket.setsockopt(zmq.RECONNECT_IVL, 20)
    for option, value in _OPTIONS.get(kind, ()):
        socket.setsockopt(option, value)
    return socket


def bare_send(socket: zmq.Socket[bytes]) -> Callable[..., Any]:
    """Returns ``socket.send`` without pyzmq's checks of options that the loop does not use, a third of its time."""
    return super(zmq.Socket, socket).send if isinstance(socket, zmq.Socket) else socket.send


def send_at_once(socket: zmq.Socket[bytes], frame: bytes) -> bool:
    """Sends a frame if that can be done at once; tells whether it could.

    A socket that has connected to a peer with other keys is soon connected to nothing; a send would wait for ever.
    """
    try:
        socket.send(frame, zmq.DONTWAIT)
    except zmq.Again:
        return False
    return True


def transport_of(context: zmq.Context[zmq.Socket[bytes]]) -> Transport:
    return context.transport if isinstance(context, SecureContext) else Transport()


def _watch_peers(socket: zmq.Socket[bytes], patience_s: float) -> None:
    """Makes the library give up a connection on which nothing is heard, and one that never says who it is."""
    if patience_s:
        milliseconds = max(2, int(patience_s * 1000))
        asks_ms = min(1000, milliseconds // 2)
        socket.setsockopt(zmq.HEARTBEAT_IVL, asks_ms)
        socket.setsockopt(zmq.HEARTBEAT_TIMEOUT, milliseconds - asks_ms)
    socket.setsockopt(zmq.HANDSHAKE_IVL, _HANDSHAKE_MS)
    socket.setsockopt(zmq.RECONNECT_IVL_MAX, 1000)


def connect(socket: zmq.Socket[bytes], address: str, key: str | None = None) -> None:
    """Connects to an address whose holder has the public key ``key``; None stands for the clock's key."""
    keys = transport_of(socket.context).keys
    if keys:
        socket.curve_serverkey = (key or keys.clock).encode()
    if "[" in address:
        socket.setsockopt(zmq.IPV6, 1)
    socket.connect(address)


def has_message(socket: zmq.Socket[bytes]) -> bool:
    """Tells whether a message is there to be taken."""
    return bool(int(socket.get(zmq.EVENTS)) & _POLLIN)


def bind(socket: zmq.Socket[bytes], directory: Path, name: str) -> str:
    """Binds in the run's directory of sockets, or to a free port of the transport's TCP host; returns the address.

    Raises OSError where the path is longer than the kernel allows, or is taken; BindError where the port is.
    """
    transport = transport_of(socket.context)
    if transport.host:
        socket.setsockopt(zmq.IPV6, int(":" in transport.host))
        port = transport.port + _PORTS.index(name) if transport.port else "*"
        host = f"[{transport.host}]" if ":" in transport.host else transport.host
        try:
            socket.bind(f"tcp://{host}:{port}")
        except zmq.ZMQError as error:
            raise BindError(
                f"Port {port} at {host} cannot be bound for the {name} socket: {error.strerror}."
            ) from error
        return bytes(socket.getsockopt(zmq.LAST_ENDPOINT)).rstrip(b"\0").decode()
    path = directory / f"{name}.sock"
    if len(os.fsencode(path)) > _LONGEST_PATH:
        raise OSError(
            f"The socket path {path} has {len(os.fsencode(path))} bytes, but the system allows {_LONGEST_PATH}; "
            "set XDG_RUNTIME_DIR to a shorter directory."
        )
    if path.exists():
        raise OSError(f"The socket {path} exists already; another process of this run has bound it.")
    address = f"ipc://{path}"
    socket.bind(address)
    return address


def with_host_of(address: str, other: str) -> str:
    """Returns a bound address, with the host of ``other`` in place of a wildcard, for one who has reached ``other``."""
    for wildcard in ("tcp://0.0.0.0:", "tcp://[::]:"):
        if address.startswith(wildcard):
            return f"{other.rpartition(':')[0]}:{address.removeprefix(wildcard)}"
    return address
