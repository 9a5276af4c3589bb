"""Elements of somebody's own: their parameters, what they show in the log, and what becomes of one that raises."""

import json
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import matplotlib.text
import numpy as np
import pytest

from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element, ElementError, Motion, PluginError, Quantity, registry
from haploop.controller.dissipation.registry import checked, load_source
from haploop.launch.clock.plugin_trial import PluginTrial
from haploop.launch.runs.in_batch import run_batch
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.runs.replay import replay
from haploop.launch.runs.start import prepare, run
from haploop.launch.scene.check import resolve
from haploop.launch.scene.mistakes import SceneError
from haploop.launch.scene.reading.layers import Layers
from haploop.launch.scene.schema import json_schema
from haploop.launch.scene.toml_writer import to_toml
from haploop.logger import read
from haploop.protocol.changes import at_work, changes_of
from haploop.protocol.ticks import Timebase
from haploop.tools.figure.data import RunData
from haploop.tools.figure.run_figure import make_figure
from helpers.scenes.least import HELD, LEAST

FIG6C = Path(__file__).parents[2] / "launch" / "scenes" / "fig6c.toml"
DAMPING = {"kind": "damping", "damping": 0.3}


class Kept(NamedTuple):
    speed: float = 0.0
    ticks: float = 0.0


class Brake(Element):
    """f = -b v, doubled where it is hard, nothing where it is off; shows the speed and the ticks so far."""

    kind = "brake"
    memory = Kept()
    columns = {"speed": "m/s", "ticks": ""}  # noqa: RUF012
    damping: Annotated[float, Quantity("N s/m", at_least=0)]
    mode: Literal["soft", "hard"] = "soft"
    on: bool = True
    times: Annotated[int, Quantity("", at_least=1)] = 1

    def force(self, motion: Motion, memory):
        share = self.on * self.times * (2.0 if self.mode == "hard" else 1.0)
        return -share * self.damping * motion.v, Kept(motion.v, memory.ticks + 1.0)


class Raises(Element):
    """Raises from its ``after``-th tick on."""

    kind = "raises"
    after: Annotated[int, Quantity("", at_least=0)]
    memory = 0.0

    def force(self, motion: Motion, memory):
        if memory >= self.after:
            raise ValueError("enough")
        return -0.1 * motion.v, memory + 1.0


class Text(Element):
    """Gives text for a force in contact."""

    kind = "text"

    def force(self, motion: Motion) -> Any:
        return "1.0"


KINDS = registry() | {kind.kind: kind for kind in (Brake, Raises, Text)}


def resolved(tables: dict[str, Any]):
    window = {"run": {"verdict": "window", **tables.get("run", {})}}
    return resolve(Layers(Path("scene.toml"), {**LEAST, **tables, **window}), KINDS)


def own(dissipation: list[dict[str, Any]], events: tuple[dict[str, Any], ...] = (), **tables: Any):
    """A press on a wall for 0.4 s, or longer."""
    pressed = {
        "duration": 0.4,
        **HELD,
        "dissipation": dissipation,
        "event": list(events),
    }
    return resolved(pressed | tables)


def swapped(after: int, **run: str):
    """Damping, at 0.1 s swapped for an element that raises some ticks later."""
    event = {"at": 0.1, "swap": {"kind": "raises", "after": after, "acts": "always"}}
    return own([DAMPING], (event,), duration=1.5, run={"verdict": "window"} | run)


def test_a_parameter_may_be_a_choice_a_switch_or_a_whole_number_and_means_what_it_says():
    def force(**values: Any) -> float:
        motion = Motion(0.001, -1.0)
        motion.v = 0.5
        return Brake(damping=2.0, **values).force(motion, Kept())[0]

    assert [force(), force(mode="hard"), force(on=False), force(times=3)] == [-1.0, -2.0, -0.0, -3.0]
    [table] = own([{"kind": "brake", "damping": 1.0, "mode": "hard", "on": False, "times": 2.0}]).dissipation
    assert table.parameters == {"damping": 1.0, "mode": "hard", "on": False, "times": 2}


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"mode": "medium"}, 'dissipation.0.mode is "medium". It must be "soft" or "hard".'),
        ({"on": 1}, "dissipation.0.on is 1. It must be false or true."),
        ({"times": 1.5}, "dissipation.0.times is 1.5. It must be a whole number, at least 1."),
    ],
)
def test_a_value_that_is_none_of_the_choices_is_refused_with_them(given, says):
    table = {"kind": "brake", "damping": 1.0, **given}
    with pytest.raises(SceneError) as refused:
        own([table])
    assert [str(mistake) for mistake in refused.value.mistakes] == [f"scene.toml: {says}"]


