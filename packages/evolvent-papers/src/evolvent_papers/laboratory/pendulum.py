"""Swings of a double and a triple pendulum: angles from the first rows of every piece, predicted and measured.

Each piece starts from the angles of its own first row, with the slopes of its first angles as rates: recorded rates
deviate from them by 0.04 rad/s. With the authors' parameters it starts from recorded rates as well. The parameters are
those that the authors of the measurements identified, and those of a fit to ten pieces, spread over the set, with which
the others are predicted.

Source: dynamicslab/MultiArm-Pendulum (MIT licence); arXiv 2205.06231.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import pathlib
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
import scipy
from pydantic import Field

from evolvent.analysis.runs import solve
from evolvent.analysis.system import System
from evolvent.parts import Joint, JointSpring, RigidBody
from evolvent_base import progress, units
from evolvent_base.errors import RunFailed
from evolvent_base.figures import Figure, Line, Panel, stacked
from evolvent_base.schema import Section
from evolvent_papers.laboratory import book, tables
from evolvent_papers.laboratory.book import Array, Band, Budget, Comparison, Contribution, Set, Verdict, rms

SOURCE = (
    "public repository dynamicslab/MultiArm-Pendulum, folder ParameterEstimation, commit e99a7e1 (arXiv 2205.06231); "
    "MIT licence"
)
#: Tolerance of the runs, and of those that say how far they are off.
TOLERANCE, FINE = 1e-6, 1e-8
#: Rows of a piece whose angles give the rates at its start: 40 ms.
FIRST = 9
#: Of pieces that start from the rates of their first row.
RECORDED = "recorded rates"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Pendulum:
    """Arms from the ground on: the parameters of the model.

    Attributes
    ----------
    masses : (n,) float, kg
    centres : (n,) float, m, from the joint above to the centre of mass
    lengths : (n - 1,) float, m, from joint to joint
    inertias : (n,) float, kg m2, about the centre of mass
    frictions : (n,) float, N m s/rad, viscous friction of the joints
    gravity : float, m/s2
    dry : (n,) float, N m, Coulomb friction of the joints; none if left out
    """

    masses: tuple[float, ...]
    centres: tuple[float, ...]
    lengths: tuple[float, ...]
    inertias: tuple[float, ...]
    frictions: tuple[float, ...]
    gravity: float
    dry: tuple[float, ...] = ()

    @property
    def arms(self) -> int:
        """Number of arms."""
        return len(self.masses)

    def system(self, angles: Array, rates: Array) -> System:
        """The pendulum at a start.

        Parameters
        ----------
        angles, rates : (n,) float, rad from upward and rad/s, absolute
        """
        found = System(gravity=(0.0, -self.gravity, 0.0))
        at, moving = np.zeros(2), np.zeros(2)
        for k, (angle, rate) in enumerate(zip(angles, rates, strict=True)):
            turn, above = angle + 0.5 * math.pi, self.centres[k]
            along = np.array([math.cos(turn), math.sin(turn)])
            across = float(rate) * np.array([-along[1], along[0]])
            points = {"top": (-above, 0.0, 0.0)}
            if k + 1 < self.arms:
                points["bottom"] = (self.lengths[k] - above, 0.0, 0.0)
            arm = RigidBody(
                mass=self.masses[k], inertia=self.inertias[k], points=points,
                position=(*(at + above * along), 0.0), velocity=(*(moving + above * across), 0.0),
                orientation=(math.cos(0.5 * turn), 0.0, 0.0, math.sin(0.5 * turn)),
                angular_velocity=(0.0, 0.0, float(rate)),
            )  # fmt: skip
            found.add(arm, f"arm {k + 1}")
            above_it: Any = (0.0, 0.0, 0.0) if k == 0 else f"arm {k}.bottom"
            found.add(Joint(a=above_it, b=f"arm {k + 1}.top", type="revolute", axis=(0.0, 0.0, 1.0)), f"pivot {k + 1}")
            bearing = JointSpring(
                joint=f"pivot {k + 1}", damping=self.frictions[k], friction=self.dry[k] if self.dry else 0.0
            )
            found.add(bearing, f"bearing {k + 1}")
            if k + 1 < self.arms:
                at, moving = at + self.lengths[k] * along, moving + self.lengths[k] * across
        return found

    def predicted(self, piece: Piece, *, tolerance: float = TOLERANCE, start: Array | None = None) -> Array:
        """Angles at the times of a piece from its start: (nt, n) float, rad, absolute.

        Parameters
        ----------
        start : (2 n,) float, angles and rates in place of the piece's
        """
        n = self.arms
        row = piece.start if start is None else start
        solution, _, _ = solve(
            self.system(row[:n], row[n:]).assemble(), until=float(piece.time[-1]), every=piece.every, fine=False,
            method="dopri5", tolerance=tolerance,
        )  # fmt: skip
        if not solution.success:
            raise RunFailed(solution.message, None)
        at = solution.model.bodies["iq"][-n:]
        turned = np.unwrap(2.0 * np.arctan2(solution.y[:, at + 6], solution.y[:, at + 3]), axis=0)
        return np.asarray(row[:n] + turned - turned[0])


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """A recorded swing.

    Attributes
    ----------
    name : str
    time : (nt,) float, s, from 0
    angles, rates : (nt, n) float, rad from upward and rad/s, absolute
    recorded : bool, whether it starts from the rates of its first row
    """

    name: str
    time: Array
    angles: Array
    rates: Array
    recorded: bool = False

    @property
    def every(self) -> float:
        """Time between samples, s."""
        return float(self.time[-1]) / (self.time.size - 1)

    @functools.cached_property
    def start(self) -> Array:
        """Angles of the first row, and its rates or slopes of cubics through the first angles: (2 n,) float."""
        return np.concatenate([self.angles[0], self.rates[0] if self.recorded else self.slopes(3)])

    def slopes(self, degree: int) -> Array:
        """Slopes of polynomials through the first angles, at the first row: (n,) float, rad/s."""
        m = min(FIRST, self.time.size)
        through = np.polynomial.polynomial.polyfit(self.time[:m], self.angles[:m], min(degree, m - 1))
        return np.asarray(through[1])


#: Parameters that the authors identified.
AUTHORS = {
    "double-pendulum": Pendulum(
        masses=(0.09384397, 0.13759597), centres=(0.10856521, 0.11677902), lengths=(0.17271920,),
        inertias=(4.3752943e-4, 1.26882939e-3), frictions=(2.3714278e-4, 1.0e-5), gravity=9.80858023,
    ),
    "triple-pendulum": Pendulum(
        masses=(0.25817200, 0.27942780, 0.11862423), centres=(0.15999993, 0.20293921, 0.18370874),
        lengths=(0.17279974, 0.2287), inertias=(1.0004344e-4, 3.1415952e-4, 1.6873904e-4),
        frictions=(1.47709548e-3, 2.5957663e-4, 1e-5), gravity=9.80834384,
    ),
}  # fmt: skip


class Settings(Section):
    """What `--set` changes."""

    fitted: Annotated[int, units.Whole(least=0, most=1000)] = Field(
        10,
        description="pieces that the parameters are fitted to, spread over all; the others are predicted; 0 for no fit",
    )
    dry: bool = Field(True, description="whether the fitted joints have Coulomb friction beside viscous friction")
    pieces: Annotated[int, units.Whole(least=1, most=1000)] = Field(1000, description="pieces that are used at most")


# ------------------------------------------------------------------------------------------------ measurements


def pieces_of(name: str, folder: str | None, most: int) -> list[Piece]:
    """Recorded swings of a set: those of the package, or of a folder with files of the same form.

    Raises
    ------
    InputError
        If the folder has no such file, or one cannot be read.
    """
    arms = AUTHORS[name].arms
    head = ["time_s", *(f"angle{k + 1}_rad" for k in range(arms)), *(f"rate{k + 1}_rad_s" for k in range(arms))]
    files = tables.contents(folder, pathlib.Path(__file__).with_name("data") / "pendulum.zip", name.partition("-")[0])
    if folder is not None:  # which may hold those of the other pendulum as well
        files = tables.having(files, head, folder)
    found = []
    for file, raw in files[:most]:
        values = tables.table(file, raw, head)
        time = values[:, 0] - values[0, 0]
        found.append(Piece(name=file, time=time, angles=values[:, 1 : 1 + arms], rates=values[:, 1 + arms :]))
    return found


# ------------------------------------------------------------------------------------------------ fit


#: Coulomb friction from which a fit starts, N m.
DRY = 1e-4
#: Centres and inertias of a fit over those of its start.
LEAST, MOST = 0.2, 5.0


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A pendulum fitted to pieces.

    Attributes
    ----------
    start : Pendulum, which keeps masses, lengths and gravity
    values : (p,) float, fitted centres, inertias, frictions and dry frictions, over their scales
    scale : (p,) float
    covariance : (p, p) float, of the values
    """

    start: Pendulum
    values: Array
    scale: Array
    covariance: Array

    def at(self, values: Array) -> Pendulum:
        """The pendulum with other values."""
        return _with(self.start, values * self.scale)

    @property
    def model(self) -> Pendulum:
        """The fitted pendulum."""
        return self.at(self.values)


