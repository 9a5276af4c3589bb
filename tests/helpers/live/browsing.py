"""A server of the live page, and the part of a page in a browser."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from functools import wraps
from typing import Any

import aiohttp
import numpy as np

from haploop.tools.cli.live_runs import LiveRuns
from haploop.view.receive.runs import CommandFailed, Runs
from haploop.view.serve.guard import Guard
from haploop.view.serve.server import listen, serve
from helpers.live.waiting import PATIENCE_S


def to_its_end(work: Coroutine[Any, Any, Any]) -> Any:
    """Runs a coroutine to its end on a separate thread: a browser of other tests may keep an event loop on this one."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, work).result()


class NoRuns:
    """A place where nothing runs; it records what it was asked."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, Any]] = []

    def live(self) -> list[Any]:
        return []

    def stiffness_limit(self, scene: Any) -> None:
        return None

    def past(self) -> list[Any]:
        return []

    def record_of(self, run: Any) -> None:
        return None

    def has_launcher(self, run: Any) -> bool:
        return False

    def ask(self, run: Any, verb: str, arguments: Any) -> Any:
        self.asked.append((verb, arguments))
        raise CommandFailed("Nothing runs here.")


def scenario(play: Callable[..., Coroutine[Any, Any, Any]]) -> Callable[..., None]:
    """A test whose body is a coroutine."""

    @wraps(play)
    def test(*args: Any, **kwargs: Any) -> None:
        to_its_end(play(*args, **kwargs))

    return test


def decode(data: bytes) -> dict[str, Any]:
    """A snapshot: its header, every table with its columns by name as ``values``."""
    length = int.from_bytes(data[:4], "little")
    assert (4 + length) % 8 == 0
    snapshot = json.loads(data[4 : 4 + length])
    at, tables = 4 + length, {}
    for table in snapshot["tables"]:
        size = table["rows"] * len(table["columns"])
        rows = np.frombuffer(data, "<f4", size, at).reshape(len(table["columns"]), table["rows"])
        names = [column["name"] for column in table["columns"]]
        tables[table["name"]] = {**table, "values": dict(zip(names, rows, strict=True))}
        at += -(-4 * size // 8) * 8
    assert at == len(data)
    return {**snapshot, "tables": tables}


class Tab:
    """A page that is connected.

    Attributes:
        state, events: as last received; None before.
        snapshot: the last one, decoded; None before. ``is_whole``: with the data beside the charts.
        snapshots: how many have been received.
        closed: (code, reason) once the server has closed.
    """

    def __init__(self, socket: aiohttp.ClientWebSocketResponse, token: str) -> None:
        self.socket, self.token = socket, token
        self.state: Any = None
        self.events: Any = None
        self.snapshot: Any = None
        self.snapshots, self.is_whole = 0, False
        self.closed: tuple[int | None, str] | None = None
        self._answers: dict[int, dict[str, Any]] = {}
        self._asked = 0
        self.reading = asyncio.create_task(self._read())

    async def _read(self) -> None:
        reason = ""
        async for message in self.socket:
            if message.type is aiohttp.WSMsgType.BINARY:
                self._take(decode(message.data))
                with suppress(ConnectionError):
                    await self.socket.send_json({"type": "drawn", "snapshots": 1})
                continue
            told = json.loads(message.data)
            if told["type"] == "answer":
                self._answers[told["id"]] = told
            elif told["type"] == "events":
                self.events = told["events"]
            elif told["type"] == "state":
                self.state = told
        self.closed = self.socket.close_code, reason

    def _take(self, now: dict[str, Any]) -> None:
        """Keeps the earlier data beside the charts where this snapshot comes without any."""
        self.is_whole = now["beside"]
        if not self.is_whole:
            now = {**self.snapshot, **now, "tables": {**self.snapshot["tables"], **now["tables"]}}
        self.snapshot, self.snapshots = now, self.snapshots + 1

    async def until(self, what: str, look: Callable[[], Any]) -> Any:
        """The first true result of ``look``."""
        give_up = asyncio.get_running_loop().time() + PATIENCE_S
        while not (found := look()):
            assert asyncio.get_running_loop().time() < give_up, f"{what} has not come; the state is {self.state}"
            await asyncio.sleep(0.01)
        return found

    async def phase(self, phase: str) -> dict[str, Any]:
        """Waits for a phase; returns the state."""
        return await self.until(
            f"phase {phase}", lambda: self.state if (self.state or {}).get("phase") == phase else None
        )

    async def watch(self, **what: Any) -> dict[str, Any]:
        """Watches something; returns the first snapshot that shows it."""
        await self.socket.send_json({"type": "watch", **what})
        seen, span_s, end_s = self.snapshots, what.get("span_s"), what.get("end_s")

        def shows() -> bool:
            if self.snapshots == seen or not self.is_whole:
                return False
            from_s, to_s = self.snapshot["from_s"], self.snapshot["to_s"]
            return (span_s is None or abs(to_s - from_s - span_s) < 1e-9) and (
                end_s is None or abs(to_s - end_s) < 1e-9
            )

        await self.until("the snapshot asked for", shows)
        return self.snapshot

    async def ask(self, verb: str, **arguments: Any) -> tuple[bool, str]:
        """Sends a command; returns whether it was done, and the answer."""
        return await self.send(verb, arguments, self.token)

    async def send(self, verb: str, arguments: dict[str, Any], token: str) -> tuple[bool, str]:
        """Sends a command with some token."""
        self._asked += 1
        number = self._asked
        await self.socket.send_json(
            {"type": "command", "id": number, "token": token, "verb": verb, "arguments": arguments}
        )
        answer = await self.until("an answer", lambda: self._answers.get(number))
        return answer["ok"], answer["text"]


class Site:
    """A server and a browser's access to it."""

    def __init__(self, guard: Guard, session: aiohttp.ClientSession) -> None:
        self.guard, self.session = guard, session
        self._streams: list[aiohttp.ClientWebSocketResponse] = []

    @property
    def address(self) -> str:
        return self.guard.address.rstrip("/")

    async def stream(self, **headers: str) -> aiohttp.ClientWebSocketResponse:
        """Opens the page's stream."""
        self._streams.append(await stream(self.session, self.address, **headers))
        return self._streams[-1]

    async def tab(self, **headers: str) -> Tab:
        """A page with its stream open."""
        return Tab(await self.stream(**headers), self.guard.token)

    def close(self) -> None:
        """Closes everything that is still open."""
        for stream in self._streams:
            stream._response.close()


def stream(session: aiohttp.ClientSession, address: str, **headers: str) -> Any:
    """The stream of the page at an address, to be awaited or entered."""
    return session.ws_connect(f"{address}/stream", headers={"Origin": address, **headers}, max_msg_size=0)


@asynccontextmanager
async def site(runs: Runs | None = None, **options: Any) -> AsyncIterator[Site]:
    """A server on a free port, and a session of a browser."""
    ready: asyncio.Future[Guard] = asyncio.get_running_loop().create_future()
    end = asyncio.Event()
    server = asyncio.create_task(serve(runs or LiveRuns(), listen(0), on_serving=ready.set_result, end=end, **options))
    await asyncio.wait((ready, server), return_when=asyncio.FIRST_COMPLETED)
    assert ready.done(), server.result()
    async with aiohttp.ClientSession() as session:
        here = Site(ready.result(), session)
        try:
            yield here
        finally:
            end.set()
            await asyncio.wait_for(server, PATIENCE_S)
            here.close()


async def status(site: Site, path: str, **headers: str) -> int:
    """The HTTP status of the answer to a request."""
    async with site.session.get(f"{site.address}{path}", headers=headers, allow_redirects=False) as answer:
        return answer.status
