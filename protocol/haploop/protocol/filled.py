"""Numbers in a sentence, as people write them: 1230 Hz, not 1.23e+03 Hz."""

from __future__ import annotations

import string
from typing import Any

# A larger number keeps its power of ten: nobody counts so many digits.
_MOST = 1e6


class _Formatter(string.Formatter):
    def format_field(self, value: Any, format_spec: str) -> str:
        text = super().format_field(value, format_spec)
        return f"{value:.0f}" if "e+" in text and isinstance(value, float) and abs(value) < _MOST else text


def filled(sentence: str, *values: Any, **named: Any) -> str:
    """Returns a sentence with values in it, as ``str.format``, but whole digits of numbers below a million."""
    return _Formatter().format(sentence, *values, **named)
