"""The logger's core: telemetry in, books, log and summary out; knows nothing of sockets."""

from __future__ import annotations

import hashlib
import time as wall_clock
from bisect import insort
from collections import Counter
from collections.abc import Callable

import numpy as np

from haploop.logger.books.balance import balance_words, moved_J, residual_J, unexplained_J
from haploop.logger.books.books import Books
from haploop.logger.books.buffers import ControllerBuffer, PlantBuffer
from haploop.logger.log.channels import Channels, motion_columns
from haploop.logger.summary import Account, Summary, energy, note_accounts, outcome, versions
from haploop.logger.verdict.changes_made import ChangesMade
from haploop.logger.verdict.measures import UNTOLD, WINDOW_S, RunMeasures
from haploop.logger.verdict.window import CONTROLLER_COLUMNS, Window
from haploop.plant.counters import COUNTERS
from haploop.protocol.changes import Event
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.telemetry import Block
from haploop.protocol.transport.wire import Message
from haploop.protocol.walls.registry import class_of


class Logger:
    """Keeps the books of a run from the blocks of plant and controller, in whichever order they come.

    Args:
        scene, time: the resolved scene and its timebase.
        channels: where to write, or None to keep books only.

    Attributes:
        time: the timebase of the run.
        tick: every interval before it is booked.
        foreign: roles taken by foreign programs.
        booked: called once some ticks are booked, with the first of them and the running books at each, name -> array.
    """

    def __init__(self, scene: Scene, time: Timebase, channels: Channels | None) -> None:
        self._scene, self.time, self._channels = scene, time, channels
        self.books = Books(scene, time)
        self.window = Window(time, scene.count_m)
        self._measures: RunMeasures | None = None
        self._accounts: dict[int, Account] = {}
        self._events: list[tuple[int, Event]] = []
        self._not_made: list[str] = []
        self._changes = ChangesMade()
        self._counted: Counter[str] = Counter()
        self._digest = hashlib.sha256()
        self.booked: Callable[[int, dict[str, np.ndarray]], object] = lambda first, books: None
        self.foreign: tuple[str, ...] = ()
        self.tick = self._first_tick = 0

    def count_wall_time(self) -> None:
        self._began = wall_clock.perf_counter()

    def start(self, plant: dict[str, float], history: list[Block], controller_tick: int = 0) -> None:
        """Starts from the plant's state and, when joining a run, the controller's last blocks.

        Args:
            controller_tick: tick at which the controller's blocks will begin if it has sent none.
        """
        self.count_wall_time()
        known = history[-1]["from_tick"] + history[-1]["ticks"] if history else 0
        self.tick = self._first_tick = max(int(plant["tick"]), known)
        self._plant = PlantBuffer(self.time.steps_per_tick, int(plant["tick"]))
        self._controller = ControllerBuffer(
            history[0]["from_tick"] if history else controller_tick, class_of(self._scene.wall)
        )
        for block in history:
            self._buffer(block)
        self._end_state = {name: np.array([plant[name]]) for name in ("x", "v", "force")}
        self._started = False
        self._unlogged: list[Block] = []

    def plant_block(self, block: Block) -> None:
        self._plant.add(block)
        self._book_common()

    def controller_block(self, block: Block) -> None:
        self._buffer(block)
        self._unlogged.append(block)
        self._book_common()

    def _buffer(self, block: Block) -> None:
        self._controller.add(block)
        note_accounts(self._accounts, block["elements"], block["from_tick"] + block["ticks"])

    def event(self, tick: int, event: Event) -> None:
        """Records an event that changes the run at ``tick``; it is logged once the books reach that tick."""
        self._not_made += [event[kind] for kind in ("refused", "restored") if kind in event]
        insort(self._events, (tick, event), key=lambda item: item[0])
        self._log_events()

    def _log_events(self) -> None:
        while self._events and self._events[0][0] <= self.tick:
            tick, event = self._events.pop(0)
            self._changes.note(tick, event)
            if self._channels:
                self._channels.event(tick, event)

    def _book_common(self) -> None:
        """Books the intervals of which both sides are known, block by block of the controller.

        Cutting only where elements change makes the log's columns independent of how telemetry was cut. A logger that
        joins a run begins where no command older than the controller rows it knows is still in effect.
        """
        if not self._started and self._plant.end > self._plant.tick:
            self.tick = self._first_tick = max(self.tick, self._plant.first_tick_from(self._controller.first))
        if self._started or self._bookable > self.tick:  # a logger that joins knows its first tick only now
            self._log_controller()
        while (end := self._bookable) > self.tick:
            self._book(end)

    @property
    def _bookable(self) -> int:
        return min(self._plant.end, self._controller.part_end(self.tick))

    def _log_controller(self) -> None:
        """Logs what has come from the controller, before the plant: a log cut off anywhere can be replayed."""
        blocks, self._unlogged = self._unlogged, []
        for block in blocks:
            if self._channels:
                self._channels.controller(block, self._first_tick)

    @np.errstate(over="ignore", invalid="ignore")  # where a force is not finite, its books are not finite either
    def _book(self, end: int) -> None:
        if self._plant.tick < self.tick:
            self._plant.take(self.tick)
        plant, controller = self._plant.take(end), self._controller
        states = np.stack([plant["x"], plant["v"]], axis=1)
        if not self._started:
            self.books.start(plant)
            self._digest.update(states[:1].tobytes())
            self._started = True
        rows = self.books.book(self.tick, plant, controller.commanded(self.tick, end))
        columns = {name: controller.rows(name, self.tick, end)[:, None] for name in CONTROLLER_COLUMNS}
        self.window.add(plant["x"][:, None], plant["force"][:-1, None], columns)
        self._measures = None
        self._digest.update(states[1:].tobytes())
        for name in plant.keys() & COUNTERS:
            self._counted[name] += int(plant[name][-1] - plant[name][0])
        motion, first, books = motion_columns(plant), self.tick, self._named(rows)
        self._end_state = {name: column[-1:] for name, column in motion.items()}
        if self._channels:
            self._channels.plant(first, end - first, motion)
            self._channels.energy(first, books)
        self.tick = end
        self.booked(first, books)
        controller.forget_before(end, int(plant["command"][-1]))
        self._log_events()

    def _named(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """Returns the running books by readable names: an element's by its kind, numbered where a kind recurs."""
        names = [self._account_name(name) for name in self.books.names]
        return dict(zip(names, rows, strict=True)) | self.books.residuals(rows)

    def _account_name(self, name: str) -> str:
        book, dot, side = name.partition(".")
        if not book.isdigit():
            return name
        kind = self._accounts[int(book)].kind
        number = [known for known in sorted(self._accounts) if self._accounts[known].kind == kind].index(int(book)) + 1
        return f"{kind}{f'-{number}' if number > 1 else ''}{dot}{side}"

    def end(self) -> None:
        """Writes the end state, and what the controller sent even if nothing was booked; call once, at the end."""
        self._log_controller()
        if self._channels:
            self._channels.plant_end(self.tick, self._end_state)

    def summary(self, failed: str, reason: str | None, trouble: str | None, telemetry_gaps: int) -> Summary:
        """Returns the summary of what was booked so far.

        Args:
            failed: why the run failed, "" if it did not.
            reason: why the plant itself ended the run, or None.
            trouble: which element gave a force that is not finite, or None.
            telemetry_gaps: ticks whose telemetry did not arrive.
        """
        why = failed or "; ".join(part for part in (trouble, reason) if part)
        is_complete = self.tick >= self.time.ticks
        ended = "failed" if failed or trouble else "diverged" if reason else "done" if is_complete else "stopped"
        ticks, wall_s = self.tick - self._first_tick, wall_clock.perf_counter() - self._began
        duration_s = ticks / self.time.control_rate
        ran: Summary = {
            "duration_s": duration_s,
            "ticks": ticks,
            "steps": ticks * self.time.steps_per_tick,
            "from_tick": self._first_tick,
            "ended": ended,
            "why": why,
            "final": {"x_m": float(self._end_state["x"][0]), "v_m_s": float(self._end_state["v"][0])},
            "lost": {"commands_dropped": 0, "commands_lost": 0, "telemetry_gaps": telemetry_gaps},
        }
        for name in COUNTERS:
            if name in self._counted:
                entry, _, what = name.partition(".")
                ran.setdefault(entry, {})[what] = self._counted[name]
        ran |= {
            "trajectory_sha256": self._digest.hexdigest(),
            "versions": versions(),
            "wall_s": wall_s,
            "real_time_factor": duration_s / wall_s if wall_s else 0.0,
        }
        books = self.books.state
        accounts = [
            a._replace(from_tick=max(a.from_tick, self._first_tick), to_tick=min(a.to_tick, self.tick))
            for a in self._accounts.values()
            if f"{a.book}.true" in books.names
        ]
        has_wall = self._scene.wall is not None
        energies = energy(books, accounts, has_wall) | self._balance()
        told = {"not_made": self._not_made} if self._not_made else {}
        diverged = reason if ended == "diverged" else None
        return outcome(self._scene, ran, self._measured(), diverged, self._changed_s) | {"energy": energies} | told

    def _balance(self) -> dict[str, str]:
        """Returns the sentence ``balance`` on what the books leave unexplained, where it is worth one."""
        # haploop's own crude integrators generate energy, too: then the cause need not be the controller.
        may_be = {*self.foreign, *["plant"] * (self._scene.clock.integrator != "exact")} if self.foreign else ()
        words = balance_words(unexplained_J(self.books.state), moved_J(self.books.state), may_be)
        return {"balance": words} if words else {}

    def _measured(self) -> RunMeasures:
        if self._measures is None:
            (self._measures,) = self.window.measures()
        return self._measures

    @property
    def _changed_s(self) -> float | None:
        """When the loop was last changed within the window, s; None if it was not."""
        first = self._first_tick + self._measured().window.figures.from_s * self.time.control_rate
        tick = self._changes.last_within(first, self.tick)
        return None if tick is None else tick / self.time.control_rate

    def status(self) -> Message:
        """Returns the time that the run has reached and its measures, for progress lines and viewers."""
        if self.tick == self._first_tick:
            return {}
        measures, books, changed_s = self._measured(), self.books.state, self._changed_s
        is_short = self.tick - self._first_tick < WINDOW_S * self.time.control_rate
        verdict = measures.verdict(None, UNTOLD["short"] if is_short else measures.untold(self.tick, "", changed_s))
        figures = (measures if changed_s is None else measures.of_two_loops(changed_s)).window.figures
        return {
            "t_s": self.tick / self.time.control_rate,
            "verdict": verdict.word,
            "verdict_rule": verdict.rule,
            "oscillation_m": figures.oscillation_m,
            "displayed_stiffness_N_m": figures.displayed_stiffness_N_m,
            "residual_J": residual_J(books),
            "moved_J": moved_J(books),
            **self._balance(),
        }
