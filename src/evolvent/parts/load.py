"""Loads: on threads (force per length), forces at places and torques on bodies. Gravity belongs to the System."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from evolvent import units
from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.kernels import beam_loads, springs
from evolvent.kernels import loads as kernels
from evolvent.parts.base import Part, Place, ThreadName
from evolvent.parts.beam import node_of
from evolvent.parts.beam_load import add_beam_load
from evolvent.parts.expression import Constants, ForceLaw, Parameters, write_law
from evolvent.parts.profile import ForceProfile, Profile, TorqueProfile, write_profile

FRAMES = {"inertial": 0.0, "body": 1.0}
Frame = Literal["inertial", "body"]


def _add(builder: Builder, name: str, kind: int, target: int, **fields: int) -> None:
    builder.names[name] = ("loads", builder.add("loads", kind=kind, target=target, **{"law": 0, **fields}))


def _parameters(builder: Builder, values: Sequence[float]) -> dict[str, int]:
    first, last = builder.parameters(values)
    return {"first": first, "last": last}


class UniformLoad(Part):
    """The same force per length all along a thread.

    Parameters
    ----------
    thread : str
        The thread.
    force : (3,) float, N/m
        Per length.
    frame : {"inertial", "body"}
        Axes of `force`; "body": of the body that carries the reel.
    """

    kind: Literal["uniform-load"] = "uniform-load"
    thread: ThreadName
    force: units.LineForceVector
    frame: Frame = "inertial"

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`."""
        fields = _parameters(builder, [*self.force, FRAMES[self.frame]])
        _add(builder, name, kernels.UNIFORM, builder.find(self.thread, "threads"), **fields)


class RadiationPressure(Part):
    """Sunlight on a blade, a flat strip whose chord keeps the direction of the spool's axis.

    Parameters
    ----------
    thread : str
        The thread.
    pressure : float, Pa
        Of light that is wholly absorbed at normal incidence (4.56e-6 at one astronomical unit).
    width : float, m
        The blade's chord, measured across the thread's tangent.
    direction : (3,) float
        In which the light travels, inertial axes.
    reflectivity : float
        0 (absorbs all) to 1 (mirror).
    """

    kind: Literal["radiation-pressure"] = "radiation-pressure"
    thread: ThreadName
    pressure: units.PressureOrZero
    width: units.LengthOrZero
    direction: units.Direction = (0.0, 0.0, 1.0)
    reflectivity: units.Fraction = 1.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`."""
        along = np.array(self.direction) / np.linalg.norm(self.direction)
        fields = _parameters(builder, [self.pressure * self.width, self.reflectivity, *along])
        _add(builder, name, kernels.RADIATION, builder.find(self.thread, "threads"), **fields)


class LawLoad(Part):
    """A force per length along a thread, by a law.

    Parameters
    ----------
    thread : str
        The thread.
    law : list of three expressions
        fx, fy and fz, N/m, of the place x, y, z (m), the velocity vx, vy, vz (m/s), inertial axes, and t (s); or a
        function under ``@evolvent.force_law``: ``law(x, v, t, parameters) -> (fx, fy, fz)``.
    parameters : list of float
        Of a Python law.
    constants : mapping of names to float
        Of expressions.
    """

    kind: Literal["law-load"] = "law-load"
    thread: ThreadName
    law: ForceLaw
    parameters: Parameters = ()
    constants: Constants | None = None

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`."""
        target = builder.find(self.thread, "threads")
        fields = write_law(builder, name, self.law, "force", self.parameters, self.constants)
        _add(builder, name, kernels.LAW, target, **fields)


class Force(Part):
    """A force at a place of a body or beam, or at a point: constant, or along a direction by a profile.

    Parameters
    ----------
    at : place
        A point of a body, a point mass, or a node of a beam ("boom.tip").
    force : (3,) float, N, optional
        Of a constant force.
    direction : (3,) float, optional
        Of a force that follows a profile.
    profile : optional
        Value of the force along `direction`, N, as a function of time.
    frame : {"inertial", "body"}
        Axes of `force` or `direction`.
    start : float, s
        When the load begins.
    end : float, s, optional
        When it ends; never if left out.
    ramp : float, s
        Over which it grows smoothly; in statics it has grown.
    """

    kind: Literal["force"] = "force"
    at: Place
    force: units.ForceVector | None = None
    direction: units.Direction | None = None
    profile: ForceProfile | None = None
    frame: Frame = "inertial"
    start: units.Time = 0.0
    end: units.Time | None = None
    ramp: units.DurationOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`, on a beam's node into `beam_loads`; its times are breaks."""
        vector = _vector(name, {"force": self.force, "direction": self.direction}, self.profile)
        node = _node(builder, name, self.at)
        if node is None:
            _write_at_marker(builder, name, kernels.AT_MARKER, self, vector)
            return
        if self.frame == "body":
            raise InputError(f"{name}.frame is 'body', but {name}.at is {self.at!r}, a node of a beam; take 'inertial'")
        beam, _, iq, iv = node
        times = (self.start, self.end, self.ramp)
        add_beam_load(
            builder, name, beam_loads.POINT, beam, 1.0, times, self.profile, axis=np.array(vector), iq=iq, iv=iv
        )


