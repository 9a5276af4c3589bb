"""haploop export: in every format each number, name and unit is what the log holds; read by other libraries."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader
from typer.testing import CliRunner

from haploop.logger import read
from haploop.logger.log.recording import Recording
from haploop.tools.cli.app import app
from helpers.data.logs import AFTER, PLANT, SCENE, same_bits, swapped_run

TABLES = {"/plant": PLANT, "/controller": AFTER}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return swapped_run(tmp_path_factory.mktemp("run") / "out")


@pytest.fixture(scope="module")
def log(run: Path) -> Recording:
    return read(run)


def export(run: Path, *arguments: str) -> list[Path]:
    """The files that a command has named."""
    result = CliRunner().invoke(app, ["export", str(run), "--to", *arguments])
    assert result.exit_code == 0, result.output
    return [Path(line) for line in result.stdout.splitlines()]


def test_csv_has_units_in_its_header_and_every_number_bit_for_bit(run: Path, log: Recording, tmp_path: Path) -> None:
    files = export(run, "csv", "--out", str(tmp_path))
    assert [file.name for file in files] == ["events.csv", "plant.csv", "controller.csv"]
    for topic, units in TABLES.items():
        with (tmp_path / f"{topic[1:]}.csv").open(newline="", encoding="utf-8") as file:
            header, *rows = csv.reader(file)
        assert header == [f"{name} ({unit})" if unit else name for name, unit in units.items()]
        for name, texts in zip(units, zip(*rows, strict=True), strict=True):
            assert same_bits(np.array([float(text or "nan") for text in texts]), log[topic][name]), name
    [event] = csv.DictReader(io.StringIO((tmp_path / "events.csv").read_text(encoding="utf-8")))
    assert event["timestamp (s)"] == "0.15"
    assert json.loads(event["message"]) == log["/events"][0]


@pytest.mark.slow
def test_csv_is_read_by_pandas_at_once(run: Path, log: Recording, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    export(run, "csv", "--out", str(tmp_path), "--topics", "controller,/plant")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["controller.csv", "plant.csv"]
    to_the_bit = {"float_precision": "round_trip"} if pandas.__version__ < "3" else {}
    frame = pandas.read_csv(tmp_path / "plant.csv", **to_the_bit)
    assert same_bits(frame["force (N)"].to_numpy(), log["/plant"]["force"])
    assert pandas.read_csv(tmp_path / "controller.csv")["dissipation.1 (N)"].isna().sum() == 150


def test_npz_holds_every_column_its_units_the_events_and_the_scene(run: Path, log: Recording, tmp_path: Path) -> None:
    [file] = export(run, "npz", "--out", str(tmp_path / "mine.npz"))
    with np.load(file) as archive:
        for topic, units in TABLES.items():
            for name in units:
                assert same_bits(archive[f"{topic[1:]}/{name}"], log[topic][name]), name
        assert json.loads(archive["units.json"]) == {
            f"{topic[1:]}/{name}": unit for topic, units in TABLES.items() for name, unit in units.items()
        }
        assert json.loads(archive["events.json"]) == log["/events"]
        assert archive["scene.toml"] == SCENE
    assert [path.name for path in tmp_path.iterdir()] == ["mine.npz"]


def test_parquet_holds_every_column_with_its_unit_in_the_schema(run: Path, log: Recording, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    export(run, "parquet", "--out", str(tmp_path))
    for topic, units in TABLES.items():
        table = parquet.read_table(tmp_path / f"{topic[1:]}.parquet")
        assert {field.name: field.metadata[b"unit"].decode() for field in table.schema} == units
        for name in units:
            assert same_bits(table[name].to_numpy(), log[topic][name]), name
    events = parquet.read_table(tmp_path / "events.parquet").to_pylist()
    assert [json.loads(event["message"]) for event in events] == log["/events"]
    assert events[0]["timestamp"] == 0.15


def test_pandas_reads_a_parquet_file_with_its_units(run: Path, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    pandas = pytest.importorskip("pandas")
    export(run, "parquet", "--out", str(tmp_path))
    for topic, units in TABLES.items():
        assert pandas.read_parquet(tmp_path / f"{topic[1:]}.parquet").attrs == {"units": units}


def test_a_long_parquet_file_comes_in_groups_that_are_read_one_by_one(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    run = swapped_run(tmp_path / "run", 20_000, hard=False, flush_ticks=2_000)
    [file] = export(run, "parquet", "--topics", "plant")
    held = parquet.ParquetFile(file)
    sizes = [held.metadata.row_group(number).num_rows for number in range(held.metadata.num_row_groups)]
    assert sum(sizes) == 200_001
    assert max(sizes) < 100_000
    assert same_bits(held.read_row_group(1)["x"].to_numpy(), read(run)["/plant"]["x"][sizes[0] : sum(sizes[:2])])


@pytest.fixture(scope="module")
def messages(run: Path, tmp_path_factory: pytest.TempPathFactory) -> list[tuple[Any, Any, Any]]:
    [file] = export(run, "json-mcap", "--out", str(tmp_path_factory.mktemp("mcap")))
    assert file.name == "log.json.mcap"
    return list(make_reader(io.BytesIO(file.read_bytes())).iter_messages())


def test_json_mcap_has_one_message_a_row_at_the_time_of_the_row(messages: list[Any], log: Recording) -> None:
    for topic, units in TABLES.items():
        found = [
            (message.log_time, json.loads(message.data)) for _, channel, message in messages if channel.topic == topic
        ]
        assert [time for time, _ in found] == [round(t * 1e9) for t in log[topic]["timestamp"]]
        for name in units:
            column = log[topic][name]
            there = np.array([one.get(name, np.nan) for _, one in found], np.float64)
            assert same_bits(there, np.where(np.isfinite(column), column, np.nan)), name
    assert [json.loads(m.data) for _, channel, m in messages if channel.topic == "/events"] == log["/events"]


def test_json_mcap_has_schemas_as_foxglove_reads_them_and_messages_that_obey_them(messages: list[Any]) -> None:
    """An object whose properties each have one plain type; a list of types, or none, would not be read."""
    assert {channel.topic for _, channel, _ in messages} == {"/events", *TABLES}
    events = [message for message in messages if message[1].topic == "/events"]
    for schema, channel, message in [*messages[::23], *events]:
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        described = json.loads(schema.data)
        assert described["type"] == "object"
        assert {column["type"] for column in described["properties"].values()} == {"number"}
        jsonschema.validate(json.loads(message.data), described)
        if channel.topic in TABLES:
            units = TABLES[channel.topic]
            assert {name: column["unit"] for name, column in described["properties"].items()} == units
            assert described["properties"]["x"]["title"] == "x (m)"


def test_json_mcap_keeps_what_was_attached(run: Path, tmp_path: Path) -> None:
    [file] = export(run, "json-mcap", "--out", str(tmp_path / "it.mcap"))
    [attached] = make_reader(io.BytesIO(file.read_bytes())).iter_attachments()
    assert (attached.name, attached.data) == ("scene.toml", SCENE)


def test_json_mcap_holds_no_word_that_json_does_not_know(messages: list[Any]) -> None:
    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    for _, _, message in messages:
        json.loads(message.data, parse_constant=refuse)


def test_what_a_real_run_leaves_is_exported_beside_it(tmp_path: Path) -> None:
    scene = Path(__file__).parents[2] / "launch/scenes/swap.toml"
    out = tmp_path / "out"
    arguments = ["run", str(scene), "--set", "duration=1.6", "--in-process", "--out", str(out)]
    assert CliRunner().invoke(app, arguments).exit_code == 0
    log = read(out)
    [file] = export(out, "npz")
    assert file == out / "log.npz"
    with np.load(file) as archive:
        arrays = {name: archive[name] for name in archive.files if name.count("/")}
        for topic in ("/plant", "/controller", "/energy"):
            for name, column in log[topic].items():
                assert same_bits(arrays.pop(f"{topic[1:]}/{name}"), column), (topic, name)
        assert json.loads(archive["events.json"])[0]["swap"]["kind"] == "unidirectional-inertia"
    assert arrays == {}
