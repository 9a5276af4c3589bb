"""The events of a run and the single meaning of a change: what a swap or a set does to a scene, and from which tick on.

An event is a map, in the form that a scene's ``[[event]]``, GRANT and the log's ``/events`` hold. Two events change
what is simulated: ``swap`` (adds, removes or replaces an element) and ``set`` (sets values of wall, delay or elements).
The others (pause, resume, step, pace, stop, refused, restored) change no bit of it: a controller that takes a swap
back because the new element raised an error has already done so by itself when the event reports it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any

from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import NO_ELEMENT, ElementTable, Scene

Event = dict[str, Any]

KINDS = ("swap", "set", "pause", "resume", "step", "stop", "pace", "refused", "restored")
# Keys in the status of a PROGRESS that report changes which were not made, or were taken back.
REFUSALS = ("refused", "refused_changes", "restored")
_NO_UNITS: Mapping[str, str] = {}


@dataclass(frozen=True)
class Change:
    """A swap or a set at its tick.

    Attributes:
        tick: the first tick that sees the change.
        swap: the new element; one named ``NO_ELEMENT`` removes an element. None for a set.
        element: place in the list of elements, counted from 0; one past the end adds an element.
        set: dotted key -> value in SI units.
        plugin: path of a file that defines the element, loaded first; None if there is none.
        refused: why the change could not be carried out, as a full sentence; None if it was carried out.
        on_record: tick of the event that reports the change, if that is a later one, as when a swap is taken back.
    """

    tick: int
    swap: ElementTable | None = None
    element: int = 0
    set: Mapping[str, Any] = field(default_factory=dict)
    plugin: str | None = None
    refused: str | None = None
    on_record: int | None = field(default=None, compare=False)

    @classmethod
    def from_dict(cls, tick: int, event: Event) -> Change:
        """Reads an event that is a change."""
        return cls(
            tick,
            ElementTable.from_dict(event["swap"]) if event.get("swap") else None,
            event.get("element") or 0,
            event.get("set") or {},
            event.get("plugin"),
            event.get("refused"),
        )

    def as_dict(self) -> Event:
        """Returns a map that ``from_dict`` reads back, the tick aside."""
        content: Event = {"set": dict(self.set)}
        if self.swap is not None:
            content = {"swap": self.swap.as_dict(), "element": self.element}
        extra = {"plugin": self.plugin, "refused": self.refused}
        return {"tick": self.tick, **content, **{key: value for key, value in extra.items() if value is not None}}

    def apply(self, scene: Scene) -> Scene:
        """Returns the scene with the change made, or unchanged if the change was refused.

        What the change does not affect is shared with ``scene``: an element that stays is the same object.
        """
        if self.refused is not None:
            return scene
        if self.swap is not None:
            elements = list(scene.dissipation)
            elements[self.element : self.element + 1] = [] if self.swap.name == NO_ELEMENT else [self.swap]
            scene = replace(scene, dissipation=tuple(elements))
        for key, value in self.set.items():
            scene = with_value(scene, key, value)
        return scene

    def singly(self) -> Iterator[Change]:
        """Yields the change value by value: each set of an element's parameter opens a separate book."""
        if self.swap is not None or len(self.set) < 2:
            yield self
            return
        for key, value in self.set.items():
            yield replace(self, set={key: value})

    def describe(self, units: Mapping[str, str] = _NO_UNITS) -> str:
        """Returns the change in a few words, such as ``element 0 becomes damping (damping 0.8 N s/m)``.

        Args:
            units: unit by settable key, and by kind and parameter (``damping.damping``); a number without one is bare.
        """
        if self.swap is None:
            return "set " + ", ".join(f"{key} = {_amount(value, units.get(key))}" for key, value in self.set.items())
        kind = self.swap.name
        if kind == NO_ELEMENT:
            return f"element {self.element} is removed"
        values = self.swap.parameters.items()
        words = [f"{name} {_amount(value, units.get(f'{kind}.{name}'))}" for name, value in values]
        words += ["always"] * (self.swap.acts == "always")
        return f"element {self.element} becomes {kind}" + (f" ({', '.join(words)})" if words else "")

    def is_as(self, other: Change | None) -> bool:
        """Tells whether another change is the same, apart from its plugin file and from whether it was refused."""
        return other is not None and replace(self, plugin=None, refused=None) == replace(
            other, plugin=None, refused=None
        )

    def refuse(self, error: BaseException, place: str = "") -> Change:
        """Returns the change as one that could not be carried out; ``place`` says where in a file the error arose."""
        why = f"{type(error).__name__}: {error}{place}"
        return replace(self, refused=f"The change at tick {self.tick}, {self.describe()}, was refused: {why}")


@dataclass(frozen=True)
class Span:
    """The scene at work from one tick up to another, which is infinite for the last span."""

    from_tick: int
    to_tick: float
    scene: Scene


def is_change(event: Event) -> bool:
    """Tells whether an event changes what is simulated."""
    return "swap" in event or "set" in event


def refusal(change: Change) -> Event:
    """Returns the event that puts a refused change on record; it comes later than the event of the change itself."""
    return {"refused": change.refused, "change": {k: v for k, v in change.as_dict().items() if k != "refused"}}


