"""A logger and the files it keeps: log.mcap and summary.json in the run's directory."""

from __future__ import annotations

from pathlib import Path

from haploop.logger.log.channels import Channels
from haploop.logger.log.recording import MemoryLog
from haploop.logger.log.writer import Log
from haploop.logger.logger import Logger
from haploop.logger.summary import Summary, finite, write_summary
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.machine import MACHINE, Machine
from haploop.protocol.transport.wire import Message

LOG = "log.mcap"
# The log on disk is at most this far behind, in wall time.
_FLUSH_S = 0.4


class LogSession:
    """Keeps a logger's log flushed and closes everything in order.

    Attributes:
        programs: what plant and controller are, by role, for the summary; empty where both are haploop's own.
    """

    def __init__(self, logger: Logger, log: Log | None, out: Path | None, machine: Machine = MACHINE) -> None:
        self.logger = logger
        self._log, self._out, self._machine = log, out, machine
        self._flush_due = self._machine.now() + _FLUSH_S
        self.programs: Message = {}

    def flush_when_due(self) -> None:
        """Hands the log to the operating system if that was last done too long ago."""
        now = self._machine.now()
        if self._log and now >= self._flush_due:
            self._log.flush()
            self._flush_due = now + _FLUSH_S

    def close(self, failed: str, reason: str | None, trouble: str | None, telemetry_gaps: int) -> Summary:
        """Writes the end state, closes the log, writes the summary and returns it; arguments of ``Logger.summary``."""
        self.logger.end()
        if self._log:
            self._log.close()
        summary = finite(self.logger.summary(failed, reason, trouble, telemetry_gaps))
        if self.programs:
            summary["programs"] = self.programs
        if self._out:
            write_summary(summary, self._out, self._machine)
        return summary


def open_session(
    scene: Scene,
    time: Timebase,
    out: Path | None,
    attachments: dict[str, str],
    memory: MemoryLog | None = None,
    machine: Machine = MACHINE,
) -> LogSession:
    """Makes a logger with its files in directory ``out``, or without files if that is None.

    Args:
        scene: the resolved scene; ``run.log`` decides what is logged.
        attachments: text files to put into the log, by name (the scene as TOML, plugins).
        memory: where to log without a directory; if None, only the books are kept then.

    Raises:
        LogError: the log cannot be created.
    """
    detail = scene.run.log
    file = Log(out / LOG, machine=machine) if out and detail != "none" else None
    log = file or memory
    if log is None or detail == "none":
        return LogSession(Logger(scene, time, None), None, out, machine)
    for name, text in attachments.items():
        log.attach(name, "text/plain", text.encode())
    channels = Channels(log, time, every_step=detail == "steps")
    return LogSession(Logger(scene, time, channels), file, out, machine)
