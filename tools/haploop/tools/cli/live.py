"""Commands to a running loop: status, pause, resume, step, pace, stop, swap, set."""

from __future__ import annotations

import math
import sys
import tomllib
from typing import Any, Literal

from haploop.tools.cli.exit_codes import WRONG_USE, leave, plain_errors, print_json


def command(run_id: str | None, as_json: bool, verb: str, arguments: dict[str, Any]) -> None:
    """Have a live run do something and print its answer."""
    from haploop.launch.processes import run_directory
    from haploop.launch.processes.control import ask

    with plain_errors():
        text, data = ask(run_directory.find(run_id), verb, **arguments)
    if as_json:
        print_json({"text": text, **data})
    else:
        print(text)


def show_status(run_id: str | None, as_json: bool) -> None:
    """Every live run with its nodes."""
    from haploop.launch.processes import run_directory
    from haploop.launch.processes.control import ask

    answers = {}
    with plain_errors():
        for run in [run_directory.find(run_id)] if run_id else run_directory.live_runs():
            try:
                answers[run.id] = ask(run, "status")[1]
            except run_directory.RunNotFound as error:  # it ended just now, or its launcher hangs
                print(error, file=sys.stderr)
    if as_json:
        print_json(answers)
    elif not answers:
        print("No run is live.")
    else:
        from haploop.tools.render.report import status_table
        from haploop.tools.render.terminal import console

        for identity, data in answers.items():
            console().print(status_table({**data, "run": identity}))


def assignments(texts: list[str]) -> dict[str, Any]:
    """``KEY=VALUE`` words as a table; a value is TOML where it parses, else text ("0.15 N/mm")."""
    table: dict[str, Any] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            leave(f"KEY=VALUE was expected, but {text!r} was given.", WRONG_USE)
        try:
            table[key.strip()] = tomllib.loads(f"v = {value}")["v"]
        except tomllib.TOMLDecodeError:
            table[key.strip()] = value.strip()
    return table


def pace_of(text: str) -> float | Literal["free"]:
    """``free`` or a positive number, simulated seconds per second."""
    if text == "free":
        return "free"
    try:
        rate = float(text.removesuffix("x"))
    except ValueError:
        rate = math.nan
    if not (rate > 0 and math.isfinite(rate)):
        leave(f"A pace must be free or a number above 0 (1 is real time), but {text!r} was given.", WRONG_USE)
    return rate


def seconds(text: str | None, option: str = "--at") -> float | None:
    """A time given in seconds, or with its unit."""
    if text is None:
        return None
    try:
        return float(text)
    except ValueError:
        pass
    from haploop.launch.scene.tables.number import Number
    from haploop.protocol.quantity import Quantity

    try:
        return float(Number(Quantity("s", at_least=0, about="time")).read(text))
    except ValueError as error:
        leave(f"{option} must be a time such as 1.5 or '1500 ms', but {text!r} was given: {error}", WRONG_USE)
