"""One colour for each kind of element, on every figure."""

from __future__ import annotations

from haploop.tools.figure.style import ELEMENTS, FAINT, WALL

COLOURS = {
    "nothing": FAINT,
    "spring": WALL,
    "damping": ELEMENTS[0],
    "bidirectional-inertia": ELEMENTS[1],
    "unidirectional-inertia": ELEMENTS[2],
    "both": ELEMENTS[3],
}
SHORT = {
    "nothing": "nothing",
    "damping": "damping",
    "bidirectional-inertia": "bidirectional",
    "unidirectional-inertia": "unidirectional",
    "both": "damping and unidirectional",
}
