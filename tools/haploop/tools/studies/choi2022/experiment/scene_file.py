"""The nearest interpretation as a scene file: launch/scenes/premium_press.toml."""

from __future__ import annotations

from typing import Any

from haploop.launch.scene.toml_writer import inline
from haploop.tools.studies.choi2022.experiment.setup import MASS_KG, Setup

_TEXT = """\
# The experiments of Choi et al. 2022, section V.B: a person collides with a virtual wall and presses on, along the
# vertical axis of a PHANToM Premium 1.5 with an inertial unit. What is not published is marked ASSUMPTION: the
# interpretation with which the paper's results come out best of all that `haploop paper --figure 7` tries, which wrote
# this file.
# The Coulomb friction of 48 mN that Cavusoglu et al. 2002 found is left out, ASSUMPTION: with it walls stiffer than the
# paper's are steady.
title = "A person taps and presses a stiff wall with a PHANToM Premium 1.5"
extends = "../hands/fu_cavusoglu_y.toml"
duration = 0.9  # s: the contact comes after some 10 ms, the last 0.5 s are judged
seed = 1

[clock]
round_trip_delay = {delay}  # s. ASSUMPTION: computing, amplifier and motor (L/R 0.11 ms) beyond the hold itself

[device]
mass = {far}  # kg. ASSUMPTION: the far side of the elastic drive, of {mass} kg in all
damping = 0.0  # N s/m. ASSUMPTION: the viscous friction is the motor's
position = 0.0  # m
velocity = {velocity}  # m/s. ASSUMPTION: a tap; 0.20 to 0.24 m/s were measured of firm ones

[transmission]
motor_mass = {near}  # kg. ASSUMPTION: the near side, {share} % of {mass} kg
stiffness = {stiffness}  # N/m. ASSUMPTION: both ring at {mode} Hz (S. Choi and H. Z. Tan 2004: near 200 Hz)
damping = {damping}  # N s/m. ASSUMPTION: {ratio} % of critical
motor_damping = {viscous}  # N s/m. Cavusoglu et al. 2002, all of it

[encoder]
resolution = {step}  # m. 1024 lines, counted four times each, and 11.2 to 1 (see ../devices/premium15.toml)

[actuator]
saturation = {peak}  # N. Maxon data sheet: stall torque

# An inertial unit of the class of the MPU-9250 (TDK InvenSense data sheet), {setting}.
[accelerometer]
range = {range}  # m/s^2: 8 g. ASSUMPTION: of the four ranges, 2 to 16 g
resolution = {resolution}  # m/s^2. Data sheet: 16 bits over both sides of the range
noise_density = {noise}  # m/s^2/Hz^0.5. Data sheet: 300 ug/Hz^0.5
{bandwidth}delay = {late}  # s. ASSUMPTION
mount = {mount}  # ASSUMPTION: {place}

# The hand of Fu and Cavusoglu 2012. ASSUMPTION: {times} times as heavy, damped and stiff.
[hand]
{hand}
[hand.grip]
{grip}
[hand.force]  # ASSUMPTION: pressed with so much (the motor gives 1.5 N for long, 6.9 N at its peak)
kind = "constant"
value = {push}  # N

[wall]
position = -0.002  # m
stiffness = 5000.0  # N/m
{filtered}
[acceleration]
source = "accelerometer"
"""
_PLACES = {"motor": "the near side, that of the rotor", "tip": "the motor's body, which moves with the link"}


def file_text(setup: Setup) -> str:
    """Returns the scene file of a setup, its numbers to six digits."""
    scene = setup.scene(5000.0, [])
    drive, unit, hand = scene["transmission"], scene["accelerometer"], scene["hand"]
    bandwidth = f"bandwidth = {_six(unit['bandwidth'])}  # Hz. ASSUMPTION\n" if "bandwidth" in unit else ""
    cutoff = scene.get("velocity", {}).get("cutoff")
    return _TEXT.format(
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