def test_the_schema_lists_the_choices():
    [of] = [model for name, model in json_schema(KINDS)["$defs"].items() if name == "brake"]
    assert of["properties"]["mode"]["enum"] == ["soft", "hard"]
    assert of["properties"]["on"]["enum"] == [False, True]


@pytest.mark.parametrize("hint", [str, list[float], Literal[1, 2], Annotated[complex, Quantity("")]])
def test_a_parameter_of_another_type_is_refused(hint):
    kind = type("Odd", (Element,), {"kind": "odd", "__annotations__": {"one": hint}, "force": lambda *_: 0.0})
    with pytest.raises(PluginError, match="must be declared as"):
        checked(kind, "odd.py")


def test_a_plugin_tried_in_a_process_of_its_own_declares_the_same():
    source = (
        "from typing import Annotated, Literal\nfrom haploop.controller.dissipation import Element, Quantity\n"
        'class One(Element):\n    kind = "one"\n    mode: Literal["a", "b"] = "b"\n    on: bool = False\n'
        '    n: Annotated[int, Quantity("")] = 3\n    def force(self, motion): return 0.0\n'
    )
    with PluginTrial(source, "one.py") as trial:
        stand_in = trial.wait(trial.load())["one"]
    assert stand_in.parameters() == load_source(source, "one.py")["one"].parameters()


def test_what_an_element_shows_is_in_the_log_with_its_unit_and_replays(tmp_path):
    run_in_process(own([DAMPING, {"kind": "brake", "damping": 0.5}]), KINDS, out=tmp_path)
    log = read(tmp_path)["/controller"]
    assert log.units["dissipation.1.speed"] == "m/s"
    assert np.array_equal(log["dissipation.1.speed"], log["v"])
    assert np.array_equal(log["dissipation.1.ticks"], np.arange(1.0, 401.0))
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert [each["kind"] for each in summary["energy"]["elements"]] == ["damping", "brake"]


def test_the_figure_has_a_panel_for_each_unit_of_what_elements_show(tmp_path):
    of = own([{"kind": "brake", "damping": 0.5, "mode": "hard", "on": False}])
    run_in_process(of, KINDS, out=tmp_path)
    (tmp_path / "scene.toml").write_text(to_toml(of.as_dict()))
    panels = [ax for part in make_figure(RunData.from_directory(tmp_path)).subfigs for ax in part.axes]
    own_panels = [ax for ax in panels if "Own columns" in ax.get_title("left")]
    shown = {ax.get_ylabel(): ax.get_legend_handles_labels()[1] for ax in own_panels}
    assert shown == {"speed (mm/s)": ["brake"], "ticks": ["brake"]}
    assert [ax.get_title("left") for ax in own_panels] == ["Own columns: speed", "Own columns: ticks"]


def test_an_element_has_one_name_and_one_colour_in_all_panels_also_where_another_had_its_place(tmp_path):
    brake = {"kind": "brake", "damping": 0.5}
    event = [{"at": 0.1, "swap": brake, "element": 0}, {"at": 0.2, "swap": brake | {"damping": 0.7}, "element": 0}]
    of = own([DAMPING, {"kind": "unidirectional-inertia", "mass": 0.01}], event=event)
    run_in_process(of, KINDS, out=tmp_path)
    (tmp_path / "scene.toml").write_text(to_toml(of.as_dict()))
    panels = [ax for part in make_figure(RunData.from_directory(tmp_path)).subfigs for ax in part.axes]
    lines = {ax.get_title("left"): {each.get_label(): each.get_color() for each in ax.lines} for ax in panels}
    forces, speeds = lines["Force by part"], lines["Own columns: speed"]
    for name in ("brake", "brake-2"):
        assert speeds[name] == forces[name]
        assert lines["Energy out of the device (below 0: into it)"][name] == forces[name]
    [panel] = [ax for ax in panels if ax.get_title("left") == "Force by part"]
    legend = panel.get_legend()
    assert legend
    assert {"damping", "unidirectional-inertia", "brake", "brake-2"} <= {text.get_text() for text in legend.get_texts()}


@pytest.mark.slow
def test_no_legend_of_own_columns_reaches_over_its_title_however_many_elements_show_them(tmp_path):
    swaps = [{"at": 0.05 * n, "swap": {"kind": "brake", "damping": 0.1 * n}, "element": 0} for n in range(1, 7)]
    of = own([{"kind": "brake", "damping": 0.05}], event=swaps)
    run_in_process(of, KINDS, out=tmp_path)
    (tmp_path / "scene.toml").write_text(to_toml(of.as_dict()))
    figure = make_figure(RunData.from_directory(tmp_path))
    figure.draw_without_rendering()
    panels = [ax for part in figure.subfigs for ax in part.axes if "Own columns" in ax.get_title("left")]
    assert len(panels) == 2
    for ax in panels:
        legend, (title,) = (
            ax.get_legend(),
            [each for each in ax.findobj(matplotlib.text.Text) if "Own" in each.get_text()],
        )
        assert legend
        assert not legend.get_window_extent().overlaps(title.get_window_extent())


