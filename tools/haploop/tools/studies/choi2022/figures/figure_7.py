"""Fig. 7 shows the experiments' device: here what of it nobody published, and the reading nearest to the paper."""

from __future__ import annotations

from typing import Any

from haploop.tools.studies.choi2022.claims import Claim, Finding
from haploop.tools.studies.choi2022.colours import SHORT
from haploop.tools.studies.choi2022.experiment.influence import influence
from haploop.tools.studies.choi2022.experiment.reading_file import file_text
from haploop.tools.studies.choi2022.experiment.reading_notes import notes
from haploop.tools.studies.choi2022.experiment.reading_rows import CLAIMS as TESTED
from haploop.tools.studies.choi2022.experiment.reading_rows import PAPER
from haploop.tools.studies.choi2022.experiment.reading_search import Found, columns, search
from haploop.tools.studies.choi2022.experiment.readings import SPACE
from haploop.tools.studies.choi2022.experiment.setup import KINDS, SCENE_FILE
from haploop.tools.studies.choi2022.experiment.verdict_under_assumptions import READING, SCENE, keep_shares
from haploop.tools.studies.choi2022.simulation.search_figure import share_map
from haploop.tools.studies.choi2022.simulation.shares import options, percent, share
from haploop.tools.studies.choi2022.work import Work

TITLE = "The device of the experiments: readings, and the one nearest to the paper"
UNIT = Claim(
    "V.B.1",
    "owing to the noisy behavior of the double derivative, acceleration was obtained from an inertial measurement unit "
    "(IMU) sensor for better accuracy",
)
CLAIMS = (UNIT,)


def make(work: Work) -> list[Finding]:
    """The search, what each value does by itself, and the nearest reading as a scene."""
    found = search(work)
    rows = found.of("random")
    there = options(rows, SPACE)
    if there:
        seen = "How often each claim of Figs. 8 to 13 holds, by what a reading chose; the claims are told below."
        work.figure(share_map(there, list(TESTED), len(rows)), "figure_7", seen)
    keep_shares(work, list(TESTED), rows, there)
    influences = influence(work, found.nearest, found.with_friction)
    work.data("figure_7_readings", columns(found.rows))
    work.scene(SCENE.removesuffix(".toml"), found.nearest.scene(5000.0, []))
    work.path(SCENE_FILE).write_text(file_text(found.nearest), encoding="utf-8")
    work.notes = notes(found, there)
    work.answer = _answer(found)
    return [_on_the_unit(found, *influences["acceleration"])]


def _answer(found: Found) -> str:
    rows, row = found.of("random"), found.row
    here = ", ".join(f"{SHORT[name]} {row[f'{name}_N_m'] / 1e3:.1f}" for name in PAPER)
    papers = ", ".join(f"{stiffness / 1e3:.1f}" for stiffness in PAPER.values())
    return (
        "**The ranking of the paper's experiments is possible, and rare.** Unidirectional inertia steadies a stiffer "
        f"wall than damping and bidirectional inertia do in {percent(share(rows, '10 larger'))} of {len(rows)} random "
        f"readings of the device. The nearest reading bears, in N/mm and with the best of the few sizes that the "
        f"search tries, {here} (the paper: {papers}); of its neighbours, "
        f"all numbers a few per cent off, {percent(share(found.of('neighbour'), '10 larger'))} keep that ranking"
    )


def _on_the_unit(found: Found, unit: dict[str, float], encoder: dict[str, float]) -> Finding:
    """Whether inertia steadies stiffer walls with the unit than with the encoder's second differences."""
    inertias = KINDS[2:]
    better = all(unit[kind] > encoder[kind] for kind in inertias)
    words = "; ".join(f"{name} {_two(of)}" for name, of in (("the unit", unit), ("the encoder", encoder)))
    numbers = (
        f"largest steady stiffness with bi- and unidirectional inertia, acceleration of {words} N/mm (low-pass of the "
        f"velocity: {found.nearest.velocity})"
    )
    return UNIT.assuming(READING, numbers) if better else UNIT.fails(numbers)


def _two(of: dict[str, Any]) -> str:
    return " and ".join(f"{of[kind] / 1e3:.1f}" for kind in KINDS[2:])
