"""The entry points of installed packages: elements, estimators, integrators, effects and forces that they offer."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from importlib.metadata import EntryPoints


def entry_points_of(group: str) -> EntryPoints:
    """Returns the entry points of a group such as ``haploop.effects``."""
    return _all().select(group=group)


@cache
def _all() -> Any:
    """Every entry point; looked for once, since that reads a file of each package there is."""
    from importlib.metadata import entry_points

    return entry_points()
