"""What a dissipation element is: declared parameters and one method from motion to force."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from typing import Annotated, Any, ClassVar, dataclass_transform, get_args, get_origin, get_type_hints

from haploop.protocol.quantity import Quantity


class ElementError(Exception):
    """An element that cannot be made of its parameters, or gave no force; the message names it and what it raised."""


class Motion:
    """What the controller knows of the device at tick k; one object, renewed each tick, read only for elements.

    Attributes:
        x: measured position x_m[k], m.
        v: estimated velocity v[k], m/s.
        a: estimated or measured acceleration a[k], m/s^2.
        a_before: a[k - 1], m/s^2 (0 at the first tick).
        contact: whether x is strictly inside the wall.
        into_wall: direction that leads into the wall, +1.0 or -1.0 (0.0 in a scene without a wall).
        period_s: the control period T.
    """

    __slots__ = ("a", "a_before", "contact", "into_wall", "period_s", "v", "x")

    def __init__(self, period_s: float, into_wall: float) -> None:
        self.x = self.v = self.a = self.a_before = 0.0
        self.contact = False
        self.into_wall = into_wall
        self.period_s = period_s


@dataclass_transform(kw_only_default=True)
class Element(ABC):
    """Base of every dissipation element.

    A subclass names its ``kind``, declares each parameter as ``name: Annotated[float, Quantity(unit, bounds)]`` and
    writes ``force``. It becomes a dataclass by itself. State across ticks goes into attributes set in
    ``__post_init__``: a swap makes a new object, so state is fresh after it. ``force`` is called at every tick,
    in contact or not, and is written with arithmetic and ``where`` so that it serves floats and arrays alike.

    Attributes:
        linear: whether the force is a linear function of the motion, past ticks included; a loop of such elements
            has an exact limit of stability.
    """

    kind: ClassVar[str]
    linear: ClassVar[bool] = False

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        dataclasses.dataclass(kw_only=True, eq=False)(cls)

    @abstractmethod
    def force(self, motion: Motion) -> Any:
        """Force of the element on the device at this tick, N, positive along +x."""

    def values(self) -> dict[str, float]:
        """The parameters as they are now."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}  # pyright: ignore[reportAttributeAccessIssue]

    @classmethod
    def parameters(cls) -> dict[str, tuple[Quantity, Any]]:
        """Name -> (quantity, default or ``dataclasses.MISSING``) of every declared parameter.

        Raises:
            TypeError: a parameter is not declared as ``Annotated[float, Quantity(...)]``.
        """
        hints = get_type_hints(cls, include_extras=True)
        return {f.name: (_quantity(cls, f.name, hints[f.name]), f.default) for f in dataclasses.fields(cls)}  # pyright: ignore[reportArgumentType]


def _quantity(cls: type, name: str, hint: Any) -> Quantity:
    if get_origin(hint) is Annotated and get_args(hint)[0] is float:
        for mark in get_args(hint)[1:]:
            if isinstance(mark, Quantity):
                return mark
    raise TypeError(
        f"Parameter {name!r} of {cls.__name__} must be declared as Annotated[float, Quantity(unit, ...)], not {hint!r}."
    )
