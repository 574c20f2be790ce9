"""What the claims of Belyakov (2002) on the motion are measured by: (1.1), (1.2), steps 5 and 8, the release.

The motion of the package is held against equations that are written down here from the text.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from evolvent_massprops.inertia import Stand, equilibrium, linear_model
from evolvent_papers.papers.stand import grid, simulated
from evolvent_papers.papers.stand_scheme import GRAVITY, STEP, Bodies, Steps

Values = Mapping[str, float]
#: Offset of the centre of mass, m, at which the motion is compared, and duration, s.
AT, DURATION = (0.4, 0.174), 12.24
#: Samples a second, Hz, of velocities whose differences give accelerations.
FINE = 2000.0


def equations_of_motion() -> Values:
    """Motion by (1.1) and (1.2) beside the package's at (0.4, 0.174) m, and the shift of its frequencies.

    `apart` is the largest distance, mm, of the heights in 12.24 s; `once` and `twice` are the largest shifts, ppm, of a
    frequency from the linear model's without offset, by the load and by twice the load.
    """
    bodies = Bodies((AT,), Steps())
    levers, tensor = bodies.r[0].copy(), bodies.tensor[0].copy()
    run = simulated(*AT, solver__method="dop853", solver__step="auto", sensors__rate=50.0)[0]

    def rates(t: float, state: np.ndarray) -> np.ndarray:
        y, v, w, turn = state[:3], state[3:6], state[6:9], state[9:].reshape(3, 3)
        bodies.y, bodies.r, bodies.tensor = y[None], (levers @ turn.T)[None], (turn @ tensor @ turn.T)[None]
        a, e = bodies.accelerations(w[None])
        return np.concatenate([v, a[0], e[0], np.cross(w, turn.T).T.ravel()])

    start = np.concatenate([bodies.y[0], np.zeros(6), np.eye(3).ravel()])
    times = run.time.values[run.time.values <= DURATION + 1e-9]
    found = scipy.integrate.solve_ivp(rates, (0.0, times[-1]), start, "DOP853", times, rtol=1e-9, atol=1e-11).y.T
    turns = found[:, 9:].reshape(-1, 3, 3)
    heights = found[:, 1, None] + (levers @ turns.transpose(0, 2, 1))[:, :, 1]
    theirs = run.sensor_true.values[: len(times)]
    apart = 1e3 * float(np.abs(heights - heights[0] - theirs + theirs[0]).max())
    return {"apart": apart, "once": _shift(1.0), "twice": _shift(2.0)}


def _shift(factor: float) -> float:
    """Largest shift, ppm, of a simulated frequency from the linear model's, by a multiple of the load."""
    load = [0.0, factor * float(grid().case.excitation.force[1]), 0.0]
    run = simulated(0.0, 0.0, excitation__force=load)[0]
    return 1e6 * float(np.abs(run.mode_frequency.values / run.mode_frequency_linear.values - 1.0).max())


def kinds_of_motion() -> Values:
    """Axes of the modes with the centre of mass at (0.4, 0.174) m, six degrees of freedom, at the tilted rest.

    Largest slope of the axes of pitch and roll to the horizontal, deg, and angle between them, deg; largest horizontal
    part of the motion of the centre of mass in heave, of its vertical part.
    """
    over = grid()
    modes = linear_model(over.stand, over.body(*AT)).modes()
    directions = modes.axes()[1]
    pitch, roll = (directions[modes.kinds.index(kind)] for kind in ("pitch", "roll"))
    slope = max(abs(float(one[1])) / float(np.linalg.norm(one)) for one in (pitch, roll))
    cosine = abs(float(pitch @ roll)) / float(np.linalg.norm(pitch) * np.linalg.norm(roll))
    shape = np.abs(modes.shapes[..., :3, modes.kinds.index("heave")])
    return {
        "slope": float(np.degrees(np.arcsin(slope))),
        "angle": float(np.degrees(np.arccos(cosine))),
        "sideways": 100.0 * float(np.hypot(shape[0], shape[2]) / shape[1]),
    }


