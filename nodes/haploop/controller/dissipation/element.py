"""Dissipation elements: declared parameters and one method from motion to force."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from typing import Annotated, Any, ClassVar, dataclass_transform, get_args, get_origin, get_type_hints

from haploop.protocol.quantity import Quantity


class ElementError(Exception):
    """An element that cannot be made of its parameters, or gave no force; the message names it and what it raised."""


class Motion:
    """Motion of the device at tick k as the controller knows it; renewed each tick, read only for elements.

    Attributes:
        x: measured position x_m[k], m.
        v: estimated velocity v[k], m/s.
        a: estimated or measured acceleration a[k], m/s^2.
        a_before: a[k - 1], m/s^2 (0 at the first tick).
        contact: whether x is strictly inside the wall.
        inward: direction that leads into the wall, +1.0 or -1.0 (0.0 in a scene without a wall).
        period_s: the control period T.
    """

    __slots__ = ("a", "a_before", "contact", "inward", "period_s", "v", "x")

    def __init__(self, period_s: float, inward: float) -> None:
        self.x: Any = 0.0
        self.v: Any = 0.0
        self.a: Any = 0.0
        self.a_before: Any = 0.0
        self.contact: Any = False
        self.inward = inward
        self.period_s = period_s

    @property
    def into_wall(self) -> float:
        """``inward`` by its name in plugins written before."""
        return self.inward


@dataclass_transform(kw_only_default=True)
@dataclasses.dataclass(kw_only=True, eq=False)
class Element(ABC):
    """Base of every dissipation element.

    A subclass names its ``kind``, declares each parameter as ``name: Annotated[float, Quantity(unit, bounds)]`` and
    writes ``force``, with arithmetic and ``where`` so that it serves floats and arrays alike. It becomes a dataclass by
    itself. ``force`` is called at every tick, in contact or not.

    An element that remembers declares its memory at the first tick as ``memory``, a number or a NamedTuple of numbers;
    ``force(self, motion, memory)`` then returns the force and the memory of the next tick. One that keeps attributes of
    its own, set in ``__post_init__``, works too, but one loop at a time: it has no part in batches. A swap makes a new
    object, so either is fresh after it.

    Attributes:
        memory: the declared memory at the first tick; None where ``force`` depends on the motion alone.
        linear: whether the force is a linear function of the motion, past ticks included; a loop of such elements
            has an exact limit of stability.
    """

    kind: ClassVar[str]
    memory: ClassVar[Any] = None
    linear: ClassVar[bool] = False

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        dataclasses.dataclass(kw_only=True, eq=False)(cls)

    @abstractmethod
    def force(self, *args: Any, **kwargs: Any) -> Any:
        """Force of the element on the device at this tick, N, positive along +x, and the memory where it has one."""

    def values(self) -> dict[str, float]:
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    @classmethod
    def parameters(cls) -> dict[str, tuple[Quantity, Any]]:
        """Returns name -> (quantity, default or ``dataclasses.MISSING``) of every declared parameter.

        Raises:
            TypeError: a parameter is not declared as ``Annotated[float, Quantity(...)]``.
        """
        hints = get_type_hints(cls, include_extras=True)
        return {f.name: (_quantity(cls, f.name, hints[f.name]), f.default) for f in dataclasses.fields(cls)}


def _quantity(cls: type, name: str, hint: Any) -> Quantity:
    if get_origin(hint) is Annotated and get_args(hint)[0] is float:
        for mark in get_args(hint)[1:]:
            if isinstance(mark, Quantity):
                return mark
    raise TypeError(
        f"Parameter {name!r} of {cls.__name__} must be declared as Annotated[float, Quantity(unit, ...)], not {hint!r}."
    )
