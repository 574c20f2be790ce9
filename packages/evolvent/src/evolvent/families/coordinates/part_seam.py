"""Seam: joins edges of surfaces with one another, with bodies and with rods, node by node."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from evolvent.assembly.builder import Builder
from evolvent.assembly.references import split_reference
from evolvent.families.coordinates.part import JointSpring
from evolvent.families.joints.part import Joint
from evolvent.kernels import rigid
from evolvent.parts.applies import Applies, given, one_of, refuse_unfit
from evolvent.parts.base import Group, Part, Reference, Spread
from evolvent_base import units
from evolvent_base.errors import InputError

#: How far from one another two nodes may be that are joined, beside the length of their seam.
_APART = 1e-6


class Seam(Part):
    """A joint along an edge of a surface: a clamp, or a hinge along the edge, such as a fold with its own stiffness.

    Each node of the edge has a `Joint` of its own, with results under "seam 0", "seam 1" and so on, and with a
    `JointSpring` "seam spring 0" and so on where the seam has a stiffness, damping or latch. Two nodes that stand
    still, or that seams before this one clamp to the same body, have none. The seam's own results are their sums: force
    and moment on `b`, the angle of `b` as seen from `a`, and the torque of the springs.

    Parameters
    ----------
    a : str
        An edge of a surface, such as "panel.x1" or "panel.edge[1]", or a rod.
    b : str, optional
        What it is joined with: another edge or a rod, whose nodes are at the places of those of `a`, or a rigid body;
        the ground if left out. A rod that is clamped to an edge stiffens it.
    type : {"revolute", "clamp", "spherical"}
        revolute: a hinge about the edge of `a`, at each node about its tangent there. clamp: without rotation.
        spherical: the nodes coincide, all rotations are free.
    stiffness : float, N/rad
        Torque of the hinge per angle and per length of the edge.
    damping : float, N s/rad
        Torque of the hinge per rate of the angle and per length of the edge.
    start : float, rad
        Angle at the start: of b as seen from a, right-handed about the edge of `a` from its begin.
    rest : float, rad
        Angle at which the hinge has no torque.
    latch : float, rad, optional
        Angle at which the hinge locks permanently.
    latches : {"nodes", "edge"}
        nodes: each node locks by itself, by its own angle. edge: all lock at once, by the mean angle along the edge,
        as a latch at one place of a stiff edge.
    latch_stiffness : float, N/rad
        Of the latch, per length of the edge.
    latch_damping : float, N s/rad
        Of the latch, per length of the edge.
    """

    applies: ClassVar[Applies] = {
        **{key: (one_of("type", "revolute"),) for key in ("stiffness", "damping", "start", "rest", "latch")},
        **{key: (given("latch"),) for key in ("latches", "latch_stiffness", "latch_damping")},
    }
    kind: Literal["seam"] = "seam"
    writes_others = True
    group = Group.JOINTS
    a: Annotated[str, Reference(what="an edge of a surface, or a rod", edges=True)]
    b: Annotated[str, Reference(what="an edge of a surface, a rod or a body", edges=True)] = "ground"
    type: Literal["revolute", "clamp", "spherical"] = "revolute"
    stiffness: units.FoldStiffnessOrZero = 0.0
    damping: units.FoldDampingOrZero = 0.0
    start: units.Angle = 0.0
    rest: units.Angle = 0.0
    latch: units.Angle | None = None
    latches: Literal["nodes", "edge"] = "nodes"
    latch_stiffness: units.FoldStiffnessOrZero = 0.0
    latch_damping: units.FoldDampingOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write a joint of each node, and its spring."""
        refuse_unfit(name, self)
        if self.latch is not None and self.latch_stiffness == 0.0:
            raise InputError(f"{name}.latch_stiffness is 0.0; a latch needs one above 0 N/rad")
        nodes = self._nodes(builder, name, "a")
        if nodes is None:
            raise InputError(f"{name}.a is {self.a!r}; it must be an edge of a surface, such as 'panel.x1', or a rod")
        others = None if self.b == "ground" else self._others(builder, name, nodes)
        own, written, first = split_reference(self.a)[0], 0, len(builder.rows["coordinates"])
        sprung = bool(self.stiffness or self.damping or self.latch is not None)
        carried = self._carried(builder, name) if others is not None else {}
        for k, (node, share, tangent) in enumerate(zip(nodes.nodes, nodes.shares, nodes.tangents, strict=True)):
            point = f"{own}[{node}]"
            end: Any = tuple(builder.location(point).x.tolist()) if others is None else others[k]
            if self._stands(builder, point) and self._stands(builder, end):
                continue
            if point in carried and carried[point] == carried.get(end):
                continue
            taken = next((one for one in (f"{name} {k}", f"{name} spring {k}") if one in builder.specs), None)
            if taken is not None:
                raise InputError(f"{taken!r} is a part, and what {name!r} calls one of its joints; rename one of them")
            keys: Any = {"axis": tuple(tangent.tolist())} if self.type == "revolute" else {}
            a, b = (end, point) if others is None else (point, end)
            builder.write(f"{name} {k}", self._joint(k, a=a, b=b, type=self.type, **keys))
            if sprung:
                # with the ground as a, the angle of b is that of the edge: the other sense
                sense = -1.0 if others is None else 1.0
                spring = JointSpring(
                    joint=f"{name} {k}", stiffness=share * self.stiffness, damping=share * self.damping,
                    start=sense * self.start, rest=sense * self.rest,
                    latch=None if self.latch is None else sense * self.latch,
                    latch_stiffness=share * self.latch_stiffness, latch_damping=share * self.latch_damping,
                )  # fmt: skip
                builder.write(f"{name} spring {k}", spring)
            written += 1
        rows = builder.rows["coordinates"]
        for row in rows[first:] if self.latches == "edge" else ():
            row |= {"together": first, "together_end": len(rows)}
        builder.part = name
        if written == 0:
            raise InputError(f"{name} joins nodes that all stand still; leave it out")
        index = builder.add("seams", nodes=len(nodes.nodes), sprung=int(sprung), sense=-1 if others is None else 1)
        builder.names[name] = ("seams", index)

    def _joint(self, k: int, **keys: Any) -> Joint:
        """The joint of a node of the edge."""
        return Joint(**keys)

    def _nodes(self, builder: Builder, name: str, key: str) -> Spread | None:
        """Nodes of an edge or a rod; None of other parts."""
        part, on = split_reference(getattr(self, key))
        found: Spread | None = builder.specs[part].spread(part, on) if part in builder.specs else None
        if found is not None and found.surface:
            raise InputError(f"{name}.{key} is {part!r}, a whole surface; give an edge, such as '{part}.edge[0]'")
        return found

    def _others(self, builder: Builder, name: str, nodes: Spread) -> list[str]:
        """The point that each node is joined with."""
        own, (other, on), found = split_reference(self.a)[0], split_reference(self.b), self._nodes(builder, name, "b")
        if found is None:
            if on is not None or builder.names.get(other, ("", -1))[0] != "bodies":
                raise InputError(f"{name}.b is {self.b!r}; it must be an edge of a surface, a rod or a rigid body")
            return [other] * len(nodes.nodes)
        x = np.array([builder.location(f"{other}[{node}]").x for node in found.nodes])
        taken = []
        for node in nodes.nodes:
            place = builder.location(f"{own}[{node}]").x
            off = np.linalg.norm(x - place, axis=1)
            k = int(off.argmin())
            if off[k] > _APART * max(float(nodes.shares.sum()), float(np.abs(place).max())):
                raise InputError(
                    f"{name}: node {node} of {own!r} is {off[k]:.3g} m from the nearest node of {self.b!r}; nodes of "
                    f"both must be at the same places"
                )
            taken.append(f"{other}[{found.nodes[k]}]")
        return taken

    @staticmethod
    def _carried(builder: Builder, name: str) -> dict[str, str]:
        """Nodes that seams before this one clamp to bodies, and these: joints of two on one body are redundant."""
        found: dict[str, str] = {}
        for other, seam in builder.specs.items():
            if other != name and isinstance(seam, Seam) and seam.type == "clamp":
                nodes, (body, on) = seam._nodes(builder, other, "a"), split_reference(seam.b)
                if nodes is not None and on is None and builder.names.get(body, ("", -1))[0] == "bodies":
                    found |= {f"{split_reference(seam.a)[0]}[{node}]": body for node in nodes.nodes}
        return found

    @staticmethod
    def _stands(builder: Builder, where: Any) -> bool:
        """Whether a point is on the ground or a node that is held."""
        at = builder.location(where)
        body = builder.rows["bodies"][at.row] if at.family == "bodies" else {"motion": rigid.FREE}
        return bool(body["motion"] == rigid.DRIVEN and body["rate"] == 0.0)
