"""The connection of one page: snapshots, state and events go out, its viewport and commands come in.

At most four snapshots are on their way to a page that has not yet reported drawing them: a slow or hidden page costs
nothing, and one whose answers take as long as four pictures, as beside a run that uses every core, still gets each.
What stands beside the charts over time comes with one snapshot in four, and with the last: nobody reads it more often.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import time as wall_clock
from dataclasses import dataclass

from aiohttp import WSCloseCode, WSMsgType, web

from haploop.protocol.transport.wire import Message
from haploop.view.draw.messages import WAITING, event_lines, state
from haploop.view.draw.panels import PANELS
from haploop.view.draw.snapshot import Viewport
from haploop.view.receive.runs import CommandFailed
from haploop.view.serve.guard import Guard
from haploop.view.viewer import Viewer

# The state goes out at least this often.
_STATE_S = 0.4
# A close frame has no room for a longer reason, in bytes.
_LONGEST_REASON = 120
_FEWEST_POINTS, _MOST_POINTS = 50, 8000
_LONGEST_S = 1e9
# What stands beside the charts over time comes with one snapshot in this many: it is read more than watched.
_BESIDE_EVERY = 4
# Most snapshots that go out before the page has drawn them.
_MOST_UNDRAWN = 4
# Commands that a page may send; the clock answers more.
_VERBS = ("pause", "resume", "step", "stop", "swap", "set", "undo", "pace", "open", "overlay")
# Those of them that change what is shown, and nothing in a run.
_OF_VIEWER = ("open", "overlay")


class Page:
    """Serves one page over its WebSocket; a slow page gets fewer snapshots, and no other page is affected."""

    def __init__(self, socket: web.WebSocketResponse, viewer: Viewer, guard: Guard) -> None:
        self._socket, self._viewer, self._guard = socket, viewer, guard
        self._viewport = Viewport()
        self._state_due = 0.0
        self._sent_state: tuple[object, ...] | None = ()
        self._sent_events: tuple[object, ...] | None = ()
        self._sent_snapshot: tuple[object, ...] = ()
        self._until_beside = 0
        self._undrawn = 0
        self._sent_listing: Message = {}

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
            pass  # the page has gone while it was being answered
        finally:
            showing.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await showing

    async def _take(self, message: Viewport | Command | Drawn) -> None:
        if isinstance(message, Drawn):
            was_full, self._undrawn = self._undrawn >= _MOST_UNDRAWN, max(0, self._undrawn - message.snapshots)
            if was_full:
                await self._send_snapshot(only_new=True)
            return
        if isinstance(message, Viewport):
            self._viewport, self._until_beside = message, 0
            return
        try:
            ok, text = True, await self._carry_out(message)
        except CommandFailed as error:
            ok, text = False, str(error)
        await self._send({"type": "answer", "id": message.id, "ok": ok, "text": text})

    async def _carry_out(self, command: Command) -> str:
        if not self._guard.may_steer(command.token):
            raise CommandFailed("This page only watches: open the link that haploop view printed to steer.")
        if command.verb not in _VERBS:
            raise CommandFailed(f"{command.verb[:40]!r} is not a command; the commands are: {', '.join(_VERBS)}.")
        if command.verb in _OF_VIEWER:
            run_id = command.arguments.get("run")
            if not isinstance(run_id, str):
                raise CommandFailed(f"{command.verb} needs the id of a run as text.")
            return await (self._viewer.open if command.verb == "open" else self._viewer.lay_over)(run_id)
        session = self._viewer.session
        if session is None:
            raise CommandFailed("No run is live; start one with haploop run SCENE.")
        if session.outcome:
            raise CommandFailed(f"Run {session.run.id} is over; nothing in it can be changed any more.")
        return await session.clock.command(command.verb, command.arguments)

    async def _send_updates(self) -> None:
        """Sends what is new after every update; a page that does not read blocks only this task."""
        try:
            while True:
                await self._send_news()
                await self._send_snapshot()
                await self._viewer.wait_for_update()
        except ConnectionError:
            pass  # the page has gone
        finally:
            await self._socket.close()

    async def _send_news(self) -> None:
        """Sends state and events when they have changed, the state in any case every 0.4 s."""
        now, session = wall_clock.monotonic(), self._viewer.session
        known = session and (session, len(session.events), session.clock.options is None)
        if known != self._sent_events:
            self._sent_events = known
            lines = event_lines(session.events, session.time.control_rate, session.clock.units) if session else []
            await self._send({"type": "events", "events": lines})
        version = session and (session, session.version)
        if version != self._sent_state or now >= self._state_due:
            self._sent_state, self._state_due = version, now + _STATE_S
            await self._send(state(session) if session else WAITING | {"why": self._viewer.why})
            if (listing := self._viewer.listing()) != self._sent_listing:
                self._sent_listing = listing
                await self._send(listing)

    async def _send_snapshot(self, only_new: bool = False) -> None:
        """Sends what is shown now if it is new; else, unless ``only_new``, completes the last, once, if it came without
        what stands beside the charts."""
        if self._undrawn >= _MOST_UNDRAWN:
            return
        made = self._viewer.snapshot(self._viewport, beside := self._until_beside == 0)
        if made and made[0] == self._sent_snapshot:
            if only_new or self._until_beside == _BESIDE_EVERY - 1:
                return
            made, beside = self._viewer.snapshot(self._viewport, True), True  # the last picture is complete
        if made:
            self._sent_snapshot, self._undrawn = made[0], self._undrawn + 1
            self._until_beside = (_BESIDE_EVERY if beside else self._until_beside) - 1
            await self._socket.send_bytes(made[1])

    async def _send(self, message: Message) -> None:
        await self._socket.send_str(json.dumps(message, allow_nan=False))


class BadMessage(ValueError):
    """Raised where a page sent an invalid message; the text says what was expected."""


@dataclass(frozen=True)
class Command:
    """A command of a page: number of the message, token, verb and arguments."""

    id: int
    token: str
    verb: str
    arguments: Message


@dataclass(frozen=True)
class Drawn:
    """What a page says of the snapshots that it has drawn since it said so last: how many."""

    snapshots: int


def parse_message(text: str) -> Viewport | Command | Drawn:
    """Returns what a text says: ``watch`` as a viewport, ``command`` as a command, ``drawn`` as a number of snapshots.

    Raises:
        BadMessage: the text says anything else.
    """
    try:
        message = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadMessage(f"A message must be JSON: {error}.") from error
    match message:
        case {"type": "watch"}:
            return _watch(message)
        case {"type": "drawn", "snapshots": int(snapshots)} if 0 < snapshots <= _MOST_UNDRAWN:
            return Drawn(snapshots)
        case {"type": "command", "id": int(number), "verb": str(verb)}:
            token, arguments = message.get("token"), message.get("arguments", {})
            if isinstance(arguments, dict):
                return Command(number, token if isinstance(token, str) else "", verb, arguments)
    if isinstance(message, dict) and message.get("type") == "command":
        raise BadMessage("A command must have a whole number as id, a verb, and a table of arguments.")
    if isinstance(message, dict) and message.get("type") == "drawn":
        raise BadMessage(f"drawn.snapshots must be a whole number from 1 to {_MOST_UNDRAWN}.")
    raise BadMessage("A message must be a JSON object whose type is watch, drawn or command.")


def _watch(message: Message) -> Viewport:
    span_s, end_s = (_seconds(message.get(key), key) for key in ("span_s", "end_s"))
    points = message.get("points", Viewport.points)
    if span_s is not None and span_s <= 0.0:
        raise BadMessage("watch.span_s must be above 0, or null.")
    if isinstance(points, bool) or not isinstance(points, int | float) or not math.isfinite(points):
        raise BadMessage("watch.points must be a number.")
    panel = message.get("panel", Viewport.panel)
    if panel not in PANELS:
        raise BadMessage(f"watch.panel must be one of {', '.join(PANELS)}.")
    return Viewport(
        span_s, int(min(max(points, _FEWEST_POINTS), _MOST_POINTS)), end_s, panel, message.get("sound") is True
    )


def _seconds(value: object, key: str) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= _LONGEST_S:
        raise BadMessage(f"watch.{key} must be a number of seconds from 0 to {_LONGEST_S:g}, or null.")
    return float(value)
