"""Geometrically exact shell."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np

from evolvent.assembly.assembled import Pose
from evolvent.assembly.builder import Builder
from evolvent.elements import rods
from evolvent.elements.sections import MaterialOrName
from evolvent.families.beams.part import _across
from evolvent.families.shells import stiffness
from evolvent.kernels import rigid
from evolvent.parts.applies import Applies, given, left_out
from evolvent.parts.base import Arrays, Group, Part, unit
from evolvent_base import units
from evolvent_base.errors import InputError

Array = np.ndarray
#: Positions of all nodes.
ShellNodes = Annotated[tuple[tuple[units.Triple, ...], ...], Arrays(shape="of the shape (n1 + 1, n2 + 1, 3)")]
Edge = Literal["x0", "x1", "y0", "y1"]
#: Largest angle between the directors of neighbouring nodes at the start, degrees.
LARGEST_TURN = 90.0


class Shell(Part):
    """A geometrically exact shell (Reissner, Mindlin; Simo, Fox): membrane, bending and shear, at any rotation.

    Each node has a rotation: joints, forces, torques and springs refer to the nodes "panel[0]", "panel[1]" and so on as
    to points of a body. Node (i, j) of the mesh has the number i (n2 + 1) + j (`Shell.node`).

    Parameters
    ----------
    size : (2,) float, m, optional
        Lengths of the sides along axes 1 and 2, of a rectangle or, with `radius`, of a part of a cylinder.
    radius : float, m, optional
        Of a cylinder with its axis along axis 1, on whose outside the normal is; the second side is its arc.
    nodes : (n1 + 1, n2 + 1, 3) float, m, optional
        Positions of all nodes without stress, inertial axes, in place of `size`.
    normals : (n1 + 1, n2 + 1, 3) float, optional
        Normals of the surface at `nodes`; if left out, those of paraboloids through neighbouring nodes. Exact ones make
        coarse meshes of curved shells more accurate.
    elements : (2,) int
        Numbers n1 and n2 of elements along both sides.
    thickness : float, m
        Of the wall.
    material : Material, or the name of a known one
        Linearly elastic.
    position : (3,) float, m
        Position of the corner where both sides begin, inertial axes.
    direction : (3,) float
        Axis 1 there, inertial axes.
    normal : (3,) float, optional
        Normal there, inertial axes, perpendicular to `direction`; if left out, z, or y where axis 1 is along z.
    clamped : list of {"x0", "x1", "y0", "y1"}
        Edges whose nodes stand still: the begin and end of side 1 (x) and of side 2 (y).
    drilling : float
        Stiffness against rotations of nodes about the normal, which the shell does not resist by itself, beside that
        of membrane shear.
    velocity : (3,) float, m/s
        Velocity of the first node at the start, inertial axes.
    angular_velocity : (3,) float, rad/s
        Angular velocity of the whole shell about its first node at the start, inertial axes.

    Notes
    -----
    Elements of four nodes with the strains of edges and diagonals as long as arcs, transverse shear by Dvorkin and
    Bathe, and resultants of Pian and Sumihara: bending is exact on regular meshes up to fourth order, and warped or
    distorted elements do not lock. The membrane strain is Green's, and strains are small: bent to a radius R, a shell
    of the thickness h is shorter by h^2/(12 R^2). The masses are lumped at the nodes.
    """

    applies: ClassVar[Applies] = {
        "size": (left_out("nodes"),),
        "radius": (left_out("nodes"),),
        "normals": (given("nodes"),),
        "position": (left_out("nodes"),),
        "direction": (left_out("nodes"),),
        "normal": (left_out("nodes"),),
    }
    kind: Literal["shell"] = "shell"
    group = Group.BODIES
    size: units.Pair | None = None
    radius: units.Length | None = None
    nodes: ShellNodes | None = None
    normals: ShellNodes | None = None
    elements: tuple[Annotated[int, units.Whole(least=1, most=1000)], Annotated[int, units.Whole(least=1, most=1000)]]
    thickness: units.Length
    material: MaterialOrName
    position: units.Position = (0.0, 0.0, 0.0)
    direction: units.Direction = (1.0, 0.0, 0.0)
    normal: units.Direction | None = None
    clamped: tuple[Edge, ...] = ()
    drilling: units.PositiveNumber = 1e-4
    velocity: units.Velocity = (0.0, 0.0, 0.0)
    angular_velocity: units.AngularVelocity = (0.0, 0.0, 0.0)

    def node(self, i: int, j: int) -> int:
        """Number of the node i along side 1, j along side 2."""
        return i * (self.elements[1] + 1) + j

    def edge(self, edge: Edge) -> Array:
        """Numbers of the nodes of an edge, from its begin."""
        numbers = np.arange((self.elements[0] + 1) * (self.elements[1] + 1)).reshape(self.elements[0] + 1, -1)
        return {"x0": numbers[0], "x1": numbers[-1], "y0": numbers[:, 0], "y1": numbers[:, -1]}[edge].copy()

    def edge_shares(self, edge: Edge, name: str = "shell") -> Array:
        """Lengths of the edge that its nodes stand for, m: of a force per length, that at each node."""
        x = self.mesh(name)[0].reshape(-1, 3)[self.edge(edge)]
        lengths = np.linalg.norm(np.diff(x, axis=0), axis=1)
        return np.asarray(0.5 * (np.append(lengths, 0.0) + np.append(0.0, lengths)))

    def mesh(self, name: str = "shell") -> tuple[Array, Array]:
        """Positions (n1 + 1, n2 + 1, 3), m, and axes (n1 + 1, n2 + 1, 3, 3), columns 1, 2 and the normal, of the nodes."""
        n1, n2 = self.elements
        if self.nodes is not None:
            x = np.array(self.nodes, dtype=float)
            if x.shape != (n1 + 1, n2 + 1, 3):
                raise InputError(f"{name}.nodes has the shape {x.shape}; it must be {(n1 + 1, n2 + 1, 3)}")
            if self.normals is None:
                return x, _axes_of(x, _normals_of(name, x))
            normals = np.array(self.normals, dtype=float)
            sizes = np.linalg.norm(normals, axis=-1, keepdims=True)
            if normals.shape != x.shape or not np.all(sizes > 0.0):
                raise InputError(
                    f"{name}.normals has the shape {normals.shape}; it must be {x.shape}, of vectors that are not 0"
                )
            return x, _axes_of(x, normals / sizes)
        if self.size is None:
            raise InputError(f"{name}.size is missing; give it, or {name}.nodes")
        if min(self.size) <= 0.0:
            raise InputError(f"{name}.size is {self.size!r}; both lengths must be above 0")
        one = unit(self.direction)
        if self.normal is None:
            flat = np.array([0.0, 0.0, 1.0])
            three = flat - one * one[2] if abs(one[2]) < 0.9 else _across(one)
            three = three / np.linalg.norm(three)
        else:
            three = unit(self.normal)
        if abs(one @ three) > 1e-9:
            raise InputError(
                f"{name}.normal is {self.normal!r}; it must be perpendicular to {name}.direction, {self.direction!r}"
            )
        two = np.cross(three, one)
        along, across = np.linspace(0.0, self.size[0], n1 + 1), np.linspace(0.0, self.size[1], n2 + 1)
        x, R = np.empty((n1 + 1, n2 + 1, 3)), np.empty((n1 + 1, n2 + 1, 3, 3))
        for j, s in enumerate(across):
            turn = 0.0 if self.radius is None else s / self.radius
            sine, cosine = np.sin(turn), np.cos(turn)
            place = s * two if self.radius is None else self.radius * (sine * two + (cosine - 1.0) * three)
            x[:, j] = np.array(self.position) + along[:, None] * one + place
            R[:, j] = np.array([one, cosine * two - sine * three, cosine * three + sine * two]).T
        return x, R

    def write(self, builder: Builder, name: str) -> None:
        """Write the nodes into the family `bodies`, the rest into `shells` and `shell_elements`."""
        n1, n2 = self.elements
        places, turns = self.mesh(name)
        x, R = places.reshape(-1, 3), turns.reshape(-1, 3, 3)
        material = self.material
        C = stiffness.isotropic(material.E, material.nu, self.thickness, material.shear)
        corners = [
            np.array([self.node(i, j), self.node(i + 1, j), self.node(i + 1, j + 1), self.node(i, j + 1)])
            for i in range(n1)
            for j in range(n2)
        ]
        constants = []
        for k, own in enumerate(corners):
            cosines = np.clip(R[own, :, 2] @ R[own, :, 2].T, -1.0, 1.0)
            turn = float(np.degrees(np.arccos(cosines.min())))
            if turn > LARGEST_TURN:
                raise InputError(
                    f"{name}.elements is {self.elements!r}, but the normals of element {k} are {turn:.0f} deg apart; "
                    f"at most {LARGEST_TURN:g} deg is allowed, use more elements"
                )
            along = R[own, :, 0].sum(axis=0)
            constants.append(stiffness.element_constants(f"element {k} of {name}", x[own], R[own], along, C))
        masses = np.zeros(len(x))
        for own, found in zip(corners, constants, strict=True):
            masses[own] += 0.25 * found.area * self.thickness * material.density
        first_body = self._write_nodes(builder, x, R, masses)
        first = len(builder.rows["shell_elements"])
        for own, found in zip(corners, constants, strict=True):
            builder.add(
                "shell_elements", nodes=first_body + own, area=found.area, membrane=float(C[:3, :3].max()),
                drilling=0.25 * self.drilling * float(C[2, 2]) * found.area, stiffness=found.stiffness,
                resultants=found.resultants, rest=found.rest, slopes=found.slopes, untwisted=found.untwisted,
            )  # fmt: skip
        index = builder.add(
            "shells", first_element=first, elements=len(corners), first_body=first_body, nodes=len(x),
        )  # fmt: skip
        builder.names[name] = ("shells", index)

    def _write_nodes(self, builder: Builder, x: Array, R: Array, masses: Array) -> int:
        """Write the nodes as bodies, free but at edges that are clamped; returns the first one's index."""
        held = {int(k) for edge in self.clamped for k in self.edge(edge)}
        first, turns, w = len(builder.rows["bodies"]), rods.quaternion(R), np.array(self.angular_velocity)
        speeds = np.array(self.velocity) + np.cross(w, x - x[0])
        for k, (place, mass) in enumerate(zip(x, masses, strict=True)):
            inertia = mass * self.thickness**2 / 12.0 * np.diag([1.0, 1.0, 2.0])
            if k in held:
                q, at, motion, pose = -1, -1, rigid.DRIVEN, Pose(place, R[k], np.zeros(3), np.zeros(3))
            else:
                q, at = builder.coordinates([*place, *turns[k]], [*speeds[k], *(R[k].T @ w)])
                motion, pose = rigid.FREE, Pose(place, R[k], speeds[k], w)
            builder.poses.append(pose)
            builder.add(
                "bodies", motion=motion, iq=q, iv=at, mass=mass, inertia=inertia, axis=np.array([1.0, 0.0, 0.0]),
                R0=R[k], x0=place, rate=0.0, spin_inertia=float(inertia[0, 0]),
            )  # fmt: skip
        return first


