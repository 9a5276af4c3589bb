"""Walls: what a virtual wall answers to a penetration and its rate, and what it holds.

``registry.make_wall`` is the way in.
"""
