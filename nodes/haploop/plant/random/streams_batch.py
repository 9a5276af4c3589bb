"""Random numbers of many runs at once: to each run those it would draw alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from haploop.plant.random.streams import PIECE, RandomStream

# Rows drawn at a time; divides a piece. A generator goes on where it stopped.
_ROWS = 128


class RandomStreamArray:
    """A stream of one name for every seed of an array.

    Args:
        seeds: shape (loops,), whole numbers.
        name: what is random.
    """

    def __init__(self, seeds: np.ndarray, name: str) -> None:
        self._seeds, self._name = seeds, name

    def normal(self) -> Draws:
        """Standard normal numbers, shape (loops,) a draw."""
        return Draws(self._seeds, self._name, lambda generator: generator.standard_normal(_ROWS))


class Draws:
    """Row after row of draws, a number for every loop in each."""

    def __init__(self, seeds: np.ndarray, name: str, make: Callable[[Generator], np.ndarray]) -> None:
        self._seeds, self._name, self._make = seeds, name, make
        self._generators = np.empty(len(seeds), object)
        self._rows = np.empty((0, len(seeds)))
        self._drawn = self._at = 0

    def __call__(self) -> np.ndarray:
        if self._at == len(self._rows):
            self._draw()
        row = self._rows[self._at]
        self._at += 1
        return row

    def _draw(self) -> None:
        piece, within = divmod(self._drawn, PIECE)
        if not within:
            streams = [RandomStream(int(seed), self._name) for seed in self._seeds]
            self._generators[:] = [stream.generator(piece) for stream in streams]
        self._rows = np.stack([self._make(generator) for generator in self._generators], axis=-1)
        self._drawn, self._at = self._drawn + _ROWS, 0
