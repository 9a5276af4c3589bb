"""The commands that other terminals may send to a running loop, and the answers."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from typing import TYPE_CHECKING

from haploop.controller.dissipation import ElementError, PluginError
from haploop.launch.clock import device_time
from haploop.launch.clock.arguments import check_burden, check_names
from haploop.launch.clock.capabilities import as_typed, capabilities, in_words, units_at
from haploop.launch.clock.clock import Clock, ClockError
from haploop.launch.clock.pace import PaceError, pace_of
from haploop.launch.clock.plugin_swap import swap_plugin
from haploop.launch.clock.reloads import Code, Reloads
from haploop.launch.clock.roster import Roster
from haploop.launch.clock.seen import when_seen
from haploop.launch.clock.undo import Made, MadeChanges
from haploop.launch.plan.effects import notes
from haploop.launch.scene.mistakes import SceneError
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
_MOST_TOLD = 5
_CHANGES = ("swap", "set", "undo")
_PROBATION = {
    "restore": "If it raises or gives no finite number within its first second, what was there before is restored; the "
    "terminal of the run reports this at once, and the log and the summary record it, with the file and the line. "
    "If this happens later, the run ends.",
    "end": "If it raises or gives no finite number, the run ends and reports the file and the line.",
}


def pace_in_words(pace: float) -> float | str:
    """Returns a pace as people write it: a number, or ``free``."""
    return "free" if math.isinf(pace) else pace


class Commands:
    """Carries out COMMAND messages: each a verb and its arguments, answered with a sentence and data.

    A refused command leaves the run as it was.
    """

    def __init__(self, clock: Clock, spec: RunSpec, roster: Callable[[], Roster]) -> None:
        self._clock, self._spec, self._roster, self._reloads = clock, spec, roster, Reloads(clock, spec)
        self._rate = spec.scene.clock.control_rate
        self._is_trying = False
        self._made = MadeChanges()
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
        """Returns the answer, or a generator that returns it, to be advanced step by step while time goes on."""
        act = self._verbs.get(verb)
        if self._spec.clock == device_time.PLANT and (why := device_time.refusal(verb, arguments)):
            return False, why, {}
        if act is None:
            return False, f"{verb[:40]!r} is not a command; the commands are: {', '.join(self._verbs)}.", {}
        try:
            check_names(verb, act, arguments)
            check_burden(arguments)
            self._settle()
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
            "pace": device_time.PLANT if self._spec.clock == device_time.PLANT else pace_in_words(clock.pace.rate),
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
                f"A step lasts for a whole number of ticks from 1 to {longest}, but {given} was asked for."
            )
        self._clock.note({"step": ticks})
        tick = self._clock.step(ticks)
        return f"stepping to {self._at(tick)}", {"tick": tick}

    def _pace(self, pace: float | str) -> tuple[str, Message]:
        rate = pace_of(pace)
        tick = self._clock.run_at(rate)
        self._clock.note({"pace": pace_in_words(rate)})
        return f"pace {pace_in_words(rate)} from {self._at(tick)} on", {"tick": tick}

    def _stop(self) -> tuple[str, Message]:
        tick = self._clock.stop()
        self._clock.note({"stop": True})
        return f"stopping at {self._at(tick)}", {"tick": tick}

    def _swap(
        self, swap: Tables, element: int = 0, at: float | None = None, reload: bool = False
    ) -> Done | Generator[None, None, Done]:
        """Swaps an element; a kind from a file is tried first, which takes time, so the answer comes later."""
        kind, change = swap.get("kind") if isinstance(swap, dict) else None, {"swap": swap, "element": element}
        if isinstance(kind, str) and kind in self._spec.plugin_sources:
            return self._swap_tried(change, at, reload)
        if reload:
            known = ", ".join(sorted(self._spec.plugin_sources)) or "none"
            says = f"Only kinds from files given by --plugin when the run was started can be reloaded ({known})"
            raise ClockError(f"{says}, but {kind} was asked for.")
        before = self._clock.scene_at(self._clock.tick_at(at)).dissipation
        done = self._swapped(change, before, self._clock.change(change, at))
        is_known = kind == NO_ELEMENT or self._spec.kinds[str(kind)].__module__.startswith("haploop.")
        return done if is_known else self._on_probation(done)

    def _swap_tried(self, change: Event, at: float | None, reload: bool) -> Generator[None, None, Done]:
        if self._is_trying:
            raise ClockError("The file of another swap is being tried; wait for its answer, then ask again.")
        self._is_trying = True
        try:
            tick, before, code = yield from swap_plugin(self._clock, self._spec, self._reloads, change, at, reload)
        finally:
            self._is_trying = False
        return (yield from self._on_probation(self._swapped(change, before, tick, code)))

    def _settle(self, withdrawn: Event | None = None) -> None:
        """Forgets swaps and reloads that have failed since, and their code: nothing is left of them to undo."""
        self._made.forget(*self._reloads.settle(withdrawn))
        self._made.forget_taken_back(self._clock.events)

    def _on_probation(self, done: Done) -> Generator[None, None, Done]:
        """Returns the answer to a swap to an element that may raise, once the element has worked for a tick."""
        asked = self._made.last.event
        try:
            text, data = yield from when_seen(self._clock, self._roster, *done, by="controller")
        except ClockError:  # it was refused, and nothing has changed
            self._made.forget(asked)
            self._settle()
            raise
        return f"{text}\n{_PROBATION[self._spec.scene.run.faulty_swap]}", data

    def _swapped(self, change: Event, before: Sequence[ElementTable], tick: int, code: Code | None = None) -> Done:
        """Returns what was done and what would undo it; ``code`` is that before a reload, which undo brings back."""
        swap, element = change["swap"], change["element"]
        text, data = f"element {element} becomes {swap['kind']} at {self._at(tick)}", {"tick": tick}
        if swap["kind"] == NO_ELEMENT and element < len(before) - 1:  # those after it move up: no swap restores it
            self._made.add(Made(tick, self._clock.newest, None))
            return text, data
        back = before[element].as_dict() if element < len(before) else {"kind": NO_ELEMENT}
        words = " ".join([back["kind"], *(f"{key}={as_typed(back[key])}" for key in back if key != "kind")])
        where = f" --element {element}" if element else ""
        undo: Event = {"swap": back, "element": element}
        self._made.add(Made(tick, self._clock.newest, undo, code))
        return f"{text}; to go back: {'undo' if code else f'swap {words}{where}'}", data | {"before": undo}

    def _set(self, set: dict[str, float], at: float | None = None) -> tuple[str, Message]:
        if set == {}:
            raise ClockError("Nothing was set: a set names at least one key with its value, such as wall.stiffness.")
        before = self._clock.scene_at(self._clock.tick_at(at))
        tick = self._clock.change({"set": set}, at)
        back = {key: value_at(before, key) for key in set}
        taken, were = (in_words(before, self._spec.kinds, values) for values in (self._clock.newest["set"], back))
        what = ", ".join(f"{key} = {value}" for key, value in taken.items())
        words = " ".join(f'{key}="{value}"' if " " in value else f"{key}={value}" for key, value in were.items())
        self._made.add(Made(tick, self._clock.newest, {"set": back}))
        known, kinds = notes(before, self._spec.kinds), self._spec.kinds
        found = [note for note in notes(self._clock.scene_at(tick), kinds) if not note.key.startswith("event.")]
        new = [note for note in found if note not in known]  # whoever sets a key again knows that it was set
        text = f"{what} from {self._at(tick)} on; to go back: set {words}"
        return "\n".join([text, *new]), {"tick": tick, "before": {"set": back}, "notes": new}

    def _undo(self) -> tuple[str, Message]:
        """Undoes the last swap or set: withdraws it if it still lies in the future, else makes another change at once.

        An element comes back with the parameters it had, but starts afresh: what it remembered is lost.
        """
        if not self._made:
            raise ClockError("There is nothing to undo: no swap or set requested by a command is left.")
        _, asked, back, code = self._made.last
        units = units_at(self._clock.present(), self._spec.kinds)
        what = describe(asked, units)
        if back is None:
            raise ClockError(
                f"The last change, {what}, cannot be undone: the elements after it have moved up, and no swap inserts "
                "one between others. Earlier changes cannot be undone past it; swap and set can still change what they "
                "changed."
            )
        if self._clock.withdraw(asked):
            self._settle(withdrawn=asked)
            text, data = f"{what} will not happen", {}
        else:
            # The file that the kind had before the reload comes back with the element, of whatever kind that is.
            if code and (former := code[asked["swap"]["kind"]]) and former[2]:
                tick, _ = self._reloads.change(back, None, code, former[2])
            else:
                tick = self._clock.change(back)
            text, data = f"undone: {what}; {describe(back, units)} at {self._at(tick)}", {"tick": tick, **back}
        self._made.forget(asked)
        return text, data


def _refusal(verb: str, error: Exception) -> Answer:
    """Returns the answer to a command that failed: whatever a terminal sends, the run continues."""
    if isinstance(error, SceneError):
        told = [str(mistake) for mistake in error.mistakes[:_MOST_TOLD]]
        rest = len(error.mistakes) - len(told)
        return False, "\n".join([*told, *([f"There are {rest} more mistakes."] if rest else [])]), {}
    if isinstance(error, ClockError | PaceError | PluginError | ElementError | OutputError):
        return False, str(error), {}
    return False, f"The arguments of {verb} cannot be used: {type(error).__name__}: {error}.", {}
