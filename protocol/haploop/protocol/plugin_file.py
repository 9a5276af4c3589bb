"""A user's plugin file: it is run and searched for what a scene may name, which is made known to this process."""

from __future__ import annotations

import ast
import hashlib
import inspect
import re
import sys
from contextlib import redirect_stdout
from pathlib import Path
from types import ModuleType
from typing import Any

from haploop.protocol.files import line_of, read_text
from haploop.protocol.installed import Brought, PluginError, bring

# Elements are passed on explicitly, since a swap may change the code of one; everything else is known by its name.
ELEMENTS = "haploop.dissipation"
_MODULE = "haploop_plugin_"
# A run keeps a copy of each plugin under its name with a digest; messages show the name that the user gave.
_KEPT = re.compile(r"-[0-9a-f]{12}(?=\.py$)")
_NOTHING = (
    "The plugin {} defines nothing that a scene can name; a class derived from Element, Wall, Estimator or HandForce "
    "was expected."
)


def bring_file(path: Path) -> Brought:
    """Runs a Python file as ``bring_source`` runs its text; only a file that the user named is passed to it.

    Raises:
        PluginError: as there, or the file cannot be read.
    """
    try:
        source = read_text(path)
    except OSError as error:
        raise PluginError(f"The plugin {path} does not load: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        why = f"line {line_of(error)} is not UTF-8 text; save the file as UTF-8"
        raise PluginError(f"The plugin {path} does not load: {why}.") from error
    return bring_source(source, str(path))


def bring_source(source: str, origin: str) -> Brought:
    """Runs the text of a Python file; returns the classes that a scene may name, by group of entry points and name.

    The base of a class decides what it is: it gives the group, and the attribute that holds the name. All classes but
    elements are known to this process from then on. ``origin`` is the file. Its ``print`` writes to stderr, now and
    later, since stdout is for the answers of commands.

    Raises:
        PluginError: the text cannot be run, or defines no usable class.
    """
    module = _run(source, origin)
    found: dict[str, dict[str, type]] = {}
    for made in vars(module).values():
        if not inspect.isclass(made) or made.__module__ != module.__name__ or not hasattr(made, "group"):
            continue
        kind: Any = made
        name = getattr(kind, kind.named_by, None)
        place = f"The class {kind.__name__} in {origin}{_line_of(source, kind)}"
        if kind.group != ELEMENTS:  # the register of elements itself says what is wrong with one
            if not isinstance(name, str) or not name:
                raise PluginError(f'{place} has no {kind.named_by}; write {kind.named_by} = "my-own" in the class.')
            if lacks := sorted(getattr(kind, "__abstractmethods__", ())):
                raise PluginError(f"{place} has no method {' and no method '.join(lacks)}, which it must define.")
            if why := kind.complaint():
                raise PluginError(f"{place} {why}")
        found.setdefault(kind.group, {})[str(name)] = kind
    if not found:
        raise PluginError(_NOTHING.format(origin))
    bring({group: named for group, named in found.items() if group != ELEMENTS}, (source, origin))
    return found


def _run(source: str, origin: str) -> ModuleType:
    try:
        module = ModuleType(_MODULE + hashlib.sha256(source.encode()).hexdigest()[:12])
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
        what = error.msg if isinstance(error, SyntaxError) and line else error
        raise PluginError(f"The plugin {origin}{line} does not load: {type(error).__name__}: {what}") from error
    return module


def _print(*values: object, file: Any = None, **how: Any) -> None:
    print(*values, file=sys.stderr if file is None else file, **how)


def _line_of(source: str, made: type) -> str:
    classes = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ClassDef)]
    lines = [node.lineno for node in classes if node.name == made.__name__]
    return f", line {lines[-1]}" if lines else ""


def places_of(error: BaseException | None) -> list[tuple[str, int]]:
    """Returns the files and lines through which an error came, the innermost last."""
    places, trace = [], error.__traceback__ if error else None
    while trace:
        places.append((trace.tb_frame.f_code.co_filename, trace.tb_lineno))
        trace = trace.tb_next
    return places


def told_name(file: str) -> str:
    """Returns the name of a plugin file as its user knows it, without the digest of a kept copy."""
    return _KEPT.sub("", Path(file).name)


def raised_in_file(error: BaseException) -> str:
    """Returns an error's text with the plugin file and line that it came through; "" if it came through none."""
    trace, place = error.__traceback__, ""
    while trace:
        frame = trace.tb_frame
        if str(frame.f_globals.get("__name__", "")).startswith(_MODULE):
            place = f"{told_name(frame.f_code.co_filename)}, line {trace.tb_lineno}"
        trace = trace.tb_next
    return place and f"{type(error).__name__}: {error} ({place})"
