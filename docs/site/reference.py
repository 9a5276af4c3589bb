"""Pages of the reference that are generated from the code: scene, commands, summary, log, Python."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from haploop.api import load, run
from haploop.controller.dissipation import registry
from haploop.launch.runs.result import Result, unit_of
from haploop.launch.scene.schema import json_schema
from haploop.tools.render.terminal import markdown_table

sys.path.insert(0, str(Path(__file__).parent))
import meanings

GENERATED = "*Generated from the code with this page's site.*"
_API = """\
# Python

::: haploop.api
    options:
      show_root_toc_entry: false
      members: false
"""
# Modules of the Python interface with what they offer, each under a heading that its docstring explains.
_OFFERED = (
    ("Scenes", "haploop.launch.runs.loaded_scene", "load, LoadedScene"),
    ("Runs", "haploop.launch.runs.result", "run, Result"),
    ("Live runs", "haploop.api.live", "start, attach, LiveLoop"),
    ("Studies", "haploop.api.studies", "sweep, advise, compare, dissipate, plot"),
    ("What advise and compare return", "haploop.api.results", "AdviceResult, ComparisonResult"),
    ("Reading a log", "haploop.logger.log.stream", "read, LogStream"),
    ("What a log holds", "haploop.logger.log.recording", "Recording, Table"),
    ("The table of a sweep", "haploop.tools.sweep.table", "SweepTable"),
    ("Elements", "haploop.controller.dissipation.element", "Element, Motion"),
)
_OF_MODULE = """\
## {}

::: {}
    options: {{members: [{}], inherited_members: true, show_root_heading: false, heading_level: 3}}
