"""Thread: lumped masses on springs or on segments of fixed length, paid out by a reel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.assembly.references import Location
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.families.relaxation.family import add_branches, add_terms
from evolvent.families.threads.part_reel import Reel
from evolvent.kernels import markers, rigid, thread as kernels
from evolvent.kernels.drive import LEAST_OUT
from evolvent.parts.applies import Applies, left_out, one_of
from evolvent.parts.base import Group, Part, PointReference, ReelName, unit
from evolvent.parts.drive import FreeSpool, RampDrive
from evolvent.parts.feedback import FeedbackDrive
from evolvent_base import units
from evolvent_base.dense import norm, product
from evolvent_base.errors import InputError, nearest

#: Of a thread whose end is fixed, at the start.
LARGEST_STRAIN = 0.1
#: Of a segment: the shortest length that counts for the stiffness of a boundary segment by its length.
SHORTEST_FRACTION = 0.1
SEGMENTS = {"springs": kernels.SPRINGS, "inextensible": kernels.INEXTENSIBLE}


def turns_with(builder: Builder, body: int, axis: np.ndarray, centre: np.ndarray) -> bool:
    """Whether the rotation of a spinning body acts on its spool: axes not perpendicular, or centre off the plane."""
    along = builder.rows["bodies"][body]["axis"]
    return bool(abs(along @ axis) > 1e-9 or abs(centre @ axis) > 1e-9)


def give_mass(builder: Builder, node: int, end: int) -> None:
    """Add the mass of a thread's first node to the point mass that the thread ends at, if it is one."""
    marker, row = builder.rows["markers"][end], builder.rows["nodes"][node]
    if marker["kind"] == markers.ON_POINT:
        point = builder.rows["points"][marker["index"]]
        point["mass"] += row["mass"]
        point["compliance"] = 1.0 / point["mass"]
        row["mass"] = row["compliance"] = 0.0


