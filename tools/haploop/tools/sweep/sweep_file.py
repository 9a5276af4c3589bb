"""The sweep file, read into a resolved sweep, or into a list of all its mistakes."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError
from pydantic_core import PydanticCustomError

from haploop.launch.runs.loaded_scene import texts
from haploop.launch.scene import file as scene_file
from haploop.launch.scene.bundled import found
from haploop.launch.scene.check import complain
from haploop.launch.scene.mistakes import COMMAND_LINE, Mistake, SceneError, shown
from haploop.launch.scene.models import Model
from haploop.launch.scene.number import Number, si
from haploop.launch.scene.reading.layers import KeyPath, Layers, key_path, lay_overrides, read_layers
from haploop.launch.scene.reading.lines import line_in
from haploop.launch.scene.reading.tables import parse
from haploop.launch.scene.schema import TomlSchema
from haploop.logger.verdict.measures import OF_WINDOW
from haploop.protocol.names import nearest
from haploop.protocol.quantity import Quantity
from haploop.protocol.scene.scene import Scene
from haploop.tools.executor.work import Sources, load_kinds
from haploop.tools.search.bisect import Tolerance
from haploop.tools.sweep.cell_scene import Refused, Values, resolved
from haploop.tools.sweep.cells import Axis, Bisect, Sweep
from haploop.tools.sweep.points import AxisError, Span, listed, make_points, number_at
from haploop.tools.sweep.record import make_columns, usual
from haploop.tools.sweep.table import SEED, Column

MOST_AXES = 3
_SCENE = (
    "This is a scene, for haploop run. A sweep is a separate file that names a scene and what is varied in it: "
    'scene = "{0}", then [axes], then a line such as "wall.stiffness" = [500, 1000, 2000].'
)
_KINDS_UNLESS_GIVEN = {"wall": "spring"}
Verdict = Literal["steady", "limit-cycle", "diverged", "no-contact", "no-swing-seen", "swinging"]


class BisectTable(Model):
    """Table ``[bisect]``: the axis on which the change of the verdict is sought."""

    axis: Annotated[str, Field(description="key of the axis")]
    tolerance: Any = None
    relative: Annotated[float | None, si("", "tolerance as a fraction", above=0, below=1)] = None
    holds: Verdict = "steady"


class SweepFile(Model):
    """A sweep: a scene, and what is varied in it."""

    title: str | None = None
    scene: str | None = None
    base: Values | None = None
    repeat: Annotated[int, si("", "seeds of every combination", whole=True, at_least=1, at_most=1_000_000)] = 1
    record: list[str] | None = None
    set: Values = Field(default_factory=dict)
    axes: Values
    bisect: BisectTable | None = None


def load(path: Path, overrides: Sequence[str] = (), sources: Sources = ()) -> Sweep:
    """Reads the resolved sweep of a TOML file.

    Args:
        overrides: ``KEY=VALUE`` with dotted keys of the scene, laid over what the file says.
        sources: plugin files, by name and text.

    Raises:
        SceneError: the sweep cannot be run; it holds every mistake.
        PluginError: a plugin does not load.
    """
    return _Reader(path, sources).sweep(overrides)


class _Reader:
    """Collects the parts of a sweep and everything that is wrong with them."""

    def __init__(self, path: Path, sources: Sources) -> None:
        self._kinds, self._sources = load_kinds(sources), sources
        path = found(path, "sweeps")
        self._layers = Layers(path)
        self._layers.lay(parse(path, "sweep", "a scene and [axes]"), str(path))
        self._data = self._layers.data
        if not {"axes", "scene", "base"} & self._data.keys() and {"extends", "device", "wall"} & self._data.keys():
            raise SceneError([Mistake(shown(path), "", "", _SCENE.format(path.name))])
        given = self._data.get("set")
        self._changes: Values = given if isinstance(given, dict) else {}
        # By the key of each axis, the reader of its values where they are numbers.
        self._numbers = dict[str | None, Number | None]()

    def sweep(self, overrides: Sequence[str]) -> Sweep:
        """Makes the sweep."""
        table, base = self._table(), self._base(overrides)
        axes = self._axes(Layers(self._layers.path, base.as_dict()) if base else self._as_written())
        record = self._record(base or self._unchanged(), axes)
        bisect = self._bisect(axes)
        if bisect and base and base.run.verdict == "window":  # whose runs are never called steady
            bisect = replace(bisect, holds=OF_WINDOW.get(bisect.holds, bisect.holds))
        if table and table.repeat > 1 and any(axis.key == SEED for axis in axes):
            self._layers.complain(("repeat",), "It draws seeds, and so does the axis seed; leave one of them out.")
        if self._layers.mistakes or table is None or base is None:
            raise SceneError(self._layers.mistakes)
        title = table.title or self._layers.path.stem
        return Sweep(title, base, tuple(axes), table.repeat, tuple(record), bisect, self._sources)

    def _table(self) -> SweepFile | None:
        table = None
        try:
            table = SweepFile.model_validate(self._data)
        except ValidationError as error:
            _complain(self._layers, error, SweepFile, "Sweep")
        if ("scene" in self._data) == ("base" in self._data):
            given = "is given beside [base]" if "scene" in self._data else "is missing"
            expected = "A sweep has the path of a scene file, relative to its own, or the scene itself in [base]."
            self._layers.complain(("scene",), expected, given)
        return table

    def _base(self, overrides: Sequence[str]) -> Scene | None:
        try:
            laid = [*texts(self._changes), *overrides]
            if isinstance(name := self._data.get("scene"), str):
                return scene_file.load(self._scene_path(name), laid, self._kinds)
            if isinstance(table := self._data.get("base"), dict):
                return scene_file.resolved(Layers(self._layers.path, table), laid, self._kinds)
        except SceneError as error:
            for mistake in error.mistakes:
                if mistake.file == COMMAND_LINE and mistake.key in self._changes:
                    path, line = self._layers.path, line_in(str(self._layers.path), ("set", mistake.key))
                    mistake = replace(mistake, file=shown(path), key=f"set.{mistake.key}", line=line)
                self._layers.mistakes.append(mistake)
        except TypeError as error:  # a value that no scene holds, such as a date
            self._layers.complain(("set",), str(error), "cannot be used")
        return None

    def _scene_path(self, name: str) -> Path:
        return found(Path(name), "scenes", self._layers.path.parent)

    def _unchanged(self) -> Scene | None:
        """Returns the scene without what is laid over it, where nothing else is wrong with it."""
        try:
            return scene_file.load(self._scene_path(self._data["scene"]), (), self._kinds)
        except (SceneError, LookupError, TypeError):
            return None

    def _as_written(self) -> Layers | None:
        """Returns the scene as its files and ``set`` have it, where something is wrong with it; None without tables."""
        name, table = self._data.get("scene"), self._data.get("base")
        with suppress(SceneError, TypeError):
            layers = Layers(self._layers.path, deepcopy(table)) if isinstance(table, dict) else None
            layers = read_layers(self._scene_path(name)) if isinstance(name, str) else layers
            if layers:
                lay_overrides(layers, texts(self._changes))
                for key, kind in _KINDS_UNLESS_GIVEN.items():
                    if isinstance(one := layers.data.get(key), dict):
                        one.setdefault("kind", kind)
            return layers
        return None

    def _axes(self, base: Layers | None) -> list[Axis]:
        given = self._data.get("axes")
        if not isinstance(given, dict):
            return []
        if not 1 <= len(given) <= MOST_AXES:
            self._layers.complain(("axes",), f"A sweep has one to {MOST_AXES} axes.", f"has {len(given)}")
        whole = base and self._with_first_names(base)
        return [axis for key, values in given.items() if whole and (axis := self._axis(key, values, whole))]

    def _with_first_names(self, base: Layers) -> Layers:
        """Returns the base with the first name or table of each axis of these, which may bring another axis's keys."""
        firsts = {key: values[0] for key, values in self._data["axes"].items() if isinstance(values, list) and values}
        names = {key: value for key, value in firsts.items() if not isinstance(value, int | float) and key_path(key)}
        layers = Layers(self._layers.path, base.data)
        with suppress(TypeError):  # a value that no scene holds, which is a mistake of its axis
            lay_overrides(layers, texts(names))
        return layers

    def _axis(self, key: str, values: Any, scene: Layers) -> Axis | None:
        at: KeyPath = ("axes", key)
        path = key_path(key)
        if isinstance(values, dict) and not {"from", "to", "step", "count", "scale"} & values.keys():
            inner = next(iter(values), "key")
            self._layers.complain(
                at, f'Write the whole key in quotes, such as "{key}.{inner}" = [1.0, 2.0].', "is a table"
            )
            return None
        try:
            if not path:
                raise AxisError("It must be a dotted key, such as wall.stiffness.", "cannot be read")
            number = self._numbers[key] = number_at(path, scene, self._kinds)
            points = self._points(at, values, number)
        except AxisError as error:
            place = at if error.place == "" else (*at, error.place)
            self._layers.complain(place, error.expected, error.given, error.nearest)
            return None
        if points is None or (number is None and not self._names_fit(at, key, points, scene)):
            return None
        if number is None:
            return Axis(key, tuple(points))
        return Axis(key, tuple(points), number.quantity.unit, number.quantity.whole)

    def _points(self, at: KeyPath, values: Any, number: Number | None) -> list[Any] | None:
        if isinstance(values, list):
            return listed(values, number)
        if number is None:
            self._layers.complain(at, "It holds no number, so its values must be a list.")
            return None
        if not isinstance(values, dict):
            self._layers.complain(at, "It must be a list, or a table with from, to, and step or count.")
            return None
        try:
            return make_points(Span.model_validate(values), number)
        except ValidationError as error:
            layers, name = Layers(self._layers.path, values), ".".join(map(str, at))
            _complain(layers, error, Span, "span")
            for mistake in layers.mistakes:
                key, given = f"{name}.{mistake.key}".rstrip("."), mistake.given.replace("of a span", f"of {name}")
                self._layers.mistakes.append(replace(mistake, key=key, given=given))
            return None

    def _names_fit(self, at: KeyPath, key: str, values: Sequence[Any], scene: Layers) -> bool:
        """Tells whether the key takes each value; whether it suits the rest of a scene is known only cell by cell."""
        count = len(self._layers.mistakes)
        for place, value in enumerate(values):
            try:
                resolved({key: value}, scene.data, self._kinds)
            except Refused as error:
                for mistake in error.mistakes:
                    if mistake.key == key:
                        self._layers.complain((*at, place), mistake.expected, None, mistake.nearest)
            except TypeError:
                self._layers.complain((*at, place), "A scene holds text, numbers, true or false, lists and tables.")
        return len(self._layers.mistakes) == count

    def _record(self, base: Scene | None, axes: Sequence[Axis]) -> list[Column]:
        given = self._data.get("record")
        if base is None:
            return []  # what can be recorded depends on what runs
        names = given if isinstance(given, list) and all(isinstance(name, str) for name in given) else usual(base)

        def complain(place: int, sentence: str, hint: str | None) -> None:
            self._layers.complain(("record", place), sentence, None, hint)

        return make_columns(names, Sweep("", base, tuple(axes), sources=self._sources), self._kinds, complain)

    def _bisect(self, axes: Sequence[Axis]) -> Bisect | None:
        """Returns the bisection; None where there is none, or it cannot be made.

        Mistakes that the model of its table finds have been reported already.
        """
        given = self._data.get("bisect")
        if not isinstance(given, dict) or not isinstance(key := given.get("axis"), str):
            return None
        mistakes, place = len(self._layers.mistakes), ("bisect", "axis")
        keys = list(self._data["axes"]) if isinstance(self._data.get("axes"), dict) else []
        axis = next((axis for axis in axes if axis.key == key), None)
        if key not in keys:
            self._layers.complain(place, f"It must be an axis: {', '.join(keys)}.", None, nearest(key, keys))
        elif axis and (axis.unit is None or axis.whole or len(axis.values) < 2):
            self._layers.complain(place, "It must be an axis of two or more numbers, of a key that takes fractions.")
        elif axis and len({b > a for a, b in zip(axis.values, axis.values[1:], strict=False)}) > 1:
            self._layers.complain(
                ("axes", key), "The values of the axis that is bisected must all increase or all decrease."
            )
        tolerance_given, relative = given.get("tolerance"), given.get("relative")
        if (tolerance_given is None) == (relative is None):
            self._layers.complain(("bisect",), "It must have exactly one of tolerance and relative.")
        tolerance = self._tolerance(tolerance_given, self._numbers.get(key) or self._numbers.get(nearest(key, keys)))
        if len(self._layers.mistakes) > mistakes or axis is None or not isinstance(relative, float | int | None):
            return None
        return Bisect(key, given.get("holds", "steady"), Tolerance(tolerance, float(relative or 0.0)))

    def _tolerance(self, given: Any, number: Number | None) -> float:
        """Returns the tolerance in the unit of its axis; 0 where it is missing or wrong, or the axis is not known."""
        if given is None or number is None:
            return 0.0
        try:
            return Number(Quantity(number.quantity.unit, above=0.0)).read(given)
        except PydanticCustomError as error:
            self._layers.complain(("bisect", "tolerance"), error.message())
            return 0.0


def _complain(layers: Layers, error: ValidationError, model: type[Model], title: str) -> None:
    schema = {**model.model_json_schema(schema_generator=TomlSchema), "title": title}
    for detail in error.errors(include_url=False):
        complain(layers, detail["type"], detail["msg"], detail["loc"], schema)
