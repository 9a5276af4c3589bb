"""Damage as disks, transfers and people cause it: seeded, to the bytes of a file or to the file as a whole."""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from pathlib import Path


def _slice(rng: random.Random, data: bytes, most: int = 4096) -> tuple[int, int]:
    start = rng.randrange(len(data) + 1)
    return start, min(len(data), start + rng.randint(1, most))


def flip_bit(rng: random.Random, data: bytes) -> bytes:
    return flip_bits(rng, data, 1)


def flip_bits(rng: random.Random, data: bytes, count: int = 0) -> bytes:
    found = bytearray(data)
    for _ in range(count or rng.randint(2, 20)):
        found[rng.randrange(len(found))] ^= 1 << rng.randrange(8)
    return bytes(found)


def replace_byte(rng: random.Random, data: bytes) -> bytes:
    """One byte becomes another that may occur in text."""
    at = rng.randrange(len(data))
    return data[:at] + rng.choice("0123456789.-+eE\"'[]{}=,:# \nnaN").encode() + data[at + 1 :]


def truncate(rng: random.Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data))]


def duplicate(rng: random.Random, data: bytes) -> bytes:
    start, end = _slice(rng, data)
    return data[:end] + data[start:]


def leave_out(rng: random.Random, data: bytes) -> bytes:
    start, end = _slice(rng, data)
    return data[:start] + data[end:]


def swap(rng: random.Random, data: bytes) -> bytes:
    """Two pieces are exchanged."""
    a, b, c, d = sorted((*_slice(rng, data), *_slice(rng, data)))
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def zero(rng: random.Random, data: bytes) -> bytes:
    start, end = _slice(rng, data)
    return data[:start] + bytes(end - start) + data[end:]


def append(rng: random.Random, data: bytes) -> bytes:
    return data + rng.randbytes(rng.randint(1, 4096))


def empty(_rng: random.Random, _data: bytes) -> bytes:
    return b""


def random_bytes(rng: random.Random, data: bytes) -> bytes:
    return rng.randbytes(rng.choice([1, 8, 100, len(data)]))


TO_BYTES: tuple[Callable[[random.Random, bytes], bytes], ...] = (
    flip_bit, flip_bits, replace_byte, truncate, duplicate, leave_out, swap, zero, append, empty, random_bytes,
)  # fmt: skip


def remove(path: Path) -> None:
    path.unlink()


def directory(path: Path) -> None:
    path.unlink()
    path.mkdir()


def pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def circle(path: Path) -> None:
    path.unlink()
    path.symlink_to(path.name)


def dangling(path: Path) -> None:
    path.unlink()
    path.symlink_to("nowhere")


def device(path: Path) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


TO_FILES: tuple[Callable[[Path], None], ...] = (remove, directory, pipe, circle, dangling, device)


def damage(rng: random.Random, path: Path) -> str:
    """Damages a file; returns how, in a word."""
    if rng.random() < 0.1:
        to_file = rng.choice(TO_FILES)
        to_file(path)
        return to_file.__name__
    to_bytes = rng.choice(TO_BYTES)
    path.write_bytes(to_bytes(rng, path.read_bytes()))
    return to_bytes.__name__
