"""Loads: forces and torques at points and along beams, rods and threads. Gravity belongs to the System."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from evolvent.assembly import expressions
from evolvent.assembly.builder import Builder
from evolvent.assembly.references import split_reference
from evolvent.families.beams.nodes import node_of
from evolvent.families.loads import beam_loads
from evolvent.families.loads.part_rows import (
    FRAMES,
    Frame,
    add_beam_load,
    add_load,
    add_rod_loads,
    refuse_ground,
    spread_of,
    window,
)
from evolvent.kernels import loads as kernels, markers
from evolvent.kernels.ancf_beams import BEAM, NODE_VECTORS
from evolvent.parts.applies import OF_LAW, Applies, given, left_out, one_of, refuse_unfit
from evolvent.parts.base import Group, Part, PointReference, Reference, unit
from evolvent.parts.checks import check_unit
from evolvent.parts.expression import Constants, ForceLaw, Parameters, write_law
from evolvent.parts.profile import AS_PROFILE, ForceProfile, Profile, TorqueProfile, write_profile
from evolvent_base import units
from evolvent_base.dense import norm
from evolvent_base.errors import InputError, nearest

#: Keys by which the type of a load is "torque" where it is left out.
_OF_TORQUE = ("torque", "axis", "slope")
_LoadProfile = Annotated[Profile[units.ForceOrTorque], AS_PROFILE]
_FORCE, _TORQUE = one_of("type", "force", ""), one_of("type", "torque", "")


class Load(Part):
    """A force or a torque, at a point or along a beam, rod or thread: constant, by a profile of time, or by a law.

    Parameters
    ----------
    at : point, optional
        Where it acts: a point of a body, a point mass, a node of a beam or rod ("boom.tip"), or a node of a thread,
        counted from its tip: "tether.tip" (with the tip mass), "tether[3]". The force on a node that is wound on the
        reel is zero.
    along : str, optional
        In place of `at`: the beam, rod or thread along which it acts, as a force per stress-free length; or an edge of
        a surface, "panel.x0" or "panel.edge[2]", as a force or torque per length of it. Along a beam also a torque that
        is spread over its mass: a field of forces around a fixed axis, which has no potential and can make vibrations
        grow; to twist a beam, give torques `at` its nodes. No load along a thread acts on its tip mass.
    over : str, optional
        In place of `at`: the surface, "panel", on which it acts as a force per area. In the frame "body" the third axis
        is the normal: (0, 0, p) is a pressure from below that follows the surface.
    type : {"force", "torque"}, optional
        If left out, a torque where one of the keys `torque`, `axis` and `slope` is given, else a force.
    force : (3,) float, N, along a part N/m, over a surface Pa, optional
        Of a constant force.
    torque : (3,) float, N m, along an edge N m/m, optional
        Of a constant torque.
    direction : (3,) float, optional
        Of a force that follows a profile.
    axis : (3,) float, optional
        Of a torque that follows a profile.
    profile : optional
        Value along `direction` or about `axis` as a function of time: N, N/m, Pa or N m.
    law : list of three expressions, optional
        fx, fy and fz, N or N/m, of the position x, y, z (m), the velocity vx, vy, vz (m/s), inertial axes, and t (s),
        such as a drag; or a function under ``@evolvent.law``: ``law(x, v, t, parameters) -> (fx, fy, fz)``. Of a
        torque (`type`) Tx, Ty and Tz, N m: vx, vy, vz are the angular velocity w (rad/s), and on a body r11 to r33 its
        rotation matrix R, whose columns are its axes; or a function under ``@evolvent.law``:
        ``law(t, x, R, w, parameters) -> (Tx, Ty, Tz)``. On a beam's node there is no R: an expression without it, or a
        function ``law(x, w, t, parameters) -> (Tx, Ty, Tz)``.
    parameters : list of float
        Of a Python law.
    constants : mapping of names to float
        Of expressions.
    frame : {"inertial", "body"}
        Axes of the vector or the direction, or of the value of `law`. "body" means the axes of the body, for a thread
        and its nodes those of the reel's body, for a beam's node those of its section: along the axis, y and z.
    slope : int, optional
        Of a beam's node: the torque is a generalised force on one of its slope vectors, 1 along the axis, 2 and 3
        across.
    centre : (3,) float, m
        Of a torque along a beam: a point on its axis, inertial axes.
    pitch : float, m
        Of a torque along a beam: advance along the axis in one turn of a screw motion, along which the force acts; it
        does not change the torque about the axis.
    start : float, s
        When the load begins.
    until : float, s, optional
        When it ends; never if left out.
    ramp : float, s
        Over which it grows smoothly; in statics it has grown.

    Notes
    -----
    The power of a torque M on a beam's node is M . w, with the angular velocity w of the section. A cable has no
    section: the component of M along its tangent does no work and is ignored.

    A torque along a beam is a force per mass T/J (axis x arm + pitch/(2 pi) axis), J being the moment of inertia of the
    beam about the axis: a field that is fixed in space and has no potential, since its force around the axis does work
    on every turn. Where the beam lies along the axis, J is that of its sections alone, and the forces that a deflection
    brings in are large: bending of a round beam, of frequency w, has poles with s^2 = -w^2 + i T/J and -w^2 - i T/J,
    some of which grow where nothing damps them.

    On a rod the force per length of half an element acts on its node, a sixth of the element from it: in linear statics
    a rod under a constant load is exact at its nodes. A law is evaluated at these points, one for each node. On a
    thread the force on a node is the value times the length that the node represents; for the tip node this is half a
    segment, independently of the tip mass. Along a thread a load is constant or follows a law, at all times. On an edge
    or a surface the nodes have their shares of the length or area without strain.
    """

    applies: ClassVar[Applies] = {
        "at": (left_out("along", "over"),),
        "along": (left_out("at", "over"),),
        "over": (_FORCE, left_out("at", "along")),
        "force": (_FORCE, left_out("torque", "direction", "axis", "profile", "law")),
        "torque": (_TORQUE, left_out("force", "direction", "axis", "profile", "law")),
        "direction": (_FORCE, left_out("force", "torque", "axis", "law")),
        "axis": (_TORQUE, left_out("force", "torque", "direction", "law")),
        "profile": (left_out("force", "torque", "law"),),
        "law": (left_out("force", "torque", "direction", "axis", "profile"),),
        **OF_LAW,
        "slope": (given("at"), _TORQUE, left_out("force", "direction", "axis", "profile", "law")),
        "centre": (given("along"), _TORQUE, left_out("force", "direction", "law")),
        "pitch": (given("along"), _TORQUE, left_out("force", "direction", "law")),
    }
    kind: Literal["load"] = "load"
    group = Group.LOADS
    at: PointReference | None = None
    along: Annotated[str, Reference(what="a beam, a rod, a thread or an edge of a surface", edges=True)] | None = None
    over: Annotated[str, Reference(what="a surface")] | None = None
    type: Literal["force", "torque"] | None = None
    force: units.AnyForceVector | None = None
    torque: units.AnyTorqueVector | None = None
    direction: units.Direction | None = None
    axis: units.Direction | None = None
    profile: _LoadProfile | None = None
    law: ForceLaw | None = None
    parameters: Parameters = ()
    constants: Constants | None = None
    frame: Frame = "inertial"
    slope: Annotated[int, units.Whole(least=1, most=3)] | None = None
    centre: units.Position = (0.0, 0.0, 0.0)
    pitch: units.Coordinate = 0.0
    start: units.Time = 0.0
    until: units.Time | None = None
    ramp: units.DurationOrZero = 0.0

    @classmethod
    def type_of(cls, key: str, content: Any) -> Any:
        """The type of a key, of `force` and `profile` with the unit that the other keys say."""
        keys = content if isinstance(content, Mapping) else {}
        along, over = (keys.get(key) is not None for key in ("along", "over"))
        if key == "force":
            return units.LineForceVector if along else units.AreaForceVector if over else units.ForceVector
        edge = along and "." in str(keys["along"])
        if key == "torque":
            return units.LineTorqueVector if edge else units.TorqueVector
        if key == "profile" and _is_torque(keys):
            return Annotated[Profile[units.LineTorque], AS_PROFILE] if edge else TorqueProfile
        if key == "profile" and along:
            return Annotated[Profile[units.LineForce], AS_PROFILE]
        if key == "profile":
            return Annotated[Profile[units.AreaForce], AS_PROFILE] if over else ForceProfile
        return super().type_of(key, content)

    @property
    def is_torque(self) -> bool:
        """Whether it is a torque."""
        return _is_torque({key: getattr(self, key) for key in ("type", *_OF_TORQUE)})

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`, on a beam and its nodes into `beam_loads`."""
        refuse_unfit(name, self)
        if self.at is None and self.along is None and self.over is None:
            raise InputError(f"{name}.at is missing; give at, along or over")
        of_force = "N/m" if self.along is not None else "Pa" if self.over is not None else "N"
        of_torque = "N m" if self.along is None or "." not in self.along else "N"
        check_unit(f"{name}.force", self.force, of_force)
        check_unit(f"{name}.torque", self.torque, of_torque)
        check_unit(f"{name}.profile", self.profile, of_torque if self.is_torque else of_force)
        vector = self._vector(name)
        if self.over is not None:
            self._write_spread(builder, name, "over", vector)
        elif self.along is not None:
            self._write_along(builder, name, vector)
        elif self.slope is not None:
            self._write_slope(builder, name)
        else:
            self._write_at(builder, name, vector)

    def _vector(self, name: str) -> np.ndarray:
        """The constant vector, or the unit vector along which the profile acts; ones, which a law multiplies."""
        constant, direction = ("torque", "axis") if self.is_torque else ("force", "direction")
        if self.law is not None:
            return np.ones(3)
        if getattr(self, constant) is not None:
            return np.array(getattr(self, constant), dtype=float)
        along = getattr(self, direction)
        if along is not None and self.profile is not None:
            return unit(along)
        if along is None and self.profile is None:
            other = "torque, " if self.type is None else ""
            raise InputError(f"{name}.{constant} is missing; give {constant}, {other}{direction} and profile, or law")
        key, other = (direction, "profile") if along is None else ("profile", direction)
        raise InputError(f"{name}.{key} is missing; it goes with {name}.{other}")

    def _law(self, builder: Builder, name: str, kind: str = "force", before: str = "") -> dict[str, Any]:
        """Fields of a row for the law; none without one. Its parameters are the fields `before`first, `before`last."""
        if self.law is None:
            return {}
        found = write_law(builder, name, self.law, kind, self.parameters, self.constants)
        return {"law": found["law"], f"{before}first": found["first"], f"{before}last": found["last"]}

    # ------------------------------------------------------------------------------------------------ along a part

    def _write_along(self, builder: Builder, name: str, vector: np.ndarray) -> None:
        """Write a force per length, or a torque that is spread over a beam."""
        family, index = builder.names.get(str(self.along), ("", -1))
        if family == "threads":
            self._write_on_thread(builder, name, index, vector)
            return
        if family not in ("beams", "rods"):
            self._write_spread(builder, name, "along", vector)
            return
        if self.frame == "body":
            raise InputError(
                f"{name}.frame is 'body', but {name}.along is {self.along!r}, along which a load has inertial axes"
            )
        if family == "rods" and self.is_torque:
            raise InputError(
                f"{name}.along is {self.along!r}, a rod, which a spread torque does not support; give a torque at a "
                f"node such as '{self.along}.tip', a force by a law, or a beam"
            )
        if family == "rods":
            times = window(builder, name, self)
            profile = [] if self.profile is None else write_profile(builder, f"{name}.profile", self.profile)
            law = self._law(builder, name, before="law_")
            add_rod_loads(builder, name, kernels.AT_MARKER, str(self.along), vector, [*times, *profile], **law)
        elif self.is_torque:
            if self.law is not None:
                raise InputError(f"{name}.law is given, but a torque along {self.along!r} has no law; give torque")
            value = float(norm(vector))
            add_beam_load(
                builder, name, beam_loads.FIELD, index, self, value=value, axis=vector / (value or 1.0),
                centre=np.array(self.centre), pitch=self.pitch / (2.0 * math.pi),
            )  # fmt: skip
        else:
            law = {"axis": vector} if self.law is None else self._law(builder, name)
            add_beam_load(builder, name, beam_loads.LINE, index, self, **law)

    def _write_spread(self, builder: Builder, name: str, key: str, vector: np.ndarray) -> None:
        """Write a load per length of an edge or a force per area of a surface, as loads on its nodes."""
        along = str(getattr(self, key))
        spread = spread_of(builder, along)
        if spread is None or spread.surface != (key == "over"):
            known = [n for n in builder.specs if spread_of(builder, n) is not None]
            allowed = "a surface"
            if key == "along":
                if spread is not None:
                    raise InputError(
                        f"{name}.along is {along!r}, a surface; give an edge, such as '{along}.edge[0]', or {name}.over"
                    )
                known = [n for n, (of, _) in builder.names.items() if of in ("beams", "rods", "threads")]
                allowed = "a beam, a rod, a thread or an edge of a surface"
            raise InputError(f"{name}.{key} is {along!r}; it must be {allowed}; {nearest(along, known)}")
        if self.is_torque and key == "over":
            raise InputError(f"{name}.{key} is {along!r}, {key} which a load is a force; give torques at nodes")
        times = window(builder, name, self)
        profile = [] if self.profile is None else write_profile(builder, f"{name}.profile", self.profile)
        kind = kernels.TORQUE if self.is_torque else kernels.AT_MARKER
        law = self._law(builder, name, "torque" if self.is_torque else "force", "law_")
        if self.law is not None and self.is_torque:
            law["attitude"] = _attitude(self.law)
        part, index = split_reference(along)[0], len(builder.rows["loads"])
        for node, share in zip(spread.nodes, spread.shares, strict=True):
            target = builder.marker(f"{part}[{node}]", f"{name}.{key}")
            values = [*(share * vector), FRAMES[self.frame], *times, *profile]
            add_load(builder, kind, target, values, **law)
        builder.names[name] = ("loads", index)

    def _write_on_thread(self, builder: Builder, name: str, thread: int, vector: np.ndarray) -> None:
        """Write a force per length along a thread."""
        for key in ("torque", "axis", "profile", "start", "until", "ramp"):
            if getattr(self, key) != type(self).model_fields[key].default:
                raise InputError(
                    f"{name}.{key} is given, but {name}.along is {self.along!r}, a thread, along which a force is "
                    f"constant or follows a law"
                )
        if self.law is None:
            index = add_load(builder, kernels.UNIFORM, thread, [*vector, FRAMES[self.frame]])
        elif self.is_torque or self.frame == "body":
            key = "type" if self.is_torque else "frame"
            raise InputError(
                f"{name}.{key} is {getattr(self, key)!r}, but {name}.along is {self.along!r}, a thread, along which a "
                f"law is that of a force, in inertial axes"
            )
        else:
            index = add_load(builder, kernels.LAW, thread, **self._law(builder, name))
        builder.names[name] = ("loads", index)

    # ------------------------------------------------------------------------------------------------ at a point

    def _write_at(self, builder: Builder, name: str, vector: np.ndarray) -> None:
        """Write a force or torque at a point."""
        thread = self._thread_node(builder, name)
        if thread is not None:
            if self.is_torque:
                raise InputError(f"{name}.at is {self.at!r}, a node of a thread, on which only forces can act")
            self._write_load(builder, name, kernels.NODE, thread[0], vector, node=thread[1])
        elif builder.location(self.at, f"{name}.at").family == "beams":
            self._write_at_node(builder, name, vector)
        else:
            target = builder.marker(self.at, f"{name}.at")
            on_body = builder.rows["markers"][target]["kind"] == markers.ON_BODY
            refuse_ground(builder, name, self.at, target)
            if not on_body and (self.frame == "body" or self.is_torque):
                raise InputError(f"{name}.at is {self.at!r}; this load needs a body")
            kind = kernels.TORQUE if self.is_torque else kernels.AT_MARKER
            self._write_load(builder, name, kind, target, vector)

    def _thread_node(self, builder: Builder, name: str) -> tuple[int, int] | None:
        """Index of the thread and number of its node (0 at the tip) at which the load acts; None at other points."""
        thread, on = split_reference(self.at) if isinstance(self.at, str) else ("", None)
        family, index = builder.names.get(thread, ("", -1))
        if family != "threads":
            return None
        last = int(builder.rows["threads"][index]["n"]) - 1
        number = 0 if on == "tip" else on
        if not isinstance(number, int) or number > last:
            what = "is a thread" if on is None else f"has no {f'node {on}' if isinstance(on, int) else repr(on)}"
            raise InputError(f"{name}.at is {self.at!r}; {thread!r} {what}; give '{thread}.tip', or a node from its "
                             f"tip on, '{thread}[0]' to '{thread}[{last}]'")  # fmt: skip
        return index, number

    def _write_slope(self, builder: Builder, name: str) -> None:
        """Write a generalised force on a slope vector of a beam's node."""
        beam, formulation, iq, iv = node_of(builder, self.at, f"{name}.at")
        if self.slope >= NODE_VECTORS[formulation]:  # type: ignore[operator]
            raise InputError(f"{name}.slope is {self.slope!r}; a node of this beam has the slope 1 alone")
        if self.frame == "body":
            raise InputError(f"{name}.frame is 'body', but a force on a slope, {name}.slope, has inertial axes")
        off = 3 * self.slope  # type: ignore[operator]
        add_beam_load(builder, name, beam_loads.POINT, beam, self, axis=np.array(self.torque), iq=iq + off, iv=iv + off)

    def _write_at_node(self, builder: Builder, name: str, vector: np.ndarray) -> None:
        """Write a force or torque on a node of a beam."""
        beam, formulation, iq, iv = node_of(builder, self.at, f"{name}.at")
        if self.is_torque and formulation != BEAM and self.law is None:
            tangent = unit(builder.q[iq + 3 : iq + 6])
            if np.linalg.norm(np.cross(tangent, vector)) <= 1e-9 * np.linalg.norm(vector):
                key = "torque" if self.torque is not None else "axis"
                raise InputError(
                    f"{name}.{key} is {getattr(self, key)!r}, along the cable at {self.at!r}, which has no torsion; "
                    f"give a direction perpendicular to it, or use a beam"
                )
        if self.frame == "body" and formulation != BEAM:
            raise InputError(
                f"{name}.frame is 'body', but {name}.at is {self.at!r}, a node of a cable, which has no section; use "
                f"'inertial', or a beam"
            )
        kind = beam_loads.MOMENT if self.is_torque else beam_loads.POINT
        add_beam_load(
            builder, name, kind, beam, self, axis=vector, iq=iq, iv=iv, frame=int(FRAMES[self.frame]),
            **self._law(builder, name),
        )  # fmt: skip

    def _write_load(
        self, builder: Builder, name: str, kind: int, target: int, vector: np.ndarray, **fields: int
    ) -> None:
        """Append a force or torque to the family `loads`."""
        values = [*vector, FRAMES[self.frame], *window(builder, name, self)]
        if self.profile is not None:
            values += write_profile(builder, f"{name}.profile", self.profile)
        fields |= self._law(builder, name, "torque" if kind == kernels.TORQUE else "force", "law_")
        if self.law is not None and kind == kernels.TORQUE:
            fields["attitude"] = _attitude(self.law)
        builder.names[name] = ("loads", add_load(builder, kind, target, values, **fields))


def _is_torque(keys: Mapping[str, Any]) -> bool:
    """Whether a load with some keys is a torque."""
    word = keys.get("type")
    return bool(word == "torque" or (word is None and any(keys.get(key) is not None for key in _OF_TORQUE)))


def _attitude(law: Any) -> int:
    """Whether the law of a torque on a body is called with its attitude, and whether the load follows it."""
    if callable(law):
        return int(kernels.FOLLOWS) * int(law.of("torque").law_kind == "torque")
    used = {name for text in law for name in expressions.names(text)}
    follows = any(name[0] == "r" and name[1:].isdigit() for name in used)
    return int(kernels.FOLLOWS) if follows else 1
