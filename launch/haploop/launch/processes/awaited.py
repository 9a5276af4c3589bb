"""Programs that somebody else starts: how they find a run that waits for them, and the wait."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from haploop.launch.clock.server import ClockServer
from haploop.launch.foreign import Program, seat_file
from haploop.launch.spec import NeverBegan
from haploop.protocol.transport.machine import Machine
from haploop.protocol.transport.wire import Message

_LOOK_MS = 100


class Awaited:
    """The external programs of some roles, which join by means of a file in the run's directory of sockets."""

    def __init__(self, sockets: Path, programs: Sequence[Program], server: ClockServer, machine: Machine) -> None:
        self._roles = [program.role for program in programs]
        self._sockets, self._server, self._machine = sockets, server, machine

    def wait(self, told_to: Callable[[str], Message], wait_s: float, interrupts: Sequence[int]) -> None:
        """Waits until all have joined, then removes the files; a line on stderr says whom the run waits for.

        Args:
            told_to: returns what the program of a role is told at its start.
            interrupts: signals that have arrived.

        Raises:
            NeverBegan: one did not join in time, or the run was stopped.
            KeyboardInterrupt: a signal came.
        """
        for role in self._roles:
            file = self._write(role, told_to(role))
            print(f"Waiting {wait_s:g} s for a {role} to join; {file} says how.", file=sys.stderr, flush=True)
        roster, give_up = self._server.roster, self._machine.now() + wait_s
        while missing := [role for role in self._roles if not roster.own(role)]:
            left_s = give_up - self._machine.now()
            if left_s <= 0:
                why = f"No program joined as the {' and the '.join(missing)} within {wait_s:g} s; --wait allows more."
                raise NeverBegan(" ".join([why, *(roster.refused[role] for role in missing if role in roster.refused)]))
            self._server.socket.poll(min(_LOOK_MS, max(1, int(1000 * left_s))))
            self._server.serve()
            if interrupts:
                raise KeyboardInterrupt
            if self._server.is_stopped:
                raise NeverBegan(f"The run was stopped before a program had joined as the {' and the '.join(missing)}.")
        for role in self._roles:
            (self._sockets / seat_file(role)).unlink(missing_ok=True)

    def _write(self, role: str, start: Message) -> Path:
        """Writes what the program of a role is told into a file that only this user can read; returns the file."""
        file = self._sockets / seat_file(role)
        told = {"role": role, "run": self._sockets.name, "directory": str(self._sockets), "cores": None, **start}
        with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as opened:
            json.dump(told, opened)
        return file
