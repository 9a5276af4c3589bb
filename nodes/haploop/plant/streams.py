"""Random numbers of a run: one stream for each random quantity, a function of the seed and its name alone."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain, count, islice
from typing import Any

import numpy as np
from numpy.random import Generator, Philox

# Returns the next number of a stream; in a batch, an array with a number for each member.
Draw = Callable[[], Any]

# Draws are made in pieces on a fixed grid, so that the way a run is cut into messages cannot change a bit of them.
PIECE = 4096
# Rows drawn at a time in a batch; a piece is a multiple of it. A generator continues where it stopped.
_ROWS = 128


def make_normal(seed: Any, name: str, first: int = 0) -> Draw:
    """Returns the standard normal numbers of a named stream from draw ``first`` on; in rows if ``seed`` is an array."""
    if getattr(seed, "shape", ()):
        return NormalRows(np.asarray(seed), name, first)
    return RandomStream(int(seed), name).normal(first)


@dataclass(frozen=True)
class RandomStream:
    """A named stream of a seed: draw i depends on (seed, name, i) only, so that no effect disturbs another's numbers.

    Counter-based: Philox 4x64 (Salmon et al. 2011) under a key made of seed and name by SHA-256; each piece of draws
    starts at its own counter. A stream is meant for draws of one kind; each method starts it at draw ``first``.
    """

    seed: int
    name: str

    def normal(self, first: int = 0) -> Draw:
        return self._draws(lambda generator: generator.standard_normal(PIECE), first)

    def uniform(self, first: int = 0) -> Draw:
        """Returns numbers in [0, 1)."""
        return self._draws(lambda generator: generator.random(PIECE), first)

    def whole(self, below: int, first: int = 0) -> Draw:
        """Returns whole numbers 0 ... ``below`` - 1, equally likely."""
        return self._draws(lambda generator: generator.integers(below, size=PIECE), first)

    def gamma(self, shape: float, first: int = 0) -> Draw:
        """Returns gamma-distributed numbers of unit scale: mean and variance are ``shape``."""
        return self._draws(lambda generator: generator.standard_gamma(shape, PIECE), first)

    def _draws(self, make: Callable[[Generator], np.ndarray], first: int) -> Draw:
        piece, within = divmod(first, PIECE)
        pieces = (make(self.generator(index)).tolist() for index in count(piece))
        draws: Iterator[Any] = islice(chain.from_iterable(pieces), within, None)
        return draws.__next__

    def generator(self, piece: int) -> Generator:
        """Returns the generator of the draws of a piece, at its first draw."""
        digest = hashlib.sha256(f"{self.seed}/{self.name}".encode()).digest()
        return Generator(Philox(key=int.from_bytes(digest[:16], "little"), counter=piece << 128))


class NormalRows:
    """Standard normal numbers of a named stream for every seed of a batch: a row of shape (members,) per draw.

    Every member draws the numbers that it would draw alone.
    """

    def __init__(self, seeds: np.ndarray, name: str, first: int = 0) -> None:
        self._seeds, self._name = seeds, name
        self._drawn = first // PIECE * PIECE
        self._generators: list[Generator] = []
        self._rows, self._at = np.empty((0, len(seeds))), 0
        for _ in range(first - self._drawn):
            self()

    def select(self, kept: np.ndarray) -> None:
        """Drops the members that are not kept; ``kept`` is their mask, shape (members,)."""
        self._seeds, self._rows = self._seeds[kept], self._rows[:, kept]
        self._generators = [one for one, stays in zip(self._generators, kept, strict=False) if stays]

    def __call__(self) -> np.ndarray:
        if self._at == len(self._rows):
            self._draw()
        row = self._rows[self._at]
        self._at += 1
        return row

    def _draw(self) -> None:
        piece, within = divmod(self._drawn, PIECE)
        if not within:
            self._generators = [RandomStream(int(seed), self._name).generator(piece) for seed in self._seeds]
        self._rows = np.stack([one.standard_normal(_ROWS) for one in self._generators], axis=-1)
        self._drawn, self._at = self._drawn + _ROWS, 0


def select_draws(draw: Draw | None, kept: np.ndarray) -> None:
    """Drops members from a stream with numbers for each member; one that all share stays unchanged."""
    if isinstance(draw, NormalRows):
        draw.select(kept)
