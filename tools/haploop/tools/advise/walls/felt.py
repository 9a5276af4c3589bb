"""The test for a buzz: a stretch of a run goes to and fro, and a hand feels that as motion or as force."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from haploop.launch.stability.traces import smallest_felt_m
from haploop.logger.verdict.ripple import RIPPLE_ABOVE_HZ
from haploop.plant.chain.chain import Chain
from haploop.protocol.scene.scene import Scene

# This many turns within a stretch are a buzz; a device that only follows a swaying hand turns once.
TURNS = 4
# A line holds at least this share of the power; one between two frequencies of the spectrum has four fifths of its own.
_LINE = 0.5
# Turns of less than this are rounding: an atom is as wide.
_LEAST_M = 1e-10

# Powers of time that a hand's sway of half a period a stretch has; a device off its wall by more than this, m, bounces.
_SWAY_POWERS, _OFF_M = 6, 5e-4

# From frequencies in Hz to what a hand feels at them.
Threshold = Callable[[np.ndarray], np.ndarray]


class Buzz(NamedTuple):
    """How a member went to and fro in a stretch, all arrays of shape (members,).

    Attributes:
        turns: times that the measured position (the true one without an encoder) changed its direction.
        motion_m, force_N: swing of position and of command, peak to peak, see ``ripple``; 0 if it does not go to and
            fro.
        frequency_Hz: frequency of whichever is felt more.
        times_felt: the larger of both as a multiple of what is felt; 0 if it does not go to and fro.
        by_force: whether that is the force.
        other_felt: the smaller of both as such a multiple.
        is_line: whether half of what is felt more lies at that frequency; otherwise it has no one frequency.
    """

    turns: np.ndarray
    motion_m: np.ndarray
    force_N: np.ndarray
    frequency_Hz: np.ndarray
    times_felt: np.ndarray
    by_force: np.ndarray
    other_felt: np.ndarray
    is_line: np.ndarray


def felt_m(frequency_Hz: np.ndarray) -> np.ndarray:
    """Returns the narrowest swing that is felt, peak to peak, m (Israr, Choi and Tan 2006)."""
    return 2.0 * smallest_felt_m(frequency_Hz)


def felt_force_N(scene: Scene) -> Threshold:
    """Makes the threshold of the force: the command that would move device and hand, without friction, just far enough
    to be felt. |F| = felt / |x / F|, with x / F of the scene's own chain of bodies at the encoder.

    No threshold of force is published for a stylus; this is that of the motion, taken through the device.
    """
    chain = Chain.from_scene(scene)
    size = len(chain.states)
    rates = chain.rates().astype(float)
    a, b = rates[:, :size], rates[:, size]

    def threshold(frequency_Hz: np.ndarray) -> np.ndarray:
        w = 2j * np.pi * np.maximum(frequency_Hz, 1.0)
        x = np.linalg.solve(w[:, None, None] * np.eye(size) - a, np.broadcast_to(b[:, None], (len(w), size, 1)))
        return felt_m(frequency_Hz) / np.abs(x[:, 0, 0])

    return threshold


def buzz(x: np.ndarray, measured: np.ndarray, command: np.ndarray, rate: float, felt_N: Threshold) -> Buzz:
    """Measures a stretch of ticks; arrays of shape (ticks, members).

    A hand that presses harder moves on, and a coarse encoder makes a staircase of its wall's force; neither goes to and
    fro. So the measured position has to turn ``TURNS`` times before anything counts.
    """
    turns = _turns(measured)
    (motion, f_motion, line), (force, f_force, line_of_force) = (np.zeros((3, len(turns))) for _ in range(2))
    swings = np.flatnonzero(turns >= TURNS)
    motion[swings], f_motion[swings], line[swings] = ripple(x[:, swings], rate)
    force[swings], f_force[swings], line_of_force[swings] = ripple(command[:, swings], rate)
    by_motion, by_force = motion / felt_m(f_motion), force / felt_N(f_force)
    is_force = by_force > by_motion
    frequency, share = np.where(is_force, f_force, f_motion), np.where(is_force, line_of_force, line)
    felt, other = np.maximum(by_motion, by_force), np.minimum(by_motion, by_force)
    return Buzz(turns, motion, force, frequency, felt, is_force, other, share >= _LINE)


def _turns(u: np.ndarray) -> np.ndarray:
    """Counts the changes of direction of each column; steps smaller than rounding do not count."""
    move = np.diff(u, axis=0)
    direction = np.where(np.abs(move) > _LEAST_M, np.sign(move), 0.0)
    rows = np.arange(len(direction))[:, None]
    last = np.maximum.accumulate(np.where(direction != 0.0, rows, -1), axis=0)
    held = np.where(last >= 0, np.take_along_axis(direction, np.maximum(last, 0), axis=0), 0.0)
    return (held[1:] * held[:-1] < 0.0).sum(axis=0)


def slow_swing_m(x: np.ndarray) -> np.ndarray:
    """Returns how wide each column still swings, or bounces off its wall at 0, peak to peak, m; 0 where it does not.

    It swings where it turns ``TURNS`` times, about the polynomial that a swaying hand follows, and bounces where it is
    off the wall by half a millimetre at times.
    """
    x = np.where(np.isfinite(x).all(axis=0), x, 0.0)
    powers = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, len(x)), _SWAY_POWERS))[0]
    swings = np.where(_turns(x) >= TURNS, np.ptp(x - powers @ (powers.T @ x), axis=0), 0.0)
    return np.where(x.max(axis=0) > _OFF_M, np.ptp(x, axis=0), swings)


def ripple(u: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the swing of each column, peak to peak, faster than ``TURNS`` turns a stretch, and its frequency in Hz.

    The third is the share of its power at that frequency and those beside it, which is small for spikes and noise.

    The column's parabola is removed first: a hand that sways would leave steps at the ends.
    """
    u = np.where(np.isfinite(u).all(axis=0), u, 0.0)
    parabolas = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, len(u)), 3))[0]
    u = u - parabolas @ (parabolas.T @ u)
    spectrum, frequencies = np.fft.rfft(u, axis=0), np.fft.rfftfreq(len(u), 1.0 / rate)
    spectrum[frequencies < min(RIPPLE_ABOVE_HZ, TURNS / 2.0 * rate / len(u))] = 0.0
    power = np.abs(spectrum) ** 2
    peak, whole = power.argmax(axis=0), power.sum(axis=0)
    near = np.abs(np.arange(len(power))[:, None] - peak) <= 1
    share = np.divide(np.where(near, power, 0.0).sum(axis=0), whole, out=np.zeros_like(whole), where=whole > 0.0)
    return np.ptp(np.fft.irfft(spectrum, len(u), axis=0), axis=0), frequencies[peak], share
