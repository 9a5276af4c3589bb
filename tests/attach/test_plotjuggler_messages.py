"""Messages to PlotJuggler: msgpack as its parser takes it, arrays of maps, each with its time, and only floats."""

from __future__ import annotations

import socket

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from haploop.logger.log.channels import Channels
from haploop.logger.log.table import TableLayout
from haploop.protocol.ticks import Timebase
from haploop.tools.attach.plotjuggler import MOST_SAMPLES, MessageBatches, Outlet, PortTaken, pack_array_of_maps
from oracles.plotjuggler_rules import Parser

TIME = Timebase(plant_rate=10_000, control_rate=1_000, delay_steps=0, ticks=3000)


def maps(layout: TableLayout, values: np.ndarray) -> list[dict[str, float]]:
    """The slow way: dictionaries."""
    return [dict(zip(layout.columns, map(float, row), strict=True)) for row in values]


@pytest.mark.parametrize("samples", [1, 15, 16, 255, 1000])
def test_a_message_is_byte_for_byte_what_msgpack_makes_of_the_samples(samples: int) -> None:
    """Also where msgpack counts an array in another way, from 16 elements on."""
    layout = TableLayout({"timestamp": "s", "x": "m", "dissipation.0": "N"})
    values = np.random.default_rng(samples).normal(size=(samples, 3))
    assert pack_array_of_maps(layout, values) == msgpack.packb(maps(layout, values))


@given(arrays.arrays(np.float64, st.tuples(st.integers(1, 40), st.just(2)), elements=st.floats()))
def test_every_bit_of_every_number_survives(values: np.ndarray) -> None:
    """NaN and infinities, too."""
    layout = TableLayout({"timestamp": "s", "x": "m"})
    back = msgpack.unpackb(pack_array_of_maps(layout, values))
    assert np.array([[sample[name] for name in layout.columns] for sample in back]).tobytes() == values.tobytes()


def test_a_long_stretch_is_cut_into_messages_of_bounded_length_and_no_sample_is_lost_or_doubled() -> None:
    batches = MessageBatches()
    number = batches.channel("/plant", {"timestamp": "s"}, title="")
    stamps = np.arange(2.5 * MOST_SAMPLES)
    for part in np.array_split(stamps, 7):
        batches.write(number, np.zeros(len(part), np.int64), part[:, None])
    messages = [msgpack.unpackb(payload) for _, payload in batches.take_messages()]
    assert [len(message) for message in messages] == [MOST_SAMPLES, MOST_SAMPLES, MOST_SAMPLES // 2]
    assert [sample["timestamp"] for message in messages for sample in message] == stamps.tolist()
    assert list(batches.take_messages()) == []


def test_columns_that_come_and_go_leave_the_samples_of_a_topic_in_order() -> None:
    """An element added and removed again within one batch: /controller has other columns, then the first ones again."""
    batches = MessageBatches()
    for tick, columns in enumerate([("x",), ("x", "dissipation.0"), ("x",)]):
        number = batches.channel("/controller", dict.fromkeys(("timestamp", *columns), ""), title=f"from {tick}")
        batches.write(number, np.array([tick]), np.full((1, 1 + len(columns)), float(tick)))
        other = batches.channel("/energy", {"timestamp": "s"}, title="")
        batches.write(other, np.array([tick]), np.full((1, 1), float(tick)))
    came = [(topic, sample) for topic, payload in batches.take_messages() for sample in msgpack.unpackb(payload)]
    assert [sample["timestamp"] for topic, sample in came if topic == "/controller"] == [0.0, 1.0, 2.0]
    assert [len(sample) for topic, sample in came if topic == "/controller"] == [2, 3, 2]
    assert [sample["timestamp"] for topic, sample in came if topic == "/energy"] == [0.0, 1.0, 2.0]


def test_what_nobody_wants_is_dropped_and_does_not_pile_up() -> None:
    batches = MessageBatches()
    number = batches.channel("/plant", {"timestamp": "s"}, title="")
    batches.write(number, np.zeros(1, np.int64), np.zeros((1, 1)))
    assert list(batches.take_messages(wanted=False)) == []
    assert list(batches.take_messages()) == []


def test_the_channels_are_those_of_the_log_and_every_sample_has_its_time() -> None:
    batches = MessageBatches()
    channels = Channels(batches, TIME, every_step=True)
    steps = np.arange(21.0)
    channels.plant(3, 2, {"x": steps, "v": -steps, "force": 0 * steps})
    channels.event(3, {"pause": True})
    [(topic, payload)] = batches.take_messages()
    samples = msgpack.unpackb(payload)
    assert topic == "/plant"
    assert [sample["x"] for sample in samples] == steps[:-1].tolist()
    assert [sample["timestamp"] for sample in samples] == [step / 10_000 for step in range(30, 50)]
    assert {type(value) for sample in samples for value in sample.values()} == {float}


def test_one_sample_without_its_time_would_cost_the_topic_its_time_for_good() -> None:
    """Why every sample has one: from there on PlotJuggler draws messages at the time of their arrival."""
    parser = Parser("/plant")
    parser.parse([{"timestamp": 0.5, "x": 1.0}, {"x": 2.0}, {"timestamp": 0.7, "x": 3.0}], 98.0)
    parser.parse([{"timestamp": 0.8, "x": 4.0}], 99.0)
    assert parser.series["/plant/x"] == [(0.5, 1.0), (0.5, 2.0), (0.5, 3.0), (99.0, 4.0)]


def test_a_port_that_is_taken_is_told_with_what_to_do_and_the_socket_is_of_this_machine_only() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(PortTaken, match=f"Port {port} is taken .*--port.*PlotJuggler"):
            Outlet(port)
    outlet = Outlet(0)
    assert outlet.address.startswith("tcp://127.0.0.1:")
    assert not outlet.has_subscribers
    outlet.close()
