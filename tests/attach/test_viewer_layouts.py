"""The layouts that the guide to viewers hands out show what a run publishes, in the form that their programs read."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

import haploop.logger
from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.logger.log.recording import Recording

HOUSE = Path(__file__).parents[2]
DOCS = HOUSE / "docs"
PLOTJUGGLER, FOXGLOVE = DOCS / "plotjuggler_layout.xml", DOCS / "foxglove_layout.json"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    kinds, out = registry(), tmp_path_factory.mktemp("run")
    run_in_process(load(HOUSE / "launch/scenes/fig6c.toml", ["duration=0.1"], kinds), kinds, out=out)
    return haploop.logger.read(out)


def test_every_curve_of_the_plotjuggler_layout_is_a_series_of_a_run(log: Recording) -> None:
    """A series is called topic/name there; an XY curve names two of one topic, which have the same times."""
    series = {f"{topic}/{name}" for topic in ("/plant", "/controller", "/energy") for name in log[topic]}
    curves = ElementTree.parse(PLOTJUGGLER).getroot().findall(".//curve")
    assert len(curves) > 8
    for curve in curves:
        names = [curve.get("curve_x"), curve.get("curve_y")] if "curve_x" in curve.attrib else [curve.get("name")]
        assert set(names) <= series, names
        assert len({str(name).rpartition("/")[0] for name in names}) == 1


def test_the_plotjuggler_layout_is_nested_as_plotjuggler_reads_it() -> None:
    """As versions 3 write it: each splitter counts its children and gives each its share; nothing else is looked at."""
    root = ElementTree.parse(PLOTJUGGLER).getroot()
    assert root.tag == "root"
    plots = root.findall("tabbed_widget[@parent='main_window']/Tab/Container/DockSplitter/DockArea/plot")
    assert len(plots) == len(root.findall(".//plot")) == 5
    for splitter in root.iter("DockSplitter"):
        shares = [float(share) for share in splitter.attrib["sizes"].split(";")]
        assert int(splitter.attrib["count"]) == len(splitter) == len(shares)
        assert sum(shares) == pytest.approx(1.0)
        assert splitter.attrib["orientation"] in "|-"
    assert {plot.attrib["mode"] for plot in plots} == {"TimeSeries", "XYPlot"}
    streamer = root.find("previouslyLoaded_Streamer")
    assert streamer is not None
    assert streamer.get("name") == "ZMQ Subscriber"


def paths(panel: dict[str, Any]) -> list[tuple[str, str]]:
    """Topic and field of every path of a plot; a field with a point in it stands in quotes."""
    values = [path["value"] for path in (*panel["paths"], *([panel["xAxisPath"]] if "xAxisPath" in panel else ()))]
    parsed = [re.fullmatch(r'(/\w+)\.(?:(\w+)|"([\w.-]+)")', value) for value in values]
    return [(found[1], found[2] or found[3]) for found in parsed if found] if all(parsed) else [("", str(values))]


def test_every_path_of_the_foxglove_layout_is_a_column_of_a_run(log: Recording) -> None:
    panels = json.loads(FOXGLOVE.read_text(encoding="utf-8"))["configById"]
    plots = [panel for name, panel in panels.items() if name.startswith("Plot!")]
    assert len(plots) == 4
    for topic, name in (path for panel in plots for path in paths(panel)):
        assert name in log[topic], (topic, name)


def test_the_foxglove_layout_places_every_panel_once() -> None:
    layout = json.loads(FOXGLOVE.read_text(encoding="utf-8"))

    def leaves(tree: Any) -> list[str]:
        return [tree] if isinstance(tree, str) else leaves(tree["first"]) + leaves(tree["second"])

    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"])


def test_every_file_that_the_guide_links_to_is_there() -> None:
    links = re.findall(r"\]\(([^)#:]+)\)", (DOCS / "viewers.md").read_text(encoding="utf-8"))
    assert {"plotjuggler_layout.xml", "foxglove_layout.json"} <= set(links)
    assert [link for link in links if not (DOCS / link).exists()] == []
