"""Loads: on threads (force per length), forces at points and torques on bodies. Gravity belongs to the System."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar, Literal

import numpy as np

from evolvent.assembly import expressions
from evolvent.assembly.builder import Builder
from evolvent.assembly.references import split_reference
from evolvent.kernels import beam_loads, loads as kernels, springs
from evolvent.kernels.ancf_beams import BEAM
from evolvent.parts.applies import OF_LAW, Applies, either, left_out
from evolvent.parts.base import Part, PointReference, RodName, ThreadName, unit
from evolvent.parts.beam import node_of
from evolvent.parts.beam_load import add_beam_load, refuse_beside_law
from evolvent.parts.expression import Constants, ForceLaw, Parameters, TorqueLaw, refuse_without_law, write_law
from evolvent.parts.load_window import FRAMES, Frame, window
from evolvent.parts.profile import ForceProfile, TorqueProfile, write_profile
from evolvent.parts.rod_load import write_light
from evolvent_base import units
from evolvent_base.errors import InputError


def _add(builder: Builder, name: str, kind: int, target: int, **fields: int) -> None:
    whole = {"law": 0, "law_first": 0, "law_last": 0, "node": -1, "attitude": 0, "scale": 1.0, **fields}
    builder.names[name] = ("loads", builder.add("loads", kind=kind, target=target, **whole))


def _parameters(builder: Builder, values: Sequence[float]) -> dict[str, int]:
    first, last = builder.parameters(values)
    return {"first": first, "last": last}


def _check_reflection(name: str, key: str, specular: float, diffuse: float) -> None:
    """Refuse fractions of specular (by its key) and diffuse reflection that share more than 1."""
    if specular + diffuse > 1.0 + 1e-12:
        raise InputError(f"{name}.{key} and {name}.diffuse add up to {specular + diffuse:g}; they share at most 1")


class UniformLoad(Part):
    """A uniform force per length along a thread; it does not act on a tip mass.

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
    """Sunlight on a blade, a flat strip: on a rod, or on a thread whose chord keeps the direction of the spool's axis.

    Parameters
    ----------
    thread : str, optional
        The thread.
    rod : str, optional
        The rod, in place of a thread; y of its section is the normal of the strip at each node.
    pressure : float, Pa
        Of light that is wholly absorbed at normal incidence (4.56e-6 at one astronomical unit).
    width : float, m, optional
        The blade's chord, across the thread's tangent; of a rod, if left out, the extent of its section along z.
    direction : (3,) float
        In which the light travels, inertial axes.
    reflectivity : float
        Fraction that is reflected specularly: 0 to 1 (mirror).
    diffuse : float
        Fraction that is reflected diffusely (Lambert); the rest is absorbed. Both sides are alike.

    Notes
    -----
    The force per length is that of `PanelRadiation` with the width in place of the area. On a rod it acts at each node
    on the length that the node represents, as a `LineLoad` does. Shadows of other parts are not modelled.
    """

    applies: ClassVar[Applies] = {"thread": (left_out("rod"),), "rod": (left_out("thread"),)}
    kind: Literal["radiation-pressure"] = "radiation-pressure"
    thread: ThreadName | None = None
    rod: RodName | None = None
    pressure: units.PressureOrZero
    width: units.LengthOrZero | None = None
    direction: units.Direction = (0.0, 0.0, 1.0)
    reflectivity: units.Fraction = 1.0
    diffuse: units.Fraction = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`, on a rod as light on a panel at each node."""
        _check_reflection(name, "reflectivity", self.reflectivity, self.diffuse)
        optics = [self.reflectivity, self.diffuse]
        if self.thread is not None and self.rod is not None:
            raise InputError(f"{name}.thread and {name}.rod are both given; leave one of them out")
        if self.thread is not None:
            target = builder.find(self.thread, "threads")
            if self.width is None:
                raise InputError(f"{name}.width is missing; a thread needs it, such as '10 cm'")
            light = self.pressure * self.width * unit(self.direction)
            _add(builder, name, kernels.RADIATION, target, **_parameters(builder, [*light, *optics]))
            return
        if self.rod is None:
            raise InputError(f"{name}.thread is missing; give thread, or rod")
        builder.find(self.rod, "rods")
        sides = builder.specs[self.rod].section.sides
        if self.width is None and sides is None:
            raise InputError(f"{name}.width is missing; the section of {self.rod!r} has none, give it, such as '10 cm'")
        light = self.pressure * (sides[1] if self.width is None else self.width) * unit(self.direction)
        write_light(builder, name, self.rod, light, optics)


class PanelRadiation(Part):
    """Radiation pressure on a flat panel of a body; both sides have the same optical properties.

    Parameters
    ----------
    at : point
        Centre of the panel, a point of a body.
    area : float, m^2
        Area of one side.
    normal : (3,) float
        Normal of the panel, body axes.
    pressure : float, Pa
        Radiation pressure on an absorbing surface at normal incidence (4.56e-6 at one astronomical unit).
    direction : (3,) float
        Direction of propagation of the light, inertial axes.
    specular, diffuse : float
        Fractions reflected specularly and diffusely (Lambert); the rest is absorbed.
    start : float, s
        Time at which the load begins.
    until : float, s, optional
        Time at which it ends; never if left out.
    ramp : float, s
        Duration of its smooth increase; statics apply the full load.

    Notes
    -----
    F = p A a [(1 - specular) s + (2 specular a + 2/3 diffuse) m], with the direction s of the light, the magnitude a of
    the cosine of its angle to the normal, and the normal m on the shaded side (McInnes, Solar Sailing, 1999). Shadows
    between panels are not modelled.
    """

    kind: Literal["panel-radiation"] = "panel-radiation"
    at: PointReference
    area: units.Area
    normal: units.Direction
    pressure: units.PressureOrZero
    direction: units.Direction = (0.0, 0.0, 1.0)
    specular: units.Fraction = 0.0
    diffuse: units.Fraction = 0.0
    start: units.Time = 0.0
    until: units.Time | None = None
    ramp: units.DurationOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`."""
        _check_reflection(name, "specular", self.specular, self.diffuse)
        target = builder.marker(self.at, f"{name}.at")
        if builder.rows["markers"][target]["kind"] != springs.ON_BODY:
            raise InputError(f"{name}.at is {self.at!r}; this load needs a body")
        _refuse_ground(builder, name, self.at, target)
        end = window(builder, name, self)
        light = self.pressure * self.area * unit(self.direction)
        values = [*light, 0.0, self.start, end, self.ramp, *unit(self.normal), self.specular, self.diffuse]
        _add(builder, name, kernels.PANEL, target, **_parameters(builder, values))


class LawLoad(Part):
    """A force per length along a thread, by a law; it does not act on a tip mass.

    Parameters
    ----------
    thread : str
        The thread.
    law : list of three expressions
        fx, fy and fz, N/m, of the position x, y, z (m), the velocity vx, vy, vz (m/s), inertial axes, and t (s); or a
        function under ``@evolvent.force_law``: ``law(x, v, t, parameters) -> (fx, fy, fz)``.
    parameters : list of float
        Of a Python law.
    constants : mapping of names to float
        Of expressions.

    Notes
    -----
    The force on a node is the law's value times the length of thread that the node represents; for the tip node this is
    half a segment, independently of the tip mass. For a force on the tip mass add a `Force` at "tether.tip". For an
    acceleration of every mass, including the tip mass, use an `AccelerationField`.
    """

    applies: ClassVar[Applies] = OF_LAW
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
    """A force at a place: constant, along a direction by a profile, or by a law of time and state.

    Parameters
    ----------
    at : point
        A point of a body, a point mass, a node of a beam ("boom.tip"), or a node of a thread, counted from its tip:
        "tether.tip" (with the tip mass), "tether[3]". The force on a node that is wound on the reel is zero.
    force : (3,) float, N, optional
        Of a constant force.
    direction : (3,) float, optional
        Of a force that follows a profile.
    profile : optional
        Value of the force along `direction`, N, as a function of time.
    law : list of three expressions, optional
        fx, fy and fz, N, of the position x, y, z (m) and velocity vx, vy, vz (m/s), inertial axes, and t (s); or a
        function under ``@evolvent.force_law``: ``law(x, v, t, parameters) -> (fx, fy, fz)``.
    parameters : list of float
        Of a Python law.
    constants : mapping of names to float
        Of expressions.
    frame : {"inertial", "body"}
        Axes of `force` or `direction`, or of the value of `law`. "body" means the axes of the body, for a thread's node
        those of the reel's body, for a beam's node those of its section: along the axis, y and z.
    start : float, s
        When the load begins.
    until : float, s, optional
        When it ends; never if left out.
    ramp : float, s
        Over which it grows smoothly; in statics it has grown.
    """

    applies: ClassVar[Applies] = either("force", "direction")
    kind: Literal["force"] = "force"
    at: PointReference
    force: units.ForceVector | None = None
    direction: units.Direction | None = None
    profile: ForceProfile | None = None
    law: ForceLaw | None = None
    parameters: Parameters = ()
    constants: Constants | None = None
    frame: Frame = "inertial"
    start: units.Time = 0.0
    until: units.Time | None = None
    ramp: units.DurationOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`, on a beam's node into `beam_loads`; its times are breaks."""
        vector = _vector(name, self, ("force", "direction"))
        thread = _thread_node(builder, name, self.at)
        if thread is not None:
            _write_load(builder, name, kernels.NODE, thread[0], self, vector, node=thread[1])
            return
        node = _node(builder, name, self.at)
        if node is None:
            _write_at_marker(builder, name, kernels.AT_MARKER, self, vector)
            return
        _write_at_node(builder, name, beam_loads.POINT, self, node, vector)


