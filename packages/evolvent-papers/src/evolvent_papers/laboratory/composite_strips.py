"""Composite strips at large deflection: clamped, turned about their axis, with a weight at the tip.

Source: measured by Minguet and Dugundji (doi 10.2514/3.25255), as digitized in luizpancini/AeroBeams.jl (MIT licence),
with the stiffness matrices of the sections.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from evolvent_base import progress, units
from evolvent_base.errors import InputError, nearest
from evolvent_base.figures import Figure, Line, Panel, stacked
from evolvent_base.schema import Section
from evolvent_papers.laboratory import tables
from evolvent_papers.laboratory.book import Array, Budget, Comparison, Contribution, Set, Verdict
from evolvent_papers.laboratory.clamped import Clamped, Deviation, G

SOURCE = (
    "deflections measured by Minguet and Dugundji (doi 10.2514/3.25255), as digitized in the public repository "
    "luizpancini/AeroBeams.jl (test/referenceData/compositeCantileverMD); MIT licence"
)
#: Length of the strips, and of the point whose displacements are measured, m.
LENGTH, PLACE = 0.55, 0.5
#: Goal: largest difference, parts of the length.
GOAL = 0.03
ASSUMED = "assumed, the source states none"
BUDGET = Budget(contributions=(
    Contribution(
        name="reading", kind="measurement", size="{reading_deviation:g} m", source="assumed, of a plot that was read",
    ),
    Contribution(name="stiffness", kind="parameters", size="{stiffness_deviation:.1%} of all of it", source=ASSUMED),
    Contribution(
        name="own weight", kind="parameters", size="all of {mass_per_length:g} kg/m, which the prediction lacks",
        source="estimated, the source states no mass",
    ),
    Contribution(
        name="mesh", kind="numerics", size="change by half the length of elements", source="computed",
    ),
))  # fmt: skip
#: Displacements of the table: component along x, y or z, and its sign.
DISPLACEMENTS = {"-u1": (0, -1.0), "u2": (1, 1.0), "-u3": (2, -1.0)}
#: Stiffness of each strip: its diagonal, and entries off it by their places, counted from 0; N, N m and N m2.
STRIPS: dict[int, tuple[tuple[float, ...], dict[tuple[int, int], float]]] = {
    1: ((3.7e6, 2.6e5, 2.9e5, 0.183, 0.707, 276.0), {}),
    2: ((4.0e6, 2.6e5, 5.5e5, 0.368, 0.522, 298.0), {(0, 1): -2.7e5, (3, 4): -0.102}),
    3: ((3.9e6, 1.1e6, 1.2e5, 1.18, 0.983, 290.0), {(0, 3): -522.0}),
}


class Settings(Section):
    """What `--set` changes."""

    stiffness_deviation: Deviation = Field(
        0.05, description="standard uncertainty of all stiffnesses, part of them; the source states none"
    )
    mass_per_length: units.LineDensity = Field(
        0.07, description="mass per length, kg/m, whose weight is part of the band; estimated, the source states none"
    )
    reading_deviation: units.Length = Field(
        2e-3, description="standard uncertainty of a displacement that was read off a plot, m"
    )
    elements: Annotated[int, units.Whole(least=2, most=1000)] = Field(22, description="elements of the rod")


def stiffness(strip: int) -> Array:
    """Stiffness matrix of a strip, (6, 6), as of `SectionStiffness`."""
    diagonal, couplings = STRIPS[strip]
    found = np.diag(diagonal)
    for (i, k), value in couplings.items():
        found[i, k] = found[k, i] = value
    return found


def run(settings: Settings, data: str | None) -> Verdict:
    """Predict the displacements of every strip by every weight, with their bands, and compare."""
    rows = _checked(tables.rows_of(tables.stored("composite-strips.csv"), data, measured=("value_m",),
                                   words=("displacement",)))  # fmt: skip
    found: dict[tuple[int, float, float], tuple[Array, ...]] = {}
    loaded = sorted({(int(row["beam"]), row["root_deg"], row["weight_g"]) for row in rows})
    for strip, root, grams in progress.track(loaded, "predicting"):
        model = Clamped(
            stiffness=stiffness(strip), length=LENGTH, turn=math.radians(root), elements=settings.elements
        )  # fmt: skip
        base, (by_stiffness, by_weight, by_mesh) = model.predicted(
            1e-3 * grams * G, PLACE, {"stiffness": model.stiffness * (1.0 - settings.stiffness_deviation)},
            {"own_weight": settings.mass_per_length * G}, {"elements": 2 * settings.elements},
        )  # fmt: skip
        found[strip, root, grams] = base, *map(np.abs, (by_stiffness, by_weight, by_mesh))
    comparisons = []
    for row in rows:
        predicted, *changes = found[int(row["beam"]), row["root_deg"], row["weight_g"]]
        axis, sign = DISPLACEMENTS[row["displacement"]]
        sizes = (settings.reading_deviation, *(float(one[axis]) for one in changes))
        band = BUDGET.band(dict(zip((one.name for one in BUDGET.contributions), sizes, strict=True)))
        comparisons.append(
            Comparison(
                what=f"strip {row['beam']:g}, root {row['root_deg']:g} deg, {row['weight_g']:g} g, "
                f"{row['displacement']}", unit="m", predicted=sign * float(predicted[axis]), measured=row["value_m"],
                band=band, allowed=GOAL * LENGTH, goal="3 % of the length",
            )
        )  # fmt: skip
    notes = (
        "the prediction is without the strip's own weight: the source states no mass, and an estimate of the weight is "
        "part of the bands, as are assumed uncertainties of stiffness and readings",
    )
    return Verdict(comparisons=tuple(comparisons), figures=(_figure(rows, comparisons),), notes=notes)


def _checked(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows whose strip and displacement are known, and whose weight is not below 0."""
    for row in rows:
        if row["beam"] not in STRIPS:
            raise InputError(f"beam is {row['beam']:g}; it must be {', '.join(map(str, STRIPS))}")
        if row["displacement"] not in DISPLACEMENTS:
            raise InputError(f"displacement is {row['displacement']!r}; {nearest(row['displacement'], DISPLACEMENTS)}")
        if row["weight_g"] < 0.0:
            raise InputError(f"weight_g is {row['weight_g']:g}; it must not be below 0")
    return rows


