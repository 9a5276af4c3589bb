"""Elements that print: the run goes on with the same bits, all of it is kept, and a command's answer is its own."""

from __future__ import annotations

import json
import os
import re
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from haploop.controller.dissipation import load_plugin, registry
from haploop.launch.processes.children import Child
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.launch.shown_prints import ShownPrints
from haploop.protocol.transport.prints import NodeOutput
from helpers.live.launched import HAPLOOP, SCENES, command
from helpers.live.waiting import PATIENCE_S, wait_for
from helpers.scenes.brake import source
from helpers.slowly import first_and_slowly

SETS = ("duration=0.3", "run.verdict=window", 'dissipation=[{kind="brake", acts="always"}]')
MARKED = re.compile(r"controller(, tick \d+)?: ")
KINDS = {
    "everywhere": ("print('import')", "print('making')", "print('force')"),
    "each tick": ("pass", "pass", "print('tick', self.tick)"),
    "megabytes": ("pass", "pass", "print('x' * 200_000)"),
    "no newline": ("sys.stdout.write('import')", "pass", "print('on', end=' ', flush=True)"),
    "binary": ("pass", "pass", "sys.stdout.buffer.write(bytes(range(256))); sys.stdout.flush()"),
    "surrogates": ("pass", "pass", "print(chr(0xD800), chr(27) + '[2J')"),
    "raw": ("os.write(1, b'raw')", "os.write(1, b'raw')", "os.write(1, b'raw'); os.write(2, b'raw')"),
    "closes": ("sys.stdout.close()", "sys.stderr.close()", "sys.stdout.close(); print('still there')"),
    "closes 1 and 2": ("pass", "pass", "self.tick in (20, 30) and os.close(self.tick // 10 - 1); print('on')"),
    "threads": ("pass", "pass", "threading.Thread(target=print, args=('thread', self.tick)).start()"),
    "errors": ("pass", "pass", "logging.error('tick %d', self.tick); print('and', file=sys.stderr)"),
    "a child": ("pass", "pass", "self.tick == 50 and subprocess.run(['echo', 'child'], check=True)"),
    "no stdout": ("sys.stdout = None", "pass", "sys.stdout = open(os.devnull, 'w'); print('gone')"),
}  # fmt: skip


def write_plugin(directory: Path, *statements: str) -> Path:
    path = directory / "brake.py"
    path.write_text(source(*statements))
    return path


