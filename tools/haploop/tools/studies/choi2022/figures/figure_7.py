"""Fig. 7 shows the experiments' device: here what nobody published of it, and the nearest interpretation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from haploop.tools.figure.style import GREY, INK, SMALL, dress, empty_figure
from haploop.tools.render.terminal import markdown_table
from haploop.tools.studies.choi2022.claims import RARE_BELOW, Finding, claims_of
from haploop.tools.studies.choi2022.device import FRICTION_N, KINDS, SCENE_FILE, Setup, file_text
from haploop.tools.studies.choi2022.drawing import SHORT, claims_table, search_words, share_map
from haploop.tools.studies.choi2022.experiment import NEAREST, SCENE, SPACE, WHOLE, describe, keep_shares, search
from haploop.tools.studies.choi2022.experiment_measure import CLAIMS as TESTED
from haploop.tools.studies.choi2022.experiment_measure import NAMES, PAPER, largest_of, stiffness_ladder
from haploop.tools.studies.choi2022.interpretations import (
    Found,
    Option,
    holds,
    interval,
    never_together,
    often,
    options,
    percent,
    share,
)
from haploop.tools.studies.choi2022.steadiness import largest
from haploop.tools.studies.choi2022.work import Work

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CLAIMS = claims_of(7)
# Largest steady stiffness in N/m by element, and by key of a setup at a lower and an upper value of it.
Largest = dict[str, float]
Influences = dict[str, tuple[Largest, Largest]]
# Two values of a number, or two options of a choice.
Pair = tuple[float, float] | tuple[str, str]
_FACTOR, _DELAY_S = 1.4, 5e-4
_LOWER, _UPPER = "#56B4E9", "#E69F00"
# Claims that hold less often than this are in no pair of those that never hold together.
_OFTEN = 0.05


def make(work: Work) -> list[Finding]:
    """Searches, varies each value by itself, and writes the nearest interpretation as a scene."""
    found = search(work)
    rows, [row] = (found.of(stage) for stage in ("random", "nearest"))
    there = options(rows, SPACE)
    if there:
        work.figure(share_map(there, list(TESTED), len(rows)), "figure_7", work.tell("seen_search"))
    keep_shares(work, list(TESTED), rows, there)
    varied = _varied(found.nearest, work.small)
    ends = [Setup.from_row(found.nearest.as_dict() | {key: value}) for key, pair in varied.items() for value in pair]
    base, *rest = _largest(work, [found.nearest, *ends])
    influences = {key: (rest[2 * i], rest[2 * i + 1]) for i, key in enumerate(varied)}
    rough = replace(found.nearest, friction_N=0.0 if work.small else FRICTION_N)
    with_friction = work.map_parallel("the nearest with friction", largest_of, [(rough, name) for name in NAMES])
    influences["friction_N"] = base, dict(zip(NAMES, with_friction, strict=True))
    drawn = _draw(base, influences, varied | {"friction_N": (0.0, FRICTION_N)})
    work.figure(drawn, "figure_7_influence", work.tell("seen_influence", factor=_FACTOR))
    # That of the nearest is among the rows once already.
    kept = [one for one in found.rows if one["stage"] != "nearest"]
    work.data("figure_7_interpretations", {key.replace(" ", "_"): [one[key] for one in kept] for key in kept[0]})
    work.scene(SCENE.removesuffix(".toml"), found.nearest.scene(5000.0))
    work.text(SCENE_FILE, file_text(found.nearest))
    work.notes = [_notes(work, found, there, influences["friction_N"])]
    larger = interval(rows, "10 larger", SPACE)
    work.conclude(
        "often" if larger.value >= RARE_BELOW else "rare",
        supports=larger.value >= RARE_BELOW,
        larger=often(larger),
        more=often(interval(rows, "11 more", SPACE)),
        count=len(rows),
        holding=row["holding"],
        claims=len(TESTED),
        neighbours=percent(share(found.of("neighbour"), "10 larger")),
        friction_mN=1e3 * FRICTION_N,
        friction=", ".join(
            f"{SHORT[name]} {stiffness / 1e3:.1f}" for name, stiffness in influences["friction_N"][1].items()
        ),
    )
    # Inertia may steady stiffer walls with the unit than with the encoder's second differences.
    unit, encoder = influences["acceleration"]
    better = all(unit[kind] > encoder[kind] for kind in KINDS[2:])
    of_unit, of_encoder = (" and ".join(f"{of[kind] / 1e3:.1f}" for kind in KINDS[2:]) for of in (unit, encoder))
    words = {"velocity": found.nearest.velocity, "nearest": NEAREST}
    return [CLAIMS["unit"].holds_if(False, better, unit=of_unit, encoder=of_encoder, **words)]


def _largest(work: Work, setups: Sequence[Setup]) -> list[Largest]:
    """Returns the largest steady stiffness of each element in each setup; those of one structure run together."""
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
    """Returns for each value of a setup a lower and an upper one, or two other choices."""
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
        dress(ax, name.replace("-", " "), "largest steady stiffness (N/mm)", "")
        ax.margins(x=0.3)
        ax.set_xticks(range(0, 9, 2))
    axes[0].set_yticks(range(len(varied)), [SPACE.label(key) for key in varied])
    axes[0].invert_yaxis()
    return figure


def _notes(work: Work, found: Found[Setup], there: Sequence[Option], friction: tuple[Largest, Largest]) -> str:
    rows, [row] = found.of("random"), found.of("nearest")
    described = describe(found.nearest)
    measured = zip(("nearest interpretation", "with friction of 48 mN"), friction, strict=True)
    bears = [["the paper", "", *(f"{stiffness / 1e3:.1f}" for stiffness in PAPER.values())]]
    bears += [[name, *(f"{one[kind] / 1e3:.1f}" for kind in NAMES)] for name, one in measured]
    kinds = [*(SHORT[kind] for kind in KINDS), "damping with unidirectional"]
    never = never_together(rows, [name for name in TESTED if share(rows, name) >= _OFTEN])
    alone = claims_table(
        TESTED,
        SPACE,
        {"nearest": row},
        found.of("neighbour"),
        rows,
        there,
    )
    bounds = (
        f"- {SPACE.label(key)}: {SPACE.value(key, low)} to {SPACE.value(key, high)}"
        for key, (low, high) in SPACE.bounds.items()
    )
    return work.tell(
        "notes",
        **search_words(SPACE, WHOLE, found, TESTED),
        described=f"{described[:1].upper()}{described[1:]}",
        file=SCENE_FILE,
        holding=row["holding"],
        lacks=", ".join(f"*{name}*" for name in TESTED if not holds(row, name)),
        stiffnesses=markdown_table(["", *kinds], bears, numbers=range(1, 6)),
        bears=sum(max(row[f"{name}_N_m"] for name in PAPER) > 0.0 for row in rows),
        alone=alone,
        most=max(row["holding"] for row in found.rows),
        never=work.tell("never", often=percent(_OFTEN), pairs=never) if never else "",
        papers=", ".join(f"{name.replace('-', ' ')} {stiffness / 1e3:.1f}" for name, stiffness in PAPER.items()),
        numbers="\n".join(bounds),
    )
