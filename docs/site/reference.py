"""Pages of the reference that are generated from the code: scene, commands, summary, log, Python."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from haploop.controller.dissipation import registry
from haploop.launch import load, run
from haploop.launch.runs.result import Result, unit_of
from haploop.launch.scene.schema import json_schema
from haploop.tools.render.terminal import markdown_table

GENERATED = "*Generated from the code with this page's site.*"
# The tables of a scene in the order of its description; each may be of several kinds.
_API = """\
# Python

`haploop.api` is the front door. Nothing is imported before it is first used.

::: haploop.api
    options:
      show_root_toc_entry: false
      members: false

::: haploop.launch.runs.loaded_scene
    options: {members: [load, LoadedScene], show_root_heading: false}

::: haploop.launch.runs.result
    options: {members: [run, Result], show_root_heading: false}

::: haploop.api.live
    options: {members: [start, attach, LiveLoop], show_root_heading: false}

::: haploop.api.studies
    options: {show_root_heading: false, members: [sweep, advise, compare, dissipate, plot]}

::: haploop.api.results
    options: {members: [AdviceResult, ComparisonResult], inherited_members: true, show_root_heading: false}

::: haploop.logger.log.stream
    options: {members: [read, LogStream], show_root_heading: false}

::: haploop.logger.log.recording
    options: {members: [Recording, Table], show_root_heading: false}

::: haploop.tools.sweep.table
    options: {members: [SweepTable], show_root_heading: false}

::: haploop.controller.dissipation.element
    options: {members: [Element, Motion], show_root_heading: false}
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

    parts = ["# Commands", GENERATED, "Exit status: 0 done, 1 the run failed or was interrupted, 2 wrong use."]
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
    """Returns the page of the summary's entries with units and an example, from a run."""
    rows = [(f"`{key}`", unit_of(key) or "–", _plain(_shown(value))) for key, value in _leaves(_example().summary)]
    about = (
        "`summary.json`, `result.summary` and `haploop run --json` hold these entries; the end of a key says its unit. "
        "The values are those of a run of `all_effects`, 0.6 s long, with a swap. A number that the run did not "
        "come to is `null`. Books are positive where energy was taken out of the device."
    )
    table = markdown_table(("key", "unit", "for example"), rows)
    return "\n\n".join(["# Summary", GENERATED, about, '<div class="keys entries" markdown>', table, "</div>"]) + "\n"


def _leaves(entry: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    inner = entry.items() if isinstance(entry, dict) else enumerate(entry) if isinstance(entry, list) else None
    if inner is None:
        yield key, entry
        return
    for name, value in inner:
        yield from _leaves(value, f"{key}.{name}".lstrip("."))


def _shown(value: Any) -> str:
    """Returns a value as the JSON file has it, a float shortened, text without its quotes."""
    return f"{value:.4g}" if isinstance(value, float) else value if isinstance(value, str) else json.dumps(value)


def log() -> str:
    """Returns the page of the log's channels, columns and units, from a run."""
    parts = ["# Log", GENERATED, _LOG]
    for topic, rows in _example().log.items():
        parts.append(f"## `{topic}`")
        if isinstance(rows, list):
            parts.append("Maps, not columns: `timestamp` (s), `tick`, and the event as it was given.")
            continue
        parts.append(
            markdown_table(("column", "unit"), [(f"`{name}`", unit or "–") for name, unit in rows.units.items()])
        )
    return "\n\n".join(parts) + "\n"


_LOG = (
    "A log is [MCAP](https://mcap.dev) with msgpack messages: `/plant` at every plant step (a message a tick, an "
    "array of its steps; `force` acts from that step on), `/controller` and `/energy` at every tick, `/events` for "
    "what changed. "
    "`haploop.api.read(directory)` gives NumPy arrays by channel and column, `.frame()` a pandas frame (with the "
    "extra `pandas`); "
    '`run.log = "ticks"` leaves out `/plant`, `"none"` all of it. The columns are those of a run of `all_effects`.'
)


def api() -> str:
    """Returns the page of the Python interface, whose content are docstrings."""
    return _API


PAGES = {
    "reference/scene.md": scene,
    "reference/commands.md": commands,
    "reference/summary.md": summary,
    "reference/log.md": log,
    "reference/api.md": api,
}
