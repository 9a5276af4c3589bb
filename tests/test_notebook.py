"""docs/notebook.ipynb runs as it stands, with every warning an error, and holds what came of it."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import pytest

from haploop.tools.notebook import Cell, run_cells

FILE = Path(__file__).parents[1] / "docs/notebook.ipynb"
NOTEBOOK = json.loads(FILE.read_text(encoding="utf-8"))
CODE = [cell for cell in NOTEBOOK["cells"] if cell["cell_type"] == "code"]


def words(cells: list[dict[str, Any]]) -> list[Any]:
    """What the cells say, without their pictures: those differ from one matplotlib to the next."""
    outputs = [output for cell in cells for output in cell["outputs"]]
    return [output.get("text") or output["data"].get("text/plain") for output in outputs]


@pytest.mark.slow
def test_every_cell_runs_and_says_what_the_notebook_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(FILE.parent)
    again = copy.deepcopy(NOTEBOOK)
    run_cells(again["cells"])
    assert words([cell for cell in again["cells"] if cell["cell_type"] == "code"]) == words(CODE)


def test_the_notebook_holds_the_figures_it_draws() -> None:
    drawn = sum("plt.subplots" in "".join(cell["source"]) for cell in CODE)
    held = [output for cell in CODE for output in cell["outputs"] if "image/png" in output.get("data", {})]
    assert len(held) == drawn >= 3


def test_a_cell_that_fails_fails_the_whole() -> None:
    cell: Cell = {"cell_type": "code", "source": ["1 / 0"], "outputs": []}
    with pytest.raises(ZeroDivisionError):
        run_cells([cell])


def test_the_file_is_a_notebook_of_the_format_it_names() -> None:
    assert (NOTEBOOK["nbformat"], NOTEBOOK["nbformat_minor"]) == (4, 5)
    assert len({cell["id"] for cell in NOTEBOOK["cells"]}) == len(NOTEBOOK["cells"])
    assert all(line.endswith("\n") for cell in NOTEBOOK["cells"] for line in cell["source"][:-1])
