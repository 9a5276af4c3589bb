"""The bits of shipped scenes under other kernels, vector units and C libraries, and that a difference would be seen."""

import re
import sys
from pathlib import Path

import pytest
from everywhere import command
from everywhere.variants import Variant, lowest_direct, of_the_machine, python_of

SCENES = ("all_effects", "fig6c")
OTHERS = ("OpenBLAS Prescott", "NumPy without vector units", "C library without FMA")
HERE = Path(sys.executable)


@pytest.mark.slow
def test_trajectories_keep_every_bit_whatever_kernels_vector_units_and_c_library_there_are():
    expected = command.bits_of(Variant("default"), HERE, SCENES)
    assert len(expected) == 2 * len(SCENES)
    for variant in (each for each in of_the_machine() if each.name in OTHERS):
        assert command.bits_of(variant, HERE, SCENES) == expected, variant.name


@pytest.mark.slow
def test_what_depends_on_linear_algebra_passes_with_the_oldest_kernels():
    oldest = next(each for each in of_the_machine() if each.name == OTHERS[0])
    passed, words = command.tested(oldest, HERE, ["tests/estimators/test_kalman.py"])
    assert passed, words


@pytest.mark.slow
def test_a_test_that_fails_in_a_variant_is_named(tmp_path):
    (tmp_path / "test_it.py").write_text(
        "import os\ndef test_the_kernel_is_not_named(): assert 'OPENBLAS_CORETYPE' not in os.environ\n"
    )
    variants = {each.name: each for each in of_the_machine()}
    assert command.tested(variants["default"], HERE, [str(tmp_path)]) == (True, "1 passed")
    passed, words = command.tested(variants["OpenBLAS Zen"], HERE, [str(tmp_path)])
    assert not passed
    assert "test_the_kernel_is_not_named" in words


def test_other_bits_fail_the_command(monkeypatch, capsys, tmp_path):
    digests = {"default": {"a": "1", "b": "2"}, "OpenBLAS Haswell": {"a": "1", "b": "3"}}
    monkeypatch.setattr(command, "ROOT", tmp_path)
    monkeypatch.setattr(command, "bits_of", lambda variant, *_: digests[variant.name])
    for only, status, words in (("default", 0, "2 of 2"), ("Haswell", 1, "1 of 2")):
        monkeypatch.setattr(sys, "argv", ["everywhere", "--no-tests", "--only", only])
        assert command.main() == status
        assert words in capsys.readouterr().out


def test_a_python_that_is_not_there_is_told_and_not_guessed(tmp_path):
    assert python_of(Variant("default"), tmp_path) == HERE
    assert python_of(Variant("CPython 2.99", python="2.99"), tmp_path) == "there is no python2.99"


def test_kernels_that_the_processor_cannot_run_are_told_and_fail_nothing(monkeypatch, capsys, tmp_path):
    lacking = Variant("OpenBLAS SkylakeX", {"OPENBLAS_CORETYPE": "SkylakeX"}, lacks="AVX512_SKX")
    monkeypatch.setattr(command, "ROOT", tmp_path)
    monkeypatch.setattr(command, "bits_of", lambda *_: {"a": "1"})
    monkeypatch.setattr(command, "of_the_machine", lambda: [lacking])
    monkeypatch.setattr(command, "of_installations", list)
    monkeypatch.setattr(sys, "argv", ["everywhere", "--no-tests"])
    assert command.main() == 0
    assert "this processor has no AVX512_SKX" in capsys.readouterr().out


def test_the_lowest_of_every_direct_dependency_is_what_the_project_allows_in_its_extras_too():
    pins = lowest_direct()
    assert {"numpy==2.1.3", "numba==0.61", "fmpy==0.3.24"} <= {*pins}
    assert all(re.fullmatch(r"[\w-]+==[\d.]+", pin) for pin in pins)


def test_an_installation_that_cannot_be_made_fails_the_command(monkeypatch, capsys, tmp_path):
    def refuses(*_):
        raise RuntimeError("it cannot be installed: no version of numpy is both")

    monkeypatch.setattr(command, "ROOT", tmp_path)
    monkeypatch.setattr(command, "bits_of", lambda *_: {"a": "1"})
    monkeypatch.setattr(command, "python_of", refuses)
    monkeypatch.setattr(sys, "argv", ["everywhere", "--only", "lowest"])
    assert command.main() == 1
    assert "failed: it" in capsys.readouterr().out
