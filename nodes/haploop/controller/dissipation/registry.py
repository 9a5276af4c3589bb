"""Finds the kinds of element: installed under the entry-point group, or in a file named at launch."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from dataclasses import MISSING
from pathlib import Path
from pkgutil import resolve_name

from haploop.controller.dissipation.element import ASKABLE, Element
from haploop.protocol.installed import Brought, entry_points_of, not_loaded
from haploop.protocol.plugin_file import ELEMENTS, PluginError, bring_file, bring_source
from haploop.protocol.quantity import Quantity

# Books are named after the kind, numbered from the second one of a kind on; a dot ends the name of an account.
_KIND = re.compile(r"(?!.*-\d+$)\w[\w-]*")
_TAKEN = ("wall", "earlier", "none")


def installed() -> dict[str, str]:
    """Returns "module:class" of every installed kind by name."""
    found = sorted(entry_points_of(ELEMENTS), key=lambda point: point.name)
    return {point.name: f"{point.module}:{point.attr}" for point in found}


def registry(
    plugin_files: list[Path] | None = None, places: Mapping[str, str] | None = None
) -> dict[str, type[Element]]:
    """Returns every kind by name: the installed ones, then those of ``plugin_files``, which take precedence.

    Args:
        places: what ``installed`` returned elsewhere; another search would read a file of every installed package.

    Raises:
        PluginError: an entry point or a file does not load, or holds no element.
    """
    kinds: dict[str, type[Element]] = {}
    for name, place in (installed() if places is None else places).items():
        try:
            kinds[name] = checked(resolve_name(place), f"entry point {name} = {place}")
        except Exception as error:
            raise not_loaded(name, place, ELEMENTS, error) from error
    for path in plugin_files or []:
        kinds.update(load_plugin(path))
    return kinds


def load_plugin(path: Path) -> dict[str, type[Element]]:
    """Returns the elements a Python file defines, by kind, and registers what else it brings, as ``bring_file`` does.

    Raises:
        PluginError: the file cannot be read or run, or defines nothing usable.
    """
    return _elements_of(bring_file(path), str(path))


def load_source(source: str, origin: str) -> dict[str, type[Element]]:
    """Does with the text of the file ``origin`` what ``load_plugin`` does with a file."""
    return _elements_of(bring_source(source, origin), origin)


def _elements_of(found: Brought, origin: str) -> dict[str, type[Element]]:
    elements = [checked(element, origin) for element in found.get(ELEMENTS, {}).values()]
    return {element.kind: element for element in elements}


def checked(element: object, origin: str) -> type[Element]:
    """Returns ``element`` if it is one, with a kind, a force and properly declared parameters.

    Raises:
        PluginError: it is not; ``origin`` says where it came from.
    """
    if not (inspect.isclass(element) and issubclass(element, Element)):
        raise PluginError(f"{origin} must name a class derived from Element, but gives {element!r}.")
    if not isinstance(getattr(element, "kind", None), str):
        raise PluginError(f'{element.__name__} in {origin} has no kind; write kind = "my-element" in the class.')
    if not _KIND.fullmatch(element.kind) or element.kind in _TAKEN:
        raise PluginError(
            f"The kind of {element.__name__} in {origin} is {element.kind!r}, but its books are named by it: it may "
            "contain only letters, digits, _ and -, and must neither end in a dash and a number, as the books of a "
            f"second element do, nor be one of {', '.join(_TAKEN)}."
        )
    if inspect.isabstract(element):
        raise PluginError(f"{element.__name__} in {origin} has no method force(self, motion).")
    if unknown := [name for name in element.asks if name not in ASKABLE]:
        raise PluginError(
            f"{element.__name__} in {origin} asks for {unknown[0]!r}, which is not known; it may ask for "
            f"{', '.join(ASKABLE)}."
        )
    if missing := [name for name in element.columns if name not in getattr(element.memory, "_fields", ())]:
        raise PluginError(
            f"{element.__name__} in {origin} shows {missing[0]!r} in the log, which must be a field of its memory, "
            "a NamedTuple."
        )
    try:
        declared = element.parameters()
    except TypeError as error:
        raise PluginError(f"{origin}: {error}") from error
    for name, (quantity, default) in declared.items():
        if default is not MISSING and (why := _complaint(quantity, default)):
            raise PluginError(f"{origin}: the default of {name} of {element.__name__} is {default!r}. It {why}.")
    return element


def _complaint(quantity: Quantity, default: object) -> str | None:
    """Returns why a default cannot be the parameter's value, None if it can."""
    if quantity.choices:
        is_one = any(choice.__class__ is default.__class__ and choice == default for choice in quantity.choices)
        return None if is_one else f"must be {' or '.join(map(quantity.text, quantity.choices))}"
    try:
        if quantity.whole and float(default) % 1:  # pyright: ignore[reportArgumentType]
            return "must be a whole number"
        return quantity.complaint(float(default))  # pyright: ignore[reportArgumentType]
    except (TypeError, ValueError, OverflowError):
        return "must be a number"
