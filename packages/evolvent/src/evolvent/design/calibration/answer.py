"""A calibration as an answer: fitted parameters, residuals, correlation, a figure and files."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent import cases
from evolvent.design.calibration import uncertainty
from evolvent.results.measurements import Series
from evolvent_base import answer as an
from evolvent_base.figures import Figure, Line, Panel
from evolvent_base.showing import Shown

Array = np.ndarray
#: Correlations that are named in the text.
STRONG = 0.95


def answer_of(found: Calibration) -> an.Answer:
    """What was fitted."""
    names = [p.key for p in found.parameters]
    correlation = [
        (name, *(f"{c:.3f}" for c in row)) for name, row in zip(names, found.correlation.tolist(), strict=True)
    ]
    values = [
        (label, f"{measured:.6g} {one.unit}", f"{model:.6g} {one.unit}", f"{model - measured:.3g} {one.unit}")
        for one, modelled in zip(found.series, found.modelled, strict=True)
        for label, measured, model in zip(one.labels, one.values, modelled, strict=True)
    ]
    tables = {
        "Correlation": an.Table(heads=("", *names), rows=correlation),
        "Values": an.Table(heads=("", "measured", "model", "difference"), rows=values),
    }
    case = cases.to_yaml(cases.load(dict(found.case)))
    return an.Answer(
        title=f"Calibration of {found.case['system'].replace('-', ' ')} by {found.source}",
        sections=[
            an.Section(title="Parameters", blocks=[parameters(found), *summary(found), figure(found)]),
            *(an.Section(title=name, blocks=[table], level=an.PAGE) for name, table in tables.items()),
            an.Section(title="Case with the fitted values", blocks=[an.Listing(case)], level=an.PAGE),
        ],
        files={"calibration.json": lambda: an.as_json(to_dict(found)), "case.yaml": lambda: case},
    )


def parameters(found: Calibration) -> an.Table:
    """Key, fitted value, standard error and value at the start of every parameter."""
    table = []
    for p, value, error in zip(found.parameters, found.values, found.errors, strict=True):
        unit = f" {p.unit}" if p.unit else ""
        digits = max(2, int(np.ceil(np.log10(abs(value) / error))) + 2) if error > 0.0 and value != 0.0 else 6
        table.append((p.key, f"{value:.{min(digits, 12)}g}{unit}", f"{error:.2g}{unit}", f"{p.start:.6g}{unit}"))
    return an.Table(heads=("parameter", "fitted", "standard error", "start"), rows=table)


def summary(found: Calibration) -> list[str]:
    """Sentences on the residuals, other formulas and correlations."""
    unit = found.series[0].unit
    n, p = found.residuals.size, len(found.parameters)
    worst = int(np.argmax(np.abs(found.residuals)))
    labels = [label for one in found.series for label in one.labels]
    lines = [
        f"residuals: root mean square {found.rms:.3g} {unit}, largest {abs(found.residuals[worst]):.3g} {unit} "
        f"({labels[worst]}); {n} values, {p} parameters, fitted by {found.model}, "
        f"derivatives by {found.derivatives}"
    ]
    if found.accuracy:
        share = max((i / e for i, e in zip(found.integration, found.errors, strict=True) if e > 0.0), default=0.0)
        lines.append(f"{found.accuracy}" + (f", {100.0 * share:.2g} % of them at most" if share > 0.0 else ""))
    for label, other in found.references.items():
        lines.append(
            f"{label}: root mean square {other.rms:.3g} {unit}, {other.rms / found.rms:.3g} times as large, fitted to "
            f"the same data"
        )
    names = [one.key for one in found.parameters]
    for i in range(p):
        for j in range(i):
            c = found.correlation[i, j]
            if abs(c) > STRONG:
                lines.append(f"correlation of {names[j]} and {names[i]}: {c:.3f}")
    for key, value, error in zip(names, found.values, found.errors, strict=True):
        if error > abs(value):
            lines.append(f"the data do not determine {key}: its standard error exceeds its value")
    following = uncertainty.following([found.residuals])
    lines += [following] if following else []
    lines += [f"evaluations: {found.evaluations} new, {found.reused} kept from before"]
    return lines + [f"note: {note}" for note in found.notes]


def figure(found: Calibration) -> Figure:
    """Measured and modelled values, and residuals, one panel each for every observed variable."""
    panels = []
    for k, (one, modelled) in enumerate(zip(found.series, found.modelled, strict=True)):
        unit = f", {one.unit}" if one.unit else ""
        if one.times is None:
            x, x_label = np.arange(1.0, one.values.size + 1.0), "number of the run in the data"
        else:
            x, x_label = np.asarray(one.times(found.case)), "time of the run, s"
        points: Any = {"x": x, "style": ""}
        values = [
            Line(y=one.values, label="measured", color=0, marker="o", **points),
            Line(y=modelled, label="model", color=1, marker="x", **points),
        ]
        own = "model" if found.references else ""
        residuals = [Line(y=modelled - one.values, label=own, color=1, marker="x", **points)]
        for c, (label, other) in enumerate(found.references.items(), start=2):
            residuals.append(Line(y=other.modelled[k] - one.values, label=label, color=c, marker="+", **points))
        residuals.append(Line(x=x[[0, -1]], y=np.zeros(2), color="grey", width=0.8))
        panels.append(Panel(x_label=x_label, y_label=f"{one.name}{unit}", lines=values))
        panels.append(Panel(x_label=x_label, y_label=f"model minus measured{unit}", lines=residuals))
    return Figure(name="calibration", title="Measured values, model and residuals", panels=panels, height=140.0)


def to_dict(found: Calibration) -> dict[str, Any]:
    """Numbers and texts, as the JSON file has them."""
    of = zip(found.parameters, found.values, found.errors, found.integration, strict=True)
    both = zip(found.series, found.modelled, strict=True)
    return {
        "source": found.source, "model": found.model, "derivatives": found.derivatives,
        "parameters": [
            {"key": p.key, "value": v, "standard_error": e, "of_integration": i, "start": p.start, "unit": p.unit}
            for p, v, e, i in of
        ],
        "correlation": found.correlation, "rms": found.rms, "integration": found.accuracy,
        "references": {label: other.rms for label, other in found.references.items()},
        "series": [
            {"name": s.name, "unit": s.unit, "labels": s.labels, "measured": s.values, "modelled": m} for s, m in both
        ],
    }  # fmt: skip


@dataclasses.dataclass(frozen=True, kw_only=True)
class Parameter:
    """A fitted key of a case: where the fit starts (SI), what is allowed, and what counts as 1."""

    key: str
    unit: str
    start: float
    least: float
    most: float
    scale: float


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Reference:
    """Another formula fitted to the same data: values of every series, and the root mean square of its residuals."""

    modelled: tuple[Array, ...]
    rms: float


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Calibration(Shown):
    """A fit.

    Attributes
    ----------
    parameters : tuple of Parameter
    values, errors : (p,) float, SI, and their errors: standard errors of the data, and `integration`
    integration : (p,) float, SI, by how much values would change with finer integration of the runs
    accuracy : str, a sentence on it; '' of closed forms
    correlation : (p, p) float
    series : tuple of `Series`, as measured
    modelled : of each series the model's values in its unit
    references : mapping, label -> Reference, formulas that the system has beside its model
    residuals : (n,) float, modelled less measured of all series, in their units
    evaluations : int, of which `reused` were read from the folder
    message : str, of the least squares
    notes : what the data do not determine
    case : dict, the content of the case with the fitted values
    source, model : str, file of the data, and what was fitted
    derivatives : str, how they were found: of the discrete solution (`System.sensitivity`), or differences and why
    """

    parameters: tuple[Parameter, ...]
    values: Array
    errors: Array
    integration: Array
    accuracy: str
    correlation: Array
    series: tuple[Series, ...]
    modelled: tuple[Array, ...]
    references: Mapping[str, Reference]
    residuals: Array
    evaluations: int
    reused: int
    message: str
    notes: tuple[str, ...]
    case: Mapping[str, Any]
    source: str
    model: str
    derivatives: str

    named = "calibrations"
    endings = (".json", ".yaml")

    @property
    def rms(self) -> float:
        """Root mean square of the residuals."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    def answer(self) -> an.Answer:
        """Fitted values, residuals with their figure, and files."""
        return answer_of(self)
