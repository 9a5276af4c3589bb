"""haploop export as its users meet it: where files go, what is refused, and that nothing half done is left behind."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.writer import Writer
from typer.testing import CliRunner, Result

from haploop.logger import read
from haploop.logger.log.writer import Log
from haploop.tools.cli.app import app
from helpers.data.logs import cut, swapped_run
from helpers.live.system import on_a_disk_of
from helpers.slowly import first_and_slowly

FORMATS = ("csv", "npz", "parquet", "json-mcap")


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return swapped_run(tmp_path / "out")


def export(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["export", *map(str, arguments)])


def needs(to: str) -> None:
    """Skip where what a format takes is not installed."""
    if to == "parquet":
        pytest.importorskip("pyarrow")


def refused(result: Result, status: int, *words: str) -> None:
    assert result.exit_code == status, result.output
    assert result.stdout == ""
    assert "Traceback" not in result.output
    for one in words:
        assert one in result.stderr, result.stderr


def test_files_stand_beside_the_log_unless_another_place_is_named(run: Path, tmp_path: Path) -> None:
    assert export(run, "--to", "csv").exit_code == 0
    assert export(run / "log.mcap", "--to", "npz", "--out", tmp_path / "deep" / "mine.npz").exit_code == 0
    assert export(run, "--to", "json-mcap", "--out", tmp_path).exit_code == 0
    assert {path.name for path in run.iterdir()} == {"log.mcap", "plant.csv", "controller.csv", "events.csv"}
    assert {path.name for path in tmp_path.iterdir()} == {"out", "deep", "log.json.mcap"}
    assert {path.name for path in (tmp_path / "deep").iterdir()} == {"mine.npz"}


def test_a_file_that_exists_is_left_as_it_is_unless_that_is_forced(run: Path) -> None:
    (run / "controller.csv").write_text("mine", encoding="utf-8")
    refused(export(run, "--to", "csv"), 2, f"{run / 'controller.csv'} exists already", "--force")
    assert (run / "controller.csv").read_text(encoding="utf-8") == "mine"
    assert not (run / "plant.csv").exists()
    assert export(run, "--to", "csv", "--force").exit_code == 0
    assert (run / "controller.csv").read_text(encoding="utf-8").startswith("timestamp (s)")


def test_a_place_that_cannot_be_written_to_is_refused(run: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("a file", encoding="utf-8")
    refused(export(run, "--to", "csv", "--out", tmp_path / "file" / "x"), 2, "cannot be made", "--out")
    (run / "log.npz").mkdir()
    refused(export(run, "--to", "npz", "--force"), 2, f"{run / 'log.npz'} exists already")


@pytest.mark.slow
@pytest.mark.parametrize("to", first_and_slowly(*FORMATS))
def test_a_disk_that_fills_leaves_nothing_behind(to: str, tmp_path: Path) -> None:
    needs(to)
    run = swapped_run(tmp_path / "out", 3_000, hard=False)
    command = [sys.executable, "-m", "haploop.tools.cli", "export", str(run), "--to", to]
    quiet = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    ended = subprocess.run(on_a_disk_of(100_000, command), capture_output=True, text=True, env=quiet)
    assert ended.returncode == 1, ended.stderr
    assert f"Writing to {run} failed (File too large)" in ended.stderr
    assert "Traceback" not in ended.stderr
    assert [path.name for path in run.iterdir()] == ["log.mcap"]


@pytest.mark.parametrize("to", FORMATS)
def test_a_log_that_was_cut_off_is_exported_as_far_as_it_goes_and_that_is_said(to: str, run: Path) -> None:
    needs(to)
    cut(run, 0.5)
    result = export(run, "--to", to)
    assert result.exit_code == 0, result.output
    assert "was cut off or is still being written" in result.stderr
    assert "What it holds up to there was exported." in result.stderr
    if to == "csv":
        rows = len((run / "plant.csv").read_text(encoding="utf-8").splitlines()) - 1
        assert rows == len(read(run)["/plant"]["x"]) > 0


def test_what_is_no_log_is_told_from_what_is_not_there(tmp_path: Path) -> None:
    refused(export(tmp_path / "nowhere", "--to", "csv"), 2, "There is no", "nowhere")
    refused(export(tmp_path, "--to", "csv"), 2, "holds no log.mcap")
    log = tmp_path / "log.mcap"
    log.write_bytes(b"")
    refused(export(tmp_path, "--to", "csv"), 1, "is empty")
    log.write_text("time,force\n", encoding="utf-8")
    refused(export(tmp_path, "--to", "csv"), 1, "is not an MCAP file")
    Log(log).close()
    refused(export(tmp_path, "--to", "csv"), 1, "holds no channel yet")
    assert [path.name for path in tmp_path.iterdir()] == ["log.mcap"]


def test_a_wrong_format_or_channel_is_answered_with_the_right_ones(run: Path) -> None:
    refused(export(run, "--to", "xlsx"), 2, "csv, npz, parquet, json-mcap", "'xlsx'")
    refused(export(run, "--to", "csv", "--topics", "plnt"), 2, "no channel /plnt", "/events, /plant, /controller")


def test_a_missing_library_is_named_with_the_way_to_get_it(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    refused(export(run, "--to", "parquet"), 2, "pip install 'haploop[parquet]'")
    assert [path.name for path in run.iterdir()] == ["log.mcap"]


def test_channels_of_any_name_get_files_of_their_own(tmp_path: Path) -> None:
    with (tmp_path / "log.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("x", "jsonschema", b'{"type": "object", "properties": {"x": {}}}')
        for topic in ("/a/b", "/a_b", "/../c"):
            writer.add_message(writer.register_channel(topic, "msgpack", schema), 0, b"\x81\xa1x\x01", 0)
        writer.finish()
    result = export(tmp_path, "--to", "csv")
    assert result.exit_code == 0, result.output
    assert {Path(line).name for line in result.stdout.splitlines()} == {"a%2Fb.csv", "a_b.csv", "..%2Fc.csv"}
    assert (tmp_path / "a_b.csv").read_text(encoding="utf-8") == "x\n1.0\n"


# The peak of the process itself; getrusage would begin with what its parent held.
PEAK = Path("/proc/self/status")
MEASURED = """
import sys
from haploop.tools.cli.app import app
try:
    app(["export", sys.argv[1], "--to", sys.argv[2], "--out", sys.argv[3]])
