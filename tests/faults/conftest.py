"""The run that the runs of these tests are compared with."""

from __future__ import annotations

import pytest

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.logger import read
from haploop.logger.log.recording import Recording
from helpers.live.launched import SCENE


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """The log of 30 s of figure 6(c), run in one process to its end."""
    kinds = registry()
    out = tmp_path_factory.mktemp("undisturbed")
    run_in_process(load(SCENE, ["duration=30"], kinds), kinds, out=out)
    return read(out)
