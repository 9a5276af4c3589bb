"""A user's element that goes wrong is never silent but named with its tick; a failed reload leaves the old at work."""

import json
import re
import signal
import sys

import numpy as np
import pytest

import haploop.logger
from haploop.launch.processes import run_directory
from haploop.launch.runs.replay import replay
from haploop.logger.summary import SUMMARY, read
from helpers.live.launched import BRIEF, BRIEF_S, ROLES, SCENES, command
from helpers.live.system import alive, pending
from helpers.live.waiting import wait_for
from helpers.slowly import first_and_slowly

HEAD = """
import math, os, sys
from typing import Annotated
from haploop.controller.dissipation import Element, Motion, Quantity
"""
ELEMENT = """
class Brake(Element):
    kind = "brake"
    damping: Annotated[float, Quantity("N s/m", at_least=0)]

    def __post_init__(self):
        self.tick = -1

    def force(self, motion):
        self.tick += 1
        if self.tick == 150:
            {at_150}
        return -self.damping * motion.v
"""
SOUND = ELEMENT.format(at_150="pass")
IN_THE_CONTROLLER = "sys.argv[0].endswith(os.path.join('controller', 'node.py'))"


@pytest.fixture
def brake(tmp_path):
    """Write the plugin's file; returns the arguments that run figure 6(a) with it, acting always."""
    plugin = tmp_path / "brake.py"
    scene = tmp_path / "scene.toml"
    scene.write_text(
        f'extends = "{SCENES / "fig6a.toml"}"\n[[dissipation]]\nkind = "brake"\ndamping = 0.05\nacts = "always"\n'
    )

    def write(source):
        plugin.write_text(HEAD + source)
        return {"scene": scene, "plugin": plugin}

    return write


def started(running, brake, source, **options):
    made = brake(source)
    return running("--plugin", str(made["plugin"]), scene=made["scene"], **options)


@pytest.mark.parametrize("value", first_and_slowly("nan", "inf", "-inf"))
def test_a_force_that_is_no_finite_number_fails_the_run_and_names_element_and_tick(value, running, brake):
    run = started(running, brake, ELEMENT.format(at_150=f"return float('{value}')"))
    run.end(1)
    run.leaves_nothing()
    assert f"element 0 (brake) gave {value} at tick 150" in run.stderr
    assert "Traceback" not in run.stderr
    log = run.log()
    force = log["/controller"]["dissipation.0"]
    assert np.isfinite(force[:150]).all()
    assert str(force[150]) == value
    assert np.isfinite(log["/plant"]["x"]).all(), "no device was ever given such a force"
    assert replay(run.out).differences == []
    assert read(run.out / SUMMARY)["verdict"] == "undecided", "it says nothing of the loop"


def test_a_force_that_is_no_finite_number_fails_a_run_in_one_process_too(launched, brake, tmp_path):
    made = brake(ELEMENT.format(at_150="return math.nan"))
    options = ("--plugin", str(made["plugin"]), "--in-process")
    run = launched("run", str(made["scene"]), *options, out=tmp_path / "out")
    run.end(1)
    assert "element 0 (brake) gave nan at tick 150" in run.stderr
    assert "Traceback" not in run.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("statement", "reason"),
    first_and_slowly(
        ("return 'much'", "TypeError: it returned 'much', and a force must be a number"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
    ),
)
@pytest.mark.parametrize("options", first_and_slowly([], ["--in-process"]))
def test_a_force_that_raises_or_is_no_number_fails_the_run_and_names_element_and_tick(
    statement, reason, options, launched, brake, tmp_path
):
    """The log holds every tick before."""
    made = brake(ELEMENT.format(at_150=statement))
    out = tmp_path / "out"
    run = launched("run", str(made["scene"]), "--plugin", str(made["plugin"]), *options, out=out)
    run.end(1)
    assert f"Element 0 (brake) gave no force at tick 150: {reason}" in run.stderr
    assert "Traceback" not in run.stderr, "lines of the element are shown, none of haploop's"
    assert len(haploop.logger.read(out)["/controller"]["x"]) == 150
    assert replay(out).differences == []


