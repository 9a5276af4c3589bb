"""Programs of somebody else's as controller of a run: their bits, their names, and how a run ends with them."""

from __future__ import annotations

import json
import os
import shlex
import signal
import sys
from pathlib import Path

import pytest

from haploop.launch.foreign import Program, ProgramError, check_wait, read_programs
from haploop.launch.processes.run_directory import CommandRefused
from helpers.live.foreign import PLAIN, Started
from helpers.live.in_process import ask
from helpers.live.launched import BRIEF, BRIEF_S, SCENE
from helpers.live.system import processes
from helpers.live.waiting import wait_for
from helpers.slowly import first_and_slowly

# Ways to fail that only a deadline finds.
WAITED_FOR = ("hang", "silent", "mute", "unfinished")


def test_a_foreign_controller_gives_the_bits_of_our_own_and_is_told_as_foreign(started: Started) -> None:
    own, foreign = started(node=None), started(sets=("run.verdict=pushed",))
    theirs, ours = foreign.summary(), own.summary()
    assert theirs["trajectory_sha256"] == ours["trajectory_sha256"]
    log, truth = foreign.log(), own.log()
    for topic in ("/plant", "/controller", "/energy"):
        assert {name: log[topic][name].tobytes() for name in log[topic]} == {
            name: truth[topic][name].tobytes() for name in truth[topic]
        }
    assert "programs" not in ours
    assert "programs.json" not in truth.attachments
    program = theirs["programs"]["controller"]
    assert program == {"name": "plain controller", "version": "1.5", "command": PLAIN, "own": False}
    assert theirs["programs"]["plant"]["own"]
    assert json.loads(log.attachments["programs.json"]) == theirs["programs"]
    assert theirs["verdict_rule"].startswith("By its window alone, since the controller was not haploop's own")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "words"),
    [
        pytest.param("die", "was killed by SIGKILL; the last tick all nodes had done is", marks=pytest.mark.slow),
        pytest.param("exit", "ended with exit status 3; the last tick all nodes", marks=pytest.mark.slow),
        pytest.param("hang", f"has not answered for {BRIEF_S} s and was ended", marks=pytest.mark.slow),
        pytest.param("silent", "no tick was done, though all nodes respond", marks=pytest.mark.slow),
        pytest.param("nan", "the controller gave a force that is not a finite number", marks=pytest.mark.slow),
        pytest.param("text", "In the loop, commands from tick", marks=pytest.mark.slow),
        pytest.param("garbage", "something else (A frame of 10 bytes is not msgpack", marks=pytest.mark.slow),
        pytest.param("mute", "the logger is at tick", marks=pytest.mark.slow),
        ("cut", "column wall has"),
        pytest.param("unfinished", "has done tick 3000", marks=pytest.mark.slow),
    ],
)
def test_however_a_foreign_controller_fails_the_run_ends_names_it_and_keeps_its_log(
    how: str, words: str, started: Started
) -> None:
    run = started(node=f"{PLAIN} --misbehave {how}", sets=(BRIEF,) if how in WAITED_FOR else ())
    run.end(1)
    assert words in run.stderr
    assert "plain_controller.py" in run.stderr or how == "nan"
    assert len(run.log()["/plant"]["x"]) > 100
    summary = json.loads((run.out_directory / "summary.json").read_text())
    assert summary["ended"] == "failed"
    assert summary["programs"]["controller"]["name"] == "plain controller"
    run.leaves_nothing()


@pytest.mark.slow
def test_a_run_so_short_that_nobody_waits_for_its_blocks_fails_where_they_are_missing(started: Started) -> None:
    run = started(node=f"{PLAIN} --misbehave mute", sets=("duration=0.5",))
    run.end(1)
    assert "The controller has ended at tick 500, but its blocks reach only tick" in run.stderr
    assert json.loads((run.out_directory / "summary.json").read_text())["ended"] == "failed"
    run.leaves_nothing()


