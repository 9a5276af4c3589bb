"""The one table of processes that make a run."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Process:
    """One row of the table.

    Attributes:
        role: its name in messages, logs and errors.
        module: started as ``python -m module``.
        binds: channel -> file name of the socket it binds, ``.sock`` in the run's directory of sockets.
        on_loop_core: whether it ping-pongs at every tick, and so shares one core with its partner.
    """

    role: str
    module: str
    binds: dict[str, str]
    on_loop_core: bool


PROCESSES: dict[str, Process] = {
    process.role: process
    for process in (
        Process("plant", "haploop.plant.node", {"loop": "loop", "telemetry": "plant"}, on_loop_core=True),
        Process("controller", "haploop.controller.node", {"telemetry": "controller"}, on_loop_core=True),
        Process("logger", "haploop.logger.node", {"telemetry": "logger"}, on_loop_core=False),
    )
}

# Attached nodes join under this role, or any other that is not in the table.
OBSERVER = "observer"
