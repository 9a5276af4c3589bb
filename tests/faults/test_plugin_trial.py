"""A plugin is tried in a process of its own: whatever it does there is a sentence here, and the run goes on."""

from __future__ import annotations

import os
import re
import threading
from pathlib import Path
from typing import Any

import pytest

from haploop.controller.dissipation import ElementError, PluginError
from haploop.controller.dissipation.registry import load_source
from haploop.launch.processes import run_directory
from haploop.launch.processes.plugin_trial import PluginTrial
from haploop.launch.runs.replay import replay
from haploop.protocol.scene.scene import ElementTable
from helpers.live.launched import SCENES, alive, command, first_and_slowly, processes, wait_for

PLUGIN = """
import ctypes, os, signal, subprocess, sys, time
from pathlib import Path
from typing import Annotated
from haploop.controller.dissipation import Element, Quantity
def recurse(): recurse()
{at_import}

class Brake(Element):
    kind = "brake"
    damping: Annotated[float, Quantity("N s/m", at_least=0, about="how much")] = 0.05

    def __post_init__(self):
        {at_making}

    def force(self, motion):
        {at_force}
        return -self.damping * motion.v
"""
NEVER = "while True: pass"
# What a file may do to the process that runs it, and what is said of it.
BREAKS = {
    "raise ValueError('no')": "ValueError: no",
    "sys.exit(3)": "SystemExit: 3",
    "os._exit(3)": "ended the process it was tried in .*: exit status 3",
    "os.kill(os.getpid(), signal.SIGKILL)": "ended the process it was tried in .*: killed by SIGKILL",
    "ctypes.string_at(0)": "ended the process it was tried in .*: killed by SIGSEGV",
    "recurse()": "RecursionError",
    "raise KeyboardInterrupt": "KeyboardInterrupt",
    "raise BaseException('odd')": "BaseException: odd",
    "os.closerange(3, 50)": "ended the process it was tried in",
    "for fd in range(3, 20): exec('try: os.write(fd, b\"nonsense\\\\n\")\\nexcept OSError: pass')": "answered for",
    "for fd in range(3, 20): exec('try: os.write(fd, b\"[3]\\\\n\")\\nexcept OSError: pass')": "answered for",
    "hoard = bytearray(1 << 36)": "MemoryError",
}
HANGS = {
    NEVER: "1 s were not enough as",
    "time.sleep(1000)": "1 s were not enough as",
    "sys.stdin.read() or input()": "EOFError",
    "subprocess.run(['sleep', '1000'])": "1 s were not enough as",
}
BRAKE = ElementTable(name="brake", parameters={"damping": 0.05})


def source(at_import: str = "pass", at_making: str = "pass", at_force: str = "pass") -> str:
    return PLUGIN.format(at_import=at_import, at_making=at_making, at_force=at_force)


def tried(text: str, limit_s: float = 30.0) -> dict[str, Any]:
    with PluginTrial(text, "brake.py", limit_s) as trial:
        kinds = trial.wait(trial.load())
        trial.wait(trial.make([BRAKE]))
    return kinds


@pytest.mark.parametrize("place", first_and_slowly("at_making", "at_import", "at_force"))
@pytest.mark.parametrize(("statement", "words"), first_and_slowly(*BREAKS.items()))
def test_whatever_a_file_does_to_the_process_it_is_tried_in_is_a_sentence(statement, words, place):
    with pytest.raises((PluginError, ElementError), match=words):
        tried(source(**{place: statement}))


@pytest.mark.parametrize("force", ["nan", "inf", "-inf"])
def test_an_element_whose_force_at_rest_is_not_finite_is_refused_before_a_run_takes_it_up(force):
    with pytest.raises(ElementError, match=f"brake gave {force}, no finite force"):
        tried(source(at_force=f"return float('{force}')"))


@pytest.mark.parametrize("forged", ["{}", '{"kinds": 3}', '{"kinds": {"brake": []}}', "[" * 60_000])
def test_an_answer_that_the_file_itself_has_given_is_told_as_such(forged):
    write = f"os.write(fd, {forged.encode()!r} + bytes([10]))"
    with pytest.raises(PluginError, match=r"brake\.py answered for the process it was tried in as it loaded"):
        tried(
            source(f"""
for fd in range(3, 20):
    try:
        {write}
    except OSError:
        pass
""")
        )


@pytest.mark.parametrize("place", first_and_slowly("at_import", "at_making", "at_force"))
@pytest.mark.parametrize(("statement", "words"), first_and_slowly(*HANGS.items()))
def test_a_file_that_does_not_come_to_an_end_is_given_up_and_leaves_no_process(statement, words, place):
    before = {pid for pid, *_ in processes()}
    with pytest.raises((PluginError, ElementError), match=words):
        tried(source(**{place: statement}), limit_s=1.0)
    left = [
        pid for pid, _, _, words in processes() if pid not in before and ("trial" in words or "sleep 1000" in words)
    ]
    wait_for("the end of what it started", lambda: not alive(left))