@pytest.mark.slow
def test_a_force_of_another_number_type_gives_the_same_bits_both_ways(launched, brake, tmp_path):
    """As a force in single precision does, whose sum with the wall's is one too."""
    source = SOUND.replace("return -self.damping * motion.v", "return np.float32(-self.damping * motion.v)")
    made = brake("import numpy as np\n" + source)
    digests = []
    for way in ([], ["--in-process"]):
        run = launched(
            "run", str(made["scene"]), "--plugin", str(made["plugin"]), "--json", *way, out=tmp_path / f"{way}"
        )
        digests.append(run.summary()["trajectory_sha256"])
    assert digests[0] == digests[1]


@pytest.mark.slow
def test_a_thread_that_an_element_leaves_behind_keeps_no_process_of_the_run_and_not_its_verdict(running, brake):
    thread = "threading.Thread(target=time.sleep, args=[1e6]).start()"
    source = "import threading, time\n" + ELEMENT.format(at_150=thread)
    run = started(running, brake, source, sets=("duration=1", 'run.verdict="pushed"'))
    run.end(0)
    run.leaves_nothing()
    assert "stability" in json.loads((run.out / "summary.json").read_text(encoding="utf-8"))


NEVER = "while True: pass"
HANGS = first_and_slowly(
    NEVER,
    "time.sleep(1000)",
    "threading.Lock().acquire() and threading.Event().wait()",
    "while True: exec('try: time.sleep(9)\\nexcept Exception: pass')",
)


@pytest.mark.slow
@pytest.mark.parametrize("hang", HANGS)
def test_a_force_that_never_returns_is_named_with_element_tick_and_line_after_the_deadline(hang, running, brake):
    """At a pace: then all nodes have reported a tick before, and the deadline is that of a loop that runs."""
    run = started(running, brake, "import threading, time\n" + ELEMENT.format(at_150=hang), sets=(BRIEF,))
    run.end(1)
    run.leaves_nothing()
    assert (
        "Element 0 (brake) gave no force at tick 150: DeadlineOver: it did not finish within run.deadline" in run.stderr
    )
    assert "/plugins/brake-" in run.stderr
    assert "Traceback" not in run.stderr
    assert len(run.log()["/controller"]["x"]) == 150
    assert replay(run.out).differences == []


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the kernel's signal is ignored")
def test_when_the_launcher_is_killed_a_node_that_hangs_in_compiled_code_ends_too(running, brake, tmp_path):
    here = f"open({str(tmp_path / 'here')!r}, 'w').close()"
    source = "import itertools\n" + ELEMENT.format(at_150=f"{here}; any(itertools.repeat(0))")
    run = started(running, brake, source)
    run.nodes_started()
    wait_for("tick 150", (tmp_path / "here").exists)
    run.signal(signal.SIGKILL)
    wait_for("the end of the nodes", lambda: not alive(list(run.nodes.values())))
    run.end(-signal.SIGKILL)


@pytest.mark.slow
def test_of_a_force_that_never_returns_from_compiled_code_node_line_and_deadline_are_told(running, brake):
    """No Python code can run then, the end of a line of life goes unheard; the stack is shown all the same.

    Once all have loaded, the deadline of a loop that runs holds for the controller, before any tick is reported, too.
    """
    hangs = ELEMENT.format(at_150="any(itertools.repeat(0))").replace("== 150", "== 5")
    run = started(running, brake, "import itertools\n" + hangs, sets=(BRIEF,), pace=())
    run.end(1)
    run.leaves_nothing()
    assert f"The controller has not answered for {BRIEF_S} s" in run.stderr
    assert json.loads((run.out / "summary.json").read_text())["verdict"] == "undecided"
    assert re.search(r'File ".*/plugins/brake-.*", line \d+ in force', run.stderr)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("statement", "reason"),
    first_and_slowly(
        ("sys.exit(3)", "SystemExit: 3"), ("quit()", "SystemExit: None"), ("raise SystemExit", "SystemExit: ")
    ),
)
def test_an_element_that_leaves_is_named_with_its_tick(statement, reason, running, brake):
    run = started(running, brake, ELEMENT.format(at_150=statement))
    run.end(1)
    run.leaves_nothing()
    assert f"Element 0 (brake) gave no force at tick 150: {reason}" in run.stderr
    assert "Traceback" not in run.stderr, "lines of the element are shown, none of haploop's"
    assert replay(run.out).differences == []


