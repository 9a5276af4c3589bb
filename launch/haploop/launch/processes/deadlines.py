"""Deadlines of the run's own nodes, whose silence ends the run, and of observers, without which it continues."""

from __future__ import annotations

import sys
from collections.abc import Mapping

from haploop.launch.clock.clock import Clock
from haploop.launch.clock.roster import Node, Roster
from haploop.launch.clock.server import ClockServer
from haploop.launch.processes.children import Child
from haploop.launch.processes.standstill import START_DEADLINE_S, Standstill, late_observers
from haploop.launch.processes.strain import NOBODY, Strain
from haploop.launch.spec import RunFailed, RunSpec
from haploop.protocol.transport.machine import Machine

# How long, s, the last message of a process that has exited may still be on its way.
LAST_WORDS_S = 1.0
# Silent attached nodes are asked at this interval, s, whether they are still there.
_PROBE_S = 0.2
# A controller that is silent for longer than this, s, is reported, even if its deadline is far off.
_TOLD_AFTER_S = 5.0
# If the launcher itself was held up for longer, s (stopped, swapped out, loading a plugin), no node is blamed for it.
_HELD_UP_S = 1.0


class Deadlines:
    """Watches which nodes are silent, from the start of the processes on.

    Args:
        children: the run's processes that the launcher has started, by role.
    """

    def __init__(
        self, spec: RunSpec, clock: Clock, server: ClockServer, children: Mapping[str, Child], machine: Machine
    ) -> None:
        self._spec, self._server, self._children, self._machine = spec, server, children, machine
        self._deadline_s = spec.scene.run.deadline
        self._standstill = Standstill(server.roster, clock, self._deadline_s)
        self._started = self._looked = machine.now()
        self._probe_due = 0.0
        # By the time at which the controller was last heard from: when it was roused, whether its silence was reported,
        # whether its stack was shown.
        self._roused: dict[float, float] = {}
        self._told: set[float] = set()
        self._shown: set[float] = set()
        self._strain = Strain()

    def check(self) -> None:
        """Raises RunFailed if one of the run's own nodes has been silent for too long, or has done nothing."""
        now, roster = self._look()
        if not roster.joined():
            limit_s = max(self._deadline_s, START_DEADLINE_S)
            if now - self._started > limit_s:
                missing = [role for role in self._children if not roster.own(role)]
                names = " and the ".join(map(roster.label, missing))
                refused = [roster.refused[role] for role in missing if role in roster.refused]
                raise RunFailed(" ".join([f"The {names} did not join within {limit_s:g} s.", *refused]))
            return
        for node in roster.nodes.values():
            if node.is_gone and roster.is_external(node.role) and not node.done:
                raise RunFailed(f"The {roster.label(node.role)} is gone; {self.where()}")
        if self._spec.programs or self._server.results:  # once one is done, others may wait for what never comes
            self._standstill.check(now)
        # Nodes may still be loading, which keeps a machine busy; the scene's deadline is meant for a loop that runs.
        start_s = self._deadline_s if roster.common_tick() else max(self._deadline_s, START_DEADLINE_S)
        for node in roster.silent(now, min(self._deadline_s / 2, _TOLD_AFTER_S)):
            if not node.is_own:
                continue
            pid = self._children[node.role].pid if node.role in self._children else NOBODY
            self._strain.note(pid, node.heard, now)
            # Once all are ready, haploop's own controller has loaded all: it is at its first ticks, or reports waiting.
            is_ours = node.role == "controller" and not roster.is_external(node.role)
            is_at_work = is_ours and roster.all_own("ready")
            deadline_s = self._deadline_s if is_at_work else start_s
            if is_at_work:
                self._tell(node, now)
            if now - node.heard > deadline_s and not self._may_rouse(node, now):
                ended = "given up" if roster.is_external(node.role) else "ended"
                raise RunFailed(
                    f"The {roster.label(node.role)} has not answered for {deadline_s:g} s and was {ended}; "
                    f"{self.where()}{self._strain.told(pid, now)} A longer wait can be set with run.deadline."
                )
        self._check_observers(now)

    def _tell(self, node: Node, now: float) -> None:
        """Reports a continuing silence once if the deadline is far off: somebody waits at a terminal."""
        if _TOLD_AFTER_S < now - node.heard < self._deadline_s and node.heard not in self._told:
            self._told.add(node.heard)
            label, limit_s = self._server.roster.label(node.role), self._deadline_s
            print(
                f"The {label} has not answered for {_TOLD_AFTER_S:g} s; run.deadline is {limit_s:g} s.", file=sys.stderr
            )

    def _look(self) -> tuple[float, Roster]:
        """Returns the wall time, s, and the roster, in which no node is blamed for a hold-up of the launcher itself."""
        now, roster = self._machine.now(), self._server.roster
        held_up_s, self._looked = now - self._looked, now
        if held_up_s > _HELD_UP_S:
            self._started += held_up_s
            self._standstill.discount(held_up_s)
            roster.discount_silence(held_up_s)
        return now, roster

    def check_observers(self, ended_at: float) -> None:
        """Removes observers for which a run that ended at ``ended_at``, wall time in s, would wait in vain."""
        now, _ = self._look()
        self._check_observers(now, ended_at)

    def _check_observers(self, now: float, ended_at: float | None = None) -> None:
        for node, why in late_observers(self._server.roster, now, self._deadline_s, ended_at):
            self._server.drop(node, why)
        if now >= self._probe_due:
            self._probe_due = now + _PROBE_S
            self._server.probe(self._server.roster.silent(now, _PROBE_S))

    def _may_rouse(self, node: Node, now: float) -> bool:
        """Rouses a hanging controller, once; tells whether a last message from it may still come."""
        if node.role != "controller" or node.role in self._spec.programs:
            return False
        roused = self._roused.setdefault(node.heard, now)
        if roused == now:
            self._children[node.role].rouse()
        elif now - roused > LAST_WORDS_S / 2 and node.heard not in self._shown:
            self._shown.add(node.heard)
            self._children[node.role].show_stack()
        return now - roused < LAST_WORDS_S

    def where(self) -> str:
        """Returns how far all nodes had come, as the end of a sentence."""
        tick = self._server.roster.common_tick()
        rate = self._spec.scene.clock.control_rate
        return f"the last tick all nodes had done is {tick} ({tick / rate:g} s)."
