"""A series keeps the newest rows in full and all since the start ever coarser: no peak is lost, memory is bounded."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.protocol.scene.scene import ElementTable, Wall
from haploop.protocol.ticks import Timebase
from haploop.view.store.history import AtWork, History
from haploop.view.store.lod_level import Ring, extremes
from haploop.view.store.lod_series import MOST_COLUMNS, LodSeries

VALUES = st.one_of(st.floats(-10, 10, width=32), st.just(float("nan")))


def least_and_greatest(values):
    """Per bucket, shape (buckets, 2): what the slow way finds."""
    found = []
    for bucket in values:
        known = bucket[~np.isnan(bucket)]
        found.append((known.min(), known.max()) if len(known) else (np.nan, np.nan))
    return np.array(found)


@given(st.lists(st.floats(-10, 10, width=32), min_size=12, max_size=12), st.integers(0, 11), st.booleans())
def test_extremes_are_in_the_order_in_which_they_came_where_values_turn_once_at_most(values, turn, is_hill):
    way = 1.0 if is_hill else -1.0
    values = way * np.array([*sorted(values[:turn]), *sorted(values[turn:], reverse=True)])
    pairs = extremes(values[None], 4)[0].reshape(3, 2)
    for bucket, (first, second) in zip(values.reshape(3, 4), pairs, strict=True):
        assert {first, second} == {bucket.min(), bucket.max()}
        assert np.flatnonzero(bucket == first)[0] <= np.flatnonzero(bucket == second)[-1]


@given(st.lists(VALUES, min_size=64, max_size=64))
def test_extremes_of_extremes_are_those_of_the_values_themselves(values):
    values = np.array([values])
    once, twice = extremes(values, 16), extremes(extremes(values, 4), 8)
    np.testing.assert_array_equal(np.sort(once.reshape(-1, 2)), np.sort(twice.reshape(-1, 2)))


@given(st.lists(st.integers(1, 10), max_size=30), st.integers(1, 3))
def test_a_ring_holds_at_least_the_newest_of_its_capacity(pieces, columns):
    ring, all_values = Ring(10, columns), np.empty((columns, 0))
    for count in pieces:
        piece = np.arange(columns * count, dtype=float).reshape(columns, count) + 1000 * all_values.shape[1]
        ring.append(piece)
        all_values = np.concatenate([all_values, piece], axis=1)
        assert ring.end == all_values.shape[1]
        assert ring.start <= max(0, ring.end - 10)
        np.testing.assert_array_equal(ring.between(ring.start, ring.end), all_values[:, ring.start :])


def fed(rows_per_tick, ticks, recent_ticks=512, seed=1, pieces=(37, 1, 400, 5)):
    """A series with random rows, and the rows."""
    random = np.random.default_rng(seed)
    rows = random.normal(size=ticks * rows_per_tick)
    rows[random.random(len(rows)) < 0.1] = np.nan
    series, at, number = LodSeries(rows_per_tick, recent_ticks, 0), 0, 0
    while at < ticks:
        end = min(ticks, at + pieces[number % len(pieces)])
        series.append(at, {"x": rows[at * rows_per_tick : end * rows_per_tick]})
        at, number = end, number + 1
    return series, rows


@pytest.mark.parametrize("rows_per_tick", [1, 10])
@pytest.mark.parametrize("bucket", [1, 2, 8, 64, 1024])
@pytest.mark.parametrize("ticks", [300, 4001])
def test_an_envelope_keeps_every_least_and_every_greatest_value(rows_per_tick, bucket, ticks):
    """Level by level and in the unfinished last bucket too."""
    series, rows = fed(rows_per_tick, ticks)
    for from_tick in (0, ticks // 3, ticks - 200):
        wide = series.bucket_from(from_tick, bucket)
        first = series.aligned(from_tick, wide)
        end = ticks + (first - ticks) % wide
        pairs = series.envelope(["x"], first, end, wide)[0].reshape(-1, 2)
        padded = np.full((end - first) * rows_per_tick, np.nan)
        padded[: len(rows) - first * rows_per_tick] = rows[first * rows_per_tick :]
        np.testing.assert_array_equal(np.sort(pairs), least_and_greatest(padded.reshape(len(pairs), -1)))


@pytest.mark.parametrize("rows_per_tick", [1, 10])
def test_envelopes_of_a_window_that_moves_are_those_of_one_that_is_looked_at_once(rows_per_tick):
    """What is kept of the last one serves where it reaches: windows go on, back, further back, and columns come."""
    ticks, ends = 9000, (6000, 6100, 6101, 8000, 5000, 9000, 2000)
    rows = np.random.default_rng(4).normal(size=ticks * rows_per_tick)
    series, known = LodSeries(rows_per_tick, 4096, 0), 0
    for end in ends:
        if end > known:
            new = {"x": rows[known * rows_per_tick : end * rows_per_tick]}
            series.append(known, new | ({"y": new["x"]} if end > 8000 else {}))
            known = end
        for bucket in (16, 64):
            first, last = series.aligned(max(0, end - 3000), bucket), end + -end % bucket
            found = series.envelope(["x", "y"], first, last, bucket)
            padded = np.full((last - first) * rows_per_tick, np.nan)
            held = rows[first * rows_per_tick : min(last, known) * rows_per_tick]
            padded[: len(held)] = held
            expected = least_and_greatest(padded.reshape(-1, bucket * rows_per_tick))
            np.testing.assert_array_equal(np.sort(found[0].reshape(-1, 2)), expected)
            of_y = found[1].reshape(-1, 2)[max(0, 8000 - first) // bucket :]
            np.testing.assert_array_equal(
                np.sort(of_y), expected[len(expected) - len(of_y) :] if known > 8000 else of_y
            )


def test_an_envelope_that_ends_in_the_past_knows_nothing_of_what_came_later():
    series, rows = fed(1, 5000)
    pairs = series.envelope(["x"], 1024, 2048, 64)[0].reshape(-1, 2)
    np.testing.assert_array_equal(np.sort(pairs), least_and_greatest(rows[1024:2048].reshape(-1, 64)))


def test_the_newest_rows_are_held_as_they_came_and_what_is_not_there_is_nan():
    series, rows = fed(10, 3000)
    found = series.rows(["x", "y"], 2600, 3100)
    np.testing.assert_array_equal(found[0, :4000], rows[26_000:])
    assert np.isnan(found[0, 4000:]).all()
    assert np.isnan(found[1]).all()


def test_a_gap_stays_unknown_and_what_is_known_is_passed_over():
    series = LodSeries(1, 512, 0)
    series.append(0, {"x": np.arange(100.0)})
    series.append(50, {"x": np.full(60, -1.0)})
    series.append(1500, {"x": np.full(10, 2.0)})
    rows = series.rows(["x"], 1000, 1510)[0]
    assert np.isnan(rows[:500]).all()
    assert (rows[500:] == 2.0).all()
    pairs = series.envelope(["x"], 0, 1536, 16)[0].reshape(-1, 2)
    np.testing.assert_array_equal(np.sort(pairs[6]), [-1.0, 99.0])
    assert np.isnan(pairs[7:93]).all()


@pytest.mark.parametrize("rows_per_tick", [1, 5, 10])
def test_what_another_series_holds_as_ranges_only_is_taken_as_such(rows_per_tick):
    """A log that is read more slowly than the run goes: what was received meanwhile is not held in full any more."""
    begun, ticks = 18_944, 60_000
    series, rows = fed(rows_per_tick, 20_000)
    full = np.random.default_rng(1).normal(size=ticks * rows_per_tick)
    full[: len(rows)] = rows
    live = LodSeries(rows_per_tick, 512, begun)
    for tick in range(begun, ticks, 100):
        end = min(ticks, tick + 100)
        live.append(tick, {"x": full[tick * rows_per_tick : end * rows_per_tick]})
    series.extend_from(live)
    assert series.end_tick == ticks
    full_from = series.full_from_tick
    assert live.full_from_tick <= full_from < live.full_from_tick + 64
    pairs = series.envelope(["x"], 0, 59_904, 512)[0].reshape(-1, 2)
    np.testing.assert_array_equal(
        np.sort(pairs), least_and_greatest(full[: 59_904 * rows_per_tick].reshape(len(pairs), -1))
    )
    newest = series.rows(["x"], full_from, ticks)[0]
    np.testing.assert_array_equal(newest, full[full_from * rows_per_tick :])


def test_a_column_that_comes_in_mid_run_is_unknown_before_and_kept_from_there_on():
    series = LodSeries(1, 512, 0)
    series.append(0, {"x": np.zeros(5000)})
    series.append(5000, {"x": np.zeros(1000), "y": np.arange(1000.0)})
    pairs = series.envelope(["y"], 0, 6016, 64)[0].reshape(-1, 2)
    assert np.isnan(pairs[:78]).all()
    np.testing.assert_array_equal(pairs[80], [120.0, 183.0])
    np.testing.assert_array_equal(series.rows(["y"], 5900, 6000)[0], np.arange(900.0, 1000.0))


def test_columns_without_end_replace_the_oldest_that_is_gone_and_never_one_that_is_there():
    series = LodSeries(1, 512, 0)
    for number in range(3 * MOST_COLUMNS):
        series.append(10 * number, {"x": np.full(10, 1.0), f"book-{number}": np.full(10, float(number))})
    last = 3 * MOST_COLUMNS - 1
    assert len(series.names) == MOST_COLUMNS
    assert "x" in series.names
    assert "book-1" not in series.names
    newest = series.rows([f"book-{last}", "x"], 10 * last - 10, 10 * last + 10)
    np.testing.assert_array_equal(newest[0], [np.nan] * 10 + [last] * 10)
    assert (newest[1] == 1.0).all()


def size_bytes(history):
    """Returns the memory of every array of a history."""
    return sum(series.nbytes for series in history.all_series)


@pytest.mark.slow
def test_the_memory_of_a_history_stays_bounded_over_a_million_ticks():
    """Ten times as long a run takes a few coarse levels more, a fifth of what it took."""
    history = History(Timebase(10_000, 1_000, 0, 1_000_000), 0)
    sizes = {}
    block = np.sin(np.arange(10_001) / 500.0)
    ticks = block[:1000]
    columns = {"x": ticks, "v": ticks, "wall": ticks, "total": ticks, "dissipation.0": ticks}
    at_work = AtWork((ElementTable(name="damping", parameters={"damping": 0.1}),), Wall(position=0.0, stiffness=100.0))
    for tick in range(0, 1_000_000, 1000):
        history.append_plant_block(tick, {"x": block, "v": block, "force": block})
        history.append_ticks(tick, columns, at_work)
        history.append_energy(tick, {"wall.true": ticks, "damping.true": ticks, "residual": ticks, "hand_work": ticks})
        if tick in (99_000, 999_000):
            sizes[tick] = size_bytes(history)
    assert sizes[999_000] < 1.25 * sizes[99_000]
    assert history.first_tick == 0
    assert history.end_tick == 1_000_000
    bucket = history.steps.bucket_from(0, 1)
    whole = history.steps.envelope(["x"], 0, 1_000_000 // bucket * bucket, bucket)
    assert (whole.min(), whole.max()) == (block.min(), block.max())


@pytest.mark.parametrize("rows_per_tick", [1, 10])
def test_any_amount_may_come_at_once_and_any_gap_may_lie_between(rows_per_tick):
    """Twenty times what is held in full, after a gap of as much."""
    ticks = 100_000
    rows = np.random.default_rng(2).normal(size=ticks * rows_per_tick)
    series = LodSeries(rows_per_tick, 5000, 0)
    series.append(ticks, {"x": rows})
    assert series.end_tick == 2 * ticks
    assert series.first_tick == ticks
    bucket = series.bucket_from(ticks, 1)
    first, end = series.aligned(ticks, bucket), 2 * ticks + -2 * ticks % bucket
    pairs = series.envelope(["x"], first, end, bucket)[0].reshape(-1, 2)
    padded = np.full((end - first) * rows_per_tick, np.nan)
    at = (ticks - first) * rows_per_tick
    padded[at : at + len(rows)] = rows
    np.testing.assert_array_equal(np.sort(pairs), least_and_greatest(padded.reshape(len(pairs), -1)))


def test_extremes_are_those_found_one_by_one_among_numbers_that_are_not_there():
    random = np.random.default_rng(3)
    for group in (1, 2, 4, 17, 40, 95, 96, 512):
        values = random.normal(size=(3, 5 * group)).round(1)
        values[random.random(values.shape) < 0.3] = np.nan
        pairs = extremes(values, group).reshape(15, 2)
        found, groups = least_and_greatest(values.reshape(15, group)), values.reshape(15, group)
        falls = groups[:, -1] < groups[:, 0]
        np.testing.assert_array_equal(np.where(falls[:, None], pairs[:, ::-1], pairs), found)
