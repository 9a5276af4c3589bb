"""Snapshots of a history: their content, and the form in which they travel."""

import asyncio
import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from haploop.logger.log.writer import Log
from haploop.protocol.changes import Change, changes_of, refusal, spans
from haploop.protocol.scene.scene import ElementTable, Wall
from haploop.protocol.ticks import Timebase
from haploop.tools.cli.live_runs import LiveRuns
from haploop.view import viewer
from haploop.view.draw.messages import event_lines
from haploop.view.draw.snapshot import Viewport, snapshot
from haploop.view.store.history import AtWork, History
from helpers.live.browsing import decode, to_its_end
from helpers.live.waiting import PATIENCE_S
from helpers.scenes.least import typed

TIME = Timebase(10_000, 1_000, 0, 100_000)
WALL = Wall(position=0.0, stiffness=100.0)


def element(kind, **parameters):
    return ElementTable(name=kind, parameters=parameters)


def made_up(ticks=100, elements=(), wall: Wall | None = WALL, books=None):
    """A history of some ticks of made-up numbers."""
    history = History(TIME, 0)
    row, steps = np.arange(float(ticks)), np.arange(ticks * 10 + 1.0)
    history.append_plant_block(0, {"x": steps, "v": steps, "force": -steps})
    forces = {f"dissipation.{place}": row * (place + 2) for place in range(len(elements))}
    columns = {"x": row, "v": row / 10, "wall": row, "total": row, **forces}
    history.append_ticks(0, columns, AtWork(tuple(elements), wall))
    history.append_energy(0, {"wall.true": row, "residual": row * 1e-20, **(books or {})})
    return history


def drawn(history, **watch):
    return decode(snapshot(history, Viewport(**watch)))


def log_ticks(path, ticks):
    """A log of so many ticks, in which x counts the steps."""
    at, steps = np.arange(float(ticks)), np.arange(ticks * 10.0).reshape(ticks, 10)
    rows = {
        "/plant": ({"timestamp": steps / 1e4, "t": steps / 1e4, "x": steps, "v": steps, "force": -steps}, 10),
        "/controller": ({"timestamp": at / 1e3, "x": at, "v": at, "a": at, "wall": at, "total": at}, None),
        "/energy": ({"timestamp": at / 1e3, "wall.true": at, "residual": at}, None),
    }
    with Log(path / "log.mcap") as log:
        for topic, (columns, samples) in rows.items():
            channel = log.channel(topic, dict.fromkeys(columns, ""), samples_per_message=samples, title=topic)
            log.write(channel, np.arange(ticks) * 1_000_000, np.stack([*columns.values()], axis=-1))


@pytest.mark.parametrize("step", [1, 7, 100])
def test_the_overview_reaches_from_the_first_sample_to_the_newest_after_every_step(step):
    history = History(TIME, 0)
    for tick in range(0, 700, step):
        rows = np.arange(10.0 * tick, 10.0 * (tick + step) + 1.0)
        history.append_plant_block(tick, {"x": rows, "v": rows, "force": rows})
        x = drawn(history)["tables"]["overview"]["values"]["x"]
        assert (np.nanmin(x), np.nanmax(x)) == (0.0, rows[-2]), tick


def test_before_the_plant_is_heard_there_is_no_overview():
    history = History(TIME, 0)
    row = np.arange(5.0)
    history.append_ticks(300, {"x": row, "v": row, "wall": row, "total": row}, AtWork((), WALL))
    assert "overview" not in drawn(history)["tables"]


def test_a_log_that_is_not_there_yet_is_looked_for_again(tmp_path, monkeypatch):
    """A viewer that is welcomed together with the logger may be the quicker of the two."""
    monkeypatch.setattr(viewer, "_LOGGED_S", 0.01)
    live, prepended = History(TIME, 0), []
    for series in live.all_series:
        series.begin(300)
    here = SimpleNamespace(is_here=True)
    session: Any = SimpleNamespace(
        run=here, out=tmp_path, scene=typed(), time=TIME, events=[], outcome="", history=live, prepend=prepended.append
    )

    async def play():
        filling = asyncio.create_task(viewer.Viewer(LiveRuns(), None, from_start=True)._backfill(session))
        await asyncio.sleep(0.1)
        assert not filling.done()
        log_ticks(tmp_path, 300)
        await asyncio.wait_for(filling, PATIENCE_S)

    to_its_end(play())
    x = prepended[0].steps.rows(["x"], 0, 300)[0]
    np.testing.assert_array_equal(x, np.arange(3000.0))


def test_no_telemetry_gives_an_empty_snapshot():
    assert drawn(History(TIME, 0))["tables"] == {}
    assert drawn(History(TIME, 0), span_s=None)["tables"] == {}


