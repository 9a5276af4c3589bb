"""The directory a run writes to: one run's alone, however many start at once, and nothing is left of one that fails."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from haploop.launch.runs.start import prepare
from haploop.launch.spec import OutputError, make_output
from haploop.tools.sweep.store import Store
from haploop.tools.sweep.table import make_schema
from helpers.live.launched import HAPLOOP, SCENE, command
from helpers.live.waiting import PATIENCE_S
from helpers.slowly import first_and_slowly

# Round after round, processes that stand at a barrier make the directory at the same instant; prints what each got.
CROWD = """
import os, sys
from pathlib import Path
from haploop.launch.spec import OutputError, make_output
wanted, there, rounds, size = sys.argv[1], sys.argv[2] == "True", int(sys.argv[3]), int(sys.argv[4])
for turn in range(rounds):
    out = None if wanted == "-" else Path(wanted, str(turn))
    if there:
        out.mkdir(parents=True)
    gate, ends = os.pipe(), []
    for _ in range(size):
        told = os.pipe()
        if os.fork() == 0:
            os.close(gate[1])
            os.read(gate[0], 1)
            try:
                said = f"got {make_output(out, Path('tap.toml'))}"
            except OutputError as error:
                said = f"refused {error}"
            os.write(told[1], said.encode())
            os._exit(0)
        os.close(told[1])
        ends.append(told[0])
    os.close(gate[0])
    os.close(gate[1])
    print(*(os.read(end, 1000).decode() for end in ends), sep="|", flush=True)
    for end in ends:
        os.wait()
        os.close(end)
"""
ROUNDS, SIZE = 60, 8
# haploop, which prints an empty line as soon as it heeds signals.
BEGIN = """
from haploop.tools.cli.main import LeavingAtOnce, main
kept = LeavingAtOnce.__enter__
def enter(self):
    kept(self)
    LeavingAtOnce.__enter__ = kept
    print(flush=True)
