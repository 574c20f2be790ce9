"""Loads on beams. A force at a node is a `Force`."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.kernels import beam_loads as kernels
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.parts.applies import Applies, either, left_out
from evolvent.parts.base import BeamName, Part, PointReference
from evolvent.parts.beam import node_of
from evolvent.parts.expression import Constants, ForceLaw, Parameters, refuse_without_law, write_law
from evolvent.parts.profile import LineForceProfile, Profile, TorqueProfile, write_profile
from evolvent.parts.rod_load import is_rod, write_line_load
from evolvent_base import units
from evolvent_base.dense import norm
from evolvent_base.errors import InputError


def add_beam_load(builder: Builder, name: str, kind: int, beam: int, value: float,
                  times: tuple[float, float | None, float], profile: Profile[Any] | None = None,
                  **fields: Any) -> None:  # fmt: skip
    """Append a row of the family `beam_loads`; `times` are its start, its end (None for none) and its ramp, s."""
    start, end, ramp = times
    if end is not None and not end > start:
        raise InputError(f"{name}.until is {end!r} s; it must be after {name}.start, {start!r} s")
    first, last = 0, 0
    if profile is not None:
        first, last = builder.parameters(write_profile(builder, f"{name}.profile", profile))
    whole = {"iq": -1, "iv": -1, "centre": np.zeros(3), "axis": np.zeros(3), "law": 0, "frame": 0, "pitch": 0.0,
             "first": first, "last": last}  # fmt: skip
    index = builder.add(
        "beam_loads", kind=kind, beam=beam, value=value, start=start, end=math.inf if end is None else end, ramp=ramp,
        **{**whole, **fields},
    )  # fmt: skip
    builder.names[name] = ("beam_loads", index)


def _either(name: str, key: str, value: Any, other: str, profile: Any) -> None:
    """Refuse a load with both or none of a constant value and a profile."""
    if value is not None and profile is not None:
        raise InputError(f"{name}.{key} and {name}.profile are both given; give {key}, or {other}profile")
    if value is None and profile is None:
        raise InputError(f"{name}.{key} is missing; give {key}, or {other}profile")


def refuse_beside_law(name: str, load: Any, keys: tuple[str, ...]) -> None:
    """Refuse a load that has one of these keys beside its law."""
    given = next((key for key in keys if getattr(load, key) is not None), None)
    if given is not None:
        raise InputError(f"{name}.law and {name}.{given} are both given; leave one of them out")


class DistributedTorque(Part):
    """A torque about an axis spread over a beam's mass: force per mass proportional to axis x arm.

    With a `pitch` it acts along a screw motion: force per mass proportional to axis x arm + pitch/(2 pi) axis.

    Parameters
    ----------
    part : str
        The beam.
    torque : float, N m, optional
        Of a constant torque.
    profile : optional
        Value of the torque, N m, as a function of time.
    centre : (3,) float, m
        A point on the axis, inertial axes.
    axis : (3,) float
        Inertial axes.
    pitch : float, m
        Advance along the axis in one turn of the screw motion; it does not change the torque about the axis.
    start : float, s
        When the load begins.
    until : float, s, optional
        When it ends; never if left out.
    ramp : float, s
        Over which it grows smoothly; in statics it has grown.
    """

    applies: ClassVar[Applies] = {"torque": (left_out("profile"),), "profile": (left_out("torque"),)}
    kind: Literal["distributed-torque"] = "distributed-torque"
    part: BeamName
    torque: units.Torque | None = None
    profile: TorqueProfile | None = None
    centre: units.Position = (0.0, 0.0, 0.0)
    axis: units.Direction = (0.0, 0.0, 1.0)
    pitch: units.Coordinate = 0.0
    start: units.Time = 0.0
    until: units.Time | None = None
    ramp: units.DurationOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the torque."""
        if builder.names.get(self.part, ("",))[0] == "rods":
            raise InputError(
                f"{name}.part is {self.part!r}, a rod, which this load does not support; use a Torque at a node "
                f"such as '{self.part}.tip', a LineLoad by a law, or a Beam"
            )
        _either(name, "torque", self.torque, "", self.profile)
        axis = np.array(self.axis) / norm(np.array(self.axis))
        add_beam_load(
            builder, name, kernels.FIELD, builder.find(self.part, "beams"),
            1.0 if self.torque is None else self.torque, (self.start, self.until, self.ramp), self.profile,
            centre=np.array(self.centre), axis=axis, pitch=self.pitch / (2.0 * math.pi),
        )  # fmt: skip


