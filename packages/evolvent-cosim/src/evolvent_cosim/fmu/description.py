"""The XML files of a unit: modelDescription.xml and buildDescription.xml."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

from evolvent_base import __version__, units
from evolvent_base.errors import visible
from evolvent_cosim.fmu.contents import Contents, Variable

_SI = {"kilogram": "kg", "meter": "m", "second": "s", "ampere": "A", "kelvin": "K", "radian": "rad"}
_LOG = {
    "logStatusWarning": "output of the worker process",
    "logStatusError": "errors",
    "logStatusFatal": "ended workers",
}


def model_description(contents: Contents, identifier: str) -> bytes:
    """modelDescription.xml."""
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=contents.title,
        instantiationToken=contents.data()["token"],
        description=f"{contents.title}, stepped by evolvent in a separate process",
        generationTool=f"evolvent {__version__}",
        variableNamingConvention="flat",
    )
    ET.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        needsExecutionTool="true",
        canHandleVariableCommunicationStepSize="true",
    )
    _add_units(root, contents.variables)
    categories = ET.SubElement(root, "LogCategories")
    for name, text in _LOG.items():
        ET.SubElement(categories, "Category", name=name, description=text)
    ET.SubElement(
        root, "DefaultExperiment", startTime="0", stopTime=repr(contents.duration), stepSize=repr(contents.step)
    )
    variables = ET.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(contents.variables):
        _add_variable(variables, reference, variable)
    structure = ET.SubElement(root, "ModelStructure")
    outputs = [str(k) for k, v in enumerate(contents.variables) if v.causality == "output"]
    for output in outputs:  # results are those of the last step: an input does not change them before the next
        ET.SubElement(structure, "Output", valueReference=output, dependencies="")
    for output in outputs:
        ET.SubElement(structure, "InitialUnknown", valueReference=output)
    return _text(root)


def build_description(identifier: str, source: str) -> bytes:
    """buildDescription.xml: how an importer compiles the source for a platform that the unit has no library for."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    files = ET.SubElement(configuration, "SourceFileSet", language="C99")
    ET.SubElement(files, "SourceFile", name=source)
    return _text(root)


def _text(root: ET.Element) -> bytes:
    for element in root.iter():
        element.attrib = {key: visible(value) for key, value in element.attrib.items()}
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"


def _add_units(root: ET.Element, variables: Sequence[Variable]) -> None:
    parent = ET.SubElement(root, "UnitDefinitions")
    for unit in sorted({v.unit for v in variables if v.unit}):
        element = ET.SubElement(parent, "Unit", name=unit)
        exponents = base_units(unit)
        if exponents is not None:
            ET.SubElement(element, "BaseUnit", {name: str(power) for name, power in exponents.items()})


def base_units(unit: str) -> Mapping[str, int] | None:
    """Exponents of SI base units and rad in a coherent unit, such as "kg m2 s-1"; None where they are not known."""
    powers = re.sub(r"(?<=[A-Za-z])(-?\d+)", r"^\1", unit)
    found = units.base_exponents(powers)
    if found is None or any(name not in _SI or power != int(power) for name, power in found.items()):
        return None
    return {_SI[name]: int(power) for name, power in found.items()}


def _add_variable(parent: ET.Element, reference: int, variable: Variable) -> None:
    element = ET.SubElement(
        parent,
        "Float64",
        name=" ".join(variable.name.split()),
        valueReference=str(reference),
        causality=variable.causality,
        variability="fixed" if variable.causality == "parameter" else "continuous",
        description=variable.description,
    )
    if variable.unit:
        element.set("unit", variable.unit)
    if variable.start is not None:
        element.set("start", repr(float(variable.start)))
    if variable.causality == "output":
        element.set("initial", "calculated")
