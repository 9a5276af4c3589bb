"""The text of a first scene: a device, a hand and a wall, with comments that say what else there is."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import Any

from haploop.launch.scene.bundled import bundled
from haploop.launch.scene.reading.layers import Layers, read_layers
from haploop.launch.scene.toml_writer import inline
from haploop.launch.scene.units import from_text
from haploop.protocol.names import nearest
from haploop.protocol.scene.table import Tables

# The wall of a first scene is no farther than this.
_FAR_MM = 5.0
_TEXT = """\
# A scene for haploop. Keys that are not set here come from the files it extends; what those do not set either is left
# out of the simulation. `haploop check THIS --json` prints the resolved scene; `haploop check --schema` all keys.
title = {title}
extends = [{device}, {hand}]  # `haploop scenes` lists them; name your own files by their path
duration = 3.0  # s

[clock]
control_rate = 1000  # Hz, of the controller; the plant runs at 10 kHz
round_trip_delay = "0 ms"  # from a sample to the force that answers it; a multiple of 0.1 ms

[hand.force]  # what the muscles do: press with 1 N, reached after 0.3 s
kind = "ramp"
value = "-1 N"
rise_time = "0.3 s"

[wall]
position = "{place}"  # below this the wall pushes back
stiffness = {wall}

# An element that takes energy out while the device is in the wall; `haploop plugins` lists all elements.
# [[dissipation]]
# kind = "damping"
# damping = "1 N s/m"

# A swap in mid-run; `haploop swap` does the same to a running loop.
# [[event]]
# at = "2 s"
# swap = {{ kind = "unidirectional-inertia", mass = "2 g" }}
"""


class FirstSceneError(ValueError):
    """A wall that is not a stiffness, or a device or hand that is not a file and does not come with haploop."""


def first_scene(device: str, hand: str, wall: str | None, folder: Path) -> str:
    """Returns a scene in which a hand moves a device into a wall and holds it there.

    What the files of device and hand say about the rest is written as comments, so that the scene does not repeat it.

    Args:
        device, hand: names that ``haploop scenes`` lists, or paths of the user's own files.
        wall: stiffness with its unit; None for that of the files, or 0.5 N/mm if they have none.
        folder: where the scene will be; the user's own files are named relative to it.

    Raises:
        FirstSceneError: what was given cannot be used; the message says what would do.
        SceneError: the file of device or hand cannot be read.
    """
    files = [_source("--device", device, "devices"), _source("--hand", hand, "hands")]
    said = read_layers(files[0])
    for file in files[1:]:
        said.lay(read_layers(file).data, str(file))
    if wall is None:
        known = _table(said, ("wall",)).get("stiffness", "0.5 N/mm")
        wall = known if isinstance(known, str) else f"{known} N/m"
    else:
        _table(said, ("wall",)).pop("stiffness", None)
    try:
        is_stiffness = from_text(wall, "N/m") >= 0
    except ValueError:
        is_stiffness = False
    if not is_stiffness:
        raise FirstSceneError(f'--wall is "{wall}". It must be a stiffness with its unit, such as --wall "0.5 N/mm".')
    return _left_to_files(
        _TEXT.format(
            title=inline(f"{Path(device).stem} held by {Path(hand).stem} against a wall"),
            device=inline(_named(files[0], "devices", folder)),
            hand=inline(_named(files[1], "hands", folder)),
            wall=inline(wall),
            place=_place(_table(said, ("hand",)).get("stiffness", 0.0)),
        ),
        said,
    )


def _place(stiffness: float | str) -> str:
    """Returns where the wall begins: 5 mm on the way, or half as far as 1 N takes a hand of this stiffness."""
    try:
        of_hand = float(stiffness if isinstance(stiffness, float | int) else from_text(stiffness, "N/m"))
    except ValueError:
        of_hand = 0.0  # the scene tells what is wrong with it
    reach_mm = 1e3 / of_hand if of_hand > 0.0 else math.inf
    return f"-{min(_FAR_MM, reach_mm / 2.0):.2g} mm"


def _left_to_files(text: str, said: Layers) -> str:
    """Returns the text with each key that the files give, and all keys of a table whose kind they name, as comments."""
    lines, table, at = list[str](), (), _table(said, ())
    for line in text.splitlines():
        if header := re.fullmatch(r"\[([\w.]+)\].*", line):
            table = tuple(header[1].split("."))
            at = _table(said, table)
        elif key := re.match(r"(\w+) = ", line):
            if key[1] in at and key[1] not in ("title", "extends"):
                line = f"# {key[1]} = {inline(at[key[1]])}  # from {Path(said.origin((*table, key[1]))).name}"
            elif "kind" in at and table != ("wall",):
                line = f"# {line}"
        lines.append(line)
    return "\n".join([*lines, ""])


def _table(said: Layers, path: tuple[str, ...]) -> Tables:
    """Returns the table of this name; an empty one where there is none, or something else."""
    found: Any = said.data
    for name in path:
        found = found.get(name) if isinstance(found, dict) else None
    return found if isinstance(found, dict) else {}


def _source(option: str, name: str, kind: str) -> Path:
    known = bundled(kind)
    if name in known:
        return known[name]
    if Path(name).is_file():
        return Path(name)
    meant = nearest(name, known)
    hint = f"; did you mean {meant}?" if meant else "."
    raise FirstSceneError(
        f"{option} {name!r} is not a file, and none of that name comes with haploop{hint} These do: {', '.join(known)}."
    )


def _named(file: Path, kind: str, folder: Path) -> str:
    """Returns a file as ``extends`` names it."""
    if file in bundled(kind).values():
        return f"{kind}/{file.name}"
    return Path(os.path.relpath(file, folder)).as_posix()