except SystemExit as end:
    assert not end.code, end
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
print(status["VmHWM"].split()[0], file=sys.stderr)
"""


@pytest.mark.skipif(not PEAK.exists(), reason="the peak of a process is told by Linux alone")
@pytest.mark.slow
@pytest.mark.parametrize("to", FORMATS)
def test_a_longer_log_takes_no_more_memory(to: str, tmp_path: Path) -> None:
    """Its columns are 61 MB more and may cost half of that: the whole process is measured, 16 MB of it chance.
    Text takes long to write, and chance is little there: logs of a third."""
    needs(to)
    sizes, more_kb = ((12_000, 42_000), 8_000) if to in ("csv", "json-mcap") else ((60_000, 200_000), 30_000)
    held_kb = []
    for ticks in sizes:
        run = swapped_run(tmp_path / str(ticks), ticks, hard=False, flush_ticks=1000)
        out = tmp_path / f"exported-{ticks}"
        out.mkdir()
        measured = [sys.executable, "-c", MEASURED, str(run), to, str(out)]
        # Arrow's own allocator keeps for a while what was freed.
        plainly = {**os.environ, "ARROW_DEFAULT_MEMORY_POOL": "system"}
        ended = subprocess.run(measured, capture_output=True, text=True, check=True, env=plainly)
        held_kb.append(int(ended.stderr.split()[-1]))
    print(f"{to}: {held_kb} kB")
    assert held_kb[1] < held_kb[0] + more_kb
