"""From a case to the body at rest on its stand, its linear modes and the state that it is let go from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from evolvent import batch
from evolvent.errors import InputError
from evolvent.inertia import Body, LinearModel, NormalModes, Stand, equilibrium, linear_model
from evolvent.motion import quaternions
from evolvent.systems._common import MOST_VALUES
from evolvent.systems.inertia_stand.case import Case

#: Largest number of steps that a run may take.
MOST_STEPS = 100_000_000
#: Relative difference of two frequencies below which they are one.
COINCIDING = 1e-6
#: Components of the inertia tensor.
COMPONENTS = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


class Prepared(NamedTuple):
    """A case with all that is known before it moves.

    Attributes
    ----------
    z : (m,) complex, modal coordinates at the start, of the linear model
    loaded : int, the spring at which the excitation acts, from 0; -1 for none
    suspended : what `batch` integrates
    steps : int, of the method between two samples; 0 for the adaptive one
    """

    case: Case
    stand: Stand
    body: Body
    model: LinearModel
    modes: NormalModes
    z: np.ndarray
    loaded: int
    suspended: batch.Suspended
    steps: int


def stand_of(case: Case) -> Stand:
    """The case's stand."""
    s = case.stand
    return Stand(
        points=s.springs,
        stiffness=s.stiffness,
        length=s.natural_length,
        damping=s.damping,
        lateral_stiffness=s.lateral_stiffness,
        lateral_damping=s.lateral_damping,
        support=s.support,
        gravity=s.gravity,
    )


def body_of(case: Case) -> Body:
    """The case's body."""
    return Body(mass=case.body.mass, centre=case.body.centre, inertia=case.body.tensor)


def prepare(case: Case) -> Prepared:
    """Rest, linear modes and initial state of a case.

    Raises
    ------
    InputError
        If the springs cannot hold the body, or the step or the sampling rate does not suit its highest mode.
    """
    stand, body = stand_of(case), body_of(case)
    model = linear_model(stand, body)
    modes = model.modes()
    highest = float(modes.natural_frequency.max())
    if 2.0 * np.pi * case.sensors.rate <= 2.0 * highest:
        raise InputError(
            f"sensors.rate is {case.sensors.rate:g} Hz; the highest mode has {highest / (2.0 * np.pi):.4g} Hz, so it "
            f"must be above {highest / np.pi:.4g} Hz"
        )
    steps = _steps(case, highest)
    state, z, loaded = _start(case, stand, body, modes)
    n = len(stand.stiffness)
    suspended = batch.Suspended(
        mass=float(body.mass),
        inertia=body.inertia,
        gravity=np.array([0.0, -float(stand.gravity), 0.0]),
        guided=stand.support == "guided",
        attachment=stand.points - body.centre,
        ground=stand.ground_points,
        axis=np.tile([0.0, 1.0, 0.0], (n, 1)),
        stiffness=stand.stiffness,
        damping=stand.damping,
        length=stand.length,
        lateral_stiffness=stand.lateral_stiffness,
        lateral_damping=stand.lateral_damping,
        state=state,
    )
    return Prepared(case, stand, body, model, modes, z, loaded, suspended, steps)


def _steps(case: Case, highest: float) -> int:
    """Steps of the method between two samples."""
    solver, every = case.solver, 1.0 / case.sensors.rate
    if case.sensors.samples * 14 > MOST_VALUES:
        raise InputError(f"sensors.duration at sensors.rate makes {case.sensors.samples:.3g} samples, too many")
    if solver.method == "dopri5":
        return 0
    limit = batch.stability_limit(solver.method) / highest
    if solver.step == "auto":
        wanted = batch.accurate_step(solver.method, solver.accuracy) / highest
    else:
        wanted = float(solver.step)
        if wanted > limit:
            raise InputError(
                f"solver.step is {wanted:.6g} s, above the stability limit {limit:.6g} s of {solver.method} (highest "
                f"frequency {highest:.6g} rad/s); take a smaller step or auto"
            )
    count = every / wanted * case.sensors.samples
    if count > MOST_STEPS:
        raise InputError(f"solver.step is {wanted:.3g} s; that makes {count:.2g} steps, too many; take a larger one")
    return max(1, int(np.ceil(every / wanted - 1e-9)))


