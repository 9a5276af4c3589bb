"""Finding the kinds of element: installed under the entry-point group, or in a file named at launch."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Mapping
from contextlib import redirect_stdout
from dataclasses import MISSING
from pathlib import Path
from pkgutil import resolve_name
from types import ModuleType
from typing import Any

from haploop.controller.dissipation.element import ASKABLE, Element, places_of
from haploop.protocol.files import read_text
from haploop.protocol.installed import entry_points_of
from haploop.protocol.quantity import Quantity

ENTRY_POINT_GROUP = "haploop.dissipation"


class PluginError(Exception):
    """A plugin that cannot be used; the message says why."""


def installed() -> dict[str, str]:
    """Returns "module:class" of every installed kind by name."""
    found = sorted(entry_points_of(ENTRY_POINT_GROUP), key=lambda point: point.name)
    return {point.name: f"{point.module}:{point.attr}" for point in found}


def registry(
    plugin_files: list[Path] | None = None, places: Mapping[str, str] | None = None
) -> dict[str, type[Element]]:
    """Returns every kind by name: the installed ones, then those of ``plugin_files``, which win.

    Args:
        places: what ``installed`` returned elsewhere; to look for it anew reads a file of every package there is.

    Raises:
        PluginError: an entry point or a file does not load, or holds no element.
    """
    kinds: dict[str, type[Element]] = {}
    for name, place in (installed() if places is None else places).items():
        try:
            kinds[name] = checked(resolve_name(place), f"entry point {name} = {place}")
        except Exception as error:
            raise PluginError(f"The installed element {name!r} ({place}) does not load: {error}") from error
    for path in plugin_files or []:
        kinds.update(load_plugin(path))
    return kinds


def load_plugin(path: Path) -> dict[str, type[Element]]:
    """Returns the elements a Python file defines, by kind. The file is executed: only a file the user named comes here.

    Raises:
        PluginError: the file cannot be read or run, or defines no usable element.
    """
    try:
        source = read_text(path)
    except OSError as error:
        raise PluginError(f"The plugin {path} does not load: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise PluginError(f"The plugin {path} does not load: byte {error.start} is not UTF-8 text.") from error
    return load_source(source, str(path))


def load_source(source: str, origin: str) -> dict[str, type[Element]]:
    """Returns the elements that the text of a Python file defines, by kind; ``origin`` is the file.

    Its ``print`` writes to stderr, now and later, since stdout belongs to the answers of commands.

    Raises:
        PluginError: the text cannot be run, or defines no usable element.
    """
    import hashlib

    try:
        module = ModuleType("haploop_plugin_" + hashlib.sha256(source.encode()).hexdigest()[:12])
        module.__file__ = origin
        module.__dict__["print"] = _print
        sys.modules[module.__name__] = module  # dataclasses and type hints look the names up there
        with redirect_stdout(sys.stderr):
            exec(compile(source, origin, "exec"), module.__dict__)
    except (Exception, SystemExit) as error:
        lines = [line for file, line in places_of(error) if file == origin]
        if isinstance(error, SyntaxError) and error.filename == origin and error.lineno:
            lines = [error.lineno]
        line = f", line {lines[-1]}" if lines else ""
        raise PluginError(f"The plugin {origin}{line} does not load: {type(error).__name__}: {error}") from error
    found = [c for c in vars(module).values() if inspect.isclass(c) and c.__module__ == module.__name__]
    elements = [checked(c, origin) for c in found if issubclass(c, Element)]
    if not elements:
        raise PluginError(f"The plugin {origin} defines no element; a class derived from Element was expected.")
    return {element.kind: element for element in elements}


def _print(*values: object, file: Any = None, **how: Any) -> None:
    print(*values, file=sys.stderr if file is None else file, **how)


def checked(element: object, origin: str) -> type[Element]:
    """Returns an element that has a kind, a force and well declared parameters.

    Raises:
        PluginError: it is none; ``origin`` says where it came from.
    """
    if not (inspect.isclass(element) and issubclass(element, Element)):
        raise PluginError(f"{origin} must name a class derived from Element, but gives {element!r}.")
    if not isinstance(getattr(element, "kind", None), str):
        raise PluginError(f'{element.__name__} in {origin} names no kind; write kind = "my-element" in the class.')
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
    """Returns why a default cannot be the parameter's value, None where it can."""
    if quantity.choices:
        is_one = any(choice.__class__ is default.__class__ and choice == default for choice in quantity.choices)
        return None if is_one else f"must be {' or '.join(map(quantity.text, quantity.choices))}"
    try:
        if quantity.whole and float(default) % 1:  # pyright: ignore[reportArgumentType]
            return "must be a whole number"
        return quantity.complaint(float(default))  # pyright: ignore[reportArgumentType]
    except (TypeError, ValueError, OverflowError):
        return "must be a number"
