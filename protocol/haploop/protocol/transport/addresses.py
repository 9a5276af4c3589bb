"""TCP addresses as people write them: those to bind, checked on this machine, and those to connect to on another."""

from __future__ import annotations

import errno
import ipaddress
import socket


class TransportError(ValueError):
    """Raised for an address that cannot be used; the message says what to do."""


def address_to_bind(text: str, ports: int, is_guarded: bool) -> tuple[str, int]:
    """Reads ADDRESS or ADDRESS:PORT, an IPv6 address with a port in brackets; the port is 0 where none is named.

    Args:
        ports: how many ports in a row are needed.
        is_guarded: whether keys guard them; only then may other machines reach them.

    Raises:
        TransportError: the address is not numeric, not of this machine, or open to others without keys, or a port is
            taken.
    """
    host, port_text = _split(text)
    try:
        address = ipaddress.ip_address("127.0.0.1" if host == "localhost" else host)
    except ValueError as error:
        raise TransportError(
            "A numeric address such as 127.0.0.1, or one with a port such as 192.0.2.7:5550, was expected for TCP, "
            f"but {text!r} was given."
        ) from error
    port = _port(port_text, 65536 - ports, text) if port_text else 0
    if not address.is_loopback and not is_guarded:
        raise TransportError(
            f"Anyone who reaches {address} could steer the loop: give a directory of keys as well (haploop keys makes "
            "one), or use 127.0.0.1."
        )
    for number in range(port, port + ports) if port else (0,):
        _refuse_taken(str(address), number, ports)
    return str(address), port


def address_to_reach(text: str) -> str:
    """Reads HOST:PORT, with or without tcp://, as the address of a run's clock; TransportError if it is not one."""
    host, port = _split(text.removeprefix("tcp://"))
    if not host or not port or not host.isprintable() or set(host) & set("/@ "):
        raise TransportError(
            f"The address of a run is what haploop run --tcp names, such as 192.0.2.7:5550, but {text!r} was given."
        )
    try:
        found = socket.getaddrinfo(host, _port(port, 65535, text), type=socket.SOCK_STREAM)[0][4]
    except (OSError, UnicodeError) as error:
        raise TransportError(f"{host} is not a host that is known here; use its numeric address.") from error
    return f"tcp://[{found[0]}]:{found[1]}" if ":" in str(found[0]) else f"tcp://{found[0]}:{found[1]}"


def own_address_towards(clock: str) -> str:
    """Returns the address, with any port, at which a program that can reach the clock can reach this machine too.

    On the clock's own machine it stands for every address, since whoever has reached the clock knows one of them.
    """
    host, port = _split(clock.removeprefix("tcp://"))
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM) as trial:
        trial.connect((host, int(port)))  # sends nothing
        own = trial.getsockname()[0]
    any_host = "[::]" if ":" in own else "0.0.0.0"
    is_here = ipaddress.ip_address(own).is_loopback or own == host
    return f"tcp://{any_host if is_here else f'[{own}]' if ':' in own else own}:0"


def _split(text: str) -> tuple[str, str]:
    """Returns host and port, "" for none; an IPv6 address has a port only after its brackets."""
    host, colon, port = text.rpartition(":")
    if not colon or text.endswith("]") or (":" in host and not host.endswith("]")):
        host, port = text, ""
    return host.removeprefix("[").removesuffix("]"), port


def _port(text: str, most: int, whole: str) -> int:
    if not (text.isascii() and text.isdigit() and 0 < int(text) <= most):
        raise TransportError(f"A port from 1 to {most} was expected after the address, but {whole!r} was given.")
    return int(text)


def _refuse_taken(host: str, port: int, ports: int) -> None:
    try:
        with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as trial:
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            trial.bind((host, port))
    except OSError as error:
        if error.errno == errno.EADDRNOTAVAIL:
            raise TransportError(f"{host} is not an address of this machine.") from error
        raise TransportError(
            f"Port {port} at {host} cannot be bound ({error.strerror}); a run takes {ports} consecutive ports: name "
            "others, or none to use any that are free."
        ) from error
