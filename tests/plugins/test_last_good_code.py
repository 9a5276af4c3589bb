"""A reload that is refused, or taken back, does not stay the code of its kind."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haploop.controller.dissipation import registry
from haploop.launch.processes import run_directory
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.runs.replay import replay
from haploop.launch.scene.file import load
from haploop.launch.spec import PLUGINS, keep_plugin, write_scene
from haploop.logger import read
from helpers.live.launched import SCENES
from helpers.scenes.brake import source

BRAKE: dict[str, Any] = {"kind": "brake", "damping": 0.05, "acts": "always"}
DAMPING: dict[str, Any] = {"kind": "damping", "damping": 0.1, "acts": "always"}
# When it is tried on the motion of the loop, but not at rest; and twenty ticks after it was swapped in.
FAILING = {
    "refused": source(at_force="1 / (motion.x == 0.0)"),
    "taken back": source(at_force="1 / (self.tick < 20)"),
    "no number": source(at_force="if self.tick >= 20: return float('nan')"),
}


def braked(tmp_path: Path) -> tuple[Path, Path]:
    """Returns a scene with a brake and its plugin file."""
    path, plugin = tmp_path / "scene.toml", tmp_path / "brake.py"
    path.write_text(
        f'extends = "{SCENES / "fig6a.toml"}"\nduration = 0.4\nrun.verdict = "window"\n'
        '[[dissipation]]\nkind = "brake"\nacts = "always"\n'
    )
    plugin.write_text(source())
    return path, plugin


@pytest.mark.parametrize("how", FAILING)
@pytest.mark.parametrize("by", ["swap", "scene"])
def test_in_one_process_a_swap_after_a_reload_that_failed_has_the_last_good_code_and_replays(how, by, tmp_path):
    path, plugin = braked(tmp_path)
    (out := tmp_path / "out").mkdir()
    good = keep_plugin(plugin, out)
    plugin.write_text(FAILING[how])
    bad = keep_plugin(plugin, out)
    kinds = registry([good])
    scene = load(path, [], kinds)
    attachments = {"scene.toml": write_scene(scene, out), f"{PLUGINS}/{good.name}": good.read_text()}
    later = BRAKE | {"damping": 0.07}
    events: list[tuple[int, dict[str, Any]]] = [
        (100, {"swap": BRAKE, "element": 0, "plugin": str(bad)}),
        (200, {"swap": DAMPING, "element": 0}),
        (300, {"swap": later, "element": 0} | ({"at": 0.3} if by == "scene" else {})),
    ]
    summary = run_in_process(scene, kinds, out=out, attachments=attachments, events=events)
    assert (summary["ended"], len(summary["not_made"])) == ("done", 1)
    rows = read(out)["/controller"]
    assert np.array_equal(rows["dissipation.0"][300:], -0.07 * rows["v"][300:])
    assert replay(out).differences == []


def failed_reload(running: Callable[..., Any], tmp_path: Path, how: str) -> Any:
    path, plugin = braked(tmp_path)
    run = running("--plugin", str(plugin), scene=path, sets=("duration=600",))
    run.reaches(100)
    plugin.write_text(FAILING[how])
    if how == "refused":
        with pytest.raises(run_directory.CommandRefused, match="ZeroDivisionError"):
            run.ask("swap", swap=BRAKE, reload=True)
    else:
        run.reaches(run.ask("swap", swap=BRAKE, reload=True)["tick"] + 100)
    return run


@pytest.mark.slow
@pytest.mark.parametrize("how", FAILING)
def test_a_swap_or_an_undo_after_a_reload_that_failed_has_the_last_good_code_and_replays(how, running, tmp_path):
    run = failed_reload(running, tmp_path, how)
    run.ask("swap", swap=DAMPING)
    undone = run.ask("undo")["tick"]
    run.reaches(undone + 100)
    with pytest.raises(run_directory.CommandRefused, match="nothing to undo"):
        run.ask("undo")  # the reload itself is gone already
    run.ask("swap", swap=DAMPING)
    swapped = run.ask("swap", swap=BRAKE | {"damping": 0.07})["tick"]
    run.reaches(swapped + 100)
    end = run.ask("stop")["tick"]
    assert (run.summary()["ended"], len(run.summary()["not_made"])) == ("stopped", 1)
    rows = run.log()["/controller"]
    assert np.array_equal(rows["dissipation.0"][swapped:end], -0.07 * rows["v"][swapped:end])
    assert replay(run.out).differences == []


@pytest.mark.slow
def test_undo_of_a_reload_that_took_another_elements_place_brings_the_code_before_back(running, tmp_path):
    path, plugin = braked(tmp_path)
    run = running("--plugin", str(plugin), scene=path, sets=("duration=600",))
    run.reaches(100)
    run.ask("swap", swap=DAMPING)
    plugin.write_text(source().replace("-self", "-2 * self"))
    run.ask("swap", swap=BRAKE, reload=True)
    run.ask("undo")
    tick = run.ask("swap", swap=BRAKE)["tick"]
    run.reaches(tick + 100)
    end = run.ask("stop")["tick"]
    run.summary()
    rows = run.log()["/controller"]
    assert np.array_equal(rows["dissipation.0"][tick:end], -0.05 * rows["v"][tick:end])
