"""The files of a run: a full disk, a directory that vanishes or holds something already."""

import json
import shutil
import signal

import pytest

import haploop.logger
from helpers.live.launched import SCENE, command, same_bits

LIMIT_BYTES = 4_000_000


def test_a_disk_that_fills_ends_the_run_with_an_error_that_names_the_file_and_the_log_reads(running, undisturbed):
    run = running(disk_bytes=LIMIT_BYTES, pace=())
    run.end(1)
    run.leaves_nothing()
    assert f"Writing the log {run.out / 'log.mcap'} failed after" in run.stderr
    assert "File too large" in run.stderr
    assert "Traceback" not in run.stderr
    assert (run.out / "log.mcap").stat().st_size <= LIMIT_BYTES
    assert same_bits(haploop.logger.read(run.out), undisturbed) >= 1000


@pytest.mark.slow
def test_a_disk_that_fills_ends_a_run_in_one_process_with_the_same_error(launched, tmp_path, undisturbed):
    out = tmp_path / "out"
    run = launched("run", str(SCENE), "--set", "duration=600", "--in-process", out=out, disk_bytes=LIMIT_BYTES)
    run.end(1)
    assert f"Writing the log {out / 'log.mcap'} failed after" in run.stderr
    assert "Traceback" not in run.stderr
    assert same_bits(haploop.logger.read(out), undisturbed) >= 1000


@pytest.mark.slow
def test_a_summary_that_cannot_be_written_fails_the_run_and_leaves_no_part_of_one(running, undisturbed):
    run = running()
    run.reaches(200)
    (run.out / "summary.json").mkdir()
    run.ask("stop")
    run.end(1)
    run.leaves_nothing()
    assert f"The summary {run.out / 'summary.json'} could not be written" in run.stderr
    assert "Traceback" not in run.stderr
    assert sorted(path.name for path in run.out.iterdir()) == ["log.mcap", "scene.toml", "summary.json"]
    assert same_bits(haploop.logger.read(run.out), undisturbed) >= 200


@pytest.mark.slow
def test_a_directory_that_is_removed_in_mid_run_fails_the_run_with_a_clear_error(running):
    run = running()
    run.reaches(200)
    shutil.rmtree(run.out)
    run.ask("stop")
    run.end(1)
    run.leaves_nothing()
    assert f"The summary {run.out / 'summary.json'} could not be written: No such file or directory." in run.stderr
    assert "Traceback" not in run.stderr


@pytest.mark.slow
@pytest.mark.parametrize("options", [[], ["--in-process"]])
def test_a_directory_that_holds_something_is_refused_and_stays_as_it_was(options, launched, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "kept.txt").write_text("an earlier run")
    run = launched("run", str(SCENE), *options, out=out)
    run.end(2)
    assert f"{out} must be new or empty" in run.stderr
    assert [(path.name, path.read_text()) for path in out.iterdir()] == [("kept.txt", "an earlier run")]


def test_a_file_where_the_directory_should_be_is_refused(launched, tmp_path):
    out = tmp_path / "out"
    out.write_text("a file")
    run = launched("run", str(SCENE), out=out)
    run.end(2)
    assert f"The directory {out} cannot be made" in run.stderr
    assert out.read_text() == "a file"


@pytest.mark.slow
def test_a_live_run_whose_launcher_hangs_does_not_hide_the_others_from_status(running):
    hanging, going = running(), running()
    hanging.reaches(1)
    going.reaches(1)
    first, second = hanging.live.id, going.live.id
    hanging.signal(signal.SIGSTOP)
    answer = command("status", "--json")
    hanging.signal(signal.SIGCONT)
    assert answer.returncode == 0
    assert json.loads(answer.stdout).keys() == {second}
    assert f"Run {first}" in answer.stderr