def _figure(rows: Sequence[dict[str, Any]], comparisons: Sequence[Comparison]) -> Figure:
    """Displacements over the weight, a panel for each strip and turn of its root."""
    panels = []
    for strip, root in sorted({(int(row["beam"]), row["root_deg"]) for row in rows}):
        lines = []
        for c, name in enumerate(DISPLACEMENTS):
            own = [
                (row["weight_g"], one.predicted, one.measured)
                for row, one in zip(rows, comparisons, strict=True)
                if (row["beam"], row["root_deg"], row["displacement"]) == (strip, root, name)
            ]
            if own:
                grams, predicted, measured = np.array(sorted(own)).T
                lines.append(Line(x=grams, y=predicted, label=f"{name}, predicted", color=c))
                if np.any(np.isfinite(measured)):
                    lines.append(Line(x=grams, y=measured, label=f"{name}, measured", color=c, style="", marker="o"))
        panels.append(
            Panel(
                x_label="weight at the tip, g", y_label="displacement, m", lines=lines,
                title=f"strip {strip}, root turned by {root:g} deg",
            )
        )  # fmt: skip
    title = "Displacements of composite strips 0.5 m from the clamp"
    return Figure(name="composite-strips", title=title, panels=panels, height=stacked(len(panels)))


SETS = {
    "composite-strips": Set(
        name="composite-strips", title="Large deflection of composite strips by weights at their tips",
        source=SOURCE, Settings=Settings, run=run, budget=BUDGET,
    )
}  # fmt: skip
