"""The channels of the log: their schemas, registering them, what is refused; read by the mcap library alone."""

from __future__ import annotations

import io
import json
from pathlib import Path

import jsonschema
import msgpack
import numpy as np
import pytest
from mcap.reader import make_reader

from haploop.logger.log.writer import Log

PLANT = {"timestamp": "s", "t": "s", "x": "m", "v": "m/s", "force": "N"}


@pytest.mark.parametrize("samples", [None, 1, 10])
def test_the_schema_is_json_schema_that_the_messages_obey(tmp_path: Path, samples: int | None) -> None:
    shape = (3, 5) if samples is None else (3, samples, 5)
    with Log(tmp_path / "log.mcap") as log:
        channel = log.channel("/plant", PLANT, samples_per_message=samples, title="Plant")
        log.write(channel, np.arange(3), np.ones(shape))
    reader = make_reader(io.BytesIO((tmp_path / "log.mcap").read_bytes()))
    for schema, found, message in reader.iter_messages():
        assert schema is not None
        assert (schema.encoding, schema.name, found.message_encoding) == ("jsonschema", "Plant", "msgpack")
        described = json.loads(schema.data)
        jsonschema.Draft202012Validator.check_schema(described)
        jsonschema.validate(msgpack.unpackb(message.data), described)
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate([{"t": 0.0}], described)
        properties = (described if samples is None else described["items"])["properties"]
        assert {name: kind["unit"] for name, kind in properties.items()} == PLANT


def test_registering_again_gives_the_same_channel_and_other_columns_a_new_one(tmp_path: Path) -> None:
    with Log(tmp_path / "log.mcap") as log:
        first = log.channel("/controller", {"x": "m"}, title="Controller")
        other = log.channel("/controller", {"x": "m", "dissipation.0": "N"}, title="Controller")
        assert log.channel("/controller", {"x": "m"}, title="Controller") == first != other
        log.write(first, np.array([0]), np.array([[1.0]]))
        log.write(other, np.array([1]), np.array([[2.0, 3.0]]))
    reader = make_reader(io.BytesIO((tmp_path / "log.mcap").read_bytes()))
    assert [msgpack.unpackb(message.data) for _, _, message in reader.iter_messages()] == [
        {"x": 1.0},
        {"x": 2.0, "dissipation.0": 3.0},
    ]


def test_an_attachment_comes_back(tmp_path: Path) -> None:
    scene = 'title = "µ"\n'.encode()
    with Log(tmp_path / "log.mcap") as log:
        log.attach("scene.toml", "application/toml", scene)
    [found] = make_reader(io.BytesIO((tmp_path / "log.mcap").read_bytes())).iter_attachments()
    assert (found.name, found.media_type, found.data) == ("scene.toml", "application/toml", scene)


def test_values_of_a_wrong_shape_and_times_before_zero_are_refused(tmp_path: Path) -> None:
    with Log(tmp_path / "log.mcap") as log:
        plant = log.channel("/plant", PLANT, samples_per_message=2, title="Plant")
        events = log.channel("/events", {}, title="Events")
        for shape in [(3, 5), (3, 3, 5), (3, 2, 4), (2, 2, 5)]:
            with pytest.raises(ValueError, match="of shape"):
                log.write(plant, np.arange(3), np.ones(shape))
        with pytest.raises(ValueError, match="0 or later"):
            log.write(plant, np.array([0, -1]), np.ones((2, 2, 5)))
        with pytest.raises(ValueError, match="through write"):
            log.message(plant, 0, {"x": 1.0})
        with pytest.raises(ValueError, match="through message"):
            log.write(events, np.arange(1), np.ones((1, 0)))
        with pytest.raises(ValueError, match="at least one sample"):
            log.channel("/none", PLANT, samples_per_message=0, title="None")
