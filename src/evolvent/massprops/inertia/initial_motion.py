"""How a body on springs is set in motion, in full geometry and in the modal coordinates of the linear model."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from evolvent.base.errors import InputError
from evolvent.massprops.inertia.stand import Body, Stand, array
from evolvent.massprops.inertia.statics import equilibrium, rotation_matrix
from evolvent.massprops.inertia.vibration import NormalModes


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


def released(stand: Stand, body: Body, modes: NormalModes, force: Any, point: Any) -> Start:
    """At rest under a force (3,), N, at a body point (3,), m, that is released at once.

    Raises
    ------
    InputError
        If no equilibrium under the force is found.
    """
    pose = equilibrium(stand, body, force=force, point=point)
    return Start(modes.release(force, point), pose.position, pose.rotation, np.zeros(3), np.zeros(3))


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
