"""The log of a run as an MCAP file: written a block at a time, read back into arrays.

``writer`` writes, ``reader`` and ``stream`` read; ``channels`` says which columns there are.
"""
