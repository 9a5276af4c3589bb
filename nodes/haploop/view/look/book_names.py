"""Names of the books of elements: their kind and, where a kind has several, the time at which each was opened."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType

from haploop.view.store.history import EARLIER, TRUE, WALL_BOOK, History

_NUMBER = re.compile(r"-\d+$")


@lru_cache(maxsize=256)
def kind_of(book: str) -> str:
    """Returns the kind of the element to which a book such as ``damping-2`` belongs."""
    return _NUMBER.sub("", book)


def book_names(history: History) -> Mapping[str, str]:
    """Returns the shown names by book, without ``.true``: ``damping``, or ``damping, from 1.2 s``; no two are alike.

    Every change of a parameter opens a book. One that was open when the page joined is named ``earlier``.
    """
    wanted = tuple(name for name in history.energy.names if name.endswith(TRUE))
    return _named(wanted, tuple(map(history.opened.get, wanted)), history.time.control_rate)


@lru_cache(maxsize=64)
def _named(columns: tuple[str, ...], opened: tuple[int | None, ...], rate: int) -> Mapping[str, str]:
    """Names the books in these columns, opened at these ticks; once, as long as successive pictures have the same."""
    books = {
        name.removesuffix(TRUE): tick
        for name, tick in zip(columns, opened, strict=True)
        if name not in (WALL_BOOK, EARLIER)
    }
    many = Counter(map(kind_of, books))
    named, seen = {}, Counter[str]()
    for name, tick in books.items():
        kind = kind_of(name)
        when = "earlier" if tick is None else f"from {tick / rate:.6g} s"
        told = f"{kind}, {when}" if many[kind] > 1 else kind
        seen[told] += 1
        named[name] = told if seen[told] == 1 else f"{told} ({seen[told]})"
    return MappingProxyType(named)
