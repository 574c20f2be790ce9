"""A motor-driven arm with joint friction: motion by the measured torque, and torque by the measured motion.

The arm is a rigid body on a revolute joint with viscous and Coulomb friction, and the motor's torque is the measured
history. Moment of inertia, weight and frictions are fitted to one record by `evolvent calibrate`; the other one is
predicted until the arm first stands upright: its motion over pieces of half a second, each from its own start, and the
torque of a motor that follows its measured motion. Near the upright position errors grow by a factor of about nine in
half a second.

Source: dfki-ric-underactuated-lab/torque_limited_simple_pendulum (BSD-3-Clause).
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import pathlib
import tempfile
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy

from evolvent import cases
from evolvent.analysis.runs import solve
from evolvent.analysis.system import System
from evolvent.design import calibration
from evolvent_base import answer as an, progress
from evolvent_base.errors import InputError, RunFailed
from evolvent_base.figures import Figure, Line, Panel, stacked
from evolvent_papers.laboratory import arm_torque, book, tables
from evolvent_papers.laboratory.arm_torque import Sampled
from evolvent_papers.laboratory.book import Array, Band, Budget, Comparison, Contribution, NoSettings, Set, Verdict, rms

SOURCE = (
    "public repository dfki-ric-underactuated-lab/torque_limited_simple_pendulum, folder results, commit ed17ea2; "
    "BSD-3-Clause licence"
)
HEAD = ("time", "position", "velocity", "torque")
FITTED, PREDICTED = "pd-identification.csv", "energy-shaping.csv"
GRAVITY = 9.81
#: Distance of the centre of mass in the model, m: motion and torque do not depend on it, only on weight and inertia.
CENTRE = 0.2
#: Duration of a piece, s; half the window of a start's slope, s; upright is nearer than this, rad.
PIECE, WINDOW, UPRIGHT = 0.5, 0.04, 0.1
#: Torques are compared below this frequency, Hz.
BELOW = 4.0
#: Duration at both ends of a record that filtered values are not compared over, s.
EDGE = 1.0 / BELOW
#: Gains of the motor that follows a measured motion, N m/rad and N m s/rad.
GAINS = (4000.0, 40.0)
#: Resolution of the recorded angle, rad.
STEP = 0.002914
TOLERANCE, FINE = 1e-5, 1e-7
FIT = ("parts.arm.mass", "parts.arm.inertia", "parts.bearing.damping", "parts.bearing.friction")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arm:
    """Parameters of the arm.

    Attributes
    ----------
    inertia : float, kg m2, about the joint
    weight : float, N m, torque that holds the arm horizontally
    viscous : float, N m s/rad; dry : float, N m, friction of the joint
    """

    inertia: float
    weight: float
    viscous: float
    dry: float

    @property
    def mass(self) -> float:
        """Mass of the model, at `CENTRE`, kg."""
        return self.weight / GRAVITY / CENTRE

    def parts(self, motor: Mapping[str, Any], angle: float = 0.0, rate: float = 0.0) -> dict[str, Any]:
        """Parts of a case at a start.

        Parameters
        ----------
        motor : keys of the motor
        angle : float, rad, from hanging; rate : float, rad/s
        """
        x, y = CENTRE * math.sin(angle), -CENTRE * math.cos(angle)
        arm = {
            "kind": "rigid-body", "mass": self.mass, "inertia": self.inertia - self.mass * CENTRE**2,
            "points": {"joint": [0.0, CENTRE, 0.0]}, "position": [x, y, 0.0], "velocity": [-rate * y, rate * x, 0.0],
            "orientation": [math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)],
            "angular_velocity": [0.0, 0.0, rate],
        }  # fmt: skip
        pivot = {"kind": "joint", "a": [0.0, 0.0, 0.0], "b": "arm.joint", "type": "revolute", "axis": [0.0, 0.0, 1.0]}
        bearing = {
            "kind": "joint-spring", "joint": "pivot", "start": angle, "damping": self.viscous,
            "friction": self.dry,
        }  # fmt: skip
        return {"arm": arm, "pivot": pivot, "bearing": bearing, "motor": {"kind": "motor", "joint": "bearing", **motor}}

    def system(self, motor: Mapping[str, Any], angle: float, rate: float) -> System:
        """The arm at a start."""
        case = {"system": "structure", "gravity": [0.0, -GRAVITY, 0.0], "parts": self.parts(motor, angle, rate)}
        found: System = cases.system("structure").build(cases.load(case))
        return found


#: What the authors published: their least squares on the first record (its friction is Fc atan(100 rate), and tends to
#: pi/2 Fc), and another file, of a point mass of 0.546 kg at 0.4 m.
PUBLISHED = {
    "the authors' least squares": Arm(
        inertia=0.06259, weight=0.1022 * GRAVITY, viscous=0.04707, dry=0.1839 * math.pi / 2
    ),
    "the authors' other file": Arm(inertia=0.546 * 0.4**2, weight=0.546 * 0.4 * GRAVITY, viscous=0.1, dry=1.3),
}  # fmt: skip


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Record:
    """A recorded motion: (nt,) float each; s from 0, rad from hanging, N m."""

    name: str
    time: Array
    angle: Array
    torque: Array

    def part(self, first: int, last: int) -> Record:
        """Rows from one to before another, time from 0."""
        own = slice(first, last)
        time = self.time[own] - self.time[first]
        return Record(name=self.name, time=time, angle=self.angle[own], torque=self.torque[own])

    @property
    def upright(self) -> int:
        """First row at which the arm stands upright, or the number of rows."""
        stands = np.abs(np.abs(self.angle) - math.pi) < UPRIGHT
        return int(np.argmax(stands)) if stands.any() else self.time.size

    def pieces(self) -> list[Piece]:
        """Pieces from the first row on, each with its start."""
        edges = np.searchsorted(self.time, np.arange(0.0, self.time[-1] + 1e-9, PIECE))
        return [
            Piece(record=self.part(a, b + 1), start=self._start(a), deviation=self._deviation(a))
            for a, b in itertools.pairwise(edges)
        ]

    def _through(self, row: int) -> tuple[Array, Array]:
        near = np.abs(self.time - self.time[row]) <= WINDOW
        return self.time[near] - self.time[row], self.angle[near]

    def _start(self, row: int) -> Array:
        time, angle = self._through(row)
        return np.asarray(np.polynomial.polynomial.polyfit(time, angle, 3)[:2])

    def _deviation(self, row: int) -> Array:
        """Standard deviations of angle and rate of a start: by the residual of the cubic and the resolution."""
        time, angle = self._through(row)
        A = np.vander(time, 4, increasing=True)
        off = angle - A @ np.linalg.lstsq(A, angle, rcond=None)[0]
        noise = max(float(off @ off) / max(off.size - 4, 1), STEP**2 / 12.0)
        return np.asarray(np.sqrt(noise * np.diag(np.linalg.inv(A.T @ A))[:2]))

    def until(self, time: float) -> Record:
        """Rows up to a time, s."""
        return self.part(0, int(np.searchsorted(self.time, time, "right")))

    @property
    def inner(self) -> Array:
        """Which of the even times are further than `EDGE` from both ends: (nt,) bool."""
        time = self.smooth[0]
        return np.asarray((time >= EDGE) & (time <= time[-1] - EDGE))

    @functools.cached_property
    def sampled(self) -> Sampled:
        """The record at even times."""
        return Sampled.of(self.name, self.time, self.angle, self.torque)

    @functools.cached_property
    def smooth(self) -> tuple[Array, Array, Array]:
        """Even times, angle and torque below `BELOW`, by a Butterworth filter of order 2, forwards and backwards."""
        even = self.sampled
        return even.time, even.low(even.angle, BELOW), even.low(even.torque, BELOW)


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """A part of a record, with angle and rate at its start and their standard deviations, rad and rad/s."""

    record: Record
    start: Array
    deviation: Array


# ------------------------------------------------------------------------------------------------ predictions


def _solved(arm: Arm, motor: Mapping[str, Any], start: Array, time: Array, tolerance: float) -> tuple[Array, Array]:
    """Angle and rate at even times: (nt,) float each."""
    solution, _, _ = solve(
        arm.system(motor, float(start[0]), float(start[1])).assemble(), until=float(time[-1]), fine=False,
        every=float(time[-1]) / (time.size - 1), method="dopri5", tolerance=tolerance,
    )  # fmt: skip
    if not solution.success:
        raise RunFailed(solution.message, None)
    y, body = solution.y, solution.model.bodies[-1]
    at = int(body["iq"])
    turned = np.unwrap(2.0 * np.arctan2(y[:, at + 6], y[:, at + 3]))
    return start[0] + turned - turned[0], np.asarray(y[:, int(body["iv"]) + 5])


def motion(arm: Arm, piece: Piece, *, tolerance: float = TOLERANCE, start: Array | None = None) -> Array:
    """Angle at the times of a piece by its measured torque: (nt,) float, rad."""
    record = piece.record
    motor = {"torque": np.stack([record.time, record.torque], axis=1).tolist()}
    even = np.linspace(0.0, record.time[-1], record.time.size)
    found, _ = _solved(arm, motor, piece.start if start is None else start, even, tolerance)
    return np.interp(record.time, even, found)


def torque(arm: Arm, record: Record, *, tolerance: float = TOLERANCE) -> Array:
    """Torque of a motor that follows the measured motion, below `BELOW`: (nt,) float, N m, at even times."""
    time, angle, _ = record.smooth
    some = np.unique(np.append(np.arange(0, time.size, 3), time.size - 1))
    motor = {
        "motion": {"table": {"time": time[some].tolist(), "angle": angle[some].tolist()}},
        "position_gain": GAINS[0], "velocity_gain": GAINS[1],
    }  # fmt: skip
    wanted = scipy.interpolate.CubicSpline(time[some], angle[some])
    start = np.array([float(wanted(0.0)), float(wanted(0.0, 1))])
    found, rate = _solved(arm, motor, start, time, tolerance)
    drives = GAINS[0] * (wanted(time) - found) + GAINS[1] * (wanted(time, 1) - rate)
    return record.sampled.low(drives, BELOW)


# ------------------------------------------------------------------------------------------------ fit


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """Arm fitted to a record, with the covariance of mass, inertia and frictions as `evolvent calibrate` names them."""

    values: Array
    covariance: Array
    rms: float

    @staticmethod
    def at(values: Array) -> Arm:
        """The arm with the values of the keys `FIT`."""
        mass, inertia, viscous, dry = (float(one) for one in values)
        return Arm(
            inertia=inertia + mass * CENTRE**2, weight=mass * GRAVITY * CENTRE, viscous=max(viscous, 0.0),
            dry=max(dry, 0.0),
        )  # fmt: skip

    @property
    def arm(self) -> Arm:
        """The fitted arm."""
        return self.at(self.values)


#: Where the fit starts: round numbers of an arm of half a kilogram at 0.5 m.
START = Arm(inertia=0.14, weight=2.8, viscous=0.03, dry=0.25)


def fitted(record: Record) -> Fit:
    """The arm by the motion of a whole record from rest, driven by its measured torque (`evolvent calibrate`)."""
    motor = {"torque": np.stack([record.time, record.torque], axis=1).tolist()}
    content = {
        "system": "structure", "gravity": [0.0, -GRAVITY, 0.0], "parts": START.parts(motor, float(record.angle[0])),
        "simulate": {"until": float(record.time[-1]), "every": 0.02, "method": "dopri5", "tolerance": 1e-4},
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "motion.csv"
        rows = "".join(f"{t:.6f},{x:.6f}\n" for t, x in zip(record.time[::6], record.angle[::6], strict=True))
        path.write_text(f"time (s),angle (rad)\n{rows}", encoding="utf-8")
        found = calibration.calibrate(
            content, str(path), fit=FIT, observe=["bearing.angle=angle"],
            progress=lambda count, _: progress.report("fitting", unit="evaluations"),
        )  # fmt: skip
    each = book.samples_per_independent([found.residuals])
    covariance = found.correlation * np.outer(found.errors, found.errors)
    count, p = found.residuals.size, found.values.size
    return Fit(values=found.values, covariance=covariance * (count - p) / max(count / each - p, 1.0), rms=found.rms)


# ------------------------------------------------------------------------------------------------ verdict


def records_of(folder: str | None) -> tuple[Record, Record]:
    """The record that is fitted, and the one that is predicted.

    Raises
    ------
    InputError
        If one of them is missing or cannot be read.
    """
    stored = dict(tables.contents(folder, pathlib.Path(__file__).with_name("data") / "driven-arm.zip"))
    found = []
    for name in (FITTED, PREDICTED):
        if name not in stored:
            raise InputError(f"{folder} has no file {name}; it needs {FITTED} and {PREDICTED}")
        values = tables.table(name, stored[name], HEAD)
        record = Record(name=name, time=values[:, 0] - values[0, 0], angle=values[:, 1], torque=values[:, 3])
        if np.any(np.diff(record.time) <= 0.0) or record.time[-1] < 2.0 * PIECE:
            raise InputError(f"{name}: times must rise, over {2.0 * PIECE:g} s or more")
        found.append(record)
    return found[0], found[1]


def _torque_size(record: Record) -> float:
    """Root mean square of the measured torque below `BELOW`, N m."""
    return rms([record.smooth[2][record.inner]])


def _torque_off(arm: Arm, record: Record) -> float:
    """Root mean square by which the torque for the measured motion differs from the measured one, N m."""
    return rms([(torque(arm, record) - record.smooth[2])[record.inner]])


def _motion_band(fit: Fit, piece: Piece) -> Band:
    """Band of the angle over a piece."""
    arm, base = fit.arm, motion(fit.arm, piece)
    squares = np.zeros_like(base)
    for k in (0, 1):
        moved = piece.start.copy()
        moved[k] += piece.deviation[k]
        squares = squares + (motion(arm, piece, start=moved) - base) ** 2
    return Band(
        measurement=math.hypot(rms([np.sqrt(squares)]), STEP / math.sqrt(12.0)),
        parameters=rms([book.by_parameters(lambda x: motion(fit.at(x), piece), fit.values, fit.covariance)]),
        numerics=rms([motion(arm, piece, tolerance=FINE) - base]),
        how="measurement: resolution of the angle, angle and rate at the start; parameters: covariance of the fit, "
        "residuals correlated; numerics: a hundredth of the tolerance",
    )


def _together(bands: Sequence[Band]) -> Band:
    """Band of the root mean square over all pieces."""
    return Band(
        measurement=rms([np.array([one.measurement for one in bands])]),
        parameters=rms([np.array([one.parameters for one in bands])]),
        numerics=rms([np.array([one.numerics for one in bands])]), how=bands[0].how,
    )  # fmt: skip


def run(settings: NoSettings, data: str | None) -> Verdict:
    """Fit one record, and predict the other."""
    basis, whole = records_of(data)
    swing = whole.part(0, whole.upright)
    fit = fitted(basis)
    arm, pieces = fit.arm, swing.pieces()
    if not pieces:
        raise InputError(f"{whole.name} stands upright within {PIECE:g} s; nothing is left to predict")
    # the measured torque of a record that was fitted says how far torque and motion agree at all
    unexplained = _torque_off(arm, basis) / _torque_size(basis)
    bands = [_motion_band(fit, piece) for piece in progress.track(pieces, "bands")]
    driven = whole.until(swing.time[-1] + EDGE)
    found, inner, size = torque(arm, driven), driven.inner, _torque_size(driven)
    torque_band = Band(
        measurement=unexplained * size,
        parameters=rms([book.by_parameters(lambda x: torque(fit.at(x), driven)[inner], fit.values, fit.covariance)]),
        numerics=rms([(torque(arm, driven, tolerance=FINE) - found)[inner]]),
        how="measurement: share of the torque of the fitted record that no motion explains, most of it its noise; "
        "parameters: covariance of the fit, residuals correlated; numerics: a hundredth of the tolerance; not "
        "contained: windup of the drive, error of the angle sensor",
    )
    predicted = [motion(arm, piece) for piece in pieces]
    off = [rms([one - piece.record.angle]) for one, piece in zip(predicted, pieces, strict=True)]
    worst = int(np.argmax(off))
    comparisons = (
        Comparison(
            what=f"rms of the angle, {len(pieces)} pieces of {PIECE:g} s", unit="rad", predicted=rms([np.array(off)]),
            measured=0.0, band=_together(bands), allowed=0.05, goal="at most 0.05 rad",
        ),
        Comparison(
            what="largest rms of the angle of a piece", unit="rad", predicted=off[worst], measured=0.0,
            band=bands[worst],
        ),
        Comparison(
            what=f"rms of the torque below {BELOW:g} Hz", unit="N m", predicted=_torque_off(arm, driven),
            measured=0.0, band=torque_band, allowed=0.1 * size, goal=f"at most 10 % of {size:.3g} N m",
        ),
    )  # fmt: skip
    notes = [
        f"fitted to {basis.name}: moment of inertia {arm.inertia:.4f} kg m2, weight {arm.weight:.3f} N m, viscous "
        f"friction {arm.viscous:.4f} N m s/rad, Coulomb friction {arm.dry:.3f} N m; {fit.rms:.3f} rad rms; "
        f"{100.0 * unexplained:.0f} % of its own torque are not those of a rigid arm",
        f"torque of {whole.name}: {100.0 * comparisons[2].predicted / size:.0f} % rms off, until the arm stands "
        f"upright at {swing.time[-1]:.2f} s",
    ]
    for label, other in PUBLISHED.items():
        own = rms([np.array([rms([motion(other, piece) - piece.record.angle]) for piece in pieces])])
        share = _torque_off(other, driven) / size
        notes.append(f"{label}: {own:.3f} rad rms, torque {100.0 * share:.0f} % rms off")
    beyond = torque(arm, whole) - whole.smooth[2]
    after = whole.inner & (np.arange(beyond.size) >= whole.upright)
    if after.any():
        k = int(np.argmax(np.abs(beyond) * after))
        notes.append(
            f"after that the arm is pushed: at {whole.smooth[0][k]:.1f} s its motion takes {abs(beyond[k]):.1f} N m "
            f"more than the motor gives"
        )
    figures, shown = [_figure(swing, pieces, predicted, driven, found)], tuple[an.Table, ...]()
    made_of = arm_torque.explained(basis.sampled, whole.sampled, swing.time[-1], BELOW)
    if made_of is not None:
        figures.append(made_of.figure)
        notes += made_of.notes
        shown = made_of.tables
    return Verdict(comparisons=comparisons, figures=tuple(figures), notes=tuple(notes), tables=shown)


def _figure(swing: Record, pieces: Sequence[Piece], predicted: Sequence[Array], driven: Record, found: Array) -> Figure:
    """Angle and torque over time."""
    edges = np.cumsum([0.0, *(piece.record.time[-1] for piece in pieces)])
    angles = [Line(x=swing.time, y=swing.angle, label="measured", color="gray", width=2.5)]
    angles += [
        Line(
            x=first + piece.record.time,
            y=one,
            label="predicted from the start of each piece" if k == 0 else "",
            color=0,
        )
        for k, (first, piece, one) in enumerate(zip(edges, pieces, predicted, strict=False))
    ]
    inner = driven.inner
    time, _, measured = (values[inner] for values in driven.smooth)
    torques = [
        Line(x=time, y=measured, label="measured", color="gray", width=2.5),
        Line(x=time, y=found[inner], label="predicted", color=0),
    ]
    panels = [
        Panel(x_label="time, s", y_label="angle, rad", lines=angles),
        Panel(x_label="time, s", y_label=f"torque below {BELOW:g} Hz, N m", lines=torques),
    ]
    title = "Motor-driven arm: predicted and measured"
    return Figure(name="driven-arm", title=title, panels=panels, height=stacked(len(panels)))


BUDGET = Budget(contributions=(
    Contribution(name="resolution", kind="measurement", size="that of the angle", source="the steps of the record"),
    Contribution(
        name="start", kind="measurement", size="of angle and rate at the start of a piece", source="fit to its samples",
    ),
    Contribution(
        name="torque that no motion explains", kind="measurement", size="its share in the fitted record",
        source="the other record",
    ),
    Contribution(
        name="fit", kind="parameters", size="covariance of the fit, residuals correlated", source="the other record",
    ),
    Contribution(name="tolerance", kind="numerics", size="change by a hundredth of it", source="computed"),
))  # fmt: skip
SETS = {
    "driven-arm": Set(
        name="driven-arm", title="Motion and torque of a motor-driven arm with joint friction", source=SOURCE,
        Settings=NoSettings, run=run, budget=BUDGET,
    ),
}  # fmt: skip
