"""A plugin that is loaded anew while its run goes on: what breaks changes nothing, and time goes on meanwhile."""

from __future__ import annotations

import re
import threading
from typing import Any

import pytest

from haploop.launch.processes import run_directory
from haploop.launch.runs.replay import replay
from helpers.live.launched import BRIEF, LONG
from helpers.live.system import alive
from helpers.live.waiting import wait_for
from helpers.scenes.brake import source

BREAKS = {
    "sys.exit(3)": "SystemExit: 3",
    "os._exit(3)": "ended the process it was tried in .*: exit status 3",
    "os.kill(os.getpid(), signal.SIGKILL)": "ended the process it was tried in .*: killed by SIGKILL",
    "recurse()": "RecursionError",
}
SWAP: dict[str, Any] = {"swap": {"kind": "brake", "damping": 0.05, "acts": "always"}}


def braked(running, scene, tmp_path):
    """Returns the file of a plugin and a run, a hundred ticks old, that was started with it."""
    plugin = tmp_path / "brake.py"
    plugin.write_text(source())
    run = running("--plugin", str(plugin), scene=scene)
    run.reaches(100)
    return plugin, run


@pytest.mark.slow
def test_a_reload_that_breaks_in_any_way_changes_nothing_and_time_goes_on(running, scene, tmp_path):
    """Neither the element at work, nor its file, nor the kinds at hand, nor one bit of the run."""
    plugin, run = braked(running, scene, tmp_path)
    kept, options = sorted((run.out / "plugins").iterdir()), run.ask("options")
    for statement, words in BREAKS.items():
        plugin.write_text(source(at_making=statement))
        with pytest.raises(run_directory.CommandRefused, match=words):
            run.ask("swap", **SWAP, reload=True)
    plugin.write_text(source().replace("Quantity(", "Quanity("))
    with pytest.raises(run_directory.CommandRefused, match="NameError: name 'Quanity'"):
        run.ask("swap", **SWAP, reload=True)
    plugin.write_text(source() + source().replace('"brake"', '"damping"').replace("class Brake", "class Damping"))
    with pytest.raises(run_directory.CommandRefused, match="now defines damping, a kind that the run has from another"):
        run.ask("swap", **SWAP, reload=True)
    assert sorted((run.out / "plugins").iterdir()) == kept
    assert run.ask("options")["kinds"] == options["kinds"]
    run.reaches(run.ask("status")["granted"] + 100)
    run.ask("stop")
    assert [e["kind"] for e in run.summary()["energy"]["elements"]] == ["brake"]
    assert replay(run.out).differences == []


@pytest.mark.slow
def test_time_goes_on_while_a_file_is_tried_and_other_commands_are_answered(running, scene, tmp_path):
    """The file waits for another that the test makes when time has gone on; then it is taken up."""
    plugin, flag = tmp_path / "brake.py", tmp_path / "flag"
    plugin.write_text(source())
    run = running("--plugin", str(plugin), scene=scene)
    began = run.reaches(100)
    here = tmp_path / "here"
    waits = f"Path({str(here)!r}).touch()\nwhile not Path({str(flag)!r}).exists(): time.sleep(0.01)"
    plugin.write_text(source(waits).replace("-self", "-2 * self"))
    said: list[dict[str, Any]] = []
    asking = threading.Thread(target=lambda: said.append(run.ask("swap", **SWAP, reload=True)))
    asking.start()
    wait_for("the trial", here.exists)
    run.reaches(began + 200)
    with pytest.raises(run_directory.CommandRefused, match="another swap is being tried"):
        run.ask("swap", **SWAP)
    assert not said
    flag.touch()
    asking.join()
    assert said[0]["tick"] > began + 200
    run.reaches(said[0]["tick"] + 100)
    run.ask("stop")
    elements = run.summary()["energy"]["elements"]
    assert [(e["kind"], e["from_tick"]) for e in elements] == [("brake", 0), ("brake", said[0]["tick"])]
    rows = run.log()["/controller"]
    tick = said[0]["tick"]
    assert (rows["dissipation.0"][tick:] == -0.1 * rows["v"][tick:]).all()


@pytest.mark.slow
def test_undo_brings_back_the_code_before_a_reload_and_one_taken_back_is_told_at_once_with_its_line(
    running, scene, tmp_path
):
    plugin, run = braked(running, scene, tmp_path)
    plugin.write_text(source().replace("-self", "-2 * self"))
    text, doubled = run_directory.ask(run.live, "swap", **SWAP, reload=True)
    assert "to go back: undo" in text
    assert "If it raises or gives no finite number within its first second, what was there before is restored" in text
    undone = run.ask("undo")["tick"]
    plugin.write_text(source(at_force="1 / (self.tick < 50)"))
    tick = run.ask("swap", **SWAP, reload=True)["tick"]
    words = rf"gave no force at tick {tick + 50}: ZeroDivisionError: .* \(brake.*, line \d+\)\. The swap is taken back"
    wait_for("the sentence, while the run goes on", lambda: re.search(words, run.stderr))
    plugin.write_text(source(at_force="1 / (self.tick < 0)"))
    with pytest.raises(run_directory.CommandRefused, match=r"ZeroDivisionError: .* \(brake.*, line \d+\)"):
        run.ask("swap", **SWAP, reload=True)
    run.ask("stop")
    run.summary()
    rows = run.log()["/controller"]
    for first, last, factor in ((doubled["tick"], undone, -0.1), (undone, tick, -0.05)):
        assert (rows["dissipation.0"][first:last] == factor * rows["v"][first:last]).all()


