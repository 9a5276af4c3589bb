"""The log of a run as an MCAP file: written a block at a time, read back into arrays.

``writer`` writes, ``stream`` reads; ``channels`` says which columns there are; ``recording`` holds what was read.
"""


class LogError(Exception):
    """The log cannot be written further, or is not a log; the message says which file, why, and what to do."""
