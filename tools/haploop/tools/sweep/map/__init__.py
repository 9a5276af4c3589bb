"""The map of a sweep: its data, its lines and its drawing.

``figure`` draws it from ``data``.
"""
