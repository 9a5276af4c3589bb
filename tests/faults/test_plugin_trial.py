"""A plugin is tried in a process of its own: whatever it does there is a sentence here, and the run goes on."""

from __future__ import annotations

import os
import re
from typing import Any

import pytest

from haploop.controller.dissipation import ElementError, PluginError
from haploop.controller.dissipation.registry import load_source
from haploop.launch.clock.plugin_trial import PluginTrial
from haploop.protocol.scene.scene import ElementTable
from helpers.live.in_process import ask
from helpers.live.system import processes_of
from helpers.live.waiting import wait_for
from helpers.scenes.brake import source
from helpers.slowly import first_and_slowly

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
    "for fd in range(3, 20): exec('try: os.write(fd, b\"nonsense\\\\n\")\\nexcept OSError: pass')": "answered in place",
    "for fd in range(3, 20): exec('try: os.write(fd, b\"[3]\\\\n\")\\nexcept OSError: pass')": "answered in place",
    "hoard = bytearray(1 << 36)": "MemoryError",
    "sys.stdin.read() or input()": "EOFError",
}
HANGS = {
    NEVER: "it took longer than 1 s while",
    "time.sleep(1000)": "it took longer than 1 s while",
    "subprocess.run(['sleep', '1000'])": "it took longer than 1 s while",
}
BRAKE = ElementTable(name="brake", parameters={"damping": 0.05})


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
    with pytest.raises(ElementError, match=f"brake gave {force}, not a finite force"):
        tried(source(at_force=f"return float('{force}')"))


def test_an_element_that_gives_text_is_told_what_it_gave():
    with pytest.raises(ElementError, match="it returned 'hello', and a force must be a number"):
        tried(source(at_force="return 'hello'"))


@pytest.mark.parametrize("forged", ["{}", '{"kinds": 3}', '{"kinds": {"brake": []}}', "[" * 60_000])
def test_an_answer_that_the_file_itself_has_given_is_told_as_such(forged):
    write = f"os.write(fd, {forged.encode()!r} + bytes([10]))"
    with pytest.raises(
        PluginError, match=r"answered in place of the process it was tried in while it was being loaded"
    ):
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
def test_a_file_that_does_not_come_to_an_end_is_given_up_and_leaves_no_process(statement, words, place, live_runs_here):
    with pytest.raises((PluginError, ElementError), match=words):
        tried(source(**{place: statement}), limit_s=1.0)
    wait_for("the end of what it started", lambda: not processes_of(live_runs_here))


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
    with pytest.raises(PluginError, match="damping of Brake is declared in 'N s/furlongz', which is not a unit"):
        tried(source().replace("N s/m", "N s/furlongz"))
    assert "brake" in tried(source().replace("N s/m", "V s/inch"))


@pytest.mark.parametrize(
    ("statement", "way"),
    first_and_slowly(
        ("os._exit(0)", []),
        ("os._exit(0)", ["--in-process"]),
        ("sys.exit(0)", []),
        ("raise KeyboardInterrupt", ["--in-process"]),
        (NEVER, []),
    ),
)
def test_a_file_that_ends_or_holds_its_process_is_a_sentence_at_launch_and_nothing_is_started(
    statement, way, scene, tmp_path
):
    plugin, out = tmp_path / "brake.py", tmp_path / "out"
    plugin.write_text(source(statement))
    done = ask("run", str(scene), "--plugin", str(plugin), "--out", str(out), *way)
    assert (done.status, done.broken()) == (2, "")
    assert f"The plugin {plugin}" in done.stderr
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
    done = ask("run", str(scene), "--plugin", str(plugin), "--out", str(tmp_path / "out"))
    assert (done.status, done.broken()) == (2, "")
    assert f"The plugin {plugin} does not load: " in done.stderr