@pytest.mark.slow
@pytest.mark.parametrize("numbers", [[signal.SIGKILL], [signal.SIGINT, signal.SIGINT]])
def test_a_program_that_ignores_every_end_and_its_children_end_with_the_run(
    numbers: list[signal.Signals], started: Started, tmp_path: Path
) -> None:
    """One of the children has a session of its own. The second interrupt ends at once, what never joined, too."""
    script = tmp_path / "stubborn.sh"
    first, second = (f"sleep {1000 + os.getpid()}.{n}" for n in (1, 2))  # nobody else's
    script.write_text(f"trap '' TERM INT HUP\nsetsid {first} &\n{second}\n")
    run = started(node=f"sh {script}", sets=())

    def asleep() -> list[int]:
        return [pid for pid, _, _, words in processes() if words in (first, second)]

    wait_for("both sleepers", lambda: len(asleep()) == 2)
    for number in numbers[:-1]:
        run.signal(number)
        assert run.ask("status"), "it has heeded the first"
    run.signal(numbers[-1])
    wait_for("their end", lambda: not asleep())
    run.end(-signal.SIGKILL if numbers == [signal.SIGKILL] else 1)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--node", "controller=no-such-program-9"], "'no-such-program-9', does not exist or cannot be executed"),
        (["--node", "controller=sh 'x"], "cannot be split into words: No closing quotation"),
        (["--node", "controller="], "is empty"),
        (["--node", "controller"], "--node expects ROLE=COMMAND"),
        (["--node", "logger=sh"], "the plant or the controller, but 'logger' was given"),
        (["--node", "plant=sh", "--node", "plant=sh"], "The plant was given twice"),
        (["--node", "plant=sh", "--external", "plant"], "The plant was given twice"),
        (["--external", "view"], "but 'view' was given"),
        (["--external", "plant", "--in-process"], "leave out --in-process"),
        (["--external", "plant", "--wait", "-1"], "--wait"),
        (["--external", "plant", "--wait", "nan"], "--wait"),
        (["--external", "plant", "--wait", "1e300"], "--wait"),
        (["--wait", "3"], "--wait is for --external"),
    ],
)
def test_what_cannot_be_a_program_is_refused_before_anything_is_written(
    options: list[str], words: str, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    answer = ask("run", str(SCENE), *options, "--out", str(out))
    assert (answer.status, answer.stdout, answer.broken()) == (2, "", "")
    assert words in answer.stderr
    assert not out.exists()


def test_of_a_long_command_the_program_is_named_and_not_its_directories() -> None:
    words = ("/deep" * 30 + "/python", "-I", "/deep" * 30 + "/mine.py", "--gain", "3")
    assert Program("controller", shlex.join(words), words).label == "controller (python -I mine.py --gain 3)"


def test_a_command_is_split_as_a_shell_splits_it_but_given_to_none() -> None:
    (program,) = read_programs([r'plant=sh -c "a b" $HOME `x` ; "c d"\ e'], []).values()
    assert program.words == ("sh", "-c", "a b", "$HOME", "`x`", ";", "c d e")
    assert check_wait(None) == 60.0
    for wait in (0.0, float("nan"), float("inf")):
        with pytest.raises(ProgramError):
            check_wait(wait)


def test_no_scene_can_name_a_program() -> None:
    for key in ("run.node", "run.nodes", "node", "external", "run.external", "run.programs"):
        assert ask("check", str(SCENE), "--set", f'{key}="sh"').status == 2, key
    schema = ask("check", "--schema")
    assert schema.status == 0
    assert not any("node" in key or "external" in key for key in json.loads(schema.stdout)["$defs"])


@pytest.mark.slow
def test_binary_on_stdout_from_the_start_harms_nobody_and_stands_in_the_prints(
    started: Started, tmp_path: Path
) -> None:
    script = tmp_path / "loud.sh"
    script.write_text(f'printf "\\377\\376\\033[2J\\000" ; exec {PLAIN} "$@"\n')
    run = started(node=f"sh {script}")
    assert run.summary()["ended"] == "done"
    assert (run.out_directory / "prints.txt").read_bytes().startswith(b"\xff\xfe\x1b[2J\0")
    assert "\x1b" not in run.stderr


@pytest.mark.slow
def test_a_change_that_a_foreign_controller_passes_over_is_refused_and_one_it_makes_is_not(started: Started) -> None:
    run = started(node=f"{PLAIN} --changes make", sets=("duration=600",), pace=("--pace", "2"))
    run.reaches(100)
    assert run.ask("set", set={"wall.stiffness": 200.0})["tick"] > 0
    with pytest.raises(CommandRefused, match=r"element 0 becomes damping .*, was refused: the controller's telemetry"):
        run.ask("swap", swap={"kind": "damping", "damping": 1.0})
    run.ask("stop")
    run.summary()
    made, passed_over, refusal, stop = run.log()["/events"]
    assert made["set"] == {"wall.stiffness": 200.0}
    assert (passed_over["swap"]["kind"], refusal["change"]["tick"]) == ("damping", passed_over["tick"])
    assert stop["stop"]


PLANT = """
import math, sys
sys.path.insert(0, {examples!r})
import seat

class Odd(seat.Seat):
    def _measured(self, *_):
        return {value} if self._tick >= 300 else 0.0

seat.Seat = Odd
seat.take_seat("odd plant", "1").run(lambda force: (0.0, 0.0), 0.0, 0.0)
"""


@pytest.mark.slow
@pytest.mark.parametrize("value", first_and_slowly("math.nan", "'x'", "[0.0]", "None", "-math.inf"))
def test_a_foreign_plant_whose_sample_is_no_number_ends_the_run_by_name(
    value: str, started: Started, tmp_path: Path
) -> None:
    script = tmp_path / "plant.py"
    examples = str(Path(__file__).parents[2] / "examples")
    script.write_text(PLANT.format(examples=examples, value=value))
    run = started("--node", f"plant={shlex.join([sys.executable, str(script)])}", node=None)
    run.end(1)
    assert "The plant's sample of tick 300 must be a list of 1 finite number, but [" in run.stderr
    assert "Not haploop's own in this run: the plant (" in run.stderr
    assert json.loads((run.out_directory / "summary.json").read_text())["ended"] == "failed"


def test_a_program_that_cannot_be_started_leaves_nothing(started: Started, tmp_path: Path) -> None:
    program = tmp_path / "program"
    program.write_text("no program")
    program.chmod(0o700)
    run = started(node=str(program))
    run.end(2)
    assert f"The controller ({program}) cannot be started: Exec format error." in run.stderr
    assert not run.out_directory.exists()
    run.leaves_nothing()
