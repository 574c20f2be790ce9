"""Flap modes of a rotating beam with a swept tip, about its equilibrium as it turns.

Source: measured by Epps and Chandra, as listed in byuflowlab/GXBeam.jl (MIT licence), with dimensions and material.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from evolvent.analysis.system import System
from evolvent.elements import Material, Rectangle
from evolvent.parts import Joint, Rod
from evolvent_base import progress, units
from evolvent_base.errors import InputError, RunFailed
from evolvent_base.figures import Figure, Line, Panel, stacked
from evolvent_base.schema import Section
from evolvent_papers.laboratory import tables
from evolvent_papers.laboratory.book import Array, Band, Budget, Comparison, Contribution, Set, Verdict
from evolvent_papers.laboratory.clamped import Deviation

SOURCE = (
    "natural frequencies measured by Epps and Chandra, as listed in the public repository byuflowlab/GXBeam.jl "
    "(docs/src/literate/rotating.jl); MIT licence"
)
#: Goal: largest difference, part of the measured frequency and Hz, added.
GOAL = (0.05, 0.5)
#: Rotational speeds of the table, rev/min, and their columns.
SPEEDS = {0: "rpm_0_Hz", 500: "rpm_500_Hz", 750: "rpm_750_Hz"}
#: Slowest modes among which those of flap are.
COUNT = 8
INCH, POUND = 0.0254, 4.4482216152605


class Settings(Section):
    """What `--set` changes."""

    sweep: Annotated[float, units.Quantity(
        what="an angle in degrees", unit="", example="45", least=0.0, below=90.0,
    )] | None = Field(None, description="sweep of the tip, degrees; those of the table if left out")  # fmt: skip
    root: units.Length = Field(2.5 * INCH, description="radius of the clamp, m; the whole radius stays")
    stiffness_deviation: Deviation = Field(
        0.04,
        description="standard uncertainty of bending stiffness over mass, part of it: 2 % of E, 0.001 in of thickness",
    )
    speed_deviation: Deviation = Field(0.01, description="standard uncertainty of the speed, part of it")
    root_deviation: units.Length = Field(0.25 * INCH, description="standard uncertainty of the radius of the clamp, m")
    elements: Annotated[int, units.Whole(least=3, most=1000)] = Field(14, description="elements of the straight part")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Beam:
    """A beam that turns about z, clamped at a radius, with a tip that is swept in the plane of rotation; SI.

    Attributes
    ----------
    root, kink, tip : float, m, radius of the clamp and of the kink, length of the tip
    width, thickness : float, m, in and out of the plane of rotation
    young_modulus, poisson_ratio, density : float, Pa, 1 and kg/m3
    elements : int, of the straight part; the tip has elements of the same length or shorter
    """

    root: float = 2.5 * INCH
    kink: float = 34.0 * INCH
    tip: float = 6.0 * INCH
    width: float = 1.0 * INCH
    thickness: float = 0.063 * INCH
    young_modulus: float = 1.06e7 * POUND / INCH**2
    poisson_ratio: float = 0.325
    density: float = 2.51e-4 * POUND / INCH**4
    elements: int = 14

    def system(self, sweep: float) -> System:
        """The beam by the sweep of its tip, degrees, in axes that turn with it."""
        material = Material(
            young_modulus=self.young_modulus, poisson_ratio=self.poisson_ratio, density=self.density
        )  # fmt: skip
        section, up = Rectangle(thickness=self.thickness, width=self.width), (0.0, 0.0, 1.0)
        length, angle = self.kink - self.root, math.radians(sweep)
        found = System()
        straight = Rod(
            length=length, section=section, material=material, elements=self.elements, position=(self.root, 0.0, 0.0),
            normal=up,
        )  # fmt: skip
        found.add(straight, "straight part")
        swept = Rod(
            length=self.tip, section=section, material=material, elements=math.ceil(self.elements * self.tip / length),
            position=(self.kink, 0.0, 0.0), direction=(math.cos(angle), -math.sin(angle), 0.0), normal=up,
        )  # fmt: skip
        found.add(swept, "tip")
        found.add(Joint(a=(self.root, 0.0, 0.0), b="straight part.root", type="clamp"), "clamp")
        found.add(Joint(a="straight part.tip", b="tip.root", type="clamp"), "kink")
        return found

    def flap(self, sweep: float, speed: float) -> Array:
        """Frequencies of the first three flap modes, Hz, by the sweep, degrees, and the speed, rev/min.

        Notes
        -----
        Of the modes about the equilibrium of the turning beam, those are flap modes whose nodes move out of the plane
        of rotation.
        """
        found = self.system(sweep).modes(count=COUNT, rotating=(0.0, 0.0, speed * math.pi / 30.0))
        moved = np.concatenate([np.abs(found[part].displacement) ** 2 for part in ("straight part", "tip")], axis=1)
        out = moved[..., 2].sum(axis=1) / moved.sum(axis=(1, 2))
        flap = np.asarray(found.frequency_hz[out > 0.5])
        if flap.size < 3:
            raise RunFailed(f"fewer than three of the first {COUNT} modes are out of plane, sweep {sweep:g} deg", found)
        return flap[:3]


def run(settings: Settings, data: str | None) -> Verdict:
    """Predict three flap modes by sweep and speed, with their bands, and compare."""
    table = tables.rows_of(tables.stored("rotating-beam.csv"), data, measured=tuple(SPEEDS.values()))
    measured = _by_place(table, settings)
    beam = Beam(root=settings.root, elements=settings.elements)
    changed = {
        "stiffness": dataclasses.replace(beam, young_modulus=beam.young_modulus * (1.0 + settings.stiffness_deviation)),
        "root": dataclasses.replace(beam, root=beam.root + settings.root_deviation),
    }
    finer = dataclasses.replace(beam, elements=2 * beam.elements)
    predicted: dict[tuple[float, int], Array] = {}
    comparisons = []
    for sweep, speed in progress.track(sorted({(place[0], place[1]) for place in measured}), "predicting"):
        found = predicted[sweep, speed] = beam.flap(sweep, speed)
        moved = [one.flap(sweep, speed) - found for one in changed.values()]
        if speed > 0:
            moved.append(beam.flap(sweep, speed * (1.0 + settings.speed_deviation)) - found)
        numerics = np.abs(finer.flap(sweep, speed) - found)
        for mode in (1, 2, 3):
            value = measured.get((sweep, speed, mode), math.nan)
            band = Band(
                measurement=math.hypot(0.1, 0.01 * found[mode - 1]),
                parameters=math.sqrt(sum(float(one[mode - 1]) ** 2 for one in moved)),
                numerics=float(numerics[mode - 1]),
                how="0.1 Hz and 1 % of a frequency; stiffness, clamp and speed; half the length of elements",
            )  # fmt: skip
            comparisons.append(
                Comparison(
                    what=f"flap mode {mode}, sweep {sweep:g} deg, {speed:g} rev/min", unit="Hz",
                    predicted=float(found[mode - 1]), measured=value, band=band, allowed=GOAL[0] * value + GOAL[1],
                    goal="5 % and 0.5 Hz",
                )
            )  # fmt: skip
    notes = [
        "modes about the equilibrium as the beam turns; the source states no uncertainties: those of the clamp's "
        "radius, the stiffness, the speed and the readings are assumed"
    ]
    off = [one.difference / one.measured for one in comparisons if one.compared]
    if off:
        notes.append(f"the mean of the relative differences is {100.0 * float(np.mean(off)):+.1f} %")
    return Verdict(comparisons=tuple(comparisons), figures=(_figure(predicted, measured),), notes=tuple(notes))


def _by_place(table: Sequence[dict[str, Any]], settings: Settings) -> dict[tuple[float, int, int], float]:
    """Measured frequencies, Hz, by sweep, speed and mode, of the sweep that is asked for; NaN without a measurement."""
    found = {}
    for row in table:
        mode, sweep = row["mode"], row["sweep_deg"]
        if mode not in (1.0, 2.0, 3.0):
            raise InputError(f"mode is {mode:g}; it must be 1, 2 or 3")
        if not 0.0 <= sweep < 90.0:
            raise InputError(f"sweep_deg is {sweep:g}; it must be from 0 to below 90")
        for speed, column in SPEEDS.items():
            found[sweep, speed, int(mode)] = row[column]
    if settings.sweep is None:
        return found
    return {(settings.sweep, speed, mode): found.get((settings.sweep, speed, mode), math.nan)
            for speed in SPEEDS for mode in (1, 2, 3)}  # fmt: skip


def _figure(predicted: dict[tuple[float, int], Array], measured: dict[tuple[float, int, int], float]) -> Figure:
    """Frequencies over the sweep, a panel for each mode."""
    panels = []
    for mode in (1, 2, 3):
        lines = []
        for c, speed in enumerate(SPEEDS):
            sweeps = np.array([sweep for sweep, other in predicted if other == speed])
            found = np.array([predicted[sweep, speed][mode - 1] for sweep in sweeps])
            points = np.array([measured.get((sweep, speed, mode), math.nan) for sweep in sweeps])
            lines.append(
                Line(x=sweeps, y=found, label=f"{speed} rev/min, predicted", color=c, marker="." * (sweeps.size < 2))
            )
            if np.any(np.isfinite(points)):
                lines.append(Line(x=sweeps, y=points, label="measured" * (c == 0), color=c, style="", marker="o"))
        panels.append(Panel(x_label="sweep of the tip, deg", y_label=f"flap mode {mode}, Hz", lines=lines, y_zero=True))
    title = "Flap modes of a rotating beam by the sweep of its tip: predicted (lines) and measured (points)"
    return Figure(name="rotating-beam", title=title, panels=panels, height=stacked(3))


ASSUMED = "assumed, the source states none"
BUDGET = Budget(contributions=(
    Contribution(
        name="reading", kind="measurement", size="0.1 Hz and 1 % of a frequency", source=f"digits listed; {ASSUMED}",
    ),
    Contribution(
        name="stiffness", kind="parameters", size="{stiffness_deviation:.1%} of that over mass", source=ASSUMED,
    ),
    Contribution(name="clamp", kind="parameters", size="{root_deviation:.3g} m of its radius", source=ASSUMED),
    Contribution(name="speed", kind="parameters", size="{speed_deviation:.1%} of it", source=ASSUMED),
    Contribution(
        name="mesh", kind="numerics", size="change by half the length of elements", source="computed",
    ),
))  # fmt: skip
SETS = {
    "rotating-beam": Set(
        name="rotating-beam", title="Flap modes of a rotating beam with a swept tip", source=SOURCE, Settings=Settings,
        run=run, budget=BUDGET,
    )
}  # fmt: skip
