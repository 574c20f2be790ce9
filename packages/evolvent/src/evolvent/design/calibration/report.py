"""What is shown of a calibration: text, figure, files and report page."""

from __future__ import annotations

import json
import pathlib
from typing import Any

import numpy as np

from evolvent import cases
from evolvent.design.calibration.fit import Calibration
from evolvent_base import files, pages
from evolvent_base.figures import Figure, Line, Panel

#: Correlations that are named in the text.
STRONG = 0.95
#: Heads of the columns of `rows`.
HEADS = ("parameter", "fitted", "standard error", "start")
#: Number of residuals from which their correlation is looked at.
MANY = 10


def rows(found: Calibration) -> list[tuple[str, str, str, str]]:
    """Key, fitted value, standard error and value at the start of every parameter."""
    table = []
    for p, value, error in zip(found.parameters, found.values, found.errors, strict=True):
        unit = f" {p.unit}" if p.unit else ""
        digits = max(2, int(np.ceil(np.log10(abs(value) / error))) + 2) if error > 0.0 and value != 0.0 else 6
        table.append((p.key, f"{value:.{min(digits, 12)}g}{unit}", f"{error:.2g}{unit}", f"{p.start:.6g}{unit}"))
    return table


def text(found: Calibration) -> str:
    """The result as lines for the screen."""
    table = [HEADS, *rows(found)]
    widths = [max(len(row[k]) for row in table) for k in range(4)]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table]
    lines += ["", *summary(found)]
    return "\n".join(lines)


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
    r = found.residuals
    following = float(r[1:] @ r[:-1] / (r @ r)) if r.size >= MANY and np.any(r) else 0.0
    if following > 2.0 / np.sqrt(r.size):
        lines.append(
            f"residuals follow one another (correlation {following:.2f} from one value to the next): the model lacks "
            f"something, and standard errors are too small"
        )
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


def write(found: Calibration, folder: pathlib.Path) -> list[str]:
    """Write files of a calibration; returns their names."""
    from evolvent_base import plots

    content: dict[str, Any] = {
        "source": found.source,
        "model": found.model,
        "derivatives": found.derivatives,
        "parameters": [
            {
                "key": p.key,
                "value": float(v),
                "standard_error": float(e),
                "of_integration": float(i),
                "start": p.start,
                "unit": p.unit,
            }
            for p, v, e, i in zip(found.parameters, found.values, found.errors, found.integration, strict=True)
        ],
        "correlation": found.correlation.tolist(),
        "rms": found.rms,
        "integration": found.accuracy,
        "references": {label: other.rms for label, other in found.references.items()},
        "series": [
            {
                "name": s.name,
                "unit": s.unit,
                "labels": list(s.labels),
                "measured": s.values.tolist(),
                "modelled": m.tolist(),
            }
            for s, m in zip(found.series, found.modelled, strict=True)
        ],
    }
    texts = {
        "calibration.json": json.dumps(content, indent=1),
        "case.yaml": cases.to_yaml(cases.load(dict(found.case))),
        "report.html": page(found),
    }
    for name, body in texts.items():
        files.write_file(str(folder / name), body)
    plots.save(figure(found), str(folder / "calibration.png"))
    return ["report.html", "calibration.png", "calibration.json", "case.yaml"]


def page(found: Calibration) -> str:
    """The report as one HTML page that needs nothing else."""
    from evolvent.exports.figure_pictures import figure_picture

    names = [p.key for p in found.parameters]
    return pages.render(
        "calibration.html",
        title=f"Calibration: {found.case['system'].replace('-', ' ')}",
        parameters=rows(found),
        summary=summary(found),
        residuals=figure_picture(figure(found)),
        names=names,
        correlation=[
            (name, *(f"{c:.3f}" for c in row)) for name, row in zip(names, found.correlation.tolist(), strict=True)
        ],
        values=[
            (label, f"{measured:.6g} {one.unit}", f"{model:.6g} {one.unit}", f"{model - measured:.3g} {one.unit}")
            for one, modelled in zip(found.series, found.modelled, strict=True)
            for label, measured, model in zip(one.labels, one.values, modelled, strict=True)
        ],
        case=cases.to_yaml(cases.load(dict(found.case))),
    )
