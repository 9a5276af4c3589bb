"""An effect: the single object that completely describes something that a scene may name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar

from haploop.plant.integrators.registry import find_integrator
from haploop.protocol.scene.paths import value_at, without
from haploop.protocol.scene.scene import Scene
from haploop.protocol.scene.table import Table, Tables

TableType = TypeVar("TableType", bound=Table)
Stage = Literal["motion", "measurement", "estimate", "line", "actuation"]

# Modules of the plant that effects bring. These move a chain of bodies, or one body under forces that change between
# ticks.
HISTORY = tuple(f"haploop.plant.chain.{name}" for name in ("history", "chain", "sensed_acceleration", "transition"))
_EXACT = ("haploop.plant.chain.motion", "haploop.plant.where_it_pays")
CHAIN = (*_EXACT, *HISTORY)
RUBBING = tuple(f"haploop.plant.friction.{name}" for name in ("motion", "substeps"))
# Shared by the one-step methods.
LINEAR_RATES = ("haploop.plant.integrators.linear_rates",)
DRAWN = ("haploop.plant.streams",)
NOISY = ("haploop.plant.sensing.noise", *DRAWN)
COUNTED = ("haploop.plant.counters",)
LINE = ("haploop.plant.line.lossy", *DRAWN, *COUNTED, *CHAIN)


@dataclass(frozen=True)
class Draft:
    """A scene that is being checked; any part of it may be wrong in itself, which is reported elsewhere.

    Attributes:
        data: the merged tables as they were given.
        scene: the whole scene, None where some value of it is wrong.
        valid: returns data as a table of a class, None where they are not valid as one.
        complain: adds a mistake, given its key, a sentence on what is expected and, unless the value is to be quoted,
            what was found.
    """

    data: Tables
    scene: Scene | None
    valid: Callable[[type[Any], Any], Any]
    complain: Callable[..., None]

    def table(self, name: str, kind: type[TableType]) -> TableType | None:
        """Returns a table, None where it is absent or wrong."""
        return self.valid(kind, self.data.get(name))


def _nothing(_of: Any) -> Any:
    return []


def _always(_scene: Scene) -> bool:
    return True


@dataclass(frozen=True)
class Effect:
    """Something that a scene may name besides device, hand, wall and elements.

    Plan, checks, JSON Schema, ``explain``, ablation, advice, the linear map and batches all ask this object alone.

    Attributes:
        key: dotted key of the scene that names it.
        node: the process it acts in.
        modules: imported for it besides the node's own core; the effect itself is written in the first.
        stage: when it acts: in the motion, at every plant step; in the measurement, the estimate, on the line to the
            device or in the actuation, once a tick.
        does: what it does, in one phrase.
        value: what must stand at the key; None if the presence of the key is enough.
        columns: columns it adds to the log's ``/plant``.
        counts: numbers it adds to the summary, as entry and key.
        states: how many numbers it remembers from tick to tick or step to step: a count, or a function of a scene.
        linear: whether a loop in contact stays a linear map with it.
        left_out: keys of it that the map of small and smooth swings in contact leaves out.
        batches: whether it takes the same path in every tick whatever its numbers, so that many scenes run as one.
        used: whether a scene that names it simulates it.
        takes_out: turns a resolved scene into one without it; None if deleting the key is enough.
        check: adds the mistakes that no single key of it can show; it is called for every scene.
        note: sentences on what is valid in a resolved scene that names it, but may not have been meant.
        frees: cause of a buzzing contact, such as "friction" -> turns a resolved scene that simulates the effect into
            one with the ideal in its place, or returns the scene itself if its values are ideal.
        scaled_with: quantity that may be uncertain, such as "device mass" -> key of the effect that scales with it.
        table: declaration of its table, for an effect of another package; the scene itself declares the others. The
            force of an effect that pushes is named in the group of entry points ``haploop.forces``.
    """

    key: str
    node: Literal["plant", "controller"]
    modules: tuple[str, ...]
    stage: Stage
    does: str
    value: str | None = None
    columns: tuple[str, ...] = ()
    counts: tuple[str, ...] = ()
    states: int | Callable[[Scene], int] = 0
    linear: bool = True
    left_out: tuple[str, ...] = ()
    batches: bool | Callable[[Scene], bool] = True
    used: Callable[[Scene], bool] = _always
    takes_out: Callable[[Scene], Scene] | None = None
    check: Callable[[Draft], Any] = _nothing
    note: Callable[[Scene], list[str]] = _nothing
    frees: Mapping[str, Callable[[Scene], Scene]] = field(default_factory=dict)
    scaled_with: Mapping[str, str] = field(default_factory=dict)
    table: type[Table] | None = None

    @property
    def name(self) -> str:
        """The key, with the value where several may stand there."""
        return f"{self.key} = {self.value}" if self.value else self.key

    @property
    def written(self) -> str:
        """The name as a scene file writes it: ``[friction]``, ``actuator.saturation``, ``jitter.kind = "gamma"``."""
        return f'{self.key} = "{self.value}"' if self.value else as_written(self.key)

    @property
    def acts(self) -> str:
        """ "every plant step" or "every tick"."""
        return "every plant step" if self.stage == "motion" else "every tick"

    def modules_in(self, scene: Scene) -> tuple[str, ...]:
        """Returns what it imports in a scene: another integrator has its own modules, not those of exact motion."""
        if scene.clock.integrator == "exact":
            return self.modules
        kept = tuple(module for module in self.modules if module not in (*_EXACT, *RUBBING))
        motion = find_integrator(scene.clock.integrator).motions[1].partition(":")[0]
        return (*kept, motion) if self.key == "friction" else kept

    def is_named(self, scene: Scene) -> bool:
        """Tells whether a resolved scene names it; a number that is 0 names nothing."""
        found = value_at(scene, self.key)
        return bool(found) if self.value is None else found == self.value

    def is_in(self, scene: Scene) -> bool:
        return self.is_named(scene) and self.used(scene)

    def batches_in(self, scene: Scene) -> bool:
        """Tells whether a scene that names it can be one of many that run as one; no effect of another package can."""
        if self.table is not None:
            return False
        return self.batches if isinstance(self.batches, bool) else self.batches(scene)

    def states_in(self, scene: Scene) -> int:
        return self.states if isinstance(self.states, int) else self.states(scene)

    def without(self, scene: Scene) -> Scene:
        """Returns a resolved scene that names it, but without it and without what cannot be there in its absence."""
        return self.takes_out(scene) if self.takes_out else without(scene, self.key)


def as_written(key: str) -> str:
    """Returns a key as a scene file writes it: a table in brackets."""
    return key if "." in key else f"[{key}]"
