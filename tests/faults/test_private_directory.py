"""The private directories of runs: listing and clearing up never touch what no run has made, nor a run that lives."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from haploop.launch.processes import private_directory, run_directory
from haploop.launch.spec import OutputError
from helpers.live.in_process import ask
from helpers.live.launched import LONG, SCENE
from helpers.live.waiting import wait_for
from helpers.slowly import first_and_slowly

LONG_AGO = (0, 0)
# Holds a directory's lock until its standard input closes, as a launcher does that nobody's list of processes shows.
HOLDER = """
import sys
from haploop.launch.processes import private_directory, run_directory
with private_directory.made() as path:
    run_directory.announce(path, f"ipc://{path}/clock.sock", "held", "nowhere")
    print(path, flush=True)
    sys.stdin.read()
"""


def tree(directory: Path) -> dict[str, bytes | str | None]:
    """Everything below a directory, with its content."""
    found = sorted(directory.rglob("*"))
    return {
        str(path.relative_to(directory)): str(path.readlink())
        if path.is_symlink()
        else path.read_bytes()
        if path.is_file()
        else None
        for path in found
    }


def dead(name: str = "abcdef") -> Path:
    """The directory of a run whose launcher was killed."""
    path = private_directory.base_directory() / name
    path.mkdir()
    for file in ("lock", "clock.sock", "loop.sock", "plant.sock", "controller.sock", "logger.sock", "run.part"):
        (path / file).write_bytes(b"haploop" if file == "lock" else b"")
    entry = {"pid": 1, "clock": f"ipc://{path}/clock.sock", "title": "dead", "out": "nowhere", "keys": None}
    (path / "run.json").write_text(json.dumps(entry))
    os.utime(path, LONG_AGO)
    return path


def test_status_clears_away_what_a_dead_run_has_left():
    path = dead()
    answer = ask("status")
    assert (answer.status, answer.stdout.strip()) == (0, "No run is live.")
    assert not path.exists()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["thesis", "abcdef", "ABCDEF", "abcdef0", "0a1b2c"])
def test_a_folder_that_no_run_has_made_stays_with_all_that_is_in_it(name, live_runs_here):
    """However it is named and however old it is: XDG_RUNTIME_DIR may be a folder of documents."""
    folder = private_directory.base_directory() / name
    (folder / "deeper").mkdir(parents=True)
    (folder / "thesis.txt").write_text("three years")
    (folder / "deeper" / "run.json").write_text("{}")
    (private_directory.base_directory() / "letter.txt").write_text("dear")
    empty = private_directory.base_directory() / f"{name[:-1]}9"
    empty.mkdir()
    for path in (folder, empty):
        os.utime(path, LONG_AGO)
    before = tree(live_runs_here)
    assert ask("status").status == 0
    assert tree(live_runs_here) == before


def test_a_directory_with_the_names_of_a_run_but_another_lock_stays(live_runs_here):
    (dead() / "lock").write_text("of another program")
    before = tree(live_runs_here)
    assert run_directory.live_runs() == []
    assert tree(live_runs_here) == before


@pytest.mark.parametrize("name", ["notes.txt", "sub/deep.txt", "run.json.bak", "clock.sock/inner.txt"])
def test_a_file_that_no_run_writes_keeps_a_dead_directory_as_it_is(name, live_runs_here):
    path = dead()
    if name.startswith("clock.sock"):
        (path / "clock.sock").unlink()
    (path / name).parent.mkdir(exist_ok=True)
    (path / name).write_text("mine")
    before = tree(live_runs_here)
    assert run_directory.live_runs() == []
    assert "mine" in (path / name).read_text()
    assert tree(live_runs_here) == before or name.startswith("clock.sock")


@pytest.mark.parametrize("of", ["directory", "lock", "entry", "socket"])
def test_no_link_is_followed(of, tmp_path, live_runs_here):
    """Neither one in the place of a run's directory nor one among its files."""
    documents = dead("123456").rename(tmp_path / "documents")
    (documents / "thesis.txt").write_text("three years")
    os.utime(documents, LONG_AGO)
    before = tree(tmp_path)
    base = private_directory.base_directory()
    if of == "directory":
        (base / "abcdef").symlink_to(documents)
    else:
        name = {"lock": "lock", "entry": "run.json", "socket": "clock.sock"}[of]
        (dead() / name).unlink()
        (base / "abcdef" / name).symlink_to(documents / "thesis.txt")
    assert run_directory.live_runs() == []
    assert tree(tmp_path) == before
    assert (base / "abcdef").exists() == (of in ("directory", "lock"))


@pytest.mark.parametrize("name", ["lock", "run.json"])
def test_a_pipe_in_the_place_of_a_file_holds_nobody_up(name):
    path = dead()
    (path / name).unlink()
    os.mkfifo(path / name)
    assert ask("status").status == 0


