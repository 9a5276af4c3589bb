"""Fixed words for what a summary holds: books of the plant, causes of a leak, counts of what was lost or limited."""

from __future__ import annotations

from typing import Any

# Entry of the summary, the count in it, and its words.
_COUNTS = (
    ("lost", "commands_dropped", "commands dropped"),
    ("lost", "commands_lost", "commands lost"),
    ("lost", "telemetry_gaps", "telemetry gaps"),
    ("actuator", "saturated_commands", "commands saturated"),
    ("accelerometer", "clipped_ticks", "readings clipped"),
)
# The causes of a wall's leak by their keys in the summary.
LEAK_CAUSES = {"sampling_and_hold_J": "sampling and hold", "quantisation_J": "quantisation", "delay_J": "delay"}


def plant_books(energy: dict[str, Any]) -> dict[str, str]:
    """Returns the words for each key of the summary's ``energy`` that is a book of the plant: work, then every heat."""
    words = {"hand_work_J": "work of the hand"}
    words |= {key: f"heat in the {key.removesuffix('_heat_J')}" for key in energy if key.endswith("_heat_J")}
    words |= {"friction_heat_J": "heat of friction", "actuator_J": "kept back by the actuator's limits"}
    return {key: name for key, name in words.items() if key in energy}


def count_losses(summary: dict[str, Any]) -> dict[str, int]:
    """Returns what was lost or limited, and how often; what never happened is left out."""
    found = {words: summary.get(entry, {}).get(key, 0) for entry, key, words in _COUNTS}
    return {words: count for words, count in found.items() if count}