class Torque(Part):
    """A torque on a body: constant, or about an axis by a profile.

    Parameters
    ----------
    at : str
        The body.
    torque : (3,) float, N m, optional
        Of a constant torque.
    axis : (3,) float, optional
        Of a torque that follows a profile.
    profile : optional
        Value of the torque about `axis`, N m, as a function of time.
    frame : {"inertial", "body"}
        Axes of `torque` or `axis`.
    start : float, s
        When the load begins.
    end : float, s, optional
        When it ends; never if left out.
    ramp : float, s
        Over which it grows smoothly; in statics it has grown.
    """

    kind: Literal["torque"] = "torque"
    at: Place
    torque: units.TorqueVector | None = None
    axis: units.Direction | None = None
    profile: TorqueProfile | None = None
    frame: Frame = "inertial"
    start: units.Time = 0.0
    end: units.Time | None = None
    ramp: units.DurationOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`; its times are breaks."""
        vector = _vector(name, {"torque": self.torque, "axis": self.axis}, self.profile)
        if _node(builder, name, self.at) is not None:
            raise InputError(
                f"{name}.at is {self.at!r}, a node of a beam, which takes forces alone; clamp a body to it for a torque"
            )
        _write_at_marker(builder, name, kernels.TORQUE, self, vector)


def _vector(name: str, given: dict[str, Any], profile: Profile[Any] | None) -> tuple[float, float, float]:
    """The constant vector of a load, or the unit vector along which its profile acts."""
    (constant, vector), (direction, along) = given.items()
    if vector is not None and (along is not None or profile is not None):
        other = direction if along is not None else "profile"
        raise InputError(f"{name}.{constant} and {name}.{other} are both given; give {constant}, or {direction} and "
                         f"profile")  # fmt: skip
    if vector is not None:
        return vector
    if along is None or profile is None:
        missing = direction if along is None else "profile"
        rest = f"; give {constant}, or {direction} and profile" if along is None and profile is None else ""
        raise InputError(f"{name}.{constant if rest else missing} is missing{rest}")
    length = math.sqrt(sum(c * c for c in along))
    return along[0] / length, along[1] / length, along[2] / length


def _node(builder: Builder, name: str, at: Any) -> tuple[int, int, int, int] | None:
    """The beam's node that a place is (see `node_of`); None for other places."""
    return node_of(builder, at, f"{name}.at") if builder.place(at, f"{name}.at").family == "beams" else None


def _write_at_marker(builder: Builder, name: str, kind: int, load: Force | Torque, vector: Sequence[float]) -> None:
    """Write a force or torque on a body or point."""
    target = builder.marker(load.at, f"{name}.at")
    on_body = builder.rows["markers"][target]["kind"] == springs.ON_BODY
    if not on_body and (load.frame == "body" or kind == kernels.TORQUE):
        raise InputError(f"{name}.at is {load.at!r}; this load needs a body")
    end = math.inf if load.end is None else load.end
    if not end > load.start:
        raise InputError(f"{name}.end is {end!r}; it must be after start {load.start!r}")
    times = (load.start, load.start + load.ramp if load.ramp else 0.0, end)
    builder.breaks.update(t for t in times if math.isfinite(t) and t > 0.0)
    values = [*vector, FRAMES[load.frame], load.start, end, load.ramp]
    if load.profile is not None:
        values += write_profile(builder, f"{name}.profile", load.profile)
    _add(builder, name, kind, target, **_parameters(builder, values))
