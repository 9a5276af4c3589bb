"""haploop view as the page sees it, without a run: serves the page, sends what a test wants, records its replies."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from aiohttp import WSMsgType, web

from helpers.live.browser import free_port
from helpers.live.waiting import PATIENCE_S, wait_for

STATIC = Path(__file__).parents[3] / "nodes/haploop/view/serve/static"
TOKEN = "a-token"
HEADERS = {"Content-Security-Policy": "default-src 'self'", "Cache-Control": "no-store"}
QUANTITY = {"at_least": None, "above": None, "at_most": None, "below": None}
NEWTONS_PER_METRE = {**QUANTITY, "unit": "N/m", "above": 0.0}
KILOGRAMS = {**QUANTITY, "unit": "kg", "above": 0.0}
DAMPING = {**QUANTITY, "unit": "N s/m", "at_least": 0.0}
OPTIONS = {
    "settable": {
        "wall.stiffness": {**NEWTONS_PER_METRE, "value": 150.0},
        "wall.position": {**QUANTITY, "unit": "m", "value": -0.06},
        "clock.round_trip_delay": {**QUANTITY, "unit": "s", "at_least": 0.0, "value": 0.002},
        "dissipation.0.damping": {**DAMPING, "value": 0.4},
        "dissipation.1.mass": {**KILOGRAMS, "value": 0.01},
    },
    "kinds": {
        "damping": {"about": "A force against the velocity.", "parameters": {"damping": {**DAMPING, "default": None}}},
        "unidirectional-inertia": {
            "about": "Virtual inertia that only ever takes energy out (Choi et al. 2022, eq. 9).",
            "parameters": {"mass": {**KILOGRAMS, "default": 0.01}},
        },
    },
    "elements": [
        {"kind": "damping", "acts": "in-contact", "damping": 0.4},
        {"kind": "unidirectional-inertia", "acts": "in-contact", "mass": 0.01},
    ],
}
RUNNING = {
    "type": "state", "phase": "running", "why": "", "run": "abc123", "out": "runs/fig6c",
    "title": "Fig. 6(c): a 0.15 N/mm wall with unidirectional inertia",
    "tick": 1500, "end_tick": 3000, "control_rate": 1000, "plant_rate": 10000, "pace": 1.0, "real_time_factor": 0.98,
    "verdict": "limit-cycle", "verdict_is": "seen",
    "sight": {
        "word": "swinging", "why": "In the last 0.5 s the position crossed its trend line 24 times.", "from_s": 1.0,
        "to_s": 1.5, "so_far": False, "oscillation_m": 0.00535, "ripple_N": 0.41, "force_swing_N": 0.41,
        "frequency_Hz": 8.25, "stiffness_N_m": 137.2,
    },
    "verdict_rule": "From 1.5 s on x crossed its trend line 24 times.",
    "oscillation_m": 0.00535, "displayed_stiffness_N_m": 137.2, "residual_J": 2.1e-18, "moved_J": 6.2e-3,
    "nodes": [
        {"role": "plant", "pid": 11, "tick": 1500, "behind_ticks": 0, "waits_for": "controller", "lossless": True,
         "skipped_ticks": 0},
        {"role": "controller", "pid": 12, "tick": 1499, "behind_ticks": 1, "waits_for": "", "lossless": True,
         "skipped_ticks": 0},
        {"role": "logger", "pid": 13, "tick": 1480, "behind_ticks": 20, "waits_for": "", "lossless": True,
         "skipped_ticks": 0},
        {"role": "view", "pid": 14, "tick": 1460, "behind_ticks": 40, "waits_for": "", "lossless": False,
         "skipped_ticks": 12},
    ],
    "skipped_ticks": 12, "first_s": 0.0, "options": OPTIONS, "elements": OPTIONS["elements"],
    "wall": {"position": -0.06, "stiffness": 150.0, "into_wall": -1.0}, "delay_s": 0.002, "summary": None,
}  # fmt: skip
WAITING: dict[str, Any] = {
    "type": "state", "phase": "waiting", "why": "", "run": None, "title": None, "out": None, "tick": None,
    "end_tick": None, "control_rate": None, "plant_rate": None, "pace": None, "real_time_factor": None,
    "verdict": None, "verdict_rule": None, "oscillation_m": None, "displayed_stiffness_N_m": None, "residual_J": None,
    "moved_J": None, "nodes": [], "skipped_ticks": 0, "first_s": None, "options": None, "elements": [], "wall": None,
    "delay_s": None, "summary": None,
}  # fmt: skip
LEAK = {"total_J": -1.2e-3, "sampling_and_hold_J": -1e-4, "quantisation_J": 2e-6, "delay_J": -1.1e-3}
SUMMARY = {
    "title": RUNNING["title"], "duration_s": 3.0, "ended": "done", "verdict": "limit-cycle",
    "verdict_rule": "Pushes of 0.195 N and of a tenth of it end in the same swing.", "trajectory_sha256": "ab" * 32,
    "stability": {
        "rate_1_s": -0.0123, "error_1_s": 0.02, "frequency_Hz": 7.1, "width_m": 5.35e-3, "spread_m": 4.2e-4,
        "force_ripple_N": 0.41, "felt": True, "chaotic": True, "own_share": 0.93,
    },
    "extremes": {"x_min_m": -0.0642, "x_max_m": 0.0, "force_max_N": 0.81}, "real_time_factor": 21.0,
    "lost": {"commands_dropped": 3, "commands_lost": 0, "telemetry_gaps": 0},
    "energy": {
        "wall": {"sampled_J": -1.1e-3, "true_J": -1.3e-3, "leak": LEAK},
        "elements": [{"kind": "damping", "from_tick": 0, "to_tick": 3000, "sampled_J": 9e-4, "true_J": 1e-3}],
        "moved_J": 6e-3, "residual_J": 2e-18,
    },
}  # fmt: skip
ENDED = {
    "phase": "ended", "tick": 3000, "verdict": "limit-cycle", "verdict_is": "judged", "options": None,
    "summary": SUMMARY, "nodes": [],
}  # fmt: skip
RUNS = {
    "type": "runs", "live": [{"id": "abc123", "title": "one"}, {"id": "def456", "title": "two"}],
    "past": [{"id": "wall-1", "title": "first wall", "told": "steady, 1 Jan 12:00"}],
    "shown": "abc123", "overlay": None, "overlay_diverged": False, "title": "one", "stays": False,
}  # fmt: skip


class StandIn:
    """A server of the page in a separate thread.

    Attributes:
        received: every message of the page, in order.
        answer: returns (ok, text) for a command.
        url: the link to open, token included.
    """

    def __init__(self) -> None:
        self.received: list[dict[str, Any]] = []
        self.answer: Callable[[dict[str, Any]], tuple[bool, str] | None] = lambda command: (True, "done")
        self._told: dict[str, str] = {}
        self._snapshot: bytes | None = None
        self._sockets: set[web.WebSocketResponse] = set()
        self._sent = 0
        # A page that has just connected gets the earlier messages first, then those sent meanwhile.
        self._one_at_a_time = asyncio.Lock()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever)
        self._thread.start()
        self._port = free_port()
        self.start()

    @property
    def url(self) -> str:
        return f"{self.origin}/#token={TOKEN}"

    @property
    def origin(self) -> str:
        return f"http://127.0.0.1:{self._port}"

    def commands(self) -> list[dict[str, Any]]:
        """The commands received: verb and arguments."""
        return [message for message in self.received if message["type"] == "command"]

    def watches(self) -> list[dict[str, Any]]:
        """The stretches of time that were requested."""
        return [message for message in self.received if message["type"] == "watch"]

    def asked(self, is_so: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """The last stretch of time that was requested, once ``is_so`` accepts it: requests take time to arrive."""
        wait_for("the question", lambda: self.watches() and is_so(self.watches()[-1]))
        return self.watches()[-1]

    def ordered(self, is_so: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """The last command, once ``is_so`` accepts it."""
        wait_for("the order", lambda: self.commands() and is_so(self.commands()[-1]))
        return self.commands()[-1]

    def drawn(self) -> None:
        """Waits until every page has drawn the last snapshot that it was sent."""
        said = lambda: sum(message["snapshots"] for message in self.received if message["type"] == "drawn")  # noqa: E731
        wait_for("the drawing", lambda: said() == self._sent)

    # From the test's thread

    def start(self) -> None:
        """Serves, on the same port as before."""
        self._do(self._start())

    def stop(self) -> None:
        """Stops serving, as when haploop view is ended."""
        self._do(self._stop())

    def close(self) -> None:
        """Stops serving and ends the thread."""
        self.stop()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def tell(self, *messages: dict[str, Any]) -> None:
        """Sends messages to every page, and the last of each type to pages that connect later."""
        for message in messages:
            self._do(self._tell(message["type"], json.dumps(message)))

    def state(self, **changes: Any) -> None:
        """Sends the state of a running loop, with some changes."""
        self.tell(RUNNING | changes)

    def show(self, snapshot: bytes) -> None:
        """Sends a snapshot to every page."""
        self._do(self._show(snapshot))

    def _do(self, work: Any) -> None:
        asyncio.run_coroutine_threadsafe(work, self._loop).result(PATIENCE_S)

    # In the server's thread

    async def _start(self) -> None:
        app = web.Application()
        app.router.add_get("/", self._file(STATIC / "index.html"))
        app.router.add_get("/stream", self._stream)
        uplot = find_spec("uplot")
        assert uplot
        assert uplot.origin
        of_uplot = Path(uplot.origin).parent / "static"
        for folder, path in [(STATIC, path) for path in STATIC.rglob("*.*")] + [
            (of_uplot, path) for path in of_uplot.glob("uPlot.*")
        ]:
            app.router.add_get(f"/static/{path.relative_to(folder).as_posix()}", self._file(path))
        self._runner = web.AppRunner(app, shutdown_timeout=0.1)
        await self._runner.setup()
        await web.TCPSite(self._runner, "127.0.0.1", self._port, reuse_address=True).start()

    async def _stop(self) -> None:
        for site in [*self._runner.sites]:  # before the pages, which reconnect
            await site.stop()
        for socket in list(self._sockets):
            await socket.close()
        await self._runner.cleanup()

    def _file(self, path: Path) -> Callable[[web.Request], Any]:
        async def serve(request: web.Request) -> web.FileResponse:
            return web.FileResponse(path, headers=HEADERS)

        return serve

    async def _stream(self, request: web.Request) -> web.WebSocketResponse:
        socket = web.WebSocketResponse()
        await socket.prepare(request)
        async with self._one_at_a_time:
            for text in self._told.values():
                await socket.send_str(text)
            if self._snapshot:
                await self._send(socket, self._snapshot)
            self._sockets.add(socket)
        try:
            async for message in socket:
                if message.type is WSMsgType.TEXT:
                    await self._receive(socket, json.loads(message.data))
        finally:
            self._sockets.discard(socket)
        return socket

    async def _receive(self, socket: web.WebSocketResponse, message: dict[str, Any]) -> None:
        self.received.append(message)
        if message["type"] == "command" and (answer := self.answer(message)):
            await socket.send_json({"type": "answer", "id": message["id"], "ok": answer[0], "text": answer[1]})

    async def _tell(self, kind: str, text: str) -> None:
        async with self._one_at_a_time:
            self._told[kind] = text
            for socket in list(self._sockets):
                with suppress(ConnectionError):  # a page that is leaving
                    await socket.send_str(text)

    async def _show(self, snapshot: bytes) -> None:
        async with self._one_at_a_time:
            self._snapshot = snapshot
            for socket in list(self._sockets):
                await self._send(socket, snapshot)

    async def _send(self, socket: web.WebSocketResponse, snapshot: bytes) -> None:
        with suppress(ConnectionError):
            await socket.send_bytes(snapshot)
            self._sent += 1
