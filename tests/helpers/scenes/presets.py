"""Loops of the devices that come with haploop, as ``haploop advise`` takes them."""

from pathlib import Path

from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.subject import make_subject
from haploop.tools.advise.walls.cases import make_loop
from helpers.scenes.least import KINDS

SCENES = Path(__file__).parents[3] / "launch" / "scenes"


def loop_of(device: str, *overrides: str) -> Scene:
    asked = make_subject(device, None, None, None, overrides, KINDS)
    return make_loop(asked.scene, asked.has_task)