def test_of_a_wall_that_is_no_spring_the_loop_has_the_curve_that_it_stores() -> None:
    ridged = Wall.from_dict({"kind": "texture", "position": 0.0, "stiffness": 100.0, "ridge_force": 2.0,
                             "ridge_spacing": 8.0, "occupies": "above"})  # fmt: skip
    depth, force = drawn(made_up(wall=ridged))["tables"]["loop"]["curve"]
    assert (depth[0], depth[-1]) == (0.0, 999.0)
    ridge = (np.array(depth) / 8.0) % 1.0
    arcs = np.where(ridge < 0.5, 16 * ridge * (0.5 - ridge), -16 * (ridge - 0.5) * (1.0 - ridge))
    np.testing.assert_allclose(force, 100.0 * np.array(depth) + 2.0 * arcs, rtol=1e-12)
    assert "curve" not in drawn(made_up())["tables"]["loop"]


def test_of_a_wall_whose_law_is_not_known_here_no_ideal_one_is_drawn() -> None:
    """That of a file is code, which a viewer does not read; a spring of its stiffness would be another wall."""
    unknown = replace(WALL, kind="deadband")
    loop = drawn(made_up(wall=unknown))["tables"]["loop"]
    assert loop["stiffness"] is None
    assert "curve" not in loop
    assert drawn(made_up())["tables"]["loop"]["stiffness"] is not None


def test_without_a_wall_there_is_none_to_draw_and_no_loop():
    tables = drawn(made_up(wall=None))["tables"]
    assert "loop" not in tables
    assert "wall" not in tables["force"]["values"]
    assert "wall" not in tables["energy"]["values"]
    assert np.isnan(tables["position"]["values"]["wall"]).all()


def test_without_an_inertia_there_is_no_momentum():
    assert "momentum" not in drawn(made_up(elements=[element("damping", damping=1.0)]))["tables"]


def test_the_momentum_of_an_inertia_counts_only_while_it_is_at_work():
    """m[k-1] v[k] against v[k-1], m[k] being 0 where its force is (Choi et al. 2022, eq. 8)."""
    history = made_up(elements=[element("damping", damping=1.0), element("unidirectional-inertia", mass=0.02)])
    momentum = drawn(history)["tables"]["momentum"]
    v = np.arange(100.0) / 10
    mass = np.where(np.arange(100) == 0, 0.0, 0.02)
    np.testing.assert_array_equal(momentum["values"]["v"], v[:-1].astype(np.float32))
    np.testing.assert_array_equal(momentum["values"]["p.1"], (mass[:-1] * v[1:]).astype(np.float32))
    assert momentum["columns"][1]["label"] == "element 1: unidirectional-inertia"


def test_a_book_that_is_closed_is_shown_only_while_its_energy_changes():
    row = np.arange(100.0)
    books = {"damping.true": np.where(row < 10, row, 9.0), "damping-2.true": np.zeros(100), "brake.true": row * 0.0}
    history = made_up(elements=[element("damping", damping=1.0)], books=books)
    shown = [column["name"] for column in drawn(history, span_s=0.05)["tables"]["energy"]["columns"]]
    assert shown == ["wall", "damping-2", "residual"]
    shown = [column["name"] for column in drawn(history, span_s=1.0)["tables"]["energy"]["columns"]]
    assert shown == ["wall", "damping", "damping-2", "residual"]
    labels = [column["label"] for column in drawn(history, span_s=1.0)["tables"]["energy"]["columns"]]
    assert labels == ["wall", "damping, from 0 s, closed", "element 0: damping", "residual"], (
        "as the chart of forces has it"
    )


def test_numbers_beyond_what_a_float32_holds_do_not_break_the_snapshot():
    history = History(TIME, 0)
    history.append_energy(0, {"wall.true": np.array([1e300, np.inf]), "residual": np.array([np.nan, 1e-320])})
    history.append_ticks(0, {name: np.zeros(2) for name in ("x", "v", "wall", "total")}, AtWork((), WALL))
    assert drawn(history)["tables"]["energy"]["values"]["wall"].tolist() == [math.inf, math.inf]


def test_bodies_beyond_the_device_are_shown_where_they_are():
    history, steps = History(TIME, 0), np.arange(101.0)
    names: list[str] = ["x", "v", "force", "cable.stretch", "cable.rate"]
    columns = dict.fromkeys(names, steps)
    history.append_plant_block(0, columns)
    np.testing.assert_array_equal(drawn(history)["tables"]["position"]["values"]["tip_x"], 2 * steps[:-1])


def test_a_swap_and_a_set_change_what_is_at_work_from_their_tick_on_and_a_refused_one_does_not():
    wall = {"position": 0.1, "stiffness": 5.0, "occupies": "above"}
    scene = typed(wall=wall, dissipation=[{"kind": "damping", "damping": 1.0, "acts": "always"}])
    swap = {"swap": {"kind": "bad", "mass": 1.0}, "element": 0}
    events = [
        (3, {"set": {"wall.stiffness": 7.0, "dissipation.0.damping": 2.0}}),
        (4, swap),
        (4, refusal(Change.from_dict(4, swap).refuse(ValueError("no")))),
        (5, {"swap": {"kind": "inertia", "mass": 1.0}, "element": 1}),
        (6, {"pause": True}),
        (8, {"swap": {"kind": "none"}, "element": 0}),
    ]
    found = [
        (span.from_tick, AtWork(span.scene.dissipation, span.scene.wall)) for span in spans(scene, changes_of(events))
    ]
    assert [(tick, [one.name for one in now.elements], now.wall and now.wall.stiffness) for tick, now in found] == [
        (0, ["damping"], 5.0),
        (3, ["damping"], 7.0),
        (5, ["damping", "inertia"], 7.0),
        (8, ["inertia"], 7.0),
    ]
    assert found[1][1].elements[0] == ElementTable(name="damping", acts="always", parameters={"damping": 2.0})


