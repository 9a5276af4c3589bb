"""The verdict on what depends on values that nobody published."""

from __future__ import annotations

from haploop.tools.paper.claims import Claim, Finding

READING = "the reading of the device in launch/scenes/premium_press.toml"


def under_the_reading(claim: Claim, is_so: bool, numbers: str, more: str = "") -> Finding:
    """Holds where the device is as ``Setup`` has it (and ``more`` is so, too), or does not hold here."""
    return claim.assuming(READING + more, numbers) if is_so else claim.fails(numbers)
