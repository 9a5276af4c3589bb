"""A plant made of any FMU of FMI 3.0 with one force in and one position out, for co-simulation or model exchange.

    haploop run scene.toml --node plant="python examples/fmu_plant.py device.fmu --force F --position x --velocity v"

Needs fmpy (pip install 'haploop[fmu]' installs it), pyzmq and msgpack. The FMU is the device with the hand's mass,
damper and spring; the force of the hand's muscles, if the scene has one, is added to the force. An element of an array
is named by its number, counted from 1, as in y[2]. Without --velocity, the velocity is the difference of positions over
a plant step, which will show in the books. A step of co-simulation is a plant step of the scene; an FMU for model
exchange is moved by one step of Runge-Kutta 4.
"""

import argparse
import math
from ctypes import c_double
from pathlib import Path
from tempfile import TemporaryDirectory

from fmpy import extract, read_model_description
from fmpy.fmi3 import FMU3Model, FMU3Slave
from hand import hand_force
from seat import take_seat


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fmu", help="file of the FMU")
    parser.add_argument("--force", default="force", metavar="NAME", help="input, N, along +x [force]")
    parser.add_argument("--position", default="position", metavar="NAME", help="output, m [position]")
    parser.add_argument("--velocity", metavar="NAME", help="output, m/s")
    parser.add_argument("--interface", choices=("cs", "me"), help="co-simulation or model exchange [cs]")
    parser.add_argument("--set", action="append", default=[], type=assignment, metavar="NAME=VALUE[,VALUE ...]")
    parser.add_argument("--state-space", action="store_true", help="the Reference FMUs' StateSpace, set to the scene")
    options, rest = parser.parse_known_args()
    if len(rest) != 1:  # for take_seat
        parser.error(f"One more word was expected, from haploop run --node or the file of --external, not {rest}.")
    seat = take_seat(f"FMU {Path(options.fmu).name}", "3.0")
    with TemporaryDirectory() as folder:
        seat.run(*device(seat.scene, seat.step_s, options, folder))


def device(scene, step_s, options, folder):
    """Returns the function of a plant step, and position and velocity at the start; unpacks the FMU in ``folder``."""
    values, bias = dict(options.set), 0.0
    if options.state_space:
        options.force, options.position, options.velocity = "u[1]", "y[1]", "y[2]"
        system, bias = state_space(scene)
        values = system | values
    description = read_model_description(options.fmu)
    if not description.fmiVersion.startswith("3."):
        raise SystemExit(f"An FMU of FMI 3.0 was expected, but {options.fmu} is of {description.fmiVersion}.")
    kind = options.interface or ("cs" if description.coSimulation else "me")
    found = description.coSimulation if kind == "cs" else description.modelExchange
    if found is None:
        raise SystemExit(f"{options.fmu} is not for {'co-simulation' if kind == 'cs' else 'model exchange'}.")
    unit = (CoSimulation if kind == "cs" else ModelExchange)(
        description, found.modelIdentifier, options, values, folder
    )
    tau = hand_force(scene)
    now, before = 0, unit.position()

    def pull(force):
        return lambda t: force + bias + tau(t)

    def step(force):
        nonlocal now, before
        unit.step(now * step_s, step_s, pull(force))
        now += 1
        x = unit.position()
        v, before = unit.velocity() if options.velocity else (x - before) / step_s, x
        return x, v

    return step, before, unit.velocity() if options.velocity else scene["device"].get("velocity", 0.0)


def assignment(text):
    name, _, values = text.partition("=")
    return name, [float(value) for value in values.split(",")]


def state_space(scene):
    """Returns the matrices of three states, two of them used, for m x'' + b x' + k (x - rest) = u; and k * rest."""
    plant, hand = scene["device"], scene.get("hand") or {}
    m, b = (plant[key] + hand.get(key, 0.0) for key in ("mass", "damping"))
    k, x, v = hand.get("stiffness", 0.0), plant.get("position", 0.0), plant.get("velocity", 0.0)
    system = {"A": [0, 1, 0, -k / m, -b / m, 0, 0, 0, 0], "B": [0, 0, 0, 1 / m, 0, 0, 0, 0, 0], "D": [0] * 9}
    return system | {"C": [1, 0, 0, 0, 1, 0, 0, 0, 1], "x0": [x, v, 0]}, k * hand.get("rest", 0.0)


