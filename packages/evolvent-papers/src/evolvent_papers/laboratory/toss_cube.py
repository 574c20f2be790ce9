"""A cube with round corners on a board, what flights and poses at rest say of it, and its contact fitted to tosses."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evolvent.analysis.runs import solve
from evolvent.analysis.system import System
from evolvent.parts import Box, Contact, Plane, RigidBody
from evolvent_base.errors import RunFailed
from evolvent_papers.laboratory import book, tables, toss_records
from evolvent_papers.laboratory.toss_records import Array, Fit, Motion, Start, Toss

#: Mass of the cube, kg, as publications on the set report it: motions do not depend on it.
MASS = 0.37
#: Tolerance of the runs, and of those that say how far they are off.
TOLERANCE, FINE = 1e-6, 1e-8
#: What is fitted beside gravity and size, and its start: acrylic on wood, and a hollow cube with thin walls.
NAMES = ("stiffness", "damping", "friction", "rounding", "inertia", "off_x", "off_y", "off_z")
UNITS = ("N/m", "s/m", "", "m", "", "m", "m", "m")
#: Values where a fit starts, those of the offset without one; unit of the offset in a fit, m, others by logarithms.
FIRST, _OFF = (1e5, 3.0, 0.2, 4e-3, 1.0), 0.05
#: Times after the first touch up to which fits before the last one see a toss, s.
SOONER = (0.1,)
#: Damping of the bristles, N s/m, which stick with the contact's stiffness.
BRISTLE_DAMPING = 10.0


class Cube(NamedTuple):
    """A cube and its board, in lengths of the record.

    Attributes
    ----------
    stiffness, damping, friction : float, of a corner's contact, N/m at `MASS`, s/m, 1
    rounding : float, m, radius of edges and corners
    inertia : float, over mass times the square of half the side: 2/3 of a homogeneous cube, 10/9 of thin walls
    off : (3,) float, m, from the centre of mass to that of the cube, which is recorded; axes of the cube
    half : float, m, half the side
    gravity : float, m/s2
    """

    stiffness: float
    damping: float
    friction: float
    rounding: float
    inertia: float
    off: tuple[float, float, float]
    half: float
    gravity: float

    def start(self, toss: Toss) -> Start:
        """The start of a toss by its flight."""
        return toss.start(self.gravity, np.array(self.off))

    def system(self, start: Start) -> System:
        """The cube at a start."""
        found = System(gravity=(0.0, 0.0, -self.gravity))
        x, y, z, w = start.pose.as_quat()
        body = RigidBody(
            mass=MASS, inertia=self.inertia * MASS * self.half**2, points={"centre": self.off},
            position=tuple(start.position), velocity=tuple(start.velocity), orientation=(w, x, y, z),
            angular_velocity=tuple(start.spin),
        )  # fmt: skip
        found.add(body, "cube")
        contact = Contact(
            a="cube.centre", b=(0.0, 0.0, 0.0), shape_a=Box(size=(2.0 * self.half,) * 3),
            shape=Plane(normal=(0.0, 0.0, 1.0)), stiffness=self.stiffness, damping=self.damping,
            friction=self.friction, bristle_stiffness=self.stiffness, bristle_damping=BRISTLE_DAMPING,
            rounding=min(self.rounding, 0.9 * self.half), initial_overlap=1.0,
        )  # fmt: skip
        found.add(contact, "board")
        return found

    def predicted(
        self, toss: Toss, start: Start | None = None, *, rows: int | None = None, tolerance: float = TOLERANCE
    ) -> Motion:
        """Motion of the recorded point from a start, that of the flight if left out, at the first rows of a toss."""
        count = toss.time.size if rows is None else rows
        solution, _, _ = solve(
            self.system(self.start(toss) if start is None else start).assemble(),
            until=(count - 1) * toss.every, every=toss.every, fine=False, method="dopri5", tolerance=tolerance,
        )  # fmt: skip
        if not solution.success:
            raise RunFailed(solution.message, None)
        at = solution.model.bodies["iq"][-1]
        pose = Rotation.from_quat(solution.y[:, [at + 4, at + 5, at + 6, at + 3]])
        return Motion(solution.y[:, at : at + 3] + pose.apply(np.array(self.off)), pose)


class Known(NamedTuple):
    """What records say without a model of the contact, of the tosses to which the contact is fitted.

    Attributes
    ----------
    gravity, off : float and (3,) float, m/s2 and m, by the flights
    gravity_std, off_std : their standard uncertainties
    half, half_std : float, m, heights at rest
    height, tilt : float, m and rad, deviations of a recorded height, and of a recorded normal per axis, at rest
    noise : (2,) float, m and rad, rms of positions and rotations about a flight
    """

    gravity: float
    off: tuple[float, ...]
    gravity_std: float
    off_std: tuple[float, ...]
    half: float
    half_std: float
    height: float
    tilt: float
    noise: tuple[float, float]

    def deviations(self, toss: Toss) -> Array:
        """Standard deviations of a start: position, velocity, rotation, spin; (12,) float."""
        line = np.vander(toss.time[: toss.touch], 2)
        rate, place = np.sqrt(np.diag(np.linalg.inv(line.T @ line)))
        moved, turned = self.noise
        found = np.repeat([place * moved, rate * moved, place * turned, rate * turned], 3)
        found[2] = math.hypot(found[2], self.height)
        found[6:9] = np.hypot(found[6:9], self.tilt)
        return np.asarray(found)


def known_of(tosses: Sequence[Toss]) -> Known:
    """Gravity, offset, size and deviations by flights and poses at rest."""
    flights = [toss.flight for toss in tosses]
    inverse = np.linalg.pinv(np.sum([columns.T @ columns for columns, _ in flights], axis=0), hermitian=True)
    found = inverse @ np.sum([columns.T @ side for columns, side in flights], axis=0)
    gradients = np.array([columns.T @ (columns @ found - side) for columns, side in flights])
    std = np.sqrt(np.diag(inverse @ (gradients.T @ gradients) @ inverse))
    still = [toss for toss in tosses if toss.rests] or list(tosses)
    heights = np.array([toss.height for toss in still])
    noises = [toss.flight_noise(found[0], found[1:]) for toss in tosses]
    moved, turned = np.sqrt(np.mean(np.square(noises), axis=0))
    height = float(np.std(heights, ddof=1)) if heights.size > 1 else 0.0
    return Known(
        float(found[0]), tuple(float(x) for x in found[1:]), float(std[0]), tuple(float(x) for x in std[1:]),
        float(heights.mean()), height / math.sqrt(heights.size), height, book.rms([toss.tilt for toss in still]),
        (float(moved), float(turned)),
    )  # fmt: skip


def cube(numbers: Array, known: Known) -> Cube:
    """A cube by the numbers of a fit: logarithms of `NAMES` but the offset, which has the unit `_OFF`."""
    own = [float(one) for one in np.exp(numbers[:5])]
    x, y, z = (float(one) for one in _OFF * numbers[5:])
    return Cube(own[0], own[1], own[2], own[3], own[4], (x, y, z), known.half, known.gravity)


def fit(tosses: Sequence[Toss], known: Known, horizon: float) -> Fit:
    """`NAMES` by the rows up to `horizon` s after the first touch of each toss, first by those up to `SOONER`."""
    start = np.concatenate([np.log(FIRST), np.zeros(3)])
    return toss_records.fitted(
        lambda numbers, toss, rows: cube(numbers, known).predicted(toss, rows=rows), start, tosses,
        [one for one in SOONER if one < horizon] + [horizon],
    )  # fmt: skip


def meant(numbers: Array) -> Array:
    """Values of `NAMES` by the numbers of a fit: (8,) float."""
    return np.concatenate([np.exp(numbers[:5]), _OFF * numbers[5:]])


def values_of(found: Fit) -> tuple[Array, Array]:
    """Values of `NAMES`, and their standard uncertainties: (8,) float each."""
    values = meant(found.values)
    scale = np.concatenate([values[:5], np.full(3, _OFF)])
    return values, scale * np.sqrt(np.diag(found.covariance))


class Alone(NamedTuple):
    """Damping and friction that each toss asks for by itself, with the other values of a fit.

    Attributes
    ----------
    changes, std : (n, 2) float, relative to the fit
    before, after : float, m, rms of the residuals with the fit and with these
    """

    changes: Array
    std: Array
    before: float
    after: float


def alone(found: Fit, known: Known, tosses: Sequence[Toss]) -> Alone:
    """What the tosses say one by one, linearly, by the rows up to `SOONER`."""
    free = [NAMES.index("damping"), NAMES.index("friction")]
    changes, deviations, before, after = [], [], [], []
    for toss in tosses:
        rows = toss.row_at(SOONER[0]) + 1
        sides = [
            toss_records.residuals(cube(numbers, known).predicted(toss, rows=rows), toss)
            for numbers in (found.sooner, *(found.sooner + 0.02 * np.eye(len(NAMES))[k] for k in free))
        ]
        jacobian = np.column_stack([(side - sides[0]) / 0.02 for side in sides[1:]])
        change, *_ = np.linalg.lstsq(jacobian, -sides[0], rcond=None)
        left = sides[0] + jacobian @ change
        variance = left @ left * book.samples_per_independent([np.reshape(left, (-1, 6))]) / left.size
        changes.append(change)
        deviations.append(np.sqrt(np.diag(np.linalg.pinv(jacobian.T @ jacobian)) * variance))
        before.append(sides[0])
        after.append(left)
    return Alone(np.array(changes), np.array(deviations), book.rms(before), book.rms(after))


def stored_fit() -> tuple[Known, Fit]:
    """What `fitted=0` takes: of 20 tosses of the package, by `python benchmarks/tosses.py`."""
    held = json.loads(tables.stored("tosses.json"))["evolvent"]
    fitted, known = held["fit"], held["known"]
    lists = {key: tuple(known[key]) for key in ("off", "off_std", "noise")}
    return (
        Known(**{**known, **lists}),
        Fit(**{key: np.array(fitted[key]) for key in ("values", "covariance", "sooner")}, cost=float(fitted["cost"])),
    )
