"""``haploop view`` and ``haploop run --view`` as a user starts them."""

from __future__ import annotations

import os
import re
import signal
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import aiohttp
import pytest

from helpers.live.browsing import Tab, stream, to_its_end
from helpers.live.in_process import ask
from helpers.live.launched import HAPLOOP, SCENE, Launched, command
from helpers.live.live_run import going, undisturbed
from helpers.live.system import alive, processes
from helpers.live.waiting import PATIENCE_S, wait_for

# The run stands still before its first tick until a test resumes it.
STANDS = ("--set", "event=[{at=0, pause=true}]")
LINK = re.compile(r"(http://127\.0\.0\.1:\d+)/#token=(\S+)")


def link(viewer: Launched) -> tuple[str, str]:
    """Address and token, as the viewer prints them."""
    found = wait_for("the link", lambda: LINK.search(viewer.stderr))
    return found[1], found[2]


def browse(viewer: Launched, play: Callable[[Tab], Any]) -> Any:
    """Open the page of a viewer and do something there."""
    address, token = link(viewer)

    async def scenario() -> Any:
        async with aiohttp.ClientSession() as session, stream(session, address) as opened:
            return await play(Tab(opened, token))

    return to_its_end(scenario())


def test_view_waits_for_a_run_and_ends_quietly_with_ctrl_c(launched):
    viewer = launched("view", "--no-browser")
    browse(viewer, lambda tab: tab.phase("waiting"))
    viewer.signal(signal.SIGINT)
    assert viewer.end(0) == ""
    assert "Traceback" not in viewer.stderr


@pytest.mark.slow
def test_view_ends_with_ctrl_c_while_a_page_is_open(launched):
    viewer = launched("view", "--no-browser")

    async def play(tab: Tab) -> None:
        await tab.phase("waiting")
        viewer.signal(signal.SIGINT)
        await tab.until("the end of the page", lambda: tab.closed)
        assert tab.closed == (1001, "")

    browse(viewer, play)
    viewer.end(0)


def test_a_taken_port_is_named(launched):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        answer = ask("view", "--no-browser", "--port", str(port))
    assert answer.status == 2
    assert f"Port {port} of 127.0.0.1 cannot be used" in answer.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--run", "nobody"], "No run is live"),
        (["--since", "yesterday"], "--since must be start or now, but 'yesterday' was given."),
    ],
)
def test_wrong_use_of_view_says_what_was_expected(words, sentence):
    answer = ask("view", "--no-browser", *words)
    assert answer.status == 2
    assert sentence in answer.stderr


def test_the_browser_is_opened_with_a_link_that_holds_no_token(launched, tmp_path, monkeypatch):
    """A command line is there for all users of the machine to see."""
    opened = tmp_path / "opened"
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\necho "$1" > {opened}\n')
    browser.chmod(0o755)
    monkeypatch.setenv("BROWSER", f"{browser} %s")
    viewer = launched("view")
    address, token = link(viewer)
    one_time_link = wait_for("the browser", lambda: opened.exists() and opened.read_text().strip())
    assert one_time_link.startswith(f"{address}/enter/")
    assert token not in one_time_link


@pytest.mark.slow
def test_run_with_view_serves_the_run_and_stays_until_ctrl_c(launched, tmp_path, monkeypatch):
    """In real time; the run ends, the page shows its summary, and the viewer goes with the launcher."""
    monkeypatch.delenv("DISPLAY", raising=False)
    words = ["--set", "duration=0.5", *STANDS, "--view", "--json"]
    run = launched("run", str(SCENE), *words, out=tmp_path / "out")

    async def play(tab: Tab) -> dict[str, Any]:
        assert (await tab.phase("paused"))["pace"] == 1.0
        assert (await tab.ask("resume"))[0]
        return await tab.phase("ended")

    state = browse(run, play)
    assert state["summary"]["ticks"] == 500
    run.says("Ctrl-C ends it")
    run.says("The run is over; its page stays at http")
    viewers = [pid for pid, parent, _, _ in processes() if parent == run.pid]
    assert len(viewers) == 1
    run.signal(signal.SIGINT)
    assert '"ended": "done"' in run.end(0)
    wait_for("the end of the viewer", lambda: not alive(viewers))


