"""Access control: only programs on this machine may look, whoever runs them, and may steer only with the printed link.

A page from elsewhere can reach a server on loopback, too, through its visitor's browser. It can make that browser send
requests, but not with a Host (its own name may resolve to this machine: DNS rebinding) or an Origin other than its own,
and it can neither read the answers nor guess a token.
"""

from __future__ import annotations

import hmac
import secrets

HOST = "127.0.0.1"
_NAMES = (HOST, "localhost")


class Guard:
    """Holds the host names, the token and the one-time key of one server.

    Attributes:
        link: the address with the token in its fragment, which no browser sends to any server.
        one_time_link: a link that leads to ``link`` once: all users can see the command line that starts a browser.
    """

    def __init__(self, port: int) -> None:
        self._hosts = [f"{name}:{port}" for name in _NAMES]
        self.token = secrets.token_urlsafe(24)
        self._key: str | None = secrets.token_urlsafe(24)
        self.address = f"http://{self._hosts[0]}/"
        self.link = f"{self.address}#token={self.token}"
        self.one_time_link = f"{self.address}enter/{self._key}"

    def redeem(self, key: str) -> bool:
        """Tells whether this is the key of the one-time link, and uses it up."""
        if self._key is None or not _same(key, self._key):
            return False
        self._key = None
        return True

    def is_own_host(self, host: str | None) -> bool:
        return host in self._hosts

    def is_own_origin(self, origin: str | None) -> bool:
        return origin in [f"http://{host}" for host in self._hosts]

    def may_steer(self, token: str) -> bool:
        """Tells whether this is the token, in a time that does not depend on how much of it is right."""
        return _same(token, self.token)

    @property
    def headers(self) -> dict[str, str]:
        """Returns the headers of every answer: they allow nothing from elsewhere in it, and no other page around it."""
        sockets = " ".join(f"ws://{host}" for host in self._hosts)
        return {
            "Content-Security-Policy": (
                f"default-src 'self'; connect-src 'self' {sockets}; "
                "base-uri 'none'; form-action 'self'; frame-ancestors 'none'; object-src 'none'"
            ),
            "X-Frame-Options": "DENY",
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Opener-Policy": "same-origin",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Cache-Control": "no-store",
        }


def _same(given: str, wanted: str) -> bool:
    return hmac.compare_digest(given.encode(errors="surrogatepass"), wanted.encode())
