"""Variables of a unit: inputs on bodies, results of parts, and numeric keys of the case."""

from __future__ import annotations

import hashlib
import json
import re
import uuid
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent import cases
from evolvent.analysis.stepper import Stepper
from evolvent.analysis.stepping import ResultAddress
from evolvent_base import __version__, schema, units
from evolvent_base.errors import InputError

#: Results that are outputs unless others are named: of bodies, and of point masses.
OF_BODIES, OF_POINTS = ("position", "attitude", "velocity", "rate"), ("position", "velocity")
#: What acts on a body that is an input: name, unit, meaning.
_WRENCH = (
    ("applied_force", "N", "force at the origin of {!r}, inertial axes"),
    ("applied_torque", "N m", "torque on {!r}, inertial axes"),
)
#: Sections of a case, and keys, that are no parameters: a unit's start and stop times are those of the importer.
_NO_PARAMETERS = ("output", "equilibrium", "modes", "simulate.until", "simulate.every", "solver.duration")


class Variable(NamedTuple):
    """A variable of a unit, a number.

    Attributes
    ----------
    name : str; of an output the name of the result, of a parameter the key of the case
    causality : {"independent", "input", "output", "parameter"}
    unit : str, SI, '' for none
    description : str
    start : float; None of an output and of the time
    address : where an output is found
    """

    name: str
    causality: str
    unit: str
    description: str
    start: float | None = None
    address: ResultAddress | None = None


class Contents(NamedTuple):
    """What a unit is made of.

    Attributes
    ----------
    title : str
    case : str, YAML
    inputs : names of bodies
    variables : sequence of Variable; its index is a variable's value reference
    duration, step : float, s, of the default experiment
    """

    title: str
    case: str
    inputs: Sequence[str]
    variables: Sequence[Variable]
    duration: float
    step: float

    def data(self) -> dict[str, Any]:
        """What the worker reads."""
        found = {
            "version": __version__,
            "inputs": list(self.inputs),
            "variables": [
                {"name": v.name, "causality": v.causality, "start": v.start, "address": v.address}
                for v in self.variables
            ],
        }
        return found | {"token": token(self.case, found)}


def token(case: str, data: Mapping[str, Any]) -> str:
    """The instantiation token: a hash of the case and of what the worker reads."""
    text = json.dumps([case, data], sort_keys=True)
    return f"{{{uuid.UUID(bytes=hashlib.sha256(text.encode()).digest()[:16])}}}"


def contents(case: Any, overrides: Mapping[str, Any], inputs: Sequence[str], outputs: Sequence[str]) -> Contents:
    """The unit of a case.

    Parameters
    ----------
    case, overrides : as of `evolvent.run`
    inputs : names of bodies
    outputs : names of results, beside those of bodies and point masses

    Raises
    ------
    InputError
        For a case that cannot be stepped from outside, and names that are not known.
    """
    loaded = cases.load(case, overrides)
    source = cases.to_yaml(loaded)
    content = cases.parse_yaml(source, "the case")
    stepper = Stepper.of_case(content, inputs=inputs)
    variables = [Variable("time", "independent", "s", "time")]
    for body in stepper.inputs:
        for name, unit, text in _WRENCH:
            variables += [Variable(f"{body}.{name}.{a}", "input", unit, text.format(body), 0.0) for a in "xyz"]
    names = [*_results_of_parts(stepper), *(one for name in outputs for one in _components(stepper, name))]
    if not names:
        raise InputError(
            "the case has no bodies and no point masses; name results by --outputs, such as boom.tip.position"
        )
    for name in dict.fromkeys(names):
        unit, text = stepper.describe(name)
        variables.append(Variable(name, "output", "" if unit == "1" else unit, text, address=stepper.address(name)))
    variables += parameters(loaded, content)
    settings = cases.system(loaded.system).settings(loaded)
    duration = stepper.until
    return Contents(
        title=getattr(loaded, "title", "") or loaded.system,
        case=source,
        inputs=stepper.inputs,
        variables=variables,
        duration=duration,
        step=float(settings.get("every") or duration / 500.0),
    )


def _results_of_parts(stepper: Stepper) -> Iterator[str]:
    """Names of the results of bodies and point masses, component by component."""
    known = stepper.results()
    for part, (family, _) in stepper.assembly.names.items():
        for name in {"bodies": OF_BODIES, "points": OF_POINTS}.get(family, ()):
            if f"{part}.{name}" in known:
                yield from _components(stepper, f"{part}.{name}")


def _components(stepper: Stepper, name: str) -> list[str]:
    """Names of the numbers that a result consists of."""
    found = stepper.result(name)
    if not isinstance(found, np.ndarray):
        return [name]
    letters = {3: "xyz", 4: "wxyz"}.get(found.size, "")
    names = [f"{name}.{letter}" for letter in letters]
    try:
        for one in names:
            stepper.result(one)
    except InputError:
        names = []
    if not names:
        part, _, rest = name.partition(".")
        raise InputError(
            f"--outputs names {name!r}, which has {found.size} values; name one entry, such as '{part}[0].{rest}'"
        )
    return names


def parameters(case: schema.Section, content: Mapping[str, Any]) -> Iterator[Variable]:
    """Numeric keys of a case.

    Parameters
    ----------
    case : Section
    content : mapping, the case as its file holds it, defaults included
    """
    for key, value in _leaves(content, ""):
        if any(key == one or key.startswith(f"{one}.") for one in _NO_PARAMETERS):
            continue
        quantity, text = _quantity(type(case), key, content)
        number = None if quantity is None else _number(quantity, value)
        if quantity is None or number is None or (not quantity.unit and re.search(r"\.\d+\.\d+$", key)):
            continue  # columns of tables have units of their own
        try:
            same = cases.load(content, {key: number}) == case
        except InputError:
            same = False
        if same:
            yield Variable(key, "parameter", quantity.unit, text, number)


def _leaves(content: Any, before: str) -> Iterator[tuple[str, Any]]:
    """Dotted keys and values of nested mappings and lists."""
    entries = content.items() if isinstance(content, Mapping) else enumerate(content)
    for key, value in entries:
        if isinstance(value, (Mapping, list)):
            yield from _leaves(value, f"{before}{key}.")
        elif not isinstance(value, bool):
            yield f"{before}{key}", value


def _quantity(kind: type[schema.Section], key: str, content: Any) -> tuple[units.Quantity | None, str]:
    """What reads the number at a key, None for none, and what it means."""
    try:
        found = schema.locate(kind, key, content)
    except InputError:
        return None, ""
    marks = (getattr(mark, "quantity", mark) for _, own in found.types for mark in own)
    return next((mark for mark in marks if isinstance(mark, units.Quantity)), None), found.text


def _number(quantity: units.Quantity, value: Any) -> float | None:
    """A value of a case file in SI units; None of what is no number."""
    try:
        found = quantity.read(value)
    except ValueError:
        return None
    return found if isinstance(found, float) else None