@pytest.mark.slow
def test_run_with_view_ends_with_its_page_where_asked(launched, tmp_path, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    words = ["--set", "duration=0.5", *STANDS, "--view", "--until-closed", "--name", "mine", "--json"]
    run = launched("run", str(SCENE), *words, out=tmp_path / "out")

    async def play(tab: Tab) -> dict[str, Any]:
        await tab.phase("paused")
        assert (await tab.ask("resume"))[0]
        return await tab.phase("ended")

    assert browse(run, play)["summary"]["title"] == "mine"
    assert '"title": "mine"' in run.end(0)


@pytest.mark.slow
def test_of_a_page_that_is_closed_while_its_run_goes_on_one_sentence_tells_and_no_error(
    launched, tmp_path, monkeypatch
):
    """The run is longer than the test has patience: however slow the host, it still goes on as the page goes."""
    monkeypatch.delenv("DISPLAY", raising=False)
    words = ["--set", "duration=600", "--view", "--until-closed", "--json"]
    run = launched("run", str(SCENE), *words, out=tmp_path / "out")

    async def play(tab: Tab) -> dict[str, Any]:
        return await tab.phase("running")

    browse(run, play)
    run.says("The page is gone; the run continues. If it stands still, haploop resume continues it")
    run.signal(signal.SIGINT)
    assert '"ended": "stopped"' in run.end(0)
    assert "Fatal Python error" not in run.stderr


@pytest.mark.slow
def test_a_run_waits_for_its_viewer_and_is_shown_however_short_it_is(launched, tmp_path):
    """Twenty ticks at free pace end long before a viewer that started with them."""
    run = launched("run", str(SCENE), "--set", "duration=0.02", "--view", "--pace", "free", out=tmp_path / "out")
    state = browse(run, lambda tab: tab.phase("ended"))
    assert state["summary"]["ticks"] == 20
    run.says("Ctrl-C ends it")
    run.signal(signal.SIGINT)
    run.end(0)


@pytest.mark.slow
def test_a_viewer_that_cannot_start_is_no_matter_to_its_run(tmp_path):
    (tmp_path / "sitecustomize.py").write_text("import os, sys\nif '--led' in sys.orig_argv:\n    os._exit(3)\n")
    answer = _run_with(
        tmp_path, ["run", str(SCENE), "--set", "duration=0.02", "--view", "--out", str(tmp_path / "out")]
    )
    assert answer.returncode == 0
    assert "The page is at" not in answer.stderr


@pytest.mark.slow
def test_a_viewer_that_dies_is_no_matter_to_its_run(launched, tmp_path):
    run = launched("run", str(SCENE), "--set", "duration=600", *STANDS, "--view", out=tmp_path / "out")
    link(run)
    viewers = [pid for pid, parent, _, args in processes() if parent == run.pid and " view " in args]
    assert len(viewers) == 1
    os.kill(viewers[0], signal.SIGKILL)
    wait_for("the end of the viewer", lambda: not alive(viewers))
    assert run.is_there()
    run.signal(signal.SIGINT)
    run.end(0)


@pytest.mark.slow
def test_a_viewer_whose_launcher_is_killed_goes_too(launched, tmp_path):
    run = launched("run", str(SCENE), "--set", "duration=600", "--view", out=tmp_path / "out")
    link(run)
    viewers = [pid for pid, parent, _, args in processes() if parent == run.pid and " view " in args]
    run.signal(signal.SIGKILL)
    run.end(-signal.SIGKILL)
    wait_for("the end of the viewer", lambda: not alive(viewers))


def test_view_of_a_run_in_one_process_is_refused(tmp_path):
    answer = command("run", str(SCENE), "--in-process", "--view", "--out", str(tmp_path / "out"))
    assert answer.returncode == 2
    assert "leave out --in-process" in answer.stderr
    assert not (tmp_path / "out").exists()


def test_view_without_aiohttp_says_how_to_get_it(tmp_path):
    """Nothing is started, not even the run."""
    blocked = tmp_path / "sitecustomize.py"
    blocked.write_text(
        "import importlib.util\nfound = importlib.util.find_spec\n"
        "importlib.util.find_spec = lambda name, *rest: None if name == 'aiohttp' else found(name, *rest)\n"
    )
    for words in (["view"], ["run", str(SCENE), "--view", "--out", str(tmp_path / "out")]):
        answer = _run_with(tmp_path, words)
        assert answer.returncode == 2
        assert "pip install 'haploop[view]'" in answer.stderr
    assert not (tmp_path / "out").exists()


def _run_with(folder: Path, words: list[str]):
    import subprocess

    environment = {**os.environ, "PYTHONPATH": str(folder)}
    return subprocess.run([*HAPLOOP, *words], capture_output=True, text=True, env=environment, timeout=PATIENCE_S)


def skipped(run: Any) -> list[int]:
    """What the clock knows of the viewers' skipped ticks."""
    return [node["skipped_ticks"] for node in run.ask("status")[1]["nodes"] if node["role"] == "view"]


def told(run: Any) -> bool:
    """Whether the clock knows of skipped ticks; a gap shows when something follows it that is not lost, too."""
    run.stands_at(run.ask("step", ticks=1)[1]["tick"])
    return any(skipped(run))


def stopped_until(launched, tmp_path, tick: int, *overrides: str, **options: Any) -> None:
    """Stop a viewer while its run goes on to a tick: the run loses nothing, and the viewer is told what it missed."""
    with going(tmp_path, *overrides, pauses=(200, tick), **options) as run:
        viewer = launched("view", "--no-browser")

        async def before(tab: Tab) -> None:
            await tab.phase("paused")
            assert tab.state["skipped_ticks"] == 0

        async def after(tab: Tab) -> None:
            """Page and clock agree in the end; either may hear of a second gap first."""
            await tab.phase("paused")
            await tab.until("what was skipped", lambda: tab.state["skipped_ticks"])
            await tab.until("the report", lambda: skipped(run) == [tab.state["skipped_ticks"]])

        browse(viewer, before)
        viewer.signal(signal.SIGSTOP)
        run.ask("resume")
        run.stands_at(tick)
        viewer.signal(signal.SIGCONT)
        wait_for("word of a gap", lambda: told(run))
        browse(viewer, after)
        run.ask("resume")
        run.ask("pace", pace="free")
        summary = run.result()
        assert summary["trajectory_sha256"] == undisturbed(run.prepared)["trajectory_sha256"]
        assert summary["ended"] == "done"
        viewer.signal(signal.SIGINT)
        viewer.end(0)


@pytest.mark.slow
def test_a_stopped_viewer_costs_the_run_nothing_and_is_told_what_it_missed(launched, tmp_path):
    """At free pace; blocks of a tick fill its queues in no time."""
    stopped_until(launched, tmp_path, 2200, "duration=3", "run.block_ticks=1", "run.log=ticks")


@pytest.mark.slow
def test_a_viewer_stopped_in_real_time_costs_the_run_nothing(launched, tmp_path):
    """Blocks of a tick fill its queues in two seconds."""
    stopped_until(launched, tmp_path, 2200, "duration=3", "run.block_ticks=1", pace=1.0)
