"""A force recorded in a file of its own: where it is, its units, and what cannot be used."""

import pytest

from haploop.launch.scene.file import load
from haploop.protocol.scene.hand_force import Trace
from haploop.protocol.scene.scene import Hand
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
        ("0,1\n1,x\n", "Line 2 must be a time in s and a force in N, but is '1,x'."),
        ("0,1\n1\n", "Line 2 must be a time in s and a force in N, but is '1'."),
        ("0,1,2\n", "Line 1 must be a time in s and a force in N, but is '0,1,2'."),
        ("0,nan\n", "Line 1: Time and force must be finite numbers."),
        ("t,f\n", "There must be at least one sample."),
        (None, "The recording cannot be read: No such file or directory."),
    ],
)
def test_a_recording_that_cannot_be_used_says_which_line(files, tmp_path, csv, sentence):
    if csv is not None:
        (tmp_path / "push.csv").write_text(csv)
    path = files(top=LEAST_TOML + '[hand.force]\nkind = "trace"\nfile = "push.csv"\n')
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
    assert "Line 1, the header of time and force:" in mistake
    assert "is a mass; a force was expected" in mistake
