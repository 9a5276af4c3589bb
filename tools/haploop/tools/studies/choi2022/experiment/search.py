"""The search for the interpretation of the experiments nearest to the paper, and the report of it below Fig. 7."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from haploop.tools.render.terminal import markdown_table
from haploop.tools.search.random import Effort, Point, Scale, random_search
from haploop.tools.studies.choi2022.experiment.measure import CLAIMS, NAMES, PAPER, gap_N_m, measure
from haploop.tools.studies.choi2022.experiment.setup import FRICTION_N, SCENE_FILE, UNITS, VELOCITIES, Setup
from haploop.tools.studies.choi2022.interpretations import Found, InterpretationSpace, Option, holds, percent, share
from haploop.tools.studies.choi2022.search_report import (
    by_number_of_claims,
    claims_table,
    list_of_choices,
    pairs_never_together,
)
from haploop.tools.studies.choi2022.work import Work

SPACE = InterpretationSpace(
    # Extra delay in s: from nothing to what a slow input and output card adds.
    choices={
        "delay_s": (0.0, 0.0003, 0.0006, 0.001, 0.0015, 0.002),
        "unit": tuple(UNITS),
        "mount": ("motor", "tip"),
        "velocity": tuple(VELOCITIES),
    },
    # The mode's frequency from below what was reported (near 200 Hz) to where it hardly matters; the near mass from the
    # rotor alone (0.0029 kg of 0.0525) to most of it; ratios of damping of metal drives; a press and a tap as a hand
    # makes them; a hand half to twice as heavy, damped and stiff as the published mean.
    bounds={
        "mode_Hz": (80.0, 500.0),
        "near_share": (0.055, 0.8),
        "mode_damping": (0.005, 0.06),
        "push_N": (1.5, 4.0),
        "entry_m_s": (0.1, 0.24),
        "hand": (0.5, 2.0),
    },
    # Delays are whole plant steps.
    scales={"delay_s": Scale(1e-4, 0.0, 2e-3)},
    # As a scene file has them: what is steady may hang on the fourth digit.
    digits=3,
    labels={
        "delay_s": "extra delay (s)",
        "unit": "inertial unit",
        "mount": "mount of the unit",
        "velocity": "low-pass of the velocity",
        "friction_N": "dry friction (N)",
        "acceleration": "acceleration of",
        "mode_Hz": "mode of the drive (Hz)",
        "near_share": "near mass, share",
        "mode_damping": "mode's damping ratio",
        "push_N": "push (N)",
        "entry_m_s": "entry speed (m/s)",
        "hand": "hand, times the published",
    },
)
SEED = 2022
WHOLE = Effort(
    structures=24, each=24, rounds=2, best=3, groups=3, children=8, neighbours=24, far=0.15, close=0.05
)  # fmt: skip
SMALL = Effort(structures=1, each=2, rounds=1, best=1, children=1, neighbours=1, far=0.15)
# Claims that hold less often than this are in no pair of those that never hold together.
_OFTEN = 0.05


def setup_of(point: Point) -> Setup:
    """Returns a point of the space as a setup, without friction."""
    return Setup(**point.numbers, **point.choices)


def evaluate(points: Sequence[Point]) -> list[dict[str, Any]]:
    """Returns the rows of points of the space."""
    return measure([setup_of(point) for point in points])


def search(work: Work) -> Found[Setup]:
    """Searches with the fixed seed; the same effort gives the same rows, whatever the number of workers.

    Stages are "random", "refined", "neighbour", "nearest" and "friction": all are without friction, which takes some
    forty times as long to run, and the nearest alone is run with it, too.
    """

    def run(stage: str, *args: Any) -> list[Any]:
        return work.map_parallel(f"interpretations of the experiments, {stage}, in groups", *args)

    found = random_search(
        SPACE,
        evaluate,
        SMALL if work.small else WHOLE,
        seed=SEED,
        distance=lambda row: row["distance"],
        tie=gap_N_m,
        evaluate_all=run,
    )
    nearest = setup_of(found.best.point)
    rough = replace(nearest, friction_N=0.0 if work.small else FRICTION_N)
    [[with_friction]] = run("friction", measure, [[rough]])
    ends = [found.best.row | {"stage": "nearest"}, with_friction | {"stage": "friction"}]
    return Found([*(trial.row for trial in [*found.trials, *found.neighbours]), *ends], nearest)


def columns(found: Found[Setup]) -> dict[str, list[Any]]:
    """Returns the rows as columns, for the data beside the figure; that of the nearest is among them once."""
    rows = [row for row in found.rows if row["stage"] != "nearest"]
    return {key.replace(" ", "_"): [row[key] for row in rows] for key in rows[0]}


def describe(setup: Setup) -> str:
    """Returns an interpretation in one line."""
    return SPACE.describe(setup.as_dict(), (*SPACE.choices, *SPACE.bounds))


def notes(work: Work, found: Found[Setup], options: Sequence[Option]) -> list[str]:
    """Returns the sections below the figure."""
    return [*_nearest(work, found), *_alone(found, options), *_together(found), *_method(work, found)]


def _nearest(work: Work, found: Found[Setup]) -> list[str]:
    values = describe(found.nearest)
    [row], [with_friction] = found.of("nearest"), found.of("friction")
    lacks = ", ".join(f"*{name}*" for name in CLAIMS if not holds(row, name))
    measured = {"nearest interpretation": row, "with friction of 48 mN": with_friction}
    rows = [["the paper", "", *(f"{stiffness / 1e3:.1f}" for stiffness in PAPER.values())]]
    rows += [[name, *(f"{one[f'{kind}_N_m'] / 1e3:.1f}" for kind in NAMES)] for name, one in measured.items()]
    kinds = ["nothing", "damping", "bidirectional", "unidirectional", "damping with unidirectional"]
    return [
        "#### The nearest interpretation",
        f"{values[:1].upper()}{values[1:]}: launch/scenes/{SCENE_FILE}, in which Figs. 8 to 13 are made. "
        f"{row['holding']} of the {len(CLAIMS)} claims hold for it; it lacks {lacks}. Largest steady stiffness "
        "in N/mm:",
        markdown_table(["", *kinds], rows, numbers=range(1, 6)),
        work.tell("friction"),
    ]


def _alone(found: Found[Setup], options: Sequence[Option]) -> list[str]:
    rows = found.of("random")
    bears = sum(max(row[f"{name}_N_m"] for name in PAPER) > 0.0 for row in rows)
    return [
        "#### Each claim alone",
        f"Of {len(rows)} random interpretations {bears} let any element steady a wall of 2.5 N/mm. Shares are of all.",
        claims_table(
            CLAIMS,
            {"nearest": found.of("nearest")[0]},
            {"its neighbours": found.of("neighbour"), "random interpretations": rows},
            options,
            "likeliest with, and least with",
        ),
    ]


def _together(found: Found[Setup]) -> list[str]:
    rows, most = found.of("random"), max(row["holding"] for row in found.rows)
    never = pairs_never_together(rows, [name for name in CLAIMS if share(rows, name) >= _OFTEN])
    often = f" Of those that hold in {percent(_OFTEN)} or more, never both: {never}." if never else ""
    return [
        "#### All claims together",
        f"The most that hold under any interpretation, refined ones included, are {most}. Random interpretations by "
        f"how many hold: {by_number_of_claims(rows, len(CLAIMS))}.{often}",
    ]


def _method(work: Work, found: Found[Setup]) -> list[str]:
    count = Counter(row["stage"] for row in found.rows)
    papers = ", ".join(f"{name.replace('-', ' ')} {stiffness / 1e3:.1f}" for name, stiffness in PAPER.items())
    numbers = [
        f"- {SPACE.label(key)}: {SPACE.value(key, low)} to {SPACE.value(key, high)}"
        for key, (low, high) in SPACE.bounds.items()
    ]
    return [
        "#### How was searched",
        work.tell("method", seed=SEED, far=WHOLE.far, close=WHOLE.close, papers=papers, **count),
        "\n".join([list_of_choices(SPACE), *numbers]),
        work.tell("unit"),
    ]