def test_what_telemetry_says_is_at_work_is_what_its_scene_says():
    wall = {"position": 0.1, "stiffness": 5.0, "into_wall": 1.0}
    damping = {"book": 3, "kind": "damping", "parameters": {"damping": 2.0, "acts": "always"}, "from_tick": 7}
    scene = typed(
        wall={"position": 0.1, "stiffness": 5.0, "occupies": "above"},
        dissipation=[{"kind": "damping", **damping["parameters"]}],
    )
    found = AtWork.of_block({"elements": [damping], "wall": wall})
    assert found == AtWork(scene.dissipation, scene.wall)
    assert found.into_wall == 1.0
    assert AtWork.of_block({"elements": [], "wall": dict.fromkeys(wall, 0.0)}) == AtWork()


DAMPING = {"swap": {"kind": "damping", "damping": 0.8, "acts": "in-contact"}}
ALWAYS = {"swap": {"kind": "damping", "damping": 0.8, "acts": "always"}}


@pytest.mark.parametrize(
    ("event", "text"),
    [
        (DAMPING | {"element": 1}, "element 1 becomes damping (damping 0.8 N s/m)"),
        (ALWAYS, "element 0 becomes damping (damping 0.8 N s/m, always)"),
        ({"swap": {"kind": "none"}, "element": 2}, "element 2 is removed"),
        ({"set": {"wall.stiffness": 200.0}}, "set wall.stiffness = 200 N/m"),
        ({"pause": True}, "paused"),
        ({"resume": True}, "resumed"),
        ({"step": 1}, "1 tick on"),
        ({"step": 7}, "7 ticks on"),
        ({"stop": True, "by": "signal"}, "stopped"),
        ({"pace": 0.1}, "pace 0.1"),
        ({"pace": "free"}, "as fast as it goes"),
        ({"refused": "No."}, "No."),
    ],
)  # fmt: skip
def test_an_event_is_told_in_words_with_its_units(event, text):
    (line,) = event_lines([(1500, event)], 1000, {"damping.damping": "N s/m", "wall.stiffness": "N/m"})
    assert (line["tick"], line["t_s"], line["text"]) == (1500, 1.5, text)


def test_own_columns_of_elements_are_shown_in_their_units_while_their_elements_are_at_work():
    """Two elements with three columns of two units; of the second swapped away, nothing where it was not."""
    history, row = made_up(), np.arange(100.0)
    units = {"dissipation.0.alpha": "N s/m", "dissipation.0.W": "J", "dissipation.1.W": "J"}
    both = AtWork((element("observer"), element("other")), WALL)
    columns = dict.fromkeys(("x", "v", "wall", "total", "dissipation.0", "dissipation.1"), row)
    history.append_ticks(100, columns | {name: row + place for place, name in enumerate(units)}, both, units)
    gone = {name: np.full(100, np.nan) for name in units}
    history.append_ticks(200, columns | gone, AtWork((element("damping"),), WALL), units)
    assert not [name for name in drawn(history, span_s=0.5)["tables"] if name.startswith("own")], "another panel"
    tables = drawn(history, span_s=None, panel="own")["tables"]
    assert [[c["label"] for c in tables[name]["columns"]] for name in ("own.0", "own.1")] == [
        ["element 0: observer, alpha"],
        ["element 0: observer, W", "element 1: other, W"],
    ]
    assert [tables[name]["columns"][0]["unit"] for name in ("own.0", "own.1")] == ["N s/m", "J"]
    seen = tables["own.1"]["values"]["own.1.other.W"]
    assert np.isnan(seen[:100]).all()
    np.testing.assert_array_equal(seen[100:200], row + 2)
    assert np.isnan(seen[200:]).all()
    late = drawn(history, span_s=0.05, panel="own")["tables"]
    assert not [name for name in late if name.startswith("own")]


def test_an_envelope_has_the_newest_values_of_one_tick_beside_it_and_says_where_the_past_is_kept_coarsely():
    history = made_up(ticks=400, elements=[element("damping", damping=1.0)])
    shown = drawn(history, span_s=None, points=50)
    assert not shown["coarse"]
    force = shown["tables"]["force"]
    last = dict(zip([column["name"] for column in force["columns"]], force["last"], strict=True))
    assert (last["wall"], last["element.0.damping"], last["total"]) == (399.0, 798.0, 399.0)
    x, _, measured = shown["tables"]["position"]["last"]
    assert (x, measured) == (3990.0, 399.0), "position and measured position of the same instant"
    long = made_up(ticks=40_000)
    assert drawn(long, span_s=0.2, end_s=1.0)["coarse"]
    assert not drawn(long, span_s=0.2)["coarse"]
