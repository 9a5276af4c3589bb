"""The connections of the page's server: silent ones are closed, and noise is not logged."""

from __future__ import annotations

import asyncio
import logging

from aiohttp import web
from aiohttp.http_exceptions import HttpProcessingError

# A connection that has requested nothing is closed after this time; if there are this many of them, the oldest at once.
SILENT_S, MOST_SILENT = 10.0, 100
_LOOK_S = 1.0


Heard = set[web.RequestHandler]


class Connections:
    """Opens connections for a server, and closes those from which no request has come; ``heard`` has the others."""

    def __init__(self, server: web.Server, heard: Heard) -> None:
        self._server, self._heard = server, heard
        self._since: dict[web.RequestHandler, float] = {}

    def open(self) -> web.RequestHandler:
        """Makes the protocol of a new connection."""
        if len(self._server.connections) > MOST_SILENT:
            self._close(self._silent()[:-MOST_SILENT])
        return self._server()

    def _silent(self) -> list[web.RequestHandler]:
        return [one for one in self._server.connections if one not in self._heard]

    def _close(self, silent: list[web.RequestHandler]) -> None:
        for one in silent:
            if one.transport:
                one.transport.abort()

    async def close_silent(self) -> None:
        """Closes connections that have been silent for ``SILENT_S``, until it is cancelled."""
        while True:
            self._heard.intersection_update(self._server.connections)
            now = asyncio.get_running_loop().time()
            self._since = {one: self._since.get(one, now) for one in self._silent()}
            self._close([one for one, since in self._since.items() if now - since >= SILENT_S])
            await asyncio.sleep(_LOOK_S)


def quiet_logger() -> logging.Logger:
    """Returns a logger of what fails in this server, but not of what is not HTTP; that is answered with 400."""
    logger = logging.getLogger(__name__)
    logger.addFilter(_is_own_failure)
    return logger


def _is_own_failure(record: logging.LogRecord) -> bool:
    return not (record.exc_info and isinstance(record.exc_info[1], HttpProcessingError))
