"""Bounded memory of a run: series at several levels of detail.

``history`` holds it.
"""
