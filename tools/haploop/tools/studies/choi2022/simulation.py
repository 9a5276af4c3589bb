"""Interpretations of the paper's simulation (Choi et al. 2022, section V.A), and their scenes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from haploop.launch.scene.toml_writer import inline
from haploop.protocol.scene.effects import Noise
from haploop.protocol.scene.estimators import Acceleration, Velocity
from haploop.protocol.scene.hand_force import Constant, HandForce, MinimumJerk, Ramp, Sine, Step
from haploop.protocol.scene.scene import Encoder, Scene
from haploop.protocol.scene.table import Table
from haploop.tools.search.random import Point, Row
from haploop.tools.studies.choi2022.claims import texts_of
from haploop.tools.studies.choi2022.interpretations import InterpretationSpace
from haploop.tools.studies.choi2022.work import fig6, hand_of, wall_of

SPACE = InterpretationSpace.from_words(6, seeded=True)
# That of our scene files fig6a.toml to fig6c.toml.
BASE = SPACE.ours
# The names of the two interpretations on the page, the second as an assumption.
OURS, NEAREST = "our interpretation", "[the nearest interpretation](#figure-6)"
_REACH_N = -0.6  # holds the hand's spring of 10 N/m at the wall, 60 mm away
_STEP_AT_S = 0.1


def used_numbers(chosen: Mapping[str, Any]) -> list[str]:
    """Returns the keys of the numbers that matter under some choices."""
    keys = ["push_N", "resolution_m"]
    of_force = {"ramp": ["rise_s"], "minimum-jerk": ["rise_s"], "sine": ["swing_Hz", "swing_share"]}
    keys += of_force.get(chosen["force"], [])
    keys += ["noise_m", "noise_Hz"] if chosen["noise"] == "low-passed" else []
    keys += ["velocity_Hz"] if chosen["velocity"] == "low-passed" else []
    keys += ["acceleration_Hz"] if chosen["acceleration"].startswith("low-passed") else []
    return keys


def as_row(interpretation: Point) -> Row:
    """Returns choices, numbers and seed in one flat map; numbers that do not matter under the choices are NaN."""
    used = used_numbers(interpretation.choices)
    numbers = {key: value if key in used else math.nan for key, value in interpretation.numbers.items()}
    return {**interpretation.choices, **numbers, "seed": interpretation.seed}


def describe(interpretation: Point) -> str:
    """Returns an interpretation in one line: its choices, then the numbers that matter."""
    chosen = interpretation.choices
    return SPACE.describe(chosen | interpretation.numbers, [*chosen, *used_numbers(chosen)])


def scene_of(interpretation: Point, panel: str) -> Scene:
    """Returns the resolved scene of a panel of Fig. 6, "a", "b" or "c", under an interpretation."""
    base = fig6(panel)
    chosen, number = interpretation.choices, interpretation.numbers
    rest, reach_N = (wall_of(base).position, 0.0) if chosen["rest"] == "wall" else (0.0, _REACH_N)
    force = _force(chosen["force"], reach_N - number["push_N"], number)
    is_filtered = chosen["acceleration"].startswith("low-passed")
    return replace(
        base,
        duration=chosen["duration"],
        seed=interpretation.seed,
        hand=replace(hand_of(base), rest=rest, force=force),
        encoder=Encoder(resolution=number["resolution_m"], rounding=chosen["rounding"]),
        noise=Noise(deviation=number["noise_m"], cutoff=number["noise_Hz"]) if chosen["noise"] != "none" else None,
        velocity=Velocity(cutoff=number["velocity_Hz"]) if chosen["velocity"] == "low-passed" else None,
        acceleration=Acceleration(
            source="accelerometer" if "accelerometer" in chosen["acceleration"] else "encoder",
            cutoff=number["acceleration_Hz"] if is_filtered else None,
        ),
        dissipation=tuple(replace(element, acts=chosen["acts"]) for element in base.dissipation),
    )


def _force(kind: str, value: float, number: Mapping[str, float]) -> HandForce:
    forces: dict[str, HandForce] = {
        "ramp": Ramp(value=value, rise_time=number["rise_s"]),
        "minimum-jerk": MinimumJerk(value=value, rise_time=number["rise_s"]),
        "step": Step(value=value, at=_STEP_AT_S),
        "constant": Constant(value=value),
        "sine": Sine(amplitude=number["swing_share"] * number["push_N"], frequency=number["swing_Hz"], offset=value),
    }
    return forces[kind]


def scene_text(interpretation: Point, panel: str) -> str:
    """Returns the scene file of an interpretation, which extends the paper's scene of the panel."""
    scene = scene_of(interpretation, panel)
    hand, texts = hand_of(scene), texts_of(6)
    title = texts[f"scene_{panel}"]
    sensing = ("encoder", "noise", "velocity", "acceleration")
    tables = {"hand.force": hand.force} | {name: getattr(scene, name) for name in sensing}
    lines = [
        texts["about_scene"].format(title=title).rstrip(),
        f"title = {inline(title)}",
        f'extends = "../fig6{panel}.toml"',
        f"duration = {inline(scene.duration)}",
        f"seed = {inline(scene.seed)}",
        "",
        "[hand]",
        f"rest = {inline(hand.rest)}",
    ]
    for name, table in tables.items():
        lines += ["", f"[{name}]", *_lines(table)] if table else []
    for element in scene.dissipation:
        lines += ["", "[[dissipation]]", *_lines(element)]
    return "\n".join(lines) + "\n"


def _lines(table: Table) -> list[str]:
    return [f"{key} = {inline(value)}" for key, value in table.as_dict().items()]
