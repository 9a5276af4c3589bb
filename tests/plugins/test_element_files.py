"""The file of an element in what is said of it: its name and line as its user wrote them; its prints, heard once."""

from pathlib import Path

import pytest

from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element, ElementError
from haploop.controller.dissipation.element import Motion, raised
from haploop.controller.dissipation.registry import load_source
from haploop.launch.runs.start import prepare, run
from haploop.launch.scene.check import resolve
from haploop.launch.scene.reading.layers import Layers
from haploop.protocol.plugin_file import PluginError
from haploop.protocol.ticks import Timebase
from haploop.tools.cli import recorded
from haploop.tools.executor.work import Work
from helpers.scenes.least import LEAST

FIG6C = Path(__file__).parents[2] / "launch" / "scenes" / "fig6c.toml"


def test_an_error_in_the_kept_copy_of_a_plugin_names_the_file_as_its_user_wrote_it():
    source = (
        "from haploop.controller.dissipation import Element\n\n\nclass Brake(Element):\n"
        '    kind = "brake"\n\n    def force(self, motion):\n        raise ValueError("enough")\n'
    )
    brake = load_source(source, "/runs/one/plugins/brake-0123456789ab.py")["brake"]
    assert raised(ValueError("enough"), brake) == "ValueError: enough (brake.py, line 7)"


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("velocity", "It holds x, v, a, a_before, contact, inward and period_s, and what the element's class asks for"),
        ("total_energy", 'An element gets only what its class asks for: asks = ("total_energy",)'),
    ],
)
def test_a_wrong_name_of_the_motion_is_answered_with_what_it_holds(name, hint):
    with pytest.raises(AttributeError) as wrong:
        getattr(Motion(0.001, 1.0), name)
    told = raised(wrong.value)
    assert told.startswith(f"AttributeError: 'Motion' object has no attribute '{name}'")
    assert told.endswith(f"). {hint}")


FORGETS = """
from haploop.controller.dissipation import Element

class Forgets(Element):
    kind = "forgets"
    memory = 0.0
    asks = {asks}

    def force(self, motion, memory):
        print("heard")
        return {answer}
"""


@pytest.mark.parametrize("asks", ["()", "('way',)"])
@pytest.mark.parametrize("answer", ["-motion.v", "None", "(1.0, 2.0, 3.0)"])
def test_an_element_that_forgets_its_memory_is_told_what_force_must_return(asks, answer, tmp_path):
    says = r"force must return the force and the memory, as in: return f, memory \(forgets\.py, line 9\)"
    text = FORGETS.format(asks=asks, answer=answer)
    kind = load_source(text, "/runs/one/plugins/forgets-0123456789ab.py")["forgets"]
    of = resolve(Layers(Path("scene.toml"), LEAST | {"dissipation": [{"kind": "forgets"}]}), {"forgets": kind})
    controller = Controller(of, Timebase.from_scene(of), {"forgets": kind})
    with pytest.raises(ElementError, match=says):
        controller.answer([(-0.001,)])
    if (asks, answer) == ("()", "-motion.v"):  # as it is tried before a run
        (tmp_path / "forgets.py").write_text(text)
        with pytest.raises(ElementError, match=says):
            prepare(FIG6C, ['dissipation=[{kind="forgets"}]'], [tmp_path / "forgets.py"], tmp_path / "run")


def test_what_an_element_prints_is_not_heard_again_where_its_run_is_judged_or_repeated(tmp_path, capfd):
    (tmp_path / "loud.py").write_text(FORGETS.format(asks="()", answer="0.0, memory").replace("forgets", "loud"))
    sets = ["duration=0.02", "run.verdict=window", "wall.position=-1", 'dissipation=[{kind="loud"}]']
    run(prepare(FIG6C, sets, [tmp_path / "loud.py"], tmp_path / "run"), in_process=True)
    assert "heard" in capfd.readouterr().err
    recorded.judge(tmp_path / "run")
    recorded.replay(tmp_path / "run")
    said = capfd.readouterr()
    assert "contact" in said.out
    text = (tmp_path / "loud.py").read_text()
    of = resolve(
        Layers(Path("scene.toml"), LEAST | {"duration": 0.02, "dissipation": [{"kind": "loud"}]}),
        {"loud": load_source(text, "loud.py")["loud"]},
    )
    Work(lambda _: of, sources=(("loud.py", text),)).run([0])
    assert "heard" not in said.out + said.err + capfd.readouterr().err


def test_an_element_without_a_docstring_is_not_described_by_its_signature():
    silent = type("Silent", (Element,), {"kind": "silent", "force": lambda self, motion: 0.0})
    assert silent.__doc__ is None


@pytest.mark.parametrize("kind", ["damping-2", "a.b", "", "two words", "wall", "none", "earlier", "a\nb"])
def test_a_kind_by_which_books_could_not_be_told_apart_is_refused(kind):
    """Books of a second damping are called damping-2, and an account's sides are told after a dot."""
    source = f"from haploop.controller.dissipation import Element\n\nclass One(Element):\n    kind = {kind!r}\n\n"
    with pytest.raises(PluginError, match=r"kind of One in one\.py is .* its books are named by it"):
        load_source(source + "    def force(self, motion):\n        return 0.0\n", "one.py")


@pytest.mark.parametrize("kind", ["damping-2b", "x2", "my_own-element", "dämpfer"])
def test_a_kind_of_letters_digits_and_dashes_is_taken(kind):
    source = f"from haploop.controller.dissipation import Element\n\nclass One(Element):\n    kind = {kind!r}\n\n"
    assert load_source(source + "    def force(self, motion):\n        return 0.0\n", "one.py").keys() == {kind}
