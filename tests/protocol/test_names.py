"""The name that was meant where an unknown one is given."""

import pytest

from haploop.protocol.names import nearest

KINDS = ("damping", "unidirectional-damping", "unidirectional-inertia", "force-rate", "wall.stiffness")


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("dampin", "damping"),
        ("damper", "damping"),
        ("unidi", None),  # two names begin so
        ("stifness", "wall.stiffness"),
        ("dam", None),
        ("spring", None),
    ],
)
def test_the_nearest_name_is_one_that_is_alike_or_the_only_one_that_begins_alike(given, meant):
    assert nearest(given, KINDS) == meant
