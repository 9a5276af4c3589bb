"""The plant's core: device and hand, sampled at ticks and driven by delayed commands."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from haploop.plant.choose import make_motion, make_position_sensor
from haploop.plant.line import Hold
from haploop.plant.line.delay import make_line
from haploop.protocol.changes import Event
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.protocol.ticks import DELAY, Timebase

# Takes the tick of the first of at most L + 1 samples, and the samples; returns the forces in N that answer them.
Exchange = Callable[[int, list[tuple[float, ...]]], list[float]]


class Checkpoint(NamedTuple):
    """Everything from which a plant continues, once its block has been taken.

    A tree of numbers, strings and NumPy arrays, which msgpack packs with ``default=np.ndarray.tolist``.

    Attributes:
        interval_due: whether the interval before ``tick`` has yet to be stepped.
        unusable: whether a command has arrived that is not a finite number.
        delays: changes of the delay still to come, (first command, plant steps).
        delay_steps: the delay that a change has set, or None.
        motion, line, position, accelerometer: the states of the parts.
    """

    tick: int
    interval_due: bool
    unusable: bool
    stop_reason: str | None
    delays: list[tuple[int, int]]
    delay_steps: int | None
    motion: Any
    last: Hold
    line: Any
    position: Any
    accelerometer: Any


class Plant:
    """Sampling, commands and record of one plant; knows nothing of sockets.

    ``stop_reason`` says why the plant ended by itself (it diverged, or a command was not finite), or is None.
    """

    def __init__(self, scene: Scene, time: Timebase) -> None:
        self._motion = make_motion(scene, time)
        self._steps, self._most = time.steps_per_tick, time.lookahead_ticks + 1
        self._control_rate = time.control_rate
        self._line = make_line(scene, time)
        self._counters = dict(self._line.counters)
        self._limit_m = scene.diverged_beyond
        self._position, self._sensor = make_position_sensor(scene, time), None
        if accelerometer_is_used(scene) and scene.accelerometer:
            from haploop.plant.sensing.accelerometer import Accelerometer

            self._sensor = Accelerometer(scene.accelerometer, scene.seed, time)
            self._counters |= self._sensor.counters
        self._measure = self._measure_both if accelerometer_is_used(scene) else self._measure_position
        self._interval_due = self._unusable = False
        self._block_first = 0
        self._delays: list[tuple[int, int]] = []
        self._delay_now: int | None = None
        self._x = self._motion.x
        self.tick = 0
        self.stop_reason: str | None = None

    def _measure_position(self, x: float) -> tuple[float, ...]:
        return (self._position.reading(x),)

    def _measure_both(self, x: float) -> tuple[float, ...]:
        acceleration, sensor = self._motion.acceleration(self.tick), self._sensor
        return self._position.reading(x), sensor.reading(acceleration) if sensor else acceleration

    def schedule(self, tick: int, change: Event) -> None:
        """Schedules a change for ``tick`` if it is one of the line's delay: command ``tick`` is the first."""
        if DELAY in (values := change.get("set", {})):
            self._delays.append((tick, round(values[DELAY] * self._steps * self._control_rate)))

    def run_until(self, end: int, exchange: Exchange) -> None:
        """Runs up to tick ``end``, or until the plant stops by itself; changes the delay on the way."""
        while self._delays and self._delays[0][0] < end:
            tick, delay_steps = self._delays.pop(0)
            self._work_until(tick, exchange)
            if self.stop_reason is None:
                self._retime(delay_steps)
        self._work_until(end, exchange)

    def _retime(self, delay_steps: int) -> None:
        self._line = self._line.retimed(delay_steps, self.tick)
        self._delay_now, self._most = delay_steps, delay_steps // self._steps + 1
        self._counters |= self._line.counters

    def _work_until(self, end: int, exchange: Exchange) -> None:
        """Runs up to tick ``end`` with one delay."""
        most = self._most
        while (tick := self.tick) < end and self.stop_reason is None:
            samples = self.samples(min(most, end - tick))
            if samples:
                self.receive(exchange(tick, samples))
        if self._interval_due and self.stop_reason is None:
            self._advance()

    def samples(self, count: int) -> list[tuple[float, ...]]:
        """Returns the next ``count`` samples, (x_m,) or (x_m, acceleration) each; fewer when the plant diverged.

        Commands up to ``tick + count - 2 - L`` must have been received.
        """
        samples = []
        for _ in range(count):
            if self._interval_due and not self._advance():
                break
            samples.append(self._measure(self._x))
            self.tick += 1
            self._interval_due = True
        return samples

    def receive(self, forces: list[float]) -> None:
        self._line.receive(forces)
        total = sum(forces)
        if total - total != 0.0:  # infinite or not a number
            self._unusable = True

    @property
    def has_no_force(self) -> bool:
        """True once a command has arrived that is not a finite number."""
        return self._unusable

    @property
    def reached(self) -> int:
        """The tick whose state is the present one: every interval before it has been stepped."""
        return self.tick - self._interval_due

    def _advance(self) -> bool:
        """Steps through interval ``tick - 1``; returns False if the run has to end where the plant now is."""
        tick = self.tick - 1
        holds = self._line.holds(tick)
        if self._unusable:
            for _, force, command in holds:
                if not math.isfinite(force):
                    self.stop_reason = f"command {command} was {force}, which no device can apply, at tick {tick}"
                    return False
        self._x = x = self._motion.advance(tick, holds)
        self._interval_due, limit_m = False, self._limit_m
        if not -limit_m <= x <= limit_m:
            self.stop_reason = f"{beyond(x, limit_m)}, at tick {tick + 1}"
            return False
        return True

    def state(self) -> dict[str, float]:
        """Returns where the plant is now: tick reached, x, v, force and command last in effect."""
        motion = self._motion
        _, force, command = motion.last
        return {"tick": self.reached, "x": motion.x, "v": motion.v, "force": force, "command": command}

    def checkpoint(self) -> Checkpoint:
        """Returns everything from which the plant continues, once its block has been taken."""
        return Checkpoint(
            self.tick,
            self._interval_due,
            self._unusable,
            self.stop_reason,
            self._delays,
            self._delay_now,
            self._motion.state,
            self._motion.last,
            self._line.state,
            self._position.state,
            self._sensor.state if self._sensor else None,
        )

    def restore(self, checkpoint: Sequence[Any]) -> None:
        """Continues from a checkpoint of a plant of the same scene, as taken or as unpacked; this plant must be new."""
        of = Checkpoint(*checkpoint)
        if of.delay_steps is not None:
            self._retime(of.delay_steps)
        self.tick, self._interval_due = of.tick, of.interval_due
        self._unusable, self.stop_reason = of.unusable, of.stop_reason
        self._delays = [(tick, delay_steps) for tick, delay_steps in of.delays]
        self._motion.restore(of.motion, of.last)
        self._line.restore(of.line)
        self._position.restore(of.position)
        if self._sensor:
            self._sensor.restore(of.accelerometer)
        self._x, self._block_first = self._motion.x, self.reached

    def take_block(self) -> tuple[int, int, dict[str, bytes]]:
        """Returns (first tick, ticks, columns) of what was stepped since the last block; clears it.

        Columns are little-endian float64 with ``ticks * n + 1`` rows: every step of the block and its end state, whose
        force and command are the last held ones. The counters of effects follow: the number of events before a step.
        """
        first, reached = self._block_first, self.reached
        record = self._motion.take_record(first)
        steps = first * self._steps, reached * self._steps
        record |= {name: counter.column(*steps) for name, counter in self._counters.items()}
        self._block_first = reached
        return first, reached - first, {name: column.tobytes() for name, column in record.items()}


def beyond(x: float, limit_m: float) -> str:
    """Returns the reason why a run ends with the device at x, which is not within ``limit_m`` of 0."""
    if math.isfinite(x):
        return f"the device was at {x:g} m, beyond the limit of {limit_m:g} m"
    return f"the arithmetic failed, not the device: its position came out as {x}"
