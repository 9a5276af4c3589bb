"""haploop.logger.stream: a log piece by piece, of any length in the same memory, and what read makes of the pieces."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from haploop.logger import read, stream
from haploop.logger.log import LogError
from haploop.logger.log.recording import Table, merge_columns
from haploop.logger.log.stream import LogStream, survey
from haploop.logger.log.writer import Log
from helpers.data.logs import AFTER, BEFORE, PLANT, SCENE, cut, same_bits, swapped_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return swapped_run(tmp_path_factory.mktemp("run") / "out")


def gathered(batches: Any, topic: str, name: str) -> np.ndarray:
    """A column of all batches of a topic, NaN where a batch has none of the name."""
    found = [
        batch.rows[name] if name in batch.rows else np.full(len(batch.log_times_ns), np.nan)
        for batch in batches
        if batch.topic == topic
    ]
    return np.concatenate(found)


@settings(max_examples=30)
@given(ticks=st.integers(1, 80), flush_ticks=st.integers(1, 30), share=st.floats(0.2, 1))
def test_the_batches_of_a_log_cut_anywhere_are_together_what_read_gives(
    tmp_path_factory: pytest.TempPathFactory, ticks: int, flush_ticks: int, share: float
) -> None:
    run = swapped_run(tmp_path_factory.mktemp("run") / "out", ticks, flush_ticks=flush_ticks)
    cut(run, share)
    log, whole = stream(run), read(run)
    batches = list(log)
    assert log.cut == whole.cut
    assert log.attachments == whole.attachments
    assert list(log.units) == list(whole)
    for topic, units in log.units.items():
        if units:
            assert list(whole[topic]) == list(units)
            assert whole[topic].units == units
            for name in units:
                together = gathered(batches, topic, name) if any(b.topic == topic for b in batches) else np.empty(0)
                assert same_bits(together, whole[topic][name]), (topic, name)
        else:
            assert [one for batch in batches if batch.topic == topic for one in batch.rows] == whole[topic]


def test_a_batch_unpacks_into_topic_times_and_rows(run: Path) -> None:
    for topic, log_times_ns, rows in stream(run, topics="/controller"):
        assert topic == "/controller"
        assert isinstance(rows, Table)
        assert same_bits(log_times_ns / 1e9, rows["timestamp"])
        assert rows.units in (BEFORE, AFTER)


def test_a_log_that_is_read_on_while_it_is_written_gives_every_row_once(tmp_path: Path) -> None:
    with Log(tmp_path / "log.mcap") as log:
        channel = log.channel("/energy", {"timestamp": "s", "moved": "J"}, title="Energy")
        log.flush()
        reading = stream(tmp_path)
        assert list(reading) == []
        seen: list[float] = []
        for first in range(0, 50, 10):
            ticks = np.arange(first, first + 10)
            log.write(channel, ticks, np.column_stack((ticks, ticks * 2)).astype(np.float64))
            assert list(reading) == []
            log.flush()
            seen += gathered(list(reading), "/energy", "timestamp").tolist()
            assert "was cut off or is still being written" in reading.cut
    assert seen == list(range(50))
    assert list(reading) == []
    assert reading.cut == ""


def test_what_comes_after_the_bytes_asked_for_is_left_alone(run: Path, tmp_path: Path) -> None:
    part = swapped_run(tmp_path / "part")
    cut(part, 0.6)
    end = survey(part).read_bytes
    (part / "log.mcap").write_bytes((run / "log.mcap").read_bytes())

    bounded = list(LogStream(part, until=end))
    everything = list(stream(run))
    assert 0 < len(bounded) < len(everything)
    assert all(same_bits(a.log_times_ns / 1.0, b.log_times_ns / 1.0) for a, b in zip(bounded, everything, strict=False))


def test_the_survey_knows_every_column_and_attachment(run: Path) -> None:
    found = survey(run)
    assert found.units == {"/events": {}, "/plant": PLANT, "/controller": AFTER}
    assert list(found.units["/controller"]) == list(AFTER)
    assert found.attachments == {"scene.toml": SCENE}
    assert found.cut == ""


def test_only_the_topics_and_columns_asked_for_are_read(run: Path) -> None:
    whole = read(run)
    some = read(run, topics=["/plant", "/controller"], columns=["x", "dissipation.1"])
    assert {topic: list(table) for topic, table in some.items()} == {
        "/plant": ["x"],
        "/controller": ["x", "dissipation.1"],
    }
    assert some["/controller"].units == {"x": "m", "dissipation.1": "N"}
    for topic, table in some.items():
        for name, column in table.items():
            assert same_bits(column, whole[topic][name])
    only = read(run, columns=["dissipation.1"])
    assert list(only) == ["/events", "/controller"]
    assert np.isnan(only["/controller"]["dissipation.1"]).tolist() == [True] * 150 + [False] * 150
    with pytest.raises(KeyError, match="There is no channel /plant in this log; its channels are /events, /controller"):
        only["/plant"]


def test_a_topic_with_and_without_columns_is_refused(tmp_path: Path) -> None:
    with Log(tmp_path / "log.mcap") as log:
        log.channel("/mixed", {"x": "m"}, title="One")
        log.channel("/mixed", {}, title="Other")
    with pytest.raises(LogError, match="/mixed mixes messages with and without columns"):
        list(stream(tmp_path))


@pytest.mark.slow
@given(
    st.permutations(list("abcdef")), st.sets(st.sampled_from(list("abcdef"))), st.sets(st.sampled_from(list("abcdef")))
)
def test_columns_that_come_and_go_keep_the_one_order_they_are_all_in(
    order: list[str], one: set[str], other: set[str]
) -> None:
    """Where both lists follow a common order, no column of the merged list stands before one it follows in its own."""
    first, second = ([name for name in order if name in chosen] for chosen in (one, other))
    merged = list(merge_columns(dict.fromkeys(first, ""), dict.fromkeys(second, "")))
    assert sorted(merged) == sorted(one | other)
    assert [name for name in merged if name in one] == first
    assert [name for name in merged if name in other] == second


def peak_bytes(work: Any) -> int:
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_a_log_four_times_as_long_takes_no_more_memory(tmp_path: Path) -> None:
    """The longer one's columns alone are 14 MB."""
    short, long = (swapped_run(tmp_path / str(n), n, hard=False, flush_ticks=1000) for n in (8_000, 32_000))

    def go_through(path: Path) -> None:
        rows = sum(len(log_times_ns) for topic, log_times_ns, _ in stream(path) if topic == "/plant")
        assert rows == 10 * int(path.name) + 1

    go_through(short)  # what is imported and cached on the way is not counted
    assert peak_bytes(lambda: go_through(long)) < peak_bytes(lambda: go_through(short)) + 300_000
    whole, one = (peak_bytes(lambda columns=columns: read(long, columns=columns)) for columns in (None, ["x"]))
    assert whole < 1.9 * 320_001 * 8 * len(PLANT)
    assert one < 0.5 * whole


def test_a_table_gives_quantities_and_a_data_frame_with_units(run: Path) -> None:
    pytest.importorskip("pandas")
    table = read(run)["/plant"]
    assert same_bits(table.quantity("v").to("mm/s").magnitude, table["v"] * 1e3)
    assert table.quantity("force").units == "newton"
    frame = table.frame()
    assert frame.index.name == "time (s)", "the label of the axis of a plot"
    assert same_bits(frame.index.to_numpy(), table["timestamp"])
    assert list(frame.columns) == ["t", "x", "v", "force"]
    assert all(same_bits(frame[name].to_numpy(), table[name]) for name in frame.columns)
    assert frame.attrs["units"] == PLANT


def test_without_pandas_a_sentence_says_how_to_get_it(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match=r"Data frames need pandas; install it with: pip install 'haploop\[pandas\]'"):
        read(run)["/plant"].frame()
