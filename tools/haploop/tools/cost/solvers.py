"""Solvers of other programs as plants of figure 6(b): how far from the exact flow they are, and what the books say."""

from __future__ import annotations

import json
import shlex
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import haploop.logger
from haploop.launch.processes.foreign import read_programs
from haploop.launch.runs.start import prepare, run
from haploop.launch.spec import RunFailed
from haploop.tools.cli.options import WRONG_USE, leave
from haploop.tools.cost.grid import scenes_folder
from haploop.tools.render.terminal import markdown_table
from haploop.tools.render.units import amount

SOLVERS_FILE = "solvers.json"
_BY_WINDOW = ("run.verdict=window",)
_ABOUT = """\
Each of these programs was the plant of figure 6(b) in haploop's place (`examples/`), device and hand moved by its own
method at the scene's plant rate, and its rows went into the energy books. *Farthest*: the largest distance of the
position from the exact flow's at any plant step. *Residual*: the energy that the books leave unexplained, of what
moved: what the solver makes of nothing, or loses. Beyond a thousandth every run says so in words."""


@dataclass(frozen=True)
class Solver:
    """A plant of examples/.

    Attributes:
        name: of program and method.
        needs: the module that must be installed.
        command: the file in examples/ and its options; ``{directory}`` is that of the measurement.
        file: what must lie in the directory of the measurement; "" for nothing.
    """

    name: str
    needs: str
    command: str
    file: str = ""

    def lack(self, directory: Path) -> str:
        """Returns why it cannot be measured here, "" where it can."""
        if find_spec(self.needs) is None:
            return f"not measured: {self.needs} is not installed"
        if self.file and not (directory / self.file).is_file():
            return f"not measured: there was no {self.file}"
        return ""

    def words(self, examples: Path, directory: Path) -> str:
        """Returns the command as ``--node plant=`` takes it."""
        script, *options = self.command.format(directory=shlex.quote(str(directory))).split(" ", 1)
        return " ".join([shlex.quote(sys.executable), shlex.quote(str(examples / script)), *options])


SOLVERS = (
    Solver("MuJoCo, Runge-Kutta 4", "mujoco", "mujoco_plant.py --integrator rk4"),
    Solver("MuJoCo, Euler", "mujoco", "mujoco_plant.py --integrator euler"),
    Solver("MuJoCo, implicit", "mujoco", "mujoco_plant.py --integrator implicit"),
    Solver(
        "StateSpace of the Reference FMUs, its own Euler",
        "fmpy",
        "fmu_plant.py {directory}/StateSpace.fmu --state-space",
        file="StateSpace.fmu",
    ),
)


@dataclass(frozen=True)
class Measured:
    """One solver measured.

    Attributes:
        version: of its program, as it said.
        farthest_m: largest distance of the position from the exact flow's; None where it was not measured.
        residual: of the energy that moved.
        words: what the books say of it, or why it was not measured.
    """

    solver: str
    version: str = ""
    farthest_m: float | None = None
    residual: float | None = None
    words: str = ""


def measure(scene: Path, solvers: Iterable[Solver], examples: Path, directory: Path) -> list[Measured]:
    """Runs a scene with each of these as its plant, beside the exact flow of its own.

    Raises:
        SceneError, LogError: the scene cannot be run.
    """
    with tempfile.TemporaryDirectory(prefix="haploop-solvers-") as scratch:
        own = Path(scratch) / "own"
        run(prepare(scene, _BY_WINDOW, out=own), in_process=True)
        exact = haploop.logger.read(own)["/plant"]["x"]
        return [
            _measured(scene, solver, exact, solver.words(examples, directory), Path(scratch) / str(number))
            if not (lack := solver.lack(directory))
            else Measured(solver.name, words=lack)
            for number, solver in enumerate(solvers)
        ]


def _measured(scene: Path, solver: Solver, exact: np.ndarray, words: str, out: Path) -> Measured:
    try:
        summary = run(prepare(scene, _BY_WINDOW, out=out), programs=read_programs([f"plant={words}"], []))
    except RunFailed as error:
        return Measured(solver.name, words=f"not measured: {error}")
    energy, x = summary["energy"], haploop.logger.read(out)["/plant"]["x"]
    farthest_m = float(np.abs(x - exact).max()) if len(x) == len(exact) else None
    said = energy.get("balance", "").partition(":")[0]
    version = summary.get("programs", {}).get("plant", {}).get("version", "")
    return Measured(solver.name, version, farthest_m, energy["residual_J"] / energy["moved_J"], said)


def read_measured(directory: Path) -> list[Measured]:
    """Returns what ``main`` has left in a directory; nothing where it has not."""
    file = directory / SOLVERS_FILE
    return [Measured(**row) for row in json.loads(file.read_text(encoding="utf-8"))] if file.exists() else []


def section(measured: Sequence[Measured]) -> list[str]:
    """Returns the part of the page on accuracy that tells of them, in Markdown; nothing for none."""
    rows = [
        [
            row.solver + (f" ({row.version})" if row.version else ""),
            "–" if row.farthest_m is None else amount(row.farthest_m, "m", 2),
            "–" if row.residual is None else f"{row.residual:.1e}",
            row.words or "nothing, being below a thousandth",
        ]
        for row in measured
    ]
    heads = ("plant", "farthest from the exact flow", "residual", "what the books say")
    table = markdown_table(heads, rows, numbers=(1, 2))
    return ["## Solvers of other programs, judged by the books", table, _ABOUT] if rows else []


def main() -> None:
    """Runs ``python -m haploop.tools.cost.solvers DIRECTORY EXAMPLES``; what is not installed is told and left out."""
    if len(sys.argv) != 3:
        leave("Two directories were expected: that of a haploop cost, and examples/.", WRONG_USE)
    directory, examples = map(Path, sys.argv[1:])
    measured = measure(scenes_folder() / "fig6b.toml", SOLVERS, examples, directory)
    directory.mkdir(parents=True, exist_ok=True)
    rows = [asdict(row) for row in measured]
    (directory / SOLVERS_FILE).write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    for row in measured:
        far = "" if row.farthest_m is None else f"{amount(row.farthest_m, 'm', 2)} from the exact flow; "
        left = "" if row.residual is None else f"residual {row.residual:.1e} of what moved. "
        print(f"{row.solver}: {far}{left}{row.words}".rstrip())


if __name__ == "__main__":
    main()
