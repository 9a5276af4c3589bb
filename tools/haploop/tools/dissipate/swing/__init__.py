"""Swings of a recorded motion: whether it buzzes, and what feeds it.

``finder`` looks for them.
"""
