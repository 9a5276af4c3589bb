"""Reading a scene file: everything it says, resolved, or everything that is wrong with it."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from haploop.launch.scene.check import resolve
from haploop.launch.scene.layers import Layers, lay_overrides, read_layers
from haploop.launch.scene.mistakes import COMMAND_LINE
from haploop.launch.scene.models import fault
from haploop.launch.scene.unmodelled import demand_modelled
from haploop.protocol.files import read_text
from haploop.protocol.scene.scene import Scene

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element


def load(
    path: Path | str,
    overrides: Sequence[str] = (),
    kinds: Mapping[str, type[Element]] | None = None,
    *,
    any_hand: bool = False,
) -> Scene:
    """Returns the resolved scene of a TOML file: in SI units, defaults filled in, events in order of time.

    Args:
        path: the scene file.
        overrides: ``KEY=VALUE`` with dotted keys, laid over what the file says.
        kinds: the dissipation elements at hand, by kind; the installed ones when None.
        any_hand: whether its hand may be unmodelled: nothing here moves such a scene.

    Raises:
        SceneError: the scene cannot be run; it holds every mistake.
    """
    return resolved(read_layers(Path(path)), overrides, kinds, any_hand=any_hand)


def resolved(
    layers: Layers,
    overrides: Sequence[str] = (),
    kinds: Mapping[str, type[Element]] | None = None,
    *,
    any_hand: bool = False,
) -> Scene:
    """Returns the resolved scene of layers that were read already; a SceneError holds every mistake."""
    lay_overrides(layers, overrides)
    layers.data.setdefault("title", layers.path.stem)
    _read_recording(layers)
    if kinds is None:
        from haploop.controller.dissipation import registry

        kinds = registry()
    scene = resolve(layers, kinds).in_order()
    return scene if any_hand else demand_modelled(layers, scene)


def _read_recording(layers: Layers) -> None:
    """Puts the samples of a recorded hand force in place of its file, so that the scene runs by itself."""
    hand = layers.data.get("hand")
    force = hand.get("force") if isinstance(hand, dict) else None
    if not isinstance(force, dict) or force.get("kind") != "trace" or "file" not in force:
        return
    key = ("hand", "force", "file")
    times, forces = [0.0], [0.0]
    if "time" in force or "force" in force:
        layers.complain(key, "A trace has either a file or the lists time and force.")
    elif not isinstance(force["file"], str):
        layers.complain(key, "It must be the path of a CSV file of time and force.")
    else:
        origin = layers.origin(key)
        folder = Path() if origin == COMMAND_LINE else Path(origin).parent
        try:
            times, forces = read_trace(folder / force["file"])
        except TraceError as error:
            layers.complain(key, str(error))
    del force["file"]
    force |= {"time": times, "force": forces}


class TraceError(ValueError):
    """A recording that cannot be used; the message is a full sentence."""


def read_trace(path: Path) -> tuple[list[float], list[float]]:
    """Times in s and forces in N from a CSV of two columns; a header line and empty lines may be there.

    Raises:
        TraceError: no such file, not text, or a line that is no pair of numbers, with its line number.
    """
    try:
        rows = list(csv.reader(read_text(path).splitlines()))
    except UnicodeDecodeError as error:
        raise TraceError(f"The recording must be UTF-8 text, but byte {error.start} is not.") from error
    except OSError as error:
        raise TraceError(f"The recording cannot be read: {error.strerror}.") from error
    except csv.Error as error:
        raise TraceError("The recording must be lines of two numbers, but a cell is longer than any number.") from error
    numbers, times, forces = [], [], []
    for number, cells in enumerate(rows, start=1):
        if not any(cell.strip() for cell in cells):
            continue
        try:
            time, force = map(float, cells)
        except ValueError as error:
            if not times and len(cells) == 2 and not any(_is_number(cell) for cell in cells):
                continue  # the header
            line = ",".join(cells)
            raise TraceError(f"Line {number} must be a time in s and a force in N, but is {line!r}.") from error
        numbers.append(number)
        times.append(time)
        forces.append(force)
    if found := fault(times, forces):
        raise TraceError(f"Line {numbers[found[0]]}: {found[1]}" if numbers else found[1])
    return times, forces


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
