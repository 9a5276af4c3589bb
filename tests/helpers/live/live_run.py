"""A run as processes that continues while a test does something to it."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from haploop.launch.processes import run_directory
from haploop.launch.processes.run_directory import LiveRun
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.runs.start import prepare, run
from haploop.launch.spec import RunSpec
from haploop.protocol.scene.scene import EventTable
from helpers.live.launched import PATIENT
from helpers.live.waiting import PATIENCE_S, wait_for

SCENE = Path(__file__).parents[3] / "launch" / "scenes" / "fig6c.toml"


class Going:
    """A run that a thread of this process controls.

    Attributes:
        prepared: the specification of the run.
        live: the run as other terminals find it.
    """

    def __init__(self, prepared: RunSpec, announced: Callable[[Path], object], options: dict[str, Any]) -> None:
        self.prepared = prepared
        self._result: dict[str, Any] = {}
        self._error: BaseException | None = None
        self._announced = threading.Event()
        self._tell = announced
        self._thread = threading.Thread(target=self._lead, args=(options,))
        self._thread.start()
        assert self._announced.wait(PATIENCE_S), "the run was never announced"
        if self._error:
            raise self._error

    def _lead(self, options: dict[str, Any]) -> None:
        try:
            self._result = run(self.prepared, on_started=self._note, **options)
        except BaseException as error:
            self._error = error
        finally:
            self._announced.set()

    def _note(self, run_id: str) -> None:
        self.live: LiveRun = run_directory.find(run_id.partition(" ")[0])
        assert self.live.sockets
        self._tell(self.live.sockets)
        self._announced.set()

    @property
    def run_json(self) -> Path:
        assert self.live.sockets
        return self.live.sockets / "run.json"

    def ask(self, verb: str, **arguments: Any) -> tuple[str, dict[str, Any]]:
        """Sends a command as from another terminal."""
        return run_directory.ask(self.live, verb, **arguments)

    def stands_at(self, tick: int, paused: bool = True) -> None:
        """Waits until the run stands still at ``tick``, every tick before it logged: paused, or because it must."""

        def stands() -> bool:
            data = self.ask("status")[1]
            return (data["paused"], data["granted"], data["tick"]) == (paused, tick, tick)

        wait_for(f"standstill at tick {tick}", stands)

    def result(self) -> dict[str, Any]:
        """The summary once the run has ended."""
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive(), "the run does not end"
        if self._error:
            raise self._error
        return self._result

    def end(self) -> None:
        """Leaves nothing behind, however the test went."""
        if self._thread.is_alive():
            with suppress(run_directory.CommandRefused, run_directory.RunNotFound):
                self.ask("stop")
            self._thread.join(PATIENCE_S)


@contextmanager
def going(
    tmp_path: Path,
    *overrides: str,
    pauses: tuple[int, ...] = (),
    announced: Callable[[Path], object] = id,
    **options: Any,
) -> Iterator[Going]:
    """A run of figure 6(c) with overrides, standing still at the ticks ``pauses``."""
    with tempfile.TemporaryDirectory(prefix="hl", dir="/tmp") as base, pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", base)
        prepared = prepare(SCENE, ("run.verdict=window", PATIENT, *overrides), out=tmp_path / "out")
        standing = tuple(EventTable(at=tick / 1000, pause=True) for tick in pauses)
        scene = replace(prepared.scene, event=standing)
        subject = Going(replace(prepared, scene=scene), announced, options)
        try:
            yield subject
        finally:
            subject.end()


def undisturbed(prepared: RunSpec) -> dict[str, Any]:
    """The summary of the same scene run in one process, without observers."""
    return run_in_process(prepared.scene, prepared.kinds)
