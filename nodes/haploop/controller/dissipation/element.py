"""Dissipation elements: declared parameters and one method from motion to force."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal, dataclass_transform, get_args, get_origin, get_type_hints

from haploop.protocol import plugin_file
from haploop.protocol.quantity import Quantity


class ElementError(Exception):
    """An element cannot be made from its parameters, or gave no force; the message names it and what it raised."""


_HERE = Path(__file__).parent
_ASK = '. An element gets only what its class asks for: asks = ("{}",)'
_HOLDS = ". It holds x, v, a, a_before, contact, inward and period_s, and what the element's class asks for"
_NO_PLUGIN = (_HERE.parent, Path(__file__), _HERE / "registry.py", Path(plugin_file.__file__))


def places_of(error: BaseException | None) -> list[tuple[str, int]]:
    """Returns the files and lines of elements that an error passed through, innermost last; none of this package."""
    return [
        (file, line)
        for file, line in plugin_file.places_of(error)
        if not (file.startswith("<") or {Path(file), Path(file).parent} & {*_NO_PLUGIN})
    ]


def place_in(kind: type[Element] | None, error: BaseException | None = None) -> str:
    """Returns `` (file, line n)``: where in an element's file an error arose, or else where its ``force`` begins."""
    code = getattr(getattr(kind, "force", None), "__code__", None)
    places = places_of(error) or ([(code.co_filename, code.co_firstlineno)] if code else [])
    lines = [line for file, line in places if file == places[0][0]]
    return f" ({plugin_file.told_name(places[0][0])}, line {lines[-1]})" if lines else ""


def raised(error: BaseException | None, kind: type[Element] | None = None) -> str:
    """Returns what an element raised, with the file and the line of its code."""
    if kind and kind.memory is not None and "unpack" in str(error) and not places_of(error):
        return f"TypeError: force must return the force and the memory, as in: return f, memory{place_in(kind)}"
    hint = ""
    if isinstance(error, AttributeError) and isinstance(error.obj, Motion):
        hint = _ASK.format(error.name) if error.name in ASKABLE else _HOLDS
    return f"{type(error).__name__}: {error}{place_in(kind, error)}{hint}"


def as_number(force: Any) -> float:
    """Returns an element's force as a number; raises TypeError if it is text, or nothing that float accepts."""
    try:
        if not isinstance(force, str | bytes):
            return float(force)
    except TypeError:
        pass
    raise TypeError(f"it returned {force!r}, and a force must be a number")


# What an element may ask for besides the motion.
ASKABLE = (
    "force",
    "wall_force",
    "wall_stored",
    "wall_position",
    "wall_stiffness",
    "way",
    "force_before",
    "output_before",
    "total_before",
    "acted",
    "wall_energy",
    "own_energy",
    "output_energy",
    "total_energy",
    "device_mass",
    "device_damping",
)


class Motion:
    """Motion of the device at tick k as the controller knows it; updated every tick, read-only for elements.

    Attributes:
        x: measured position x_m[k], m.
        v: estimated velocity v[k], m/s.
        a: estimated or measured acceleration a[k], m/s^2.
        a_before: a[k - 1], m/s^2 (0 at the first tick).
        contact: whether x is strictly inside the wall.
        inward: direction that leads into the wall, +1.0 or -1.0 (0.0 in a scene without a wall).
        period_s: the control period T.

    The following is told only to an element that names it in ``asks``. Energies are sampled books,
    E += -f[k-1] (x_m[k] - x_m[k-1]) in J, positive if taken out of the device, since the element came into the list:

    Attributes:
        force: force of the wall and of all elements before this one in the list, at this tick, N.
        wall_force, wall_stored: force of the wall alone, N; energy that its potential holds at this penetration, J.
        wall_position, wall_stiffness: as they are at this tick, m and N/m.
        way: x_m[k] - x_m[k-1], m; 0 at the first tick.
        force_before, output_before, total_before: what was commanded at tick k - 1, N: by this element; by it, the wall
            and all before it; in total.
        acted: mean force held over the last period, N, according to the round-trip delay of the scene; it does not take
            into account commands given before the element came, jitter, loss or the actuator.
        wall_energy, own_energy, output_energy, total_energy: energy of the wall; of this element; of it, the wall and
            all before it; of the total.
        device_mass, device_damping: as the scene declares them, kg and N s/m.
    """

    __slots__ = ("a", "a_before", "contact", "inward", "period_s", "v", "x", *ASKABLE)
    force: Any
    wall_force: Any
    wall_stored: Any
    wall_position: Any
    wall_stiffness: Any
    way: Any
    force_before: Any
    output_before: Any
    total_before: Any
    acted: Any
    wall_energy: Any
    own_energy: Any
    output_energy: Any
    total_energy: Any
    device_mass: Any
    device_damping: Any

    def __init__(self, period_s: float, inward: float) -> None:
        self.x: Any = 0.0
        self.v: Any = 0.0
        self.a: Any = 0.0
        self.a_before: Any = 0.0
        self.contact: Any = False
        self.inward = inward
        self.period_s = period_s

    def telling(self, known: Mapping[str, Any], asks: Iterable[str]) -> Motion:
        """Returns the same motion with what an element asks for."""
        told = Motion(self.period_s, self.inward)
        told.x, told.v, told.a, told.a_before, told.contact = self.x, self.v, self.a, self.a_before, self.contact
        for name in asks:
            setattr(told, name, known[name])
        return told

    @property
    def into_wall(self) -> float:
        """``inward``, by its name in older plugins."""
        return self.inward


