"""Dotted keys of a scene, such as ``dissipation.0.mass``: the value there is read, replaced or removed."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
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
        if isinstance(found, dict):
            found = found.get(part)
        elif isinstance(found, Table):
            found = getattr(found, part) if _declares(found, part) else _undeclared(found).get(part)
        elif isinstance(found, tuple | list):
            found = found[int(part)] if part.isdecimal() and int(part) < len(found) else None
        else:
            return None
    return found


def with_value(table: TableType, key: str, value: Any) -> TableType:
    """Returns a table with another value at a dotted key; what is not changed is shared.

    Raises:
        KeyError: the key leads through a table that is absent.
    """
    return with_values(table, {key: value})


def with_values(table: TableType, values: Mapping[str, Any]) -> TableType:
    """Returns a table with other values at some dotted keys, as ``with_value`` does for one key."""
    changed: Tables = {}
    for key, value in values.items():
        first, _, rest = key.partition(".")
        changed[first] = _within(changed[first] if first in changed else value_at(table, first), key, rest, value)
    return _put(table, changed)


def _within(inner: Any, key: str, rest: str, value: Any) -> Any:
    """Returns the value at the first part of a key, with another value at the rest of the key."""
    if not rest:
        return value
    if isinstance(inner, tuple):
        index, _, name = rest.partition(".")
        place = int(index)
        return (*inner[:place], with_values(inner[place], {name: value}), *inner[place + 1 :])
    if not isinstance(inner, Table):
        raise KeyError(f"There is no table {key.partition('.')[0]} to set {key} in.")
    return with_values(inner, {rest: value})


def without(table: TableType, *keys: str) -> TableType:
    """Returns a table without some dotted keys, which take their defaults; an absent key changes nothing."""
    for key in keys:
        first, _, rest = key.partition(".")
        inner = value_at(table, first)
        if inner is None:
            continue
        table = _put(table, {first: without(inner, rest) if rest else _default(table, first)})
    return table


def _declares(table: Table, name: str) -> bool:
    return name in vars(table)


def _undeclared(table: Table) -> Tables:
    if isinstance(table, ElementTable):
        return {"kind": table.name, **table.parameters}
    kind = {"kind": table.kind} if table.kind else {}
    return kind | (table.others if isinstance(table, OpenTable) else {})


def _put(table: TableType, values: Tables) -> TableType:
    declared = {name: value for name, value in values.items() if _declares(table, name)}
    if len(declared) < len(values):
        inside = "parameters" if isinstance(table, ElementTable) else "others"
        undeclared = getattr(table, inside) | {name: values[name] for name in values if name not in declared}
        declared[inside] = {name: value for name, value in undeclared.items() if value is not None}
    return dataclasses.replace(table, **declared)


def _default(table: Table, name: str) -> Any:
    """Returns the default of a key, None for one that the table does not declare."""
    field = next((field for field in table.fields() if field.name == name), None)
    if field is None:
        return None
    if field.default is dataclasses.MISSING:
        raise ValueError(f"{type(table).__name__} must have {name}.")
    return field.default
