"""Only this machine's browser may look, only with the printed link may it steer; a page from elsewhere can neither."""

import socket

import aiohttp
import pytest

from haploop.view.serve import assets
from haploop.view.serve.guard import Guard
from haploop.view.serve.server import PortTaken, listen
from helpers.live.browsing import NoRuns, scenario, site, status


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", "[::1]:{port}", ""]
)
@pytest.mark.parametrize("path", ["/", "/static/page.css", "/stream", "/enter/key"])
@scenario
async def test_a_request_by_another_name_than_the_servers_own_is_refused(host, path):
    """What DNS rebinding sends: the name of a page from elsewhere that now resolves to this machine."""
    async with site(NoRuns()) as here:
        host = host.format(port=here.guard.address.split(":")[2].rstrip("/"))
        assert await status(here, path, Host=host) in (400, 403)


@scenario
async def test_the_page_is_there_by_its_two_names_with_strict_headers():
    async with site(NoRuns()) as here:
        for name in ("127.0.0.1", "localhost"):
            host = here.address.replace("http://127.0.0.1", name)
            async with here.session.get(here.address, headers={"Host": host}) as answer:
                assert answer.status == 200
                assert answer.content_type == "text/html"
                policy = answer.headers["Content-Security-Policy"]
                assert "default-src 'self'" in policy
                assert "frame-ancestors 'none'" in policy
                assert "unsafe" not in policy
                assert answer.headers["X-Frame-Options"] == "DENY"
                assert "Access-Control-Allow-Origin" not in answer.headers
                assert here.guard.token not in await answer.text()


@scenario
async def test_the_files_are_those_of_the_page_and_of_uplot_and_no_others():
    async with site(NoRuns()) as here:
        js, css = "text/javascript", "text/css"
        for name, kind in (("uPlot.iife.js", js), ("uPlot.min.css", css), ("charts/time_chart.js", js)):
            async with here.session.get(f"{here.address}/static/{name}") as answer:
                assert (answer.status, answer.content_type) == (200, kind)
        for name in (
            "../guard.py",
            "..%2fguard.py",
            "charts/../../guard.py",
            "charts",
            "guard.py",
            "uPlot.mousewheel.js",
            "",
            "%00",
            "static",
        ):
            assert await status(here, f"/static/{name}") == 404
        assert await status(here, "/nothing") == 404


@pytest.mark.parametrize(
    "origin", [None, "", "null", "http://evil.example", "https://127.0.0.1:{port}", "http://127.0.0.1:1"]
)
@scenario
async def test_a_page_from_elsewhere_cannot_listen(origin):
    """A browser names the page's origin in the handshake; none, or another, gets no stream."""
    async with site(NoRuns()) as here:
        port = here.address.rpartition(":")[2]
        headers = {} if origin is None else {"Origin": origin.format(port=port)}
        with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
            await here.session.ws_connect(f"{here.address}/stream", headers=headers)
        assert refused.value.status == 403


@scenario
async def test_without_the_token_nothing_can_be_asked_but_everything_can_be_watched():
    runs = NoRuns()
    async with site(runs) as here:
        tab = await here.tab()
        for token in ("", "wrong", f"{here.guard.token}x", here.guard.token[:-1], "ü"):
            ok, text = await tab.send("pause", {}, token)
            assert not ok
            assert "open the link that haploop view printed" in text
        assert runs.asked == []
        assert (await tab.phase("waiting"))["run"] is None
        assert tab.events == []


@scenario
async def test_a_verb_that_is_not_for_pages_is_refused():
    runs = NoRuns()
    async with site(runs) as here:
        tab = await here.tab()
        for verb in ("status", "options", "explode"):
            ok, text = await tab.ask(verb)
            assert not ok
            assert "is not a command" in text
        assert runs.asked == []


@scenario
async def test_with_no_run_a_command_says_what_to_do():
    async with site(NoRuns()) as here:
        tab = await here.tab()
        assert await tab.ask("pause") == (False, "No run is live; start one with haploop run SCENE.")


GARBAGE = [
    "no JSON",
    "[]",
    "null",
    "[" * 20_000,
    '{"type": "explode"}',
    '{"type": "watch", "span_s": "2"}',
    '{"type": "watch", "span_s": 0}',
    '{"type": "watch", "span_s": -1}',
    '{"type": "watch", "span_s": NaN}',
    '{"type": "watch", "span_s": 1e300}',
    '{"type": "watch", "points": null}',
    '{"type": "watch", "points": true}',
    '{"type": "watch", "points": Infinity}',
    '{"type": "watch", "end_s": []}',
    '{"type": "drawn"}',
    '{"type": "drawn", "snapshots": 0}',
    '{"type": "drawn", "snapshots": 1e9}',
    '{"type": "command"}',
    '{"type": "command", "verb": 1}',
    '{"type": "command", "verb": "pause", "arguments": []}',
    b"\x00\x01",
    "x" * 70_000,
]


@scenario
async def test_garbage_from_a_page_closes_that_page_alone():
    async with site(NoRuns()) as here:
        good = await here.tab()
        for garbage in GARBAGE:
            bad = await here.tab()
            await (bad.socket.send_bytes(garbage) if isinstance(garbage, bytes) else bad.socket.send_str(garbage))
            await bad.until(f"the end of the page that sent {garbage[:40]!r}", lambda page=bad: page.closed)
            assert bad.closed in ((1008, ""), (1009, "")), garbage[:40]
            assert not (await good.ask("pause"))[0]
            assert good.closed is None


@scenario
async def test_the_way_in_leads_to_the_token_once_and_then_no_more():
    async with site(NoRuns()) as here:
        one_time_link = here.guard.one_time_link
        assert here.guard.token not in one_time_link
        async with here.session.get(one_time_link, allow_redirects=False) as answer:
            assert answer.status == 302
            assert answer.headers["Location"] == here.guard.link
        async with here.session.get(one_time_link, allow_redirects=False) as answer:
            assert answer.status == 403
            assert here.guard.token not in await answer.text()
        assert await status(here, "/enter/guess") == 403


def test_a_wrong_key_does_not_use_the_way_in_up():
    guard = Guard(1234)
    assert not guard.redeem("wrong")
    assert guard.redeem(guard.one_time_link.rpartition("/")[2])


def test_the_tokens_of_two_servers_differ():
    assert Guard(1).token != Guard(1).token


def test_the_server_listens_on_loopback_alone():
    with listen(0) as listening:
        assert listening.getsockname()[0] == "127.0.0.1"


def test_a_port_that_is_taken_is_named():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(PortTaken, match=f"Port {port} of 127.0.0.1 cannot be used"):
            listen(port)


@pytest.mark.parametrize("missing", ["aiohttp", "uplot"])
def test_what_is_not_installed_is_named_with_the_way_to_get_it(missing, monkeypatch):
    found = assets.importlib.util.find_spec
    monkeypatch.setattr(
        assets.importlib.util, "find_spec", lambda name, *rest: None if name == missing else found(name, *rest)
    )
    with pytest.raises(assets.MissingExtra, match=r"pip install 'haploop\[view\]'"):
        assets.check_installed()