@dataclass_transform(kw_only_default=True)
@dataclasses.dataclass(kw_only=True, eq=False)
class Element(ABC):
    """Base of every dissipation element.

    A subclass names its ``kind``, declares its parameters and defines ``force``, with arithmetic and ``where`` so that
    it works for floats and arrays alike. It becomes a dataclass automatically. ``force`` is called at every tick, in
    contact or not. A parameter is declared as ``name: Annotated[float, Quantity(unit, bounds)]``, a whole number with
    ``int`` instead of ``float``, a switch as ``bool`` and a choice as ``Literal["one", "other"]``.

    An element with memory declares its value at the first tick as ``memory``, a number or a NamedTuple of numbers;
    ``force(self, motion, memory)`` then returns the force and the memory for the next tick. One that keeps attributes
    of its own, set in ``__post_init__``, works too, but for one loop at a time: it cannot be used in batches. A swap
    makes a new object, so that either starts fresh after it.

    An element that needs more than the motion names it in ``asks``: forces of wall and other elements, energies, the
    device (``Motion`` lists them). One that limits the total returns the change that it makes; the books treat this
    change as they treat the force of any other element.

    Attributes:
        memory: the declared memory at the first tick; None where ``force`` depends on the motion alone.
        linear: whether the force is a linear function of the motion, past ticks included; a loop of such elements
            has an exact limit of stability.
        asks: names of what it is told besides the motion.
        limits: whether its force is a change of what the wall and all elements before it give; elements after it in
            the list are not limited.
        columns: unit by name of what the log shows of it besides its force, ``{"alpha": "N s/m"}``: fields of its
            memory, a NamedTuple, as they are after each tick.
    """

    group: ClassVar[str] = plugin_file.ELEMENTS
    named_by: ClassVar[str] = "kind"
    kind: ClassVar[str]
    memory: ClassVar[Any] = None
    linear: ClassVar[bool] = False
    asks: ClassVar[tuple[str, ...]] = ()
    limits: ClassVar[bool] = False
    columns: ClassVar[Mapping[str, str]] = MappingProxyType({})

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        # A list or a dict would count as something that the class keeps.
        cls.asks, cls.columns = tuple(cls.asks), MappingProxyType(dict(cls.columns))
        about = cls.__doc__
        dataclasses.dataclass(kw_only=True, eq=False)(cls)
        cls.__doc__ = about  # a dataclass without one would show its signature

    @abstractmethod
    def force(self, *args: Any, **kwargs: Any) -> Any:
        """Force of the element on the device at this tick, N, positive along +x, and the memory if it has one."""

    def values(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    @classmethod
    def parameters(cls) -> dict[str, tuple[Quantity, Any]]:
        """Returns name -> (quantity, default or ``dataclasses.MISSING``) of every declared parameter.

        Raises:
            TypeError: a parameter is declared in none of the allowed forms.
        """
        return dict(_parameters(cls))


@lru_cache(maxsize=256)
def _parameters(cls: type[Element]) -> Mapping[str, tuple[Quantity, Any]]:
    hints = get_type_hints(cls, include_extras=True)
    return {f.name: (_quantity(cls, f.name, hints[f.name]), f.default) for f in dataclasses.fields(cls)}


def hint_of(quantity: Quantity) -> Any:
    """Returns the type by which an element declares a parameter of this quantity."""
    if not quantity.choices:
        return Annotated[float, quantity]
    return Annotated[bool if False in quantity.choices else Literal[quantity.choices], quantity]


def _quantity(cls: type, name: str, hint: Any) -> Quantity:
    of, *marks = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    mark = next((mark for mark in marks if isinstance(mark, Quantity)), None)
    if of is float and mark:
        return mark
    if of is int and mark:
        return dataclasses.replace(mark, whole=True)
    choices = (False, True) if of is bool else get_args(of) if get_origin(of) is Literal else ()
    if of is bool or (choices and all(isinstance(choice, str) for choice in choices)):
        return Quantity("", about=mark.about if mark else "", choices=choices)
    raise TypeError(
        f"Parameter {name!r} of {cls.__name__} must be declared as Annotated[float, Quantity(unit, ...)], as "
        f'Annotated[int, Quantity("")], as bool or as Literal["one", "other"], not {hint!r}.'
    )
