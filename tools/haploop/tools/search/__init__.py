"""Searches that ask many members at once: bisection of a boundary, and a ladder of rungs."""
