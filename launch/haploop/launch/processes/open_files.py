"""The number of files that a process may open: ZeroMQ aborts one that can take no more connections. Light to import."""

from __future__ import annotations

# What a process of a run opens, with some to spare; and how many are asked for, since each connection takes one.
_LEAST, _MANY = 64, 65_536


def ask_for_many() -> float:
    """Lets this process, and those it starts from now on, open many files; returns how many they may."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    infinite = resource.RLIM_INFINITY
    most = _MANY if hard == infinite else min(_MANY, hard)
    if soft != infinite and soft < most:
        try:
            resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
            soft = most
        except (OSError, ValueError):  # the system allows less than it says
            pass
    return float("inf") if soft == infinite else soft


def allow_many() -> None:
    """Does what ``ask_for_many`` does; raises OutputError if they may open too few."""
    from haploop.launch.spec import OutputError

    may = ask_for_many()
    if may < _LEAST:
        raise OutputError(
            f"A process of a run opens up to {_LEAST} files, but here it may open {may}; "
            f"allow more with ulimit -n {_LEAST}."
        )
