"""Flap modes of a rotating beam with a swept tip, about its equilibrium as it turns.

Source: measured by Epps and Chandra, as listed in byuflowlab/GXBeam.jl (MIT licence), with dimensions and material.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from evolvent.analysis.system import System
from evolvent.elements import Material, Rectangle
from evolvent.parts import Joint, JointSpring, Point, RigidBody, Rod
from evolvent_base import answer as an, progress, units
from evolvent_base.errors import InputError, RunFailed
from evolvent_base.figures import Figure, Line, Panel, stacked
from evolvent_base.schema import Section
from evolvent_papers.laboratory import causes, tables
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
#: Slowest modes among which those out of the plane of rotation are.
COUNT = 8
#: Speed of the second table, of modes of coupled bending and torsion, rev/min; they are the 4th to 6th out of plane.
COUPLED = 750
#: Sweep, degrees, speed, rev/min, and number of a mode.
Place = tuple[float, int, int]
#: What the parts of a band contain.
HOW = (
    "measurement: readings to 0.1 Hz and 1 % of a frequency; parameters: bending stiffness over mass, radius of the "
    "clamp, speed; numerics: half the length of elements; not contained: a soft clamp, masses of a kink or of sensors"
)
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
    causes: bool = Field(True, description="whether causes of the differences are compared by their patterns")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Beam:
    """A beam that turns about z, clamped at a radius, with a tip that is swept in the plane of rotation; SI.

    Attributes
    ----------
    root, kink, tip : float, m, radius of the clamp and of the kink, length of the tip
    width, thickness : float, m, in and out of the plane of rotation
    young_modulus, poisson_ratio, density : float, Pa, 1 and kg/m3
    clamp_compliance : float, rad/(N m), of the clamp about the axis of flap bending
    tip_mass : float, kg, at the tip
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
    clamp_compliance: float = 0.0
    tip_mass: float = 0.0
    elements: int = 14

    def system(self, sweep: float, speed: float = 0.0) -> System:
        """The beam by the sweep of its tip, degrees, in axes that turn with it at a speed, rad/s."""
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
        if self.clamp_compliance > 0.0:
            points = {"clamp": (self.root, 0.0, 0.0)}
            found.add(
                RigidBody(motion="driven", mass=1.0, inertia=1.0, axis=up, rate=speed, points=points), "hub"
            )  # fmt: skip
            hinge = Joint(a="hub.clamp", b="straight part.root", type="revolute", axis=(0.0, 1.0, 0.0))
            found.add(hinge, "clamp")
            found.add(JointSpring(joint="clamp", stiffness=1.0 / self.clamp_compliance), "compliance")
        else:
            found.add(Joint(a=(self.root, 0.0, 0.0), b="straight part.root", type="clamp"), "clamp")
        if self.tip_mass > 0.0:
            found.add(Point(at="tip.tip", mass=self.tip_mass), "mass at the tip")
        found.add(Joint(a="straight part.tip", b="tip.root", type="clamp"), "kink")
        return found

    def flap(self, sweep: float, speed: float) -> Array:
        """Frequencies of the first three flap modes, Hz, by the sweep, degrees, and the speed, rev/min."""
        return self.out_of_plane(sweep, speed, 3)

    def out_of_plane(self, sweep: float, speed: float, count: int) -> Array:
        """Frequencies of the first modes whose nodes move out of the plane of rotation, Hz: (count,).

        Notes
        -----
        Modes about the equilibrium of the turning beam: flap bending, and torsion, which a swept tip couples with it.
        """
        found = _out_of_plane(self, sweep, speed)
        if found.size < count:
            raise RunFailed(
                f"fewer than {count} of the first {COUNT} modes are out of plane, sweep {sweep:g} deg", None
            )  # fmt: skip
        return found[:count]


@functools.lru_cache(maxsize=512)
def _out_of_plane(beam: Beam, sweep: float, speed: float) -> Array:
    """Frequencies of those of the first `COUNT` modes that are out of plane, Hz; not to be changed."""
    rate = speed * math.pi / 30.0
    found = beam.system(sweep, rate).modes(count=COUNT, rotating=(0.0, 0.0, rate))
    moved = np.concatenate([np.abs(found[part].displacement) ** 2 for part in ("straight part", "tip")], axis=1)
    out = moved[..., 2].sum(axis=1) / moved.sum(axis=(1, 2))
    flap = np.asarray(found.frequency_hz[out > 0.5])
    flap.flags.writeable = False
    return flap


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
                how=HOW,
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
    shown = _figure(predicted, measured)
    if not settings.causes:
        return Verdict(comparisons=tuple(comparisons), figures=(shown,), notes=tuple(notes))
    explained = _explained(beam, measured, _coupled(measured) if data is None else {})
    if explained is None:
        return Verdict(comparisons=tuple(comparisons), figures=(shown,), notes=tuple(notes))
    shown_causes, why, more = explained
    return Verdict(comparisons=tuple(comparisons), figures=(shown, why), notes=(*notes, *more), tables=(shown_causes,))