def _axes_of(x: Array, three: Array) -> Array:
    """Axes (n1 + 1, n2 + 1, 3, 3) of nodes x with the given normals: axis 1 is along the first side."""
    one = np.gradient(x, axis=0)
    one -= np.sum(one * three, axis=-1, keepdims=True) * three
    one /= np.linalg.norm(one, axis=-1, keepdims=True)
    return np.stack([one, np.cross(three, one), three], axis=-1)


def _normals_of(name: str, x: Array) -> Array:
    """Normals (n1 + 1, n2 + 1, 3) of a smooth surface through nodes."""
    found = _mean_normals(name, x)
    for _ in range(2):
        for place in np.ndindex(found.shape[:2]):
            found[place] = _fitted_normal(x, place, found[place])
    return found


def _mean_normals(name: str, x: Array) -> Array:
    """Means of the normals of the elements at each node, (n1 + 1, n2 + 1, 3)."""
    n1, n2 = x.shape[0] - 1, x.shape[1] - 1
    normals = np.zeros_like(x)
    areas = np.cross(x[1:, 1:] - x[:-1, :-1], x[:-1, 1:] - x[1:, :-1])
    for i in (0, 1):
        for j in (0, 1):
            normals[i : n1 + i, j : n2 + j] += areas
    sizes = np.linalg.norm(normals, axis=-1, keepdims=True)
    if np.any(sizes <= 0.0):
        i, j = np.unravel_index(int(sizes.argmin()), sizes.shape[:2])
        raise InputError(f"{name}.nodes has no normal at the node ({i}, {j}); elements there must have an area")
    return normals / sizes


def _fitted_normal(x: Array, place: tuple[int, ...], normal: Array) -> Array:
    """Normal at a node of the surface of second order through it that fits the nodes around it best."""
    first = [max(0, min(k - 1, n - 3)) for k, n in zip(place, x.shape, strict=False)]
    around = x[first[0] : first[0] + 3, first[1] : first[1] + 3]
    long = 1 if around.shape[1] == 3 else 0  # three nodes along this side
    if around.shape[long] < 3:
        return normal
    d = (around - x[place]).reshape(-1, 3)
    d /= np.abs(d).max()
    side = around.take(2, long)[0] - around.take(0, long)[0]
    one = unit(side - (side @ normal) * normal)
    two = np.cross(normal, one)
    u, v, z = d @ one, d @ two, d @ normal
    terms = [u, v, u * u, u * v, v * v] if around.shape[1 - long] == 3 else [u, v, u * u, u * v]
    fit = np.linalg.lstsq(np.stack(terms, axis=1), z, rcond=1e-6)[0]
    return unit(normal - fit[0] * one - fit[1] * two)