@pytest.fixture(scope="module")
def silent(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The digest of the run whose element prints nothing."""
    plugin = write_plugin(tmp_path_factory.mktemp("silent"))
    kinds = registry() | load_plugin(plugin)
    return run_in_process(load(SCENES / "fig6a.toml", SETS, kinds), kinds)["trajectory_sha256"]


@pytest.mark.parametrize(
    ("kind", "unbuffered"),
    first_and_slowly(*((kind, "1") for kind in KINDS), ("binary", ""), ("no newline", ""), ("closes", "")),
)
def test_an_element_that_prints_leaves_the_run_and_its_bits_as_they_are(
    kind, unbuffered, running, tmp_path, silent, monkeypatch
):
    """And the one JSON object on stdout; the terminal stays short."""
    monkeypatch.setenv("PYTHONUNBUFFERED", unbuffered)
    plugin = write_plugin(tmp_path, *KINDS[kind])
    run = running("--plugin", str(plugin), scene=SCENES / "fig6a.toml", sets=SETS, pace=())
    assert run.summary()["trajectory_sha256"] == silent
    run.leaves_nothing()
    assert len(run.stderr.splitlines()) < 150, "few of three hundred"
    assert "Traceback" not in run.stderr


@pytest.mark.slow
def test_all_that_is_printed_stands_in_a_file_of_the_run_marked_with_node_and_tick(running, tmp_path):
    """The terminal has the first lines, and says where the others are."""
    plugin = write_plugin(tmp_path, *KINDS["each tick"])
    run = running("--plugin", str(plugin), scene=SCENES / "fig6a.toml", sets=SETS, pace=())
    run.summary()
    kept = (run.out / "prints.txt").read_text().splitlines()
    assert kept == [f"controller, tick {tick}: tick {tick}" for tick in range(300)]
    told = run.stderr.splitlines()
    assert told[:10] == kept[:10]
    assert f"all of it is in {run.out / 'prints.txt'}" in run.stderr


@pytest.mark.slow
def test_a_run_in_which_nothing_is_printed_has_no_such_file(running):
    run = running(sets=("duration=0.1",), pace=())
    run.summary()
    assert not (run.out / "prints.txt").exists()


@pytest.mark.slow
def test_the_last_lines_of_a_run_that_fails_are_shown_however_much_came_before(running, tmp_path):
    plugin = write_plugin(tmp_path, "pass", "pass", "print('flood') if self.tick < 200 else print('last word', 1 / 0)")
    run = running("--plugin", str(plugin), scene=SCENES / "fig6a.toml", sets=SETS, pace=())
    run.end(1)
    assert "controller, tick 200: " in run.stderr
    assert "line 20: print('flood')" in run.stderr  # where in the element's own code
    assert "Element 0 (brake) gave no force at tick 200: ZeroDivisionError" in run.stderr
    assert run.stderr.count("flood") < 80


@pytest.mark.slow
@pytest.mark.parametrize("kind", first_and_slowly("everywhere", "binary", "raw"))
def test_a_run_in_one_process_keeps_its_answer_to_itself_too(kind, tmp_path, silent):
    plugin = write_plugin(tmp_path, *(() if kind == "raw" else KINDS[kind]))
    sets = [word for each in SETS for word in ("--set", each)]
    scene, out = str(SCENES / "fig6a.toml"), str(tmp_path / "out")
    done = subprocess.run(
        [*HAPLOOP, "run", scene, *sets, "--plugin", str(plugin), "--in-process", "--json", "--out", out],
        capture_output=True,
        check=True,
    )
    assert json.loads(done.stdout)["trajectory_sha256"] == silent


def test_what_a_plugin_prints_as_it_loads_stands_in_no_answer(tmp_path):
    plugin = str(write_plugin(tmp_path, *KINDS["everywhere"]))
    for arguments in (["plugins", "--json"], ["check", str(SCENES / "fig6a.toml"), "--json"]):
        assert json.loads(command(*arguments, "--plugin", plugin).stdout)
    assert "import" in command("plugins", "--json", "--plugin", plugin).stderr


def test_a_line_is_marked_once_however_it_comes(tmp_path):
    with (tmp_path / "prints").open("w") as file:
        output = NodeOutput("controller", file.fileno())
        print("one", end="", file=output, flush=True)
        print(" line\ntwo", file=output)
        output.lines.tick = lambda: 7
        output.buffer.write(b"\xff\x00\n")
        output.close()
        print("three\n", file=output)
    expected = b"controller: one line\ncontroller: two\n"
    marked = b"controller, tick 7: \xff\x00\ncontroller, tick 7: three\ncontroller, tick 7: \n"
    assert (tmp_path / "prints").read_bytes() == expected + marked


def test_a_terminal_gets_few_lines_a_second_without_control_characters(tmp_path, capsys):
    file = tmp_path / "prints.txt"
    shown = ShownPrints(file)
    with file.open("wb") as prints:
        for second in range(100):
            prints.write(b"\x1b[2J\xff" + b"x" * 1000 + b"\n" + b"flood\n" * 5000)
            prints.flush()
            shown.look(float(second))
    shown.close(failed=False)
    told = capsys.readouterr().err.splitlines()
    assert 100 <= len(told) <= 125
    assert max(map(len, told)) < 210
    assert all(line.isprintable() for line in told)
    assert sum("all of it is in" in line for line in told) == 1


@pytest.mark.parametrize("has_pidfd", [True, False])
def test_a_process_is_dead_when_it_has_ended_not_when_it_closes_its_output(has_pidfd, monkeypatch, tmp_path):
    """Also where the kernel has no descriptor of a process."""
    if not has_pidfd:
        monkeypatch.delattr(os, "pidfd_open")
    program, closed = tmp_path / "python", tmp_path / "closed"
    program.write_text(f"#!/bin/sh\nread start\nexec >&- 2>&-\n: > {closed}\nread never\n")
    program.chmod(0o700)
    monkeypatch.setattr(sys, "executable", str(program))
    child = Child("plant", tmp_path, {})
    wait_for("closed output", closed.exists)
    assert select.select([child.died], [], [], 0.1)[0] == []
    os.kill(child.pid, signal.SIGKILL)
    assert select.select([child.died], [], [], PATIENCE_S)[0] == [child.died]
    assert child.exit_description() == "was killed by SIGKILL"
    child.kill()
    read_end, write_end = os.pipe()  # one of them has the number that was the child's
    child.kill()
    os.close(read_end)
    os.close(write_end)
