"""A measurement on a torsion rig as an answer."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np

from evolvent_base import __version__, answer as an, texts
from evolvent_base.figures import Figure, Line, Panel
from evolvent_base.showing import Shown
from evolvent_massprops.certificate import budget, result_table
from evolvent_massprops.estimates import Output, Share, WithCovariance
from evolvent_massprops.rounding import rounded
from evolvent_massprops.torsion_rig.adjustment import Fit, Judged
from evolvent_massprops.torsion_rig.equations import Moments, directions
from evolvent_massprops.torsion_rig.keys import OnRig


@dataclasses.dataclass(frozen=True, eq=False)
class RigProperties(WithCovariance, Shown):
    """What a torsion rig gives.

    Attributes
    ----------
    description : OnRig
    moments, centre : Judged, of orientations in the plane, and of lines, pendulums and moments about the normal; None
        where nothing of it was measured
    outputs : (p,) Output
    values, covariance : (p,), (p, p)
    shares : budget
    dof, factor : (p,) degrees of freedom and coverage factors
    warnings : sentences; those on wrong records come first
    notes : sentences
    """

    description: OnRig
    moments: Judged | None
    centre: Judged | None
    outputs: tuple[Output, ...]
    values: np.ndarray
    covariance: np.ndarray
    shares: tuple[Share, ...]
    dof: np.ndarray
    factor: np.ndarray
    warnings: tuple[str, ...]
    notes: tuple[str, ...]

    named = "mass properties"
    has_uncertainties = True

    @property
    def interval(self) -> np.ndarray:
        """(2, p) coverage interval."""
        return np.array([self.values - self.expanded, self.values + self.expanded])

    @property
    def cautions(self) -> tuple[str, ...]:
        """The warnings."""
        return self.warnings

    @property
    def wrong(self) -> tuple[str, ...]:
        """Names of the records that were called wrong, and left out."""
        judged = [one for one in (self.moments, self.centre) if one is not None]
        return tuple(dict.fromkeys(one.every.equations[k].name for one in judged for k in one.wrong))

    def place(self, key: str) -> int:
        """Number of an output, such as 'Ixx'."""
        return [one.key for one in self.outputs].index(key)

    def __getitem__(self, key: str) -> float:
        """Value of an output, such as 'Ixx'."""
        return float(self.values[self.place(key)])

    def answer(self) -> an.Answer:
        """Values with their uncertainties, records with what the others predict, budget."""
        return answer_of(self)


def answer_of(found: RigProperties) -> an.Answer:
    """Values with their uncertainties, records with what the others predict, budget."""
    given = found.description
    judged = [one for one in (found.moments, found.centre) if one is not None]
    facts = [
        (o.key, f"{rounded(value, U)} ± {rounded(U, U)} {o.unit}")
        for o, value, U in zip(found.outputs, found.values, found.expanded, strict=True)
    ]
    rows = [("part", given.body.name), ("stand", "torsion rig")]
    rows += [("remarks", given.remarks)] if given.remarks else []
    return an.Answer(
        title=given.title or f"Mass properties of {given.body.name}",
        about="Record of a measurement of mass properties",
        facts=facts,
        warnings=found.warnings,
        notes=found.notes,
        sections=[
            an.Section(title="Result", blocks=[result_table(found)]),
            *(an.Section(title="", blocks=[_records(one)]) for one in judged),
            *(an.Section(title="", blocks=[_with_and_without(one)]) for one in judged if one.suspects),
            an.Section(title="Measurement", blocks=[an.Table(heads=(), rows=rows, words=2)], level=an.PAGE),
            budget(found),
            *([an.Section(title="", blocks=[_figure(found.moments)])] if _drawn(found.moments) else []),
            an.Section(title="Method", blocks=[an.Points(_METHOD, numbered=True)], level=an.PAGE),
            an.Section(title="", blocks=["Measured by, date", "Checked by, date"], level=an.PAGE, kind="sign"),
            an.Section(title="Numbers in full", blocks=lambda: [an.Listing(_numbers(found))], level=an.PAGE),
            an.Section(
                title="Description of the stand, as used", level=an.PAGE,
                blocks=lambda: [an.Listing(texts.dump(given.model_dump(mode="json", exclude_none=True)))],
            ),
        ],
        made=f"evolvent {__version__}, evolvent identify", style="certificate.css",
    )  # fmt: skip


_METHOD = (
    "Stiffness of the bar: k = I (2 π / T)², with I of a round rod by mass, diameter and length.",
    "Moment about the bar's line: k (T / 2 π)², with periods without damping; planar tensor by "
    "J(φ) = Ixx cos² φ - 2 Ixz sin φ cos φ + Izz sin² φ; centre of mass by x sin φ + z cos φ = distance.",
    "Pendulums: I = m g l / ω² - m l² about the centre of mass.",
    "More records than unknowns: least squares, weighted by the uncertainties. A record that deviates from what the "
    "others predict by more than the critical value (Baarda's test, with Bonferroni's correction) raises an alarm; it "
    "is called wrong where every other explanation is a hundred times less likely.",
    "Uncertainty: law of propagation (JCGM 100:2008) with the sensitivities of the whole evaluation.",
)


def _records(judged: Judged) -> an.Table:
    """Records beside what the others predict."""
    one = judged.accepted
    deviation, std = one.left_out
    suspects = {k for group in judged.suspects for k in group}
    rows = []
    for k, e in enumerate(one.equations):
        scale, unit = (1e3, "mm") if e.kind == "line" else (1.0, e.unit)
        measured = f"{scale * one.measured[k]:.5g} {unit}" if e.kind != "pendulum" else "-"
        own = scale * math.sqrt(one.variance[k, k])
        off = relative = times = "-"
        if np.isfinite(deviation[k]):
            off, times = f"{scale * deviation[k]:+.3g}", f"{deviation[k] / std[k]:+.1f}"
            relative = f"{deviation[k] / one.measured[k]:+.2%}" if e.kind in ("moment", "normal") else "-"
        verdict = "wrong, left out" if k in judged.wrong else "suspect" if k in suspects else "used"
        rows.append((e.name, _angle(one, e.name), measured, f"{own:.2g}", off, relative, times, verdict))
    title = "orientations" if isinstance(one.of, Moments) else "lines and pendulums"
    heads = ("", "angle deg", "measured", "u", "less what the others give", "of it", "over u", "")
    return an.Table(heads=heads, rows=rows, title=title)


def _angle(one: Fit, name: str) -> str:
    at = one.of.inputs.place.get(f"{name}.angle")
    return "-" if at is None else f"{math.degrees(one.of.inputs.listed[at].value):.1f}"


def _with_and_without(judged: Judged) -> an.Table:
    """Parameters of all records, and without each set of suspects."""
    one = judged.every
    rows = [("all records", *(_shown(one, k) for k in range(len(one.values))), f"{one.scatter:.3g}")]
    for out, fit in zip(judged.suspects, judged.alternatives, strict=True):
        names = " and ".join(one.equations[k].name for k in out)
        scatter = f"{fit.scatter:.3g}" if fit.redundancy > 0 else "-"
        rows.append((f"without {names}", *(_shown(fit, k) for k in range(len(fit.values))), scatter))
    units = {"x": "m", "z": "m"}
    heads = ("", *(f"{key} {units.get(key, 'kg m²')}" for key in one.of.parameters), "residuals over u")
    return an.Table(heads=heads, rows=rows, title="with and without")


def _shown(one: Fit, k: int) -> str:
    return rounded(float(one.values[k]), math.sqrt(one.own_covariance[k, k]))


def _drawn(judged: Judged | None) -> bool:
    return judged is not None and isinstance(judged.every.of, Moments) and not judged.every.of.round


def _figure(judged: Judged | None) -> Figure:
    """Moments over the angle."""
    assert judged is not None
    return Figure(name="moments", title="Moment about the bar's line", panels=[moments_over_angle(judged)], columns=1)


def moments_over_angle(judged: Judged) -> Panel:
    """Planar tensor and orientations over the angle of the bar's line, modulo 180 degrees.

    Parameters
    ----------
    judged : Judged, of orientations of a part that is not round
    """
    one = judged.accepted
    over = np.linspace(0.0, np.pi, 181)
    place = one.of.inputs.place
    angles = np.array([one.of.inputs.listed[place[f"{e.name}.angle"]].value for e in one.equations])
    angles = np.degrees(angles) % 180.0
    lines = [Line(x=np.degrees(over), y=directions(over) @ one.values, label="planar tensor")]
    lines.append(Line(x=angles[one.used], y=one.measured[one.used], label="orientations", style="", marker="o"))
    if not one.used.all():
        out = ~one.used
        lines.append(Line(x=angles[out], y=one.measured[out], label="left out", style="", marker="x"))
    return Panel(x_label="angle of the bar's line, deg", y_label="moment, kg m²", lines=lines)


def _numbers(found: RigProperties) -> str:
    """Values and covariance with all digits, one JSON value a line."""
    numbers = {
        "outputs": [o.key for o in found.outputs], "units": [o.unit for o in found.outputs],
        "values": found.values.tolist(), "covariance": found.covariance.tolist(),
        "coverage_factor": found.factor.tolist(), "wrong": list(found.wrong), "version": __version__,
    }  # fmt: skip
    return "\n".join(f"{k}: {json.dumps(v, ensure_ascii=False)}" for k, v in numbers.items())
