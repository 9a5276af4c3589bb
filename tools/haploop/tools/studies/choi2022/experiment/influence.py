"""What each value that nobody published changes by itself, about the nearest reading."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from haploop.tools.figure.style import GREY, INK, SMALL, dress, empty_figure
from haploop.tools.studies.choi2022.experiment.map_parallel import many
from haploop.tools.studies.choi2022.experiment.readings import SPACE, structure
from haploop.tools.studies.choi2022.experiment.setup import FRICTION_N, Setup
from haploop.tools.studies.choi2022.experiment.stiffness_ladder import NAMES, climb, largest
from haploop.tools.studies.choi2022.work import Work

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Largest = dict[str, float]
_FACTOR, _DELAY_S = 1.4, 5e-4
_LOWER, _UPPER = "#56B4E9", "#E69F00"


def varied(setup: Setup) -> dict[str, tuple[Any, Any]]:
    """For each value a lower and an upper one, or two other choices."""
    numbers = {
        key: (float(f"{getattr(setup, key) / _FACTOR:.3g}"), float(f"{getattr(setup, key) * _FACTOR:.3g}"))
        for key in SPACE.bounds
    }
    numbers["near_share"] = (numbers["near_share"][0], min(numbers["near_share"][1], 0.9))
    delays = (round(max(setup.delay_s - _DELAY_S, 0.0), 4), round(setup.delay_s + _DELAY_S, 4))
    units = [unit for unit in SPACE.choices["unit"] if unit != setup.unit]
    velocities = [one for one in SPACE.choices["velocity"] if one != setup.velocity]
    return {
        **numbers,
        "delay_s": delays,
        "unit": (units[0], units[-1]),
        "mount": ("motor", "tip"),
        "velocity": (velocities[0], velocities[-1]),
        "acceleration": ("unit", "encoder"),
    }


def influence(work: Work, setup: Setup, rough: dict[str, Any]) -> dict[str, tuple[Largest, Largest]]:
    """Draw it and return, for each value, the largest steady stiffness in N/m by element at both of its ends.

    Args:
        setup: the nearest reading.
        rough: its row with friction.
    """
    pairs = varied(setup)
    if work.small:
        pairs = {key: pairs[key] for key in ("delay_s", "acceleration")}
    ends = [replace(setup, **{key: value}) for key, pair in pairs.items() for value in pair]
    base, *rest = _climbed(work, [setup, *ends])
    found = {key: (rest[2 * i], rest[2 * i + 1]) for i, key in enumerate(pairs)}
    pairs["friction_N"] = (0.0, FRICTION_N)
    found["friction_N"] = base, {name: rough[f"{name}_N_m"] for name in NAMES}
    work.figure(
        _drawn(base, found, pairs),
        "figure_7_influence",
        "What one value changes, all others as in the nearest reading (the line): the largest stiffness that each "
        f"element steadies. Numbers are taken 1/{_FACTOR:g} (blue) and {_FACTOR:g} times (orange), the delay 0.5 ms "
        "less and more, the friction as it was published; beside a bar the value.",
    )
    return found


def _climbed(work: Work, setups: list[Setup]) -> list[Largest]:
    """Of each the largest steady stiffness by element; those of one structure run together."""
    alike: dict[Any, list[int]] = {}
    for i, setup in enumerate(setups):
        alike.setdefault((structure(setup), setup.acceleration), []).append(i)
    groups = [[setups[i] for i in members] for members in alike.values()]
    found: dict[int, Largest] = {}
    for members, climbed in zip(alike.values(), many(work, "what each value changes", climb, groups), strict=True):
        found |= {i: {name: largest(of[name]) for name in NAMES} for i, of in zip(members, climbed, strict=True)}
    return [found[i] for i in range(len(setups))]


def _drawn(base: Largest, found: dict[str, tuple[Largest, Largest]], pairs: dict[str, tuple[Any, Any]]) -> Figure:
    names = [name for name in NAMES if name != "nothing"]
    figure = empty_figure(13.0, 1.2 + 0.46 * len(pairs))
    axes = figure.subplots(1, len(names), sharey=True, sharex=True)
    for ax, name in zip(axes, names, strict=True):
        for row, (key, ends) in enumerate(found.items()):
            for of, value, colour, side in zip(ends, pairs[key], (_LOWER, _UPPER), (-0.2, 0.2), strict=True):
                ax.barh(row + side, (of[name] - base[name]) / 1e3, 0.36, base[name] / 1e3, color=colour)
                right = of[name] >= base[name]
                words = f" {SPACE.value(key, value)} "
                look = {"va": "center", "ha": "left" if right else "right", "fontsize": SMALL - 1, "color": INK}
                ax.text(of[name] / 1e3, row + side, words, **look)
        ax.axvline(base[name] / 1e3, color=GREY, linewidth=0.8)
        dress(ax, name.replace("-", " "), "largest steady stiffness (N/mm)", "")
        ax.margins(x=0.3)
        ax.set_xticks(range(0, 9, 2))
    axes[0].set_yticks(range(len(pairs)), [SPACE.label(key) for key in pairs])
    axes[0].invert_yaxis()
    return figure
