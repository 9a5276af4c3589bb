"""Runs that are judged at their end, without books and log."""

from __future__ import annotations

from haploop.controller.dissipation import registry
from haploop.launch.stability.finding import Finding
from haploop.launch.stability.judge import end_of, judge_scene
from haploop.launch.stability.still_hand import End
from haploop.protocol.scene.scene import Scene


def ended(scene: Scene) -> End:
    """The end of a scene's run, in contact."""
    end = end_of(scene, registry())
    assert end.told is None, end.told.sentence()
    return end


def found(scene: Scene) -> Finding:
    """The finding at the end of a scene's run."""
    return judge_scene(scene, registry())
