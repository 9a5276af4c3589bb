"""The unmodelled hand: what a scene that has one cannot hold besides, and who cannot use such a scene."""

from __future__ import annotations

from haploop.launch.plan.effect import Draft
from haploop.launch.scene.mistakes import SceneError
from haploop.launch.scene.reading.layers import Layers
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Hand, Scene, hand_is_unmodelled

_KIND = "unmodelled"
# What takes or stores energy between the held force and the hand in a way that the device's rows do not show.
_NEED_A_MODEL = ("clock.integrator", "transmission", "friction", "actuator.bandwidth", "accelerometer.bandwidth")
_CANNOT_MOVE = (
    "No program here knows what such a hand does, so the device can be neither moved nor judged: only a run whose "
    "plant is your own program can have it (haploop run --node plant=COMMAND, or --external plant)."
)


def check_hand(draft: Draft) -> None:
    """Refuses keys that say how an unmodelled hand moves, and effects whose energy is known only for a modelled one."""
    hand = draft.data.get("hand")
    if not isinstance(hand, dict) or hand.get("kind") != _KIND:
        return
    known = Hand(kind=_KIND).as_dict()  # as a resolved scene has it
    for key in [
        field.name for field in Hand.fields() if field.name in hand and hand[field.name] != known.get(field.name)
    ]:
        draft.complain(("hand", key), "An unmodelled hand has no key but its kind; leave this out.", "is given")
    for key in _NEED_A_MODEL:
        if value_at(draft.data, key) not in (None, "exact"):
            expected = "What it does to the energy is known only where the hand is modelled; leave one of them out."
            draft.complain(tuple(key.split(".")), expected, "is given with an unmodelled hand")


def demand_modelled(layers: Layers, scene: Scene) -> Scene:
    """Returns the resolved scene of some layers; SceneError if its hand is unmodelled, so that nothing moves it."""
    if hand_is_unmodelled(scene):
        layers.complain(("hand", "kind"), _CANNOT_MOVE)
        raise SceneError(layers.mistakes)
    return scene