def test_the_declaration_of_an_element_is_known_without_its_code():
    kinds = tried(source())
    (quantity, default) = kinds["brake"].parameters()["damping"]
    assert (quantity.unit, quantity.at_least, quantity.about, default) == ("N s/m", 0, "how much", 0.05)
    assert kinds["brake"](damping=0.3).values() == {"damping": 0.3}
    with pytest.raises(ElementError, match="declaration"):
        kinds["brake"]().force()


@pytest.mark.parametrize(
    ("default", "says"),
    [
        ("float('nan')", "damping of Brake is nan. It must be a finite number of N s/m."),
        ("-0.05", "damping of Brake is -0.05. It must be at least 0 N s/m."),
        ("'much'", "damping of Brake is 'much'. It must be a number."),
    ],
)
def test_a_default_that_its_own_declaration_does_not_allow_is_refused(default, says):
    with pytest.raises(PluginError, match=re.escape(f"brake.py: the default of {says}")):
        load_source(source().replace("= 0.05", f"= {default}"), "brake.py")


@pytest.mark.slow
def test_a_unit_that_nobody_knows_is_refused_and_one_that_is_not_usual_is_not():
    with pytest.raises(PluginError, match="damping of Brake is declared in 'N s/furlongz', which is no unit"):
        tried(source().replace("N s/m", "N s/furlongz"))
    assert "brake" in tried(source().replace("N s/m", "V s/inch"))


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(f'extends = "{SCENES / "fig6a.toml"}"\n[[dissipation]]\nkind = "brake"\nacts = "always"\n')
    return path


@pytest.mark.parametrize("way", first_and_slowly([], ["--in-process"]))
@pytest.mark.parametrize("statement", first_and_slowly("os._exit(0)", "sys.exit(0)", "raise KeyboardInterrupt", NEVER))
def test_a_file_that_ends_or_holds_its_process_is_a_sentence_at_launch_and_nothing_is_started(
    statement, way, scene, tmp_path
):
    plugin, out = tmp_path / "brake.py", tmp_path / "out"
    plugin.write_text(source(statement))
    done = command("run", str(scene), "--plugin", str(plugin), "--out", str(out), *way)
    assert done.returncode == 2
    assert f"The plugin {plugin}" in done.stderr
    assert "Traceback" not in done.stderr
    assert not out.exists()


@pytest.mark.parametrize("kind", first_and_slowly("pipe", "directory", "large", "binary"))
def test_what_is_no_python_file_is_a_sentence(kind, scene, tmp_path):
    plugin = tmp_path / "brake.py"
    if kind == "directory":
        plugin.mkdir()
    elif kind == "pipe":
        os.mkfifo(plugin)
    else:
        plugin.write_bytes(b"#" * (1 << 21) if kind == "large" else bytes(range(256)))
    done = command("run", str(scene), "--plugin", str(plugin), "--out", str(tmp_path / "out"))
    assert done.returncode == 2
    assert f"The plugin {plugin} does not load: " in done.stderr
    assert "Traceback" not in done.stderr


SWAP: dict[str, Any] = {"swap": {"kind": "brake", "damping": 0.05, "acts": "always"}}


@pytest.mark.slow
def test_a_reload_that_breaks_in_any_way_changes_nothing_and_time_goes_on(running, scene, tmp_path):
    """Neither the element at work, nor its file, nor the kinds at hand, nor one bit of the run."""
    plugin = tmp_path / "brake.py"
    plugin.write_text(source())
    run = running("--plugin", str(plugin), scene=scene)
    run.reaches(100)
    kept, options = sorted((run.out / "plugins").iterdir()), run.ask("options")
    for statement in ("sys.exit(3)", "os._exit(3)", "os.kill(os.getpid(), signal.SIGKILL)", "recurse()"):
        words = BREAKS[statement]
        plugin.write_text(source(at_making=statement))
        with pytest.raises(run_directory.CommandRefused, match=words):
            run.ask("swap", **SWAP, reload=True)
    plugin.write_text(source().replace("Quantity(", "Quanity("))
    with pytest.raises(run_directory.CommandRefused, match="NameError: name 'Quanity'"):
        run.ask("swap", **SWAP, reload=True)
    plugin.write_text(source() + source().replace('"brake"', '"damping"').replace("class Brake", "class Damping"))
    with pytest.raises(run_directory.CommandRefused, match="defines damping now, a kind that the run has from els"):
        run.ask("swap", **SWAP, reload=True)
    assert sorted((run.out / "plugins").iterdir()) == kept
    assert run.ask("options")["kinds"] == options["kinds"]
    run.reaches(run.ask("status")["granted"] + 100)
    run.ask("stop")
    assert [e["kind"] for e in run.summary()["energy"]["elements"]] == ["brake"]
    assert replay(run.out).differences == []


