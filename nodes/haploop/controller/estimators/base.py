"""Estimators as parameters alone: their memory is passed in and out, so that one object serves floats and arrays."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass
from typing import Any, ClassVar

from haploop.protocol.quantity import Quantity
from haploop.protocol.scene.scene import Scene

# (x_m,) or (x_m, acceleration) of a tick; floats, or arrays of shape (members,).
Sample = Sequence[Any]


class Estimator(ABC):
    """Base of every estimator: frozen parameters, and two functions that make and renew its memory.

    A subclass is a frozen dataclass. Its memory is a tree (``haploop.protocol.trees``) whose structure never changes,
    written with arithmetic and ``where``, so that it serves floats, NumPy and JAX alike.

    Attributes:
        name: value of ``velocity.estimator`` or ``acceleration.estimator`` that asks for it.
        does: what the estimate is, in one phrase.
        tables: the tables of the scene that may name it.
        needs, takes: keys that the scene's table must have, and that it may have in addition.
        keys: declarations of its own keys; the scene declares the keys that come with haploop.
        needs_without: key that ``[velocity]`` must have too unless the scene has one of these tables to take the value
            from; ``[acceleration]`` must always have it.
        linear: whether the estimate is a linear function of the samples.
    """

    group: ClassVar[str] = "haploop.estimators"
    named_by: ClassVar[str] = "name"
    name: ClassVar[str]
    does: ClassVar[str]
    tables: ClassVar[tuple[str, ...]] = ("velocity", "acceleration")
    needs: ClassVar[tuple[str, ...]] = ()
    takes: ClassVar[tuple[str, ...]] = ()
    keys: ClassVar[Mapping[str, Quantity]] = {}
    needs_without: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    linear: ClassVar[bool] = True

    @classmethod
    def parameters(cls) -> dict[str, tuple[Quantity, Any]]:
        """Returns its own keys by name: the declaration, and that there is no default."""
        return {name: (quantity, MISSING) for name, quantity in cls.keys.items()}

    @classmethod
    def complaint(cls) -> str:
        """Returns what is wrong with a class that is to be an estimator; "" where nothing is."""
        if not isinstance(getattr(cls, "does", None), str):
            return 'does not say what its estimate is; write does = "that of a filter of mine" in the class.'
        if unknown := [key for key in cls.keys if key not in (*cls.needs, *cls.takes)]:
            return f"has the key {unknown[0]}; name it in needs, or in takes where it may be left out."
        return ""

    @classmethod
    @abstractmethod
    def from_scene(cls, scene: Scene, of: str, period_s: float) -> Estimator:
        """Makes the one that a scene's table ``of`` ("velocity" or "acceleration") names, for the control period T."""

    @abstractmethod
    def start(self, u: Any, sample: Sample) -> Any:
        """Returns the memory before the first tick, whose input and sample are given."""

    @abstractmethod
    def step(self, memory: Any, u: Any, sample: Sample) -> tuple[Any, Any]:
        """Returns the memory after a tick, and the estimate from its input u and sample."""

    def acceleration(self, memory: Any) -> Any:
        """Returns the acceleration that the velocity estimator itself has found, m/s^2.

        Raises:
            TypeError: it finds none.
        """
        raise TypeError(f"The estimator {self.name} does not estimate acceleration.")


@dataclass(frozen=True)
class Difference(Estimator):
    """Backward difference (u[k] - u[k-1]) / T, 0 at the first input. Memory: u[k-1].

    Delays slow signals by T / 2; white noise of standard deviation sigma in u becomes sqrt(2) sigma / T.
    """

    name: ClassVar[str] = "difference"
    does: ClassVar[str] = "a backward difference"
    period_s: float

    @classmethod
    def from_scene(cls, scene: Scene, of: str, period_s: float) -> Difference:
        return cls(period_s)

    def start(self, u: Any, sample: Sample) -> Any:
        return u

    def step(self, memory: Any, u: Any, sample: Sample) -> tuple[Any, Any]:
        return u, (u - memory) / self.period_s


@dataclass(frozen=True)
class Unchanged(Estimator):
    """The input itself: an accelerometer's reading, or what another estimator has found. No memory."""

    name: ClassVar[str] = "unchanged"
    does: ClassVar[str] = "the input itself"

    @classmethod
    def from_scene(cls, scene: Scene, of: str, period_s: float) -> Unchanged:
        return cls()

    def start(self, u: Any, sample: Sample) -> Any:
        return None

    def step(self, memory: Any, u: Any, sample: Sample) -> tuple[Any, Any]:
        return None, u


@dataclass(frozen=True)
class LowPass(Estimator):
    """First-order low-pass y += gain (u - y), gain = 1 - exp(-2 pi fc T), of another estimator's estimate.

    y starts at the first estimate. Memory: (that of the other, y). Delays slow signals by T / gain - T, about
    1 / (2 pi fc); white noise of standard deviation sigma in u becomes sqrt(gain / (2 - gain)) sigma.
    """

    name: ClassVar[str] = "low-pass"
    does: ClassVar[str] = "low-passed"
    raw: Estimator
    gain: Any

    @classmethod
    def from_scene(cls, scene: Scene, of: str, period_s: float) -> LowPass:
        """Raises TypeError: a low-pass is made over another estimator."""
        raise TypeError("A low-pass wraps another estimator.")

    def start(self, u: Any, sample: Sample) -> Any:
        memory = self.raw.start(u, sample)
        return memory, self.raw.step(memory, u, sample)[1]

    def step(self, memory: Any, u: Any, sample: Sample) -> tuple[Any, Any]:
        raw, y = memory
        raw, estimate = self.raw.step(raw, u, sample)
        y = y + self.gain * (estimate - y)
        return (raw, y), y

    def acceleration(self, memory: Any) -> Any:
        return self.raw.acceleration(memory[0])