def test_what_it_shows_must_be_a_field_of_its_memory():
    kind = type("Odd", (Brake,), {"kind": "odd", "columns": {"alpha": "N"}})
    with pytest.raises(PluginError, match="shows 'alpha' in the log, which must be a field of its memory"):
        checked(kind, "odd.py")


def test_elements_that_show_something_and_choose_run_in_batches_to_the_same_bits():
    scenes = [own([{"kind": "brake", "damping": b, "mode": mode}]) for b in (0.1, 0.4) for mode in ("soft", "hard")]
    for summary, of in zip(run_batch(scenes, KINDS, trajectories=True), scenes, strict=True):
        assert summary["trajectory_sha256"] == run_in_process(of, KINDS)["trajectory_sha256"]


def test_a_new_element_that_raises_in_its_first_second_gives_way_to_the_last_one_and_all_say_so(tmp_path):
    of = swapped(after=250)
    summary = run_in_process(of, KINDS, out=tmp_path)
    assert summary["ended"] == "done"
    [why] = summary["not_made"]
    assert why.startswith(
        "Element 0 (raises) gave no force at tick 350: ValueError: enough (test_own_elements.py, line "
    )
    assert why.endswith("The swap is taken back: element 0 becomes damping (damping 0.3).")
    assert [(each["kind"], each["from_tick"]) for each in summary["energy"]["elements"]] == [
        ("damping", 0), ("raises", 100), ("damping", 350),
    ]  # fmt: skip
    events = [(event["tick"], event) for event in read(tmp_path)["/events"]]
    assert at_work(of, changes_of(events)).dissipation == of.dissipation
    assert run_batch([of, of], KINDS, trajectories=True)[1]["trajectory_sha256"] == summary["trajectory_sha256"]


def test_from_the_tick_at_which_it_is_taken_back_the_loop_is_as_with_a_swap_to_the_last_one_there():
    back = {"at": 0.35, "swap": DAMPING}
    first = {"at": 0.1, "swap": {"kind": "raises", "after": 9999, "acts": "always"}}
    by_hand = own([DAMPING], (first, back), duration=1.5, run={"verdict": "window"})
    digests = [run_in_process(each, KINDS)["trajectory_sha256"] for each in (swapped(after=250), by_hand)]
    assert digests[0] == digests[1]


def test_one_that_raises_later_or_where_the_scene_asks_for_the_end_ends_the_run():
    for of in (swapped(after=1001), swapped(after=250, faulty_swap="end"), own([{"kind": "raises", "after": 3}])):
        controller = Controller(of, Timebase.from_scene(of), KINDS)
        event = of.event[0].as_dict() if of.event else None
        if event:
            controller.schedule(100, event)
        with pytest.raises(ElementError, match="gave no force at tick"):
            controller.answer([(0.001,)] * 1400)


def test_an_element_that_fails_on_the_motion_at_hand_never_takes_the_place_of_the_last_one():
    summary = run_in_process(swapped(after=0), KINDS)
    assert "element 0 becomes raises (after 0, always), was refused: ValueError: enough" in summary["not_made"][0]
    assert [each["kind"] for each in summary["energy"]["elements"]] == ["damping"]


def test_text_is_no_force():
    of = own([{"kind": "text"}])
    controller = Controller(of, Timebase.from_scene(of), KINDS)
    with pytest.raises(ElementError, match=r"it returned '1\.0', and a force must be a number"):
        controller.answer([(-0.001,)])


def test_a_run_with_a_swap_taken_back_replays_to_the_bit(tmp_path):
    source = (
        "from haploop.controller.dissipation import Element\n"
        'class Late(Element):\n    """Raises after a while."""\n    kind = "late"\n    memory = 0.0\n'
        "    def force(self, motion, memory):\n        if memory > 50:\n            raise ValueError('enough')\n"
        "        return -motion.v, memory + 1\n"
    )
    (tmp_path / "late.py").write_text(source)
    sets = ["duration=0.4", "run.verdict=window", 'event=[{at=0.1,swap={kind="late",acts="always"}}]']
    run(prepare(FIG6C, sets, [tmp_path / "late.py"], tmp_path / "run"), in_process=True)
    repeated = replay(tmp_path / "run")
    assert not repeated.differences
    assert "not_made" in json.loads((tmp_path / "run" / "summary.json").read_text())
