"""Parameters of which all but the first are for the slow tests."""

from __future__ import annotations

from typing import Any

import pytest


def first_and_slowly(*values: Any) -> list[Any]:
    """Parameters of a test, all but the first for the slow tests only; a tuple is several parameters."""
    rest = [value if isinstance(value, tuple) else (value,) for value in values[1:]]
    return [values[0], *(pytest.param(*value, marks=pytest.mark.slow) for value in rest)]
