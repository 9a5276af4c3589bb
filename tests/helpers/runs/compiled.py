"""Loops run compiled, for the tests of compiled runs; without jax these are skipped."""

from __future__ import annotations

import math
from importlib.util import find_spec
from typing import Any

import pytest

from haploop.controller.dissipation import Element
from haploop.launch.runs.in_jax import compiled_results
from haploop.protocol.scene.scene import Scene
from helpers.runs.batches import pressed
from helpers.scenes.least import KINDS

if not find_spec("jax"):
    pytest.skip("JAX is not installed", allow_module_level=True)


def compiled(scenes: list[Scene], kinds: dict[str, type[Element]] = KINDS, **options: Any) -> list[Any]:
    results = dict(compiled_results(scenes, kinds, fewest=1, least=0, most=16, **options))
    return [results[index] for index in range(len(scenes))]


def many(count: int, **tables: Any) -> list[Scene]:
    """Loops that differ only in their walls; one program serves all of this structure."""
    return [pressed(wall={"position": -0.002, "stiffness": 200.0 + i}, **tables) for i in range(count)]


def agree(found: Any, expected: Any, within: float = 1e-9) -> bool:
    """Tells whether two results agree, numbers to within a relative error or an absolute one negligible beside 1."""
    if isinstance(expected, dict):
        return found.keys() == expected.keys() and all(agree(found[key], expected[key], within) for key in expected)
    if isinstance(expected, list):
        return len(found) == len(expected) and all(map(agree, found, expected))
    if isinstance(expected, float):
        return math.isclose(found, expected, rel_tol=within, abs_tol=1e-11)
    return found == expected
