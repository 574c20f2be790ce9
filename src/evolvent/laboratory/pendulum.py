"""Swings of a double and a triple pendulum: angles from the first row of every piece, predicted and measured.

Each piece starts from its own first row. The parameters are those that the authors of the measurements identified, and
those of a fit to ten pieces, spread over the set, with which the others are predicted.

Source: dynamicslab/MultiArm-Pendulum (MIT licence); arXiv 2205.06231.
"""

from __future__ import annotations

import dataclasses
import io
import math
import os
import pathlib
import zipfile
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from evolvent.analysis.system import System
from evolvent.base import progress, safe_open, units
from evolvent.base.errors import InputError
from evolvent.base.schema import Section
from evolvent.laboratory.book import Array, Band, Comparison, Set, Verdict, rms
from evolvent.parts import Joint, RigidBody, RotationalSpring
from evolvent.results.figures import Figure, Line, Panel, stacked

SOURCE = (
    "public repository dynamicslab/MultiArm-Pendulum, folder ParameterEstimation, commit e99a7e1 (arXiv 2205.06231); "
    "MIT licence"
)
#: Tolerance of the runs, and of those that say how far they are off.
TOLERANCE, FINE = 1e-6, 1e-8


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
    """

    masses: tuple[float, ...]
    centres: tuple[float, ...]
    lengths: tuple[float, ...]
    inertias: tuple[float, ...]
    frictions: tuple[float, ...]
    gravity: float

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
            bearing = RotationalSpring(joint=f"pivot {k + 1}", stiffness=0.0, damping=self.frictions[k])
            found.add(bearing, f"bearing {k + 1}")
            if k + 1 < self.arms:
                at, moving = at + self.lengths[k] * along, moving + self.lengths[k] * across
        return found

    def predicted(self, piece: Piece, *, tolerance: float = TOLERANCE, start: Array | None = None) -> Array:
        """Angles at the times of a piece from its first row: (nt, n) float, rad, absolute.

        Parameters
        ----------
        start : (2 n,) float, angles and rates in place of the first row
        """
        n = self.arms
        row = np.concatenate([piece.angles[0], piece.rates[0]]) if start is None else start
        keep = [f"bearing {k + 1}.angle" for k in range(n)]
        run = self.system(row[:n], row[n:]).simulate(
            until=float(piece.time[-1]), every=piece.every, fine=False, method="generalized-alpha", tolerance=tolerance,
            keep=keep,
        )  # fmt: skip
        turned = np.stack([run[name] - run[name][0] for name in keep], axis=1)
        return np.asarray(row[:n] + np.cumsum(turned, axis=1))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Piece:
    """A recorded swing.

    Attributes
    ----------
    name : str
    time : (nt,) float, s, from 0
    angles, rates : (nt, n) float, rad from upward and rad/s, absolute
    """

    name: str
    time: Array
    angles: Array
    rates: Array

    @property
    def every(self) -> float:
        """Time between samples, s."""
        return float(self.time[-1]) / (self.time.size - 1)


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
        description="pieces that the parameters are fitted to, the first ones; the others are predicted; 0 for no fit",
    )
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
    found = []
    for file, text in _texts(name, folder):
        lines = text.splitlines()
        if not lines or [word.strip() for word in lines[0].split(",")] != head:
            if folder is None or not lines or lines[0].count(",") == 2 * arms:
                raise InputError(f"{file}: the first line must be {','.join(head)}")
            continue  # of the other pendulum
        try:
            values = np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1, ndmin=2)
        except ValueError as error:
            raise InputError(f"{file}: it is no table of numbers ({error})") from None
        if len(values) < 2 or not np.all(np.isfinite(values)):
            raise InputError(f"{file}: it needs two rows of finite numbers or more")
        time = values[:, 0] - values[0, 0]
        found.append(Piece(name=file, time=time, angles=values[:, 1 : 1 + arms], rates=values[:, 1 + arms :]))
        if len(found) == most:
            break
    if not found:
        raise InputError(f"{folder} has no CSV file whose first line is {','.join(head)}")
    return found


def _texts(name: str, folder: str | None) -> list[tuple[str, str]]:
    """Names and contents of the files."""
    if folder is None:
        kind = name.partition("-")[0]
        with zipfile.ZipFile(pathlib.Path(__file__).with_name("data") / "pendulum.zip") as stored:
            return [(one, stored.read(one).decode()) for one in sorted(stored.namelist()) if one.startswith(kind)]
    if not os.path.isdir(folder):
        raise InputError(f"{folder!r} is not a folder with CSV files")
    names = sorted(one for one in os.listdir(folder) if one.endswith(".csv"))
    return [(one, safe_open.text(os.path.join(folder, one))) for one in names]


# ------------------------------------------------------------------------------------------------ fit


def fitted(model: Pendulum, pieces: Sequence[Piece]) -> Pendulum:
    """Centres, inertias and frictions by least squares over the angles of pieces; masses and lengths stay.

    Notes
    -----
    Motion alone determines ratios of masses: those of the start are kept. Each piece starts from its first row, as the
    predictions do, and counts beside the root mean square that the model has at the start: first rows have errors, and
    a piece with a large one would govern all others.
    """
    from scipy.optimize import least_squares

    n = model.arms
    scale = np.array([*model.centres, *model.inertias, *(max(one, 1e-5) for one in model.frictions)])
    weights = [1.0 / rms([model.predicted(piece) - piece.angles]) for piece in pieces]

    def at(x: Array) -> Pendulum:
        own = [float(one) for one in x * scale]
        return dataclasses.replace(
            model, centres=tuple(own[:n]), inertias=tuple(own[n : 2 * n]), frictions=tuple(own[2 * n :])
        )

    def residuals(x: Array) -> Array:
        progress.report("fitting", unit="evaluations")
        found = [weight * (at(x).predicted(one) - one.angles) for weight, one in zip(weights, pieces, strict=True)]
        return np.concatenate([np.ravel(one) for one in found])

    start = np.array([*model.centres, *model.inertias, *model.frictions]) / scale
    low = np.concatenate([np.full(2 * n, 0.2), np.zeros(n)])
    high = np.concatenate([np.full(2 * n, 5.0), np.full(n, 100.0)])
    found = least_squares(residuals, start, bounds=(low, high), diff_step=1e-4, x_scale=1.0, ftol=1e-6, xtol=1e-6)
    return at(found.x)


# ------------------------------------------------------------------------------------------------ verdict


def start_rate_deviation(pieces: Sequence[Piece]) -> float:
    """Standard deviation of the rates of the first rows, rad/s: by the slopes of parabolas through the first angles."""
    off = []
    for piece in pieces:
        m = min(9, piece.time.size)
        for k in range(piece.angles.shape[1]):
            slope = np.polynomial.Polynomial.fit(piece.time[:m], piece.angles[:m, k], 3).deriv()(0.0)
            off.append(float(piece.rates[0, k] - slope))
    return float(np.sqrt(np.mean(np.square(off))))


def band_of(model: Pendulum, piece: Piece, deviation: float) -> Array:
    """Standard deviation of the predicted angles by the rates of the first row and by the numerics: (nt, n) float."""
    row = np.concatenate([piece.angles[0], piece.rates[0]])
    base = model.predicted(piece)
    squares = (model.predicted(piece, tolerance=FINE) - base) ** 2
    for k in range(model.arms):
        moved = row.copy()
        moved[model.arms + k] += 0.1 * deviation
        squares = squares + ((model.predicted(piece, start=moved) - base) / 0.1) ** 2
    return np.asarray(np.sqrt(squares))


def run(name: str, settings: Settings, data: str | None) -> Verdict:
    """Predict all pieces with the authors' parameters, and those that were not fitted with fitted ones."""
    pieces = pieces_of(name, data, settings.pieces)
    models = {"authors' parameters": AUTHORS[name]}
    count = min(settings.fitted, len(pieces) - 1)
    chosen = {round((k + 0.5) * len(pieces) / count - 0.5) for k in range(count)} if count > 0 else set()
    if count > 0:
        models["fitted parameters"] = fitted(AUTHORS[name], [pieces[k] for k in chosen])
    others = [piece for k, piece in enumerate(pieces) if k not in chosen]
    deviation = start_rate_deviation(pieces)
    comparisons: list[Comparison] = []
    first: dict[str, Array] = {}
    for label, model in models.items():
        off, bands = [], []
        for piece in progress.track(others, "predicting"):
            found = model.predicted(piece)
            off.append(rms([found - piece.angles]))
            bands.append(rms([band_of(model, piece, deviation)]))
            first.setdefault(label, found)
        for what, reduce in (("median", np.median), ("largest", np.max)):
            allowed, goal = math.nan, ""
            if label == "fitted parameters" and what == "median":
                allowed, goal = comparisons[0].predicted, "below that of the authors' parameters"
            comparisons.append(
                Comparison(
                    what=f"{what} rms of the angles of {len(others)} pieces, {label}", unit="rad",
                    predicted=float(reduce(off)), measured=0.0, allowed=allowed, goal=goal,
                    band=Band(
                        measurement=float(reduce(bands)), parameters=0.0, numerics=0.0,
                        how="rates of the first rows, and ten times their tolerance",
                    ),
                )
            )  # fmt: skip
    panels = _panels(others[0], first)
    own = models.get("fitted parameters")
    notes = [
        f"{len(pieces)} pieces; the rates of the first rows deviate by {deviation:.2g} rad/s from slopes of the "
        f"angles, which is the largest part of the bands",
    ]
    if own is not None:
        notes.append(
            f"fitted to {count} pieces: centres {_listed(own.centres)} m, inertias {_listed(own.inertias)} "
            f"kg m2, frictions {_listed(own.frictions)} N m s/rad"
        )
    title = f"{others[0].name}: predicted from its first row, and measured"
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


def _set(name: str, title: str) -> Set:
    return Set(
        name=name, title=title, source=SOURCE, Settings=Settings, run=lambda settings, data: run(name, settings, data)
    )


SETS = {
    "double-pendulum": _set("double-pendulum", "Swings of a double pendulum, from the first row of every piece"),
    "triple-pendulum": _set("triple-pendulum", "Swings of a triple pendulum, from the first row of every piece"),
}
