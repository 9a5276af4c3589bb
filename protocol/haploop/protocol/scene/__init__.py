"""The scene as a typed, frozen object: one dataclass per table, each key with unit, bounds and default.

``scene.Scene`` is the whole; ``table.Table`` converts tables to and from plain dicts, for TOML and the wire. The
tables of a scene file, its JSON Schema and its documentation are made from these declarations.
"""