def test_a_base_directory_that_is_a_link_is_refused_with_a_sentence(tmp_path, live_runs_here):
    (tmp_path / "documents").mkdir(mode=0o700)
    (live_runs_here / "haploop").symlink_to(tmp_path / "documents")
    answer = ask("status")
    assert answer.status == 2
    assert answer.stderr.startswith(f"{live_runs_here / 'haploop'} must be a directory, not a link or a file;")
    assert "Traceback" not in answer.stderr


@pytest.mark.parametrize("of", first_and_slowly("mode", "file", "closed"))
def test_a_base_directory_that_cannot_be_used_is_a_sentence_and_no_run_is_started(
    of, live_runs_here, tmp_path, monkeypatch
):
    base, words = live_runs_here / "haploop", "with mode 0755; repair it with chmod 700"
    if of == "mode":
        base.mkdir()
        base.chmod(0o755)
    elif of == "file":
        base.write_text("a file")
        words = "must be a directory, not a link or a file"
    else:  # where not even root can make anything
        monkeypatch.setenv("XDG_RUNTIME_DIR", "/proc")
        words = "The directory of live runs /proc/haploop cannot be made: "
    for arguments in (["status"], ["run", str(SCENE), "--out", str(tmp_path / "out")]):
        answer = ask(*arguments)
        assert answer.status == 2
        assert words in answer.stderr
        assert "Traceback" not in answer.stderr
    assert not (tmp_path / "out").exists()


def test_a_run_is_live_as_long_as_its_launcher_holds_the_lock_whatever_its_process_number_says():
    """As one in another container, whose processes are not seen here; when it is killed, its directory goes."""
    holder = subprocess.Popen([sys.executable, "-c", HOLDER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert holder.stdout
        path = Path(holder.stdout.readline().strip())
        entry = json.loads((path / "run.json").read_text())
        (path / "run.json").write_text(json.dumps({**entry, "pid": 2**22 + 1}))
        os.utime(path, LONG_AGO)
        assert [run.id for run in run_directory.live_runs()] == [path.name]
    finally:
        holder.kill()
        holder.communicate()
    assert path.exists()
    assert run_directory.live_runs() == []
    assert not path.exists()


@pytest.mark.parametrize("pid", [-1, 0, 2**70, "7", None, True, [1], {}, 1.5])
@pytest.mark.parametrize("held", [True, False])
def test_an_impossible_process_number_in_an_entry_is_no_traceback(pid, held):
    with private_directory.made() as living:
        path = living if held else dead()
        (path / "run.json").write_text(json.dumps({"pid": pid, "clock": "", "title": "", "out": ""}))
        run_directory.live_runs()
        assert path.exists() == held


@pytest.mark.parametrize("text", ["", "{", "[]", "7", "null", '{"pid": 1}', "[" * 100_000, "\xff"])
def test_an_entry_that_is_none_is_passed_over(text):
    with private_directory.made() as path:
        (path / "run.json").write_bytes(text.encode("latin-1"))
        assert run_directory.live_runs() == []
        assert path.exists()


@pytest.mark.slow
def test_a_run_in_the_midst_of_starting_is_no_dead_one(running):
    """Another run that starts at that moment must not clear its directory away, however old it seems."""
    with private_directory.made() as early:
        os.utime(early, LONG_AGO)
        run = running(sets=(*LONG, "duration=0.1"), pace=())
        assert run.summary()["ended"] == "done"
        assert early.exists()
        wait_for("only the early one", lambda: [path.name for path in early.parent.iterdir()] == [early.name])
    assert not early.exists()


def test_a_file_put_beside_the_sockets_of_a_run_outlives_it():
    with private_directory.made() as path:
        (path / "notes.txt").write_text("mine")
    assert tree(path) == {"notes.txt": b"mine"}


RACE = """
import random, sys, time
from haploop.launch.processes import private_directory, run_directory
seed = int(sys.argv[1])
draw = random.Random(seed)
for round in range(40):
    with private_directory.made() as path:
        run_directory.announce(path, f"ipc://{path}/clock.sock", "race", "nowhere")
        for _ in range(draw.randrange(4)):
            run_directory.live_runs()
        assert (path / "run.json").exists() and path.name in [run.id for run in run_directory.live_runs()], path
    assert not path.exists()
"""


@pytest.mark.slow
def test_launchers_that_start_end_and_list_at_once_never_lose_a_directory(live_runs_here):
    crowd = [subprocess.Popen([sys.executable, "-c", RACE, str(n)], stderr=subprocess.PIPE) for n in range(6)]
    assert [one.communicate()[1].decode() for one in crowd] == [""] * 6
    assert list((live_runs_here / "haploop").iterdir()) == []


def test_a_directory_that_cannot_be_made_on_a_full_disk_leaves_nothing(monkeypatch, live_runs_here):
    whole = os.open

    def full(path, flags, *mode, **options):
        if flags & os.O_CREAT:
            raise OSError(28, "No space left on device")
        return whole(path, flags, *mode, **options)

    monkeypatch.setattr(os, "open", full)
    with pytest.raises(OutputError, match="cannot be made: No space left on device"), private_directory.made():
        pass
    assert list((live_runs_here / "haploop").iterdir()) == []
