"""What the claims of Belyakov (2002) on the pendulum are measured by."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from evolvent import parts
from evolvent.analysis.system import System
from evolvent.solvers import solve
from evolvent_massprops.inertia import Body, Stand, from_three_frequencies, vertical_model
from evolvent_massprops.inertia.pendulums import budget, compound
from evolvent_papers.papers.stand import grid

Values = Mapping[str, float]
GRAVITY = 9.80665
#: Offset of the centre of mass, m, at which the stand is compared.
AT = (0.4, 0.1)
#: Standard uncertainties: frequency and mass, relative; a distance, and half a spacing of the springs, m; a stiffness,
#: relative.
FREQUENCY, MASS, DISTANCE, SPACING, STIFFNESS = 1e-4, 2e-4, 5e-4, 3e-4, 1e-3


def equation() -> Values:
    """Frequencies of the paper's body on a hinge 2 m above its centre of mass, rad/s, simulated as a multibody system.

    `closed` is sqrt(g r / rho^2) with rho^2 = Ixx/M + r^2; `small` and `wide` are of swings of 0.01 and 0.5 rad;
    `lower` is by how much the latter is below `closed`, %, and `bend` A^2/16.
    """
    body, distance = grid().case.body, 2.0
    square = body.inertia[0] / body.mass + distance**2
    closed = float(np.sqrt(GRAVITY * distance / square))
    swings = {"small": 0.01, "wide": 0.5}
    found = {name: _frequency(body.mass, body.inertia[0], distance, angle) for name, angle in swings.items()}
    return {"closed": closed, **found, "lower": 100.0 * (1.0 - found["wide"] / closed), "bend": 100.0 * 0.5**2 / 16.0}


def _frequency(mass: float, moment: float, distance: float, angle: float) -> float:
    """Frequency, rad/s, of a swing of an amplitude, rad, from the times at which it passes the vertical."""
    system = System(gravity=(0.0, -GRAVITY, 0.0))
    start = (distance * np.sin(angle), -distance * np.cos(angle), 0.0)
    system.add(parts.RigidBody(mass=mass, inertia=moment, position=start), "body")
    joint = parts.Joint(a="ground", b="body", type="revolute", position=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0))
    system.add(joint, "hinge")
    times = np.linspace(0.0, 12.0, 1201)
    x = solve(system.assemble(), samples=times, method="dopri5", rtol=1e-9, atol=1e-10).y[:, 0]
    before = np.flatnonzero(x[:-1] * x[1:] < 0.0)
    slope = (x[before + 1] - x[before]) / (times[before + 1] - times[before])
    crossing = times[before] - x[before] / slope
    return float(np.pi * (len(crossing) - 1) / (crossing[-1] - crossing[0]))


def distance() -> Values:
    """Standard uncertainties of Ixx, %, by a pendulum at 2 m, at the radius of inertia and at 0.1 m from its pivot.

    `ratio` is the moment about the pivot at 2 m over that about the centre of mass.
    """
    body = grid().case.body
    moment, mass = body.inertia[0], body.mass
    radius = float(np.sqrt(moment / mass))
    found = {n: _uncertainty(moment, r) for n, r in (("far", 2.0), ("near_best", radius), ("near", 0.1))}
    return found | {"ratio": 1.0 + mass * 4.0 / moment, "at": radius}


def _uncertainty(moment: float, distance: float) -> float:
    """Standard uncertainty, %, of a moment by a pendulum whose centre of mass is at a distance, m, from its pivot."""
    mass = grid().case.body.mass
    w = float(np.sqrt(mass * GRAVITY * distance / (moment + mass * distance**2)))
    known = {"frequency": w, "mass": mass, "distance": distance}
    found = budget(compound, known, {"frequency": FREQUENCY * w, "mass": MASS * mass, "distance": DISTANCE})
    return 100.0 * float(np.linalg.norm(found.contribution)) / moment


def beside_the_stand() -> Values:
    """Standard uncertainties, %, of Ixx and Izz by the stand and by a pendulum 2 m below its pivot."""
    over = grid()
    case = over.case
    mass, frequency = case.body.mass, over.modes(*AT).natural_frequency
    values = [*frequency, case.stand.half_length, case.stand.half_width, *AT, mass, 1.0, 1.0, 1.0, 1.0]
    lengths = [SPACING, SPACING, DISTANCE, DISTANCE]
    deviations = np.array([*(FREQUENCY * frequency), *lengths, MASS * mass, *[STIFFNESS] * 4])

    def moments(x: np.ndarray) -> np.ndarray:
        given = Stand.rectangle(x[3], x[4], stiffness=case.stand.stiffness * x[8:], length=case.stand.natural_length)
        body = Body(mass=x[7], centre=[x[5], 0.0, x[6]], inertia=case.body.tensor)
        return identified(given, body, x[:3])

    x = np.array(values)
    slopes = [moments(x + 0.5 * row) - moments(x - 0.5 * row) for row in np.diag(deviations)]
    by_stand = 100.0 * np.sqrt(np.sum(np.square(slopes), axis=0)) / np.array(case.body.inertia)[[0, 2]]
    stand = {"stand_xx": float(by_stand[0]), "stand_zz": float(by_stand[1])}
    return stand | {f"pendulum_{name}": _uncertainty(case.body.inertia[k], 2.0) for name, k in (("xx", 0), ("zz", 2))}


def identified(given: Stand, body: Body, frequency: np.ndarray) -> np.ndarray:
    """(2,) Ixx, Izz by three frequencies, the solution whose shapes agree."""
    over = grid()
    shapes = vertical_model(over.stand, over.body(body.centre[0], body.centre[2])).modes().at(given.points)
    found = from_three_frequencies(given, body, frequency, shapes=shapes, points=given.points)
    return np.array([found["Ixx"], found["Izz"]])