# ------------------------------------------------------------------------------------------------ causes


#: What the table of causes calls its parts.
REST, TURNING, WITNESS = "at rest", "turning", "of bending and torsion"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Change:
    """A change of the beam that may explain differences.

    Attributes
    ----------
    name, unit : str
    step : float, size of the change, units
    of : mapping, attributes of the changed beam
    speed : float, factor of the speed
    least : float, smallest size that is possible, units
    """

    name: str
    unit: str
    step: float
    of: dict[str, Any] = dataclasses.field(default_factory=dict)
    speed: float = 1.0
    least: float = -math.inf


def changes(beam: Beam) -> list[Change]:
    """Changes of a beam, each by a small step."""
    bending = beam.young_modulus * beam.width * beam.thickness**3 / 12.0
    soft = 0.01 * (beam.kink + beam.tip - beam.root) / bending
    return [
        Change(name="bending stiffness over mass (twice the thickness)", unit="%", step=4.0,
               of={"young_modulus": 1.04 * beam.young_modulus}),
        Change(name="radius of the clamp, radius of the tip kept", unit="in", step=0.25,
               of={"root": beam.root + 0.25 * INCH}),
        Change(name="length of the straight part, clamp kept", unit="in", step=0.25,
               of={"kink": beam.kink + 0.25 * INCH}),
        Change(name="length of the swept tip", unit="in", step=0.25, of={"tip": beam.tip + 0.25 * INCH}),
        Change(name="mass at the tip", unit="g", step=1.0, of={"tip_mass": 1e-3}, least=0.0),
        Change(name="compliance of the clamp", unit="1e-3 rad/(N m)", step=1e3 * soft, of={"clamp_compliance": soft},
               least=0.0),
        Change(name="radius of the whole beam", unit="in", step=0.25,
               of={"root": beam.root + 0.25 * INCH, "kink": beam.kink + 0.25 * INCH}),
        Change(name="speed", unit="%", step=1.0, speed=1.01),
    ]  # fmt: skip


def _coupled(measured: Mapping[Place, float]) -> dict[Place, float]:
    """Measured frequencies of coupled bending and torsion, Hz, at sweeps of the first table."""
    rows = tables.rows_of(tables.stored("rotating-beam-coupled.csv"), None, measured=())
    found = {(row["sweep_deg"], COUPLED, int(row["order"])): row[SPEEDS[COUPLED]] for row in rows}
    sweeps = {sweep for sweep, _, _ in measured}
    return {place: value for place, value in found.items() if place[0] in sweeps}


def _predicted(beam: Beam, places: Sequence[Place], factor: float = 1.0) -> Array:
    """Frequencies at places, Hz, with all speeds by a factor: (n,)."""
    most: dict[tuple[float, int], int] = {}
    for sweep, speed, mode in places:
        most[sweep, speed] = max(mode, most.get((sweep, speed), 0))
    found = {key: beam.out_of_plane(key[0], key[1] * factor, count) for key, count in most.items()}
    return np.array([found[sweep, speed][mode - 1] for sweep, speed, mode in places])


