"""Rotational spring, damper, stops and latch between a body and a beam's node."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from evolvent import units
from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.kernels import flexible
from evolvent.parts.base import BodyName, Part, Place, unit
from evolvent.parts.beam import node_of


class RotationalSpring(Part):
    """Spring, damper, stops and latch against the angle of a beam's node on a body; a `Joint` holds the node's place.

    Parameters
    ----------
    body : str
        Body that carries it, or ground.
    node : place
        Node of a beam, such as "boom.root".
    axis : (3,) float
        Of the angle, inertial axes at the start.
    zero : (3,) float, optional
        Direction from which the angle counts, inertial axes at the start; the beam's own if left out.
    stiffness, damping : float, N m/rad and N m s/rad
        Of the spring and the damper.
    rest : float, rad
        Angle without torque of the spring.
    low, high : float, rad, optional
        Stops; none if left out.
    stop : float, N m/rad
        Stiffness of the stops.
    latch : float, rad, optional
        Angle at which the hinge locks for good.
    latch_stiffness, latch_damping : float, N m/rad and N m s/rad
        Of the lock.

    Notes
    -----
    Of a cable the angle is that of its axis, of a beam that of its section, a quarter turn from the slope across it:
    what turns the axis passes moments on by the shear of half an element alone.
    """

    kind: Literal["rotational-spring"] = "rotational-spring"
    body: BodyName
    node: Place
    axis: units.Direction = (0.0, 0.0, 1.0)
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
        index = builder.find(self.body, "bodies")
        _, kind, iq, iv = node_of(builder, self.node, f"{name}.node")
        R, axis = builder.poses[index].R, unit(self.axis)
        slope = np.array(builder.q[iq + 3 : iq + 6])
        zero = unit(slope if self.zero is None else self.zero)
        if abs(zero @ axis) > 1e-6:
            raise InputError(f"{name}.zero is {tuple(zero.tolist())!r}; it must be across the axis")
        zero = zero - (zero @ axis) * axis
        zero /= np.linalg.norm(zero)
        which = 1
        if kind == flexible.BEAM:
            across = np.array(builder.q[iq + 6 : iq + 12]).reshape(2, 3)
            which = 2 + int(np.argmin(np.abs(across @ axis) / np.linalg.norm(across, axis=1)))
            quarter = np.cross(axis, zero)
            zero = quarter if across[which - 2] @ np.cross(axis, slope) > 0.0 else -quarter
            slope = across[which - 2]
        angle = math.atan2(slope @ np.cross(axis, zero), slope @ zero)
        latch = math.inf if self.latch is None else self.latch
        keys = ("stiffness", "damping", "rest", "stop", "latch_stiffness", "latch_damping")
        found = builder.add(
            "hinges",
            body=index,
            iq=iq + 3 * which,
            iv=iv + 3 * which,
            axis=R.T @ axis,
            zero=R.T @ zero,
            low=-math.inf if self.low is None else self.low,
            high=math.inf if self.high is None else self.high,
            latch=latch,
            side=1.0 if angle > latch else -1.0,
            **{key: getattr(self, key) for key in keys},
        )
        builder.names[name] = ("hinges", found)
