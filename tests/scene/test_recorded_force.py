"""A force recorded in a file of its own: where it is, its units, and what cannot be used."""

import pytest
from typer.testing import CliRunner

from haploop.launch.scene.file import load
from haploop.protocol.scene.hand_force import Trace
from haploop.protocol.scene.scene import Hand
from haploop.tools.cli.app import app
from helpers.scenes.least import LEAST_TOML, file_mistakes


def test_a_recorded_force_is_read_in_whole_relative_to_the_file_that_names_it(files, tmp_path):
    (tmp_path / "devices").mkdir()
    (tmp_path / "devices/push.csv").write_text("time,force\n0.0,0.0\n\n0.5,-1.0\n")
    (tmp_path / "devices/base.toml").write_text(LEAST_TOML + '[hand.force]\nkind = "trace"\nfile = "push.csv"\n')
    scene = load(files(top='extends = "devices/base.toml"\n'))
    assert scene.hand == Hand(force=Trace(time=(0.0, 0.5), force=(0.0, -1.0)))


@pytest.mark.parametrize(
    ("csv", "sentence"),
    [
        ("t,f\n0,1\n0,2\n", "Line 3: The times must increase, but 0 s follows 0 s."),
        (
            "0,1\n1,x\n",
            "Line 2 of {path}: a number was expected in column 2, not 'x'.",
        ),
        ("0,1\n1\n", "Line 2: Time and force must be finite numbers."),
        (
            "t,f\n0,1\n1,2,3\n",
            "Line 3 of {path} has 3 cells, but 2 columns were expected. Decimal commas need semicolons, tabs or blanks "
            "between the cells.",
        ),
        (
            "0,1,2\n",
            "Which column of {path} is the time? Name it with time_column, by name or number. There are: 1, 2, 3.",
        ),
        (
            "t (s);a;b\n0;1;2\n",
            "Which column of {path} is the force? Name it with force_column, by name or number. There are: t, a, b.",
        ),
        ("t\n0\n", "Which column of {path} is the force? Name it with force_column, by name or number. There are: t."),
        ("", "{path} is empty: a line for every sample was expected."),
        ("0,nan\n", "Line 1: Time and force must be finite numbers."),
        ("t,f\n", "There must be at least one sample."),
        ("t,F\n0,1\n0.5,x\n", "Line 3 of {path}: a number was expected in column F, not 'x'."),
        (
            "t,F\n1764400000,1\n1764400001,2\n",
            "The times in column t of {path} begin at 1764400000 s, as those of a clock do: subtract the first from "
            "all of them, for a run begins at 0.",
        ),
        (None, "The recording {path} cannot be read: No such file or directory."),
    ],
)
def test_a_recording_that_cannot_be_used_says_which_line(files, tmp_path, csv, sentence):
    if csv is not None:
        (tmp_path / "push.csv").write_text(csv)
    path = files(top=LEAST_TOML + '[hand.force]\nkind = "trace"\nfile = "push.csv"\n')
    sentence = sentence.format(path=tmp_path / "push.csv")
    assert file_mistakes(path) == [f'top.toml:7: hand.force.file is "push.csv". {sentence}']


def test_a_trace_has_a_file_or_samples_but_not_both(files):
    path = files(top=LEAST_TOML + '[hand.force]\nkind = "trace"\nfile = "push.csv"\ntime = [0.0, 1.0]\n')
    [mistake] = file_mistakes(path)
    assert mistake.endswith("A trace has either a file or the lists time and force.")


@pytest.mark.parametrize(
    ("csv", "times", "forces"),
    [
        ("t (ms), F [mN]\n0,0\n500,-1500\n", (0.0, 0.5), (0.0, -1.5)),
        ("t_ms,F_mN\n0,0\n500,-1500\n", (0.0, 0.5), (0.0, -1.5)),
        ("time,force (N)\n0,0\n500,-1500\n", (0.0, 500.0), (0.0, -1500.0)),
    ],
)
def test_units_in_the_header_of_a_recorded_force_are_read(files, tmp_path, csv, times, forces):
    (tmp_path / "push.csv").write_text(csv)
    path = files(top=LEAST_TOML + '[hand.force]\nkind = "trace"\nfile = "push.csv"\n')
    assert load(path).hand == Hand(force=Trace(time=times, force=forces))
    wrong = csv.replace("F [mN]", "m (g)").replace("F_mN", "m (g)").replace("force (N)", "m (kg)")
    (tmp_path / "push.csv").write_text(wrong)
    [mistake] = file_mistakes(path)
    assert "is a mass; a force was expected" in mistake


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("Zeit (s);Kraft (N)\n0,0;0,5\n0,5;-1,25\n", ""),
        ("Zeit (ms)\tWeg (mm)\tKraft (N)\n0\t7\t0.5\n500\t8\t-1.25\n", ""),
        ("F,x,t\n0.5,7,0\n-1.25,8,0.5\n", ""),
        ("0 7 0.5\n0.5 8 -1.25\n", 'time_column = 1\nforce_column = "3"\n'),
        ("Recorded 2026\nt,F\n0,0.5\n0.5,-1.25\n", ""),
        ("Experiment,2024\nSubject,7\nt,F\n0,0.5\n0.5,-1.25\n", ""),
        ("0,0.5,go\n0.5,-1.25,on\n", "time_column = 1\nforce_column = 2\n"),
        ("t,F,held (N)\n0,7,0.5\n0.5,8,-1.25\n", 'force_column = "held"\n'),
    ],
)
def test_a_recorded_force_is_found_among_other_columns_however_they_are_separated(files, tmp_path, text, keys):
    (tmp_path / "push.csv").write_text(text)
    path = files(top=LEAST_TOML + f'[hand.force]\nkind = "trace"\nfile = "push.csv"\n{keys}')
    assert load(path).hand == Hand(force=Trace(time=(0.0, 0.5), force=(0.5, -1.25)))


@pytest.mark.parametrize(
    ("head", "force"), [("t_ms,F_foo", "column F_foo in N (it names no unit)"), ("t_ms,F (mN)", "column F in mN")]
)
def test_check_tells_in_which_columns_and_units_a_recorded_force_is_read(files, tmp_path, head, force):
    (tmp_path / "push.csv").write_text(f"{head}\n0,1\n500,2\n")
    path = files(top=LEAST_TOML + '[hand.force]\nkind = "trace"\nfile = "push.csv"\n')
    told = CliRunner().invoke(app, ["check", str(path)]).stderr
    assert f"is read from {tmp_path / 'push.csv'}: times from column t_ms in ms, forces from {force}.\n" in told
    assert "is read from" not in CliRunner().invoke(app, ["check", "fig6c"]).stderr


def test_a_column_of_a_recorded_force_is_a_name_or_a_number(files, tmp_path):
    (tmp_path / "push.csv").write_text("t,F\n0,1\n")
    top = LEAST_TOML + '[hand.force]\nkind = "trace"\nfile = "push.csv"\n'
    [mistake] = file_mistakes(files(top=top + "force_column = true\n"))
    assert mistake.endswith("hand.force.force_column is true. It must be the name of a column, or its number from 1.")
    [mistake] = file_mistakes(files(top=top + 'force_column = "G"\n'))
    assert "There is no column 'G' in" in mistake
