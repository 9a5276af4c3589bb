"""Runs the code of a notebook and stores its outputs in it: ``python -m haploop.tools.notebook FILE``.

The cells run in order, in one namespace and in the notebook's directory, as Jupyter would run them; Jupyter itself is
not needed. What a cell prints, the value of its last line and the figures it draws become its outputs.
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Literal, NotRequired, TypedDict


class Cell(TypedDict):
    """A cell; one of code has the last two."""

    cell_type: str
    source: list[str]
    execution_count: NotRequired[int]
    outputs: NotRequired[list[Output]]


class Output(TypedDict, total=False):
    """An output of a cell."""

    output_type: Literal["stream", "execute_result", "display_data"]
    name: Literal["stdout"]
    text: list[str]
    execution_count: int
    metadata: dict[str, str]
    data: dict[str, str | list[str]]


def run_cells(cells: Sequence[Cell]) -> None:
    """Runs every code cell of a notebook of format 4 and replaces its outputs. If one raises, discard the notebook."""
    import matplotlib

    matplotlib.use("Agg")
    main_module = ModuleType("__main__")
    for number, cell in enumerate((c for c in cells if c["cell_type"] == "code"), start=1):
        cell["execution_count"] = number
        cell["outputs"] = _outputs("".join(cell["source"]), main_module, number)


def _outputs(source: str, module: ModuleType, number: int) -> list[Output]:
    tree, file = ast.parse(source), f"cell {number}"
    shows = bool(tree.body) and isinstance(tree.body[-1], ast.Expr) and not source.rstrip().endswith(";")
    last = tree.body.pop() if shows else None
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(compile(tree, file, "exec"), vars(module))
        value = None
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), file, "eval"), vars(module))
    outputs: list[Output] = []
    if text := printed.getvalue():
        outputs.append({"output_type": "stream", "name": "stdout", "text": text.splitlines(keepends=True)})
    if value is not None:
        data: dict[str, str | list[str]] = {"text/plain": repr(value).splitlines(keepends=True)}
        outputs.append({"output_type": "execute_result", "execution_count": number, "metadata": {}, "data": data})
    return outputs + [{"output_type": "display_data", "metadata": {}, "data": {"image/png": png}} for png in _figures()]


def _figures() -> list[str]:
    if "matplotlib.pyplot" not in sys.modules:
        return []
    from matplotlib import pyplot

    images = []
    for number in pyplot.get_fignums():
        image = io.BytesIO()
        pyplot.figure(number).savefig(image, format="png", dpi=80, bbox_inches="tight", metadata={"Software": None})
        images.append(base64.b64encode(image.getvalue()).decode())
    pyplot.close("all")
    return images


def main(path: Path) -> None:
    path = path.resolve()
    notebook = json.loads(path.read_text(encoding="utf-8"))
    os.chdir(path.parent)
    run_cells(notebook["cells"])
    path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
