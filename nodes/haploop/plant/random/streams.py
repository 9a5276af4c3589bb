"""Random numbers of a run: one stream for each thing that is random, a function of the seed and its name alone."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain, count
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.random import Generator, Philox

if TYPE_CHECKING:
    from haploop.plant.random.streams_batch import RandomStreamArray

# The next number of a stream, of one run; of many runs at once it would be an array with a number for each.
Draw = Callable[[], Any]

# Draws are made in pieces on a fixed grid, so that how a run is cut into messages cannot change a bit of them.
PIECE = 4096


def stream_of(seed: Any, name: str) -> RandomStream | RandomStreamArray:
    """The stream of a name, of one seed or of an array of them."""
    if not getattr(seed, "shape", ()):
        return RandomStream(seed, name)
    from haploop.plant.random.streams_batch import RandomStreamArray

    return RandomStreamArray(seed, name)


@dataclass(frozen=True)
class RandomStream:
    """A named stream of a seed: draw i depends on (seed, name, i) only, so that no effect disturbs another's numbers.

    Counter-based: Philox 4x64 (Salmon et al. 2011) under a key made of seed and name by SHA-256; each piece of draws
    starts at a counter of its own. A stream is meant for draws of one kind, and each method starts it anew.
    """

    seed: int
    name: str

    def normal(self) -> Draw:
        """Standard normal numbers."""
        return self._draws(lambda generator: generator.standard_normal(PIECE))

    def uniform(self) -> Draw:
        """Numbers in [0, 1)."""
        return self._draws(lambda generator: generator.random(PIECE))

    def whole(self, below: int) -> Draw:
        """Whole numbers 0 ... ``below`` - 1, equally likely."""
        return self._draws(lambda generator: generator.integers(below, size=PIECE))

    def gamma(self, shape: float) -> Draw:
        """Gamma-distributed numbers of unit scale: mean and variance are ``shape``."""
        return self._draws(lambda generator: generator.standard_gamma(shape, PIECE))

    def _draws(self, make: Callable[[Generator], np.ndarray]) -> Draw:
        pieces = (make(self.generator(piece)).tolist() for piece in count())
        draws: Iterator[Any] = chain.from_iterable(pieces)
        return draws.__next__

    def generator(self, piece: int) -> Generator:
        """What makes the draws of a piece, from its first one on."""
        digest = hashlib.sha256(f"{self.seed}/{self.name}".encode()).digest()
        return Generator(Philox(key=int.from_bytes(digest[:16], "little"), counter=piece << 128))
