"""docs/elements.md and plugins.md: their files run as they stand, and the table is what the elements do."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from haploop.controller.dissipation.registry import load_source
from haploop.launch.runs.in_batch import run_batch
from helpers.runs.batches import alone, pressed, together, with_element
from helpers.scenes.least import KINDS, scene

PAGE = (Path(__file__).parents[3] / "docs/elements.md").read_text(encoding="utf-8")
PLUGINS = (Path(__file__).parents[3] / "docs/plugins.md").read_text(encoding="utf-8")
FILES = re.findall(r"```python\n(.*?)```", PAGE + PLUGINS, re.DOTALL)
VALUES = [{"coefficient": 5.0}, {"damping": 0.3}, {"most": 4.0}, {"most": 4.0, "side": "inward", "on": True}]
ROWS = re.findall(r"^\| (none|`[^|]*) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|$", PAGE, re.MULTILINE)
NAMES = {"N s/m": ("damping", 1.0), "N/m": ("stiffness", 1.0), "g": ("mass", 1e-3), "ms": ("time", 1e-3)}


@pytest.mark.parametrize("place", range(len(VALUES)))
def test_a_file_of_the_page_runs_alone_and_has_the_same_bits_in_a_batch(place: int) -> None:
    found = load_source(FILES[place], "page.py")
    kinds, (kind,) = KINDS | found, found
    made = [with_element(pressed(wall={"position": -0.002, "stiffness": k}), kind, **VALUES[place]) for k in (9e2, 1e3)]
    expected = [alone(each, kinds) for each in made]
    assert all(result["energy"]["elements"][0]["true_J"] for result in expected)
    assert together(made, kinds) == expected


def test_the_pages_passivity_controller_does_what_the_one_of_the_package_does() -> None:
    made = pressed(wall={"position": -0.002, "stiffness": 2000.0})
    kinds = KINDS | load_source(FILES[2], "page.py")
    own = alone(with_element(made, "own-passivity-controller", most=4.0), kinds)
    ours = alone(with_element(made, "passivity-controller", damping=4.0))
    assert own["final"] == pytest.approx(ours["final"], rel=1e-9)
    assert own["energy"]["elements"][0]["true_J"] > 1e-6


def element_of(words: str) -> list[dict[str, object]]:
    """The element that a row names: `kind` 20 N s/m, tool 10 g, always."""
    kind, _, rest = words.strip("`").partition("`")
    if kind == "none":
        return []
    named = {NAMES[unit][0]: float(size) * NAMES[unit][1] for size, unit in re.findall(r"(\d+) (N s/m|N/m|ms|g)", rest)}
    return [{"kind": kind, "acts": "always" if "always" in rest else "in-contact", **named}]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_a_tap_leaves_as_fast_as_the_table_says(row: tuple[str, ...]) -> None:
    words, *speeds = row
    for late, speed in enumerate(speeds):
        made = scene(
            duration=0.15,
            clock={"round_trip_delay": late * 1e-3},
            device={"mass": 0.05, "damping": 0.0, "position": 0.002, "velocity": -0.2},
            wall={"position": 0.0, "stiffness": 2000.0},
            dissipation=element_of(words),
        )
        assert alone(made)["final"]["v_m_s"] == pytest.approx(float(speed), abs=5.1e-4)


def test_the_page_lists_every_element_of_the_package_that_asks() -> None:
    asking = [name for name, kind in KINDS.items() if kind.asks]
    assert len(asking) >= 7
    assert [name for name in asking if f"\n| `{name}` | " not in PAGE] == []


def swings_on(delay: float, *elements: tuple[str, dict[str, float]]) -> list[float]:
    """Width of the swing in m, a second and a half after a device is pressed on 3600 N/m, with each element."""
    made = [
        scene(
            duration=1.5,
            clock={"round_trip_delay": delay},
            device={"mass": 0.05, "damping": 0.05, "position": 0.001},
            encoder={"resolution": 1e-5},
            hand={"mass": 0.01, "stiffness": 10.0, "damping": 0.05, "force": {"kind": "constant", "value": -1.0}},
            wall={"position": 0.0, "stiffness": 3600.0},
            dissipation=[{"kind": kind, **values}],
        )
        for kind, values in elements
    ]
    return [result["window"]["oscillation_m"] for result in run_batch(made, KINDS, energy=False)]


def test_adaptive_inertia_helps_where_the_damper_is_at_its_limit_and_there_alone() -> None:
    weak, strong = ("passivity-controller", {"damping": 1.0}), ("passivity-controller", {"damping": 20.0})
    helped, plain = ("adaptive-inertia", {"damping": 1.0, "mass": 0.02}), ("damping", {"damping": 5.0})
    of_weak, of_helped, of_strong, of_plain = swings_on(0.0, weak, helped, strong, plain)
    assert of_weak > 0.01
    assert max(of_helped, of_strong) < 0.001
    assert of_plain < 1e-5
    assert min(swings_on(0.001, weak, helped, strong)) > 0.1