class Torque(Part):
    """A torque on a body or a node of a beam: constant, about an axis by a profile, or by a law of time and state.

    Parameters
    ----------
    at : str
        The body, or a node of a beam ("boom.tip").
    torque : (3,) float, N m, optional
        Of a constant torque.
    axis : (3,) float, optional
        Of a torque that follows a profile.
    profile : optional
        Value of the torque about `axis`, N m, as a function of time.
    law : list of three expressions, optional
        Tx, Ty and Tz, N m, of the position x, y, z (m), angular velocity vx, vy, vz (rad/s), inertial axes, t (s), and
        r11 to r33, the rotation matrix of the body, whose columns are its axes; or a function under
        ``@evolvent.torque_law``: ``law(t, x, R, w, parameters) -> (Tx, Ty, Tz)``. On a beam's node there is no R: an
        expression without it, or a function under ``@evolvent.force_law``: ``law(x, w, t, parameters)``.
    parameters : list of float
        Of a Python law.
    constants : mapping of names to float
        Of expressions.
    frame : {"inertial", "body"}
        Axes of `torque` or `axis`, or of the value of `law`. "body" means the axes of the body, for a beam's node those
        of its section: along the axis, y and z.
    start : float, s
        When the load begins.
    until : float, s, optional
        When it ends; never if left out.
    ramp : float, s
        Over which it grows smoothly; in statics it has grown.

    Notes
    -----
    On a beam's node the power of the torque M is M . w, with the angular velocity w of the section. A cable has no
    section: the component of M along its tangent does no work and is ignored.
    """

    applies: ClassVar[Applies] = either("torque", "axis")
    kind: Literal["torque"] = "torque"
    at: PointReference
    torque: units.TorqueVector | None = None
    axis: units.Direction | None = None
    profile: TorqueProfile | None = None
    law: TorqueLaw | None = None
    parameters: Parameters = ()
    constants: Constants | None = None
    frame: Frame = "inertial"
    start: units.Time = 0.0
    until: units.Time | None = None
    ramp: units.DurationOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`, on a beam's node into `beam_loads`; its times are breaks."""
        vector = _vector(name, self, ("torque", "axis"))
        if _thread_node(builder, name, self.at) is not None:
            raise InputError(f"{name}.at is {self.at!r}, a node of a thread, on which only forces can act")
        node = _node(builder, name, self.at)
        if node is None:
            _write_at_marker(builder, name, kernels.TORQUE, self, vector)
            return
        if node[1] != BEAM and self.law is None:
            tangent = unit(builder.q[node[2] + 3 : node[2] + 6])
            if np.linalg.norm(np.cross(tangent, vector)) <= 1e-9 * np.linalg.norm(vector):
                key = "torque" if self.torque is not None else "axis"
                raise InputError(
                    f"{name}.{key} is {getattr(self, key)!r}, along the cable at {self.at!r}, which has no torsion; "
                    f"give a direction perpendicular to it, or use a beam"
                )
        _write_at_node(builder, name, beam_loads.MOMENT, self, node, vector)


def _vector(name: str, load: Force | Torque, keys: tuple[str, str]) -> tuple[float, float, float]:
    """The constant vector of a load, or the unit vector along which its profile acts; ones, which a law multiplies."""
    constant, direction = keys
    if load.law is not None:
        refuse_beside_law(name, load, (constant, direction, "profile"))
        return 1.0, 1.0, 1.0
    refuse_without_law(name, load)
    vector, along, profile = getattr(load, constant), getattr(load, direction), load.profile
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
    """The beam's node that a point is (see `node_of`); None for other points."""
    return node_of(builder, at, f"{name}.at") if builder.location(at, f"{name}.at").family == "beams" else None


def _thread_node(builder: Builder, name: str, at: Any) -> tuple[int, int] | None:
    """Index of the thread and number of its node (0 at the tip) that a point is; None for other points."""
    thread, on = split_reference(at) if isinstance(at, str) else ("", None)
    family, index = builder.names.get(thread, ("", -1))
    if family != "threads":
        return None
    last = int(builder.rows["threads"][index]["n"]) - 1
    number = 0 if on == "tip" else on
    if not isinstance(number, int) or number > last:
        what = "is a thread" if on is None else f"has no {f'node {on}' if isinstance(on, int) else repr(on)}"
        raise InputError(f"{name}.at is {at!r}; {thread!r} {what}; give '{thread}.tip', or a node from its tip on, "
                         f"'{thread}[0]' to '{thread}[{last}]'")  # fmt: skip
    return index, number


def _write_at_node(builder: Builder, name: str, kind: int, load: Force | Torque, node: tuple[int, int, int, int],
                   vector: Sequence[float]) -> None:  # fmt: skip
    """Write a force or torque on a node of a beam."""
    beam, formulation, iq, iv = node
    if load.frame == "body" and formulation != BEAM:
        raise InputError(
            f"{name}.frame is 'body', but {name}.at is {load.at!r}, a node of a cable, which has no section; use "
            f"'inertial', or a beam"
        )
    law: dict[str, Any] = {}
    if load.law is not None:
        law = write_law(builder, name, load.law, "force", load.parameters, load.constants)
    add_beam_load(
        builder, name, kind, beam, 1.0, (load.start, load.until, load.ramp), load.profile, axis=np.array(vector), iq=iq,
        iv=iv, frame=int(FRAMES[load.frame]), **law,
    )  # fmt: skip


def _write_at_marker(builder: Builder, name: str, kind: int, load: Force | Torque, vector: Sequence[float]) -> None:
    """Write a force or torque on a body or point."""
    target = builder.marker(load.at, f"{name}.at")
    on_body = builder.rows["markers"][target]["kind"] == springs.ON_BODY
    _refuse_ground(builder, name, load.at, target)
    if not on_body and (load.frame == "body" or kind == kernels.TORQUE):
        raise InputError(f"{name}.at is {load.at!r}; this load needs a body")
    _write_load(builder, name, kind, target, load, vector)


def _refuse_ground(builder: Builder, name: str, at: Any, target: int) -> None:
    """Refuse a load whose marker is on the ground."""
    marker = builder.rows["markers"][target]
    if marker["kind"] == springs.ON_BODY and marker["index"] == builder.names["ground"][1]:
        raise InputError(f"{name}.at is {at!r}, on the ground, which no load moves; give a body, a point or a node")


def _write_load(builder: Builder, name: str, kind: int, target: int, load: Force | Torque, vector: Sequence[float],
                **fields: int) -> None:  # fmt: skip
    """Append a force or torque to the family `loads`."""
    end = window(builder, name, load)
    values = [*vector, FRAMES[load.frame], load.start, end, load.ramp]
    if load.profile is not None:
        values += write_profile(builder, f"{name}.profile", load.profile)
    if load.law is not None:
        of = "torque" if kind == kernels.TORQUE else "force"
        found = write_law(builder, name, load.law, of, load.parameters, load.constants)
        fields |= {"law": found["law"], "law_first": found["first"], "law_last": found["last"]}
        if kind == kernels.TORQUE and callable(load.law):
            fields["attitude"] = kernels.FOLLOWS * int(load.law.law_kind == "torque")
        elif kind == kernels.TORQUE:
            used = {name for text in load.law for name in expressions.names(text)}
            follows = any(name[0] == "r" and name[1:].isdigit() for name in used)
            fields["attitude"] = kernels.FOLLOWS if follows else 1
    _add(builder, name, kind, target, **_parameters(builder, values), **fields)
