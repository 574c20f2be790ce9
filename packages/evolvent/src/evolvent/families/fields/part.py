"""Fields: accelerations that act on every mass of a system. Uniform gravity belongs to the System."""

from __future__ import annotations

import math
from typing import Any, ClassVar, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.families.fields.part_points import write_field_points
from evolvent.kernels import drive, fields as kernels
from evolvent.parts.applies import OF_LAW, Applies, left_out, one_of, refuse_unfit
from evolvent.parts.base import Group, Part, unit
from evolvent.parts.expression import Constants, ForceLaw, Parameters, write_law
from evolvent_base import units
from evolvent_base.errors import InputError

#: Largest cosine between the directions of an orbit that counts as a right angle.
_RIGHT = 1e-6


class Field(Part):
    """A field of accelerations on every mass: by a law, or the frame of a circular orbit, with which the axes rotate.

    Parameters
    ----------
    type : {"acceleration", "orbit"}
        acceleration: by `law`. orbit: the system's axes rotate with the orbital frame, and its accelerations act.
    law : list of three expressions, optional
        ax, ay and az, m/s^2, of the position x, y, z (m), the velocity vx, vy, vz (m/s), inertial axes, and t (s); or a
        function under ``@evolvent.law``: ``law(x, v, t, parameters) -> (ax, ay, az)``.
    parameters : list of float
        Parameters of a Python law.
    constants : mapping of names to float
        Constants of the expressions.
    rate : float, rad/s, optional
        Mean motion n of the orbit.
    radius : float, m, optional
        Radius of the orbit from the centre of the planet; with `gravitational_parameter`, in place of `rate`.
    gravitational_parameter : float, m^3/s^2, optional
        Gravitational parameter of the planet; that of the Earth is 3.986004418e14.
    radial : (3,) float
        Direction away from the planet.
    along : (3,) float
        Direction of flight, perpendicular to `radial`.

    Notes
    -----
    The acceleration of points and nodes of threads (tip masses included) is evaluated at their positions. It is
    integrated over a body by at most seven points that have its mass, centre and second moments, over an element of a
    beam by Gauss points along the axis and four points in the section, and over wound thread with `wound_mass`
    'carried' by four points of its ring. Forces and moments are exact for laws linear in position and velocity, as
    those of an orbit are.

    The origin of the system's axes moves on the orbit. With x radial, y along the flight and z normal to the orbit, a
    point follows

        x'' = 2 n y' + 3 n^2 x,    y'' = -2 n x',    z'' = -n^2 z

    in the absence of other forces (Clohessy & Wiltshire, 1960): gravity to the first order in the distance from the
    origin, centrifugal and Coriolis forces. A body therefore has the gravity-gradient moment 3 n^2 e_r x J e_r and the
    gyroscopic moments of the frame, also on the spin of its reaction wheels. Positions, velocities, angular velocities,
    momenta and kinetic energies are relative to the frame. The work of the frame's forces counts as work of loads;
    Coriolis forces do no work.
    """

    applies: ClassVar[Applies] = {
        "law": (one_of("type", "acceleration"),),
        **OF_LAW,
        "rate": (one_of("type", "orbit"), left_out("radius", "gravitational_parameter")),
        "radius": (one_of("type", "orbit"), left_out("rate")),
        "gravitational_parameter": (one_of("type", "orbit"), left_out("rate")),
        "radial": (one_of("type", "orbit"),),
        "along": (one_of("type", "orbit"),),
    }
    kind: Literal["field"] = "field"
    group = Group.LOADS
    type: Literal["acceleration", "orbit"] = "acceleration"
    law: ForceLaw | None = None
    parameters: Parameters = ()
    constants: Constants | None = None
    rate: units.PositiveRate | None = None
    radius: units.Length | None = None
    gravitational_parameter: units.GravitationalParameter | None = None
    radial: units.Direction = (1.0, 0.0, 0.0)
    along: units.Direction = (0.0, 1.0, 0.0)

    def write(self, builder: Builder, name: str) -> None:
        """Write the field."""
        refuse_unfit(name, self)
        if self.type == "orbit":
            self._write_orbit(builder, name)
            return
        if self.law is None:
            raise InputError(f"{name}.law is missing; a field of type 'acceleration' needs it")
        found = write_law(builder, name, self.law, "force", self.parameters, self.constants)
        _write(builder, name, kind=kernels.LAW, K=np.zeros((3, 3)), w=np.zeros(3), scale=1.0, **found)

    def mean_motion(self, name: str = "orbit") -> float:
        """Mean motion n of an orbit, rad/s."""
        if self.rate is not None:
            return self.rate
        if self.radius is None or self.gravitational_parameter is None:
            if self.radius is None and self.gravitational_parameter is None:
                raise InputError(f"{name}.rate is missing; give rate, or radius and gravitational_parameter")
            key = "radius" if self.radius is None else "gravitational_parameter"
            raise InputError(f"{name}.{key} is missing")
        return math.sqrt(self.gravitational_parameter / self.radius**3)

    def _write_orbit(self, builder: Builder, name: str) -> None:
        """Write the accelerations of the frame of an orbit."""
        n, r, along = self.mean_motion(name), unit(self.radial), unit(self.along)
        if abs(float(r @ along)) > _RIGHT:
            raise InputError(
                f"{name}.along is {self.along!r}; it must be perpendicular to {name}.radial, {self.radial!r}"
            )
        if np.any(builder.gravity):
            raise InputError(
                f"gravity is {tuple(builder.gravity.tolist())!r} m/s^2, but {name!r} is an orbit, whose frame is in "
                f"free fall; leave out gravity"
            )
        h = np.cross(r, along)
        K = n * n * (3.0 * np.outer(r, r) - np.outer(h, h))
        _write(builder, name, kind=kernels.ORBIT, law=0, first=0, last=0, K=K, w=n * h, scale=1.0)


def _write(builder: Builder, name: str, **fields: Any) -> None:
    """Append a field, the only one of its kind."""
    other = next((k for k, row in enumerate(builder.rows["fields"]) if row["kind"] == fields["kind"]), None)
    if other is not None:
        first = next(key for key, found in builder.names.items() if found == ("fields", other))
        what = "an orbit" if fields["kind"] == kernels.ORBIT else "an acceleration field"
        raise InputError(f"{name!r} is {what}, and so is {first!r}; a system has one at most")
    if not builder.rows["fields"]:
        builder.at_end.append(_finish)
    builder.names[name] = ("fields", builder.add("fields", **fields))


def _finish(builder: Builder) -> None:
    """Write the points of all masses once every part is there."""
    for p, row in enumerate(builder.rows["threads"]):
        thread = next(key for key, found in builder.names.items() if found == ("threads", p))
        field = next(key for key, found in builder.names.items() if found[0] == "fields")
        if row["carried"] and row["drive"] == drive.FREE:
            raise InputError(
                f"{thread!r} has wound_mass 'carried' on a free spool, which the field {field!r} does not support; "
                f"take wound_mass 'ignored', or a drive that prescribes the spool's angle"
            )
        if row["take_drive"] >= 0:
            raise InputError(
                f"{thread!r} flows to a take-up reel, which the field {field!r} does not support; give it an `end`"
            )
        if row["copies"] > 1:
            raise InputError(
                f"{thread!r} stands for {row['copies']} copies, but the field {field!r} is not the same for all of "
                f"them; add a thread for each"
            )
    write_field_points(builder)
