"""The plant's core: a device in a hand, stepped by its exact flow, sampled at ticks, driven by delayed commands."""

from __future__ import annotations

import math
from array import array
from typing import Any

import numpy as np

from haploop.plant.command_line import CommandLine, Hold
from haploop.plant.flow import StepFlow
from haploop.plant.hand_force import HandForce
from haploop.plant.mechanics import Mechanics
from haploop.plant.sensors import accelerometer_is_used, encoder
from haploop.protocol.ticks import Timebase

# The drive of the hand is prepared for this many intervals at a time.
_DRIVE_TICKS = 256


class Plant:
    """State, sampling and stepping of one plant; knows nothing of sockets.

    Call ``samples`` and ``receive`` in turn: samples of at most L + 1 ticks, then the commands that answer them.
    The state is carried as a float and the rounding it left over (compensated addition), so that neither slow motion
    nor a long run loses what a single step adds.

    Attributes:
        tick: the next tick to be sampled.
        stop_reason: why the plant ended by itself (diverged), or None.
    """

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        mechanics = Mechanics.of(scene)
        flow = self._flow = StepFlow.of(mechanics.mass_kg, mechanics.damping, mechanics.stiffness, time.step_s)
        self._coefficients = flow.x_x, flow.x_v, flow.x_force, flow.v_x, flow.v_v, flow.v_force
        self._mechanics = mechanics
        self._steps = time.steps_per_tick
        self._tau = HandForce(scene.get("hand", {}).get("force"), time.plant_rate)
        self._spring_at_origin_N = mechanics.stiffness * mechanics.rest_m
        self._line = CommandLine(time)
        self._limit_m = scene["diverged_beyond"]
        measure = encoder(scene.get("encoder"))
        if accelerometer_is_used(scene):
            self._measure = lambda: (measure(self.x), self._acceleration())
        else:
            self._measure = lambda: (measure(self.x),)
        self.x, self.v = mechanics.start
        self._x_low = self._v_low = 0.0
        self._interval_due = self._unusable = False
        self._drive: list[tuple[float, float]] = []
        self._drive_first = self._drive_end = 0
        self.tick = 0
        self.stop_reason: str | None = None
        self._holds: list[Hold] = [(0, 0.0, -1)]
        self._begin_block()

    def samples(self, count: int) -> list[tuple[float, ...]]:
        """The next ``count`` samples, (x_m,) or (x_m, acceleration) each; fewer when the plant diverged.

        Commands up to ``tick + count - 2 - L`` must have been received.
        """
        samples = []
        for _ in range(count):
            if self._interval_due and not self._advance():
                break
            samples.append(self._measure())
            self.tick += 1
            self._interval_due = True
        return samples

    def receive(self, forces: list[float]) -> None:
        """Take the next commands, in order of their ticks."""
        self._line.receive(forces)
        total = sum(forces)
        if total - total != 0.0:  # infinite or not a number
            self._unusable = True

    def finish(self) -> None:
        """Step through the interval after the last sample, so that the run ends at the tick after it."""
        if self._interval_due:
            self._advance()

    @property
    def reached(self) -> int:
        """The tick whose state is the present one: every interval before it has been stepped."""
        return self.tick - self._interval_due

    def _advance(self) -> bool:
        """Step through interval ``tick - 1``; False when the run has to end where the plant now is."""
        tick = self.tick - 1
        if tick >= self._drive_end:
            self._prepare_drive(tick)
        holds = self._line.holds(tick)
        if self._unusable and self._refuse(tick, holds):
            return False
        drive = (tick - self._drive_first) * self._steps
        for hold in holds:
            drive = self._hold(hold[0], hold[1], drive)
        self._holds += holds
        self._interval_due = False
        if not -self._limit_m <= self.x <= self._limit_m:
            self._stop(tick + 1, f"the device was at {self.x:g} m, beyond the limit of {self._limit_m:g} m")
            return False
        return True

    def _hold(self, count: int, force: float, drive: int) -> int:
        """``count`` plant steps under one held force: x+ = x + dx, v+ = v + dv by the exact flow."""
        x_x, x_v, x_force, v_x, v_v, v_force = self._coefficients
        held_x, held_v = x_force * force, v_force * force
        x, v, x_low, v_low = self.x, self.v, self._x_low, self._v_low
        log_x, log_v, log_low = self._xs.append, self._vs.append, self._lows.append
        for drive_x, drive_v in self._drive[drive : drive + count]:
            dx = x_x * x + x_v * v + (held_x + drive_x) + x_low
            dv = v_x * x + v_v * v + (held_v + drive_v) + v_low
            next_x = x + dx
            next_v = v + dv
            x_low = dx - (next_x - x)
            v_low = dv - (next_v - v)
            x = next_x
            v = next_v
            log_x(x)
            log_v(v)
            log_low(x_low)
        self.x, self.v, self._x_low, self._v_low = x, v, x_low, v_low
        return drive + count

    def _refuse(self, tick: int, holds: list[Hold]) -> bool:
        """End the run before interval ``tick`` if a force in it is no finite number."""
        for _, force, command in holds:
            if not math.isfinite(force):
                self._stop(tick, f"command {command} was {force}, which no device can apply")
                return True
        return False

    def _prepare_drive(self, tick: int) -> None:
        """What hand force and spring rest add to dx and dv at each step of the next intervals."""
        first = tick * self._steps
        tau = self._tau.at_steps(first, first + _DRIVE_TICKS * self._steps + 1)
        start, rise = tau[:-1] + self._spring_at_origin_N, tau[1:] - tau[:-1]
        flow = self._flow
        drive_x, drive_v = flow.x_force * start + flow.x_slope * rise, flow.v_force * start + flow.v_slope * rise
        if (start == start[0]).all() and not rise.any():  # one pair for all steps, kinder to the cache
            self._drive = [(float(drive_x[0]), float(drive_v[0]))] * len(start)
        else:
            self._drive = list(zip(drive_x.tolist(), drive_v.tolist(), strict=True))
        self._drive_first, self._drive_end = tick, tick + _DRIVE_TICKS

    def _acceleration(self) -> float:
        """Acceleration now, under the force held over the step that ends here (0 at the start), m/s^2."""
        step = self.tick * self._steps
        tau = float(self._tau.at_steps(step, step + 1)[0])
        m = self._mechanics
        return (self._holds[-1][1] + tau - m.damping * self.v - m.stiffness * (self.x - m.rest_m)) / m.mass_kg

    def _stop(self, tick: int, what: str) -> None:
        self.stop_reason = f"{what}, at tick {tick}"

    def state(self) -> dict[str, float]:
        """Where the plant is now: tick reached, x, v, force and command last in effect."""
        _, force, command = self._holds[-1]
        return {"tick": self.reached, "x": self.x, "v": self.v, "force": force, "command": command}

    def take_block(self) -> tuple[int, int, dict[str, bytes]]:
        """(first tick, ticks, columns) of what was stepped since the last block; empties it.

        Columns x, v, x_low (what rounding to a float left of x), force and command are little-endian float64 with
        ``ticks * n + 1`` rows: every step of the block and its end state, whose force and command are the last
        held ones.
        """
        first, reached = self._block_first, self.reached
        counts, forces, commands = zip(*self._holds[1:], (1, *self._holds[-1][1:]), strict=True)
        columns = {
            "x": array("d", self._xs).tobytes(),
            "v": array("d", self._vs).tobytes(),
            "x_low": array("d", self._lows).tobytes(),
            "force": np.repeat(np.array(forces, float), counts).tobytes(),
            "command": np.repeat(np.array(commands, float), counts).tobytes(),
        }
        self._begin_block()
        return first, reached - first, columns

    def _begin_block(self) -> None:
        """Start a block with the present state; the last hold stays, for whoever asks for the force."""
        self._block_first = self.reached
        self._xs, self._vs, self._lows = [self.x], [self.v], [self._x_low]
        self._holds = self._holds[-1:]
