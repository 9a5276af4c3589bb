"""One page in a browser: what it watches goes out to it, what it asks for comes in."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time as wall_clock
from typing import Any

from aiohttp import WSCloseCode, WSMsgType, web

from haploop.view.draw.snapshot import picture
from haploop.view.receive.runs import CommandFailed
from haploop.view.serve.guard import Guard
from haploop.view.serve.watch import VERBS, BadMessage, Command, Watch, message_of
from haploop.view.viewer import Viewer

# The state goes out at least so often.
_STATE_S = 0.4
# A close frame has no room for a longer reason, in bytes.
_LONGEST_REASON = 120


class Page:
    """The conversation with one page; it sees fewer pictures when it is slow, and nobody else notices."""

    def __init__(self, socket: web.WebSocketResponse, viewer: Viewer, guard: Guard) -> None:
        self._socket, self._viewer, self._guard = socket, viewer, guard
        self._watch = Watch()
        self._state_due = 0.0
        self._state_said = self._events_said = self._shown = ()

    async def converse(self) -> None:
        """Until the page closes, or says something that makes no sense."""
        showing = asyncio.create_task(self._show())
        try:
            async for message in self._socket:
                if message.type is not WSMsgType.TEXT:
                    raise BadMessage("Messages must be text.")
                await self._take(message_of(message.data))
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

    async def _take(self, message: Watch | Command) -> None:
        if isinstance(message, Watch):
            self._watch = message
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

    async def _show(self) -> None:
        """Send what is new, turn after turn; a page that cannot take it holds up this loop alone."""
        try:
            while True:
                await self._tell()
                await self._draw()
                await self._viewer.next_turn()
        except ConnectionError:
            pass  # it has gone
        finally:
            await self._socket.close()

    async def _tell(self) -> None:
        """State and events when they have changed, the state anyway now and then."""
        now, viewer = wall_clock.monotonic(), self._viewer
        if (signs := viewer.signs_of_events) != self._events_said:
            self._events_said = signs
            await self._send(viewer.events())
        if (signs := viewer.signs_of_state) != self._state_said or now >= self._state_due:
            self._state_said, self._state_due = signs, now + _STATE_S
            await self._send(viewer.state())

    async def _draw(self) -> None:
        followed = self._viewer.followed
        if followed is None:
            return
        showing = (followed.history, followed.history.version, self._watch)
        if showing != self._shown:
            self._shown = showing
            await self._socket.send_bytes(picture(followed.history, self._watch))

    async def _send(self, message: dict[str, Any]) -> None:
        await self._socket.send_str(json.dumps(message, allow_nan=False))
