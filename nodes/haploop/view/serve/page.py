"""The connection of one page: snapshots, state and events go out, its viewport and commands come in."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time as wall_clock
from typing import Any

from aiohttp import WSCloseCode, WSMsgType, web

from haploop.view.draw.snapshot import snapshot
from haploop.view.receive.runs import CommandFailed
from haploop.view.serve.guard import Guard
from haploop.view.serve.messages import VERBS, BadMessage, Command, Viewport, parse_message
from haploop.view.viewer import Viewer

# The state goes out at least so often.
_STATE_S = 0.4
# A close frame has no room for a longer reason, in bytes.
_LONGEST_REASON = 120


class Page:
    """Serves one page over its WebSocket; a slow page gets fewer snapshots, and no other page is affected."""

    def __init__(self, socket: web.WebSocketResponse, viewer: Viewer, guard: Guard) -> None:
        self._socket, self._viewer, self._guard = socket, viewer, guard
        self._viewport = Viewport()
        self._state_due = 0.0
        self._sent_state = self._sent_events = self._sent_snapshot = ()

    async def run(self) -> None:
        """Serves the page until it closes, or sends an invalid message."""
        showing = asyncio.create_task(self._send_updates())
        try:
            async for message in self._socket:
                if message.type is not WSMsgType.TEXT:
                    raise BadMessage("Messages must be text.")
                await self._take(parse_message(message.data))
        except BadMessage as error:
            reason = str(error).encode()[:_LONGEST_REASON].decode(errors="ignore").encode()
            await self._socket.close(code=WSCloseCode.POLICY_VIOLATION, message=reason)
        except ConnectionError:
            pass  # it has gone while it was being answered
        finally:
            showing.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await showing

    # In

    async def _take(self, message: Viewport | Command) -> None:
        if isinstance(message, Viewport):
            self._viewport = message
            return
        try:
            ok, text = True, await self._carry_out(message)
        except CommandFailed as error:
            ok, text = False, str(error)
        await self._send({"type": "answer", "id": message.id, "ok": ok, "text": text})

    async def _carry_out(self, command: Command) -> str:
        if not self._guard.may_steer(command.token):
            raise CommandFailed("This page only watches: open the link that haploop view printed to steer.")
        if command.verb not in VERBS:
            raise CommandFailed(f"{command.verb[:40]!r} is no command; these are: {', '.join(VERBS)}.")
        return await self._viewer.command(command.verb, command.arguments)

    # Out

    async def _send_updates(self) -> None:
        """Sends what is new after every update; a page that does not read blocks this task alone."""
        try:
            while True:
                await self._send_news()
                await self._send_snapshot()
                await self._viewer.wait_for_update()
        except ConnectionError:
            pass  # it has gone
        finally:
            await self._socket.close()

    async def _send_news(self) -> None:
        """Sends state and events when they have changed, the state anyway every 0.4 s."""
        now, viewer = wall_clock.monotonic(), self._viewer
        if (version := viewer.events_version) != self._sent_events:
            self._sent_events = version
            await self._send(viewer.events())
        if (version := viewer.state_version) != self._sent_state or now >= self._state_due:
            self._sent_state, self._state_due = version, now + _STATE_S
            await self._send(viewer.state())

    async def _send_snapshot(self) -> None:
        session = self._viewer.session
        if session is None:
            return
        showing = (session.history, session.history.version, self._viewport)
        if showing != self._sent_snapshot:
            self._sent_snapshot = showing
            await self._socket.send_bytes(snapshot(session.history, self._viewport))

    async def _send(self, message: dict[str, Any]) -> None:
        await self._socket.send_str(json.dumps(message, allow_nan=False))
