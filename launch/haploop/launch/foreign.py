"""Foreign programs that take the place of a run's plant or controller, as a command line asks for them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath

# Roles that a foreign program can take; the logger is what judges it.
ROLES = ("plant", "controller")
WAIT_S = 60.0
_LONGEST_WAIT_S = 1e6
_LONGEST_TOLD = 100


class ProgramError(ValueError):
    """A program that cannot take a role of the run; the message says what to do."""


@dataclass(frozen=True)
class Program:
    """A program that takes the place of one of the run's own processes.

    Attributes:
        command: as it was given; "" for a program that somebody else starts.
        words: the command split as a shell splits it; no command is ever given to a shell.
    """

    role: str
    command: str = ""
    words: tuple[str, ...] = ()

    @property
    def is_external(self) -> bool:
        """True for a program that the launcher does not start."""
        return not self.words

    @property
    def label(self) -> str:
        """The role and its program, for messages; in a long command, files are given without their directories."""
        told = self.command or "external"
        if len(told) > _LONGEST_TOLD:
            told = " ".join(PurePath(word).name if word.startswith("/") else word for word in self.words)
        if len(told) > _LONGEST_TOLD:
            told = f"{told[:_LONGEST_TOLD]} ..."
        return f"{self.role} ({told})"


def seat_file(role: str) -> str:
    """Returns the name of the file by which a program that somebody else starts finds the run."""
    return f"external-{role}.json"


def described(told: Mapping[str, str]) -> str:
    """Returns name, version and command of a program, as far as it reported them, for messages."""
    name = " ".join(filter(None, (told["name"], told["version"]))) or "a program without a name"
    return f"{name} ({told['command']})" if told["command"] else name


NO_PROGRAMS: Mapping[str, Program] = {}


def read_programs(nodes: Sequence[str], externals: Sequence[str]) -> dict[str, Program]:
    """Returns the programs by role.

    Args:
        nodes: texts ``ROLE=COMMAND``, each started by the launcher.
        externals: roles for which a program is awaited.

    Raises ProgramError where a role or a command cannot be used, or a role is given twice.
    """
    programs = [_read_node(text) for text in nodes] + [Program(role) for role in externals]
    found: dict[str, Program] = {}
    for program in programs:
        if program.role not in ROLES:
            raise ProgramError(
                f"A program can take the place of the {' or the '.join(ROLES)}, but {program.role!r} was given."
            )
        if program.role in found:
            raise ProgramError(f"The {program.role} was given twice; only one program can take its place.")
        found[program.role] = program
    return found


def _read_node(text: str) -> Program:
    import shlex
    import shutil

    role, sign, command = text.partition("=")
    if not sign:
        raise ProgramError(f'--node expects ROLE=COMMAND, such as controller="node law.js", but {text!r} was given.')
    try:
        words = tuple(shlex.split(command))
    except ValueError as error:
        raise ProgramError(f"The command of the {role}, {command!r}, cannot be split into words: {error}.") from error
    if not words or not words[0]:
        raise ProgramError(f"The command of the {role} is empty; name the program that takes its place.")
    if any("\0" in word for word in words):
        raise ProgramError(f"The command of the {role} holds a character that no command can hold.")
    if shutil.which(words[0]) is None:
        raise ProgramError(
            f"The program of the {role}, {words[0]!r}, does not exist or cannot be executed; give its path."
        )
    return Program(role, command, words)


def check_wait(seconds: float | None) -> float:
    """Returns the time in s for which an external program is awaited; ProgramError if it is not a valid duration."""
    if seconds is None:
        return WAIT_S
    if not 0 < seconds <= _LONGEST_WAIT_S or math.isnan(seconds):
        raise ProgramError(f"--wait must be above 0 and at most {_LONGEST_WAIT_S:g} s, but {seconds:g} s was given.")
    return seconds
