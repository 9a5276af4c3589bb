"""The options that say which live run a command is for: one of this machine, or one elsewhere by its address."""

from __future__ import annotations

import functools
import inspect
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from haploop.tools.command.options import WRONG_USE, leave, parse_seconds

_ADDRESS = "a run elsewhere, HOST:PORT as printed by haploop run --tcp"
_TIME = 'simulated time of the change, s or "1500 ms" [as soon as it can be, mostly within 2 s]; or '
_KEYS = typer.Option("--keys", metavar="DIR", help="with --at: directory with its clock.key and client.key_secret")


def for_a_run(command: Callable[..., None]) -> Callable[..., None]:
    """Gives a command with a parameter ``run`` the options --at ADDRESS and --keys DIR beside --run ID.

    Its ``run`` is then what ``run_directory.find`` takes. If the command has a parameter ``at``, a simulated time, --at
    takes that as well: an address has a colon, and no time has one.
    """
    hints = typing.get_type_hints(command, include_extras=True)
    parameters = inspect.signature(command).parameters
    has_time = "at" in parameters
    at = typer.Option(
        "--at", metavar="TIME|ADDRESS" if has_time else "ADDRESS", help=f"{_TIME if has_time else ''}{_ADDRESS}"
    )

    @functools.wraps(command)
    def with_run(**given: Any) -> None:
        texts, directory = given.pop("at") or [], given.pop("keys")
        times = [text for text in texts if ":" not in text]
        addresses = [text for text in texts if ":" in text]
        if len(addresses) > 1 or len(times) > has_time:
            expected = "a time and an address" if has_time else "one address such as 192.0.2.7:5550"
            leave(f"--at takes {expected}, but {' and '.join(map(repr, texts))} was given.", WRONG_USE)
        if has_time:
            given["at"] = parse_seconds(times[0] if times else None)
        given["run"] = _elsewhere(addresses[0], directory, given["run"]) if addresses else given["run"]
        if directory and not addresses:
            leave("--keys belongs to a run elsewhere: name its address with --at.", WRONG_USE)
        command(**given)

    options = {
        "run": (hints["run"], None),
        "at": (Annotated[list[str] | None, at], None),
        "keys": (Annotated[Path | None, _KEYS], None),
    }
    own = {name: (hints[name], one.default) for name, one in parameters.items() if name not in options}
    kind = inspect.Parameter.KEYWORD_ONLY
    with_run.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [inspect.Parameter(name, kind, default=of[1], annotation=of[0]) for name, of in (own | options).items()]
    )
    with_run.__annotations__ = {name: of[0] for name, of in (own | options).items()}
    return with_run


def _elsewhere(address: str, directory: Path | None, run_id: str | None) -> Any:
    from haploop.launch.processes.run_directory import Elsewhere
    from haploop.protocol.transport.addresses import TransportError, address_to_reach

    if run_id:
        leave("--run names a run of this machine and --at one elsewhere; leave one of them out.", WRONG_USE)
    try:
        return Elsewhere(address_to_reach(address), directory)
    except TransportError as error:
        leave(str(error), WRONG_USE)
