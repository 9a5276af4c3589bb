"""The time of a device that is not simulated: when its ticks are due, and how late the answers to its samples were."""

import math
import time
from collections import Counter
from itertools import accumulate

# Ticks held up for no longer than this are caught up at once, s; any further time is lost.
CATCH_UP_S = 0.02
# Time between reports of the figures, s.
EVERY_S = 1.0


class Schedule:
    """When each tick is due, and how long after its tick each answer arrived, in classes 5 % wide.

    Ticks are due every period, whatever happens to them. Time for which this process was held up beyond CATCH_UP_S is
    lost: all later ticks are due later by that time.
    """

    def __init__(self, period_s, late_s):
        self._period_s, self._late_s = period_s, late_s
        self._began, self._lost_s, self._said = None, 0.0, 0.0
        self._classes, self._late, self._most_s = Counter(), 0, 0.0

    def begin(self, tick):
        """Begins a tick now; the first one begins the schedule."""
        now = time.monotonic()
        if self._began is None:
            self._began = now - tick * self._period_s
        lost_s = max(0.0, now - self.due(tick) - CATCH_UP_S)
        self._began += lost_s
        self._lost_s += lost_s

    def due(self, tick):
        """Returns when a tick is due, s of time.monotonic()."""
        return self._began + tick * self._period_s

    def answered(self, tick, is_late):
        """Records that the answer to the sample of a tick has come; late if its force was to act before."""
        after_s = time.monotonic() - self.due(tick)
        self._classes[math.ceil(math.log(max(after_s, 1e-6) / 1e-6, 1.05))] += 1
        self._late, self._most_s = self._late + is_late, max(self._most_s, after_s)

    def says_so(self):
        """Tells whether it is time to report the figures, which is once a second."""
        if (now := time.monotonic()) < self._said + EVERY_S:
            return False
        self._said = now
        return True

    def figures(self):
        """Returns the same figures as a run at the launcher's pace reports, in s; {} before the first answer."""
        ticks = self._classes.total()
        if not ticks:
            return {}
        shares = {"median_s": 0.5, "percent_99_s": 0.99, "percent_99_9_s": 0.999}
        figures = {name: min(self._quantile(share * ticks), self._most_s) for name, share in shares.items()}
        late = {"most_s": self._most_s, "late_ticks": self._late, "late_s": self._late_s, "lost_s": self._lost_s}
        return {"ticks": ticks, **figures, **late}

    def _quantile(self, rank):
        ordered = sorted(self._classes)
        upto = accumulate(self._classes[place] for place in ordered)
        return next(1e-6 * 1.05**place for place, seen in zip(ordered, upto, strict=True) if seen >= rank)
