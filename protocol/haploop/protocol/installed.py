"""Classes that a scene may name besides haploop's own: from installed packages, by entry points, and plugin files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints

Cached = TypeVar("Cached", bound=Callable[..., Any])
# Classes by group and name, and the text and name of each file that they came from.
Brought = Mapping[str, Mapping[str, type]]
_brought: dict[str, dict[str, type]] = {}
_sources: dict[type, tuple[str, str]] = {}
_caches: list[Callable[[], None]] = []


class PluginError(Exception):
    """A plugin that cannot be used; the message says why."""


def loaded(entry: EntryPoint) -> Any:
    """Returns what an entry point names.

    Raises:
        PluginError: it cannot be imported; the message gives its name, its group and where it should be.
    """
    try:
        return entry.load()
    except Exception as error:
        raise not_loaded(entry.name, entry.value, entry.group, error) from error


def not_loaded(name: str, place: str, group: str, error: Exception) -> PluginError:
    """Returns the error of an entry point that cannot be used; ``place`` is "module:object"."""
    return PluginError(
        f"An installed package names {name!r} ({place}) under {group}, which does not load: "
        f"{type(error).__name__}: {error}. Repair or uninstall that package."
    )


def entry_points_of(group: str) -> EntryPoints:
    """Returns the entry points of a group such as ``haploop.effects``."""
    return _all().select(group=group)


@cache
def _all() -> Any:
    """Returns every entry point; looks them up once, since that reads a file of every installed package."""
    from importlib.metadata import entry_points

    return entry_points()


def brought(group: str) -> Mapping[str, type]:
    """Returns the classes that plugin files have brought into this process, by the name that a scene gives them."""
    return _brought.get(group, {})


def all_brought() -> Brought:
    """Returns the classes that files have brought, of every group, so that ``bring`` can make them known again."""
    return {group: dict(classes) for group, classes in _brought.items()}


def sources_brought() -> tuple[tuple[str, str], ...]:
    """Returns text and name of the files that brought the classes known here, for other processes."""
    known = [made for classes in _brought.values() for made in classes.values()]
    return tuple(dict.fromkeys(_sources[made] for made in known if made in _sources))


def bring(classes: Brought, source: tuple[str, str] | None = None) -> None:
    """Makes classes known to this process by group and name; a new class replaces a known one of the same name."""
    for group, named in classes.items():
        if any(_brought.get(group, {}).get(name) is not made for name, made in named.items()):
            _brought.setdefault(group, {}).update(named)
            forget()
        if source:
            _sources.update(dict.fromkeys(named.values(), source))


def take_back(known: Brought) -> None:
    """Makes known what ``all_brought`` returned, and nothing else."""
    _brought.clear()
    _brought.update({group: dict(classes) for group, classes in known.items()})
    forget()


def forget() -> None:
    for clear in _caches:
        clear()


def cached_until_brought(function: Cached) -> Cached:
    """Caches what a function returns, as ``functools.cache`` does, until a file brings something it may depend on."""
    kept: Any = cache(function)
    _caches.append(kept.cache_clear)
    return kept
