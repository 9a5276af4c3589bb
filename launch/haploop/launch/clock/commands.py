"""The commands that other terminals may send to a running loop, and the answers."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from inspect import signature
from typing import TYPE_CHECKING, Any

from haploop.controller.dissipation import ElementError, PluginError
from haploop.launch.clock import device_time
from haploop.launch.clock.capabilities import capabilities
from haploop.launch.clock.clock import Clock, ClockError
from haploop.launch.clock.pace import PaceError, pace_of
from haploop.launch.clock.plugin_swap import swap_plugin
from haploop.launch.clock.roster import Roster
from haploop.launch.clock.seen import when_seen
from haploop.launch.scene.mistakes import SceneError
from haploop.launch.scene.number import is_exotic
from haploop.launch.spec import OutputError
from haploop.protocol.changes import Event, describe
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import NO_ELEMENT, ElementTable
from haploop.protocol.scene.table import Tables
from haploop.protocol.transport.wire import Message

if TYPE_CHECKING:
    from haploop.launch.spec import RunSpec

Done = tuple[str, Message]
Answer = tuple[bool, str, Message]
# What one command may carry, so that none holds time up: keys and values, tables in each other, letters of a text.
_MOST_VALUES, _DEEPEST, _LONGEST = 64, 3, 200
_MOST_TOLD = 5
_CHANGES = ("swap", "set", "undo")
_UNITS = "Hz, J, N, Pa, W, g, m, min, rad, s and %, with n, u, m, c, k or M before them"


def in_words(pace: float) -> float | str:
    """Returns a pace as people write it: a number, or ``free``."""
    return "free" if math.isinf(pace) else pace


class Commands:
    """Carries out COMMAND messages: each a verb and its arguments, answered with a sentence and data.

    Whatever is refused leaves the run as it was.
    """

    def __init__(self, clock: Clock, spec: RunSpec, roster: Callable[[], Roster]) -> None:
        self._clock, self._spec, self._roster = clock, spec, roster
        self._rate = spec.scene.clock.control_rate
        self._is_trying = False
        # Of each change: its event, and the change that would take it back, None where none can.
        self._undo_by: list[tuple[Event, Event | None]] = []
        self._verbs = {
            "status": self._status,
            "options": self._options,
            "pause": self._pause,
            "resume": self._resume,
            "step": self._step,
            "pace": self._pace,
            "stop": self._stop,
            "swap": self._swap,
            "set": self._set,
            "undo": self._undo,
        }

    def __call__(self, verb: str, arguments: Message) -> Answer | Generator[None, None, Answer]:
        """Returns the answer, or steps to be gone through one by one while time goes on, which return it."""
        act = self._verbs.get(verb)
        if self._spec.clock == device_time.PLANT and (why := device_time.refusal(verb, arguments)):
            return False, why, {}
        if act is None:
            return False, f"{verb[:40]!r} is no command; these are: {', '.join(self._verbs)}.", {}
        try:
            _check_names(verb, act, arguments)
            _check_burden(arguments)
            done = act(**arguments)
        except Exception as error:
            return _refusal(verb, error)
        if isinstance(done, tuple) and verb in _CHANGES and "tick" in done[1] and self._roster().witness == "logger":
            return self._later(verb, when_seen(self._clock, self._roster, *done))
        return (True, *done) if isinstance(done, tuple) else self._later(verb, done)

    def _later(self, verb: str, steps: Generator[None, None, Done]) -> Generator[None, None, Answer]:
        try:
            done = yield from steps
        except Exception as error:
            return _refusal(verb, error)
        return (True, *done)

    def _at(self, tick: int) -> str:
        return f"tick {tick} ({tick / self._rate:g} s)"

    def _status(self) -> tuple[str, Message]:
        clock, roster = self._clock, self._roster()
        logger = roster.own("logger")
        data = {
            "title": self._spec.scene.title,
            "out": str(self._spec.out),
            "tick": logger.tick if logger else 0,
            "granted": clock.until,
            "end": clock.end,
            "control_rate": self._rate,
            "paused": clock.paused,
            "pace": device_time.PLANT if self._spec.clock == device_time.PLANT else in_words(clock.pace.rate),
            "lateness": self._lateness(roster),
            "nodes": roster.table(),
            **({"programs": programs} if (programs := roster.provenance()) else {}),
            "refused": roster.refused,
            "telemetry": {role: addresses["telemetry"] for role, addresses in roster.endpoints().items()},
            **({"status": logger.status} if logger else {}),
        }
        state = "paused" if clock.paused else "running"
        return f"{state} at {self._at(data['tick'])} of {clock.end}", data

    def _lateness(self, roster: Roster) -> Message:
        if self._spec.clock != device_time.PLANT:
            return self._clock.pace.lateness()
        plant = roster.own("plant")
        return device_time.lateness_told(plant.status if plant else {})

    def _options(self) -> tuple[str, Message]:
        data = capabilities(self._clock.present(), self._spec.kinds)
        return f"{len(data['settable'])} keys can be set, {len(data['kinds'])} kinds swapped in", data

    def _pause(self) -> tuple[str, Message]:
        tick = self._clock.pause()
        self._clock.note({"pause": True})
        return f"paused at {self._at(tick)}", {"tick": tick}

    def _resume(self) -> tuple[str, Message]:
        tick = self._clock.resume()
        self._clock.note({"resume": True})
        return f"resumed at {self._at(tick)}", {"tick": tick}

    def _step(self, ticks: int = 1) -> tuple[str, Message]:
        longest = self._clock.end
        if isinstance(ticks, bool) or not isinstance(ticks, int) or not 1 <= ticks <= longest:
            given = repr(ticks)[:40]
            raise ClockError(
                f"A step goes on for a whole number of ticks from 1 to {longest}, but {given} was asked for."
            )
        self._clock.note({"step": ticks})
        tick = self._clock.step(ticks)
        return f"stepping to {self._at(tick)}", {"tick": tick}

    def _pace(self, pace: float | str) -> tuple[str, Message]:
        rate = pace_of(pace)
        tick = self._clock.run_at(rate)
        self._clock.note({"pace": in_words(rate)})
        return f"pace {in_words(rate)} from {self._at(tick)} on", {"tick": tick}

    def _stop(self) -> tuple[str, Message]:
        tick = self._clock.stop()
        self._clock.note({"stop": True})
        return f"stopping at {self._at(tick)}", {"tick": tick}

    def _swap(
        self, swap: Tables, element: int = 0, at: float | None = None, reload: bool = False
    ) -> Done | Generator[None, None, Done]:
        """A kind that came from a file is tried first, which takes time: the answer comes later."""
        kind, change = swap.get("kind") if isinstance(swap, dict) else None, {"swap": swap, "element": element}
        if isinstance(kind, str) and kind in self._spec.plugin_sources:
            return self._swap_tried(change, at, reload)
        if reload:
            known = ", ".join(sorted(self._spec.plugin_sources)) or "none"
            says = f"Only kinds from files that the run was started with by --plugin can be reloaded ({known})"
            raise ClockError(f"{says}, but {kind} was asked for.")
        before = self._clock.scene_at(self._clock.tick_at(at)).dissipation
        return self._swapped(change, before, self._clock.change(change, at))

    def _swap_tried(self, change: Event, at: float | None, reload: bool) -> Generator[None, None, Done]:
        if self._is_trying:
            raise ClockError("The file of another swap is being tried; wait for its answer, then ask again.")
        self._is_trying = True
        try:
            tick, before = yield from swap_plugin(self._clock, self._spec, change, at, reload)
        finally:
            self._is_trying = False
        if reload:  # the code before is gone from here: no swap brings it back
            self._undo_by.append((self._clock.newest, None))
            return f"element {change['element']} becomes {change['swap']['kind']} at {self._at(tick)}", {"tick": tick}
        return self._swapped(change, before, tick)

    def _swapped(self, change: Event, before: Sequence[ElementTable], tick: int) -> Done:
        """Tells what was done, and what would undo it."""
        swap, element = change["swap"], change["element"]
        text, data = f"element {element} becomes {swap['kind']} at {self._at(tick)}", {"tick": tick}
        if swap["kind"] == NO_ELEMENT and element < len(before) - 1:  # those after it move up: no swap brings it back
            self._undo_by.append((self._clock.newest, None))
            return text, data
        back = before[element].as_dict() if element < len(before) else {"kind": NO_ELEMENT}
        words = " ".join([back["kind"], *(f"{key}={value}" for key, value in back.items() if key != "kind")])
        where = f" --element {element}" if element else ""
        undo: Event = {"swap": back, "element": element}
        self._undo_by.append((self._clock.newest, undo))
        return f"{text}; to go back: swap {words}{where}", data | {"before": undo}

    def _set(self, set: dict[str, float], at: float | None = None) -> tuple[str, Message]:
        before = self._clock.scene_at(self._clock.tick_at(at))
        tick = self._clock.change({"set": set}, at)
        what = ", ".join(f"{key} = {value}" for key, value in set.items())
        back = {key: value_at(before, key) for key in set}
        words = " ".join(f"{key}={value}" for key, value in back.items())
        self._undo_by.append((self._clock.newest, {"set": back}))
        return f"{what} from {self._at(tick)} on; to go back: set {words}", {"tick": tick, "before": {"set": back}}

    def _undo(self) -> tuple[str, Message]:
        """Takes the last swap or set back: out of the future where it still lies there, else by another change at once.

        An element comes back with the parameters it had, and begins anew: what it remembered is gone.
        """
        if not self._undo_by:
            raise ClockError("There is nothing to undo: no swap and no set that a command asked for is left.")
        asked, back = self._undo_by[-1]
        if back is None:
            raise ClockError("The last change cannot be undone: no swap brings back what was there before it.")
        what = describe(asked)
        if self._clock.withdraw(asked):
            text, data = f"{what} will not happen", {}
        else:
            tick = self._clock.change(back)
            text, data = f"{what} is undone: {describe(back)} at {self._at(tick)}", {"tick": tick, **back}
        self._undo_by.pop()
        return text, data


def _refusal(verb: str, error: Exception) -> Answer:
    """Returns the answer to what failed: whatever a terminal sends, the run goes on."""
    if isinstance(error, SceneError):
        told = [str(mistake) for mistake in error.mistakes[:_MOST_TOLD]]
        rest = len(error.mistakes) - len(told)
        return False, "\n".join([*told, *([f"There are {rest} more mistakes."] if rest else [])]), {}
    if isinstance(error, ClockError | PaceError | PluginError | ElementError | OutputError):
        return False, str(error), {}
    return False, f"The arguments of {verb} cannot be used: {type(error).__name__}: {error}.", {}


def _check_names(verb: str, act: Callable[..., Any], arguments: Message) -> None:
    """Raises ClockError where an argument is none of the command's, or one that it needs is missing."""
    taken = signature(act).parameters
    needed = [name for name, one in taken.items() if one.default is one.empty and name not in arguments]
    if needed or not arguments.keys() <= taken.keys():
        names = f"it takes {', '.join(taken)}" if taken else "it takes none"
        lacks = f", and {' and '.join(needed)} must be given" if needed else ""
        raise ClockError(f"The arguments of {verb} cannot be used: {names}{lacks}.")


def _check_burden(arguments: Message) -> None:
    """Raises ClockError where a command carries more than takes a moment to look through, or keys that are none."""
    left: list[tuple[Any, int]] = [(arguments, 0)]
    seen = 0
    while left:
        value, depth = left.pop()
        inner = [*value, *value.values()] if isinstance(value, dict) else value if isinstance(value, list) else []
        seen += len(inner)
        if seen > _MOST_VALUES or depth > _DEEPEST:
            raise ClockError(
                f"A command carries at most {_MOST_VALUES} keys and values, {_DEEPEST} tables deep; this one has more."
            )
        if isinstance(value, str | bytes) and len(value) > _LONGEST:
            raise ClockError(f"A text in a command has at most {_LONGEST} letters, but one has {len(value)}.")
        if isinstance(value, str) and is_exotic(value):
            raise ClockError(f"{value!r} has a unit that a running loop does not know; it knows {_UNITS}.")
        if isinstance(value, dict) and (odd := [key for key in value if not isinstance(key, str)]):
            raise ClockError(f"The keys of what a command carries are texts, but {odd[0]!r} was given as one.")
        left += [(one, depth + 1) for one in inner]
