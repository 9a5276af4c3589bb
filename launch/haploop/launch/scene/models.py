"""Validating models of the tables: made from their declarations in ``haploop.protocol.scene``, key by key."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from operator import or_
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model, model_validator
from pydantic_core import PydanticCustomError

from haploop.controller.estimators.choose import estimators_for
from haploop.launch.plan.effects import all_effects
from haploop.launch.scene.number import Number
from haploop.plant.integrators.registry import integrator_names
from haploop.protocol.installed import cached_until_brought
from haploop.protocol.quantity import Quantity
from haploop.protocol.scene.estimators import Acceleration, Velocity
from haploop.protocol.scene.hand_force import Trace
from haploop.protocol.scene.scene import NO_ELEMENT, Clock, EventTable, Scene, Wall
from haploop.protocol.scene.table import Table
from haploop.protocol.walls.registry import all_walls

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element


class Model(BaseModel):
    """Validates a TOML table: unknown keys are mistakes and nothing is converted silently."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True, protected_namespaces=())


TableType = TypeVar("TableType", bound=Table)
_SPRING_KEYS = {"position", "stiffness", "occupies"}
# Keys of a model to be made: key -> (type, default).
Keys = dict[str, Any]


class FunctionOfTime(Model):
    """Points whose times increase."""

    @model_validator(mode="after")
    def _times_rise(self) -> FunctionOfTime:
        if found := fault(getattr(self, "time"), getattr(self, "force")):  # noqa: B009  the keys are made later
            sentence = f"Sample {found[0]}: {found[1]}"
            raise PydanticCustomError("sentence", "{sentence}", {"sentence": sentence})
        return self


# Tables with a rule beyond that of each key.
_BASES: dict[type[Table], type[Model]] = {Trace: FunctionOfTime}


@cached_until_brought
def model_of(table: type[Table]) -> type[Model]:
    """Makes the model that validates a table: bounds and units at every number, no unknown keys."""
    return _model(table.__name__, table.__doc__, _keys_of(table, _registered(table)), _BASES.get(table, Model))


def _keys_of(table: type[Table], others: Keys, named: frozenset[str] | None = None) -> Keys:
    """Makes the keys of a table; if ``named`` is given, those with a default only if they are in it."""
    keys: Keys = {"kind": (Literal[table.kind], ...)} if table.kind else {}
    hints = get_type_hints(table, include_extras=True)
    for field in table.fields():
        if field.name in others:
            keys[field.name] = others[field.name]
        elif field.name != "others" and (named is None or field.name in named or field.default is dataclasses.MISSING):
            keys[field.name] = _validated(hints[field.name]), _default(field)
    return keys | others


def _registered(table: type[Table]) -> Keys:
    """Returns the keys that registries give: names, keys of walls and estimators, tables of effects."""
    if table is Scene:
        return {effect.key: (model_of(effect.table) | None, None) for effect in all_effects() if effect.table}
    if table is Clock:
        return {"integrator": (_one_name(integrator_names()), "exact")}
    if table not in (Velocity, Acceleration, Wall):
        return {}
    kinds, name = (all_walls(), "kind") if table is Wall else (estimators_for(table.__name__.lower()), "estimator")
    keys: Keys = {name: (_one_name(kinds) | None, None)}
    for kind in kinds.values():
        keys |= {key: (Annotated[float | None, Number(quantity)], None) for key, quantity in kind.keys.items()}
    return keys


def _one_name(names: Iterable[str]) -> Any:
    return Literal[tuple(names)]  # pyright: ignore[reportInvalidTypeForm]


def _default(field: dataclasses.Field[Any]) -> Any:
    if field.default is dataclasses.MISSING:
        return ...
    return Field(default_factory=model_of(type(field.default))) if isinstance(field.default, Table) else field.default


def _validated(hint: Any) -> Any:
    """Returns the type of a key with numbers that read units, and models in place of tables."""
    if isinstance(hint, type) and issubclass(hint, Table):
        return _one_of([model_of(table) for table in hint.alternatives()])
    origin, parts = get_origin(hint), get_args(hint)
    if origin is Annotated:
        marks = [Number(mark) if isinstance(mark, Quantity) else mark for mark in parts[1:]]
        return Annotated[_validated(parts[0]), *marks]
    if origin in (Union, UnionType):
        choices = [_validated(part) for part in parts if part is not type(None)]
        kinds = all(isinstance(choice, type) and issubclass(choice, Model) for choice in choices)
        one = _one_of(choices) if kinds else reduce(or_, choices)
        return one | None if type(None) in parts else one
    if origin is tuple:
        return list[_validated(parts[0])]
    return hint


