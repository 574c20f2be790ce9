"""Rigid body: driven, spinning about a fixed axis, or free in six degrees of freedom."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from evolvent.builder import Builder, Pose
from evolvent.errors import InputError
from evolvent.kernels import rigid
from evolvent.kernels.rotations import rotation_about_axis, rotation_from_quaternion
from evolvent.parts.checks import choice, not_negative, number, unit_vector, vector

MOTIONS = {"driven": rigid.DRIVEN, "spin": rigid.SPIN, "free": rigid.FREE}


@dataclasses.dataclass(frozen=True, kw_only=True)
class RigidBody:
    """A rigid body; its axes start from its centre of mass.

    Parameters
    ----------
    motion : {"free", "spin", "driven"}
        Free in six degrees of freedom, free to turn about `axis` through its fixed origin, or turning about `axis` at
        the constant `rate` whatever acts on it (a `rate` of 0 holds it fixed).
    mass : float, kg (used by free bodies)
    inertia : float, (3,) or (3, 3) float, kg m2
        Moment of inertia about every axis, principal moments, or the tensor in body axes.
    position, velocity : (3,) float, m and m/s, inertial frame, of the centre of mass
    orientation : (4,) float, quaternion body to inertial at the start, scalar part first
    angular_velocity : (3,) float, rad/s, body axes (free bodies)
    axis : (3,) float, body axes (spinning and driven bodies)
    rate : float, rad/s about `axis` (spinning and driven bodies)

    Notes
    -----
    The state of a free body is position, quaternion, velocity (inertial) and angular velocity (body axes); of a
    spinning body its angle, unwrapped, and rate.
    """

    motion: str = "free"
    mass: float = 0.0
    inertia: float | Sequence[float] | Sequence[Sequence[float]] = 0.0
    position: Sequence[float] = (0.0, 0.0, 0.0)
    velocity: Sequence[float] = (0.0, 0.0, 0.0)
    orientation: Sequence[float] = (1.0, 0.0, 0.0, 0.0)
    angular_velocity: Sequence[float] = (0.0, 0.0, 0.0)
    axis: Sequence[float] = (0.0, 0.0, 1.0)
    rate: float = 0.0

    def inertia_tensor(self) -> np.ndarray:
        """Inertia as a (3, 3) tensor in body axes."""
        given = " ".join(str(self.inertia).split())
        try:
            tensor = np.array(self.inertia, dtype=float)
        except (TypeError, ValueError):
            tensor = np.full(0, np.nan)
        if tensor.shape in ((), (3,)):
            tensor = np.diag(np.broadcast_to(tensor, 3).astype(float))
        if tensor.shape != (3, 3) or not np.all(np.isfinite(tensor)):
            raise InputError(f"inertia is {given}; give a number, three, or a 3 x 3 tensor")
        if not np.allclose(tensor, tensor.T, rtol=1e-9, atol=0.0):
            raise InputError(f"inertia is {given}; the tensor must be symmetric")
        moments = np.linalg.eigvalsh(tensor)
        if moments[0] < 0.0 or (self.motion == "free" and moments[0] <= 0.0):
            raise InputError(f"inertia is {given}; its principal moments must be above 0")
        if moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-9):
            raise InputError(f"inertia is {given}; no body has it: one principal moment exceeds the sum of the others")
        return tensor

    def write(self, builder: Builder, name: str) -> None:
        """Write the body into the family `bodies`."""
        motion = choice(f"{name}.motion", self.motion, MOTIONS)
        mass = not_negative(f"{name}.mass", self.mass)
        tensor = self.inertia_tensor()
        axis = unit_vector(f"{name}.axis", self.axis)
        rate = number(f"{name}.rate", self.rate)
        spin_inertia = float(axis @ tensor @ axis)
        q4 = unit_vector4(f"{name}.orientation", self.orientation)
        R = np.empty((3, 3))
        rotation_from_quaternion(*q4, R)
        x = vector(f"{name}.position", self.position)
        if motion == rigid.FREE:
            if mass == 0.0:
                raise InputError(f"{name}.mass is 0; a free body needs a mass above 0")
            velocity = vector(f"{name}.velocity", self.velocity)
            w = vector(f"{name}.angular_velocity", self.angular_velocity)
            q, v = builder.coordinates([*x, *q4], [*velocity, *w])
            pose = Pose(x, R, velocity, R @ w)
        else:
            if motion == rigid.SPIN and spin_inertia <= 0.0:
                raise InputError(f"{name}.inertia is {self.inertia!r}; about the spin axis it must be above 0")
            q, v = (-1, -1) if motion == rigid.DRIVEN else builder.coordinates([0.0], [rate])
            turned = np.empty((3, 3))
            rotation_about_axis(axis, 0.0, R, turned)
            pose = Pose(x, turned, np.zeros(3), turned @ axis * rate)
        builder.poses.append(pose)
        index = builder.add(
            "bodies",
            motion=motion,
            iq=q,
            iv=v,
            mass=mass,
            inertia=tensor,
            axis=axis,
            R0=R,
            x0=x,
            rate=rate,
            spin_inertia=spin_inertia,
        )
        builder.names[name] = ("bodies", index)


def unit_vector4(name: str, value: Sequence[float]) -> np.ndarray:
    """A quaternion of length 1."""
    q = vector(name, value, 4)
    if not np.any(q):
        raise InputError(f"{name} is {value!r}; a quaternion must not be zero")
    return q / np.linalg.norm(q)
