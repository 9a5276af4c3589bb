"""The pace of a run: when each tick is due by the wall clock, how late it was done, and what real time was lost."""

from __future__ import annotations

import math
from collections import Counter, deque
from typing import Any

# Simulated seconds per wall second that may be asked for.
SLOWEST, FASTEST = 1e-6, 1e6
# Grants are at least this far apart, s of wall time: up to 2 ticks a ms are granted one by one, faster ones in blocks.
LEAST_GRANT_S = 0.0005
# A hold-up of the ticks by up to this, s of wall time, is made up for at once; the rest of the time is lost.
CATCH_UP_S = 0.02
# A tick counts as late if it is done later than this, s, after it was due, or than a period if that is longer.
_LATE_S = 0.001
# Lateness is counted in classes, each wider than the one before by this factor.
_FINEST_S, _FACTOR = 1e-6, 1.05
# The entries of ``lateness`` of a run at a pace, or of one whose plant owns the time; absent for any other run.
LATENESS = {
    "ticks": "ticks whose lateness is known: at a pace, from when a tick was due until it was done; where the plant "
    "owns the time, from when its sample was due until an answer came",
    "median_s": "half of the ticks were no later than this; accurate to 5 % at a pace",
    "percent_99_s": "99 % of the ticks were no later than this; accurate to 5 % at a pace",
    "percent_99_9_s": "99.9 % of the ticks were no later than this; only where the plant owns the time",
    "most_s": "lateness of the latest tick",
    "late_ticks": "ticks that were later than `late_s`",
    "late_s": "lateness beyond which a tick counts as late; at a pace 1 ms, or a period where that is longer",
    "lost_s": "real time by which the schedule was delayed, since a stall is not made up for",
    "clock": "`plant` where the plant owned the time; absent otherwise",
}


class PaceError(ValueError):
    """A pace that cannot be kept; the message says which paces can."""


def pace_of(pace: object) -> float:
    """Returns the requested pace, infinite for ``free``; raises PaceError if it is not a pace."""
    if pace == "free":
        return math.inf
    if isinstance(pace, bool) or not isinstance(pace, int | float) or not SLOWEST <= pace <= FASTEST:
        given = repr(pace)[:40]
        raise PaceError(f"A pace is a number from {SLOWEST:g} to {FASTEST:g}, or free, but {given} was asked for.")
    return pace


class Pace:
    """Says which ticks are due, and keeps count of how late they are done.

    Tick k is due (k - first tick) / (control rate * pace) after the first. A run held up for longer than
    ``CATCH_UP_S`` makes up for that much; all further ticks become due later by the rest, which is lost.

    Attributes:
        rate: simulated seconds per wall second; infinite: every tick is due at once.
        lost_s: wall time by which the schedule was put off.
    """

    def __init__(self, control_rate: int, rate: float) -> None:
        self._control_rate = control_rate
        self.lost_s = 0.0
        self._late: Counter[int] = Counter()
        self._most_s, self._too_late = 0.0, 0
        self._awaited: deque[tuple[int, int, float, float]] = deque()
        self.set(rate)

    def set(self, rate: float) -> None:
        """Sets another rate, infinite for no pace; raises PaceError if it cannot be kept."""
        self.rate = rate if rate == math.inf else pace_of(rate)
        self._period_s = 1.0 / (rate * self._control_rate)
        self._late_s = max(_LATE_S, self._period_s)
        self._least = self._ticks(LEAST_GRANT_S)
        self.most_at_once = max(self._least, self._ticks(CATCH_UP_S))
        self.anew()

    def _ticks(self, seconds: float) -> int:
        return 1 if math.isinf(self.rate) else max(1, math.floor(seconds / self._period_s))

    def anew(self) -> None:
        """Restarts the schedule with the next tick asked for; time spent standing still is not made up for."""
        self._from: tuple[float, int] | None = None

    def _due(self, tick: int, now: float) -> float:
        began, first = self._from = self._from or (now, tick)
        return began + (tick - first) * self._period_s

    def allowed(self, until: int, now: float) -> int:
        """Returns the tick up to which all are due at wall time ``now``, s; ``until`` if that is too early to grant."""
        behind = math.floor((now - self._due(until, now)) / self._period_s + 1e-6) + 1
        return until + behind if behind >= self._least else until

    def grant(self, until: int, limit: int, now: float) -> int:
        """Grants, and notes, the ticks from ``until`` on as far as they are due and ``limit`` allows.

        Returns the tick up to which they are granted.
        """
        due, allowed = self._due(until, now), self.allowed(until, now)
        surplus = allowed - until - self.most_at_once
        if surplus > 0:
            began, first = self._from or (now, until)
            self._from = began + surplus * self._period_s, first
            self.lost_s += surplus * self._period_s
        granted = max(until, min(limit, until + self.most_at_once, allowed))
        if granted > until:
            self._awaited.append((until, granted, due, self._period_s))
        return granted

    def wait_s(self, until: int, now: float) -> float:
        """Returns the time in s until the next grant is due."""
        if not self._from:
            return 0.0
        return max(0.0, self._due(until, now) + (self._least - 1) * self._period_s - now)

    def done(self, tick: int, now: float) -> None:
        """Notes that every tick before ``tick`` is done at wall time ``now``."""
        while self._awaited and self._awaited[0][0] < tick:
            first, end, due, period_s = self._awaited.popleft()
            for late_s in (now - due - place * period_s for place in range(min(end, tick) - first)):
                self._late[max(0, math.ceil(math.log(max(late_s, _FINEST_S) / _FINEST_S, _FACTOR)))] += 1
                self._most_s = max(self._most_s, late_s)
                self._too_late += late_s > self._late_s
            if end > tick:
                self._awaited.appendleft((tick, end, due + (tick - first) * period_s, period_s))

    def lateness(self) -> dict[str, Any]:
        """Returns how late the ticks were done, by keys of ``LATENESS``; {} if none had a pace to keep."""
        ticks = self._late.total()
        if not ticks:
            return {}
        quantiles = {name: self._quantile(share * ticks) for name, share in (("median_s", 0.5), ("percent_99_s", 0.99))}
        late = {"late_ticks": self._too_late, "late_s": self._late_s, "lost_s": self.lost_s}
        return {"ticks": ticks, **quantiles, "most_s": max(0.0, self._most_s), **late}

    def _quantile(self, rank: float) -> float:
        seen = 0
        for place in sorted(self._late):
            seen += self._late[place]
            if seen >= rank:
                return min(_FINEST_S * _FACTOR**place, max(0.0, self._most_s))
        return self._most_s