"""


def scene() -> str:
    """Returns the page of every key a scene may have, from its JSON Schema."""
    schema = json_schema(registry())
    tables = schema["$defs"]
    parts = ["# Scene", GENERATED, _SCENE]
    parts += ["## At the top", _keys({key: one for key, one in schema["properties"].items() if not _of(one)}, tables)]
    for key, one in schema["properties"].items():
        for name in _of(one):
            parts += _table(_heading(key, one, _kind(name, tables), len(_of(one)) > 1), tables[name], tables)
            for inner, its in tables[name].get("properties", {}).items():
                for kind in _of(its) if key == "hand" else ():
                    heading = _heading(f"{key}.{inner}", its, _kind(kind, tables), len(_of(its)) > 1)
                    parts += _table(heading, tables[kind], tables)
    return "\n\n".join(parts) + "\n"


_SCENE = (
    "A scene is a TOML file. A table that is absent is an effect that is not simulated. Numbers are SI; text has its "
    'unit: `"0.2 N/mm"`, `"2 ms"`. `extends` names one file or several that it is laid over, own files or what '
    "`haploop scenes` lists. `haploop check --schema` prints this as JSON Schema for an editor."
)


def _of(one: Mapping[str, Any]) -> list[str]:
    """Returns the names of the tables that a key may be."""
    one = one.get("items", one)
    return [each["$ref"].rpartition("/")[2] for each in one.get("anyOf", [one]) if "$ref" in each]


def _heading(key: str, one: Mapping[str, Any], kind: str, several: bool) -> str:
    brackets = f"[[{key}]]" if "items" in one else f"[{key}]"
    return f"## `{brackets}`" + (f" of kind `{kind}`" if several else "")


def _kind(name: str, tables: Mapping[str, Any]) -> str:
    """Returns what a scene writes as the kind of a table, or its name in small letters where it has no kind."""
    told = tables.get(name, {}).get("properties", {}).get("kind", {}).get("const")
    return told or "".join(
        f"-{letter.lower()}" if letter.isupper() and at else letter.lower() for at, letter in enumerate(name)
    )


def _table(heading: str, table: Mapping[str, Any], tables: Mapping[str, Any]) -> list[str]:
    return [heading, _plain(table.get("description", "")), _keys(table.get("properties", {}), tables)]


def _keys(properties: Mapping[str, Any], tables: Mapping[str, Any]) -> str:
    rows = []
    for key, one in properties.items():
        if inner := _of(one):
            about = f"a table; see below ({', '.join(_kind(name, tables) for name in inner)})"
        else:
            about = _plain(one.get("description") or _choices(one))
        default = json.dumps(one["default"]) if one.get("default") is not None else ""
        rows.append((f"`{key}`", about, f"`{default}`" if default else "–"))
    table = markdown_table(("key", "what it is", "unless given"), rows)
    return f'<div class="keys" markdown>\n\n{table}\n\n</div>' if rows else ""  # on a phone a key above its words


def _choices(one: Mapping[str, Any]) -> str:
    given = one.get("enum") or ([one["const"]] if "const" in one else [])
    kinds = one.get("type") or [each.get("type", "") for each in one.get("anyOf", [])]
    return " or ".join([f"`{json.dumps(each)}`" for each in given] or ([kinds] if isinstance(kinds, str) else kinds))


def _plain(text: str) -> str:
    """Returns text without what Markdown or HTML would take for its own, code in backticks as it is."""
    parts = re.split(r"(`+[^`]+`+)", text.replace("\n", " "))
    marks = str.maketrans({"[": "\\[", "<": "&lt;", "*": "\\*", "_": "\\_"})
    return "".join(part if part.startswith("`") else part.translate(marks) for part in parts)


def commands() -> str:
    """Returns the page of every command with its arguments and options, from the command line itself."""
    import typer.main

    from haploop.tools.cli.app import app

    parts = [
        "# Commands",
        GENERATED,
        "Exit status: 0 done, or stopped in order, as by a first Ctrl-C; 1 the run failed or was interrupted at once; "
        "2 wrong use.",
    ]
    group: Any = typer.main.get_command(app)
    for name, command in group.commands.items():
        arguments = [one for one in command.params if one.param_type_name == "argument"]
        usage = " ".join(one.name.upper() if one.required else f"[{one.name.upper()}]" for one in arguments)
        parts += [
            f"## haploop {name}",
            f"```\nhaploop {name} [OPTIONS] {usage}".rstrip() + "\n```",
            _prose(command.help),
        ]
        rows = [(_words(one), _plain(one.help)) for one in command.params if one.help and not one.hidden]
        parts += [markdown_table(("", "what it is"), rows)] if rows else []
    return "\n\n".join(parts) + "\n"


def _words(one: Any) -> str:
    """Returns how an argument or an option is written."""
    if one.param_type_name == "argument":
        return f"`{one.name.upper()}`"
    value = "" if one.is_flag else f" {one.metavar or one.name.upper()}"
    return f"`{', '.join([*one.opts, *one.secondary_opts])}{value}`"


def _prose(text: str | None) -> str:
    return "\n\n".join(_plain(paragraph) for paragraph in (text or "").split("\n\n"))


@cache
def _example() -> Result:
    """A short run with every effect, whose summary and log hold all there is."""
    return run(load("all_effects", {"duration": 0.6}).swap("damping", at=0.3, damping=1.0))


def summary() -> str:
    """Returns the page of the summary's entries: what each means, its unit, and an example from a run."""
    shown = {meanings.pattern(key): _shown(value) for key, value in reversed([*_leaves(_example().summary)])}
    tables: dict[str, list[tuple[str, ...]]] = {"": []}
    for key, meaning in meanings.summary().items():
        table = key.partition(".")[0] if key.partition(".")[0] in _TABLES else ""
        row = f"`{key}`", unit_of(key), meaning, _plain(shown.get(key, ""))
        tables.setdefault(table, []).append(row)
    about = (
        "`summary.json`, `result.summary` and `haploop run --json`, which adds `directory` and `notes`, hold these "
        "entries; the end of a key says its unit. "
        "N is a place in a list, NAME a name of the scene or the machine. The values are those of a run of "
        "`all_effects`, 0.6 s long, with a swap; where there is none, that run has no such entry. A number that a run "
        "did not come to is `null`. [The books](../books.md#how-they-add-up) says how the energies add up."
    )
    parts = ["# Summary", GENERATED, about]
    for table, rows in tables.items():
        parts += [f"## `{table}`", _TABLES[table]] if table else ["## The run"]
        parts.append(_entries(("key", "unit", "meaning", "for example"), rows))
    return "\n\n".join(parts) + "\n"


