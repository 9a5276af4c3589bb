"""``--jax``: the same table, within the tolerance of the compiled way."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

from helpers.scenes.sweep_files import GRID, swept

if not find_spec("jax"):
    pytest.skip("JAX is not installed", allow_module_level=True)


@pytest.mark.slow
def test_compiled_the_verdicts_are_the_same_and_the_numbers_within_its_tolerance(tmp_path: Path) -> None:
    text = 'record = ["extremes.x_min_m", "extremes.force_max_N"]\n' + GRID
    plain, compiled = swept(tmp_path, text), swept(tmp_path, text, out=tmp_path / "jax", compiled=True)
    assert compiled["verdict"].tolist() == plain["verdict"].tolist()
    assert compiled["scene"].tolist() == plain["scene"].tolist()
    for name in ("extremes.x_min_m", "extremes.force_max_N"):
        assert compiled[name] == pytest.approx(plain[name], rel=1e-9)


def test_bits_are_refused_since_the_compiled_way_keeps_to_a_tolerance(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        swept(tmp_path, 'record = ["trajectory_sha256"]\n' + GRID, compiled=True)
    assert "leave it out of record" in capsys.readouterr().err