def test_time_goes_on_while_a_file_is_tried_and_other_commands_are_answered(running, scene, tmp_path):
    """The file waits for another that the test makes when time has gone on; then it is taken up."""
    plugin, flag = tmp_path / "brake.py", tmp_path / "flag"
    plugin.write_text(source())
    run = running("--plugin", str(plugin), scene=scene)
    began = run.reaches(100)
    plugin.write_text(source(f"while not Path({str(flag)!r}).exists(): time.sleep(0.01)").replace("-self", "-2 * self"))
    said: list[dict[str, Any]] = []
    asking = threading.Thread(target=lambda: said.append(run.ask("swap", **SWAP, reload=True)))
    asking.start()
    run.reaches(began + 1000)
    with pytest.raises(run_directory.CommandRefused, match="another swap is being tried"):
        run.ask("swap", **SWAP)
    assert not said
    flag.touch()
    asking.join()
    assert said[0]["tick"] > began + 1000
    run.reaches(said[0]["tick"] + 100)
    run.ask("stop")
    elements = run.summary()["energy"]["elements"]
    assert [(e["kind"], e["from_tick"]) for e in elements] == [("brake", 0), ("brake", said[0]["tick"])]
    rows = run.log()["/controller"]
    tick = said[0]["tick"]
    assert (rows["dissipation.0"][tick:] == -0.1 * rows["v"][tick:]).all()


@pytest.mark.slow
def test_a_reload_that_never_ends_is_answered_and_the_run_ends_as_it_would_have(running, scene, tmp_path):
    plugin = tmp_path / "brake.py"
    plugin.write_text(source())
    run = running("--plugin", str(plugin), scene=scene)
    run.reaches(100)
    plugin.write_text(source(at_force=NEVER))
    with pytest.raises(run_directory.CommandRefused, match="10 s were not enough as the element brake was made"):
        run.ask("swap", **SWAP, reload=True)
    run.ask("stop")
    assert run.summary()["ended"] == "stopped"


@pytest.mark.slow
def test_a_run_that_ends_while_a_file_is_tried_leaves_nothing(running, scene, tmp_path):
    plugin = tmp_path / "brake.py"
    plugin.write_text(source())
    run = running("--plugin", str(plugin), scene=scene)
    run.reaches(100)
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


def test_a_change_that_hangs_in_the_controller_alone_is_refused_at_its_tick_and_the_run_goes_on(
    running, scene, tmp_path
):
    """As no trial elsewhere can find out."""
    plugin = tmp_path / "brake.py"
    plugin.write_text(source())
    run = running("--plugin", str(plugin), scene=scene, sets=("duration=600", "run.deadline=0.7"))
    run.reaches(100)
    there = "sys.argv[0].endswith(os.path.join('controller', 'node.py'))"
    plugin.write_text(source(at_making=f"time.sleep(1000) if {there} else None"))
    tick = run.ask("swap", **SWAP, reload=True)["tick"]
    run.reaches(tick + 500)
    run.ask("stop")
    assert run.summary()["ended"] == "stopped"
    refused = [event["refused"] for event in run.log()["/events"] if "refused" in event]
    assert len(refused) == 1
    assert f"The change at tick {tick}" in refused[0]
    assert "DeadlineOver" in refused[0]


@pytest.mark.slow
@pytest.mark.parametrize("statement", ["os._exit(0)", "os.kill(os.getpid(), signal.SIGKILL)", "pass"])
def test_a_file_that_ends_the_process_that_judges_the_run_leaves_it_undecided(statement, running, scene, tmp_path):
    """The judge goes on where the run has ended; nothing of the answer is lost."""
    plugin = tmp_path / "brake.py"
    making = "self.tick = 0"
    plugin.write_text(source(at_making=making, at_force=f"self.tick += 1; self.tick > 1050 and {statement}"))
    if statement == "pass":
        plugin.write_text(source())
    run = running(
        "--plugin", str(plugin), scene=scene, sets=("duration=1", "wall.position=-0.001", "run.verdict=pushed"), pace=()
    )
    summary = run.summary()
    assert summary["ended"] == "done"
    assert ("ended with status" in summary["verdict_rule"]) == (statement != "pass")
    assert (summary["verdict"] == "undecided") == (statement != "pass")