@cached_until_brought
def number_of(table: type[Table], key: str) -> Number:
    declared = get_type_hints(table, include_extras=True).get(key)
    marks = get_args(_validated(declared)) if declared else model_of(table).model_fields[key].metadata
    return next(mark for mark in marks if isinstance(mark, Number))


def read_table(table: type[TableType], data: Any) -> TableType | None:
    """Returns a table validated by itself; None where it is absent or wrong."""
    if data is None:
        return None
    try:
        return table.from_dict(model_of(table).model_validate(data).model_dump(exclude_none=True))
    except ValidationError:
        return None


def scene_model(kinds: Mapping[str, type[Element]], named: Mapping[str, Any] | None = None) -> type[Model]:
    """Makes the model of the scene, with the kinds of dissipation element that are at hand.

    Args:
        named: the tables that are there: the model accepts what that of the whole scene would accept, and is made
            faster, without walls other than the spring if the wall is one, and without elements other than theirs.
    """
    if named is None:
        return _scene_model(tuple(kinds.items()), None)
    wall, asked = named.get("wall"), _kinds_in(named)
    is_plain = isinstance(wall, dict) and wall.keys() <= _SPRING_KEYS
    asked_for = [known for known in kinds.items() if known[0] in asked] or [*kinds.items()][:1]
    return _scene_model(tuple(asked_for), frozenset(named), is_plain)


def _kinds_in(tables: Mapping[str, Any]) -> list[Any]:
    """Returns the kinds of element that stand in tables which may be invalid."""
    elements, events = (
        [of for of in _listed(tables.get(key)) if isinstance(of, dict)] for key in ("dissipation", "event")
    )
    swaps = [event.get("swap") for event in events]
    return [of.get("kind") for of in [*elements, *swaps] if isinstance(of, dict)]


def _listed(value: Any) -> Sequence[Any]:
    return value if isinstance(value, list | tuple) else ()


@cached_until_brought
def _scene_model(
    kinds: tuple[tuple[str, type[Element]], ...], named: frozenset[str] | None, has_spring: bool = False
) -> type[Model]:
    nothing = _model(NO_ELEMENT, "Removes the element.", {"kind": (Literal["none"], ...)})
    elements = [_element_model(kind, element) for kind, element in kinds]
    others: Keys = {"dissipation": (list[_one_of(elements or [nothing])] | None, None), "event": (type(None), None)}
    if has_spring:
        keys = {key: kept for key, kept in _keys_of(Wall, {}).items() if key in _SPRING_KEYS}
        others["wall"] = _model("Wall", Wall.__doc__, keys) | None, None
    if named is None or "event" in named:
        changes: Keys = {
            "swap": (_one_of([*elements, nothing]) | None, None),
            "set": (dict[str, Any] | None, Field(None, description='new values: { "wall.stiffness" = 200.0 }')),
        }
        others["event"] = list[_model("Event", EventTable.__doc__, _keys_of(EventTable, changes))] | None, None
    return _model("Scene", Scene.__doc__, _keys_of(Scene, others | _registered(Scene), named))


def _element_model(kind: str, element: type[Element]) -> type[Model]:
    keys: Keys = {
        "kind": (Literal[kind], ...),  # pyright: ignore[reportInvalidTypeForm]
        "acts": (Literal["in-contact", "always"], "in-contact"),
    }
    for name, (quantity, default) in element.parameters().items():
        keys[name] = (Annotated[float, Number(quantity)], ... if default is dataclasses.MISSING else default)
    return _model(kind, element.__doc__, keys)


def _model(name: str, about: str | None, keys: Keys, base: type[Model] = Model) -> type[Model]:
    return create_model(name, __base__=base, __doc__=about, **keys)


def _one_of(models: list[Any]) -> Any:
    return Annotated[reduce(or_, models), Field(discriminator="kind")] if len(models) > 1 else models[0]


def fault(times: Sequence[float], forces: Sequence[float]) -> tuple[int, str] | None:
    """Returns the first sample at which the lists are not a function of time, and why; None if they are one."""
    if not times:
        return 0, "There must be at least one sample."
    if len(times) != len(forces):
        return min(len(times), len(forces)), f"There are {len(times)} times but {len(forces)} forces."
    for i, (time, force) in enumerate(zip(times, forces, strict=True)):
        if not abs(time) < float("inf") or not abs(force) < float("inf"):
            return i, "Time and force must be finite numbers."
        if i and time <= times[i - 1]:
            return i, f"The times must increase, but {time:g} s follows {times[i - 1]:g} s."
    return None
