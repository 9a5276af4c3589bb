"""Validating models of the tables: made from their declarations in ``haploop.protocol.scene``, key by key."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from functools import cache, reduce
from operator import or_
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model, model_validator
from pydantic_core import PydanticCustomError

from haploop.controller.estimators.choose import estimators_for
from haploop.launch.plan.effects import all_effects
from haploop.launch.scene.force_csv import fault
from haploop.launch.scene.number import Number
from haploop.plant.integrators.registry import integrator_names
from haploop.protocol.quantity import Quantity
from haploop.protocol.scene.estimators import Acceleration, Velocity
from haploop.protocol.scene.hand_force import Trace
from haploop.protocol.scene.scene import Clock, Scene
from haploop.protocol.scene.table import Table

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element


class Model(BaseModel):
    """Validates a TOML table: unknown keys are mistakes and nothing is converted silently."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True, protected_namespaces=())


TableType = TypeVar("TableType", bound=Table)


class FunctionOfTime(Model):
    """Points whose times rise."""

    @model_validator(mode="after")
    def _times_rise(self) -> FunctionOfTime:
        if found := fault(getattr(self, "time"), getattr(self, "force")):  # noqa: B009  the keys are made later
            sentence = f"Sample {found[0]}: {found[1]}"
            raise PydanticCustomError("sentence", "{sentence}", {"sentence": sentence})
        return self


class EventModel(Model):
    """What changes during the run; exactly one of swap, set, pause and stop."""

    at: Annotated[float, Number(Quantity("s", at_least=0, about="time; the first tick at or after it sees the change"))]
    element: Annotated[
        int | None, Number(Quantity("", at_least=0, about="which element a swap replaces", whole=True))
    ] = None
    set: dict[str, Any] | None = Field(None, description='new values: { "wall.stiffness" = 200.0 }')
    pause: Literal[True] | None = None
    stop: Literal[True] | None = None


# Tables with a rule beyond that of each key.
_BASES: dict[type[Table], type[Model]] = {Trace: FunctionOfTime}


@cache
def model_of(table: type[Table]) -> type[Model]:
    """Makes the model that validates a table: bounds and units at every number, no unknown keys."""
    return _model(table.__name__, _BASES.get(table, Model), table.__doc__, _keys_of(table))


def _keys_of(table: type[Table]) -> dict[str, Any]:
    keys: dict[str, Any] = {"kind": (Literal[table.kind], ...)} if table.kind else {}
    hints = get_type_hints(table, include_extras=True)
    for field in table.fields():
        if field.name != "others":
            keys[field.name] = _validated(hints[field.name]), _default(field)
    return keys | _registered(table)


def _registered(table: type[Table]) -> dict[str, Any]:
    """Returns the keys that registries give: names, keys of estimators of other packages, tables of their effects."""
    if table is Scene:
        return {effect.key: (model_of(effect.table) | None, None) for effect in all_effects() if effect.table}
    if table is Clock:
        return {"integrator": (_one_name(integrator_names()), "exact")}
    if table not in (Velocity, Acceleration):
        return {}
    kinds = estimators_for(table.__name__.lower())
    keys: dict[str, Any] = {"estimator": (_one_name(kinds) | None, None)}
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
        return model_of(hint)
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


def number_of(table: type[Table], key: str) -> Number:
    """Returns the number declared at ``key`` of a table."""
    return number_in(model_of(table), key)


def number_in(model: type[Model], key: str) -> Number:
    """Returns the number that a model reads at ``key``."""
    return next(mark for mark in model.model_fields[key].metadata if isinstance(mark, Number))


def read_table(table: type[TableType], data: Any) -> TableType | None:
    """Returns a table validated by itself; None where it is absent or wrong."""
    try:
        return table.from_dict(model_of(table).model_validate(data).model_dump(exclude_none=True))
    except ValidationError:
        return None


def scene_model(kinds: Mapping[str, type[Element]]) -> type[Model]:
    """Makes the model of the whole scene, with the kinds of dissipation element that are at hand."""
    return _scene_model(tuple(kinds.items()))


@cache
def _scene_model(kinds: tuple[tuple[str, type[Element]], ...]) -> type[Model]:
    nothing = _model("none", Model, "Removes the element.", {"kind": (Literal["none"], ...)})
    elements = [_element_model(kind, element) for kind, element in kinds]
    event = _model("Event", EventModel, EventModel.__doc__, {"swap": (_one_of([*elements, nothing]) | None, None)})
    keys = _keys_of(Scene)
    keys["dissipation"] = list[_one_of(elements or [nothing])] | None, None
    keys["event"] = list[event] | None, None
    return _model("Scene", Model, Scene.__doc__, keys)


def _element_model(kind: str, element: type[Element]) -> type[Model]:
    keys: dict[str, Any] = {
        "kind": (Literal[kind], ...),  # pyright: ignore[reportInvalidTypeForm]
        "acts": (Literal["in-contact", "always"], "in-contact"),
    }
    for name, (quantity, default) in element.parameters().items():
        keys[name] = (Annotated[float, Number(quantity)], ... if default is dataclasses.MISSING else default)
    return _model(kind, Model, element.__doc__, keys)


def _model(name: str, base: type[Model], about: str | None, keys: dict[str, Any]) -> type[Model]:
    return create_model(name, __base__=base, __doc__=about, **keys)


def _one_of(models: list[Any]) -> Any:
    """Returns the type of a table of one of these kinds."""
    return Annotated[reduce(or_, models), Field(discriminator="kind")] if len(models) > 1 else models[0]
