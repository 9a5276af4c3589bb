"""Linear theory of a loop in contact: the one-tick map, its limit of stability, and known bounds.

``one_tick`` makes the map.
"""
