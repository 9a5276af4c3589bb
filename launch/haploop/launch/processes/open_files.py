"""The number of files that a process may open: ZeroMQ aborts one to which nobody more can connect."""

from __future__ import annotations

from haploop.launch.spec import OutputError

# What a process of a run opens, with some to spare; and how many are asked for, since everybody who connects takes one.
_LEAST, _MANY = 64, 65_536


def allow_many() -> None:
    """Lets this process, and those it starts, open many files; raises OutputError where they may open too few."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    infinite = resource.RLIM_INFINITY
    most = _MANY if hard == infinite else min(_MANY, hard)
    if soft != infinite and soft < most:
        try:
            resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
            soft = most
        except (OSError, ValueError):  # what the system allows less of than it says
            pass
    if soft != infinite and soft < _LEAST:
        raise OutputError(
            f"A process of a run opens up to {_LEAST} files, but here it may open {soft}; "
            f"allow more with ulimit -n {_LEAST}."
        )
