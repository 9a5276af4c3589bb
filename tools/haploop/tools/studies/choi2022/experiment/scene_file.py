"""The nearest interpretation as a scene file: launch/scenes/premium_press.toml."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from haploop.tools.studies.choi2022.experiment.setup import MASS_KG, Setup

_TEMPLATE = Path(__file__).with_name("premium_press.toml.in")
_PLACES = {"motor": "the near side, that of the rotor", "tip": "the motor's body, which moves with the link"}


def file_text(setup: Setup) -> str:
    """Returns the scene file of a setup, ``premium_press.toml.in`` with its numbers to six digits."""
    scene = _six_digits(setup.scene(5000.0, []))
    bandwidth, cutoff = scene["accelerometer"].get("bandwidth"), scene.get("velocity", {}).get("cutoff")
    return _TEMPLATE.read_text(encoding="utf-8").format(
        setup=setup,
        mass=MASS_KG,
        share=100 * setup.near_share,
        ratio=100 * setup.mode_damping,
        setting=f"at its setting of {setup.unit}" if bandwidth else "but with no lag of its own",
        bandwidth=f"bandwidth = {bandwidth}  # Hz. ASSUMPTION\n" if bandwidth else "",
        place=_PLACES[setup.mount],
        filtered=f"\n[velocity]\ncutoff = {cutoff}  # Hz. ASSUMPTION\n" if cutoff else "",
        **scene,
    )


def _six_digits(value: Any) -> Any:
    """Returns a table with all its numbers to six digits."""
    if isinstance(value, dict):
        return {key: _six_digits(one) for key, one in value.items()}
    return float(f"{value:.6g}") if isinstance(value, float) else value
