"""Net of cords over a wanted surface."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np

from evolvent.assembly.assembled import Pose
from evolvent.assembly.builder import Builder
from evolvent.families.beams.nodes import across
from evolvent.families.nets.part_ties import Anchors, AnyTies, Behind, HungNet, RearNet
from evolvent.families.nets.part_unfold import unfolded
from evolvent.kernels import markers
from evolvent.model.registry import asked
from evolvent.nets import form
from evolvent.nets.cut import read_cut
from evolvent.nets.surface import WantedSurface
from evolvent.nets.topology import AnyLayout, Topology
from evolvent.parts.applies import Applies, given, left_out, refuse_unfit
from evolvent.parts.base import Group, Part, Reference, unit
from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.file_keys import FileKey, digest
from evolvent_base.schema import members

Array = np.ndarray
#: How far a rim node may be from the node that holds it, beside the diameter of the aperture.
_NEAR = 0.05
#: Iterations of force densities towards wanted tensions, and the change of length by which they end.
_ITERATIONS, _CHANGE = 200, 1e-13


class Whole(NamedTuple):
    """A net with its ties and its rear net.

    Attributes
    ----------
    x : (n, 3) float, m, nodes of the net, of the rear net, and anchors of ties
    cords : (m, 2) int, their nodes: of the net, of the rear net, ties
    length, tension, stiffness : (m,) float, m, N and N, of the form
    anchors : int, number of the last nodes that are anchors
    """

    x: Array
    cords: Array
    length: Array
    tension: Array
    stiffness: Array
    anchors: int


def _whole(x: list[Array], cords: list[Array], densities: list[Array], stiffness: list[float], anchors: int) -> Whole:
    """A net of parts: nodes, cords, their force densities, N/m, and stiffnesses, N."""
    every, ends, density = np.concatenate(x), np.concatenate(cords), np.concatenate(densities)
    length = np.linalg.norm(every[ends[:, 1]] - every[ends[:, 0]], axis=1)
    each = np.repeat(stiffness, [len(one) for one in cords])
    return Whole(every, ends, length, density * length, each, anchors)


class Net(Part):
    """A net of cords over a wanted surface: its form follows from force densities, and its cords only pull.

    Its nodes are points, "net[0]" and so on in the order of the topology. At the start the net is in equilibrium under
    its tensions, on what holds its rim; the cords are cut so that they have these tensions. With `unfold` that is so
    where the rim has unfolded.

    Parameters
    ----------
    surface : {paraboloid: {focal_length, diameter, offset}} or {formula: {expression, diameter, offset}}
        The wanted surface, in the axes of the net: heights along `axis`, x along `direction`.
    topology : {rings: ..}, {gores: ..} or {file: ..}
        Nodes in the plane of the aperture and cords between them.
    force_density : float, N/m, optional
        Tension over length, of all cords.
    tension : float, N, optional
        Of all cords, in place of force densities.
    edge : float
        Factor of the force density or tension of cords at the edge.
    ties : {anchors: {to, length, stiffness}}, {rear: {gap, stiffness}} or {hung: {drop, stiffness}}, optional
        What pulls the nodes onto the surface; without ties a net is as flat as its rim lets it be.
    rim : list of str
        What holds the rim: the ground or one rigid body holds each node where it is. The nodes of rods and shells, and
        the points of several rigid bodies (their centres if they have none), hold the nodes of the net that are
        nearest to them. "bar" stands for "bar 1", "bar 2" and so on.
    rear_rim : list of str
        The same of a rear net that mirrors the net.
    stiffness : float, N
        E A of a cord.
    damping : float, s
        Factor of the stiffness of a cord that is its damping.
    mass_per_length : float, kg/m, optional
        Of a cord.
    node_mass : float, kg
        Of each node beside its cords: fittings, mesh.
    thermal_expansion : float, 1/K
        Of the cords.
    temperature : float, K
        Change of the temperature since the net has its form.
    cut : str, optional
        A file that `evolvent reflector` has written: lengths to which the cords are cut.
    unfold : list of str
        Joint springs whose angle or travel is 0 where the net has its form, while the parts beyond their joints are
        folded at the start. The net is then slack at the start. "hinge spring" stands for "hinge spring 1" and so on.
    position : (3,) float, m
        Of the origin of the wanted surface, inertial axes.
    axis : (3,) float
        Along which heights count.
    direction : (3,) float, optional
        Of x; if left out, x of the inertial axes, or y where `axis` is along x.
    """

    applies: ClassVar[Applies] = {
        "force_density": (left_out("tension"),),
        "temperature": (given("thermal_expansion"),),
        "rear_rim": (given("ties"),),
    }
    kind: Literal["net"] = "net"
    group = Group.BODIES
    surface: WantedSurface
    topology: AnyLayout
    force_density: units.ForceDensity | None = None
    tension: units.PositiveForce | None = None
    edge: units.PositiveNumber = 1.0
    ties: AnyTies | None = None
    rim: Annotated[tuple[str, ...], Reference(what="parts that hold the rim", several=True)] = ("ground",)
    rear_rim: Annotated[tuple[str, ...], Reference(what="parts that hold the rear rim", several=True)] = ("ground",)
    stiffness: units.PositiveForce
    damping: units.DurationOrZero = 0.0
    mass_per_length: units.LineDensity | None = None
    node_mass: units.MassOrZero = 0.0
    thermal_expansion: units.ThermalExpansion | None = None
    temperature: units.Temperature = 0.0
    cut: Annotated[str, FileKey(endings=(".json",))] | None = None
    unfold: Annotated[tuple[str, ...], Reference(what="joint springs", several=True)] = ()
    position: units.Position = (0.0, 0.0, 0.0)
    axis: units.Direction = (0.0, 0.0, 1.0)
    direction: units.Direction | None = None

    def references(self) -> Iterator[str]:
        """Of no part: a name may stand for several, and the net comes after them."""
        return iter(())

    @property
    def axes(self) -> Array:
        """Axes of the net, (3, 3), in columns."""
        three = unit(self.axis)
        one = np.array([1.0, 0.0, 0.0]) if self.direction is None else unit(self.direction)
        one = one - (one @ three) * three
        one = unit(one) if np.linalg.norm(one) > 1e-3 else across(three)
        return np.stack([one, np.cross(three, one), three], axis=1)

    def layout(self, name: str = "net") -> Topology:
        """Nodes in the plane, cords and facets."""
        return self.topology.topology(name, self.surface)

    def in_place(self, x: Array) -> Array:
        """Inertial positions of points (.., 3) in the axes of the net."""
        return np.asarray(np.array(self.position) + x @ self.axes.T)

    def seen(self, x: Array) -> Array:
        """Points (.., 3) at inertial positions, in the axes of the net."""
        return np.asarray((x - np.array(self.position)) @ self.axes)

    def form(self, name: str, topology: Topology, rim: Array, base: Array | None = None,
             rear: Array | None = None) -> Whole:  # fmt: skip
        """Form of the net on its rim, in the axes of the net.

        Parameters
        ----------
        rim : (r, 3) float, m, of the nodes that are held
        base : (f, 3) float, m, anchors; below the nodes if left out
        rear : (r, 3) float, m, rim of the rear net; below the rim if left out
        """
        factors = np.where(topology.edge, self.edge, 1.0)
        if self.tension is None:
            if self.force_density is None:
                raise InputError(f"{name}.force_density is missing; give it, or {name}.tension")
            return self._form(name, topology, rim, self.force_density * factors, base, rear)
        density = self.tension * factors / np.linalg.norm(np.diff(topology.plan[topology.cords], axis=1)[:, 0], axis=1)
        before = np.zeros(len(density))
        for _ in range(_ITERATIONS):
            found = self._form(name, topology, rim, density, base, rear)
            length = found.length[: len(density)]
            if np.abs(length - before).max() <= _CHANGE * self.surface.diameter:
                return found
            before, density = length, self.tension * factors / length
        raise InputError(
            f"{name}.tension is {self.tension:g} N of all cords, with which no form was found in {_ITERATIONS} "
            f"iterations; give {name}.force_density"
        )

    def _form(self, name: str, topology: Topology, rim: Array, density: Array, base: Array | None,
              rear: Array | None) -> Whole:  # fmt: skip
        """Form of the net with force densities of its cords (m,), N/m."""
        ties, free, n = self.ties, topology.free, len(topology.plan)
        if ties is None:
            return _whole([form.find_form(topology, rim, density)], [topology.cords], [density], [self.stiffness], 0)
        pull = form.Pull(self.surface.height if ties.tension is None else None, ties.tension or 0.0)
        start = form.axial_form(topology, rim, density, pull)
        if start[1].min() <= 0.0:
            k = int(start[1].argmin())
            raise InputError(
                f"{name}.ties: the tie of node {free[k]} would have to push, with {-start[1][k]:.3g} N; the surface "
                f"must be hollow along {name}.axis, and the node lower than the cords around it are without ties"
            )
        if isinstance(ties, Behind):
            below = ties.below(start[0])
            behind = form.Rear(density / ties.ratio, below[topology.rim] if rear is None else rear)
            found = form.tied_form(topology, rim, density, pull, start, below, behind)
            cords = [topology.cords, topology.cords + n, np.stack([free, free + n], axis=1)]
            stiffness = [self.stiffness, self.stiffness, ties.stiffness]
            return _whole([found.x, found.base], cords, [density, behind.density, found.tie], stiffness, 0)
        assert isinstance(ties, Anchors)
        below = start[0][free] - [0.0, 0.0, ties.length] if base is None else base
        found = form.tied_form(topology, rim, density, pull, start, below, None)
        cords = [topology.cords, np.stack([free, n + np.arange(len(free))], axis=1)]
        return _whole([found.x, below], cords, [density, found.tie], [self.stiffness, ties.stiffness], len(below))

    def write(self, builder: Builder, name: str) -> None:
        """Write the nodes into the family `points`, the cords into `springs`."""
        refuse_unfit(name, self)
        self._check(builder, name)
        topology = self.layout(name)
        if self.ties is not None and not topology.free.size:
            raise InputError(f"{name}.ties: all nodes are held at the rim, so that they pull none; leave the ties out")
        if self.mass_per_length is None and self.node_mass == 0.0:
            raise InputError(f"{name}.mass_per_length and {name}.node_mass are missing; give one of them")
        wanted = np.zeros((len(topology.plan), 3))
        wanted[:, :2] = topology.plan
        wanted[:, 2] = self.surface.height(*topology.plan.T)
        poses = self.poses(builder, name)
        held = self._held(builder, f"{name}.rim", self.rim, topology.rim, wanted, poses)
        rim, rear = self.seen(np.array([_place(poses, held[int(k)]) for k in topology.rim])), None
        if isinstance(self.ties, Behind):
            n = len(topology.plan)
            behind = self._held_behind(builder, f"{name}.rear_rim", topology.rim, wanted, held, poses)
            rear = self.seen(np.array([_place(poses, behind[int(k)]) for k in topology.rim]))
            held |= {n + k: one for k, one in behind.items()}
        found = self.form(name, topology, rim, rear=rear)
        lengths = self.natural_lengths(found)
        if self.cut is not None:
            lengths = read_cut(f"{name}.cut", self.cut, digest(self.cut), len(found.cords))
        if isinstance(self.ties, Anchors):
            anchor, n = builder.names[self.ties.to][1], len(found.x)
            low = self.in_place(found.x[n - found.anchors :])
            held |= {
                n - found.anchors + k: (anchor, poses[anchor].R.T @ (x - poses[anchor].x)) for k, x in enumerate(low)
            }
        x = self.in_place(found.x)
        if self.unfold:
            x = self._slack(builder, name, x, found, held, lengths)
        self._write(builder, name, found, held, lengths, x)

    def _check(self, builder: Builder, name: str) -> None:
        """Refuse what ties cannot be fixed to, a rear rim of no rear net, and cords that heat makes no length."""
        if isinstance(self.ties, Anchors) and builder.names.get(self.ties.to, ("", 0))[0] != "bodies":
            raise InputError(
                f"{name}.ties.anchors.to is {self.ties.to!r}; it must be 'ground' or a rigid body that is named before "
                f"the net"
            )
        if self.rear_rim != type(self).model_fields["rear_rim"].default and not isinstance(self.ties, RearNet):
            raise InputError(f"{name}.rear_rim is given, but {name}.ties are not of the kind 'rear'")
        self.heat(name, "temperature", self.temperature)

    def heat(self, name: str, key: str, change: float) -> float:
        """Strain of the cords by a change of temperature, K, that a key gives."""
        strain = (self.thermal_expansion or 0.0) * change
        if strain <= -1.0:
            raise InputError(
                f"{key if '.' in key else f'{name}.{key}'} is {change:g} K, which with {name}.thermal_expansion of "
                f"{self.thermal_expansion:g} 1/K is a strain of {strain:g}; it must be above -1"
            )
        return strain

    def poses(self, builder: Builder, name: str) -> list[Pose]:
        """Poses of the bodies that were written where the net has its form."""
        return unfolded(builder, f"{name}.unfold", self.springs(builder.names))

    def springs(self, parts: Collection[str]) -> list[str]:
        """Names of the joint springs that unfold, of the names of parts before the net."""
        return [own for one in self.unfold for own in members(parts, one) or [one]]

    def _slack(
        self, builder: Builder, name: str, x: Array, found: Whole, held: dict[int, Any], lengths: Array
    ) -> Array:
        """Inertial positions (n, 3), m, of the nodes with slack cords, on the rim as it is at the start."""
        x, free = x.copy(), np.setdiff1d(np.arange(len(x)), list(held))
        for k, one in held.items():
            x[k] = _place(builder.poses, one)
        x = form.slack_form(x, free, found.cords, lengths)
        length = np.linalg.norm(x[found.cords[:, 1]] - x[found.cords[:, 0]], axis=1)
        over = length / lengths - 1.0
        k = int(over.argmax())
        if over[k] > 0.0:
            a, b = found.cords[k].tolist()
            raise InputError(
                f"{name}.unfold: where the rim is folded the cord from node {a} to node {b} is {length[k]:.4g} m long, "
                f"but it is cut to {lengths[k]:.4g} m; fold the parts of the rim towards one another"
            )
        return x

    def natural_lengths(self, found: Whole) -> Array:
        """Lengths without tension, at the temperature of the form, m."""
        return form.cut_lengths(found.length, found.tension, found.stiffness)

    def _held_behind(self, builder: Builder, key: str, nodes: Array, wanted: Array, held: dict[int, Any],
                     poses: list[Pose]) -> dict[int, Any]:  # fmt: skip
        """What holds the rim of a rear net: parts of its own, or standoffs of those that hold the rim of the net."""
        assert isinstance(self.ties, Behind)
        if not isinstance(self.ties, HungNet):
            return self._held(builder, key, self.rear_rim, nodes, self.ties.below(wanted), poses)
        down = self.in_place(self.ties.below(np.zeros((1, 3))))[0] - self.in_place(np.zeros((1, 3)))[0]
        return {k: (body, at + poses[body].R.T @ down) for k, (body, at) in held.items()}

    def _held(self, builder: Builder, key: str, rim: tuple[str, ...], nodes: Array, wanted: Array,
              poses: list[Pose]) -> dict[int, Any]:  # fmt: skip
        """What holds each of some nodes at wanted places, in the axes of the net: a body, and a place of it."""
        parts = [own for one in rim for own in members(builder.names, one) or [one]]
        at: list[tuple[int, Array]] = []
        for part in parts:
            if part not in builder.names:
                raise InputError(f"{key}: no part is called {part!r}; name the parts that hold the rim before the net")
            family, index = builder.names[part]
            if family == "bodies":
                own = list(builder.body_points.get(part, {}).values()) or [(0.0, 0.0, 0.0)]
                at += [(index, np.array(one)) for one in own]
            elif family in asked("parts.touches"):
                at += [(one.body, one.place) for one in asked("parts.touches")[family](builder, part)]
            else:
                raise InputError(f"{key}: {part!r} has no nodes that are bodies; give rods, shells or bodies")
        bodies = [builder.names[part][1] for part in parts if builder.names[part][0] == "bodies"]
        if bodies and (len(bodies) < len(parts) or (len(bodies) > 1 and 0 in bodies)):
            raise InputError(
                f"{key} is {list(rim)}; one rigid body or the ground holds the whole rim, several rigid bodies, or "
                f"rods and shells, hold the nodes that are nearest to theirs"
            )
        if not bodies and not at:
            raise InputError(f"{key} is {list(rim)}; name at least one part that holds the rim, or 'ground'")
        x, found, taken = self.in_place(wanted), dict[int, Any](), dict[int, int]()
        places = np.array([_place(poses, one) for one in at]).reshape(-1, 3)
        for k in nodes.tolist():
            if len(bodies) == 1:
                pose = poses[bodies[0]]
                found[k] = (bodies[0], pose.R.T @ (x[k] - pose.x))
                continue
            off = np.linalg.norm(places - x[k], axis=1)
            best = int(off.argmin())
            if off[best] > _NEAR * self.surface.diameter:
                raise InputError(
                    f"{key}: the nearest node to rim node {k} at {np.round(x[k], 4).tolist()} m is {off[best]:.3g} m "
                    f"away; it must be within {_NEAR * self.surface.diameter:.3g} m: give parts with nodes there"
                )
            if best in taken:
                raise InputError(
                    f"{key}: the rim nodes {taken[best]} and {k} are both nearest to one node of what holds them; give "
                    f"more nodes there, or fewer nodes of the net"
                )
            taken[best], found[k] = k, at[best]
        return found

    def _write(self, builder: Builder, name: str, found: Whole, held: dict[int, Any], lengths: Array,
               x: Array) -> None:  # fmt: skip
        """Write records, with nodes at inertial positions (n, 3), m, and cords of lengths (m,), m."""
        n = len(x)
        masses = np.full(n, self.node_mass)
        for k in (0, 1):
            np.add.at(masses, found.cords[:, k], 0.5 * (self.mass_per_length or 0.0) * found.length)
        first_marker, first_point = len(builder.rows["markers"]), len(builder.rows["points"])
        for k in range(n):
            if k in held:
                body, place = held[k]
                builder.add("markers", kind=markers.ON_BODY, index=body, local=place)
                continue
            q, v = builder.coordinates(x[k].tolist(), (0.0, 0.0, 0.0))
            point = builder.add("points", iq=q, iv=v, mass=masses[k], compliance=1.0 / masses[k])
            builder.add("markers", kind=markers.ON_POINT, index=point, local=np.zeros(3))
        natural = lengths * (1.0 + self.heat(name, "temperature", self.temperature))
        first_spring = len(builder.rows["springs"])
        for (a, b), length, stiffness in zip(found.cords.tolist(), natural.tolist(), found.stiffness, strict=True):
            builder.add(
                "springs", a=first_marker + a, b=first_marker + b, stiffness=stiffness / length,
                damping=self.damping * stiffness / length, length=length, slack=1, lateral_stiffness=0.0,
                lateral_damping=0.0, axis=np.zeros(3), law=0, first=0, last=0, prony=0, prony_end=0, branch=0,
            )  # fmt: skip
        index = builder.add(
            "nets", first_marker=first_marker, nodes=n, first_point=first_point,
            points=len(builder.rows["points"]) - first_point, first_spring=first_spring, cords=len(found.cords),
            aperture=self.surface.diameter,
        )  # fmt: skip
        builder.names[name] = ("nets", index)


def _place(poses: list[Pose], held: tuple[int, Array]) -> Array:
    """Inertial position of a place of a body."""
    body, at = held
    return poses[body].x + poses[body].R @ at
