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
from pathlib import Path
from typing import Any

Notebook = dict[str, Any]


def run_cells(notebook: Notebook) -> None:
    """Runs every code cell and replaces its outputs.

    Raises:
        Exception: whatever a cell raises; the notebook is then to be thrown away.
    """
    import matplotlib

    matplotlib.use("Agg")
    names: dict[str, Any] = {"__name__": "__main__"}
    for number, cell in enumerate((c for c in notebook["cells"] if c["cell_type"] == "code"), start=1):
        cell["execution_count"] = number
        cell["outputs"] = _outputs("".join(cell["source"]), names, number)


def _outputs(source: str, names: dict[str, Any], number: int) -> list[dict[str, Any]]:
    """Runs the code of cell ``number`` and returns its outputs."""
    tree, file = ast.parse(source), f"cell {number}"
    shows = bool(tree.body) and isinstance(tree.body[-1], ast.Expr) and not source.rstrip().endswith(";")
    last = tree.body.pop() if shows else None
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(compile(tree, file, "exec"), names)
        value = eval(compile(ast.Expression(last.value), file, "eval"), names) if isinstance(last, ast.Expr) else None
    outputs: list[dict[str, Any]] = []
    if text := printed.getvalue():
        outputs.append({"output_type": "stream", "name": "stdout", "text": text.splitlines(keepends=True)})
    if value is not None:
        data = {"text/plain": repr(value).splitlines(keepends=True)}
        outputs.append({"output_type": "execute_result", "execution_count": number, "metadata": {}, "data": data})
    return outputs + [{"output_type": "display_data", "metadata": {}, "data": {"image/png": png}} for png in _figures()]


def _figures() -> list[str]:
    """Returns the figures that stand open, as PNG in base64; they are closed."""
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
    """Runs a notebook and writes it back."""
    path = path.resolve()
    notebook = json.loads(path.read_text(encoding="utf-8"))
    os.chdir(path.parent)
    run_cells(notebook)
    path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
