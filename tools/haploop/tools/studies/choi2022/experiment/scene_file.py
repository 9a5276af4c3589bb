"""The nearest interpretation as a scene file: launch/scenes/premium_press.toml."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from haploop.launch.scene.toml_writer import inline
from haploop.tools.studies.choi2022.experiment.setup import MASS_KG, Setup

_TEMPLATE = Path(__file__).with_name("premium_press.toml.in")
_PLACES = {"motor": "the near side, that of the rotor", "tip": "the motor's body, which moves with the link"}


def file_text(setup: Setup) -> str:
    """Returns the scene file of a setup, ``premium_press.toml.in`` with its numbers to six digits."""
    scene = setup.scene(5000.0, [])
    drive, unit, hand = scene["transmission"], scene["accelerometer"], scene["hand"]
    bandwidth = f"bandwidth = {_six(unit['bandwidth'])}  # Hz. ASSUMPTION\n" if "bandwidth" in unit else ""
    cutoff = scene.get("velocity", {}).get("cutoff")
    return _TEMPLATE.read_text(encoding="utf-8").format(
        delay=_six(setup.delay_s),
        far=_six(scene["device"]["mass"]),
        near=_six(drive["motor_mass"]),
        mass=MASS_KG,
        velocity=_six(-setup.entry_m_s),
        share=f"{100 * setup.near_share:.3g}",
        stiffness=_six(drive["stiffness"]),
        mode=f"{setup.mode_Hz:.3g}",
        damping=_six(drive["damping"]),
        ratio=f"{100 * setup.mode_damping:.3g}",
        viscous=drive["motor_damping"],
        setting=f"at its setting of {setup.unit}" if bandwidth else "but with no lag of its own",
        step=_six(scene["encoder"]["resolution"]),
        peak=_six(scene["actuator"]["saturation"]),
        range=_six(unit["range"]),
        resolution=_six(unit["resolution"]),
        noise=_six(unit["noise_density"]),
        bandwidth=bandwidth,
        late=_six(unit["delay"]),
        mount=inline(setup.mount),
        place=_PLACES[setup.mount],
        times=f"{setup.hand:.3g}",
        hand=_lines(hand, {"mass": "kg", "damping": "N s/m", "stiffness": "N/m"}),
        grip=_lines(hand["grip"], {"stiffness": "N/m", "damping": "N s/m"}),
        push=_six(-setup.push_N),
        filtered=f"\n[velocity]\ncutoff = {_six(cutoff)}  # Hz. ASSUMPTION\n" if cutoff else "",
    )


def _lines(table: dict[str, Any], units: dict[str, str]) -> str:
    return "".join(f"{key} = {_six(table[key])}  # {unit}\n" for key, unit in units.items())


def _six(value: float) -> str:
    return inline(float(f"{value:.6g}"))
