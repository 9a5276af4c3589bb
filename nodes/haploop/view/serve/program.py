"""The viewer as a program: one loop that follows runs and serves the page until it is told to end."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import socket
from collections.abc import Callable

from aiohttp import web

from haploop.view.receive.runs import Runs
from haploop.view.serve.guard import HOST, Guard
from haploop.view.serve.server import app_of
from haploop.view.viewer import Viewer

# How long requests under way are waited for at the end.
_END_S = 1.0


class PortTaken(OSError):
    """Another program listens there; the message says where, and what to do."""


def listen(port: int) -> socket.socket:
    """A socket that listens on loopback, at any free port for 0.

    Raises:
        PortTaken: the port cannot be had.
    """
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((HOST, port))
        listening.listen()
    except OSError as error:
        listening.close()
        raise PortTaken(
            f"Port {port} of {HOST} cannot be used ({error.strerror}); name another with --port, or 0 for any free one."
        ) from error
    return listening


async def serve(
    runs: Runs,
    listening: socket.socket,
    *,
    first: str | None = None,
    from_start: bool = True,
    serving: Callable[[Guard], object] = lambda guard: None,
    end: asyncio.Event | None = None,
) -> None:
    """Serve the page until SIGINT, SIGTERM or ``end``.

    Args:
        runs: where runs are found and asked.
        listening: from :func:`listen`.
        first: id of the run to follow first; the newest when None.
        from_start: whether the page shows what was logged before this viewer joined.
        serving: called once the page can be opened.
        end: set from outside to end.
    """
    guard = Guard(listening.getsockname()[1])
    viewer = Viewer(runs, first, from_start)
    end = end or asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):  # not in the main thread
            loop.add_signal_handler(number, end.set)
    runner = web.AppRunner(app_of(viewer, guard), access_log=None, shutdown_timeout=_END_S)
    await runner.setup()
    following, ending = asyncio.create_task(viewer.follow()), asyncio.create_task(end.wait())
    try:
        await web.SockSite(runner, listening).start()
        serving(guard)
        await asyncio.wait((following, ending), return_when=asyncio.FIRST_COMPLETED)
        if following.done():
            following.result()
    finally:
        for task in (following, ending):
            task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await following
        await runner.cleanup()
