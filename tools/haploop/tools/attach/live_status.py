"""The present state of an observed run: the newest message of each kind that was received from it."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import numpy as np

from haploop.logger.summary import Summary, awaits_verdict
from haploop.protocol.changes import Event
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.telemetry import Block
from haploop.protocol.transport.wire import Frame, Message

# Wall time over which the real-time factor is taken.
_FACTOR_OVER_S = 2.0


class LiveStatus:
    """Keeps the newest message of each kind, and decodes it only when asked.

    Attributes:
        tick: every tick before this one has been received.
        factor: simulated over wall time of the last 2 s; None while nothing moves.
        changes: every event so far, (tick, event) in order.
        skipped_ticks: ticks whose telemetry never came.
        figures: verdict, oscillation_m, residual_J and balance so far, in the end those of the summary; empty before
            any.
        is_judged: whether the verdict is that of the ended run, held still and pushed.
        is_awaited: whether its launcher has yet to judge it.
        ended: how the run ended, in a word; "" while it goes on.
        why: a sentence on that; "" for none.
    """

    def __init__(self, run_id: str, welcome: Message) -> None:
        self.run_id = run_id
        self.time = Timebase(**welcome["timebase"])
        self._scene = Scene.from_dict(welcome["scene"])
        self.title = self._scene.title
        self.tick = 0
        self.paused = False
        self.factor: float | None = None
        self.changes: list[tuple[int, Event]] = []
        self.skipped_ticks = 0
        self.ended = self.why = ""
        self._newest: dict[str, Block] = {}
        self.figures: Message = {}
        self.is_judged = self.is_awaited = False
        self._motion_at_start: dict[str, float] = {}
        self._marks: deque[tuple[float, int]] = deque()

    @property
    def t_s(self) -> float:
        return self.tick / self.time.control_rate

    def ingest(self, frames: Iterable[tuple[str, Frame]], now: float) -> None:
        """Takes messages, (role, message); ``now`` is wall time, s."""
        for role, frame in frames:
            if frame.name == "STATE":
                self._note_state(role, *frame.fields)
            elif frame.name.endswith("_BLOCK"):
                self._newest[frame.name] = frame.as_dict()
                self.tick = max(self.tick, frame.fields[0] + frame.fields[1])
        self.figures = self._newest.get("ENERGY_BLOCK", {}).get("status") or self.figures
        self._marks.append((now, self.tick))
        while len(self._marks) > 2 and now - self._marks[1][0] >= _FACTOR_OVER_S:
            self._marks.popleft()
        began, tick = self._marks[0]
        moved = self.tick - tick
        self.factor = moved / self.time.control_rate / (now - began) if moved and now > began else None

    def _note_state(self, role: str, tick: int, state: Message) -> None:
        """Notes the STATE of a publisher, all there is to see of a run that stands still."""
        self.tick = max(self.tick, tick)
        if role == "plant":
            self._motion_at_start = {name: state[name] for name in ("x", "v", "force")}
        elif role == "controller" and state["history"]:
            self._newest["CONTROLLER_BLOCK"] = state["history"][-1]
        elif role == "logger":
            self.figures = state

    def note_event(self, tick: int, event: Event) -> None:
        self.changes.append((tick, event))
        if "pause" in event or "step" in event:
            self.paused = True
        elif "resume" in event:
            self.paused = False

    def end(self, failure: str, summary: Summary | None) -> None:
        """Ends the run, with the figures of its summary if there is one; ``failure`` says why it ended early."""
        self.paused, self.factor = False, None
        if summary is None:  # on another machine, or never written
            self.ended, self.why = ("failed" if failure else "ended"), failure
            return
        self.ended, self.why = summary["ended"], summary["why"] or failure
        self.is_judged, self.is_awaited = "stability" in summary, awaits_verdict(self._scene, summary)
        self.figures = {"verdict": summary["verdict"], "oscillation_m": summary["window"]["oscillation_m"]}
        self.figures |= {name: summary["energy"].get(name) for name in ("residual_J", "balance")}

    def last(self, frame: str) -> dict[str, float]:
        columns = self._newest.get(frame, {}).get("columns", {})
        return {name: float(np.frombuffer(data, "<f8")[-1]) for name, data in columns.items() if data}

    def motion(self) -> dict[str, float]:
        """Returns x (m), v (m/s) and force (N) of the device at the end of the last block."""
        return self.last("PLANT_BLOCK") or self._motion_at_start

    def penetration_m(self) -> float | None:
        """Returns the penetration of the wall, negative outside; None without a wall, or before any telemetry."""
        wall, x = self._newest.get("CONTROLLER_BLOCK", {}).get("wall"), self.motion().get("x")
        return (x - wall["position"]) * wall["into_wall"] if wall and wall["into_wall"] and x is not None else None

    def parts(self) -> dict[str, float]:
        """Returns the commanded force of the wall and of each element at the last tick, N, by name in their order."""
        forces = self.last("CONTROLLER_BLOCK")
        names = {"wall": "wall"} if self.penetration_m() is not None else {}
        for index, element in enumerate(self._newest.get("CONTROLLER_BLOCK", {}).get("elements", [])):
            kind = element["kind"]
            names[f"dissipation.{index}"] = kind if kind not in names.values() else f"{kind} ({index})"
        return {name: forces[column] for column, name in names.items() if column in forces}