_LONGEST = 24  # letters of an example
# The parts of a summary that have a heading of their own, with what is to be said of all of it.
_TABLES = {
    "stability": "What was found when the loop was held still at the end of the run and pushed. Absent where that was "
    "not done.",
    "window": "The last half second of the run, or the second half of a shorter one, hand and noise in it.",
    "extremes": "The whole run.",
    "energy": "The energy books at the end of the run. A key that ends in `sampled_J` is of what the controller knows, "
    "one that ends in `true_J` of what happened.",
    "lateness": "How late the ticks were, of a run at a pace or one whose plant owns the time. Absent of any other.",
    "programs": "What plant and controller are, NAME, where one of them is a program of somebody else's. Absent of any "
    "other run.",
}


def _entries(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Returns a table that a phone shows row by row, each with what it means below its name."""
    return f'<div class="stacked entries" markdown>\n\n{markdown_table(heads, rows)}\n\n</div>'


def _leaves(entry: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    inner = entry.items() if isinstance(entry, dict) else enumerate(entry) if isinstance(entry, list) else None
    if inner is None:
        yield key, entry
        return
    for name, value in inner:
        yield from _leaves(value, f"{key}.{name}".lstrip("."))


def _shown(value: Any) -> str:
    """Returns a value as the JSON file has it, a float shortened, text without its quotes and cut where it is long."""
    if isinstance(value, str):
        return value if len(value) <= _LONGEST else f"{value[:_LONGEST]}…"
    return f"{value:.4g}" if isinstance(value, float) else json.dumps(value)


def log() -> str:
    """Returns the page of the log's channels: the unit of every column, and what it means."""
    parts = ["# Log", GENERATED, _LOG]
    for topic, columns in meanings.columns().items():
        rows = [(f"`{name}`", one.unit, one.meaning) for name, one in columns.items()]
        parts += [f"## `{topic}`", _ABOUT[topic], _entries(("column", "unit", "meaning"), rows)]
    return "\n\n".join([*parts, "## `/events`", _EVENTS]) + "\n"


_LOG = (
    "A log is [MCAP](https://mcap.dev) with msgpack messages: `/plant` at every plant step (a message a tick, an "
    "array of its steps; `force` acts from that step on), `/controller` and `/energy` at every tick, `/events` for "
    "what changed. "
    "`haploop.api.read(directory)` gives NumPy arrays by channel and column, `.frame()` a pandas frame (with the "
    "extra `pandas`); "
    '`run.log = "ticks"` leaves out `/plant`, `"none"` all of it. Positions, velocities and forces count '
    "along the one axis of the scene. A run has the columns of what its scene holds."
)
_ABOUT = {
    "/plant": "What is true of the motion, which nobody in the loop knows. The last row is the end of the run.",
    "/controller": "What the controller knew and did. N is the place of an element in the list, from 0.",
    "/energy": "Running sums: true books and those of the plant up to the tick, sampled ones with the tick's sample. "
    "ELEMENT is the kind of an element, with a number from the second of a kind on; FORCE the table of a force that an "
    "installed package brings. [The books](../books.md#how-they-add-up) says how they add up.",
}
_EVENTS = "Maps, not columns: `timestamp` (s), `tick`, and the event as it was given."


def api() -> str:
    """Returns the page of the Python interface, whose content are docstrings."""
    return "\n".join([_API, *(_OF_MODULE.format(*one) for one in _OFFERED)])


PAGES = {
    "reference/scene.md": scene,
    "reference/commands.md": commands,
    "reference/summary.md": summary,
    "reference/log.md": log,
    "reference/api.md": api,
}
