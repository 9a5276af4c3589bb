"""The base of every table of a scene: a frozen dataclass that reads and writes plain dicts."""

from __future__ import annotations

import dataclasses
from functools import cache
from types import UnionType
from typing import Annotated, Any, ClassVar, Self, Union, dataclass_transform, get_args, get_origin, get_type_hints

# Tables as plain dicts, as TOML and the wire hold them.
Tables = dict[str, Any]
# Values that stand in a table as they are.
_PLAIN = (float, int, str, bool)


@dataclass_transform(kw_only_default=True, frozen_default=True)
@dataclasses.dataclass(kw_only=True, frozen=True)
class Table:
    """Base of every table; a subclass is a frozen dataclass with keyword arguments by itself.

    A key declared ``X | None`` with default None is absent unless it is given: the effect is then not simulated.
    A number that differs from member to member of a batch is an array of shape (batch,).

    Attributes:
        kind: name by which a scene file chooses between tables in one place; "" where there is no choice.
    """

    kind: ClassVar[str] = ""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        dataclasses.dataclass(kw_only=True, frozen=True)(cls)

    @classmethod
    def fields(cls) -> tuple[dataclasses.Field[Any], ...]:
        """Returns the declared keys, in order."""
        return dataclasses.fields(cls)

    @classmethod
    def from_dict(cls, data: Tables) -> Self:
        """Makes the table from a resolved dict: every value already checked and in SI units.

        Raises:
            TypeError: a key is unknown or missing.
        """
        tables = _tables_of(cls)
        given = {
            key: value if value.__class__ in _PLAIN else _read(tables.get(key, ()), value)
            for key, value in data.items()
        }
        if cls.kind:
            given.pop("kind", None)
        return cls(**given)

    def as_dict(self) -> Tables:
        """Returns the table as nested dicts and lists, absent keys left out, in the order of declaration."""
        written = {"kind": self.kind} if self.kind else {}
        for name, value in vars(self).items():
            if value is not None:
                written[name] = as_plain(value)
        return written


class OpenTable(Table):
    """Base of a table to which other packages may add keys.

    Attributes:
        others: the keys they have added, with their values in SI units.
    """

    others: Tables = dataclasses.field(default_factory=dict)

    @classmethod
    def from_dict(cls, data: Tables) -> Self:
        """Makes the table as ``Table.from_dict`` does; keys that it does not declare are those of others."""
        declared = _declared(cls)
        if declared.issuperset(data):
            return super().from_dict(data)
        others = {key: value for key, value in data.items() if key not in declared and not (cls.kind and key == "kind")}
        made = super().from_dict({key: value for key, value in data.items() if key not in others})
        return dataclasses.replace(made, others=others) if others else made

    def as_dict(self) -> Tables:
        """Returns the table as ``Table.as_dict`` does, the keys of others last."""
        written = super().as_dict()
        return written | written.pop("others")


@cache
def _declared(cls: type[Table]) -> frozenset[str]:
    return frozenset(field.name for field in cls.fields())


@cache
def _tables_of(cls: type[Table]) -> dict[str, tuple[type[Table], ...]]:
    """The table classes that may stand at each key that holds tables."""
    hints = get_type_hints(cls)
    return {name: found for name, hint in hints.items() if (found := tuple(_tables_in(hint)))}


def _tables_in(hint: Any) -> list[type[Table]]:
    if isinstance(hint, type) and issubclass(hint, Table):
        return [hint]
    if get_origin(hint) in (Union, UnionType, Annotated, tuple):
        return [table for part in get_args(hint) for table in _tables_in(part)]
    return []


def _read(tables: tuple[type[Table], ...], value: Any) -> Any:
    if isinstance(value, list | tuple):
        return tuple(_read(tables, item) for item in value)
    if not tables or not isinstance(value, dict):
        return value
    kind = value.get("kind", "")
    return next((table for table in tables if table.kind == kind), tables[0]).from_dict(value)


def as_plain(value: Any) -> Any:
    """Returns a value of a table with tables in it as dicts and tuples as lists."""
    if value.__class__ in _PLAIN:
        return value
    if isinstance(value, Table):
        return value.as_dict()
    if isinstance(value, list | tuple):
        return [as_plain(item) for item in value]
    return value
