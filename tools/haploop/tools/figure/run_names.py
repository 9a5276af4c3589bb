"""Names of runs shown side by side: those of their directories, as much of them as tells the runs apart."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path

# A longer name is cut at its beginning, where others begin the same, and then in its middle.
_LONG, _CUT = 36, "…"
_SEPARATORS = "_-/ ."


def run_names(directories: Sequence[Path]) -> list[str]:
    """Returns a name for each directory, no two the same: its own, with as many directories above it as necessary.

    A directory that is given again has a number after its name.
    """
    whole = [Path(os.path.abspath(directory)) for directory in directories]  # noqa: PTH100, a link has its own name
    unlike = [*dict.fromkeys(whole)]
    depth = 1
    while len({path.parts[-depth:] for path in unlike}) < len(unlike):
        depth += 1
    tails = ["/".join(path.parts[-depth:]).replace("//", "/") for path in unlike]
    name_of, seen, names = dict(zip(unlike, tails, strict=True)), Counter[Path](), list[str]()
    for path in whole:
        seen[path] += 1
        names.append(name_of[path] + (f" ({seen[path]})" if seen[path] > 1 else ""))
    return names


def shortened(names: Sequence[str]) -> list[str]:
    """Returns names with the long ones cut: without the words that all of these begin with, and then in their middle.

    Returns all of them whole if two would become the same.
    """
    long = [name for name in names if len(name) > _LONG]
    alike = takewhile(lambda letters: len({*letters}) == 1, zip(*long, strict=False)) if len(long) > 1 else ()
    common = "".join(letters[0] for letters in alike)
    cut, half = max(common.rfind(separator) for separator in _SEPARATORS) + 1, _LONG // 2
    short = [f"{_CUT}{name[cut:]}" if cut and name in long else name for name in names]
    short = [name if len(name) <= _LONG else f"{name[: half - 1]}{_CUT}{name[-half:]}" for name in short]
    return short if len({*short}) == len(short) else [*names]
