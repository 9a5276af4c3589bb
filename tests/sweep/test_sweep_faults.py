"""Sweeps as a user starts them, killed, interrupted, out of disk or beside one another."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pyarrow.parquet
import pytest

from haploop.tools.sweep.table import TableError, read
from helpers.live.in_process import ask
from helpers.live.launched import HAPLOOP, Launched
from helpers.live.system import alive, processes
from helpers.live.waiting import PATIENCE_S, wait_for
from helpers.scenes.sweep_files import PRESS, sweep_file, swept

# Such scenes go into no array: so many take so long that something can be done to the sweep meanwhile.
SLOW_PRESS = PRESS.replace("duration = 0.05", "duration = 0.3") + '[clock]\nintegrator = "rk4"\n'
SLOW = '[axes]\n"wall.stiffness" = { from = 10, to = 240, step = 10 }\n'
CELLS = 24
LIMIT_BYTES = 30_000


def parts(out: Path) -> list[Path]:
    return [path for path in (out / "parts").glob("*.parquet") if path.exists()] if out.exists() else []


def workers_of(pid: int) -> list[int]:
    return [child for child, parent, _, words in processes() if parent == pid and "multiprocessing.spawn" in words]


def cells(out: Path) -> list[int]:
    return sorted(cell for part in parts(out) for cell in pyarrow.parquet.read_table(part)["cell"].to_pylist())


@pytest.mark.slow
def test_killed_it_leaves_no_process_and_goes_on_with_what_is_missing(
    launched: Callable[..., Launched], tmp_path: Path
) -> None:
    out, path = tmp_path / "out", sweep_file(tmp_path, SLOW, SLOW_PRESS)
    run = launched("sweep", str(path), "--workers", "2", out=out)
    wait_for("two workers and two parts", lambda: len(workers_of(run.pid)) == 2 and len(parts(out)) >= 2)
    children = workers_of(run.pid)
    run.signal(signal.SIGKILL)
    run.end(-signal.SIGKILL)
    wait_for("the end of the workers", lambda: not alive(children))
    before = cells(out)
    stamps = {part: part.stat().st_mtime_ns for part in parts(out)}
    assert 0 < len(before) < CELLS
    assert not read(out).finished
    again = launched("sweep", str(path), "--workers", "2", out=out)
    wait_for("more parts", lambda: len(parts(out)) > len(stamps) or not again.is_there())
    assert {part: part.stat().st_mtime_ns for part in stamps if part.exists()} in (stamps, {})
    again.end(0)
    table = read(out)
    assert table.finished
    assert table["cell"].tolist() == list(range(CELLS))
    whole = swept(tmp_path, SLOW, SLOW_PRESS, out=tmp_path / "whole", workers=2)
    assert {name: column.tolist() for name, column in table.columns.items()} == {
        name: column.tolist() for name, column in whole.columns.items()
    }


@pytest.mark.slow
def test_interrupted_once_it_stores_what_is_under_way_and_says_how_to_go_on(
    launched: Callable[..., Launched], tmp_path: Path
) -> None:
    out, path = tmp_path / "out", sweep_file(tmp_path, SLOW, SLOW_PRESS)
    run = launched("sweep", str(path), "--workers", "2", out=out)
    wait_for("a part", lambda: parts(out))
    run.signal(signal.SIGINT)
    run.end(1)
    said = re.search(r"Stopping after the cells in progress \((\d+)\); interrupt again to end at once", run.stderr)
    assert said
    assert f"to continue: haploop sweep {out / 'sweep.toml'} --out {out}" in run.stderr
    assert "Traceback" not in run.stderr
    done = cells(out)
    assert 0 < int(said[1]) <= len(done) < CELLS
    again = launched("sweep", str(out / "sweep.toml"), "--workers", "2", out=out)
    again.end(0)
    assert read(out)["cell"].tolist() == list(range(CELLS))


@pytest.mark.slow
@pytest.mark.parametrize("wait_s", [0.0, 0.1, 0.3, 0.6])
def test_interrupted_while_its_workers_start_it_says_so_and_no_worker_shows_a_traceback(
    wait_s: float, tmp_path: Path
) -> None:
    path = sweep_file(tmp_path, SLOW, SLOW_PRESS)
    words = ["sweep", str(path), "--workers", "2", "--out", str(tmp_path / "out")]
    run = subprocess.Popen([*HAPLOOP, *words], stderr=subprocess.PIPE, text=True, start_new_session=True)
    wait_for("a process of the sweep", lambda: any(parent == run.pid for _, parent, *_ in processes()))
    time.sleep(wait_s)
    os.killpg(run.pid, signal.SIGINT)
    _, said = run.communicate(timeout=PATIENCE_S)
    assert run.returncode == 1, said
    assert "Interrupted" in said or "Stopping after the cells in progress" in said
    assert not any(words in said for words in ("Traceback", "cannot be started"))


@pytest.mark.slow
def test_interrupted_twice_it_ends_at_once_and_keeps_what_was_stored(
    launched: Callable[..., Launched], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    path = sweep_file(tmp_path, SLOW, SLOW_PRESS.replace("duration = 0.3", "duration = 2000.0"))
    run = launched("sweep", str(path), "--workers", "2", out=out)
    # The first cells take minutes: when the workers are busy, nothing is done yet.
    wait_for("busy workers", lambda: (out / "parts").exists() and len(workers_of(run.pid)) == 2)
    children = workers_of(run.pid)
    run.signal(signal.SIGINT)
    run.says("Stopping")
    run.signal(signal.SIGINT)
    run.end(1)
    assert "Interrupted at once" in run.stderr
    assert "Traceback" not in run.stderr
    wait_for("the end of the workers", lambda: not alive(children))


@pytest.mark.slow
def test_a_full_disk_is_said_and_loses_nothing_that_was_written(
    launched: Callable[..., Launched], tmp_path: Path
) -> None:
    """The first part is small and fits."""
    text = 'repeat = 20\n[axes]\n"wall.stiffness" = { from = 10, to = 400, step = 10 }\n'
    out, path = tmp_path / "out", sweep_file(tmp_path, text)
    run = launched("sweep", str(path), "--workers", "1", out=out, disk_bytes=LIMIT_BYTES)
    run.end(1)
    assert f"Writing {out}" in run.stderr
    assert "File too large" in run.stderr
    assert "the same command continues" in run.stderr
    assert "Traceback" not in run.stderr
    assert not list(out.rglob("*.part"))
    kept = cells(out)
    assert kept
    assert f"The {len(kept)} cells written before are safe" in run.stderr
    again = launched("sweep", str(path), "--workers", "1", out=out)
    again.end(0)
    assert read(out)["cell"].tolist() == list(range(800))


@pytest.mark.slow
def test_a_second_sweep_into_the_same_directory_is_refused(launched: Callable[..., Launched], tmp_path: Path) -> None:
    out, path = tmp_path / "out", sweep_file(tmp_path, SLOW, SLOW_PRESS)
    run = launched("sweep", str(path), "--workers", "1", out=out)
    wait_for("a part", lambda: parts(out))
    second = launched("sweep", str(path), "--workers", "1", out=out)
    second.end(2)
    assert f"Another sweep (process {run.pid}) is writing to {out}" in second.stderr
    assert run.is_there()


@pytest.mark.slow
def test_a_directory_that_vanishes_is_said(launched: Callable[..., Launched], tmp_path: Path) -> None:
    out, path = tmp_path / "out", sweep_file(tmp_path, SLOW, SLOW_PRESS)
    run = launched("sweep", str(path), "--workers", "1", out=out)
    wait_for("a part", lambda: parts(out))
    out.rename(tmp_path / "elsewhere")  # at once, whatever is being written
    run.end(1)
    assert "failed: No such file or directory." in run.stderr
    assert "Traceback" not in run.stderr


def test_a_directory_that_holds_something_else_is_refused(launched: Callable[..., Launched], tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "kept.txt").write_text("mine")
    run = launched("sweep", str(sweep_file(tmp_path)), out=out)
    run.end(2)
    assert "must be new or empty" in run.stderr
    assert [path.name for path in out.iterdir()] == ["kept.txt"]


@pytest.mark.parametrize(
    ("missing", "options", "said"),
    [
        ("pyarrow", [], "pip install 'haploop[parquet]'"),
        ("jax", ["--jax"], "pip install 'haploop[jax]'"),
        ("distributed", ["--dask", "tcp://127.0.0.1:1"], "pip install 'haploop[cluster]'"),
    ],
)
def test_what_is_not_installed_is_named_before_anything_is_started(
    missing: str, options: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, missing, None)
    answer = ask("sweep", str(sweep_file(tmp_path)), "--out", str(tmp_path / "o"), *options)
    assert (answer.status, answer.broken()) == (2, "")
    assert said in answer.stderr


def test_a_number_of_workers_below_one_is_refused(tmp_path: Path) -> None:
    answer = ask("sweep", str(sweep_file(tmp_path)), "--workers", "0", "--out", str(tmp_path / "o"))
    assert answer.status == 2
    assert "--workers must be at least 1" in answer.stderr


@pytest.mark.slow
def test_a_plugin_that_kills_its_worker_in_one_cell_is_one_row(
    launched: Callable[..., Launched], tmp_path: Path
) -> None:
    plugin = tmp_path / "deadly.py"
    plugin.write_text(
        "import os\nfrom typing import Annotated\n"
        "from haploop.controller.dissipation import Element, Motion, Quantity\n\n\n"
        'class Deadly(Element):\n    """Ends its process where it is strong."""\n\n    kind = "deadly"\n'
        '    force_N: Annotated[float, Quantity("N", at_least=0)] = 0.1\n\n'
        "    def __post_init__(self):\n        self.ticks = 0\n\n"
        "    def force(self, motion: Motion):\n        self.ticks += 1\n"
        "        if self.force_N > 0.85 and self.ticks > 20:\n            os._exit(3)\n"
        "        return -self.force_N * motion.v\n"
    )
    text = '[set]\ndissipation = [{ kind = "deadly" }]\n[axes]\n'
    text += '"dissipation.0.force_N" = { from = 0.1, to = 0.9, step = 0.1 }\n'
    run = launched(
        "sweep", str(sweep_file(tmp_path, text)), "--workers", "2", "--plugin", str(plugin), out=tmp_path / "out"
    )
    run.end(0)
    table = read(tmp_path / "out")
    assert table["ended"].tolist() == ["done"] * 8 + ["failed"]
    assert "The process that ran it died" in table["why"][8]


@pytest.mark.slow
def test_on_a_dask_cluster_of_which_a_worker_is_killed_the_table_is_the_same(
    launched: Callable[..., Launched], tmp_path: Path
) -> None:
    distributed = pytest.importorskip("distributed")
    few = SLOW.replace("480", "120")
    whole = swept(tmp_path, few, SLOW_PRESS, out=tmp_path / "whole")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0", host="127.0.0.1"
    ) as cluster:
        out = tmp_path / "out"
        run = launched("sweep", str(tmp_path / "sweep.toml"), "--dask", cluster.scheduler_address, out=out)
        wait_for("a part", lambda: parts(out) or not run.is_there())
        killed = next(iter(cluster.workers.values())).pid
        os.kill(killed, signal.SIGKILL)
        run.end(0)
        assert killed not in [worker.pid for worker in cluster.workers.values()]
    table = read(out)
    assert {name: column.tolist() for name, column in table.columns.items()} == {
        name: column.tolist() for name, column in whole.columns.items()
    }


def test_a_damaged_table_is_refused_and_gives_no_other_number(tmp_path: Path) -> None:
    """One bit here and there: of numbers, of names and units, and of the sweep's text."""
    out = tmp_path / "out"
    whole = swept(tmp_path, '[axes]\n"wall.stiffness" = [100, 200, 300]\n', out=out)
    for name in ("table.parquet", "sweep.toml"):
        content = (out / name).read_bytes()
        for at in range(0, len(content), 61):
            (out / name).write_bytes(content[:at] + bytes([content[at] ^ 1 << at % 8]) + content[at + 1 :])
            try:
                found = read(out)
            except TableError:
                continue
            assert (found.units, found.sweep, list(found.columns)) == (whole.units, whole.sweep, list(whole.columns))
            assert all([*map(str, found[key])] == [*map(str, whole[key])] for key in whole.columns)
        (out / name).write_bytes(content)


def test_a_finished_sweep_with_a_damaged_summary_is_told_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    axes, out = '[axes]\n"wall.stiffness" = [100, 200]\n', tmp_path / "out"
    swept(tmp_path, axes, out=out)
    for text, sentence in (
        ("{}", "is not that of a sweep: it lacks cells"),
        ("[", "is not a JSON object that haploop wrote"),
    ):
        (out / "summary.json").write_text(text)
        with pytest.raises(SystemExit, match="1"):
            swept(tmp_path, axes, out=out)
        assert sentence in capsys.readouterr().err
