"""The error of a run that could not go on."""


class RunFailed(Exception):
    """A run that could not go on; the message names the node and the last common tick."""
