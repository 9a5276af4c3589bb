"""Fig. 7 shows the experiments' device: here what was not published about it, and the nearest interpretation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from haploop.tools.figure.style import GREY, INK, SMALL, dress, empty_figure
from haploop.tools.render.terminal import markdown_table
from haploop.tools.search.random import Row
from haploop.tools.studies.choi2022.device import FRICTION_N, KINDS, SCENE_FILE, Setup, file_text
from haploop.tools.studies.choi2022.experiment import (
    CLAIMS,
    NAMES,
    PAPER,
    SCENE,
    SHARES,
    SPACE,
    WHOLE,
    largest_of,
    search,
    setup_of,
    shares_of,
    stiffness_ladder,
)
from haploop.tools.studies.choi2022.figures.claims import RARE_BELOW, Finding
from haploop.tools.studies.choi2022.figures.drawing import (
    SHORT,
    claims_table,
    columns_of,
    open_table,
    search_words,
)
from haploop.tools.studies.choi2022.figures.work import NEAREST, Work
from haploop.tools.studies.choi2022.interpretations import holds, interval, often, options
from haploop.tools.studies.choi2022.steadiness import largest

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Largest steady stiffness in N/m by element; and, by key of a setup, that at a lower and at an upper value of the key.
Largest = dict[str, float]
Influences = dict[str, tuple[Largest, Largest]]
# Two values of a number, or two options of a choice.
Pair = tuple[float, float] | tuple[str, str]
_FACTOR, _DELAY_S = 1.4, 5e-4
_LOWER, _UPPER = "#56B4E9", "#E69F00"


def make_7(work: Work) -> list[Finding]:
    """Searches, varies each value alone, and writes the nearest interpretation as a scene."""
    found = search(work)
    nearest, rows = setup_of(found.nearest), found.of("random")
    # The nearest is among the other rows already.
    work.data("figure_7_interpretations", columns_of([row for row in found.rows if row["stage"] != "nearest"]))
    work.text(SHARES, shares_of(rows, work.small))
    work.scene(SCENE.removesuffix(".toml"), nearest.scene(5000.0))
    work.text(SCENE_FILE, file_text(nearest))
    base, influences, varied = _influences(work, nearest)
    work.figure(_draw(base, influences, varied), "figure_7", work.tell("seen", factor=_FACTOR))
    friction = influences["friction_N"][1]
    words, around = search_words(found, WHOLE, CLAIMS), found.of("neighbour")
    measured = {"nearest interpretation": base, "with friction of 48 mN": friction}
    bears = [["the paper", "", *(f"{stiffness / 1e3:.1f}" for stiffness in PAPER.values())]]
    bears += [[name, *(f"{one[kind] / 1e3:.1f}" for kind in NAMES)] for name, one in measured.items()]
    table = claims_table(CLAIMS, SPACE, {"nearest": found.of("nearest")[0]}, found, options(rows, SPACE))
    work.notes = [
        work.tell(
            "notes",
            **words,
            described=SPACE.describe(nearest.as_dict(), (*SPACE.choices, *SPACE.bounds)),
            file=SCENE_FILE,
            stiffnesses=markdown_table(["", *(SHORT[kind] for kind in NAMES)], bears, numbers=range(1, 6)),
            bears=sum(max(row[f"{name}_N_m"] for name in PAPER) > 0.0 for row in rows),
            table=table,
            open=open_table(SPACE, 7),
        )
    ]
    larger = interval(rows, "10 larger", SPACE)
    work.conclude(
        "often" if larger.value >= RARE_BELOW else "rare",
        supports=larger.value >= RARE_BELOW,
        larger=often(larger),
        near=sum(holds(row, "10 larger") for row in around),
        friction_mN=1e3 * FRICTION_N,
        friction=", ".join(f"{SHORT[name]} {stiffness / 1e3:.1f}" for name, stiffness in friction.items()),
        **words,
    )
    # Inertia may steady stiffer walls with the unit than with the encoder's second differences.
    unit, encoder = influences["acceleration"]
    better = all(unit[kind] > encoder[kind] for kind in KINDS[2:])
    of_unit, of_encoder = (" and ".join(f"{of[kind] / 1e3:.1f}" for kind in KINDS[2:]) for of in (unit, encoder))
    computed = {"velocity": nearest.velocity, "nearest": NEAREST, "unit": of_unit, "encoder": of_encoder}
    return [work.claims["unit"].holds_if(False, better, **computed)]


def _influences(work: Work, nearest: Setup) -> tuple[Largest, Influences, dict[str, Pair]]:
    """Returns the largest steady stiffnesses of the nearest setup, those at two values of each key, and the values."""
    varied = _varied(nearest, work.small)
    ends: list[Row] = [nearest.as_dict() | {key: value} for key, pair in varied.items() for value in pair]
    base, *rest = _largest(work, [nearest, *(Setup(**end) for end in ends)])
    influences = {key: (rest[2 * i], rest[2 * i + 1]) for i, key in enumerate(varied)}
    rough = replace(nearest, friction_N=0.0 if work.small else FRICTION_N)
    with_friction = work.map_parallel("the nearest with friction", largest_of, [(rough, name) for name in NAMES])
    influences["friction_N"] = base, dict(zip(NAMES, with_friction, strict=True))
    return base, influences, varied | {"friction_N": (0.0, FRICTION_N)}


def _largest(work: Work, setups: Sequence[Setup]) -> list[Largest]:
    """Returns the largest steady stiffness of each element in each setup; setups of one structure run together."""
    groups: dict[tuple[object, ...], list[Setup]] = {}
    for setup in dict.fromkeys(setups):
        structure = (setup.delay_s, setup.unit, setup.mount, setup.velocity, setup.acceleration)
        groups.setdefault(structure, []).append(setup)
    ladders = work.map_parallel("what each value changes", stiffness_ladder, [*groups.values()])
    found = {
        setup: {name: largest(steady[name]) for name in NAMES}
        for group, of_group in zip(groups.values(), ladders, strict=True)
        for setup, steady in zip(group, of_group, strict=True)
    }
    return [found[setup] for setup in setups]


def _varied(setup: Setup, small: bool) -> dict[str, Pair]:
    """Returns for each value of a setup a lower and an upper value, or two other choices."""
    pairs: dict[str, Pair] = {
        key: (float(f"{getattr(setup, key) / _FACTOR:.3g}"), float(f"{getattr(setup, key) * _FACTOR:.3g}"))
        for key in SPACE.bounds
    }
    lower, upper = pairs["near_share"]
    pairs["near_share"] = (float(lower), min(float(upper), 0.9))
    pairs["delay_s"] = round(max(setup.delay_s - _DELAY_S, 0.0), 4), round(setup.delay_s + _DELAY_S, 4)
    for key in ("unit", "mount", "velocity"):
        others = [one for one in SPACE.choices[key] if key == "mount" or one != getattr(setup, key)]
        pairs[key] = others[0], others[-1]
    pairs["acceleration"] = "unit", "encoder"
    return {key: pairs[key] for key in ("delay_s", "acceleration")} if small else pairs


def _draw(base: Largest, influences: Influences, varied: Mapping[str, Pair]) -> Figure:
    figure = empty_figure(13.0, 1.2 + 0.46 * len(varied))
    axes = figure.subplots(1, len(NAMES) - 1, sharey=True, sharex=True)
    for ax, name in zip(axes, NAMES[1:], strict=True):
        for row, (key, ends) in enumerate(influences.items()):
            for of, value, colour, side in zip(ends, varied[key], (_LOWER, _UPPER), (-0.2, 0.2), strict=True):
                ax.barh(row + side, (of[name] - base[name]) / 1e3, 0.36, base[name] / 1e3, color=colour)
                text = {"ha": "left" if of[name] >= base[name] else "right", "fontsize": SMALL - 1, "color": INK}
                ax.text(of[name] / 1e3, row + side, f" {SPACE.value(key, value)} ", va="center", **text)
        ax.axvline(base[name] / 1e3, color=GREY, linewidth=0.8)
        dress(ax, SHORT[name], "largest steady stiffness (N/mm)", "")
        ax.margins(x=0.3)
        ax.set_xticks(range(0, 9, 2))
    axes[0].set_yticks(range(len(varied)), [SPACE.label(key) for key in varied])
    axes[0].set_ylim(len(varied) - 0.4, -0.6)
    return figure