def stiffness_centre() -> Values:
    """Distance, mm, from the springs' middle of the point at which a load down tilts the body by nothing.

    From equilibria of the hanging body, with its centre of mass at (0.4, 0.174) m: `equal` springs; spring 1 is 1 %
    `stiffer`.
    """
    over, found = grid(), dict[str, float]()
    load = np.array(over.case.excitation.force)
    places = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, 0.1]])
    for name, more in (("equal", 0.0), ("stiffer", 0.01)):
        k = over.stand.stiffness * np.array([1.0 + more, 1.0, 1.0, 1.0])
        springs = Stand(points=over.stand.points, stiffness=k, length=over.stand.length)
        rest = equilibrium(springs, over.body(*AT)).rotation
        turns = [equilibrium(springs, over.body(*AT), force=load, point=p).rotation @ rest.T for p in places]
        tilts = np.array([[turn[2, 1] - turn[1, 2], turn[1, 0] - turn[0, 1]] for turn in turns])
        slopes = (tilts[1:] - tilts[0]).T / 0.1  # over x and z
        found[name] = 1e3 * float(np.linalg.norm(np.linalg.solve(slopes, tilts[0])))
    return found


def step_5() -> Values:
    """Largest difference of the package's accelerations from sum F / M + g, with its own forces, of the largest, %.

    `without` is the same without g.
    """
    run = simulated(*AT, solver__method="dop853", solver__step="auto", sensors__rate=FINE, sensors__duration=1.2)[0]
    force = np.zeros((run.sizes["time"], 3))
    for k in range(1, 5):
        ends = run[f"spring-{k}"].ends.values
        along = ends[:, 0] - ends[:, 1]
        pull = run[f"spring-{k}"].force.values
        force += pull[:, None] * along / np.linalg.norm(along, axis=1)[:, None]
    velocity = run["body"].velocity.values
    a = (velocity[2:] - velocity[:-2]) * (0.5 * FINE)
    by_force = force[1:-1] / float(grid().case.body.mass)
    size = float(np.linalg.norm(a, axis=1).max())
    apart = {"right": by_force + GRAVITY - a, "without": by_force - a}
    return {name: 100.0 * float(np.linalg.norm(rest, axis=1).max()) / size for name, rest in apart.items()}


def step_8() -> Values:
    """Largest |y_n+1 - y_n - (v_n + v_n+1) dt/2|, mm, at steps of 6 ms: of the package's modified Euler, of DOP853.

    It is zero where position and velocity follow from one acceleration over the step, as step 8 has it.
    """
    found = {}
    for name, method, step in (("right", "modified-euler", STEP), ("other", "dop853", "auto")):
        run: Any = simulated(*AT, solver__method=method, solver__step=step, sensors__rate=1.0 / STEP)[0]
        y, v = run["body"].position.values, run["body"].velocity.values
        found[name] = max(1e3 * float(np.abs(np.diff(y, axis=0) - 0.5 * STEP * (v[1:] + v[:-1])).max()), 1e-9)
    return found


def release() -> Values:
    """The load of 1000 kgf at spring 1 by the paper's steps, written down in NumPy, from where the package starts.

    `held` is how far, mm, an attachment moves in 12.24 s with the load on, at (0.4, 0.174) m. Without offset: `deep`
    is how deep, mm, the load has pulled spring 1, `closed` is 3 F / 4 k; the load is removed, and `swing` is the
    distance of the highest and lowest place of that spring, mm, `first` the first acceleration of the centre of mass,
    of F / M.
    """
    load = np.array(grid().case.excitation.force)
    held = Bodies((AT,), Steps())
    held.load = load
    held.a, held.e = held.accelerations(held.w)
    before, moved = held.sensors(), 0.0
    free = Bodies(((0.0, 0.0),), Steps())
    first = float(free.a[0, 1]) * free.mass / -float(load[1])
    low = high = deep = float(free.sensors()[0, 0])
    for _ in range(round(DURATION / STEP)):
        held.advance(STEP)
        free.advance(STEP)
        moved = max(moved, float(np.abs(held.sensors() - before).max()))
        height = float(free.sensors()[0, 0])
        low, high = min(low, height), max(high, height)
    closed = 0.75 * -float(load[1]) / free.stiffness
    found = {"held": max(moved, 1e-9), "deep": -deep, "closed": closed, "swing": high - low}
    return {name: 1e3 * value for name, value in found.items()} | {"first": first}
