"""Sockets of a seat: local files, or TCP with or without CURVE keys, as the line of JSON that starts a node says."""

import msgpack
import zmq
from zmq.auth.thread import ThreadAuthenticator

VERSION = 1
# If the transport names a port, the sockets have consecutive ports from there on, in this order.
PORTS = ("clock", "loop", "plant", "controller", "logger")
BINDS = (zmq.ROUTER, zmq.XPUB)
# Time that messages may still take to reach a logger that is held up.
LINGER_MS = 20000


def pack(*message):
    """Returns the frame of a message: its code and fields."""
    return msgpack.packb([VERSION, *message])


class Sockets:
    """Opens and binds the sockets of one run; `transport` is the entry of the line of JSON."""

    def __init__(self, directory, transport):
        self._directory, self._context, self._authenticator = directory, zmq.Context(), None
        self._host, self._port, self._keys = (transport.get(key) for key in ("host", "port", "keys"))
        self._patience_ms = max(2, int(1000 * transport.get("patience_s", 5.0)))
        if self._keys:  # without a handler CURVE accepts any key
            self._authenticator = ThreadAuthenticator(self._context)
            self._authenticator.start()
            self._authenticator.configure_curve_callback(credentials_provider=self)

    def callback(self, _domain, key):
        """Tells whether a key is known; called by the authenticator."""
        return key.decode() in self._keys["known"].values()

    def open(self, kind):
        socket = self._context.socket(kind)
        socket.linger = LINGER_MS
        if self._keys:
            socket.curve_publickey, socket.curve_secretkey = (self._keys[key].encode() for key in ("public", "secret"))
            socket.curve_server = kind in BINDS
            asks_ms = min(1000, self._patience_ms // 2)
            socket.heartbeat_ivl, socket.heartbeat_timeout = asks_ms, self._patience_ms - asks_ms
        return socket

    def connect(self, socket, address):
        """Connects to the clock."""
        if self._keys:
            socket.curve_serverkey = self._keys["clock"].encode()
        socket.ipv6 = "[" in address
        socket.connect(address)

    def bind(self, socket, name):
        """Binds a socket of the plant, "loop" or "plant"; returns the address."""
        address = f"ipc://{self._directory}/{name}.sock"
        if self._host:
            socket.ipv6 = ":" in self._host
            host = f"[{self._host}]" if socket.ipv6 else self._host
            address = f"tcp://{host}:{self._port + PORTS.index(name) if self._port else '*'}"
        socket.bind(address)
        return socket.last_endpoint.rstrip(b"\0").decode()

    def close(self):
        """Waits until sent messages have gone out, for at most LINGER_MS, and closes everything."""
        if self._authenticator:
            self._authenticator.stop()
        self._context.destroy(linger=LINGER_MS)
