"""A register of the classes that a scene may name in one place."""

from __future__ import annotations

from collections.abc import Mapping
from pkgutil import resolve_name
from typing import Any, Generic, TypeVar

from haploop.protocol.installed import brought, cached_until_brought, entry_points_of, loaded

Kind = TypeVar("Kind")


class UnknownKind(KeyError):
    """Raised for a kind that a scene names but that is not available; the message says what to do."""

    def __str__(self) -> str:
        return str(self.args[0])


class Register(Generic[Kind]):
    """Walls, estimators or hand forces by name: those of haploop, of installed packages and of plugin files.

    Args:
        what: what one of them is called in messages.
        group: group of the entry points by which packages name theirs.
        own: haploop's own by name: the class, or "module:class", which is imported when it is used.
    """

    def __init__(self, what: str, group: str, own: Mapping[str, str | type[Kind]]) -> None:
        self.what, self.group, self._own = what, group, own
        self.all = cached_until_brought(self._all)

    def names(self) -> tuple[str, ...]:
        """Returns all names, those of other packages and of files last."""
        return tuple({**self._own, **dict.fromkeys(entry_points_of(self.group).names), **brought(self.group)})

    def find(self, name: str) -> type[Kind]:
        """Returns the class of a name; its module is imported here. One from a file takes precedence over others.

        Raises:
            UnknownKind: there is no class of this name.
            PluginError: an installed package names it, and it does not load.
        """
        found: Any
        if found := brought(self.group).get(name):
            return found
        if found := self._own.get(name):
            return resolve_name(found) if isinstance(found, str) else found
        for entry in entry_points_of(self.group):  # nothing is searched unless a class of another package is used
            if entry.name == name:
                return loaded(entry)
        raise UnknownKind(
            f'There is no {self.what} "{name}" here. It comes from a plugin file, which needs --plugin FILE, or from '
            "a package, which must be installed."
        )

    def _all(self) -> dict[str, type[Kind]]:
        """Returns every class by its name; all are imported."""
        return {name: self.find(name) for name in self.names()}
