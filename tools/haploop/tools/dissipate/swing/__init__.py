"""Swings of a recorded motion: whether it buzzes, and what feeds it."""
