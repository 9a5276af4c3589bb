"""Reading a scene file: everything it says, resolved, or everything that is wrong with it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from haploop.launch.scene.check import resolve
from haploop.launch.scene.events import in_order_of_time
from haploop.launch.scene.mistakes import COMMAND_LINE, SceneError, shown
from haploop.launch.scene.reading.layers import Layers, lay_overrides, read_layers
from haploop.launch.scene.reading.lines import KeyPath, line_in
from haploop.launch.scene.reading.shorthand import put_in_full, told_of_recording
from haploop.launch.scene.unmodelled import demand_modelled
from haploop.protocol.installed import all_brought
from haploop.protocol.scene.scene import Scene

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# What steers a terminal, or ends a line.
_CONTROLS = re.compile("[\\x00-\\x1f\\x7f-\\x9f\\u2028\\u2029]")
_A_SWEEP = "A sweep is run by haploop sweep {}; it names a scene and says what is varied in it."


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
        any_hand: whether its hand may be unmodelled; nothing here moves such a scene.

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
    """Returns the resolved scene of layers that were read already.

    Raises:
        SceneError: the scene cannot be run; it holds every mistake.
        PluginError: something that it names from a plugin file does not give a number.
    """
    if "axes" in layers.data:
        layers.complain(("axes",), _A_SWEEP.format(layers.path), "is a key of a sweep, not of a scene")
        raise SceneError(layers.mistakes)
    lay_overrides(layers, overrides)
    layers.data.setdefault("title", layers.path.stem)
    if isinstance(title := layers.data["title"], str) and _CONTROLS.search(title):
        layers.complain(("title",), "It must be one line of letters that can be printed.")
    put_in_full(layers)
    if kinds is None:
        from haploop.controller.dissipation import registry

        kinds = registry()
    scene = resolve(layers, kinds).in_order()
    if all_brought():
        from haploop.controller.tried import try_kinds

        try_kinds(scene)
    return scene if any_hand else demand_modelled(layers, scene)


def places(path: Path, overrides: Sequence[str], keys: Sequence[str]) -> list[str]:
    """Returns where keys of a file's resolved scene stand, as ``FILE:LINE``; "" for one that stands in no file.

    A file that is gone, or is another by now, has none of them.
    """
    try:
        layers = read_layers(path)
    except SceneError:
        return [""] * len(keys)
    lay_overrides(layers, overrides)
    return [_place(layers, key) for key in keys]


def recording_told(path: Path, overrides: Sequence[str]) -> str:
    """Returns a sentence on how the recorded hand force of a valid scene is read; "" where there is none."""
    layers = read_layers(path)
    lay_overrides(layers, overrides)
    return told_of_recording(layers)


def _place(layers: Layers, name: str) -> str:
    key: KeyPath = tuple(int(part) if part.isdecimal() else part for part in name.split("."))
    if key[0] == "event" and len(key) > 1:
        places_in_file = in_order_of_time(layers.data.get("event", []))[int(key[1]) :]
        key = ("event", *places_in_file[:1])
    while key and key not in layers.origins and not (len(key) == 2 and key[:1] in layers.origins):
        key = key[:-1]
    origin = layers.origin(key)
    line = None if origin == COMMAND_LINE or not key else line_in(origin, key)
    return f"{shown(origin)}:{line}" if line else ""