class Thread(Part):
    """A thread of n equal segments, its tip first off the reel.

    Parameters
    ----------
    reel : str
        Reel from which the thread is paid out.
    length : float, m
        Length of the whole thread.
    line_density : float, kg/m
        Mass per length.
    nodes : int
        Number n of lumped masses.
    tip_mass : float, kg
        Added to the first node.
    end : point, optional
        Point of a body or a point mass, such as "satellite.hook", to which the outer end is fixed. Without it the end
        is an attachment point for springs, forces, point masses and joints, by the name "tether.tip" (`segments`
        'springs', `mesh` 'material'). On a moving mesh it is on the ground or a driven body.
    segments : {"springs", "inextensible"}
        Springs, or segments of fixed length.
    stiffness, damping : float, N/m and N s/m
        Of one segment (springs). The damper takes the rate of the elongation: at the spool all that is paid out counts.
    viscoelastic : mapping, optional
        How the stiffness relaxes, which is the instantaneous one then (`segments` 'springs', `mesh` 'material'):
        `prony`, rows of share and relaxation time, and `shift`, what temperature does. A thread that is held loses
        tension by the series, and one under a load creeps.
    mesh : {"material", "moving"}
        Whether nodes are fixed to the material and leave the spool one by one, or all stand on the deployed length, in
        equal parts, and material flows through the mesh (springs). A moving mesh carries wound thread. It needs a
        deployed length of at least a thousandth of `length`.
    take_up : str, optional
        Reel onto which the outer end is wound (`mesh` 'moving', on the ground or a driven body). It takes up where its
        drive turns backwards, and has nothing on it at the start. The thread runs straight from reel to reel.
    slack : bool
        Whether a spring segment only pulls: it is slack below its natural length, and while its damper would push
        harder than its spring pulls. Otherwise it carries compression. Under generalized-alpha let the steps follow
        from `tolerance`.
    boundary_segment : {"constant", "by-length"}
        Stiffness and damping of the segment between the spool and the last node off it (springs on mesh 'material'):
        those of its own natural length b, `stiffness` l0/b, or, as in the paper, those of a whole segment at any
        length, with which a line is too soft by up to 1/(whole segments that are out).
    shortest_fraction : float
        Fraction of a segment, above 0 and up to 1: below this length the stiffness of the boundary segment stays that
        at it (`boundary_segment` 'by-length'). Explicit methods need steps shorter by
        sqrt((1 + 1/shortest_fraction)/2) where the stiffness limits them, and by (1 + 1/shortest_fraction)/2 where the
        damping does: 2.3 and 5.5 with the default.
    direction : (3,) float, optional
        Direction of the thread deployed at the start, body axes; the pay-out axis of the reel if left out. With `end`
        or `take_up` the thread is straight to that point.
    rotate_velocity : bool
        Whether a released node's velocity is turned along the thread (springs; eq. 12).
    wound_mass : {"ignored", "carried"}
        Whether wound thread acts on the body that carries it. Ignored, as in the paper, momentum appears with
        every released node; carried, momentum is kept.
    separates : bool
        Whether the thread leaves the spool when it is all out (separation).
    multiplicity : int
        Number of identical threads, evenly spaced about the spin axis, that this one stands for.
    capture_fraction : float
        Fraction of a segment at which a node that is reeled in goes back onto the spool.
    width : float, m, optional
        Of a tape, along the axis of its spool: it is drawn as a strip.
    thickness : float, m
        Thickness of a tape wound in an Archimedean spiral. The reel's radius is then that with the whole tape wound. It
        decreases by the thickness per turn. The departure point Q is fixed, as that of an eyelet.

    Notes
    -----
    Masses by Tenenbaum (2014), eq. 6: m_i = rho l0, the tip m_k + rho l0 / 2, l0 = length / n. The half segment at
    the root is not counted. On springs what is out at the start is not stretched yet and rings for a while. Carried
    thread is evenly wound: a thin ring of radius r about the spool's axis, that turns with the spool. What a node's
    momentum at Q differs from its share of the ring acts on the body as an impulse when the node leaves or comes back.

    With `end` the first node is that place: the tension of the outermost segment acts on it, and the mass of half a
    segment and `tip_mass` move with it. On a body their energy and momentum count as those of the thread; on a point
    mass they are added to its mass. The thread deployed at the start is straight, and stretched uniformly where the
    point is farther away than the deployed length. Without `slack` the segments carry compression: give the end a
    velocity away from the reel, or keep the thread taut by a spin.

    A boundary segment whose stiffness k follows its natural length b stores k (l - b)^2/2 at the length l: what the
    spool pays out changes it by -T (1 + strain/2) per length. A driven spool takes up that much power, and a free one
    is turned by that force, which is the tension T plus the strain energy per length. A released node starts on a
    segment without strain, as under 'constant'. When a node has gone back onto the spool, the next segment is longer
    than l0, by up to `capture_fraction` l0, and softer by as much, also where `shortest_fraction` is 1.

    The memory of a viscoelastic thread is that of the strain of each segment. Wound thread has none. What is paid out
    into the segment at the spool, or wound up from it, has the mean of that segment's: an error of the order of its
    length, as of all that is lumped. The spool takes or gives the energy of that thread, as above. A free spool then
    needs an explicit method.
    """

    applies: ClassVar[Applies] = {
        **{key: (one_of("segments", "springs"),) for key in ("stiffness", "damping", "mesh")},
        **{
            key: (one_of("segments", "springs"), one_of("mesh", "material"))
            for key in ("boundary_segment", "rotate_velocity", "viscoelastic")
        },
        "slack": (one_of("segments", "springs"),),
        "end": (one_of("segments", "springs"), left_out("take_up")),
        "take_up": (one_of("segments", "springs"), one_of("mesh", "moving"), left_out("end")),
        **{key: (one_of("mesh", "material"),) for key in ("wound_mass", "separates", "capture_fraction")},
        "shortest_fraction": (
            one_of("boundary_segment", "by-length"),
            one_of("segments", "springs"),
            one_of("mesh", "material"),
        ),
        "direction": (left_out("end"), left_out("take_up")),
    }
    kind: Literal["thread"] = "thread"
    group = Group.BODIES
    reel: ReelName
    length: units.Length
    line_density: units.LineDensity
    nodes: Annotated[int, units.Whole(least=1, most=1_000_000)] = 20
    tip_mass: units.MassOrZero = 0.0
    end: PointReference | None = None
    segments: Literal["springs", "inextensible"] = "springs"
    stiffness: units.StiffnessOrZero = 1e4
    damping: units.DampingOrZero = 0.0
    viscoelastic: Viscoelastic | None = None
    mesh: Literal["material", "moving"] = "material"
    take_up: ReelName | None = None
    slack: bool = False
    boundary_segment: Literal["constant", "by-length"] = "by-length"
    shortest_fraction: units.PositiveNumber = SHORTEST_FRACTION
    direction: units.Direction | None = None
    rotate_velocity: bool = True
    wound_mass: Literal["ignored", "carried"] = "ignored"
    separates: bool = False
    multiplicity: Annotated[int, units.Whole(least=1, most=1_000_000)] = 1
    capture_fraction: units.PositiveNumber = 1e-3
    width: units.Length | None = None
    thickness: units.LengthOrZero = 0.0

    def refined(self, name: str, parts: Mapping[str, Part]) -> Thread:
        """The thread with every segment in halves, of the same stiffness and damping of a length."""
        keys: dict[str, Any] = {"nodes": 2 * self.nodes}
        if self.segments == "springs":
            keys |= {"stiffness": 2.0 * self.stiffness, "damping": 2.0 * self.damping}
        return self.with_keys(**keys)

    def write(self, builder: Builder, name: str) -> None:
        """Write the thread into the families `threads` and `nodes`."""
        reel = builder.specs.get(self.reel)
        if not isinstance(reel, Reel):
            known = [n for n, part in builder.specs.items() if isinstance(part, Reel)]
            raise InputError(f"{name}.reel is {self.reel!r}; {nearest(self.reel, known)}")
        kind, n, length, tip = SEGMENTS[self.segments], self.nodes, self.length, self.tip_mass
        l0 = length / n
        body = builder.find(reel.body, "bodies")
        motion = builder.rows["bodies"][body]["motion"]
        self._check_segments(name, kind)
        self._check_body(builder, name, reel, body)
        X, Y, Z = reel.frame(self.reel)
        centre = np.array(reel.centre)
        drive = reel.drive.write(builder, f"{self.reel}.drive")
        angle, rate, _ = reel.drive.at(builder, drive, 0.0)
        core = reel.radius**2 - length * self.thickness / np.pi
        out = angle * (reel.radius - 0.25 * self.thickness / np.pi * angle)
        self._check_wound(name, reel, core, out, still=angle == 0.0 and rate == 0.0)
        take_up = self._take_up(builder, name)
        released = min(int(np.ceil(round(out / l0, 9))), n)
        moving = self.mesh == "moving"
        if moving:
            self._check_mesh(name, out)
            released, kind = n, kernels.MOVING
        departure = centre + reel.radius * Z
        direction, distance, end = X if self.direction is None else unit(self.direction), out, -1
        if self.end is not None or take_up:
            released = max(released, 1)
            key, end = ("take_up", take_up["end"]) if take_up else ("end", builder.marker(self.end, f"{name}.end"))
            direction, distance = self._to_end(builder, name, key, end, body, departure, X, out)
        q, v = self._start(
            builder, body, departure, direction, kind, n, released, out, rate * reel.radius, distance, end
        )
        first, terms = len(builder.rows["nodes"]), add_terms(builder, self.viscoelastic)
        for i in range(n):
            span = l0 if i > 0 else 0.5 * l0
            span *= out / length if moving else 1.0
            mass = self.line_density * span + (tip if i == 0 else 0.0)
            strain = 0.0
            if i < released and out > 0.0:
                strain = self._strain(distance / out - 1.0, l0 if i < released - 1 else out - i * l0)
            branch = add_branches(builder, terms, strain, dashpot=True)
            builder.add("nodes", mass=mass, compliance=1.0 / mass, span=span, branch=branch)
        if end >= 0:
            give_mass(builder, first, end)
        index = builder.add(
            "threads",
            kind=kind,
            iq=q,
            iv=v,
            n=n,
            node=first,
            copies=self.multiplicity,
            segment=l0,
            stiffness=self.stiffness,
            damping=self.damping,
            body=body,
            departure=departure,
            payout_axis=X,
            chord=Y,
            normal=Z,
            radius=reel.radius,
            drive=drive.kind,
            first=drive.first,
            last=drive.last,
            law=drive.law,
            spool_q=drive.spool_q,
            spool_v=drive.spool_v,
            spool_inertia=drive.inertia,
            spool_torque=drive.torque,
            turned=int(self.rotate_velocity),
            carried=int(self.wound_mass == "carried" or moving),
            density=self.line_density,
            tip_mass=tip,
            separates=int(self.separates),
            capture=self.capture_fraction,
            **({"end": -1, "take_drive": -1} | take_up | ({"end": end} if end >= 0 else {})),
            slack=int(self.slack),
            shortest=l0 * self.shortest_fraction if self._follows_length else 0.0,
            coiling=0.5 * self.thickness / np.pi,
            core=np.sqrt(core),
            spool_friction=drive.friction,
            spool_viscous=drive.viscous,
            spool_switch=-1,
            tip=-1,
            **terms,
            motor_profile=drive.profile,
            motor_law=drive.motor,
            motor_first=drive.motor_first,
            motor_last=drive.motor_last,
            coupled=int(motion == rigid.FREE or (motion == rigid.SPIN and turns_with(builder, body, Y, centre))),
        )
        builder.released.append(released)
        builder.names[name] = ("threads", index)

    @property
    def _follows_length(self) -> bool:
        """Whether the stiffness of the boundary segment is that of its length."""
        return self.boundary_segment == "by-length" and self.segments == "springs" and self.mesh == "material"

    def _strain(self, stretch: float, rest: float) -> float:
        """Strain of a segment that is `rest` long without stress, as `kernels.thread.relaxing` has it, m."""
        if self._follows_length:
            l0 = self.length / self.nodes
            rest *= l0 / max(rest, self.shortest_fraction * l0)
        return max(stretch * rest, 0.0) if self.slack else stretch * rest

    def _check_segments(self, name: str, kind: int) -> None:
        """Refuse keys that do not fit the segments."""
        if kind == kernels.SPRINGS and self.stiffness == 0.0:
            raise InputError(f"{name}.stiffness is {self.stiffness!r}; segments that are springs need one above 0 N/m")
        given = "boundary_segment" in self.model_fields_set and self.boundary_segment != "constant"
        if given and kind != kernels.SPRINGS:
            raise InputError(
                f"{name}.boundary_segment is {self.boundary_segment!r}; it needs {name}.segments 'springs', not "
                f"{self.segments!r}"
            )
        for key, needed in (("segments", "springs"), ("mesh", "material")):
            if self.viscoelastic is not None and getattr(self, key) != needed:
                raise InputError(
                    f"{name}.viscoelastic is given; it needs {name}.{key} {needed!r}, not {getattr(self, key)!r}"
                )
        if self.shortest_fraction > 1.0:
            raise InputError(
                f"{name}.shortest_fraction is {self.shortest_fraction!r}; it must be above 0 and at most 1, of the "
                f"length of a segment"
            )
        if not self._follows_length and self.shortest_fraction != SHORTEST_FRACTION:
            raise InputError(
                f"{name}.shortest_fraction is {self.shortest_fraction!r}; it needs {name}.boundary_segment 'by-length'"
            )
        if self.slack and kind != kernels.SPRINGS:
            raise InputError(f"{name}.slack is true; it needs {name}.segments 'springs', not {self.segments!r}")

    def _check_mesh(self, name: str, out: float) -> None:
        """Refuse keys that do not fit a moving mesh, and a start with too little out."""
        if self.segments != "springs":
            raise InputError(f"{name}.mesh is 'moving'; it needs {name}.segments 'springs', not {self.segments!r}")
        for key, allowed in (("separates", False), ("boundary_segment", "constant")):
            if key in self.model_fields_set and getattr(self, key) != allowed:
                raise InputError(f"{name}.{key} is {getattr(self, key)!r}, which mesh 'moving' does not support; "
                                 f"leave it out, or use mesh 'material'")  # fmt: skip
        least = LEAST_OUT * self.length
        if out < least * (1.0 - 1e-9):
            raise InputError(
                f"{name}.mesh is 'moving', but {out:g} m are out at the start; start with "
                f"at least {least:g} m (`angle` of {self.reel}.drive)"
            )

    def _take_up(self, builder: Builder, name: str) -> dict[str, Any]:
        """Fields of the take-up reel, with the marker `end` where the thread meets it; none without one."""
        if self.take_up is None:
            return {}
        key, reel = f"{name}.take_up", builder.specs.get(self.take_up)
        if not isinstance(reel, Reel):
            known = [n for n, part in builder.specs.items() if isinstance(part, Reel)]
            raise InputError(f"{key} is {self.take_up!r}; {nearest(self.take_up, known)}")
        for n, part in builder.specs.items():
            if isinstance(part, Thread) and self.take_up in (part.reel, part.take_up if part is not self else None):
                raise InputError(f"{key} is {self.take_up!r}, a reel of the thread {n!r}; give one of its own")
        if self.mesh != "moving":
            raise InputError(f"{key} is {self.take_up!r}; it needs {name}.mesh 'moving', not {self.mesh!r}")
        if self.end is not None:
            raise InputError(f"{name}.end and {key} are both given; leave one of them out")
        if isinstance(reel.drive, (FreeSpool, FeedbackDrive)):
            what = "a free spool" if isinstance(reel.drive, FreeSpool) else "one that reacts"
            may = "be free" if isinstance(reel.drive, FreeSpool) else "react"
            raise InputError(f"{self.take_up}.drive is {what}, but {key} names that reel; give it a drive that "
                             f"prescribes its angle (only {self.reel!r} may {may})")  # fmt: skip
        body = builder.find(reel.body, "bodies")
        normal = reel.frame(self.take_up)[2]
        drive = reel.drive.write(builder, f"{self.take_up}.drive")
        angle = reel.drive.at(builder, drive, 0.0)[0]
        if angle != 0.0:
            raise InputError(f"{self.take_up}.drive.angle is {angle!r} rad; a take-up reel is empty at the start, so "
                             f"it must be 0 there")  # fmt: skip
        place = np.array(reel.centre) + reel.radius * normal
        end = builder.add("markers", kind=markers.ON_BODY, index=body, local=place)
        return {
            "end": end, "take_drive": drive.kind, "take_first": drive.first, "take_last": drive.last,
            "take_law": drive.law, "take_radius": reel.radius,
        }  # fmt: skip

    def _check_body(self, builder: Builder, name: str, reel: Reel, body: int) -> None:
        """Refuse a body whose motion does not fit the thread."""
        row = builder.rows["bodies"][body]
        if self.mesh == "moving" and row.get("path"):
            raise InputError(f"{name}.mesh is 'moving', which carries wound thread, but {reel.body!r} is driven along "
                             f"a line; use 'material', or a free body")  # fmt: skip
        if self.wound_mass == "carried" and row.get("path"):
            raise InputError(f"{name}.wound_mass is 'carried', but {reel.body!r} is driven along a line; "
                             f"use 'ignored', or a free body")  # fmt: skip
        if self.multiplicity > 1 and row["motion"] == rigid.FREE:
            raise InputError(
                f"{name}.multiplicity is {self.multiplicity!r}; above 1 it needs a spinning or driven body"
            )

    def _check_wound(self, name: str, reel: Reel, core: float, out: float, *, still: bool) -> None:
        """Refuse a drive, a thickness and a start that do not fit the thread; core : m2, radius of the core squared."""
        if self.segments == "inextensible":
            if isinstance(reel.drive, RampDrive) and any(duration == 0.0 for _, duration, _ in reel.drive.steps):
                raise InputError(
                    f"{self.reel}.drive.steps holds one of no duration, which jerks an inextensible thread; give it a "
                    f"duration above 0"
                )
            if still:
                raise InputError(
                    f"{self.reel}.drive starts at rest with nothing out, where an inextensible thread has no "
                    "direction; start with some length out (`angle` above 0), or at a rate above 0"
                )
        if core <= 0.0:
            raise InputError(
                f"{name}.thickness is {self.thickness!r} m, which leaves no core: {self.length:g} m of tape do not fit "
                f"within {self.reel}.radius, {reel.radius!r} m; it must be below "
                f"{np.pi * reel.radius**2 / self.length:.6g} m"
            )
        if out > self.length * (1.0 + 1e-12):
            raise InputError(
                f"{self.reel}.drive: {out:g} m are out at the start, more than {name}.length, {self.length:g} m"
            )

    def tip_location(self, builder: Builder, name: str, where: str, key: str) -> Location:
        """The end of the thread as a place: what it is fixed to, or a point mass that takes the first node's mass."""
        row = builder.rows["threads"][builder.names[name][1]]
        if row["end"] < 0:
            self.check_tip(builder, name, where, key)
            x, v = builder.q[row["iq"] :][:3], builder.v[row["iv"] :][:3]
            q, rate = builder.coordinates(x, v)
            point = builder.add("points", iq=q, iv=rate, mass=0.0, compliance=0.0)
            builder.names[f"{name}.tip"] = ("points", point)
            row["tip"] = point
            marker = builder.add("markers", kind=markers.ON_POINT, index=point, local=np.zeros(3))
            self.fix_tip(builder, name, marker, v)
        at = builder.rows["markers"][row["end"]]
        position, velocity = builder.marker_state(row["end"])
        if at["kind"] == markers.ON_BODY:
            return Location("bodies", at["index"], at["local"], -1, -1, -1, position, velocity, False)
        own = builder.rows["points"][at["index"]]
        return Location("points", at["index"], np.zeros(3), own["iq"], own["iv"], -1, position, velocity, False)

    def check_tip(self, builder: Builder, name: str, where: str, key: str) -> None:
        """Refuse an end that cannot be an attachment point of other parts."""
        given = f"{key} is {where!r}"
        if self.segments != "springs":
            raise InputError(f"{given}; it needs {name}.segments 'springs', not {self.segments!r}")
        if self.mesh == "moving":
            raise InputError(f"{given}; it needs {name}.mesh 'material', not 'moving'")
        if self.multiplicity > 1:
            raise InputError(f"{given}; it needs {name}.multiplicity 1, which is {self.multiplicity!r}")
        if builder.released[builder.names[name][1]] == 0:
            raise InputError(f"{given}, but nothing of {name!r} is out at the start; start with some length out "
                             f"(`angle` of {self.reel}.drive above 0)")  # fmt: skip

    def fix_tip(self, builder: Builder, name: str, end: int, v: Sequence[float] | np.ndarray) -> None:
        """Fix the end to a marker at the same position, with the velocity v (3,); nodes move with both ends."""
        index = builder.names[name][1]
        row, released, n = builder.rows["threads"][index], builder.released[index], self.nodes
        iq, iv = row["iq"], row["iv"]
        rates = np.array(builder.v[iv : iv + 3 * n]).reshape(n, 3)
        x = np.array(builder.q[iq : iq + 3 * n]).reshape(n, 3)
        pose = builder.poses[row["body"]]
        length = np.linalg.norm(x[:released] - (pose.x + product(pose.R, row["departure"])), axis=1)
        rates[:released] += np.outer(length / length[0], np.array(v) - rates[0])
        rates[0] = x[0] = 0.0  # not used: the first node is that point
        builder.v[iv : iv + 3 * n] = rates.ravel().tolist()
        builder.q[iq : iq + 3 * n] = x.ravel().tolist()
        row["end"] = end
        give_mass(builder, row["node"], end)

    def _to_end(
        self,
        builder: Builder,
        name: str,
        of: str,
        end: int,
        body: int,
        departure: np.ndarray,
        X: np.ndarray,
        out: float,
    ) -> tuple[np.ndarray, float]:
        """Direction to the marker that the end is fixed to (body axes), and its distance; `of` is the key."""
        key, given = f"{name}.{of}", getattr(self, of)
        if self.segments != "springs":
            raise InputError(f"{key} is {given!r}; it needs {name}.segments 'springs', not {self.segments!r}")
        if self.multiplicity > 1:
            raise InputError(f"{key} is {given!r}; it needs {name}.multiplicity 1, which is {self.multiplicity!r}")
        if self.direction is not None:
            raise InputError(f"{name}.direction and {key} are both given; leave one of them out")
        row, pose = builder.rows["markers"][end], builder.poses[body]
        driven = row["kind"] == markers.ON_BODY and builder.rows["bodies"][row["index"]]["motion"] == rigid.DRIVEN
        if self.mesh == "moving" and not driven:
            raise InputError(
                f"{key} is {given!r}, which moves freely; with {name}.mesh 'moving', whose elements have masses that "
                f"couple both ends, it must be on the ground or a driven body; use mesh 'material'"
            )
        if self.mesh == "moving" and self.nodes < 2:
            raise InputError(f"{name}.nodes is {self.nodes!r}; with {key} and mesh 'moving' it must be 2 or more")
        if row["kind"] == markers.ON_BODY and row["index"] == body and self.mesh == "material":
            raise InputError(f"{key} is {given!r}, on the body of {self.reel!r} itself; give a point of another part")
        away = builder.marker_state(end)[0] - (pose.x + product(pose.R, departure))
        distance = norm(away)
        if not out * (1.0 - 1e-6) - 1e-9 <= distance <= out * (1.0 + LARGEST_STRAIN) + 1e-9:
            r, c = builder.specs[self.reel].radius, 0.5 * self.thickness / np.pi
            angle = 2.0 * distance / (r + np.sqrt(max(r * r - 2.0 * c * distance, 0.0)))
            raise InputError(
                f"{key} is {given!r}, {distance:.6g} m from where the thread leaves {self.reel!r}, but the "
                f"deployed length at the start is {out:.6g} m; set {self.reel}.drive.angle to {angle:.9g} rad, or "
                f"move the point"
            )
        return (product(pose.R.T, away) / distance if distance > kernels.TINY else X), distance

    def _start(
        self,
        builder: Builder,
        body: int,
        departure: np.ndarray,
        direction: np.ndarray,
        kind: int,
        n: int,
        released: int,
        out: float,
        speed: float,
        distance: float,
        end: int,
    ) -> tuple[int, int]:
        """Coordinates of all nodes: straight, rotating with the body or moving with both ends."""
        pose, l0 = builder.poses[body], self.length / n
        e = product(pose.R, direction)
        d = product(pose.R, departure)
        q, v = np.zeros((n, 3)), np.zeros((n, 3))
        if kind == kernels.INEXTENSIBLE:
            q[:] = e
            v[:released] = np.cross(pose.w, e)
        elif end >= 0:
            root, far = pose.x + d, builder.marker_state(end)
            root_speed = pose.v + np.cross(pose.w, d) + speed * e
            if self.mesh == "moving":
                root_speed = pose.v + np.cross(pose.w, d)  # nodes move less than their material
            for i in range(released):
                share = (out - i * l0) / out if out > 0.0 else 0.0
                share = 1.0 - i / n if self.mesh == "moving" else share
                q[i] = root + share * distance * e
                v[i] = root_speed + share * (far[1] - root_speed)
            q[0], v[0] = 0.0, 0.0  # not used: the first node is that point
        else:
            for i in range(released):
                share = 1.0
                arm = d + (out - i * l0) * e
                if self.mesh == "moving":  # whose nodes move less than their material
                    share = 1.0 - i / n
                    arm = d + share * out * e
                q[i] = pose.x + arm
                v[i] = pose.v + np.cross(pose.w, arm) + share * speed * e
        return builder.coordinates(list(q.ravel()), list(v.ravel()))
