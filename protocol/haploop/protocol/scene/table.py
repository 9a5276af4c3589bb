"""The base of every table of a scene: a frozen dataclass that reads and writes plain dicts."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable
from functools import cache
from types import UnionType
from typing import Annotated, Any, ClassVar, NoReturn, Self, Union, dataclass_transform, get_args, get_origin

# Tables as plain dicts, as TOML and the wire hold them.
Tables = dict[str, Any]
# Types of the values that stand in a table unchanged.
_PLAIN = (float, int, str, bool)


@dataclass_transform(kw_only_default=True, frozen_default=True)
@dataclasses.dataclass(init=False, repr=False, eq=False)
class Table:
    """Base of every table; a subclass automatically is a frozen dataclass with keyword arguments.

    A key declared ``X | None`` with default None is absent unless it is given; an absent effect is not simulated.
    A number that differs from member to member of a batch is an array of shape (batch,).

    The methods of a dataclass stand here once for all tables: compiling them for each table, as ``dataclass`` does,
    would take longer than everything else that a node does before its first tick.

    Attributes:
        kind: name by which a scene file chooses between tables in one place; "" where there is no choice.
    """

    kind: ClassVar[str] = ""
    # Default of every key, in order of declaration; keys without a default; keys whose default is made by a function.
    _defaults: ClassVar[Tables] = {}
    _needed: ClassVar[tuple[str, ...]] = ()
    _made: ClassVar[tuple[tuple[str, Callable[[], Any]], ...]] = ()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        dataclasses.dataclass(kw_only=True, init=False, repr=False, eq=False)(cls)
        fields, none = dataclasses.fields(cls), dataclasses.MISSING
        cls._defaults = {field.name: field.default for field in fields}
        cls._made = tuple((f.name, f.default_factory) for f in fields if f.default_factory is not none)
        cls._needed = tuple(f.name for f in fields if f.default is none and f.default_factory is none)

    def __init__(self, **values: Any) -> None:
        own = vars(self)
        own.update(self._defaults)
        own.update(values)
        for name, make in self._made:
            if name not in values:
                own[name] = make()
        if len(own) > len(self._defaults) or any(own[name] is dataclasses.MISSING for name in self._needed):
            unknown, lacks = values.keys() - self._defaults.keys(), set(self._needed) - values.keys()
            raise TypeError(f"{type(self).__name__} is made without {sorted(lacks)} or with {sorted(unknown)}.")

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")

    def __delattr__(self, name: str) -> NoReturn:
        raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")

    def __eq__(self, other: object) -> bool:
        return vars(self) == vars(other) if other.__class__ is self.__class__ else NotImplemented

    def __hash__(self) -> int:
        return hash(tuple(vars(self).values()))

    def __repr__(self) -> str:
        return f"{type(self).__qualname__}({', '.join(f'{name}={value!r}' for name, value in vars(self).items())})"

    @classmethod
    def of_kind(cls, kind: str) -> type[Table] | None:
        """Returns the class of a kind that may stand where this class is declared; None if there is none."""
        return cls if cls.kind == kind else None

    @classmethod
    def alternatives(cls) -> list[type[Any]]:
        """Returns every class of table that may stand where this one is declared."""
        return [cls]

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
        given = {key: value if value.__class__ in _PLAIN else _read(cls, key, value) for key, value in data.items()}
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
        """Makes the table as ``Table.from_dict`` does; keys that it does not declare go to ``others``."""
        declared = cls._defaults.keys()
        if declared >= data.keys():
            return super().from_dict(data)
        others = {key: value for key, value in data.items() if key not in declared and not (cls.kind and key == "kind")}
        made = super().from_dict({key: value for key, value in data.items() if key not in others})
        return dataclasses.replace(made, others=others) if others else made

    def as_dict(self) -> Tables:
        """Returns the table as ``Table.as_dict`` does, with the keys in ``others`` last."""
        written = super().as_dict()
        return written | written.pop("others")


@cache
def _tables_at(cls: type[Table], key: str) -> tuple[type[Table], ...]:
    """Returns the table classes that may stand at a key."""
    field = cls.__dataclass_fields__.get(key)
    hint = field.type if field else None
    if isinstance(hint, str):
        declares = next(base for base in cls.__mro__ if key in vars(base).get("__annotations__", ()))
        hint = eval(hint, vars(sys.modules[declares.__module__]))
    return tuple(_tables_in(hint))


def _tables_in(hint: Any) -> list[type[Table]]:
    if isinstance(hint, type) and issubclass(hint, Table):
        return [hint]
    if get_origin(hint) in (Union, UnionType, Annotated, tuple):
        return [table for part in get_args(hint) for table in _tables_in(part)]
    return []


def _read(cls: type[Table], key: str, value: Any) -> Any:
    if isinstance(value, list | tuple):
        return tuple(_read(cls, key, item) for item in value)
    if not isinstance(value, dict) or not (tables := _tables_at(cls, key)):
        return value
    kind = value.get("kind", "")
    return next((found for table in tables if (found := table.of_kind(kind))), tables[0]).from_dict(value)


def as_plain(value: Any) -> Any:
    """Returns a value of a table, with the tables in it as dicts and tuples as lists."""
    if value.__class__ in _PLAIN:
        return value
    if isinstance(value, Table):
        return value.as_dict()
    if isinstance(value, list | tuple):
        return [as_plain(item) for item in value]
    return value