@pytest.mark.slow
def test_a_force_that_never_returns_in_one_process_is_ended_by_the_second_interrupt(launched, brake, tmp_path):
    made = brake(ELEMENT.format(at_150=f"open({str(tmp_path / 'here')!r}, 'w')\n            while True: pass"))
    options = ("--plugin", str(made["plugin"]), "--in-process")
    run = launched("run", str(made["scene"]), *options, out=tmp_path / "out")
    wait_for("tick 150", (tmp_path / "here").exists)
    run.signal(signal.SIGINT)
    wait_for("the first to be heeded", lambda: not pending(run.pid) and run.stood_for(0.3))
    run.signal(signal.SIGINT)
    run.end(1)
    assert "Interrupted at once" in run.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("statement", "words"),
    first_and_slowly(
        ("raise RuntimeError('not here')", "The controller failed: The plugin "),
        ("os._exit(3)", "The controller ended with exit status 3; the last tick all nodes had done is 0 "),
    ),
)
def test_a_plugin_that_fails_in_the_controllers_process_alone_ends_the_run(statement, words, running, brake):
    run = started(running, brake, f"if {IN_THE_CONTROLLER}:\n    {statement}\n{SOUND}")
    run.end(1)
    run.leaves_nothing()
    assert words in run.stderr
    assert "Traceback" not in run.stderr


@pytest.mark.slow
def test_an_element_that_refuses_its_parameters_in_the_controllers_process_alone_ends_the_run(running, brake):
    source = SOUND.replace("self.tick = -1", f"self.tick = 1 / (not {IN_THE_CONTROLLER}) - 2")
    run = started(running, brake, source)
    run.end(1)
    run.leaves_nothing()
    assert "The controller failed: The element brake cannot be made with damping = 0.05: ZeroDiv" in run.stderr


def test_an_element_that_refuses_its_parameters_is_an_error_of_the_scene_and_nothing_is_started(running, brake):
    run = started(running, brake, SOUND.replace("self.tick = -1", "raise ValueError('too little')"))
    run.end(2)
    assert "The element brake cannot be made with damping = 0.05: ValueError: too little" in run.stderr
    assert not run.out.exists()


@pytest.mark.slow
@pytest.mark.parametrize("role", first_and_slowly(*ROLES))
def test_a_node_whose_python_does_not_even_start_ends_the_run_and_is_named(role, running, tmp_path, monkeypatch):
    (tmp_path / "sitecustomize.py").write_text(
        f"import os, sys\nif 'haploop.{role}.node' in sys.orig_argv:\n    os._exit(3)\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    run = running()
    run.end(1)
    run.leaves_nothing()
    assert f"The {role} ended with exit status 3; the last tick all nodes had done is 0 (0 s)." in run.stderr


BROKEN = {
    "line 5 does not load: SyntaxError: [^,]*$": "class Brake(Element:\n",  # the place is told once
    "has no method force": SOUND.replace("def force", "def strength"),
    "no longer defines brake": SOUND.replace('"brake"', '"break"'),
    "cannot be made with damping = 0.05: ValueError: too little": SOUND.replace(
        "self.tick = -1", "raise ValueError('too little')"
    ),
    "gain is missing": SOUND.replace("    damping:", '    gain: Annotated[float, Quantity("")]\n    damping:'),
}


@pytest.mark.slow
def test_a_reload_that_fails_says_why_and_leaves_the_old_element_at_work_until_one_succeeds(running, brake):
    run = started(running, brake, SOUND)
    run.reaches(300)
    run.ask("pause")
    paused = run.stands()
    swap = {"swap": {"kind": "brake", "damping": 0.05, "acts": "always"}, "reload": True}
    for reason, source in BROKEN.items():
        brake(source)
        with pytest.raises(run_directory.CommandRefused, match=reason):
            run.ask("swap", **swap)
    swapped = run.stands(at=run.ask("step", ticks=100)["tick"])
    assert swapped == paused + 100
    brake(SOUND.replace("-self.damping", "-3.0 * self.damping"))
    assert command("swap", "brake", "damping=0.05", "acts=always", "--reload").returncode == 0
    run.ask("resume")
    run.reaches(swapped + 100)
    end = run.ask("stop")["tick"]
    summary = run.summary()
    rows = run.log()["/controller"]
    v, force = rows["v"], rows["dissipation.0"]
    assert np.array_equal(force[:swapped], -0.05 * v[:swapped])
    assert np.array_equal(force[swapped:], -3.0 * 0.05 * v[swapped:])
    books = [(e["kind"], e["from_tick"], e["to_tick"]) for e in summary["energy"]["elements"]]
    assert books == [("brake", 0, swapped), ("brake", swapped, end)]
    (run.out.parent / "brake.py").unlink()
    assert replay(run.out).differences == []
