"""Names of the books of elements: their kind and, where a kind has several, the time at which each was opened."""

from __future__ import annotations

import re
from collections import Counter

from haploop.view.store.history import EARLIER, TRUE, WALL_BOOK, History

_NUMBER = re.compile(r"-\d+$")


def kind_of(book: str) -> str:
    """Returns the kind of the element that ``damping-2`` is the book of."""
    return _NUMBER.sub("", book)


def book_names(history: History) -> dict[str, str]:
    """Returns by book, without ``.true``, what it is called: ``damping``, or ``damping, from 1.2 s``; no two alike.

    Every change of a parameter opens a book. One that was open when the page joined is of ``earlier``.
    """
    wanted = [name.removesuffix(TRUE) for name in history.energy.names if name.endswith(TRUE)]
    books = [name for name in wanted if f"{name}{TRUE}" not in (WALL_BOOK, EARLIER)]
    many = Counter(kind_of(name) for name in books)
    named, seen = {}, Counter[str]()
    for name in books:
        tick, kind = history.opened.get(f"{name}{TRUE}"), kind_of(name)
        when = "earlier" if tick is None else f"from {tick / history.time.control_rate:.6g} s"
        told = f"{kind}, {when}" if many[kind] > 1 else kind
        seen[told] += 1
        named[name] = told if seen[told] == 1 else f"{told} ({seen[told]})"
    return named
