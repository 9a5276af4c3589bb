"""Dotted keys of a scene, such as ``dissipation.0.mass``: the value there, another one there, nothing there."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

from haploop.protocol.scene.scene import ElementTable
from haploop.protocol.scene.table import OpenTable, Table, Tables

TableType = TypeVar("TableType", bound=Table)


def value_at(table: Any, key: str) -> Any:
    """Returns the value at a dotted key of a scene, a table or nested dicts; None where there is none.

    Entries of a list are counted from 0.
    """
    found = table
    for part in key.split("."):
        if isinstance(found, tuple | list):
            found = found[int(part)] if part.isdecimal() and int(part) < len(found) else None
        elif isinstance(found, Table):
            found = getattr(found, part) if _declares(found, part) else _undeclared(found).get(part)
        else:
            found = found.get(part) if isinstance(found, dict) else None
    return found


def with_value(table: TableType, key: str, value: Any) -> TableType:
    """Returns a table with another value at a dotted key; what is not changed is shared.

    Raises:
        KeyError: the key leads through a table that is absent.
    """
    first, _, rest = key.partition(".")
    if not rest:
        return _put(table, first, value)
    inner = value_at(table, first)
    if isinstance(inner, tuple):
        index, _, name = rest.partition(".")
        changed = with_value(inner[int(index)], name, value)
        return _put(table, first, (*inner[: int(index)], changed, *inner[int(index) + 1 :]))
    if not isinstance(inner, Table):
        raise KeyError(f"There is no table {first} to set {key} in.")
    return _put(table, first, with_value(inner, rest, value))


def without(table: TableType, *keys: str) -> TableType:
    """Returns a table without some dotted keys, each at its default; an absent key changes nothing."""
    for key in keys:
        first, _, rest = key.partition(".")
        inner = value_at(table, first)
        if inner is None:
            continue
        table = _put(table, first, without(inner, rest) if rest else _default(table, first))
    return table


def _declares(table: Table, name: str) -> bool:
    return name in vars(table)


def _undeclared(table: Table) -> Tables:
    if isinstance(table, ElementTable):
        return {"kind": table.name, **table.parameters}
    kind = {"kind": table.kind} if table.kind else {}
    return kind | (table.others if isinstance(table, OpenTable) else {})


def _put(table: TableType, name: str, value: Any) -> TableType:
    if _declares(table, name):
        return dataclasses.replace(table, **{name: value})
    inside = "parameters" if isinstance(table, ElementTable) else "others"
    kept = {key: old for key, old in getattr(table, inside).items() if key != name or value is not None}
    return dataclasses.replace(table, **{inside: kept if value is None else {**kept, name: value}})


def _default(table: Table, name: str) -> Any:
    """Returns the default of a key, None for one that the table does not declare."""
    field = next((field for field in table.fields() if field.name == name), None)
    if field is None:
        return None
    if field.default is dataclasses.MISSING:
        raise ValueError(f"{type(table).__name__} cannot be without {name}.")
    return field.default
