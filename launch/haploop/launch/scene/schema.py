"""The JSON Schema of a scene file, for editors and for saying what a key may be."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from typing import TYPE_CHECKING, Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from haploop.launch.scene.models import model_of, scene_model
from haploop.launch.scene.reading.shorthand import CountedRange
from haploop.protocol.installed import cached_until_brought

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

Schema = JsonSchemaValue


class TomlSchema(GenerateJsonSchema):
    """TOML has no null, and a key left out may come from the scene that this one extends."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> Schema:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> Schema:
        if schema.get("default", ...) is None:
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)

    def tagged_union_schema(self, schema: core_schema.TaggedUnionSchema) -> Schema:
        return {"anyOf": [self.generate_inner(choice) for choice in schema["choices"].values()]}  # pyright: ignore[reportArgumentType]


def json_schema(kinds: Mapping[str, type[Element]]) -> Schema:
    """Returns the JSON Schema (draft 2020-12) of a scene file, with the parameters of every kind of element.

    A file that extends another may leave out what the other gives, so keys are required only in arrays of tables,
    which are replaced whole.
    """
    schema = deepcopy(whole_schema(kinds))
    whole = {"Event", "none", *kinds}
    for name, table in [("Scene", schema), *schema["$defs"].items()]:
        if name not in whole:
            table.pop("required", None)
    path = {"type": "string", "description": "a scene file whose keys this one overrides"}
    schema["properties"]["extends"] = {"anyOf": [path, {"type": "array", "items": path}]}
    schema["anyOf"] = [{"required": ["extends"]}, {"required": ["duration", "device"]}]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def whole_schema(kinds: Mapping[str, type[Element]]) -> Schema:
    """Returns the JSON Schema of a scene after everything it extends has been merged into it; not to be changed."""
    return _whole_schema(tuple(kinds.items()))


@cached_until_brought
def _whole_schema(kinds: tuple[tuple[str, type[Element]], ...]) -> Schema:
    schema = scene_model(dict(kinds)).model_json_schema(schema_generator=TomlSchema)
    about = "a text file of time and force, in s and N or in the units of its header, in place of time and force"
    trace = schema["$defs"]["Trace"]["properties"]
    trace["file"] = {"type": "string", "description": about}
    for name in ("time", "force"):
        about = f"the column of the file that holds the {name}, by its name or its number from 1"
        trace[f"{name}_column"] = {"type": ["string", "integer"], "description": about}
    counted = model_of(CountedRange).model_json_schema(schema_generator=TomlSchema)
    schema["$defs"]["Encoder"]["properties"] |= counted["properties"]
    return schema


def schema_at(schema: Schema, path: tuple[str | int, ...], data: Any) -> Schema:
    """Returns the part of ``schema`` that governs the value at ``path`` of ``data``; empty if nothing does."""
    node = _chosen(schema, schema, data)
    for key in path:
        inner = node.get("items", {}) if isinstance(key, int) else node.get("properties", {}).get(key, {})
        try:
            data = data[key]
        except (KeyError, IndexError, TypeError):
            data = None
        node = _chosen(schema, inner, data)
    return node


def alternatives(schema: Schema, rule: Schema) -> list[str]:
    """Returns the names that may stand where ``rule`` applies: the values of a choice, or the kinds of a table."""
    if "anyOf" in rule:
        return [_chosen(schema, choice, None)["properties"]["kind"]["const"] for choice in rule["anyOf"]]
    names = rule.get("enum", [rule.get("const")])
    return [name if isinstance(name, str) else str(name).lower() for name in names]


def keys_of_all(schema: Schema, rule: Schema) -> list[str]:
    """Returns the keys that a table of any kind may have where ``rule`` applies, each once."""
    tables = [_chosen(schema, choice, None) for choice in rule.get("anyOf", ())]
    return list(dict.fromkeys(key for table in tables for key in table.get("properties", ())))


def _chosen(schema: Schema, node: Schema, data: Any) -> Schema:
    """Follows a reference; of alternatives takes the one whose kind ``data`` names."""
    if "$ref" in node:
        return _chosen(schema, schema["$defs"][_name(node)], data)
    for choice in node.get("anyOf", []):
        table = _chosen(schema, choice, data)
        if isinstance(data, dict) and table.get("properties", {}).get("kind", {}).get("const") == data.get("kind"):
            return table
    return node


def _name(reference: Schema) -> str:
    return reference["$ref"].rpartition("/")[2]
