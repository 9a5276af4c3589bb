"""Nodes that join a running simulation: a second logger, a live table, and a source for PlotJuggler.

``observed_run`` is what they join.
"""
