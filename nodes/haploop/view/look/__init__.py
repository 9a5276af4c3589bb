"""Measures of a history: what it shows (``sight``), its lines, its energy by cause, the two sides of a change."""
