"""Logs in the formats of other programs."""
