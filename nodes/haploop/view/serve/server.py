"""The page's server: its files, and the stream of what there is to see, on loopback alone."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import weakref

from aiohttp import WSCloseCode, hdrs, web
from aiohttp.typedefs import Handler, Middleware

from haploop.view.serve.assets import TYPES, assets
from haploop.view.serve.guard import Guard
from haploop.view.serve.page import Page
from haploop.view.viewer import Viewer

# What a page says is short.
_LARGEST_MESSAGE = 64 * 1024
# A page that does not answer for so long is gone.
_HEARTBEAT_S = 20.0
# So long a page is waited for that has been told to go.
_GOODBYE_S = 1.0
# So much may wait in the system for a page that is slow; then it gets fewer pictures.
_WAITING_BYTES = 256 * 1024


def app_of(viewer: Viewer, guard: Guard) -> web.Application:
    """The web application.

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
        if not guard.admits(request.match_info["key"]):
            raise web.HTTPForbidden(text="This link has been used. Open the one that haploop view printed.")
        raise web.HTTPFound(guard.link)

    async def stream(request: web.Request) -> web.StreamResponse:
        if not guard.knows_origin(request.headers.get(hdrs.ORIGIN)):
            raise web.HTTPForbidden(text="Only the page of this server may listen here.")
        page = web.WebSocketResponse(
            timeout=_GOODBYE_S,
            heartbeat=_HEARTBEAT_S,
            compress=False,
            max_msg_size=_LARGEST_MESSAGE,
            writer_limit=1,  # every picture waits until there is room for it
        )
        await page.prepare(request)
        _narrow(page)
        pages.add(page)
        await Page(page, viewer, guard).converse()
        return page

    async def protect(_: web.Request, response: web.StreamResponse) -> None:
        response.headers.update(guard.headers)

    async def close(_: web.Application) -> None:
        leaving = [page.close(code=WSCloseCode.GOING_AWAY, message=b"The viewer has ended.") for page in pages]
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(asyncio.gather(*leaving, return_exceptions=True), _GOODBYE_S)

    app = web.Application(middlewares=[_only_by_name(guard)])
    app.router.add_get("/", file)
    app.router.add_get("/static/{name}", file)
    app.router.add_get("/enter/{key}", enter)
    app.router.add_get("/stream", stream)
    app.on_response_prepare.append(protect)
    app.on_shutdown.append(close)
    return app


def _only_by_name(guard: Guard) -> Middleware:
    @web.middleware
    async def check(request: web.Request, handler: Handler) -> web.StreamResponse:
        if not guard.knows_host(request.headers.get(hdrs.HOST)):
            raise web.HTTPForbidden(text=f"This server answers at {guard.address} alone.")
        return await handler(request)

    return check


def _narrow(page: web.WebSocketResponse) -> None:
    """Let little wait on the way: what waits there is old when it arrives."""
    connection = page.get_extra_info("socket")
    if connection is not None:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _WAITING_BYTES)
