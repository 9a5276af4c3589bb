"""Causes of a swing by trial: the loop continues from the end of its run without its delay, counts or elements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import reduce

from haploop.launch.stability.finding import DOES, Finding
from haploop.launch.stability.looks import LOOKS_S, push_of
from haploop.launch.stability.still_hand import End, continue_plant
from haploop.launch.stability.watch import watch
from haploop.protocol.ticks import DELAY

# An encoder so many times as fine has no counts that a hand could feel.
FINER = 1000.0
ALL = "all"
RESTS, LESS, OTHERWISE = "rests", "swings less", "swings otherwise"
# A swing narrower than this share of the first is less; one whose frequency differs by more than this is another.
_LESS, _OTHER = 1.0 / 3.0, 1.5


def with_causes(end: End, found: Finding) -> Finding:
    """Returns the finding of a loop that swings with what the loop does without each of its parts.

    The loop continues from the end of the run; one part is taken out, the hand is held and pushed as for the verdict,
    by the larger push alone, and the loop is watched for up to 16 s. Parts are the round-trip delay (of a line without
    jitter and loss, which would stay), the counts of the encoder (made ``FINER`` times as fine) and the dissipation
    elements. If the loop swings without any one of several, it is also tried without all of them. A swing less than a
    third as wide, or at a frequency 1.5 times off, is named as such: the part made most of the swing, or another swing
    takes the place of the first.
    """
    if found.word not in ("limit-cycle", "growing"):
        return found
    trials = {name: without for name, (has, without) in _PARTS.items() if has(end)}
    does = {name: _does(without(end), found) for name, without in trials.items()}
    if len(does) > 1 and not {RESTS, LESS} & set(does.values()):
        does[ALL] = _does(reduce(lambda so_far, without: without(so_far), trials.values(), end), found)
    return replace(found, without=does)


def _does(end: End, found: Finding) -> str:
    """Returns what a changed loop does, compared with the swing that was found."""
    push_N = push_of(end.hold_N, end.scene.hand, end.wall_m)
    changed, _ = watch(end, (push_N,), LOOKS_S)
    does = DOES.get(changed.word, "undecided")
    if does != "swings on" or not found.frequency_Hz or not changed.frequency_Hz:
        return does
    if found.word == changed.word == "limit-cycle" and changed.width_m < _LESS * found.width_m:
        return LESS
    is_other = not 1.0 / _OTHER < changed.frequency_Hz / found.frequency_Hz < _OTHER
    return OTHERWISE if is_other else does


def _delay_steps(end: End) -> int:
    changed = end.plant.checkpoint().delay_steps
    return end.time.delay_steps if changed is None else changed


def _has_plain_delay(end: End) -> bool:
    """Tells whether there is a delay that can be taken out: jitter and loss would stay on the line."""
    return _delay_steps(end) > 0 and not (end.scene.jitter or end.scene.loss)


def _without_delay(end: End) -> End:
    """Returns the end with a line without delay; commands already on the line still arrive."""
    plant = continue_plant(end.scene, end.time, end.plant)
    plant.schedule(plant.tick, {"set": {DELAY: 0.0}})
    return replace(end, plant=plant)


def _with_fine_counts(end: End) -> End:
    assert end.scene.encoder
    fine = replace(end.scene.encoder, resolution=end.scene.encoder.resolution / FINER)
    return replace(end, scene=replace(end.scene, encoder=fine))


def _without_elements(end: End) -> End:
    state = end.controller.state
    params = replace(end.controller.params, elements=())
    return replace(end, controller=end.controller.fork(params, state and (*state[:3], ())))


_PARTS: dict[str, tuple[Callable[[End], bool], Callable[[End], End]]] = {
    "delay": (_has_plain_delay, _without_delay),
    "encoder": (lambda end: end.scene.encoder is not None, _with_fine_counts),
    "elements": (lambda end: bool(end.controller.params.elements), _without_elements),
}
