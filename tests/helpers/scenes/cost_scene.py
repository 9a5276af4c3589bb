"""A small scene to be measured by ``haploop cost``, and ways to measure it."""

from pathlib import Path
from typing import Any

from haploop.launch.scene.file import load as load_scene
from haploop.protocol.scene.scene import Scene
from haploop.tools.cost.grid import grid, outcome, true_swings
from haploop.tools.cost.reference import Reference, statistics
from haploop.tools.trajectory import trajectory

SMOOTH = """
title = "a spring drawn out"
duration = 0.04
diverged_beyond = 0.5
[clock]
integrator = "euler"
plant_rate = 5000
[device]
mass = 0.02
damping = 0.4
[hand]
stiffness = 400.0
[hand.force]
kind = "ramp"
value = 1.0
rise_time = 0.02
"""


def exact_reference(path: Path, _scene: Scene | None = None) -> Reference:
    """The exact method at 100 kHz, in the shape of a stored reference."""
    scene = load_scene(path, ["clock.integrator=exact", "clock.plant_rate=100000"])
    ran = trajectory(scene)
    swings, verdict = statistics(scene, ran.x_m, ran.v_m_s), ran.summary["verdict"]
    return Reference(path.stem, "Exact at 100 kHz.", verdict, True, 1e-15, swings, ran.x_m, ran.v_m_s)


def outcomes(path: Path, methods: list[str], rates: list[int], reference: Reference | None = None) -> dict[Any, Any]:
    """(method, rate) -> outcome, without a store."""
    reference = reference or exact_reference(path)
    made = grid(path, methods, rates)
    swings = () if reference.pointwise else true_swings(made.scene)
    return {(c.method, c.plant_rate): outcome(c, reference, swings) for c in made.candidates}


def count_stages(counts):
    """A stage that records its name and how many measurements were announced and made."""

    def stage(name, announced):
        entry = counts.setdefault(name, {"announced": announced, "made": 0})

        def advance():
            entry["made"] += 1

        return advance

    return stage
