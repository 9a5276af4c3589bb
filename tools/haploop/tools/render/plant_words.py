"""What the plant did with energy, and what its limits did to commands, in words; from the summary of a run."""

from __future__ import annotations

from typing import Any

# Entry of the summary, what it counts, and what to call that.
_COUNTS = (
    ("lost", "commands_dropped", "commands dropped"),
    ("lost", "commands_lost", "commands lost"),
    ("lost", "telemetry_gaps", "telemetry gaps"),
    ("actuator", "saturated_commands", "commands saturated"),
    ("accelerometer", "clipped_ticks", "readings clipped"),
)


def plant_books(energy: dict[str, Any]) -> dict[str, str]:
    """Keys of the summary's ``energy`` with their words: work of the hand, every heat, what the actuator kept back."""
    words = {"hand_work_J": "work of the hand"}
    words |= {key: f"heat in the {key.removesuffix('_heat_J')}" for key in energy if key.endswith("_heat_J")}
    words |= {"friction_heat_J": "heat of friction", "actuator_J": "kept back by the actuator's limits"}
    return {key: of_key for key, of_key in words.items() if key in energy}


def counts(summary: dict[str, Any]) -> dict[str, int]:
    """What was lost or limited, and how often, in words; what never happened is left out."""
    found = {words: summary.get(entry, {}).get(key, 0) for entry, key, words in _COUNTS}
    return {words: count for words, count in found.items() if count}
