"""Deflection of a wing spar by weights at its tip, at large rotation: an elastica of one bending stiffness.

Source: deflections of the spar of the Pazy wing (Technion), as numbers; no file of the source is part of the package.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from evolvent_base import progress, units
from evolvent_base.figures import Figure, Line, Panel, stacked
from evolvent_base.schema import Section
from evolvent_papers.laboratory import tables
from evolvent_papers.laboratory.book import Budget, Comparison, Contribution, Set, Verdict
from evolvent_papers.laboratory.clamped import Clamped, Deviation, G

SOURCE = (
    "bending test of the Pazy wing (Technion): loads and deflections cited as numbers, no file of the source is used"
)
MEASURED = b"""mass_kg,deflection_percent
1,21.15
1.8,34.90
2.6,45.90
"""
#: Goal: largest difference, parts of the length.
GOAL = 0.02
ASSUMED = "assumed, the source states none"
BUDGET = Budget(contributions=(
    Contribution(
        name="reading", kind="measurement", size="{reading_deviation:.1%} of the length", source=ASSUMED,
    ),
    Contribution(name="bending stiffness", kind="parameters", size="{stiffness_deviation:.1%} of it", source=ASSUMED),
    Contribution(
        name="mesh", kind="numerics", size="change by half the length of elements", source="computed",
    ),
))  # fmt: skip
#: Stiffness against extension and shear, N, and of bending across, N m2, beside which the spar bends alone.
STIFF = 1e7


class Settings(Section):
    """What `--set` changes."""

    length: units.Length = Field(0.55, description="length of the spar from its clamp to the load, m")
    bending_stiffness: Annotated[float, units.Quantity(
        what="a bending stiffness", unit="N m^2", example="4.475 N m^2", above=0.0,
    )] = Field(4.475, description="bending stiffness E I, N m2")  # fmt: skip
    stiffness_deviation: Deviation = Field(
        0.03, description="standard uncertainty of the bending stiffness, part of it; the source states none"
    )
    reading_deviation: Deviation = Field(
        0.003, description="standard uncertainty of a measured deflection, part of the length; the source states none"
    )
    elements: Annotated[int, units.Whole(least=2, most=1000)] = Field(22, description="elements of the rod")


def spar(settings: Settings) -> Clamped:
    """The spar: it bends about y, and is stiff otherwise."""
    EI = settings.bending_stiffness
    return Clamped(
        stiffness=np.diag([STIFF, STIFF, STIFF, STIFF, EI, STIFF]), length=settings.length, elements=settings.elements
    )


def run(settings: Settings, data: str | None) -> Verdict:
    """Predict the deflection by each mass, with its band, and compare."""
    model, L = spar(settings), settings.length
    finer = 2 * settings.elements
    share = settings.stiffness_deviation
    softer = spar(settings.replaced(bending_stiffness=settings.bending_stiffness * (1.0 - share))).stiffness
    rows, comparisons = tables.rows_of(MEASURED, data, measured=("deflection_percent",)), []
    for row in progress.track(rows, "predicting"):
        weight = row["mass_kg"] * G
        predicted, (by_stiffness, by_mesh) = model.predicted(weight, L, {"stiffness": softer}, {"elements": finer})
        band = BUDGET.band({
            "reading": 100.0 * settings.reading_deviation, "bending stiffness": 100.0 / L * abs(float(by_stiffness[2])),
            "mesh": 100.0 / L * abs(float(by_mesh[2])),
        })  # fmt: skip
        comparisons.append(
            Comparison(
                what=f"deflection of the tip by {row['mass_kg']:g} kg, % of the length", unit="%",
                predicted=float(-100.0 / L * predicted[2]), measured=row["deflection_percent"], band=band,
                allowed=100.0 * GOAL, goal="2 % of the length",
            )
        )  # fmt: skip
    notes = (
        "the spar is uniform, inextensible and without its own weight; the source states no uncertainties: those of "
        "the bending stiffness and of the readings are assumed",
        "where the bending stiffness is from is not stated: the set holds how it grows stiffer at large rotation, more "
        "than the stiffness itself",
    )
    return Verdict(comparisons=tuple(comparisons), figures=(_figure(model, rows),), notes=notes)


def _figure(model: Clamped, rows: list[dict[str, Any]]) -> Figure:
    """Deflection over mass."""
    masses, measured = (np.array([row[key] for row in rows]) for key in ("mass_kg", "deflection_percent"))
    dense = np.linspace(0.0, 1.1 * masses.max(), 15)
    shape = np.array([-100.0 / model.length * model.deflection(m * G, model.length)[2] for m in dense])
    lines = [Line(x=dense, y=shape, label="predicted")]
    lines.append(Line(x=masses, y=measured, label="measured", color="gray", style="", marker="o"))
    panel = Panel(x_label="mass at the tip, kg", y_label="deflection of the tip, % of the length", lines=lines)
    return Figure(
        name="wing-spar", title="Deflection of a wing spar by weights at its tip", panels=[panel], height=stacked(1)
    )


SETS = {
    "wing-spar": Set(
        name="wing-spar", title="Deflection of a wing spar by weights at its tip, up to 46 % of its length",
        source=SOURCE, Settings=Settings, run=run, budget=BUDGET,
    )
}  # fmt: skip
