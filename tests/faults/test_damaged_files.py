"""Damaged files of a run, spoilt command lines: right numbers or a sentence; the helpers try any number of seeds."""

from __future__ import annotations

from pathlib import Path

import pytest

from helpers.data.damaged_run import COMMANDS, DamagedRuns
from helpers.data.mutated_words import MutatedWords

QUICK = ("check", "replay", "csv", "npz", "json-mcap")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> DamagedRuns:
    return DamagedRuns(tmp_path_factory.mktemp("damaged"))


def attempts(runs: DamagedRuns, seeds: range, names: tuple[str, ...]) -> list[str]:
    tried = ((seed, *runs.attempt(seed, names)) for seed in seeds)
    return [f"seed {seed}, {what}: {fault}" for seed, what, fault in tried if fault]


def test_a_damaged_file_gives_right_numbers_or_a_sentence(runs):
    assert not attempts(runs, range(16), QUICK)


@pytest.mark.slow
def test_a_damaged_file_gives_right_numbers_or_a_sentence_whatever_reads_it(runs):
    assert not attempts(runs, range(100, 400), tuple(COMMANDS))


def broken_lines(folder: Path, seeds: range) -> list[str]:
    words = MutatedWords(folder)
    tried = ((seed, *words.attempt(seed)) for seed in seeds)
    return [f"seed {seed}, {line}: {fault}" for seed, line, answer in tried if (fault := answer.broken())]


def test_a_spoilt_command_line_is_answered_or_refused_with_a_sentence(tmp_path):
    assert not broken_lines(tmp_path, range(20))


@pytest.mark.slow
def test_a_thousand_spoilt_command_lines_are_answered_or_refused_with_a_sentence(tmp_path):
    assert not broken_lines(tmp_path, range(1000, 2000))