def _start(case: Case, stand: Stand, body: Body, modes: NormalModes) -> tuple[np.ndarray, np.ndarray, int]:
    """State at t = 0 in the level frame, modal coordinates, and the spring that is loaded (-1 for none)."""
    given, rest = case.excitation, modes.model.pose
    position, rotation = rest.position, rest.rotation
    velocity, rate = np.zeros(3), np.zeros(3)
    loaded = -1
    if given.force is not None or given.impulse is not None:
        point, loaded = _place(case, stand, modes)
        if given.force is not None:
            pulled = equilibrium(stand, body, force=given.force, point=point)
            position, rotation = pulled.position, pulled.rotation
            z = modes.release(given.force, point)
        else:
            z = modes.impulse(given.impulse, point)
            jump = _impulse(modes.model, np.array(given.impulse), point)
            velocity, rate = jump[:3], jump[3:]
    else:
        from scipy.spatial.transform import Rotation

        turn = np.array(given.rotation or (0.0, 0.0, 0.0))
        move = np.array(given.displacement or (0.0, 0.0, 0.0))
        velocity, rate = np.array(given.velocity or (0.0,) * 3), np.array(given.rate or (0.0,) * 3)
        guided = stand.support == "guided"
        if guided and (np.any(move[[0, 2]]) or np.any(velocity[[0, 2]]) or turn[1] != 0.0 or rate[1] != 0.0):
            raise InputError(
                "excitation gives motion along x or z or about y, which support 'guided' holds; leave it out, "
                "or take support: hanging"
            )
        position, rotation = rest.position + move, Rotation.from_rotvec(turn).as_matrix() @ rest.rotation
        z = modes.state(np.concatenate([move, turn]), np.concatenate([velocity, rate]))
    state = np.concatenate([position, quaternions(rotation), velocity, rate])
    return state, np.asarray(z), loaded


def _place(case: Case, stand: Stand, modes: NormalModes) -> tuple[np.ndarray, int]:
    """Point where the excitation acts, and the number of its spring (-1 for a point of its own)."""
    given = case.excitation
    if isinstance(given.at, tuple):
        return np.array(given.at), -1
    if given.at != "best":
        return stand.points[int(given.at) - 1], int(given.at) - 1
    best = int(np.argmax(least_energies(case, stand, modes)))
    return stand.points[best], best


def heave_roll_pitch(modes: NormalModes) -> np.ndarray:
    """(3,) int, numbers of the modes with most kinetic energy in heave, roll and pitch, frequencies rising."""
    shares = modes.shapes * (modes.model.mass @ modes.shapes)
    return np.sort(np.argsort(shares[[1, 3, 5]].sum(axis=0))[-3:])


def distinct(frequency: np.ndarray) -> np.ndarray:
    """(m,) bool, whether each of the rising frequencies differs from the one before by more than `COINCIDING`."""
    return np.diff(frequency, prepend=0.0) > COINCIDING * frequency


def least_energies(case: Case, stand: Stand, modes: NormalModes) -> np.ndarray:
    """(n,) J, energy of the weakest of heave, roll and pitch, were the case's load to act at each spring."""
    given = case.excitation
    knock = modes.release if given.force is not None else modes.impulse
    load = given.force if given.force is not None else given.impulse
    vertical = heave_roll_pitch(modes)
    return np.array([modes.energy(knock(load, point))[vertical].min() for point in stand.points])


def _impulse(model: LinearModel, impulse: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Jump (6,) of velocity and angular velocity from an impulse at a body point, guides included."""
    r = model.pose.rotation @ (point - model.centre)
    M, _, _ = model.reduced()
    load = model.basis.T @ np.concatenate([impulse, np.cross(r, impulse)])
    return np.asarray(model.basis @ np.linalg.solve(M, load))
