"""Walls: the force with which a virtual wall answers a penetration and its rate, and the energy it stores.

``registry.make_wall`` makes the wall of a scene.
"""