class LineLoad(Part):
    """A force per stress-free length of a beam or rod: of constant direction in inertial axes, or by a law.

    Parameters
    ----------
    part : str
        The beam or rod.
    force : (3,) float, N/m, optional
        Of a constant load, inertial axes.
    direction : (3,) float, optional
        Of a load that follows a profile, inertial axes.
    profile : optional
        Value of the load along `direction`, N/m, as a function of time.
    law : list of three expressions, optional
        fx, fy and fz, N/m, of the position x, y, z (m) and velocity vx, vy, vz (m/s) of a point of the axis, inertial
        axes, and t (s); or a function under ``@evolvent.force_law``: ``law(x, v, t, parameters) -> (fx, fy, fz)``.
    parameters : list of float
        Of a Python law.
    constants : mapping of names to float
        Of expressions.
    start : float, s
        When the load begins.
    until : float, s, optional
        When it ends; never if left out.
    ramp : float, s
        Over which it grows smoothly; in statics it has grown.

    Notes
    -----
    On a rod the load of half an element acts on its node, a sixth of the element from it: in linear statics a rod under
    a constant load is exact at its nodes. A law is evaluated at these points, one for each node.
    """

    applies: ClassVar[Applies] = either("force", "direction")
    kind: Literal["line-load"] = "line-load"
    part: BeamName
    force: units.LineForceVector | None = None
    direction: units.Direction | None = None
    profile: LineForceProfile | None = None
    law: ForceLaw | None = None
    parameters: Parameters = ()
    constants: Constants | None = None
    start: units.Time = 0.0
    until: units.Time | None = None
    ramp: units.DurationOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the load, on a rod as forces at its nodes."""
        times, on_rod = (self.start, self.until, self.ramp), is_rod(builder, self.part)
        if self.law is not None:
            refuse_beside_law(name, self, ("force", "direction", "profile"))
            if on_rod:
                write_line_load(builder, name, self, np.ones(3))
                return
            law: dict[str, Any] = write_law(builder, name, self.law, "force", self.parameters, self.constants)
            add_beam_load(builder, name, kernels.LINE, builder.find(self.part, "beams"), 1.0, times, **law)
            return
        refuse_without_law(name, self)
        _either(name, "force", self.force, "direction and ", self.profile)
        if (self.direction is None) != (self.profile is None):
            given = "is missing; it goes" if self.direction is None else "goes"
            raise InputError(f"{name}.direction {given} with {name}.profile")
        axis = np.array(self.force if self.direction is None else self.direction)
        if self.direction is not None:
            axis /= norm(axis)
        if on_rod:
            write_line_load(builder, name, self, axis)
            return
        add_beam_load(
            builder, name, kernels.LINE, builder.find(self.part, "beams"), 1.0, times, self.profile, axis=axis
        )


class SlopeLoad(Part):
    """A constant generalised force on a slope vector of a beam's node.

    Parameters
    ----------
    at : point
        A node of a beam ("boom.tip").
    slope : int
        1 the slope along the axis, 2 and 3 those across.
    force : (3,) float, N m
        Inertial axes.
    start : float, s
        When the load begins.
    until : float, s, optional
        When it ends; never if left out.
    ramp : float, s
        Over which it grows smoothly; in statics it has grown.
    """

    kind: Literal["slope-load"] = "slope-load"
    at: PointReference
    slope: Annotated[int, units.Whole(least=1, most=3)]
    force: units.TorqueVector
    start: units.Time = 0.0
    until: units.Time | None = None
    ramp: units.DurationOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the load."""
        beam, kind, iq, iv = node_of(builder, self.at, f"{name}.at")
        if self.slope >= NODE_VECTORS[kind]:
            raise InputError(f"{name}.slope is {self.slope!r}; a node of this beam has the slope 1 alone")
        add_beam_load(
            builder, name, kernels.POINT, beam, 1.0, (self.start, self.until, self.ramp), axis=np.array(self.force),
            iq=iq + 3 * self.slope, iv=iv + 3 * self.slope,
        )  # fmt: skip