def refusals_as_status(refused: Iterable[Change], restored: Sequence[Event] = ()) -> Event | None:
    """Returns the controller's PROGRESS status for changes refused and taken back; None if there are none."""
    events = [refusal(change) for change in refused]
    named = {"refused": "refused", "refused_changes": "change"}
    status = {key: [event[name] for event in events] for key, name in named.items()} if events else {}
    return status | ({"restored": list(restored)} if restored else {}) or None


def restoration(change: Change, why: str, since: int | None = None, plugin: str | None = None) -> Event:
    """Returns the event that reports that a swap was taken back: what took its place, from which tick on, and why.

    ``since`` is the tick of that swap and ``plugin`` the file that came with it, which is taken back too.
    """
    code = {} if plugin is None else {"code": {"tick": since, "plugin": plugin}}
    return {"restored": why, "change": change.as_dict()} | code


def is_off(tick: int, event: Event, events: Sequence[tuple[int, Event]]) -> bool:
    """Tells from the events of a run whether a change that came with a plugin was refused or taken back."""
    change, code = Change.from_dict(tick, event), {"tick": tick, "plugin": event["plugin"]}
    refused = (refused_change(other) for _, other in events if "refused" in other)
    return any(other.get("code") == code for _, other in events) or any(
        told and told.plugin == change.plugin and change.is_as(told) for told in refused
    )


def refused_change(event: Event) -> Change | None:
    """Returns the change that is named by a refusal, or by the taking back of a swap; None if it names none."""
    try:
        return Change.from_dict(
            int(event["change"]["tick"]), {**event["change"], "set": dict(event["change"].get("set", {}))}
        )
    except (AttributeError, KeyError, TypeError, ValueError):
        return None


def refusals_of(status: Event, events: Iterable[tuple[int, Event]] = ()) -> list[Event]:
    """Returns the events that put on record what a PROGRESS reported; the report need not name the changes themselves.

    What is not a refusal is left out, and so are refusals that are already among ``events``, (tick, event).
    """
    sentences, changes = status.get("refused"), status.get("refused_changes")
    known = [refused_change(event) for _, event in events if "refused" in event]
    found: list[Event] = []
    for number, sentence in enumerate(sentences if isinstance(sentences, list) else ()):
        event: Event = {"refused": str(sentence)}
        if isinstance(changes, list) and number < len(changes):
            event["change"] = changes[number]
            change = refused_change(event)
            if change is None:
                del event["change"]
            elif any(change.is_as(other) for other in known):
                continue
        found.append(event)
    taken_back = status.get("restored")
    for told in taken_back if isinstance(taken_back, list) else ():
        if change := refused_change(told):
            code = told.get("code") or {}
            found.append(restoration(change, str(told.get("restored")), code.get("tick"), code.get("plugin")))
    return found


def changes_of(events: Iterable[tuple[int, Event]]) -> list[Change]:
    """Returns the changes among (tick, event) in order, with ``refused`` set where a later event refuses one."""
    events = list(events)
    refusals = [event for _, event in events if "refused" in event]
    changes: list[Change] = []
    for tick, event in events:
        if is_change(event):
            changes.append(Change.from_dict(tick, event))
        elif "restored" in event and (change := refused_change(event)):
            changes.append(replace(change, on_record=tick))
    changes.sort(key=lambda change: change.tick)
    sentences = [
        next((event["refused"] for event in refusals if change.is_as(refused_change(event))), None)
        for change in changes
    ]
    return [replace(change, refused=why or change.refused) for change, why in zip(changes, sentences, strict=True)]


def spans(scene: Scene, changes: Iterable[Change]) -> list[Span]:
    """Returns which scene was at work from when to when, in order: a span for the start and one per change made."""
    made = [change for change in changes if change.refused is None]
    ends = [*(change.tick for change in made), math.inf]
    found = [Span(0, ends[0], scene)]
    for change, end in zip(made, ends[1:], strict=True):
        found.append(Span(change.tick, end, change.apply(found[-1].scene)))
    return found


def happened_at(tick: int, event: Event) -> int:
    """Returns the tick at which an event recorded at a tick took effect: an earlier one if a swap was taken back."""
    taken_back = refused_change(event) if "restored" in event else None
    return taken_back.tick if taken_back else tick


def at_work(scene: Scene, changes: Iterable[Change]) -> Scene:
    return reduce(lambda now, change: change.apply(now), changes, scene)


def describe(event: Event, units: Mapping[str, str] = _NO_UNITS) -> str:
    """Returns any event in a few words; ``units`` as in ``Change.describe``."""
    if is_change(event):
        return Change.from_dict(0, event).describe(units)
    match next((kind for kind in KINDS if kind in event), None):
        case "step":
            return f"{event['step']} tick{'s' * (event['step'] != 1)} on"
        case "pace":
            return "as fast as it goes" if event["pace"] == "free" else f"pace {_amount(event['pace'], None)}"
        case "refused" | "restored" as kind:
            return str(event[kind])
        case kind:
            return {"pause": "paused", "resume": "resumed", "stop": "stopped"}.get(kind or "", "changed")


def _amount(value: Any, unit: str | None) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g} {unit or ''}".rstrip() if isinstance(value, int | float) else str(value)
