"""The text of a first scene: a device, a hand and a wall, with comments that say what else there is."""

from __future__ import annotations

import os
from pathlib import Path

from haploop.launch.scene.bundled import bundled
from haploop.launch.scene.number import from_text
from haploop.launch.scene.toml_writer import inline
from haploop.protocol.names import nearest

_TEXT = """\
# A scene for haploop. What it does not say it takes from the files it extends; what they do not say is left out of the
# simulation. `haploop check THIS --json` prints all of it, resolved; `haploop check --schema` every key there is.
title = {title}
extends = [{device}, {hand}]  # haploop scenes lists them; a file of yours is named by its path
duration = 3.0  # s

[clock]
control_rate = 1000  # Hz, of the controller; the plant moves at 10 kHz
round_trip_delay = "0 ms"  # from a sample to its force; a multiple of 0.1 ms

[hand.force]  # what the muscles do: press with 1 N, reached after 0.3 s
kind = "ramp"
value = "-1 N"
rise_time = "0.3 s"

[wall]
position = "-5 mm"  # below this the wall pushes back
stiffness = {wall}

# An element that takes energy out while the device is in the wall; haploop plugins lists them.
# [[dissipation]]
# kind = "damping"
# damping = "1 N s/m"

# A swap in mid-run; haploop swap does the same to a running loop.
# [[event]]
# at = "2 s"
# swap = {{ kind = "unidirectional-inertia", mass = "2 g" }}
"""


class FirstSceneError(ValueError):
    """A wall that is no stiffness, or a device or hand that is no file and does not come with haploop."""


def first_scene(device: str, hand: str, wall: str, folder: Path) -> str:
    """Returns a scene in which a hand moves a device into a wall and holds it there.

    Args:
        device, hand: names that ``haploop scenes`` lists, or paths of files of one's own.
        wall: stiffness with its unit.
        folder: where the scene will be; files of one's own are named from there.

    Raises FirstSceneError, whose message says what would do.
    """
    try:
        is_stiffness = from_text(wall, "N/m") >= 0
    except ValueError:
        is_stiffness = False
    if not is_stiffness:
        raise FirstSceneError(f'--wall is "{wall}". It must be a stiffness with its unit, such as --wall "0.5 N/mm".')
    return _TEXT.format(
        title=inline(f"{Path(device).stem} held by {Path(hand).stem} against a wall of {wall}"),
        device=inline(_source("--device", device, "devices", folder)),
        hand=inline(_source("--hand", hand, "hands", folder)),
        wall=inline(wall),
    )


def _source(option: str, name: str, kind: str, folder: Path) -> str:
    known = bundled(kind)
    if name in known:
        return f"{kind}/{name}.toml"
    if Path(name).is_file():
        return Path(os.path.relpath(name, folder)).as_posix()
    meant = nearest(name, known)
    hint = f"; did you mean {meant}?" if meant else "."
    raise FirstSceneError(
        f"{option} {name!r} is no file, and none of that name comes with haploop{hint} These do: {', '.join(known)}."
    )