class Unit:
    """An FMU accessed by the names of its variables; the constructor completes its initialization."""

    def __init__(self, made, description, identifier, options, values, folder):
        self._variables = {variable.name: variable for variable in description.modelVariables}
        self._options = options
        self.fmu = made(
            guid=description.guid or description.instantiationToken,
            unzipDirectory=extract(options.fmu, unzipdir=folder),
            modelIdentifier=identifier,
            instanceName="plant",
        )
        self.fmu.instantiate()
        for name, given in values.items():
            self.fmu.setFloat64([self._place(name)[0]], given)
        self._force, self._at, size = self._place(options.force)
        self._inputs = [0.0] * size
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def _place(self, name):
        """Returns reference, index and size of a variable; ``name`` may be an element of an array."""
        base, _, number = (name, "", "") if name in self._variables else name.removesuffix("]").partition("[")
        if base not in self._variables:
            raise SystemExit(f"The FMU has no variable {name}; it has {', '.join(self._variables)}.")
        variable = self._variables[base]
        size, index = math.prod(variable.shape or (1,)), int(number or 1) - 1
        if not 0 <= index < size:
            raise SystemExit(f"{name} was requested, but {base} has {size} elements, counted from 1.")
        return variable.valueReference, index, size

    def _get(self, name):
        reference, index, size = self._place(name)
        return self.fmu.getFloat64([reference], nValues=size)[index]

    def push(self, force):
        self._inputs[self._at] = force
        self.fmu.setFloat64([self._force], self._inputs)

    def position(self):
        return self._get(self._options.position)

    def velocity(self):
        return self._get(self._options.velocity)


class CoSimulation(Unit):
    """An FMU with its own solver, driven by the mean of the forces at both ends of a step."""

    def __init__(self, *about):
        super().__init__(FMU3Slave, *about)

    def step(self, t, h, pull):
        self.push(0.5 * (pull(t) + pull(t + h)))
        _, ended, _, _ = self.fmu.doStep(t, h)
        if ended:
            raise RuntimeError(f"The FMU ended the simulation at {t:g} s.")


class ModelExchange(Unit):
    """An FMU that gives rates, moved by Runge-Kutta 4; its events are handled at the ends of plant steps."""

    def __init__(self, *about):
        super().__init__(FMU3Model, *about)
        self._n, self._indicators = self.fmu.getNumberOfContinuousStates(), self.fmu.getNumberOfEventIndicators()
        self._next = math.inf
        self._handle_events()
        self._signs = self._sides()

    def _handle_events(self):
        again = True
        while again:
            again, ended, _, _, timed, at = self.fmu.updateDiscreteStates()
            self._next = at if timed else math.inf
            if ended:
                raise RuntimeError("The FMU ended the simulation.")
        self.fmu.enterContinuousTimeMode()
        states = (c_double * self._n)()
        self.fmu.getContinuousStates(states, self._n)
        self._states = list(states)

    def _sides(self):
        values = (c_double * self._indicators)()
        if self._indicators:
            self.fmu.getEventIndicators(values, self._indicators)
        return [value > 0.0 for value in values]

    def _rates(self, t, states, force):
        self.fmu.setTime(t)
        self.fmu.setContinuousStates((c_double * self._n)(*states), self._n)
        self.push(force)
        rates = (c_double * self._n)()
        self.fmu.getContinuousStateDerivatives(rates, self._n)
        return rates

    def step(self, t, h, pull):
        def moved(rates, by):
            return [x + by * rate for x, rate in zip(self._states, rates, strict=True)]

        begin, end = pull(t), pull(t + h)
        middle = 0.5 * (begin + end)  # a hand's force is linear over a plant step
        k1 = self._rates(t, self._states, begin)
        k2 = self._rates(t + h / 2, moved(k1, h / 2), middle)
        k3 = self._rates(t + h / 2, moved(k2, h / 2), middle)
        k4 = self._rates(t + h, moved(k3, h), end)
        self._states = moved([(a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4, strict=True)], h)
        self._rates(t + h, self._states, end)
        asked, ended = self.fmu.completedIntegratorStep()
        if ended:
            raise RuntimeError(f"The FMU ended the simulation at {t + h:g} s.")
        sides = self._sides()
        if asked or sides != self._signs or t + h >= self._next:
            self.fmu.enterEventMode()
            self._handle_events()
            sides = self._sides()
        self._signs = sides


if __name__ == "__main__":
    main()
