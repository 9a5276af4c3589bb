"""The XML of an FMU: what its importer reads of variables, units and steps, and how to compile its sources."""

from __future__ import annotations

import re
from xml.sax.saxutils import quoteattr

from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.tools.fmu.variables import Variable, step_count

# Every unit of a variable as Modelica spells it, with its exponents of the base units.
UNITS = {
    "s": ("s", 's="1"'),
    "m": ("m", 'm="1"'),
    "m/s^2": ("m/s2", 'm="1" s="-2"'),
    "kg": ("kg", 'kg="1"'),
    "N": ("N", 'kg="1" m="1" s="-2"'),
    "N/m": ("N/m", 'kg="1" s="-2"'),
    "N s/m": ("N.s/m", 'kg="1" s="-1"'),
}
_VARIABILITY = {"independent": "continuous", "output": "discrete", "input": "continuous", "parameter": "tunable"}
# Control characters that no XML can hold.
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_MODEL = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName={title} instantiationToken="{token}" generationTool="haploop"
  description="The controller of a haptic loop: virtual wall, dissipation elements, estimators and delay"
  variableNamingConvention="flat">
  <CoSimulation modelIdentifier="{identifier}" canGetAndSetFMUState="true" canHandleVariableCommunicationStepSize="true"
    fixedInternalStepSize="{step}"/>
  <UnitDefinitions>{units}
  </UnitDefinitions>
  <LogCategories>
    <Category name="logStatusError" description="what was refused, and why"/>
  </LogCategories>
  <DefaultExperiment startTime="0" stopTime="{stop}" stepSize="{step}"/>
  <ModelVariables>{variables}
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="1"{dependencies}/>
    <InitialUnknown valueReference="1"{dependencies}/>
  </ModelStructure>
</fmiModelDescription>
"""
_UNIT = '\n    <Unit name="{}"><BaseUnit {}/></Unit>'
_VARIABLE = """
    <Float64 name="{name}" valueReference="{at}" causality="{causality}" variability="{variability}" unit="{unit}"
      description="{about}"{limits}/>"""
# The file with which importers compile the sources for other machines.
BUILD = """<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0">
  <BuildConfiguration modelIdentifier="{identifier}">
    <SourceFileSet language="C99" compilerOptions="-ffp-contract=off">
      <SourceFile name="fmi3.c"/>
    </SourceFileSet>
  </BuildConfiguration>
</fmiBuildDescription>
"""


def model_description(scene: Scene, variables: list[Variable], identifier: str, token: str) -> str:
    """Returns ``modelDescription.xml``."""
    time = Timebase.from_scene(scene)
    return _MODEL.format(
        title=quoteattr(_NO_XML.sub("\ufffd", scene.title)),
        token=token,
        identifier=identifier,
        step=step_count(time) / time.plant_rate,
        stop=float(scene.duration),
        units="".join(_UNIT.format(*UNITS[unit]) for unit in dict.fromkeys(each.unit for each in variables)),
        variables="".join(_variable(at, each) for at, each in enumerate(variables)),
        # A command that is already on its way does not depend on the present position.
        dependencies=' dependencies=""' if time.delay_steps else "",
    )


def _variable(at: int, of: Variable) -> str:
    """Returns one variable; inputs and parameters have bounds and a value at the start."""
    limits, (least, most) = "", of.bounds
    if of.causality in ("input", "parameter"):
        limits = f' min="{least!r}" max="{most!r}" start="{float(of.start)!r}"'
    named = {"name": of.name, "causality": of.causality, "variability": _VARIABILITY[of.causality], "about": of.about}
    return _VARIABLE.format(at=at, unit=UNITS[of.unit][0], limits=limits, **named)
