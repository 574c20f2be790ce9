"""Rotational spring, damper, stops and latch between a body and a beam's node, or between two bodies."""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import model_validator

from evolvent import units
from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.kernels import flexible
from evolvent.kernels.sides import ON_BODY, ON_COORDINATES
from evolvent.parts.base import BodyName, Part, Place, unit
from evolvent.references import Location

#: What the angle at the start may be off the one that `zero` gives, rad.
_LEAST_OFF = 1e-6


class _Second(NamedTuple):
    """The second direction: fields of the family `hinges`, and the zero direction (inertial axes) and angle."""

    on: int
    other: int
    iq: int
    iv: int
    local: np.ndarray
    zero: np.ndarray
    angle: float


class RotationalSpring(Part):
    """Spring, damper, stops and latch about an axis; a `Joint` between the same two parts holds their place.

    Parameters
    ----------
    a : str
        A body, or ground; the axis is fixed to it.
    b : place
        The other body, such as "panel", or the node of a beam, such as "boom.root". The angle is that of `b` as seen
        from `a`, right-handed about the axis.
    axis : (3,) float
        Inertial axes at the start.
    angle : float, rad, optional
        At the start, any number of turns: it distinguishes a panel folded by 180 deg from one folded by -180 deg.
        Between bodies 0 if left out, of a beam's node the angle from `zero`.
    zero : (3,) float, optional
        Of a beam's node, the direction from which its angle counts, inertial axes at the start; the beam's own, turned
        back by `angle`, if left out.
    stiffness, damping : float, N m/rad and N m s/rad
        Of the spring and the damper.
    rest : float, rad
        Angle without torque of the spring.
    low, high : float, rad, optional
        Stops; none if left out.
    stop : float, N m/rad
        Stiffness of the stops.
    latch : float, rad, optional
        Angle at which the hinge locks for good; one that starts there is locked.
    latch_stiffness, latch_damping : float, N m/rad and N m s/rad
        Of the lock.

    Notes
    -----
    The angle is continuous over any number of turns. `body` and `node` are read as `a` and `b`. Of a cable the angle is
    that of its axis, of a beam that of its section, a quarter turn from the slope across it: what turns the axis passes
    moments on by the shear of half an element alone.
    """

    kind: Literal["rotational-spring"] = "rotational-spring"
    a: BodyName
    b: Place
    axis: units.Direction = (0.0, 0.0, 1.0)
    angle: units.Angle | None = None
    zero: units.Direction | None = None
    stiffness: units.RotationalStiffnessOrZero = 0.0
    damping: units.RotationalDampingOrZero = 0.0
    rest: units.Angle = 0.0
    low: units.Angle | None = None
    high: units.Angle | None = None
    stop: units.RotationalStiffnessOrZero = 0.0
    latch: units.Angle | None = None
    latch_stiffness: units.RotationalStiffnessOrZero = 0.0
    latch_damping: units.RotationalDampingOrZero = 0.0

    @model_validator(mode="before")
    @classmethod
    def _read_former_names(cls, values: Any) -> Any:
        """Read `body` and `node` as `a` and `b`."""
        if not isinstance(values, dict):
            return values
        former = {"body": "a", "node": "b"}
        return {key if former.get(key, key) in values else former[key]: value for key, value in values.items()}

    def _check(self, name: str) -> None:
        """Refuse stops and latches without what they need."""
        if self.low is not None and self.high is not None and self.low > self.high:
            raise InputError(f"{name}.low is {self.low!r} rad, above {name}.high, {self.high!r} rad")
        if (self.low is not None or self.high is not None) and self.stop == 0.0:
            raise InputError(f"{name}.stop is {self.stop!r}; stops need a stiffness above 0 N m/rad")
        if self.latch is not None and self.latch_stiffness == 0.0:
            raise InputError(f"{name}.latch_stiffness is {self.latch_stiffness!r}; a latch needs one above 0 N m/rad")

    def write(self, builder: Builder, name: str) -> None:
        """Write the row of the family `hinges`."""
        self._check(name)
        index = builder.find(self.a, "bodies")
        place = builder.place(self.b, f"{name}.b")
        R, axis = builder.poses[index].R, unit(self.axis)
        if place.family == "points":
            raise InputError(f"{name}.b is {self.b!r}, a point mass, which has no angle; give a body or a beam's node")
        if place.family == "bodies":
            second = self._body(builder, name, index, place, axis)
        else:
            second = self._node(builder, name, place, axis)
        latch = math.inf if self.latch is None else self.latch
        keys = ("stiffness", "damping", "rest", "stop", "latch_stiffness", "latch_damping")
        found = builder.add(
            "hinges",
            body=index,
            axis=R.T @ axis,
            low=-math.inf if self.low is None else self.low,
            high=math.inf if self.high is None else self.high,
            latch=latch,
            side=1.0 if second.angle > latch else -1.0,
            **(second._asdict() | {"zero": R.T @ second.zero}),
            **{key: getattr(self, key) for key in keys},
        )
        builder.names[name] = ("hinges", found)

    def _body(self, builder: Builder, name: str, index: int, place: Location, axis: np.ndarray) -> _Second:
        """The second direction of a body: across the axis, at the angle that the start has."""
        _, other, *_ = place
        if other == index:
            raise InputError(f"{name}.a and {name}.b are one body, {self.a!r}; a hinge needs two parts")
        if self.zero is not None:
            raise InputError(f"{name}.zero is given, but {name}.b is a body; give {name}.angle, its angle at the start")
        angle = 0.0 if self.angle is None else self.angle
        zero = _across(axis)
        u = math.cos(angle) * zero + math.sin(angle) * np.cross(axis, zero)
        return _Second(ON_BODY, other, -1, -1, builder.poses[other].R.T @ u, zero, angle)

    def _node(self, builder: Builder, name: str, place: Location, axis: np.ndarray) -> _Second:
        """The second direction of a beam's node: the slope along it, or one across it."""
        slope = np.array(builder.q[place.iq + 3 : place.iq + 6])
        zero = unit(slope if self.zero is None else self.zero)
        if abs(zero @ axis) > 1e-6:
            raise InputError(f"{name}.zero is {tuple(zero.tolist())!r}; it must be across the axis")
        zero = zero - (zero @ axis) * axis
        zero /= np.linalg.norm(zero)
        if self.zero is None and self.angle is not None:
            zero = math.cos(self.angle) * zero - math.sin(self.angle) * np.cross(axis, zero)
        which = 1
        if place.beam == flexible.BEAM:
            across = np.array(builder.q[place.iq + 6 : place.iq + 12]).reshape(2, 3)
            which = 2 + int(np.argmin(np.abs(across @ axis) / np.linalg.norm(across, axis=1)))
            quarter = np.cross(axis, zero)
            zero = quarter if across[which - 2] @ np.cross(axis, slope) > 0.0 else -quarter
            slope = across[which - 2]
        angle = math.atan2(slope @ np.cross(axis, zero), slope @ zero)
        if self.angle is not None:
            off = math.remainder(angle - self.angle, 2.0 * math.pi)
            if abs(off) > _LEAST_OFF:
                raise InputError(
                    f"{name}.angle is {self.angle:.9g} rad, but {name}.b stands at {angle:.9g} rad from {name}.zero "
                    f"(or whole turns beside); give that, or leave out one of the two"
                )
            angle = self.angle + off
        iq, iv = place.iq + 3 * which, place.iv + 3 * which
        return _Second(ON_COORDINATES, -1, iq, iv, np.zeros(3), zero, angle)


def _across(axis: np.ndarray) -> np.ndarray:
    """A unit vector across another."""
    e = np.zeros(3)
    e[int(np.argmin(np.abs(axis)))] = 1.0
    return unit(np.cross(axis, e))
