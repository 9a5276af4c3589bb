"""Compiled blocks, kept for all groups of members of one structure, and how jax is asked for them."""

from __future__ import annotations

import os
from collections import Counter, OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import lru_cache, partial
from importlib import import_module
from time import perf_counter
from typing import Any

import jax
import numpy as np

from haploop.launch.batch.jax.block import BlockInputs, Carry, Rings

# How many programs are kept.
_MOST = 64
# On a CPU a loop over ticks is one function of machine code if XLA takes its arrays for small; otherwise every
# operation is a separate call, which takes longer than its work. This can only be set before jax first runs.
_ONE_FUNCTION = "xla_cpu_small_while_loop_byte_threshold"
# Arrays of members fill the widest registers there are.
_WIDE: dict[str, Any] = {"xla_cpu_prefer_vector_width": 512}
_FLAGS, _OPTIONS = "XLA_FLAGS", "--xla_backend_extra_options="
# On a GPU jax takes three quarters of the memory for itself unless told otherwise; the next worker then finds none.
_TAKES_ALL = "XLA_PYTHON_CLIENT_PREALLOCATE"


Call = Callable[[Carry, Rings, BlockInputs], tuple[Carry, Rings]]


class Programs:
    """Programs by what they depend on; the least recently used one is dropped first.

    Attributes:
        asked: how many ticks of members of a structure were asked for so far.
        spare: rings that a batch is done with. Their memory serves the next batch: allocating it again, and putting
            zeros into it, takes a third as long as a batch without books.
    """

    def __init__(self) -> None:
        self._kept: OrderedDict[Hashable, Call] = OrderedDict()
        self.seconds, self.count = 0.0, 0
        self.asked = Counter[Hashable]()
        self.spare: Rings | None = None

    def call(self, key: Hashable, run: Call, args: tuple[Carry, Rings, BlockInputs]) -> Call:
        """Returns the machine code of a block, compiled for arguments of these shapes if the key is not known."""
        if key in self._kept:
            self._kept.move_to_end(key)
        else:
            self._kept[key] = self.compiled(run, args)
            if len(self._kept) > _MOST:
                self._kept.popitem(last=False)
        return self._kept[key]

    def compiled(self, run: Call, args: tuple[Carry, Rings, BlockInputs]) -> Call:
        """Compiles a block for arguments of these shapes."""
        began = perf_counter()
        lowered = jax.jit(run, donate_argnums=1).lower(*args)
        compiled = lowered.compile(_WIDE if jax.default_backend() == "cpu" else None)
        self.seconds, self.count = self.seconds + perf_counter() - began, self.count + 1
        return compiled

    def begun(self, rings: Rings, ticks: int) -> Rings:
        """Returns these NumPy rings, in spare memory if it fits; the first ``ticks`` rows and the last are in use."""
        spare, self.spare = self.spare, None
        fits = spare is not None and jax.tree.map(np.shape, spare) == jax.tree.map(np.shape, rings)
        if not fits or ticks >= len(rings.x):
            return rings
        used = np.r_[:ticks, -1]
        return _put(spare, used, jax.tree.map(lambda ring: ring[used], rings))


@partial(jax.jit, donate_argnums=0)
def _put(rings: Rings, places: Any, rows: Rings) -> Rings:
    return jax.tree.map(lambda ring, row: ring.at[places].set(row), rings, rows)


PROGRAMS = Programs()


def in_double() -> AbstractContextManager[object]:
    """Returns a context in which jax computes in float64; outside it jax is as it was."""
    enable_x64: Any = getattr(jax, "enable_x64", None)
    if enable_x64 is None:  # jax before 0.8
        enable_x64 = import_module("jax.experimental").enable_x64
    return enable_x64(True)


@lru_cache(maxsize=1)
def most() -> int:
    """Returns how many members suit the device: on a CPU so many that what a tick works on stays in the cache.

    If nothing has used jax before, it is told here how to start; the user's own settings for it are kept.
    """
    told = {_TAKES_ALL: os.environ.get(_TAKES_ALL, "false")}
    if _OPTIONS not in (flags := os.environ.get(_FLAGS, "")):
        told[_FLAGS] = f"{flags} {_OPTIONS}{_ONE_FUNCTION}=1000000000"
    with _environment(told):
        on_cpu = jax.default_backend() == "cpu"
    return 512 if on_cpu else 16384


@contextmanager
def _environment(variables: dict[str, str]) -> Iterator[None]:
    before = {name: os.environ.pop(name, None) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            del os.environ[name]
            if value is not None:
                os.environ[name] = value