LeavingAtOnce.__enter__ = enter
main()
"""


def crowd(cwd: Path, out: str, there: bool = False) -> list[list[str]]:
    """What the processes of each round say."""
    words = [sys.executable, "-c", CROWD, out, str(there), str(ROUNDS), str(SIZE)]
    done = subprocess.run(words, cwd=cwd, capture_output=True, text=True, check=True)
    return [line.split("|") for line in done.stdout.splitlines()]


@pytest.mark.parametrize("there", first_and_slowly(False, True))
def test_of_many_that_start_at_once_into_one_directory_only_one_gets_it(there, tmp_path):
    rounds = crowd(tmp_path, str(tmp_path / "out"), there)
    assert len(rounds) == ROUNDS
    for said in rounds:
        assert sorted(words.split()[0] for words in said) == ["got", *["refused"] * (SIZE - 1)]
        assert all("must be new or empty" in words for words in said if words.startswith("refused"))


@pytest.mark.slow
def test_many_that_start_at_once_without_a_directory_get_one_each(tmp_path):
    said = [words for one in crowd(tmp_path, "-") for words in one]
    assert len(set(said)) == ROUNDS * SIZE
    assert {words.split()[0] for words in said} == {"got"}


@pytest.mark.slow
@pytest.mark.parametrize("there", [False, True])
@pytest.mark.parametrize("name", ["scene.toml", "plugins"])
def test_a_disk_that_is_full_as_the_directory_is_made_leaves_nothing(name, there, tmp_path, monkeypatch):
    """But the directory itself where the user had made it."""
    plugin, out = tmp_path / "brake.py", tmp_path / "deep" / "out"
    plugin.write_text(
        (Path(__file__).parents[2] / "docs/elements.md").read_text().split("```python\n")[1].split("```")[0]
    )
    if there:
        out.mkdir(parents=True)
    whole = Path.open

    def full(path, mode="r", *more, **options):
        if "w" in mode and name in str(path):
            raise OSError(28, "No space left on device")
        return whole(path, mode, *more, **options)

    monkeypatch.setattr(Path, "open", full)
    with pytest.raises(OutputError, match="No space left on device"):
        prepare(SCENE, plugins=[plugin], out=out)
    assert list(out.parent.iterdir()) == ([out] if there else [])
    assert not there or list(out.iterdir()) == []


def test_a_directory_in_which_not_even_a_file_can_be_made_is_not_left_behind(tmp_path, monkeypatch):
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "touch", full)
    with pytest.raises(OutputError, match="cannot be made: No space left on device"):
        make_output(tmp_path / "out", SCENE)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_run_whose_sockets_cannot_be_made_leaves_no_directory(live_runs_here, tmp_path):
    (live_runs_here / "haploop").write_text("a file")
    kept = tmp_path / "kept"
    kept.mkdir()
    for out in (tmp_path / "out", kept):
        answer = command("run", str(SCENE), "--out", str(out))
        assert answer.returncode == 2
        assert "Traceback" not in answer.stderr
    assert list(tmp_path.iterdir()) == [kept]
    assert list(kept.iterdir()) == []


@pytest.mark.parametrize("after_s", first_and_slowly(0.3, 0.02, 0.06, 0.1, 0.15, 0.2, 0.4, 0.5))
@pytest.mark.parametrize("number", first_and_slowly(signal.SIGTERM, signal.SIGINT))
def test_a_signal_in_the_first_half_second_is_never_a_traceback_and_leaves_nothing_half_made(after_s, number, tmp_path):
    """Until haploop heeds signals, the words are Python's; from there on they are haploop's."""
    out = tmp_path / "out"
    words = ["run", str(SCENE), "--set", "duration=600", "--json", "--out", str(out)]
    run = subprocess.Popen(
        [sys.executable, "-c", BEGIN, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert run.stdout
    run.stdout.readline()
    try:
        run.wait(timeout=after_s)
    except subprocess.TimeoutExpired:
        run.send_signal(number)
    said, complaints = run.communicate(timeout=PATIENCE_S)
    assert "Traceback" not in complaints
    if said:
        assert json.loads(said)["ended"] == "stopped"
        assert (out / "summary.json").exists()
    else:
        assert run.returncode == 1
        assert not out.exists()
        assert complaints.strip()


@pytest.mark.slow
def test_a_run_without_enough_open_files_is_a_sentence_and_leaves_nothing(tmp_path, live_runs_here):
    limit = "import os, resource, sys; resource.setrlimit(resource.RLIMIT_NOFILE, (int(sys.argv[1]),) * 2)"
    for count in (12, 14):
        words = [*HAPLOOP, "run", str(SCENE), "--out", str(tmp_path / "out")]
        starter = [sys.executable, "-c", f"{limit}; os.execv(sys.argv[2], sys.argv[2:])", str(count), *words]
        done = subprocess.run(starter, capture_output=True, text=True)
        assert done.returncode != 0
        assert f"opens up to 64 files, but here it may open {count}" in done.stderr
        assert "Traceback" not in done.stderr
        assert list(tmp_path.iterdir()) == []
    assert command("status").returncode == 0
    assert list((live_runs_here / "haploop").iterdir()) == []


def test_what_a_sweep_has_not_written_stays_in_its_directory(tmp_path):
    """Unfinished downloads, and tables of somebody else's in the folder of its parts."""
    pytest.importorskip("pyarrow")
    out = tmp_path / "out"
    foreign = [out / "film.mkv.part", out / "deeper" / "letter.part", out / "parts" / "mine.parquet"]
    for path in foreign:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("mine")
    left = out / "parts" / "000000000064.parquet.part"
    left.write_bytes(b"PAR1")
    with Store(out, make_schema([], "")) as store:
        assert not left.exists()
        store.finish()
    assert [path.read_text() for path in foreign] == ["mine"] * 3
