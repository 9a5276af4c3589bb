"""The file that each kind of element comes from: that of the run's start, or of a later reload that has not failed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from haploop.launch.clock.clock import Clock
from haploop.protocol.changes import Event, is_off

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element
    from haploop.launch.spec import RunSpec

# For each kind: its class, the user's file and the run's copy of it (None if it came from no file); None if there is no
# such kind.
Code = dict[str, "tuple[type[Element], Path | None, Path | None] | None"]


class Reloads:
    """Keeps ``kinds``, ``plugin_sources`` and ``plugin_files`` of a run as the controller has them.

    When a change comes with a file, its kinds use the code of that file until the change is refused or taken back; then
    they use the last good code again.
    """

    def __init__(self, clock: Clock, spec: RunSpec) -> None:
        self._clock, self._spec = clock, spec
        self._began: Code = {kind: self._now(kind) for kind in spec.kinds}
        self._made: list[tuple[int, Event, Code]] = []

    def _now(self, kind: str) -> tuple[type[Element], Path | None, Path | None] | None:
        spec = self._spec
        if kind not in spec.kinds:
            return None
        return spec.kinds[kind], spec.plugin_sources.get(kind), spec.plugin_files.get(kind)

    def change(self, change: Event, at_s: float | None, code: Code, file: Path) -> tuple[int, Code]:
        """Schedules a change that comes with a file; returns its tick, and the former code of its kinds.

        Raises what ``Clock.change`` raises; then nothing has changed.
        """
        before = {kind: self._now(kind) for kind in code}
        self._write(code)
        try:
            tick = self._clock.change(change, at_s, plugin=str(file.resolve()))
        except Exception:
            self._write(before)
            raise
        self._made.append((tick, self._clock.newest, code))
        return tick, before

    def settle(self, withdrawn: Event | None = None) -> list[Event]:
        """Takes back the code of changes refused, taken back or withdrawn since; returns those changes."""
        gone = [event for tick, event, _ in self._made if event is withdrawn or is_off(tick, event, self._clock.events)]
        if gone:
            unknown: Code = {kind: None for *_, code in self._made for kind in code}
            self._made = [each for each in self._made if not any(each[1] is event for event in gone)]
            for code in (unknown, self._began, *(code for *_, code in self._made)):
                self._write(code)
        return gone

    def _write(self, code: Code) -> None:
        spec = self._spec
        for kind, known in code.items():
            of_kind = known or (None, None, None)
            for there, value in zip((spec.kinds, spec.plugin_sources, spec.plugin_files), of_kind, strict=True):
                there.pop(kind, None)
                if value is not None:
                    there[kind] = value  # pyright: ignore[reportArgumentType]
