"""Damaged files of a run, spoilt command lines: right numbers or a sentence; the helpers try any number of seeds."""

from __future__ import annotations

from pathlib import Path

import pytest

from helpers.data.damaged_run import COMMANDS, DamagedRuns
from helpers.data.mutated_words import MutatedWords
from helpers.live.in_process import ask

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
    assert not attempts(runs, range(100, 150), tuple(COMMANDS))


def broken_lines(folder: Path, seeds: range) -> list[str]:
    words = MutatedWords(folder)
    tried = ((seed, *words.attempt(seed)) for seed in seeds)
    return [f"seed {seed}, {line}: {fault}" for seed, line, answer in tried if (fault := answer.broken())]


def test_a_spoilt_command_line_is_answered_or_refused_with_a_sentence(tmp_path):
    assert not broken_lines(tmp_path, range(8))


@pytest.mark.parametrize("command", ["check", "run", "replay", "plot", "export", "sweep", "advise", "status", "swap"])
@pytest.mark.parametrize("word", ["caf\udce9", "a\0b"])
def test_an_argument_that_is_no_text_is_refused_by_every_command(command, word):
    answer = ask(command, word)
    assert (answer.status, answer.broken()) == (2, "")
    assert answer.stderr.startswith("Every argument, file names included, must be UTF-8 text")


def test_what_the_operating_system_refuses_is_a_sentence_where_a_command_has_none():
    answer = ask("plot", "a" * 5000)
    assert (answer.status, answer.broken()) == (1, "")
    assert answer.stderr.endswith("cannot be used: File name too long.\n")


@pytest.mark.slow
def test_hundreds_of_spoilt_command_lines_are_answered_or_refused_with_a_sentence(tmp_path):
    assert not broken_lines(tmp_path, range(1000, 1150))
