"""How a body on springs is set in motion, in full geometry and in the modal coordinates of the linear model."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops.inertia.stand import Body, Stand, array, setup
from evolvent_massprops.inertia.statics import equilibrium_pose, rotation_matrix
from evolvent_massprops.inertia.vibration import NormalModes, moving

#: Relative difference of energies below which points are equally good.
ALIKE = 1e-9


class Start(NamedTuple):
    """The state of a body at t = 0.

    Attributes
    ----------
    z : (m,) complex, modal coordinates, as of `NormalModes.state`
    position, rotation : (3,), (3, 3) float, m, of the centre of mass, and body to level axes
    velocity, rate : (3,) float, m/s, rad/s, level axes
    """

    z: np.ndarray
    position: np.ndarray
    rotation: np.ndarray
    velocity: np.ndarray
    rate: np.ndarray


class Load(NamedTuple):
    """What acts on the resting body at a point.

    Attributes
    ----------
    vector : (3,) float, N or N s, level axes
    point : (3,) float, m, body axes, from the stiffness centre of the attachment plane
    impulse : bool, whether it is an impulse; else a steady force, which is released at once
    """

    vector: np.ndarray
    point: np.ndarray
    impulse: bool = False


def coordinates(modes: NormalModes, loads: Sequence[Load]) -> np.ndarray:
    """Modal coordinates z (..., m) after loads that act together, as of `NormalModes.state`; points may have axes."""
    each = [(modes.impulse if load.impulse else modes.release)(load.vector, load.point) for load in loads]
    return np.asarray(sum(each[1:], each[0]))


def least_energy(modes: NormalModes, loads: Sequence[Load]) -> np.ndarray:
    """(...) J, energy of the weakest of heave, roll and pitch after loads that act together."""
    return np.asarray(modes.energy(coordinates(modes, loads))[..., modes.vertical].min(axis=-1))


def best_point(modes: NormalModes, springs: np.ndarray, vector: Any, *, impulse: bool = False) -> np.ndarray:
    """(3,) m, point within the rectangle around the springs at which a load gives the weakest mode most energy.

    Notes
    -----
    On a grid of 21 x 21 points, and three times on one of 11 x 11 around the best, each of a quarter of the width. Of
    equally good points, as a symmetric body has, it is the one of largest x, then z.
    """
    low, high = springs.min(axis=0), springs.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    centre, width = middle.copy(), half.copy()
    for count in (21, 11, 11, 11):
        x, z = (
            np.clip(np.linspace(centre[k] + width[k], centre[k] - width[k], count), low[k], high[k]) for k in (0, 2)
        )
        points = np.stack([c.ravel() for c in np.broadcast_arrays(x[:, None], middle[1], z)], axis=-1)
        least = least_energy(modes, [Load(vector, points, impulse)])
        centre = points[int(np.argmax(least >= (1.0 - ALIKE) * least.max()))]
        width = 0.25 * width
    return centre


def excited(stand: Stand, body: Body, modes: NormalModes, loads: Sequence[Load]) -> Start:
    """At rest under forces that are released at once, with the velocities that impulses give at that moment.

    Raises
    ------
    InputError
        If no equilibrium under the forces is found.
    """
    s, model, pose = setup(stand, body), modes.model, modes.model.pose
    forces = [(array("force", one.vector, (3,)), array("point", one.point, (3,))) for one in loads if not one.impulse]
    if forces:
        pose = equilibrium_pose(s, forces)
        M, B = moving(s, pose.rotation)
        model = dataclasses.replace(model, mass=M, basis=B, pose=pose)
    jump = sum((model.jump(one.vector, one.point) for one in loads if one.impulse), np.zeros(6))
    return Start(coordinates(modes, loads), pose.position, pose.rotation, jump[:3], jump[3:])


def released(stand: Stand, body: Body, modes: NormalModes, force: Any, point: Any) -> Start:
    """At rest under a force (3,), N, at a body point (3,), m, that is released at once; see `excited`."""
    return excited(stand, body, modes, [Load(force, point)])


def struck(modes: NormalModes, impulse: Any, point: Any) -> Start:
    """At the rest, with the velocities that an impulse (3,), N s, at a body point (3,), m, gives."""
    rest, jump = modes.model.pose, modes.model.jump(impulse, point)
    return Start(modes.impulse(impulse, point), rest.position, rest.rotation, jump[:3], jump[3:])


def displaced(
    modes: NormalModes,
    *,
    displacement: Any = (0.0, 0.0, 0.0),
    rotation: Any = (0.0, 0.0, 0.0),
    velocity: Any = (0.0, 0.0, 0.0),
    rate: Any = (0.0, 0.0, 0.0),
) -> Start:
    """Away from the rest, and moving.

    Parameters
    ----------
    displacement, rotation : (3,) float, m, rad, of the centre of mass and rotation vector, from the rest, level axes
    velocity, rate : (3,) float, m/s, rad/s, level axes

    Raises
    ------
    InputError
        If guides hold what is given.

    Notes
    -----
    Roll and pitch together make a yaw of second order; of a guided body it is taken off, from the rate too.
    """
    rest, guided = modes.model.pose, modes.model.basis.shape[-1] == 3
    given = {"displacement": displacement, "rotation": rotation, "velocity": velocity, "rate": rate}
    move, turn, velocity, rate = (array(name, value, (3,)) for name, value in given.items())
    z = modes.state(np.concatenate([move, turn]), np.concatenate([velocity, rate]))
    R = rotation_matrix(turn) @ rest.rotation
    if guided:
        if np.any([move[[0, 2]], velocity[[0, 2]]]) or turn[1] != 0.0 or rate[1] != 0.0:
            raise InputError(
                "the initial state has motion along x or z or about y, which support 'guided' holds; leave it out, or "
                "use support 'hanging'"
            )
        R = rotation_matrix(np.array([0.0, np.arctan2(R[2, 0], R[0, 0]), 0.0])) @ R
        x, y, _ = R[:, 0]
        rate = rate - (y * rate[0] - x * rate[1]) / (x * x + y * y) * np.array([y, -x, 0.0])
    return Start(z, rest.position + move, R, velocity, rate)
