"""State of a TCP connection to a clock, from the library's events: why it fails, and when it is lost."""

from __future__ import annotations

import struct
import time

import zmq

from haploop.protocol.transport.sockets import SecureContext, has_message

_EVENTS = (
    zmq.EVENT_CONNECTED
    | zmq.EVENT_CLOSED
    | zmq.EVENT_DISCONNECTED
    | zmq.EVENT_HANDSHAKE_SUCCEEDED
    | zmq.EVENT_HANDSHAKE_FAILED_AUTH
    | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL
    | zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL
)
# A failure that may pass is reported once it has lasted this long, s; silence, which a bad network causes, later.
_TOLD_AFTER_S, _SILENCE_AFTER_S = 2.0, 5.0

_UNKNOWN_KEY = (
    "The run at {} refuses this key: it is not a key of its clients, or was replaced since. "
    "Copy client.key_secret from its keys."
)
_OTHER_KEYS = (
    "The program at {} broke off the handshake: clock.key does not belong to its keys, or it has no keys, or it is not "
    "a run of haploop. Copy clock.key and client.key_secret from the keys of this run; leave out --keys if it has none."
)
_NEEDS_KEYS = "The run at {} is guarded by keys, or it is not a run of haploop; name a copy of its keys with --keys."
_HAS_NO_KEYS = "The run at {} has no keys, or it is not a run of haploop; leave out --keys if this is the run you mean."
_NO_RUN = "What answers at {} is not a run of haploop; check the port."
_SILENT = "What listens at {} does not answer: it is not a run of haploop, or the network loses most of what is sent."
_NOBODY = (
    "Nobody listens at {}: the run there has ended, it is in a separate network (such as that of a container), or "
    "the address is wrong."
)
_NO_ANSWER = "Nothing comes back from {}: the host is off, there is no route to it, or a firewall blocks it."


class Connection:
    """The connection of one socket that is about to connect to a TCP address.

    It is watched until the context is destroyed.
    """

    def __init__(self, context: SecureContext, socket: zmq.Socket[bytes], address: str) -> None:
        self._address, self._has_keys = address, context.transport.keys is not None
        self._monitor = context.watch(socket, _EVENTS)
        self._began = time.monotonic()
        self._stands = self._has_stood = False
        self._since = self._began  # when its present state began
        self._why, self._is_final = _NO_ANSWER, False

    def trouble(self) -> str:
        """Returns why the connection cannot be made, as a sentence; "" while it still may be, and once it has been."""
        self._take()
        patience_s = _SILENCE_AFTER_S if self._why in (_NO_ANSWER, _SILENT) else _TOLD_AFTER_S
        if self._has_stood or not (self._is_final or time.monotonic() - self._began > patience_s):
            return ""
        return self._why.format(self._address.removeprefix("tcp://"))

    def is_down(self) -> bool:
        """Tells whether the connection is down."""
        self._take()
        return not self._stands

    def lost_s(self) -> float:
        """Returns how long an established connection has been lost, s; 0 while it stands, or if it never has."""
        self._take()
        return 0.0 if self._stands or not self._has_stood else time.monotonic() - self._since

    def _take(self) -> None:
        while has_message(self._monitor):
            event = struct.unpack("=hi", self._monitor.recv_multipart()[0])[0]
            stood, self._stands = self._stands, event == zmq.EVENT_HANDSHAKE_SUCCEEDED
            self._has_stood |= self._stands
            if stood != self._stands:
                self._since = time.monotonic()
            if event == zmq.EVENT_HANDSHAKE_FAILED_AUTH:
                self._why, self._is_final = _UNKNOWN_KEY, True
            elif event == zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL:
                self._why, self._is_final = _HAS_NO_KEYS if self._has_keys else _NEEDS_KEYS, True
            elif event == zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL:
                self._why = _OTHER_KEYS if self._has_keys else _NEEDS_KEYS
            elif event == zmq.EVENT_CLOSED:
                self._why = _NOBODY
            elif event == zmq.EVENT_CONNECTED and self._why is _NO_ANSWER:
                self._why = _SILENT
            elif event == zmq.EVENT_DISCONNECTED and self._why in (_NO_ANSWER, _SILENT):
                self._why = _NO_RUN
