"""Damaged files of a run: right numbers, or a sentence; ``damaged_run`` tries any number of seeds."""

from __future__ import annotations

import pytest

from helpers.data.damaged_run import COMMANDS, DamagedRuns

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
