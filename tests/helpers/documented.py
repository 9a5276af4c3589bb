"""Commands and files that a document tells its reader to type and to write, block by block in its order."""

from __future__ import annotations

import re
import shlex
from typing import NamedTuple

# Commands to a run in progress.
LIVE = ("status", "swap", "set", "undo", "pause", "resume", "step", "pace", "attach", "stop")


class Block(NamedTuple):
    """A block of code with the language that its first line names, "" for none."""

    language: str
    text: str

    @property
    def is_typed(self) -> bool:
        """Whether it is what a terminal shows."""
        return self.language in ("", "bash", "sh", "console")


def blocks(text: str) -> list[Block]:
    """Every block of code of a document."""
    return [Block(*found) for found in re.findall(r"^```(\w*)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)]


def lines_of(block: Block) -> list[str]:
    """Lines that begin with ``haploop``, after a prompt or without; lines continued by a backslash are joined."""
    lines = [line.removeprefix("$ ") for line in block.text.replace("\\\n", " ").splitlines()]
    return [line for line in lines if line.startswith("haploop ")] if block.is_typed else []


def command_lines(text: str) -> list[str]:
    """All such lines of a document."""
    return [line for block in blocks(text) for line in lines_of(block)]


def commands(block: Block) -> list[list[str]]:
    """The words of each command after ``haploop``; comments are left out, and `pause | resume` is two commands."""
    found = []
    for line in lines_of(block):
        alternatives = re.split(r" \| ", re.split(r"   #", line)[0].removeprefix("haploop "))
        found += [shlex.split(words, comments=True) for words in alternatives]
    return found
