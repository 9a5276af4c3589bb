"""The base of every wall, and the spring, which is the wall where a scene names no other."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any, ClassVar

from haploop.protocol.arrays import where
from haploop.protocol.quantity import Quantity


@dataclass(frozen=True, slots=True)
class Wall(ABC):
    """A wall, which pushes the device out while it is strictly inside; a tree of numbers, shared or one per member.

    A subclass is a frozen dataclass that defines ``push`` and ``stored`` for depths p >= 0, with arithmetic and
    ``where`` so that they work for floats, NumPy and JAX alike.

    Attributes:
        kind: the value of ``wall.kind`` that asks for it.
        keys: declarations of its own parameters; the default of a field is that of its key.
        dissipates: whether its law takes energy besides what it stores; it then has a book of that energy.
        position, stiffness: x_w of its surface, m; its stiffness, N/m.
        inward: direction that leads into it, +1.0 or -1.0; 0.0 where there is no wall, so that nothing is inside.
    """

    group: ClassVar[str] = "haploop.walls"
    named_by: ClassVar[str] = "kind"
    kind: ClassVar[str]
    keys: ClassVar[Mapping[str, Quantity]] = {}
    dissipates: ClassVar[bool] = False
    position: Any
    stiffness: Any
    inward: float

    @classmethod
    def parameters(cls) -> dict[str, tuple[Quantity, Any]]:
        """Returns its parameters besides position and stiffness by name: declaration, and default or MISSING."""
        defaults = {field.name: field.default for field in fields(cls)}
        return {name: (quantity, defaults.get(name, MISSING)) for name, quantity in cls.keys.items()}

    @classmethod
    def complaint(cls) -> str:
        """Returns what is wrong with a class that is meant to be a wall; "" if nothing is."""
        known = {field.name for field in fields(cls)}
        if lacks := [key for key in cls.keys if key not in known]:
            return (
                f"has the key {lacks[0]}, but no field of that name; write {lacks[0]}: Any in the class, and "
                "@dataclass(frozen=True, slots=True) above it."
            )
        return ""

    @abstractmethod
    def push(self, depth: Any, speed: Any) -> Any:
        """Returns the force out of the wall, N, for a depth p >= 0 in m and the speed p' at which it grows, m/s."""

    @abstractmethod
    def stored(self, depth: Any) -> Any:
        """Returns its potential V(p), J, for a depth p >= 0; V(0) = 0."""

    def held(self, depth: Any) -> Any:
        """Returns V'(p), the part of the force whose energy is stored, N; all of it if the law does not dissipate."""
        return self.push(depth, 0.0)

    def stored_between(self, before: Any, after: Any) -> Any:
        """Returns V(after) - V(before), J."""
        return self.stored(after) - self.stored(before)

    def stiffness_and_damping(self) -> tuple[Any, Any] | None:
        """Returns K in N/m and B in N s/m of a law that is K p + B p' in lasting contact; None for any other."""
        return None

    def contact(self, x: Any, v: Any) -> tuple[Any, Any]:
        """Returns whether measured position x (m) is strictly inside, and the force on the device in N along +x.

        ``v`` is the estimated velocity in m/s.
        """
        depth = (x - self.position) * self.inward
        contact = depth > 0.0
        push = self.push(where(contact, depth, 0.0), v * self.inward)
        return contact, where(contact, -self.inward * push, 0.0)

    def values(self) -> dict[str, Any]:
        """Returns its numbers by name as telemetry reports them: position, stiffness and its own parameters."""
        return {name: getattr(self, name) for name in ("position", "stiffness", *self.keys)}


@dataclass(frozen=True, slots=True)
class Spring(Wall):
    """f = k_w p: f_wall = k_w (x_w - x_m) inside, else 0 (Choi et al. 2022, eq. 12); V = k_w p^2 / 2."""

    kind: ClassVar[str] = "spring"

    def push(self, depth: Any, speed: Any) -> Any:
        return self.stiffness * depth

    def stored(self, depth: Any) -> Any:
        return 0.5 * (self.stiffness * depth) * depth

    def stored_between(self, before: Any, after: Any) -> Any:
        return 0.5 * self.stiffness * (after - before) * (after + before)

    def stiffness_and_damping(self) -> tuple[Any, Any]:
        return self.stiffness, 0.0

    def contact(self, x: Any, v: Any) -> tuple[Any, Any]:
        """Does the same as ``Wall.contact``, in fewer steps."""
        out = self.position - x
        contact = out * self.inward < 0.0
        return contact, where(contact, self.stiffness * out, 0.0)
