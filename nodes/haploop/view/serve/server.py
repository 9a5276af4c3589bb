"""The page's server on loopback: its files, its stream, and the program that runs it until it is told to end."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import socket
import weakref
from collections.abc import Callable

from aiohttp import WSCloseCode, hdrs, web
from aiohttp.typedefs import Handler

from haploop.view.receive.runs import Runs
from haploop.view.serve.assets import TYPES, assets
from haploop.view.serve.connections import SILENT_S, Connections, Heard, quiet_logger
from haploop.view.serve.guard import HOST, Guard
from haploop.view.serve.page import Page
from haploop.view.viewer import Viewer

# Messages from a page are short.
_LARGEST_MESSAGE = 64 * 1024
# A page that does not answer for this long is gone.
_HEARTBEAT_S = 20.0
# How long the end waits for pages that have been told to close, and for requests under way.
_GOODBYE_S = 1.0
# A page that comes back within this time was reloaded, not closed.
_ANEW_S = 2.0
# Most data that may wait in the system for a slow page; beyond that it gets fewer pictures, but no old ones.
_WAITING_BYTES = 256 * 1024


def make_app(viewer: Viewer, guard: Guard, heard: Heard, on_closed: Callable[[], None] | None) -> web.Application:
    """Makes the web application, which records in ``heard`` the connections from which a request has come.

    Once every page that was open has been closed it calls ``on_closed``, if there is one.

    GET / is the page, /static/NAME its files, /stream a WebSocket (see :mod:`haploop.view.serve.page`), /enter/KEY
    the way in for a browser that is started with a link.
    """
    files = assets()
    pages: weakref.WeakSet[web.WebSocketResponse] = weakref.WeakSet()

    async def file(request: web.Request) -> web.StreamResponse:
        path = files.get(request.match_info.get("name", "index.html"))
        if path is None:
            raise web.HTTPNotFound
        return web.FileResponse(path, headers={hdrs.CONTENT_TYPE: f"{TYPES[path.suffix]}; charset=utf-8"})

    async def enter(request: web.Request) -> web.StreamResponse:
        if not guard.redeem(request.match_info["key"]):
            raise web.HTTPForbidden(text="This link has been used. Open the one that haploop view printed.")
        raise web.HTTPFound(guard.link)

    async def stream(request: web.Request) -> web.StreamResponse:
        if not guard.is_own_origin(request.headers.get(hdrs.ORIGIN)):
            raise web.HTTPForbidden(text="Only the page of this server may listen here.")
        page = web.WebSocketResponse(
            timeout=_GOODBYE_S,
            heartbeat=_HEARTBEAT_S,
            compress=False,
            max_msg_size=_LARGEST_MESSAGE,
            writer_limit=1,  # every picture waits until there is room for it
        )
        await page.prepare(request)
        if connection := page.get_extra_info("socket"):
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _WAITING_BYTES)
        pages.add(page)
        try:
            await Page(page, viewer, guard).run()
        finally:
            pages.discard(page)
        if on_closed and not pages:
            await asyncio.sleep(_ANEW_S)
            if not pages:
                on_closed()
        return page

    @web.middleware
    async def only_by_name(request: web.Request, handler: Handler) -> web.StreamResponse:
        heard.add(request.protocol)
        if not guard.is_own_host(request.headers.get(hdrs.HOST)):
            raise web.HTTPForbidden(text=f"This server answers only at {guard.address}.")
        return await handler(request)

    async def protect(_: web.Request, response: web.StreamResponse) -> None:
        response.headers.update(guard.headers)

    async def close(_: web.Application) -> None:
        leaving = [page.close(code=WSCloseCode.GOING_AWAY, message=b"The viewer has ended.") for page in pages]
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(asyncio.gather(*leaving, return_exceptions=True), _GOODBYE_S)

    app = web.Application(middlewares=[only_by_name])
    app.router.add_get("/", file)
    app.router.add_get("/static/{name:.+}", file)
    app.router.add_get("/enter/{key}", enter)
    app.router.add_get("/stream", stream)
    app.on_response_prepare.append(protect)
    app.on_shutdown.append(close)
    return app


class PortTaken(OSError):
    """Raised where the port cannot be used; the message says what to do."""


def listen(port: int) -> socket.socket:
    """Opens a socket that listens on loopback, at any free port for 0; raises PortTaken if it cannot be used."""
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
    on_serving: Callable[[Guard], object],
    end: asyncio.Event,
    first: str | None = None,
    from_start: bool = True,
    stays: bool = False,
    until_closed: bool = False,
) -> None:
    """Serves the page until SIGINT, SIGTERM or ``end``, or until every page that was open has been closed.

    Runs, first, from_start and stays are those of :class:`Viewer`.
    """
    guard = Guard(listening.getsockname()[1])
    viewer = Viewer(runs, first, from_start, stays)
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError, RuntimeError, ValueError):  # not in the main thread
            loop.add_signal_handler(number, end.set)
    heard = Heard()
    app = make_app(viewer, guard, heard, end.set if until_closed else None)
    quiet = {"access_log": None, "logger": quiet_logger()}
    runner = web.AppRunner(app, **quiet, keepalive_timeout=SILENT_S, shutdown_timeout=_GOODBYE_S)
    await runner.setup()
    assert runner.server
    connections = Connections(runner.server, heard)
    following, ending = asyncio.create_task(viewer.follow_runs()), asyncio.create_task(end.wait())
    closing = asyncio.create_task(connections.close_silent())
    server = await loop.create_server(connections.open, sock=listening)
    try:
        on_serving(guard)
        await asyncio.wait((following, ending), return_when=asyncio.FIRST_COMPLETED)
        if following.done():
            following.result()
    finally:
        server.close()
        for task in (following, ending, closing):
            task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await following
        await runner.cleanup()
