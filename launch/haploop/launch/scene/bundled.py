"""The scenes, devices, hands and sweeps that come with haploop, found by name from any directory."""

from __future__ import annotations

import os
import re
from pathlib import Path

import haploop.launch
from haploop.protocol.names import nearest

FOLDERS = ("scenes", "devices", "hands", "sweeps")


def bundled_folder(folder: str) -> Path:
    """Returns the path of one of ``FOLDERS``: in a wheel inside haploop.launch, in a checkout beside it."""
    package = Path(haploop.launch.__path__[0])
    inside = package / folder
    return inside if inside.is_dir() else package.parents[1] / folder


def bundled(folder: str) -> dict[str, Path]:
    """Returns the files of one of ``FOLDERS`` by name: ``fig6a``, ``accuracy/stick_slip``."""
    root = bundled_folder(folder)
    return {path.relative_to(root).with_suffix("").as_posix(): path for path in sorted(root.rglob("*.toml"))}


def of_name(name: str, folder: str) -> Path | None:
    """Returns the bundled file of a name, which may include its suffix and its folder, also as in a checkout.

    ``premium15``, ``devices/premium15.toml`` and ``launch/devices/premium15.toml`` are the same.
    """
    first, _, rest = name.removeprefix("launch/").removesuffix(".toml").partition("/")
    return bundled(first).get(rest) if rest and first in FOLDERS else bundled(folder).get(name.removesuffix(".toml"))


def found(path: Path, folder: str, beside: Path = Path()) -> Path:
    """Returns the user's own file if there is one, relative to ``beside``, else the bundled file of this name.

    Either may be named without its suffix.
    """
    own = beside / path
    for file in (own, own.with_name(f"{own.name}.toml")) if own.name else (own,):  # "." and "/" have none
        if os.path.exists(file) and not os.path.isdir(file):  # noqa: PTH110, PTH112 (false, not an error, for any name)
            return file
    return of_name(path.as_posix(), folder) or own


def like(name: str, folder: str, beside: Path = Path()) -> str | None:
    """Returns what an unknown name may have been meant for: a bundled file, or a file of the user's in ``beside``.

    The nearest counts, else the first that begins with the name.
    """
    own = {path.stem: path.name for path in sorted(beside.glob("*.toml"))}
    names = {one: one for one in bundled(folder)} | own
    meant = nearest(name, names) or next((one for one in names if name and one.startswith(name)), None)
    return names[meant] if meant else None


def own_file(name: str, folder: str) -> Path | None:
    """Returns the user's own file that is taken here in place of a bundled one; None if there is none."""
    bundled_one = of_name(name, folder)
    for path in (Path(name), Path(folder, name)):
        file = found(path, folder)
        if bundled_one is None or not (os.path.exists(file) and os.path.samefile(file, bundled_one)):  # noqa: PTH110, PTH121
            return file
    return None


def taken_instead(name: str, folder: str) -> Path | None:
    """Returns the user's own file that a bare name stands for, although one of that name comes with haploop."""
    bundled_one, file = of_name(name, folder), found(Path(name), folder)
    if bundled_one is None or name.endswith(".toml") or os.path.samefile(file, bundled_one):  # noqa: PTH121
        return None
    return file


def about(path: Path) -> str:
    """Returns what a bundled file is, in a line: its title, else the comment that it begins with."""
    text = path.read_text(encoding="utf-8")
    title = re.search(r'^title = "(.*)"$', text, re.MULTILINE)
    return title[1] if title else text.partition("\n")[0].lstrip("# ")
