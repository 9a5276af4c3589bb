"""The XML of an FMU: what its importer reads of variables, units and steps, and how to compile its sources."""

from __future__ import annotations

import re
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.tools.fmu.variables import Variable, step_count

# Every unit of a variable as Modelica spells it, with its exponents of the base units.
UNITS = {
    "s": ("s", {"s": 1}),
    "m": ("m", {"m": 1}),
    "m/s^2": ("m/s2", {"m": 1, "s": -2}),
    "kg": ("kg", {"kg": 1}),
    "N": ("N", {"kg": 1, "m": 1, "s": -2}),
    "N/m": ("N/m", {"kg": 1, "s": -2}),
    "N s/m": ("N.s/m", {"kg": 1, "s": -1}),
}
_VARIABILITY = {"independent": "continuous", "output": "discrete", "input": "continuous", "parameter": "tunable"}
# Control characters that no XML can hold.
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def model_description(scene: Scene, variables: list[Variable], identifier: str, token: str) -> str:
    """Returns ``modelDescription.xml``."""
    time = Timebase.from_scene(scene)
    root = Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=_NO_XML.sub("\ufffd", scene.title),
        instantiationToken=token,
        description="The controller of a haptic loop: virtual wall, dissipation elements, estimators and delay",
        generationTool="haploop",
        variableNamingConvention="flat",
    )
    step = repr(step_count(time) / time.plant_rate)
    SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        canGetAndSetFMUState="true",
        canHandleVariableCommunicationStepSize="true",
        fixedInternalStepSize=step,
    )
    units = SubElement(root, "UnitDefinitions")
    for unit in dict.fromkeys(variable.unit for variable in variables):
        name, exponents = UNITS[unit]
        base = {key: str(power) for key, power in exponents.items()}
        SubElement(SubElement(units, "Unit", name=name), "BaseUnit", base)
    categories = SubElement(root, "LogCategories")
    SubElement(categories, "Category", name="logStatusError", description="what was refused, and why")
    SubElement(root, "DefaultExperiment", startTime="0", stopTime=repr(float(scene.duration)), stepSize=step)
    listed = SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        _add_variable(listed, reference, variable)
    structure = SubElement(root, "ModelStructure")
    # A command that is on its way does not depend on the position of now.
    independent = {"dependencies": ""} if time.delay_steps else {}
    for kind in ("Output", "InitialUnknown"):
        SubElement(structure, kind, independent, valueReference="1")
    return _xml(root)


def _add_variable(listed: Element, reference: int, variable: Variable) -> None:
    """Adds one variable; inputs and parameters have bounds and start values."""
    entry = SubElement(
        listed,
        "Float64",
        name=variable.name,
        valueReference=str(reference),
        causality=variable.causality,
        variability=_VARIABILITY[variable.causality],
        description=variable.about,
        unit=UNITS[variable.unit][0],
    )
    if variable.causality in ("input", "parameter"):
        least, most = variable.bounds
        entry.attrib |= {"min": repr(least), "max": repr(most), "start": repr(float(variable.start))}


def build_description(identifier: str) -> str:
    """Returns ``buildDescription.xml``, by which importers compile the sources for other machines."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    listed = SubElement(configuration, "SourceFileSet", language="C99", compilerOptions="-ffp-contract=off")
    SubElement(listed, "SourceFile", name="fmi3.c")
    return _xml(root)


def _xml(root: Element) -> str:
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"
