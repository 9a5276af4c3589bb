"""CURVE keys: one certificate for the clock, one for each process of a run and one for clients, in one directory.

``clock.key`` and ``clients/*.key`` are public; ``NAME.key_secret`` holds both keys of NAME and is secret. A host
from which a run elsewhere is watched and steered needs only ``clock.key`` and ``client.key_secret``.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import zmq

from haploop.protocol.transport.messages import PROCESSES

CLOCK, CLIENT, CLIENTS = "clock", "client", "clients"
_HOLDERS = (CLOCK, *PROCESSES, CLIENT)
_CERTIFICATE = 'curve\n    public-key = "{}"\n'
_SECRET = '    secret-key = "{}"\n'


class KeysError(ValueError):
    """Raised for keys that are missing, incomplete, or open to others; the message says what to do."""


@dataclass(frozen=True)
class Keys:
    """The keys that one program is given, as Z85 texts of 40 characters.

    Attributes:
        public, secret: its own pair.
        clock: the public key of the clock; those of the run's processes come with their addresses.
        known: name -> public key of everyone who may connect to sockets that it binds; empty for a client.
    """

    public: str
    secret: str
    clock: str
    known: dict[str, str]

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def make_keys(directory: Path) -> list[str]:
    """Makes the certificates that a directory lacks, mode 0600, and returns their holders; changes no existing one.

    Raises:
        KeysError: the directory cannot be written, is open to others, or is the copy that a client was given.
    """
    try:
        directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        (directory / CLIENTS).mkdir(mode=0o700, exist_ok=True)
        if (directory / f"{CLOCK}.key").exists() and not _secret_of(directory, CLOCK).exists():
            raise KeysError(
                f"{directory} holds {CLOCK}.key without its secret, as a client's copy does: "
                "make keys on the host of the run, in a separate directory."
            )
        made = [holder for holder in _HOLDERS if _make_pair(directory, holder)]
        for holder, path in ((CLOCK, directory / f"{CLOCK}.key"), (CLIENT, directory / CLIENTS / f"{CLIENT}.key")):
            _write(path, _CERTIFICATE.format(_pair(directory, holder)[0]), 0o644, os.replace)
    except OSError as error:
        raise KeysError(f"Keys cannot be made in {directory}: {error.strerror}.") from error
    read_keys(directory, CLOCK)
    return made


def read_keys(directory: Path, holder: str) -> Keys:
    """Returns the keys that ``holder`` (clock, a role of the run's processes, or client) is given from a directory.

    Raises:
        KeysError: a file is missing, is not a certificate, or others can read or replace it.
    """
    if not directory.is_dir():
        raise KeysError(f"There is no directory of keys {directory}; haploop keys {directory} makes one.")
    _refuse_open(directory, 0o022, "writable")
    if holder == CLIENT:
        return Keys(*_pair(directory, CLIENT), _public(directory / f"{CLOCK}.key"), {})
    known = {name: _pair(directory, name)[0] for name in (CLOCK, *PROCESSES)}
    if (directory / CLIENTS).is_dir():
        _refuse_open(directory / CLIENTS, 0o022, "writable")
        known |= {f"{CLIENTS}/{path.stem}": _public(path) for path in sorted((directory / CLIENTS).glob("*.key"))}
    return Keys(*_pair(directory, holder), known[CLOCK], known)


def _secret_of(directory: Path, holder: str) -> Path:
    return directory / f"{holder}.key_secret"


def _make_pair(directory: Path, holder: str) -> bool:
    """Makes a pair if there is none; tells whether it did. Of two processes at once only one does."""
    public, secret = (key.decode() for key in zmq.curve_keypair())
    try:
        _write(_secret_of(directory, holder), (_CERTIFICATE + _SECRET).format(public, secret), 0o600, os.link)
    except FileExistsError:
        return False
    return True


def _write(path: Path, text: str, mode: int, put: Callable[[Path, Path], None]) -> None:
    """Writes a file whole or not at all; ``put`` gives it its name."""
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        part.touch(mode)
        part.write_text(text, encoding="ascii")
        put(part, path)
    finally:
        part.unlink(missing_ok=True)


def _pair(directory: Path, holder: str) -> tuple[str, str]:
    path = _secret_of(directory, holder)
    public, secret = _load(path)
    _refuse_open(path, 0o077, "open")
    if secret is None:
        raise KeysError(f"{path} holds only a public key; its secret is missing.")
    return public, secret


def _public(path: Path) -> str:
    return _load(path)[0]


def _load(path: Path) -> tuple[str, str | None]:
    from zmq.auth import load_certificate
    from zmq.utils import z85

    if not path.exists():
        raise KeysError(_missing(path))
    try:
        public, secret = load_certificate(path)
        if any(len(key) != 40 or len(z85.decode(key)) != 32 for key in (public, secret) if key is not None):
            raise ValueError
    except OSError as error:
        raise KeysError(f"{path} cannot be read: {error.strerror or error}.") from error
    except (ValueError, KeyError, LookupError) as error:
        raise KeysError(f"{path} is not a CURVE certificate; remove it and make or copy it again.") from error
    return public.decode(), secret.decode() if secret else None


def _missing(path: Path) -> str:
    if path.name in (f"{CLOCK}.key", f"{CLIENT}.key_secret"):
        return f"{path} is missing: copy it from the directory of keys on the host of the run (haploop keys makes it)."
    return f"{path} is missing; on the host of the run haploop keys {path.parent} makes what is missing."


def _refuse_open(path: Path, bits: int, how: str) -> None:
    mode = path.stat().st_mode & 0o777
    if mode & bits:
        closed = mode & ~(bits | 0o022)
        raise KeysError(f"{path} is {how} to others (mode {mode:04o}); repair it with chmod {closed:o} {path}.")
