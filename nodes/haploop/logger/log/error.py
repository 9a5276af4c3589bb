"""The one error of the log file, written or read."""


class LogError(Exception):
    """The log cannot be written further, or is no log; the message says which file, why, and what to do."""
