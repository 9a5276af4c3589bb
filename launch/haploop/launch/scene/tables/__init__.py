"""The tables of a scene, each key with unit, bounds and default."""
