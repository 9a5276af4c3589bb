"""A scene in Python: read from its file, ready to run; a change gives a new scene."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from haploop.controller.dissipation import Element, load_plugin, registry
from haploop.controller.dissipation.registry import checked
from haploop.controller.tried import try_kinds
from haploop.launch.scene import file as scene_file
from haploop.launch.scene.check import resolve
from haploop.launch.scene.events import elements_of, try_out
from haploop.launch.scene.mistakes import COMMAND_LINE, SceneError, shown
from haploop.launch.scene.reading.layers import Layers, lay_overrides
from haploop.launch.scene.toml_writer import inline, to_toml
from haploop.launch.scene.unmodelled import demand_modelled
from haploop.protocol.installed import Brought, all_brought, bring
from haploop.protocol.names import meant
from haploop.protocol.scene.scene import Scene
from haploop.protocol.scene.table import Tables

Values = Mapping[str, Any] | Iterable[str]
SET_SO = 'Values are set by key: set({"wall.stiffness": 200}); mid-run, set({"wall.stiffness": "0.2 N/mm"}, at=0.5).'


@dataclass(frozen=True, eq=False)
class LoadedScene:
    """A scene that can be run; every change gives a new one, which can be run too, and leaves this one unchanged.

    A value is a number in SI units, text with its unit (``"0.2 N/mm"``) or a quantity of pint. ``scene["wall"]`` is one
    of its tables in SI units, ``scene["wall.stiffness"]`` a number; ``print(scene)`` shows all of them.

    Attributes:
        scene: its content, typed.
        path: the file it was read from.
        kinds: the available elements, by kind.
        plugin_files: the file of each kind that came from one.
        plugins: the plugin files that it was loaded with.
        brought: walls, estimators and hand forces of these files; files loaded later may take over their names in this
            process.
    """

    scene: Scene
    path: Path
    kinds: Mapping[str, type[Element]] = field(default_factory=dict)
    plugin_files: Mapping[str, Path] = field(default_factory=dict)
    plugins: tuple[Path, ...] = ()
    brought: Brought = field(default_factory=all_brought)

    def __post_init__(self) -> None:
        try_out(elements_of(self.scene), self.kinds)
        try_kinds(self.scene)

    @property
    def tables(self) -> Tables:
        """All tables, copied: plain dicts, all numbers in SI units, defaults filled in, absent tables left out."""
        return self.scene.as_dict()

    @property
    def notes(self) -> list[str]:
        """What is valid but may not be what was meant, a sentence each, as ``haploop check`` tells it."""
        from haploop.launch.plan.effects import notes

        return [str(note) for note in notes(self.scene, self.kinds)]

    def __getitem__(self, key: str) -> Any:
        value, path = self.tables, list[str]()
        for part in key.split("."):
            held = dict(zip(map(str, range(len(value))), value, strict=True)) if isinstance(value, list) else value
            if not isinstance(held, dict) or part not in held:
                names = held if isinstance(held, dict) else ()
                where, holds = ".".join(path) or "this scene", f"; it holds {', '.join(names)}" if names else ""
                raise KeyError(f"There is no {part} in {where}{meant(part, names)}{holds}.")
            value, path = held[part], [*path, part]
        return value

    def __contains__(self, key: str) -> bool:
        try:
            self[key]
        except KeyError:
            return False
        return True

    def __str__(self) -> str:
        return to_toml(self.tables)

    def __repr__(self) -> str:
        return f"<Scene {self['title']!r}, {self['duration']:g} s, from {self.path}>"

    def set(self, values: Values, at: Any = None) -> LoadedScene:
        """Returns the scene with other values, from its start or from a moment on.

        Args:
            values: by dotted key, ``{"wall.stiffness": 200, "dissipation.0.mass": "20 g"}``, or as on the command line,
                ``["wall.stiffness=200"]``.
            at: time of a change in mid-run, in s or text with its unit; None for the start. In mid-run only wall,
                delay and the elements' parameters can be set.

        Raises:
            SceneError: such a scene could not be run; the error holds every mistake.
            ElementError: an element's own code does not take its parameters.
        """
        if isinstance(values, str):
            raise TypeError(SET_SO)
        if at is None:
            layers = Layers(self.path, self.tables)
            with mistakes_of_python():
                lay_overrides(layers, texts(values))
                return self._resolved(layers)
        if not isinstance(values, Mapping):
            raise TypeError(SET_SO)
        return self._with_event({"at": plain(at), "set": plain(values)}, "set")

    def swap(self, kind: str | type[Element], *, at: Any, element: int = 0, **parameters: Any) -> LoadedScene:
        """Returns the scene with an element that is swapped in during the run.

        Args:
            kind: kind of the new element, or its class; "none" removes the present one.
            at: time of the swap, in s or text with its unit; the first tick then or later sees it.
            element: which element is replaced, counted from 0; one past the end adds one.
            parameters: parameters of the new element, including ``acts``.

        Raises:
            SceneError, ElementError: as for ``set``.
            PluginError: the class is not a usable element.
        """
        scene, name = self, kind
        if not isinstance(kind, str):
            name = checked(kind, kind.__name__).kind
            files = {other: file for other, file in self.plugin_files.items() if other != name}
            scene = replace(self, kinds={**self.kinds, name: kind}, plugin_files=files)
        table = {"kind": name, **plain(parameters)}
        return scene._with_event({"at": plain(at), "swap": table, "element": element}, "swap")

    def _with_event(self, event: Tables, by: str) -> LoadedScene:
        """Returns the scene with one more event; its mistakes are reported for the method ``by``, not for the file."""
        layers = Layers(self.path, self.tables)
        events = layers.data.setdefault("event", [])
        layers.origins["event", len(events)] = by
        events.append(event)
        return self._resolved(layers)

    def _resolved(self, layers: Layers) -> LoadedScene:
        bring(self.brought)
        return replace(self, scene=demand_modelled(layers, resolve(layers, self.kinds).in_order()))


def load(
    path: str | Path, values: Values = (), *, elements: Iterable[type[Element]] = (), plugins: Iterable[str | Path] = ()
) -> LoadedScene:
    """Reads a scene file.

    Args:
        path: the scene file (TOML).
        values: override those of the file, as in ``LoadedScene.set``.
        elements: element classes that may be named by their kind, in this scene and in those made from it.
        plugins: files that define elements, walls, estimators or hand forces.

    Raises:
        SceneError: the scene cannot be run; the error holds every mistake.
        PluginError: a file defines nothing usable, or a class is not a usable element.
        ElementError: an element's own code does not take its parameters.
        TypeError: what was given is no path.
    """
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"A scene is a file, or a name that haploop scenes lists, but {path!r:.60} was given.")
    kinds, files = registry(), {}
    for plugin in (paths := tuple(map(Path, plugins))):
        found = load_plugin(plugin)
        kinds |= found
        files |= dict.fromkeys(found, plugin)
    kinds |= (given := {checked(element, element.__name__).kind: element for element in elements})
    files = {kind: file for kind, file in files.items() if kind not in given}
    with mistakes_of_python():
        scene = scene_file.load(path, texts(values), kinds)
    return LoadedScene(scene, Path(path), kinds, files, paths)


@contextmanager
def mistakes_of_python(written: Path | None = None) -> Iterator[None]:
    """Reports the mistakes of values given in Python as those of ``values``, not of the command line.

    Those in a file that was ``written`` from arguments name no file.
    """
    try:
        yield
    except SceneError as error:
        places = {COMMAND_LINE: "values"} | ({shown(written): ""} if written else {})
        mistakes = (
            replace(one, file=places[one.file], line=None) if one.file in places else one for one in error.mistakes
        )
        raise SceneError(mistakes) from None


def texts(values: Values) -> list[str]:
    """Returns values as the command line takes them: ``KEY=VALUE``.

    Raises:
        TypeError: a value is of a type that no scene holds, or the values are a single text.
    """
    if isinstance(values, str):
        raise TypeError(SET_SO)
    if isinstance(values, Mapping):
        return [_text(key, value) for key, value in values.items()]
    return list(values)


def _text(key: str, value: Any) -> str:
    try:
        return f"{key}={inline(plain(value))}"
    except TypeError as error:
        raise TypeError(f"values: {key}: {error}") from None


def plain(value: Any) -> Any:
    """Returns a value as a scene file holds it: pint's quantities as text with a unit, NumPy's arrays as lists."""
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain(inner) for inner in value]
    if hasattr(value, "units") and hasattr(value, "magnitude"):
        return f"{float(value.magnitude)!r} {value.units:~C}"
    return value.tolist() if hasattr(value, "tolist") else value
