"""Searches: bisection of a boundary and a ladder of rungs, for many members at once, and random search of a space."""
