"""Other people's solvers as plants of figure 6(b), judged by the books: a table of docs/accuracy.md.

usage: python tests/bench/plants.py PAGE, by `make accuracy`. What is not installed keeps the row that the page has of
it, with a word. The environment's STATE_SPACE_FMU names the Reference FMUs' StateSpace.fmu, built with
FIXED_SOLVER_STEP 1e-3.
"""

import importlib.util
import os
import shlex
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np

import haploop.logger
from haploop.launch.foreign import read_programs
from haploop.launch.runs.start import prepare, run
from haploop.protocol.amounts import amount
from haploop.tools.render.terminal import markdown_table

HOUSE = Path(__file__).parents[2]
SCENE = HOUSE / "launch/scenes/fig6b.toml"
TITLE = "Plants of others, judged by the books"
INTRO = """\
The scene of figure 6(b), 3 s with a plant step of 0.1 ms, with other people's solvers in place of the plant
(`haploop run --node`). *Distance* is the largest between their position and that of the exact flow at any plant step;
*residual* is what the books cannot account for, as a share of the energy that moved; that of
the exact flow is rounding, and beyond a thousandth every run says in words what its plant makes of the energy."""
NOTE = """\
MuJoCo holds every applied force over a step. The hand's is given as its mean over the step, and that is what is left of
RK4: with a constant force its residual is 2e-13. For one joint, Euler takes the damping implicitly, as `implicit`
does, and both come to the same. StateSpace moves by explicit Euler, here with steps of 1 ms."""


class Solver(NamedTuple):
    """A plant of examples/: what it is called, the package it needs, and its words on the command line.

    ``given`` is the variable of the environment that must name a file, the second word; "" where there is none.
    """

    name: str
    package: str
    words: tuple[str, ...]
    given: str = ""

    @property
    def lacks(self) -> str:
        """What there is none of here, "" for nothing."""
        if importlib.util.find_spec(self.package) is None:
            return self.package
        return "" if not self.given or Path(os.environ.get(self.given, "")).is_file() else self.given

    @property
    def script(self) -> list[str]:
        file = [os.environ[self.given]] if self.given else []
        return [sys.executable, str(HOUSE / "examples" / self.words[0]), *file, *self.words[1:]]


SOLVERS = [
    Solver(f"MuJoCo {name}, {device}", "mujoco", ("mujoco_plant.py", "--integrator", key, "--device", device))
    for device in ("slider", "arm")
    for key, name in (("rk4", "RK4"), ("euler", "Euler"), ("implicit", "implicit"))
] + [Solver("StateSpace of the Reference FMUs", "fmpy", ("fmu_plant.py", "--state-space"), "STATE_SPACE_FMU")]


def measured(solver: Solver | None, out: Path) -> tuple[np.ndarray, float, str]:
    """Returns x at every plant step, m, the residual as a share of what moved, and what is said of it.

    ``solver`` is None for the run's own plant.
    """
    programs = read_programs([f"plant={shlex.join(solver.script)}"] if solver else [], [])
    summary = run(prepare(SCENE, ["run.verdict=window"], out=out), programs=programs)
    energy = summary["energy"]
    said = energy.get("balance", "").partition(":")[0] or "–"
    return np.asarray(haploop.logger.read(out)["/plant"]["x"]), energy["residual_J"] / energy["moved_J"], said


def section(directory: Path, before: str) -> str:
    """Returns the section, intro, table and note, with the rows of ``before`` for what cannot be measured here."""
    kept = {cells[1].strip(): [cell.strip() for cell in cells[1:5]] for cells in map(_cells, before.splitlines())}
    exact, residual, said = measured(None, directory / "exact")
    rows = [("haploop, exact flow", "–", f"{residual:.1e}", said)]
    missing: dict[str, list[str]] = {}
    for number, solver in enumerate(SOLVERS):
        if lacks := solver.lacks:
            missing.setdefault(lacks, []).append(solver.name)
            rows += [tuple(kept[solver.name])] if solver.name in kept else []
            continue
        x, residual, said = measured(solver, directory / str(number))
        rows.append((solver.name, amount(float(np.abs(x - exact).max()), "m", 2), f"{residual:.1e}", said))
    left_out = [f"Not measured anew, for want of {lacks}: {', '.join(names)}." for lacks, names in missing.items()]
    there = sorted({solver.package for solver in SOLVERS if not solver.lacks})
    made = f"Measured with {', '.join(f'{package} {version(package)}' for package in there)}." if there else ""
    table = markdown_table(("plant", "distance", "residual", "said of it"), rows)
    return "\n\n".join([TITLE, INTRO, table, NOTE, *left_out, *([made] if made else [])]) + "\n"


def _cells(line: str) -> list[str]:
    cells = line.split("|")
    return cells if len(cells) == 6 else [""] * 6


def main() -> None:
    page, before = map(Path, sys.argv[1:])
    text = page.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as directory:
        made = section(Path(directory), before.read_text(encoding="utf-8"))
    sections = [one for one in text.split("\n## ") if not one.startswith(TITLE)]
    sections.insert(-1, made)  # the last one tells the machine
    page.write_text("\n## ".join(sections), encoding="utf-8")
    print(made)


if __name__ == "__main__":
    main()
