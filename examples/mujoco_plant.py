"""A plant made of MuJoCo: a slider, one joint of a small arm, or one joint of a model of your own.

    haploop run scene.toml --node plant="python examples/mujoco_plant.py --integrator rk4"

Needs mujoco, pyzmq and msgpack (pip install 'haploop[mujoco]' installs them). The joint is the device, at
x = radius * angle; the scene's hand (mass, damper, spring, force) is attached to it rigidly. MuJoCo's step is the plant
step of the scene.
"""

import argparse

import mujoco
from hand import hand_force
from seat import take_seat

INTEGRATORS = {name: getattr(mujoco.mjtIntegrator, f"mjINT_{name.upper()}") for name in ("rk4", "euler", "implicit")}
# The device of the scene: a mass on a rail, with its viscous damping.
SLIDER = """<mujoco><worldbody><body>
  <joint name="slider" type="slide" axis="1 0 0" damping="{damping!r}"/>
  <inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/>
</body></worldbody></mujoco>"""
# A forearm that turns about the vertical, with the hand 0.2 m from the elbow: 10 g and 0.1 N s/m as seen at the hand.
ARM = """<mujoco><worldbody><body>
  <joint name="elbow" type="hinge" axis="0 0 1" damping="0.004"/>
  <inertial pos="0.1 0 0" mass="0.03" diaginertia="1e-5 1e-4 1e-4"/>
</body></worldbody></mujoco>"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--integrator", choices=INTEGRATORS, default="rk4")
    parser.add_argument("--device", default="slider", help="slider, arm, or a model's file (MJCF)")
    parser.add_argument("--joint", default="elbow", help="name of the joint of a model")
    parser.add_argument("--radius", type=float, default=0.2, help="distance of the hand from the axis of a hinge, m")
    options, _ = parser.parse_known_args()
    seat = take_seat("MuJoCo", mujoco.__version__)
    try:
        made = device(seat.scene, seat.step_s, options)
    except (ValueError, KeyError) as error:
        seat.fail(f"{options.device} cannot be the device: {error}")
    seat.run(*made)


def device(scene, step_s, options):
    """Returns the function of a plant step, and the position and velocity at the start."""
    joint, radius = ("slider", 1.0) if options.device == "slider" else (options.joint, options.radius)
    if options.device in ("slider", "arm"):
        text = SLIDER.format(**scene["device"]) if options.device == "slider" else ARM
        spec = mujoco.MjSpec.from_string(text)
    else:
        spec = mujoco.MjSpec.from_file(options.device)
    spec.option.timestep, spec.option.integrator = step_s, INTEGRATORS[options.integrator]
    model = spec.compile()
    data = mujoco.MjData(model)
    at, dof = model.joint(joint).qposadr[0], model.joint(joint).dofadr[0]
    hand = scene.get("hand") or {}
    model.dof_armature[dof] += hand.get("mass", 0.0) * radius**2
    damping, stiffness, rest = (hand.get(key, 0.0) for key in ("damping", "stiffness", "rest"))
    start = data.qpos[at]
    model.dof_damping[dof] += damping * radius**2
    if stiffness:
        model.jnt_stiffness[model.joint(joint).id] += stiffness * radius**2
        model.qpos_spring[at] = start + rest / radius
    mujoco.mj_setConst(model, data)
    tau = hand_force(scene)
    data.qpos[at] = start + scene["device"].get("position", 0.0) / radius
    data.qvel[dof] = scene["device"].get("velocity", 0.0) / radius

    def step(force):
        pull = 0.5 * (tau(data.time) + tau(data.time + step_s))
        data.qfrc_applied[dof] = (force + pull) * radius
        mujoco.mj_step(model, data)
        return radius * (data.qpos[at] - start), radius * data.qvel[dof]

    return step, radius * (data.qpos[at] - start), radius * data.qvel[dof]


if __name__ == "__main__":
    main()