def _with(model: Pendulum, values: Array) -> Pendulum:
    """A pendulum with other centres, inertias, frictions and, where there are as many values, dry frictions."""
    own = [tuple(float(one) for one in part) for part in np.split(values, len(values) // model.arms)]
    # beside a fit, where a band is found, what has no meaning counts as its bound
    own[1] = tuple(max(one, LEAST * of) for one, of in zip(own[1], model.inertias, strict=True))
    own[2:] = [tuple(max(one, 0.0) for one in part) for part in own[2:]]
    dry = own[3] if len(own) > 3 else ()
    return dataclasses.replace(model, centres=own[0], inertias=own[1], frictions=own[2], dry=dry)


def fitted(model: Pendulum, pieces: Sequence[Piece], *, dry: bool = True) -> Fit:
    """Centres, inertias and frictions by least squares over the angles of pieces; masses and lengths stay.

    Parameters
    ----------
    dry : bool, whether the joints have Coulomb friction beside viscous friction

    Notes
    -----
    Motion alone determines ratios of masses: those of the start are kept. Each piece starts from its first rows, as the
    predictions do, and counts beside the root mean square that the model has at the start: starts have errors, and
    a piece with a large one would govern all others. The covariance counts residuals of a piece as correlated.
    """
    n = model.arms
    viscous = [max(one, 1e-5) for one in model.frictions]
    scale = np.array([*model.centres, *model.inertias, *viscous, *[DRY] * (n * dry)])
    weights = [1.0 / rms([model.predicted(piece) - piece.angles]) for piece in pieces]

    def weighted(x: Array) -> list[Array]:
        progress.report("fitting", unit="evaluations")
        at = _with(model, x * scale)
        return [weight * (at.predicted(one) - one.angles) for weight, one in zip(weights, pieces, strict=True)]

    start = np.array([*model.centres, *model.inertias, *model.frictions, *[DRY] * (n * dry)]) / scale
    steps = np.concatenate([np.full(2 * n, 3e-3), np.full(scale.size - 2 * n, 0.1)])
    low = np.concatenate([np.full(2 * n, LEAST), np.zeros(scale.size - 2 * n)])
    high = np.concatenate([np.full(2 * n, MOST), np.full(scale.size - 2 * n, 100.0)])
    found = scipy.optimize.least_squares(
        lambda x: np.concatenate([np.ravel(one) for one in weighted(x)]), start, bounds=(low, high), diff_step=steps,
        x_scale=1.0, ftol=1e-5, xtol=1e-5, max_nfev=20,
    )  # fmt: skip
    each = book.samples_per_independent(weighted(found.x))
    covariance = book.covariance_of(found.jac, found.fun, each)
    return Fit(start=model, values=found.x, scale=scale, covariance=covariance)


def spread_over(count: int, chosen: int) -> list[int]:
    """Numbers of pieces that are spread evenly over all."""
    return sorted({round((k + 0.5) * count / chosen - 0.5) for k in range(chosen)}) if chosen > 0 else []


def left_out(name: str, *, dry: bool, folds: int = 5) -> list[float]:
    """Root mean square of each of the ten fitted pieces of a set, predicted by a fit to those of the other folds, rad.

    What a fit is free to change was chosen by these numbers, without the pieces that are predicted.
    """
    pieces = pieces_of(name, None, 1000)
    pieces = [pieces[k] for k in spread_over(len(pieces), 10)]
    found = np.zeros(len(pieces))
    for fold in range(folds):
        own = fitted(AUTHORS[name], [one for k, one in enumerate(pieces) if k % folds != fold], dry=dry).model
        for k in range(fold, len(pieces), folds):
            found[k] = rms([own.predicted(pieces[k]) - pieces[k].angles])
    return [float(one) for one in found]


# ------------------------------------------------------------------------------------------------ verdict


def start_rate_deviation(pieces: Sequence[Piece]) -> float:
    """Standard deviation of the rates at the starts, rad/s: their differences from slopes of quartics."""
    return rms([piece.slopes(4) - piece.start[piece.angles.shape[1] :] for piece in pieces])


def by_start(model: Pendulum, piece: Piece, deviation: float) -> float:
    """Standard deviation of the predicted angles over a piece by the rates at its start, rad."""
    base, squares = model.predicted(piece), 0.0
    for k in range(model.arms):
        moved = piece.start.copy()
        moved[model.arms + k] += 0.1 * deviation
        squares += rms([(model.predicted(piece, start=moved) - base) / 0.1]) ** 2
    return math.sqrt(squares)


def excess(model: Pendulum, pieces: Sequence[Piece], deviation: float) -> float:
    """By how much pieces differ from a model beside what their starts explain, 1 or more (Birge ratio)."""
    off = [rms([model.predicted(one) - one.angles]) / by_start(model, one, deviation) for one in pieces]
    return max(1.0, rms([np.array(off)])) if off else 1.0


def band_of(model: Pendulum, piece: Piece, deviation: float, ratio: float, fit: Fit | None = None) -> Band:
    """Standard deviations of the predicted angles, over a piece.

    Parameters
    ----------
    deviation : float, rad/s, of the rates at the start
    ratio : float, by which fitted pieces differ more than by their starts
    fit : Fit, by which the model was found; None for parameters whose uncertainty is not known
    """
    base, by_fit = model.predicted(piece), 0.0
    if fit is not None:
        by_fit = rms(book.by_parameters(lambda x: fit.at(x).predicted(piece), fit.values, fit.covariance))
    by_rates = by_start(model, piece, deviation)
    return BUDGET.band({
        "start": by_rates, "excess of fitted pieces": math.sqrt(max(0.0, ratio**2 - 1.0)) * by_rates, "fit": by_fit,
        "tolerance": rms(model.predicted(piece, tolerance=FINE) - base),
    }, how=f"rates at the start, times {ratio:.2f}, by which fitted pieces differ more")  # fmt: skip


def run(name: str, settings: Settings, data: str | None) -> Verdict:
    """Predict all pieces with the authors' parameters, and those that were not fitted with fitted ones."""
    pieces = pieces_of(name, data, settings.pieces)
    models: dict[str, tuple[Pendulum, Fit | None]] = {"authors' parameters": (AUTHORS[name], None)}
    count = min(settings.fitted, len(pieces) - 1)
    chosen = spread_over(len(pieces), count)
    own: Fit | None = None
    if chosen:
        own = fitted(AUTHORS[name], [pieces[k] for k in chosen], dry=settings.dry)
        models["fitted parameters"] = (own.model, own)
    models[f"authors' parameters, {RECORDED}"] = (AUTHORS[name], None)
    smoothed = pieces
    comparisons: list[Comparison] = []
    notes: list[str] = []
    first: dict[str, Array] = {}
    for label, (model, fit) in models.items():
        pieces = [dataclasses.replace(one, recorded=label.endswith(RECORDED)) for one in smoothed]
        others = [piece for k, piece in enumerate(pieces) if k not in chosen]
        deviation = start_rate_deviation(pieces)
        ratio = excess(model, [pieces[k] for k in chosen], deviation)
        bands = [band_of(model, piece, deviation, ratio, fit) for piece in progress.track(others, "bands")]
        found = [model.predicted(piece) for piece in others]
        off = [rms([one - piece.angles]) for one, piece in zip(found, others, strict=True)]
        if not others[0].recorded:
            first[label] = found[0]
        inside = sum(one <= band.half_width for one, band in zip(off, bands, strict=True))
        notes.append(
            f"{label}: {inside} of {len(others)} pieces are within their own bands; starts are "
            f"scaled by {ratio:.2f}, the ratio of the fitted pieces"
        )
        order = np.argsort(off)
        for what, k in (("median", order[(len(off) - 1) // 2]), ("largest", order[-1])):
            value, allowed, goal = float(np.median(off)) if what == "median" else off[k], math.nan, ""
            if label == "fitted parameters" and what == "median":
                allowed, goal = comparisons[0].predicted, "below that of the authors' parameters"
            what = f"{what} rms of the angles of {len(others)} pieces, {label}"
            comparisons.append(
                Comparison(
                    what=what, unit="rad", predicted=value, measured=0.0, allowed=allowed, goal=goal, band=bands[k]
                )
            )
    panels = _panels(others[0], first)
    notes.append(
        f"{len(pieces)} pieces; each starts with the slopes of its first {FIRST} angles, which are uncertain by "
        f"{start_rate_deviation(smoothed):.2g} rad/s, or with the rates of its first row, by {deviation:.2g} rad/s"
    )
    if own is not None:
        at = own.model
        dry = f", dry frictions {_listed(at.dry)} N m" if at.dry else ""
        notes.append(
            f"fitted to {count} pieces: centres {_listed(at.centres)} m, inertias {_listed(at.inertias)} kg m2, "
            f"frictions {_listed(at.frictions)} N m s/rad{dry}"
        )
    title = f"{others[0].name}: predicted from its first rows, and measured"
    return Verdict(
        comparisons=tuple(comparisons),
        figures=(Figure(name=name, title=title, panels=panels, height=stacked(len(panels))),),
        notes=tuple(notes),
    )


def _listed(values: Sequence[float]) -> str:
    return ", ".join(f"{one:.4g}" for one in values)


def _panels(piece: Piece, predictions: dict[str, Array]) -> list[Panel]:
    """Angles of each arm over time, and the differences."""
    panels = []
    for k in range(piece.angles.shape[1]):
        lines = [Line(x=piece.time, y=piece.angles[:, k], label="measured", color="gray", width=2.5)]
        lines += [
            Line(x=piece.time, y=found[:, k], label=label, color=c, style="--" if c else "-")
            for c, (label, found) in enumerate(predictions.items())
        ]
        panels.append(Panel(x_label="time, s", y_label=f"angle of arm {k + 1}, rad", lines=lines))
    lines = []
    for c, (label, found) in enumerate(predictions.items()):
        for k in range(piece.angles.shape[1]):
            style = ("-", "--", ":")[k]
            lines.append(
                Line(
                    x=piece.time,
                    y=1e3 * (found - piece.angles)[:, k],
                    color=c,
                    style=style,
                    label=f"{label}, arm {k + 1}",
                )
            )
    panels.append(Panel(x_label="time, s", y_label="predicted less measured, mrad", lines=lines))
    return panels


BUDGET = Budget(
    contributions=(
        Contribution(
            name="start", kind="measurement", size="of the rates at the start of a piece",
            source="cubics and quartics through the first angles differ by it; recorded rates deviate by it",
        ),
        Contribution(
            name="excess of fitted pieces", kind="measurement", size="part of `start`, so that both explain them",
            source="ratio by which fitted pieces differ more than by their starts (Birge), 1 or more",
        ),
        Contribution(
            name="fit", kind="parameters", size="covariance of the fit, residuals correlated",
            source="the fitted pieces; not known of the authors' parameters",
        ),
        Contribution(name="tolerance", kind="numerics", size="change by a hundredth of it", source="computed"),
    ),
    widened="the ratio of the fitted pieces was added since with their starts alone 11 of 16 (double) and 7 of 12 "
    "(triple) pieces were within their bands",
)  # fmt: skip


def _set(name: str, title: str) -> Set:
    return Set(
        name=name, title=title, source=SOURCE, Settings=Settings, budget=BUDGET,
        run=lambda settings, data: run(name, settings, data),
    )  # fmt: skip


SETS = {
    "double-pendulum": _set("double-pendulum", "Swings of a double pendulum, from the first rows of every piece"),
    "triple-pendulum": _set("triple-pendulum", "Swings of a triple pendulum, from the first rows of every piece"),
}
