"""The log is the same however plant and controller send their rows, and whenever the logger joins."""

from itertools import accumulate

import numpy as np
import pytest

from haploop.launch.runs.in_process import Loop
from haploop.launch.scene.events import scene_events
from haploop.logger.log.channels import Channels
from haploop.logger.log.recording import MemoryLog
from haploop.logger.logger import Logger
from haploop.logger.session import LogSession
from haploop.protocol.ticks import Timebase
from helpers.runs.captured import CapturingLogger
from helpers.scenes.least import KINDS, scene

# Damping swapped in while everything is at rest: its force is 0 at first, and only the push at 30 ms changes that.
SCENE = scene(
    duration=0.06,
    wall={"position": -0.001, "stiffness": 100.0},
    hand={"force": {"kind": "step", "value": 1.0, "at": 0.03}},
    run={"block_ticks": 3},
    event=[{"at": 0.012, "swap": {"kind": "damping", "damping": 0.2}}],
)
TIME = Timebase.from_scene(SCENE)
JOINS = 6


@pytest.fixture(scope="module")
def sent():
    """Blocks of plant and of controller of one run."""
    logger = CapturingLogger(SCENE, TIME)
    loop = Loop(SCENE, TIME, KINDS, LogSession(logger, None, None))
    loop.schedule(sorted(scene_events(SCENE, TIME), key=lambda event: event[0]))
    while loop.block():
        pass
    loop.finish()
    return logger.plant_blocks, logger.controller_blocks


def logged(plant, controller, order, history=(), log=None):
    """The log of a logger that is given the blocks in an order: a sequence of "p" and "c"."""
    log = log or MemoryLog()
    logger = Logger(SCENE, TIME, Channels(log, TIME, every_step=True))
    begins = {name: np.frombuffer(plant[0]["columns"][name])[0] for name in ("x", "v", "force")}
    logger.start(begins | {"tick": plant[0]["from_tick"]}, list(history))
    taken = {"p": (iter(plant), logger.plant_block), "c": (iter(controller), logger.controller_block)}
    for who in order:
        blocks, take = taken[who]
        take(next(blocks))
    logger.end()
    return log.recording()


def test_a_new_element_opens_its_books_at_its_own_tick_in_whichever_order_blocks_come(sent):
    plant, controller = sent
    orders = ["c" * len(controller) + "p" * len(plant), "p" * len(plant) + "c" * len(controller)]
    first, *others = [logged(plant, controller, order) for order in orders]
    opened = np.isfinite(first["/energy"]["damping.true"])
    assert np.flatnonzero(opened)[0] == 12
    for other in others:
        for topic, columns in first.items():
            for name in columns if topic != "/events" else ():
                np.testing.assert_array_equal(other[topic][name], columns[name], err_msg=name)


def test_a_logger_whose_plant_is_ahead_when_it_joins_logs_the_controller_from_its_first_tick_on(sent):
    plant, controller = sent
    ends = list(accumulate(block["ticks"] for block in plant))
    late = plant[JOINS:]
    log = logged(late, controller[1:], "c" * (len(controller) - 1) + "p" * len(late), history=controller[:1])
    first = ends[JOINS - 1]
    assert (log["/controller"]["timestamp"][0], log["/energy"]["timestamp"][0]) == (first / 1000, first / 1000)
    whole = logged(plant, controller, "c" * len(controller) + "p" * len(plant))
    for name, column in log["/controller"].items():
        np.testing.assert_array_equal(column, whole["/controller"][name][first:], err_msg=name)


def test_a_logger_that_joins_before_the_controllers_first_block_expects_it_from_tick_0(sent):
    """The plant's STATE may tell of a tick that the controller has answered, but not yet told of."""
    plant, controller = sent
    ends = list(accumulate(block["ticks"] for block in plant))
    late = plant[JOINS:]
    log = logged(late, controller, "c" * len(controller) + "p" * len(late))
    whole = logged(plant, controller, "c" * len(controller) + "p" * len(plant))
    for name, column in log["/controller"].items():
        np.testing.assert_array_equal(column, whole["/controller"][name][ends[JOINS - 1] :], err_msg=name)


class Reached(MemoryLog):
    """A log that looks, at every message, that it could be replayed if it were cut off there."""

    def __init__(self):
        super().__init__()
        self.topics, self.ticks = [], {"/controller": 0, "/plant": 0}

    def channel(self, topic, columns, **options):
        number = super().channel(topic, columns, **options)
        self.topics += [topic] if number == len(self.topics) else []
        return number

    def write(self, channel, log_times_ns, values):
        super().write(channel, log_times_ns, values)
        if values.shape[1:2] == (1,):  # the end state, a message of one sample
            return
        self.ticks[self.topics[channel]] = self.ticks.get(self.topics[channel], 0) + len(values)
        assert self.ticks["/plant"] <= self.ticks["/controller"]


@pytest.mark.parametrize("order", ["cp", "pc"])
def test_a_log_cut_off_anywhere_holds_the_controller_as_far_as_the_plant(sent, order):
    plant, controller = sent
    log = Reached()
    logged(plant, controller, order * len(plant), log=log)
    assert log.ticks["/plant"] == log.ticks["/controller"] == TIME.ticks


def test_what_the_controller_sent_is_logged_even_where_nothing_came_of_the_plant(sent):
    plant, controller = sent
    log = logged(plant, controller, "c" * len(controller))
    assert len(log["/controller"]["x"]) == TIME.ticks
