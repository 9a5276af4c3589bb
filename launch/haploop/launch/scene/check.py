"""From merged tables to a resolved scene, or to everything that is wrong with them."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from haploop.launch.plan.effect import Draft
from haploop.launch.plan.effects import all_effects
from haploop.launch.scene.bundled import bundled
from haploop.launch.scene.estimator_keys import check_estimators, check_filter
from haploop.launch.scene.events import check_events
from haploop.launch.scene.mistakes import COMMAND_LINE, Mistake, SceneError, shown
from haploop.launch.scene.models import Model, number_of, read_table, scene_model
from haploop.launch.scene.reading.layers import KeyPath, Layers
from haploop.launch.scene.schema import Schema, alternatives, keys_of_all, schema_at, whole_schema
from haploop.launch.scene.toml_writer import inline
from haploop.launch.scene.unmodelled import check_hand
from haploop.launch.scene.wall_keys import check_spring, check_wall, with_defaults
from haploop.protocol.names import nearest
from haploop.protocol.scene.scene import Clock, EventTable, Scene
from haploop.protocol.scene.table import Tables
from haploop.protocol.ticks import Timebase, TimebaseError

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# Tables in which the key ``kind`` says what else is in them; a number stands for any.
_TAGGED = {("hand", "force"), ("jitter",), ("dissipation", 0), ("event", 0, "swap")}
# What may not be a mistake once the missing file is there.
_ELSEWHERE = ("missing", "union_tag_not_found")
_SOME_S = 1.0
_OWN_KIND = " {} of your own needs --plugin FILE, in a running loop when that is started."
# What a plugin file may bring, by the last keys of the place where it is named.
_OWN: dict[KeyPath, str] = {
    ("wall", "kind"): "A wall",
    ("velocity", "estimator"): "An estimator",
    ("acceleration", "estimator"): "An estimator",
    ("force", "kind"): "A hand force",
}
_A_SWAP = 'It must be a table, such as { kind = "damping", damping = 0.8 }.'
_TYPES = {"array": "a list of numbers", "string": "text in quotes", "object": "a table", "boolean": "true or false"}
# Keys that a file may give instead.
_IN_A_FILE = (("hand", "force", "time"), ("hand", "force", "force"))
_OF_A_FILE = ' A text file may hold both: file = "push.csv".'
_FORMS = {
    "bool_type": "It must be true or false.",
    "string_type": "It must be text in quotes.",
    "list_type": "It must be a list.",
    "dict_type": "It must be a table.",
    "model_type": "It must be a table.",
    "model_attributes_type": "It must be a table.",
}


def resolve(layers: Layers, kinds: Mapping[str, type[Element]]) -> Scene:
    """Returns the resolved scene: defaults filled in, numbers in SI units, events in the order given.

    Raises:
        SceneError: all mistakes, those already known to ``layers`` included.
    """
    return with_rules(layers, validated(layers, layers.data, kinds), kinds)


def validated(layers: Layers, tables: Tables, kinds: Mapping[str, type[Element]]) -> Scene | None:
    """Returns a scene of some tables of ``layers``; None if values are invalid, which it adds to the mistakes."""
    with suppress(ValidationError):  # the model of the whole scene says what is wrong
        return _read(tables, scene_model(kinds, tables))
    try:
        return _read(tables, scene_model(kinds))
    except ValidationError as error:
        schema = whole_schema(kinds)
        tagged = _TAGGED if len(kinds) > 1 else _TAGGED - {("dissipation", 0)}  # one kind alone is no choice
        for detail in error.errors(include_url=False):
            if layers.lacks_a_file and detail["type"] in _ELSEWHERE:
                continue
            complain(layers, detail["type"], detail["msg"], _plain(detail["loc"], tagged), schema)
    return None


def _read(tables: Tables, model: type[Model]) -> Scene:
    return Scene.from_dict(model.model_validate(tables).model_dump(exclude_none=True))


def with_rules(layers: Layers, scene: Scene | None, kinds: Mapping[str, type[Element]]) -> Scene:
    """Returns a scene after applying the rules between keys, with the values that its events set read.

    Args:
        layers: the tables of the scene.
        scene: a scene whose values are each valid alone; None if one is not, which is a mistake of ``layers`` already.

    Raises:
        SceneError: all mistakes, those already known to ``layers`` included.
    """
    if layers.lacks_a_file:
        raise SceneError(layers.mistakes)
    draft = Draft(layers.data, scene, read_table, layers.complain)
    for effect in all_effects():
        effect.check(draft)
    check_hand(draft)
    check_estimators(layers)
    check_wall(layers)
    if scene:
        check_spring(layers, scene, kinds)
        check_filter(layers, scene)
    settings = check_events(layers, _timebase(layers, scene), kinds)
    if layers.mistakes or scene is None:
        raise SceneError(layers.mistakes)
    scene = with_defaults(scene)
    if not scene.event:
        return scene
    events = [
        replace(event, element=event.element or 0) if event.swap else replace(event, set=settings.get(index))
        for index, event in enumerate(scene.event)
    ]
    return replace(scene, event=tuple(events))


def resolve_event(event: Tables, scene: Scene, kinds: Mapping[str, type[Element]]) -> EventTable:
    """Returns an event that comes in during a run, resolved, after the events of the resolved ``scene``.

    Raises:
        SceneError: it does not fit the scene, or an event that is still to come would then no longer fit. The event's
            own keys are reported as they were given, without their place in the scene.
    """
    events = [*(known.as_dict() for known in scene.event), event]
    layers = Layers(Path("the run with this change"), {**scene.as_dict(), "event": events})
    try:
        return resolve(layers, kinds).event[-1]
    except SceneError as error:
        raise SceneError(_as_asked(mistake, f"event.{len(events) - 1}") for mistake in error.mistakes) from None


def _as_asked(mistake: Mistake, event: str) -> Mistake:
    """Returns a mistake of one event without its place in the scene; a mistake of anything else unchanged."""
    if mistake.key == event:
        return replace(mistake, file="", key="what was asked for")
    if not mistake.key.startswith(f"{event}."):
        return mistake
    key = mistake.key.removeprefix(f"{event}.")
    key = next((key.removeprefix(verb) for verb in ("set.", "swap.") if key.startswith(verb)), key)
    return replace(mistake, file="", key=key, given=mistake.given.replace(f"[{event}.", "["))


def _timebase(layers: Layers, scene: Scene | None) -> Timebase | None:
    """Returns the integers of the run; None if there are none, which is added as a mistake unless it is one already."""
    table = scene.clock if scene else read_table(Clock, layers.data.get("clock", {}))
    try:
        duration = scene.duration if scene else number_of(Scene, "duration").read(layers.data.get("duration"))
    except PydanticCustomError:
        duration = None
    if table is None:
        return None
    try:  # without a duration the clock alone is checked: a second is a whole number of ticks at any rate
        time = Timebase.from_clock(table, _SOME_S if duration is None else duration)
        return None if duration is None else time
    except TimebaseError as error:
        clock = table.as_dict()
        for sentence in str(error).splitlines():  # each begins with its key
            name = sentence.split()[0]
            key, value = (("clock", name), clock[name]) if name in clock else ((name,), duration)
            is_given = len(key) == 1 or key[1] in layers.data.get("clock", {})
            layers.complain(key, f"The {sentence}", None if is_given else f"is {inline(value)}")
        return None


# What a scene says by other keys than data sheets use.
_COUNTS = ' 4096 counts over 0.2 m are bits = 12 and range = "0.2 m", or resolution = "0.2 m / 4096".'
_FORCE = (
    " The force is cut off at saturation at every instant, however long it lasts: give the peak force for taps, the "
    "continuous force for walls that are pressed for long. Heat is not simulated."
)
_SAID_BY: dict[KeyPath, str] = {
    **{("encoder", name): _COUNTS for name in ("counts", "cpr", "ppr")},
    **{("actuator", name): _FORCE for name in ("continuous", "peak", "limit", "max")},
    **{("actuator", f"{name}_force"): _FORCE for name in ("continuous", "peak", "max")},
}


def complain(layers: Layers, what: str, message: str, key: KeyPath, schema: Schema) -> None:
    """Adds a mistake that pydantic found, as a sentence; ``schema`` is that of the whole file."""
    rule = schema_at(schema, key, layers.data)
    match what:
        case "extra_forbidden":
            *table, name = key
            keys = list(schema_at(schema, tuple(table), layers.data).get("properties", {}))
            where = f"[{'.'.join(map(str, table))}]" if table else f"a {schema['title'].lower()}"
            expected = (
                f"Allowed: {', '.join(keys)}.{_heading(layers, schema, tuple(table), keys)}{_SAID_BY.get(key, '')}"
            )
            layers.complain(key, expected, f"is not a key of {where}", nearest(name, keys))
        case "missing":
            instead = _OF_A_FILE if key in _IN_A_FILE else _of_a_device(layers, key)
            layers.complain(key, f"It must be {_form(rule)}.{instead}", "is missing")
        case "union_tag_not_found":
            allowed = alternatives(schema, rule)
            layers.complain((*key, "kind"), f"Allowed: {', '.join(allowed)}.", "is missing")
            _complain_of_keys(layers, key, schema, rule)
        case "union_tag_invalid" | "literal_error":
            key = (*key, "kind") if what == "union_tag_invalid" else key
            allowed = alternatives(schema, rule)
            whose = "An element" if "dissipation" in key or "swap" in key else _OWN.get(tuple(key[-2:]), "")
            own = _OWN_KIND.format(whose) if whose else ""
            layers.complain(key, f"Allowed: {', '.join(allowed)}.{own}", None, nearest(layers.value(key), allowed))
            if what == "union_tag_invalid":
                _complain_of_keys(layers, key[:-1], schema, rule)
        case "sentence":
            table = layers.value(key)
            given = "does not fit together" if isinstance(table, dict) else None
            # Of a table that a file began, what was laid over it last is what does not fit.
            inner = [(*key, name) for name in table] if given else []
            layers.complain(
                key, message, given, place=next((at for at in inner if layers.origin(at) == COMMAND_LINE), key)
            )
        case "list_type" if isinstance(layers.value(key), dict):
            layers.complain(key, f"It must be a list of tables: [[{key[-1]}]], two pairs of brackets.", "is one table")
        case "model_type" | "model_attributes_type" | "dict_type" if _is_list_of_tables(layers.value(key)):
            layers.complain(key, f"It must be one table: [{key[-1]}], one pair of brackets.", "is a list of tables")
        case "model_type" | "model_attributes_type" if key[-1] == "swap":
            layers.complain(key, _A_SWAP)
        case _:
            layers.complain(key, _FORMS.get(what, f"{message}."))


def _heading(layers: Layers, schema: Schema, table: KeyPath, keys: list[str]) -> str:
    """Asks after a missing heading if all unknown keys of a table are those of one absent table; "" otherwise."""
    strange = layers.value(table).keys() - keys
    absent = schema["properties"].keys() - layers.data.keys()
    homes = [name for name in absent if strange <= schema_at(schema, (name,), {}).get("properties", {}).keys()]
    return f" Is the heading [{homes[0]}] missing above it?" if len(strange) > 1 and len(homes) == 1 else ""


def _is_list_of_tables(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(one, dict) for one in value)


def _complain_of_keys(layers: Layers, table: KeyPath, schema: Schema, rule: Schema) -> None:
    """Adds a mistake for every key that no kind has, of a table without a known kind."""
    keys = keys_of_all(schema, rule)
    for name in layers.value(table):
        if name not in keys:
            allowed = ", ".join(keys)
            layers.complain(
                (*table, name), f"Keys of all kinds: {allowed}.", "is a key of no kind", nearest(name, keys)
            )


def _of_a_device(layers: Layers, key: KeyPath) -> str:
    """Returns what to do with a file that describes a device and no task; "" for any other file."""
    if key != ("duration",) or not layers.data.keys().isdisjoint({"wall", "hand", "dissipation"}):
        return ""
    own = next((name for name, path in bundled("devices").items() if path == Path(layers.path)), None)
    name, place = (own, f"devices/{own}") if own else (shown(layers.path),) * 2
    return (
        f" A file with only a device is not a scene: haploop advise {name} takes it as it is, and a scene includes it "
        f'with extends = ["{place}"].'
    )


def _form(rule: Schema) -> str:
    if "properties" in rule:
        return f"a table with {', '.join(rule.get('required', rule['properties']))}"
    if "description" in rule:
        return rule["description"].rpartition(": ")[2]
    return _TYPES.get(rule.get("type", ""), "given")


def _plain(location: tuple[str | int, ...], tagged: set[KeyPath]) -> KeyPath:
    """Returns a location of pydantic's as a key of the scene, without the kind after a table of several kinds."""
    key: KeyPath = ()
    skip = False
    for part in location:
        if skip:
            skip = False
            continue
        key = (*key, part)
        skip = tuple(0 if isinstance(p, int) else p for p in key) in tagged
    return key
