"""Cutting a sweep into parts: small ones first, so that progress shows, then as large as the time they take allows."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from haploop.launch.batch.run import FEWEST

# Most items in a part, and how much longer the next may be than any before.
MOST, GROWTH = 1024, 8
# An array costs much the same for one scene and for some two hundred: the first part, and the least later on.
FIRST, LEAST = 64, 256
# Seconds that a part should take: at least, at most at the beginning, and at most ever.
LEAST_S, SHORT_S, LONG_S = 0.2, 2.0, 60.0
# A part may take this fraction of the time gone by, so that a long sweep does not leave a heap of small files.
FRACTION = 0.02


class Group(NamedTuple):
    """Items that are run together where that can be, or that are known to be run one by one; a range will do."""

    items: Sequence[Any]
    together: bool


@dataclass
class _Pace:
    """Sizes of parts of one sort: the most and the least the next may have, and the seconds an item took."""

    largest: int
    least: int
    each_s: float = 0.0


class Sizes:
    """Finds the number of items the next part should have, of ``most``, which memory is proportional to.

    Args:
        count: of all items, so that no worker has to wait long for another in the end; None where it is not known.
    """

    def __init__(self, workers: int, count: int | None = None, most: int = MOST) -> None:
        self._workers, self._left, self._most = workers, count, most
        self._paces = {True: _Pace(FIRST, LEAST), False: _Pace(1, 1)}
        self._began = time.monotonic()

    def next(self, together: bool) -> int:
        """Returns the size of the next part, at least 1."""
        pace = self._paces[together]
        size = min(self._most, pace.largest)
        target_s = min(LONG_S, max(SHORT_S, FRACTION * (time.monotonic() - self._began)))
        if pace.each_s:
            size = min(size, int(target_s / pace.each_s))
        if self._left is not None:
            worthwhile = int(LEAST_S / pace.each_s) if pace.each_s else 0
            size = min(size, max(math.ceil(self._left / (2 * self._workers)), worthwhile, pace.least))
        return max(1, size)

    def taken(self, items: int) -> None:
        if self._left is not None:
            self._left = max(0, self._left - items)

    def took(self, part: Group, seconds: float) -> None:
        """Notes the seconds a part took; the next may be longer."""
        pace = self._paces[part.together]
        pace.each_s = seconds / len(part.items)
        pace.largest = max(pace.largest, len(part.items) * GROWTH)


def cut(groups: Iterable[Group], sizes: Sizes) -> Iterator[Group]:
    for items, together in groups:
        together = together and len(items) >= FEWEST
        first = 0
        while first < len(items):
            part = items[first : first + sizes.next(together)]
            sizes.taken(len(part))
            yield Group(part, together)
            first += len(part)


def grouped(
    items: Iterable[Any], key: Callable[[Any], Hashable], window: int = 4 * MOST
) -> Iterator[tuple[Any, list[Any]]]:
    """Yields each key with its items, looking so many items ahead."""
    source = iter(items)
    while block := list(itertools.islice(source, window)):
        groups: dict[Hashable, list[Any]] = {}
        for item in block:
            groups.setdefault(key(item), []).append(item)
        yield from groups.items()