@pytest.mark.slow
def test_a_reload_that_never_ends_is_answered_and_the_run_ends_as_it_would_have(running, scene, tmp_path):
    plugin, run = braked(running, scene, tmp_path)
    plugin.write_text(source(at_force="time.sleep(1000)"))
    with pytest.raises(run_directory.CommandRefused, match="it took longer than 10 s while the element brake was"):
        run.ask("swap", **SWAP, reload=True)
    run.ask("stop")
    assert run.summary()["ended"] == "stopped"


@pytest.mark.slow
def test_a_run_that_ends_while_a_file_is_tried_leaves_nothing(running, scene, tmp_path):
    plugin, run = braked(running, scene, tmp_path)
    plugin.write_text(source(f"Path({str(tmp_path / 'here')!r}).write_text(str(os.getpid())); time.sleep(1000)"))

    def ask() -> None:
        with pytest.raises(run_directory.RunNotFound):
            run.ask("swap", **SWAP, reload=True)

    asking = threading.Thread(target=ask)
    asking.start()
    wait_for("the trial", lambda: (tmp_path / "here").exists() and (tmp_path / "here").read_text())
    run.ask("stop")
    run.summary()
    asking.join()
    run.leaves_nothing()
    wait_for("the end of the trial", lambda: not alive([int((tmp_path / "here").read_text())]))


@pytest.mark.slow
def test_the_launcher_never_runs_a_plugin_while_its_run_goes_on(running, scene, tmp_path):
    plugin, who = tmp_path / "brake.py", tmp_path / "who"
    plugin.write_text(source(f"with open({str(who)!r}, 'a') as file: print(os.getpid(), file=file)"))
    run = running("--plugin", str(plugin), scene=scene)
    run.reaches(100)
    run.ask("swap", **SWAP)
    run.ask("swap", **SWAP, reload=True)
    run.ask("stop")
    run.summary()
    pids = [int(line) for line in who.read_text().split()]
    assert run.nodes["controller"] in pids
    assert run.pid not in pids


@pytest.mark.slow
def test_a_change_that_hangs_in_the_controller_alone_is_refused_at_its_tick_and_the_run_goes_on(
    running, scene, tmp_path
):
    """As no trial elsewhere can find out. Who asked is told so, too, unless that takes a busy machine 3 s."""
    plugin = tmp_path / "brake.py"
    plugin.write_text(source())
    run = running("--plugin", str(plugin), scene=scene, sets=(*LONG, BRIEF))
    run.reaches(100)
    there = "sys.argv[0].endswith(os.path.join('controller', 'node.py'))"
    plugin.write_text(source(at_making=f"time.sleep(1000) if {there} else None"))
    try:
        told = run_directory.ask(run.live, "swap", **SWAP, reload=True)[0]
    except run_directory.CommandRefused as refusal:
        told = str(refusal)
    assert re.search(r"when time reaches it|The change at tick \d+, .*DeadlineOver", told)
    run.reaches(run.ask("status")["granted"] + 500)
    run.ask("stop")
    assert run.summary()["ended"] == "stopped"
    refused = [event["refused"] for event in run.log()["/events"] if "refused" in event]
    assert len(refused) == 1
    assert "DeadlineOver" in refused[0]


@pytest.mark.slow
@pytest.mark.parametrize("statement", ["os._exit(0)", "os.kill(os.getpid(), signal.SIGKILL)", "pass"])
def test_a_file_that_ends_the_process_that_judges_the_run_leaves_it_undecided(statement, running, scene, tmp_path):
    """The judge goes on where the run has ended; nothing of the answer is lost."""
    plugin = tmp_path / "brake.py"
    plugin.write_text(source(at_force=f"self.tick > 1050 and {statement}"))
    if statement == "pass":
        plugin.write_text(source())
    run = running(
        "--plugin", str(plugin), scene=scene, sets=("duration=1", "wall.position=-0.001", "run.verdict=pushed"), pace=()
    )
    summary = run.summary()
    assert summary["ended"] == "done"
    assert ("ended with status" in summary["verdict_rule"]) == (statement != "pass")
    assert (summary["verdict"] == "undecided") == (statement != "pass")