def _explained(
    beam: Beam, measured: Mapping[Place, float], coupled: Mapping[Place, float]
) -> tuple[an.Table, Figure, tuple[str, ...]] | None:
    """Table, figure and notes of causes; None where fewer than three frequencies at rest or turning are measured."""
    known = {place: value for place, value in {**measured, **coupled}.items() if math.isfinite(value)}
    places, found = list(known), np.array(list(known.values()))
    rest = np.array([speed == 0 and mode <= 3 for _, speed, mode in places])
    turning = np.array([speed > 0 and mode <= 3 for _, speed, mode in places])
    if min(rest.sum(), turning.sum()) < 3:
        return None
    base = _predicted(beam, places)
    differences, deviation = np.log(found / base), np.hypot(0.1, 0.01 * base) / base
    listed = []
    for one in progress.track(changes(beam), "causes"):
        moved = _predicted(dataclasses.replace(beam, **one.of), places, one.speed)
        listed.append(
            causes.Cause(name=one.name, unit=one.unit, pattern=np.log(moved / base) / one.step, least=one.least)
        )  # fmt: skip
    listed += [
        causes.Cause(name="scale of all measured frequencies", unit="%", pattern=np.full(base.size, 0.01)),
        causes.Cause(name="offset of all measured frequencies", unit="Hz", pattern=1.0 / base),
    ]
    explained = causes.explanations(listed, differences, deviation, {REST: rest, TURNING: turning})
    witness = ~(rest | turning)
    seconds = {WITNESS: (TURNING, witness)} if witness.any() else {}
    shown = causes.table(
        explained, causes.fitted([], differences, deviation, rest | turning), seconds,
        "Causes of the differences, each alone: its size, and the sum of squares that it leaves",
    )  # fmt: skip
    drawn = _figure_of_causes(
        base, differences, deviation, explained, {REST: rest, TURNING: turning, WITNESS: witness}
    )  # fmt: skip
    notes = (
        _contradiction(explained, differences, deviation, turning),
        _pair(listed, differences, deviation, rest | turning),
    )
    return shown, drawn, notes


def _by_place(table: Sequence[dict[str, Any]], settings: Settings) -> dict[Place, float]:
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


def _figure(predicted: dict[tuple[float, int], Array], measured: dict[Place, float]) -> Figure:
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


def _best(explained: Sequence[causes.Explanation]) -> causes.Explanation:
    """The possible cause that leaves least of the frequencies of the turning beam."""
    return min((one for one in explained if one.possible), key=lambda one: one.fits[TURNING].chi2)


def _contradiction(
    explained: Sequence[causes.Explanation], differences: Array, deviation: Array, turning: Array
) -> str:  # fmt: skip
    """What the turning frequencies say of the first cause beside the best one, and those at rest."""
    first, best = explained[0], _best(explained)
    both = causes.fitted([first.cause, best.cause], differences, deviation, turning)
    value, spread = (float(one[0]) for one in (both.values, both.deviations))
    alone = first.fits[REST]
    return (
        f"{first.cause.name}: {alone.values[0]:+.1f} ± {alone.deviations[0]:.1f} {first.cause.unit} by the frequencies "
        f"at rest, {value:+.1f} ± {spread:.1f} {first.cause.unit} by those of the turning beam, beside which the "
        f"{best.cause.name} is fitted"
    )


def _pair(listed: Sequence[causes.Cause], differences: Array, deviation: Array, chosen: Array) -> str:
    """What the best two causes together leave."""
    pair, fit = causes.best_pair(listed, differences, deviation, chosen)
    sizes = " and ".join(f"{one.name} {value:+.2g} {one.unit}" for one, value in zip(pair, fit.values, strict=True))
    rest = int(np.count_nonzero(~chosen))
    again = f", and {np.sum(fit.left[~chosen] ** 2):.0f} of {rest} {WITNESS}" if rest else ""
    return f"two causes together, {sizes}, leave chi2 {fit.chi2:.0f} of {np.count_nonzero(chosen)} frequencies{again}"


def _figure_of_causes(
    base: Array, differences: Array, deviation: Array, explained: Sequence[causes.Explanation],
    groups: Mapping[str, Array],
) -> Figure:  # fmt: skip
    """Differences over the frequency, a panel for each group, with what the turning ones make of the best cause."""
    best = _best(explained)
    size = float(best.fits[TURNING].values[0])
    panels: list[Panel] = []
    for name, which in groups.items():
        if not which.any():
            continue
        order = np.flatnonzero(which)[np.argsort(base[which])]
        x, y, bar = base[order], 100.0 * differences[order], 100.0 * deviation[order]
        gap = np.full(x.size, math.nan)
        lines = [
            Line(x=x, y=y, label="measured" * (not panels), color=0, style="", marker="o"),
            Line(x=np.stack([x, x, gap], axis=1).ravel(), y=np.stack([y - bar, y + bar, gap], axis=1).ravel(), label="",
                 color=0),
            Line(x=x, y=100.0 * size * best.cause.pattern[order], color=1, style="", marker="x",
                 label=f"{best.cause.name} {size:+.2g} {best.cause.unit}" * (not panels)),
        ]  # fmt: skip
        panels.append(Panel(x_label="predicted frequency, Hz", y_label="measured less predicted, %", lines=lines,
                            title=name, y_zero=True))  # fmt: skip
    title = "Rotating beam: differences, and those of the cause that fits the turning beam best"
    return Figure(name="rotating-beam-causes", title=title, panels=panels, height=stacked(len(panels)))


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
