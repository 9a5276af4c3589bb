"""The name that was meant, where an unknown one is given."""

from __future__ import annotations

from collections.abc import Iterable

# Names less alike than this are different words: "spring" and "damping" are 0.62.
_ALIKE = 0.65
# So many letters at the beginning of a name are enough where one name alone has them, as "damp" of "damper".
_BEGINS = 4


def nearest(name: object, allowed: Iterable[str]) -> str | None:
    """Returns the allowed name closest to ``name``, if one is close, or the only one that begins alike."""
    import difflib

    allowed = list(allowed)
    whole = difflib.get_close_matches(str(name), allowed, n=1, cutoff=_ALIKE)
    alike = [one for one in allowed if len(str(name)) >= _BEGINS and one.startswith(str(name)[:_BEGINS])]
    whole = whole or (alike if len(alike) == 1 else [])
    if whole or "." in str(name):
        return next(iter(whole), None)
    # Of a dotted key, people name only the last part.
    ends = {one.rpartition(".")[2].lower(): one for one in reversed(allowed) if "." in one}
    return next((ends[end] for end in difflib.get_close_matches(str(name).lower(), ends, n=1, cutoff=_ALIKE)), None)


def meant(name: object, allowed: Iterable[str]) -> str:
    """Returns " (did you mean NAME?)" with the nearest of the allowed names; "" if none is close."""
    found = nearest(name, allowed)
    return f" (did you mean {found}?)" if found else ""
