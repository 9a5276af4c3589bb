"""The page's server among strangers and pages: what is no HTTP, connections without end, and when it ends."""

import asyncio
import random
from contextlib import suppress

import aiohttp
import pytest

from haploop.view.serve import connections, server
from haploop.view.serve.server import listen
from helpers.live.browsing import NoRuns, scenario, site, status, stream
from helpers.live.waiting import PATIENCE_S

NO_HTTP = [
    random.Random(1).randbytes(2000),
    b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(100),
    b"GET / HTTP/1.1\r\nHost: x\r\nContent-Length: -5\r\n\r\n",
    b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
    b"GET /\xff\xfe HTTP/1.1\r\n\r\n",
    b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
    b"GET / HTTP/9.9\r\n\r\n",
]


@scenario
async def test_what_is_no_http_is_answered_with_400_and_nothing_is_told_of_it(capfd, caplog):
    async with site(NoRuns()) as here:
        for data in NO_HTTP:
            reader, writer = await asyncio.open_connection("127.0.0.1", int(here.address.split(":")[2].strip("/")))
            writer.write(data)
            assert (await reader.read(100)).startswith(b"HTTP/1.0 400 Bad Request")
            writer.close()
    assert capfd.readouterr().err == ""
    assert caplog.records == []


@scenario
async def test_a_token_that_is_no_text_of_any_encoding_is_a_wrong_token():
    async with site(NoRuns()) as here:
        tab = await here.tab()
        ok, text = await tab.send("pause", {}, "\udc80")
        assert not ok
        assert "only watches" in text
        assert not here.guard.redeem("\udc80")


@pytest.mark.slow
@scenario
async def test_connections_that_ask_for_nothing_are_closed_and_never_more_than_a_hundred_and_those_of_pages_stay(
    monkeypatch,
):
    monkeypatch.setattr(connections, "SILENT_S", 0.5)
    monkeypatch.setattr(connections, "_LOOK_S", 0.05)
    async with site(NoRuns()) as here:
        tab = await here.tab()
        port = int(here.address.split(":")[2].strip("/"))
        opened = [await asyncio.open_connection("127.0.0.1", port) for _ in range(300)]
        for _, writer in opened[::2]:
            writer.write(b"GET / HTTP/1.1\r\nHost: ")
        for reader, writer in opened:
            with suppress(ConnectionError):
                assert await reader.read(1) == b""
            writer.close()
        assert await status(here, "/") == 200
        assert tab.closed is None
        assert not (await tab.send("pause", {}, here.guard.token))[0]


@pytest.mark.slow
@scenario
async def test_where_asked_the_server_ends_once_its_last_page_is_closed_and_not_when_one_is_loaded_anew(monkeypatch):
    monkeypatch.setattr(server, "_ANEW_S", 0.05)
    for until_closed in (True, False):
        end, ready = asyncio.Event(), asyncio.get_running_loop().create_future()
        options = {"on_serving": ready.set_result, "end": end, "until_closed": until_closed}
        serving = asyncio.create_task(server.serve(NoRuns(), listen(0), **options))
        guard = await ready
        async with aiohttp.ClientSession() as session:
            first = await stream(session, guard.address.rstrip("/"))
            second = await stream(session, guard.address.rstrip("/"))
            await first.close()
            await asyncio.sleep(0.2)
            assert not serving.done()
            await second.close()
            await asyncio.wait([serving], timeout=PATIENCE_S if until_closed else 0.3)
            assert serving.done() == until_closed
            end.set()
            await asyncio.wait_for(serving, PATIENCE_S)
