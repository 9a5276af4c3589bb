"""The tables of one TOML file, or a sentence that says why there are none."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from haploop.launch.scene.bundled import bundled, like
from haploop.launch.scene.mistakes import Mistake, SceneError, shown
from haploop.launch.scene.reading.lines import outline
from haploop.protocol.files import line_of, read_text
from haploop.protocol.scene.table import Tables

# No scene needs tables nested deeper than this, nor more keys outside lists; tables a thousand deep would end the
# program.
DEEPEST, _MOST_KEYS = 32, 2000


def parse(
    path: Path,
    what: str = "scene",
    needs: str = "a duration and a [device]",
    doubled: list[Mistake] | None = None,
) -> Tables:
    """Returns the tables of one TOML file, which is a ``what`` and needs at least the keys in ``needs``.

    Keys that are given twice are added to ``doubled``, if that is given, and the first value is taken.

    Raises SceneError if the file is missing, empty, not a file, not text or not TOML (with line and column).
    """
    text, line = "", None
    try:
        text = read_text(path)
        try:
            table = tomllib.loads(text)
        except ValueError:
            table = _with_the_first(path, text, [] if doubled is None else doubled)
            if table is None or doubled is None:
                raise
        if not table:
            problem = f"The file is empty; a {what} needs at least {needs}."
        elif not (problem := excess(table)):
            return table
    except FileNotFoundError:
        problem = _absent(path, what)
    except IsADirectoryError:
        problem = f"This is a directory; a {what} is a TOML file."
    except OSError as error:
        problem = f"The file cannot be read: {error.strerror}."
    except UnicodeDecodeError as error:
        line = line_of(error)
        problem = f"A {what} must be UTF-8 text, but this line is not; save the file as UTF-8."
    except ValueError as error:
        line = _line_of(str(error), text)
        problem = f"This is not valid TOML: {error}.{_hint(str(error), text)} Other mistakes are reported once it is."
    except RecursionError:
        problem = _TOO_DEEP
    raise SceneError([Mistake(shown(path), "", "", problem, line=line)])


def _line_of(problem: str, text: str) -> int | None:
    """Returns the line that a sentence of tomllib is about; None if it names none."""
    if "at end of document" in problem:
        return len(text.splitlines())
    at = re.search(r"at line (\d+)", problem)
    return int(at[1]) if at else None


def _hint(problem: str, text: str) -> str:
    """Returns how to write a value for which TOML has no form: a decimal comma, a unit or text without quotes."""
    if re.search(r"Illegal character '\\n'|Unterminated string|Expected \"'", problem):
        return " A quotation mark is not closed."
    line = re.search(r"at line (\d+)", problem)
    written = text.splitlines()[int(line[1]) - 1] if line else ""
    value = written.partition("=")[2].partition("#")[0].strip()
    if re.fullmatch(r"[+-]?\d+,\d+", value):
        return f" Write decimals with a point, not a comma: {value.replace(',', '.')}."
    if re.fullmatch(r"[+-]?\d[\d.,]*\s*[^\W\d][\w */^.]*", value):
        return f' A number with its unit must be text in quotes: "{value.replace(",", ".")}".'
    if re.fullmatch(r"[^\W\d][\w ./-]*", value):
        return f' Text stands in quotes: "{value}".'
    return ""


def _with_the_first(path: Path, text: str, doubled: list[Mistake]) -> Tables | None:
    """Returns the tables of a text that is TOML except for keys given twice, which are added; else None."""
    found = outline(text)
    if found is None or not found.doubled:
        return None
    expected = "Leave one of the two out."
    keys = {key for key, *_ in found.doubled}
    for key, first, again in found.doubled:
        if any(key[:depth] in keys for depth in range(1, len(key))):  # the table that holds it is reported already
            continue
        given = f"is given again, after line {first}"
        doubled.append(Mistake(shown(path), ".".join(map(str, key)), given, expected, line=again))
    return found.data


_OTHERS = {
    "scenes": "{0} is a scene: haploop run {0}.",
    "sweeps": "{0} is a sweep: haploop sweep {0}.",
    "devices": "{0} is a device: haploop advise {0} says which walls it can hold, haploop new NAME.toml --device {0} "
    "writes a scene with it.",
    "hands": "{0} is a hand: haploop new NAME.toml --hand {0} writes a scene with it.",
}


def _absent(path: Path, what: str) -> str:
    """Returns the sentence on a missing file; its name may have been meant for another, or for one of another kind."""
    hint = f", and no {what} of that name comes with haploop" if path.name == str(path) else ""
    is_of = [folder for folder in _OTHERS if folder != f"{what}s" and path.stem in bundled(folder)]
    meant = like(path.stem, f"{what}s", path.parent)
    if meant and is_of and not meant.startswith(path.stem):  # a name that exists is meant, not a similar one
        meant = None
    told = [_OTHERS[folder].format(path.stem) for folder in is_of[:1]]
    return " ".join([f"There is no such file{hint}{f'; did you mean {meant}?' if meant else '.'}", *told])


_TOO_DEEP = f"Tables and lists may be nested at most {DEEPEST} deep."


def excess(value: Any) -> str:
    """Returns a sentence on what there is too much of in a value that was read; "" if there is nothing."""
    level, depth = [value], 0
    while level:
        inner = [one for node in level for one in (node.values() if isinstance(node, dict) else node)]
        level, depth = [one for one in inner if isinstance(one, dict | list)], depth + 1
        if depth > DEEPEST:
            return _TOO_DEEP
    keys = _count_keys(value)
    return f"There are {keys} keys, but at most {_MOST_KEYS} were expected." if keys > _MOST_KEYS else ""


def _count_keys(value: Any) -> int:
    return len(value) + sum(map(_count_keys, value.values())) if isinstance(value, dict) else 0
