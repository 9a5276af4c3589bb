"""Runs that stand still: a run ends if its own nodes let no tick be done, and continues without an observer."""

from __future__ import annotations

from haploop.launch.clock.clock import Clock
from haploop.launch.clock.roster import Node, Roster
from haploop.launch.spec import RunFailed

# What a node may take to start, s.
START_DEADLINE_S = 20.0

_WITHOUT_YOU = "the run continues without you."
_ENDS_WITHOUT_YOU = "the rest is no longer kept for you."


def late_observers(
    roster: Roster, now: float, deadline_s: float, ended_at: float | None = None
) -> list[tuple[Node, str]]:
    """Returns the observers that hold a run back and are silent, or not ready for too long, each with a sentence.

    Args:
        now: wall time, s.
        deadline_s: how long an observer may be silent, or take nothing from a run that has ended, s.
        ended_at: wall time at which the run ended, s; None while it goes on.
    """
    late = []
    start_s = max(deadline_s, START_DEADLINE_S)  # loading keeps a busy machine busy; the deadline is for what runs
    for node in roster.nodes.values():
        if node.is_own or not node.lossless:
            continue
        if not node.ready:
            if now - node.joined > start_s:
                late.append((node, f"You were not ready within {start_s:g} s; {_WITHOUT_YOU}"))
        elif now - node.heard > deadline_s and node.tick <= roster.slowest():
            late.append((node, f"Nothing was heard from you for {deadline_s:g} s; {_WITHOUT_YOU}"))
        elif ended_at is not None and now - max(node.moved, ended_at) > deadline_s:
            late.append((node, f"You took nothing for {deadline_s:g} s after the end; {_ENDS_WITHOUT_YOU}"))
    return late


class Standstill:
    """Watches that granted ticks are done, and that what was done reaches the other nodes, including the end of a run.

    Args:
        deadline_s: how long it may last that nothing is done, once a tick has been done, s.
    """

    def __init__(self, roster: Roster, clock: Clock, deadline_s: float) -> None:
        self._roster, self._clock, self._deadline_s = roster, clock, deadline_s
        self._seen: object = None
        self._since = 0.0

    def discount(self, seconds: float) -> None:
        """Excludes some time, s, from the standstill."""
        self._since += seconds

    def check(self, now: float) -> None:
        """Raises RunFailed if nothing that is due was done for longer than the deadline; ``now`` is wall time, s."""
        roster, clock = self._roster, self._clock
        own = [node for node in roster.nodes.values() if node.is_own]
        is_due = not roster.all_own("ready") or roster.common_tick() < clock.until or clock.is_last
        seen = clock.until, clock.is_last, [(node.tick, node.ready, node.done) for node in own]
        if not is_due or seen != self._seen or any(node.is_own for node in roster.silent(now, self._deadline_s / 2)):
            self._seen, self._since = seen, now
            return
        has_begun = roster.common_tick() or any(node.done for node in own)
        deadline_s = self._deadline_s if has_begun else max(self._deadline_s, START_DEADLINE_S)
        if now - self._since > deadline_s:
            owed = " protocol/README.md says what a node owes the others." if roster.others_than("") else ""
            raise RunFailed(
                f"For {deadline_s:g} s no tick was done, though all nodes respond: {'; '.join(map(self._told, own))}."
                + owed
            )

    def _told(self, node: Node) -> str:
        state = "has done" if node.done else "is at" if node.ready else "is not ready at"
        waits = f" and waits for the {node.waits_for}" if node.waits_for and not node.done else ""
        return f"the {self._roster.label(node.role)} {state} tick {node.tick}{waits}"
