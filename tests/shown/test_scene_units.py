"""Units beside the numbers of elements: those that a plugin file declares are read from its text, which is not run."""

from __future__ import annotations

import re
from pathlib import Path

from haploop.tools.render.scene_units import declared_units

GUIDE = Path(__file__).parents[2] / "docs/plugins.md"


def test_a_plugin_file_tells_the_units_of_its_parameters_without_being_run():
    example = re.search(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    assert example
    units = declared_units("raise SystemExit('it was run')\n" + example[1])
    assert units["observer.most"] == "N s/m"
    assert units["observer.hold"] == ""


def test_a_declaration_that_cannot_be_read_has_no_unit():
    assert declared_units("class One:\n    kind = 'a' + 'b'\n    gain: Annotated[float, Quantity('N')]\n") == {}
    assert declared_units("class One:\n    kind = 'a'\n    gain: Annotated[float, Quantity(UNIT)]\n") == {}
    assert declared_units("no Python (") == {}
