"""Geometrically exact shell."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from evolvent.assembly.assembled import Pose
from evolvent.assembly.builder import Builder
from evolvent.elements import rods
from evolvent.elements.laminates import Laminate, Ply, WallProperties, WallSection
from evolvent.elements.sections import MaterialOrName
from evolvent.families.beams.nodes import across
from evolvent.families.relaxation.family import add_branches, add_terms
from evolvent.families.shells import stiffness
from evolvent.families.shells.part_file import FORMATS, read
from evolvent.families.shells.part_mesh import (
    Mesh,
    areas_of,
    free_mesh,
    grid_edges,
    nodes_of,
    numbered,
    of_formula,
    of_nodes,
    part_of_cylinder,
    shares_of,
    tangents_of,
)
from evolvent.kernels import rigid
from evolvent.parts.applies import Applies, given, left_out, refuse_unfit
from evolvent.parts.base import Arrays, Group, Part, Spread, unit
from evolvent.parts.expression import Constants, SurfaceExpressions, refuse_unused
from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.file_keys import FileKey, digest

Array = np.ndarray
#: Positions of all nodes at the start.
StartNodes = Annotated[Any, Arrays(shape="of the shape (n1 + 1, n2 + 1, 3), or (n, 3)")]
#: Positions of all nodes.
ShellNodes = Annotated[tuple[tuple[units.Triple, ...], ...], Arrays(shape="of the shape (n1 + 1, n2 + 1, 3)")]
Elements = tuple[Annotated[int, units.Whole(least=1, most=1000)], Annotated[int, units.Whole(least=1, most=1000)]]


class Shell(Part):
    """A geometrically exact shell (Reissner, Mindlin; Simo, Fox): membrane, bending and shear, at any rotation.

    Each node has a rotation: joints, forces, torques and springs refer to the nodes "panel[0]", "panel[1]" and so on as
    to points of a body, and to ["panel", [x, y, z]] as to the node at a position, or nearest to it. Node (i, j) of the
    mesh has the number i (n2 + 1) + j (`Shell.node`). Loads and seams act along edges, "panel.x0".

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
    start : (n1 + 1, n2 + 1, 3) or (n, 3) float, m, optional
        Positions of all nodes at the start, inertial axes, where these are not those without stress: a shell that is
        stowed or rolled up.
    start_normals : (n1 + 1, n2 + 1, 3) or (n, 3) float, optional
        Normals at `start`; if left out, those of paraboloids through neighbouring nodes, whose errors at edges stress
        thin shells there.
    start_formula : list of three expressions, optional
        In place of `start` and `start_normals`: the shape at the start by x, y and z of u and v, as `formula`.
    formula : list of three expressions, optional
        x, y and z, m, of the parameters u along side 1 and v along side 2, both from 0 to 1, such as ["2*u", "v",
        "0.1*u**2"], in place of `size`: a smooth surface in the axes of `direction` and `normal` at `position`.
    constants : mapping of names to float
        Of the expressions of `formula` and `start_formula`.
    file : str, optional
        Mesh of quadrilaterals, in place of `size` and `elements`: a file of Gmsh (.msh) or Nastran (.bdf, .nas, .fem),
        for which the package meshio must be installed. Physical groups of curves and points are sets of nodes by their
        names. `position` is that of the file's origin.
    length_unit : float, m
        Unit of length of the file: 1 mm where that is in millimetres.
    elements : (2,) int, optional
        Numbers n1 and n2 of elements along both sides; of a mesh from a file its own.
    thickness : float, m, optional
        Of a homogeneous wall.
    material : Material, or the name of a known one, optional
        Of a homogeneous wall, linearly elastic or viscoelastic; its direction 1, if it has one, is along axis 1.
    section : Laminate or MatrixWall, optional
        In place of thickness and material: {laminate: [{material, thickness, angle}, ..]}, plies from the bottom to the
        top, or {stiffness: {matrix, mass_per_area}}, with the stiffness (8, 8).
    position : (3,) float, m
        Position of the corner where both sides begin, inertial axes.
    direction : (3,) float, optional
        Axis 1 there, inertial axes; x if left out. With `nodes` or `file` axis 1 at each node is the part of it in the
        surface, with `nodes` along side 1 if left out.
    normal : (3,) float, optional
        Normal there, inertial axes, perpendicular to `direction`; if left out, z, or y where axis 1 is along z.
    clamped : list of str
        Edges whose nodes stand still: "x0", "x1", "y0", "y1", the begin and end of side 1 (x) and of side 2 (y), which
        are "edge[0]" to "edge[3]" too; of a mesh from a file "edge[0]" and so on, which end at corners and go
        round the surface, counterclockwise about the normal, from the corner with the lowest number; or sets of the
        file.
    drilling : float
        Stiffness against rotations of nodes about the normal, which the shell does not resist by itself, beside that
        of membrane shear.
    velocity : (3,) float, m/s
        Velocity of the first node at the start, inertial axes.
    angular_velocity : (3,) float, rad/s
        Angular velocity of the whole shell about its first node at the start, inertial axes.
    mass_damping : float, 1/s
        Factor alpha of damping forces -alpha M v.
    stiffness_damping : float, s
        Factor beta of the damping forces: beta times the stiffness times the rates of the strains, without that of
        `drilling`.

    Notes
    -----
    Elements of four nodes with the strains of edges and diagonals as long as arcs, transverse shear by Dvorkin and
    Bathe, and resultants of Pian and Sumihara: bending is exact on regular meshes up to fourth order, and warped or
    distorted elements do not lock. The membrane strain is Green's, and strains are small: bent to a radius R, a shell
    of the thickness h is shorter by h^2/(12 R^2). The masses are lumped at the nodes. A viscoelastic material, or plies
    of such, relax with all strains but those of `drilling`.
    """

    applies: ClassVar[Applies] = {
        "thickness": (left_out("section"),),
        "material": (left_out("section"),),
        "size": (left_out("nodes", "formula", "file"),),
        "radius": (left_out("nodes", "formula", "file"),),
        "nodes": (left_out("formula", "file"),),
        "normals": (given("nodes"),),
        "start_normals": (given("start"),),
        "formula": (left_out("file"),),
        "start": (left_out("start_formula"),),
        "start_formula": (left_out("start", "nodes", "file"),),
        "constants": (given("formula", "start_formula"),),
        "length_unit": (given("file"),),
        "elements": (left_out("file"),),
        "position": (left_out("nodes"),),
        "normal": (left_out("nodes", "file"),),
    }
    kind: Literal["shell"] = "shell"
    group = Group.BODIES
    size: units.Pair | None = None
    radius: units.Length | None = None
    nodes: ShellNodes | None = None
    normals: ShellNodes | None = None
    start: StartNodes | None = None
    start_normals: StartNodes | None = None
    start_formula: SurfaceExpressions | None = None
    formula: SurfaceExpressions | None = None
    constants: Constants | None = None
    file: Annotated[str, FileKey(endings=tuple(FORMATS))] | None = None
    length_unit: units.Length = 1.0
    elements: Elements | None = None
    thickness: units.Length | None = None
    material: MaterialOrName | None = None
    section: WallSection | None = None
    position: units.Position = (0.0, 0.0, 0.0)
    direction: units.Direction | None = None
    normal: units.Direction | None = None
    clamped: tuple[str, ...] = ()
    drilling: units.PositiveNumber = 1e-4
    velocity: units.Velocity = (0.0, 0.0, 0.0)
    angular_velocity: units.AngularVelocity = (0.0, 0.0, 0.0)
    mass_damping: units.RateOrZero = 0.0
    stiffness_damping: units.DurationOrZero = 0.0

    def node(self, i: int, j: int) -> int:
        """Number of the node i along side 1, j along side 2, of a mesh of `elements`."""
        assert self.elements is not None
        return i * (self.elements[1] + 1) + j

    def refined(self, name: str, parts: Mapping[str, Part]) -> Shell:
        """The shell with twice as many elements along both sides."""
        for key in ("file", "nodes", "start"):
            if getattr(self, key) is not None:
                raise InputError(
                    f"an estimate of the mesh error needs a finer mesh, but {name}.{key} has this one; compare with a "
                    f"case of more elements"
                )
        return self if self.elements is None else self.with_keys(elements=tuple(2 * n for n in self.elements))

    def refined_node(self, node: int) -> int:
        """Node (2 i, 2 j) of the node (i, j)."""
        assert self.elements is not None
        i, j = divmod(node, self.elements[1] + 1)
        return 2 * i * (2 * self.elements[1] + 1) + 2 * j

    def edge(self, edge: str | int, name: str = "shell") -> Array:
        """Numbers of the nodes of an edge, from its begin, or of a set of the file."""
        return nodes_of(self._sides(edge, name))

    def edge_shares(self, edge: str | int, name: str = "shell") -> Array:
        """Lengths of the edge that its nodes stand for, m: of a force per length, that at each node."""
        return shares_of(self.mesh(name).x, self._sides(edge, name))

    def _sides(self, edge: str | int, name: str) -> Array:
        """Sides of elements along an edge, (k, 2)."""
        word = numbered(edge) if isinstance(edge, int) else edge
        edges = self.mesh(name).edges if self.elements is None else grid_edges(*self.elements)
        if word not in edges:
            raise InputError(f"{name} has no edge {word!r}; give one of {', '.join(edges)}")
        return edges[word]

    def spread(self, name: str, on: str | int | None) -> Spread:
        """Nodes of an edge or set, with their lengths; of the whole shell, with their areas."""
        x, R = self.start_nodes(name)
        if isinstance(on, int):
            raise InputError(f"{name}[{on}] is one node; give {name!r} or an edge, such as '{name}.{numbered(0)}'")
        if on is None:
            return Spread(np.arange(len(x)), areas_of(self.mesh(name)), R[:, :, 0], surface=True)
        sides = self._sides(on, name)
        return Spread(nodes_of(sides), self.edge_shares(on, name), tangents_of(x, sides), surface=False)

    def mesh(self, name: str = "shell") -> Mesh:
        """Nodes without stress, their axes, elements and edges."""
        refuse_unfit(name, self)
        if self.file is not None:
            found = read(self.file, digest(self.file))
            x = self.length_unit * found.x + np.array(self.position)
            return free_mesh(name, x, found.quads, self._direction, found.sets)
        if self.elements is None:
            raise InputError(f"{name}.elements is missing; only a mesh from a file has its own")
        if self.nodes is not None:
            x = self._of_shape(name, "nodes")
            normals, along = None, None if self.direction is None else self._direction
            if self.normals is not None:
                normals = self._unit_vectors(name, "normals", self._of_shape(name, "normals"))
            return of_nodes(name, x, normals, along)
        place, axes = np.array(self.position), self._axes(name)
        if self.formula is not None:
            self._check_constants(name)
            return of_formula(f"{name}.formula", self.formula, self.constants, self.elements, place, axes)
        if self.size is None:
            raise InputError(f"{name}.size is missing; give it, or {name}.nodes, {name}.formula or {name}.file")
        if min(self.size) <= 0.0:
            raise InputError(f"{name}.size is {self.size!r}; both lengths must be above 0")
        if self.radius is not None:
            turn = math.degrees(self.size[1] / (self.elements[1] * self.radius))
            if turn > stiffness.LARGEST_TURN:
                raise InputError(
                    f"{name}.radius is {self.radius:g} m: elements along side 2 are arcs of {turn:.4g} deg; at most "
                    f"{stiffness.LARGEST_TURN:g} deg is allowed, use more elements or a larger radius"
                )
        return part_of_cylinder(self.size, self.radius, self.elements, place, axes)

    def _of_shape(self, name: str, key: str) -> Array:
        """Vectors of all nodes."""
        assert self.elements is not None
        found, wanted = np.array(getattr(self, key), dtype=float), (self.elements[0] + 1, self.elements[1] + 1, 3)
        if found.shape != wanted:
            raise InputError(f"{name}.{key} has the shape {found.shape}; it must be {wanted}")
        return found

    @property
    def _direction(self) -> Array:
        """Unit vector of axis 1."""
        return unit((1.0, 0.0, 0.0) if self.direction is None else self.direction)

    def _of_nodes(self, name: str, key: str, count: int) -> Array:
        """Vectors (count, 3) of all nodes, on a grid or not."""
        found = np.array(getattr(self, key), dtype=float)
        if found.size != 3 * count or found.shape[-1] != 3:
            raise InputError(
                f"{name}.{key} has the shape {found.shape}; it must have the vectors of all {count} nodes, in their "
                f"order"
            )
        return found.reshape(-1, 3)

    @staticmethod
    def _unit_vectors(name: str, key: str, found: Array) -> Array:
        """Vectors of length 1."""
        sizes = np.linalg.norm(found, axis=-1, keepdims=True)
        if not np.all(sizes > 0.0):
            raise InputError(f"{name}.{key} has a vector of length 0; all must be of another length")
        return np.asarray(found / sizes)

    def _axes(self, name: str) -> Array:
        """Axes at the corner, (3, 3), in columns."""
        one = self._direction
        if self.normal is None:
            flat = np.array([0.0, 0.0, 1.0])
            three = flat - one * one[2] if abs(one[2]) < 0.9 else across(one)
            three = three / np.linalg.norm(three)
        else:
            three = unit(self.normal)
        if abs(one @ three) > 1e-9:
            raise InputError(
                f"{name}.normal is {self.normal!r}; it must be perpendicular to {name}.direction, "
                f"{tuple(one.tolist())!r}"
            )
        return np.stack([one, np.cross(three, one), three], axis=1)

    def wall(self, name: str = "shell") -> WallProperties:
        """Stiffness and inertia of the wall."""
        if self.section is not None:
            return self.section.properties()
        for key in ("thickness", "material"):
            if getattr(self, key) is None:
                raise InputError(f"{name}.{key} is missing; give thickness and material, or section")
        return Laminate(plies=self.plies).properties()

    @property
    def plies(self) -> tuple[Ply, ...]:
        """Plies of the wall, one of a homogeneous wall; none of a wall by its stiffness matrix."""
        if self.section is not None:
            return self.section.plies if isinstance(self.section, Laminate) else ()
        assert self.material is not None
        assert self.thickness is not None
        return (Ply(material=self.material, thickness=self.thickness),)

    def write(self, builder: Builder, name: str) -> None:
        """Write the nodes into the family `bodies`, the rest into `shells` and `shell_elements`."""
        mesh, wall = self.mesh(name), self.wall(name)
        x, R = self.start_nodes(name)
        for axes in (mesh.R, R):
            turns = stiffness.largest_turns(axes[mesh.quads][..., 2])
            k = int(turns.argmax())
            if turns[k] > stiffness.LARGEST_TURN:
                raise InputError(
                    f"{name}.elements is {self.elements!r}, but the normals of element {k} are {turns[k]:.0f} deg "
                    f"apart; at most {stiffness.LARGEST_TURN:g} deg is allowed, use more elements"
                )
        own = mesh.R[mesh.quads]
        found = stiffness.constants(
            name,
            mesh.x[mesh.quads],
            own,
            own[..., 0].sum(axis=1),
            wall.stiffness,
            wall.expansion,
            [part for _, part in wall.relaxing],
        )
        areas = np.zeros(len(x))
        np.add.at(areas, mesh.quads, 0.25 * found.area[:, None])
        first_body = self._write_nodes(builder, name, x, R, areas, wall)
        first, C = len(builder.rows["shell_elements"]), wall.stiffness
        terms = [add_terms(builder, law) for law, _ in wall.relaxing]
        starts = stiffness.measures(x[mesh.quads], R[mesh.quads]) - found.rest
        for k, area in enumerate(found.area.tolist()):
            relaxation = len(builder.rows["shell_relaxations"])
            for own_terms, (K, forces) in zip(terms, found.parts, strict=True):
                builder.add(
                    "shell_relaxations", stiffness=K[k], resultants=forces[k], **own_terms,
                    branch=add_branches(builder, own_terms, starts[k]),
                )  # fmt: skip
            builder.add(
                "shell_elements", nodes=first_body + mesh.quads[k], area=area, beta=self.stiffness_damping,
                relaxation=relaxation, relaxation_end=relaxation + len(terms),
                membrane=float(C[:3, :3].max()), drilling=0.25 * self.drilling * float(C[2, 2]) * area,
                stiffness=found.stiffness[k], resultants=found.resultants[k], rest=found.rest[k],
                slopes=found.slopes[k], untwisted=found.untwisted[k], heated=0, expansion=found.free[k],
            )  # fmt: skip
        index = builder.add(
            "shells", first_element=first, elements=len(mesh.quads), first_body=first_body, nodes=len(x),
            alpha=self.mass_damping, relaxes=int(bool(terms)), compliance=np.linalg.inv(C),
        )  # fmt: skip
        builder.names[name] = ("shells", index)

    def start_nodes(self, name: str = "shell") -> tuple[Array, Array]:
        """Positions (n, 3), m, and axes (n, 3, 3), in columns, of the nodes at the start."""
        mesh = self.mesh(name)
        if self.start_formula is not None:
            return self._shaped(name, mesh)
        if self.start is None:
            return mesh.x, mesh.R
        x, normals = self._of_nodes(name, "start", len(mesh.x)), None
        if self.start_normals is not None:
            normals = self._unit_vectors(name, "start_normals", self._of_nodes(name, "start_normals", len(x)))
        slopes = stiffness.drilling(mesh.x[mesh.quads], mesh.R[mesh.quads])[0]
        return x, mesh.moved(f"{name}.start", x, normals, slopes)

    def _shaped(self, name: str, mesh: Mesh) -> tuple[Array, Array]:
        """Positions and axes of the nodes at the start by `start_formula`."""
        assert self.start_formula is not None
        assert self.elements is not None
        if self.formula is None:  # else the constants were checked with the mesh
            self._check_constants(name)
        axes, place = self._axes(name), np.array(self.position)
        found = of_formula(f"{name}.start_formula", self.start_formula, self.constants, self.elements, place, axes)
        slopes = stiffness.drilling(mesh.x[mesh.quads], mesh.R[mesh.quads])[0]
        return found.x, mesh.moved(f"{name}.start_formula", found.x, found.R[..., 2], slopes)

    def _check_constants(self, name: str) -> None:
        """Refuse constants that neither expression uses."""
        keys = [key for key in ("formula", "start_formula") if getattr(self, key) is not None]
        texts = [text for key in keys for text in getattr(self, key)]
        refuse_unused(f"{name}.constants", self.constants, " or ".join(f"{name}.{key}" for key in keys), texts)

    def _write_nodes(self, builder: Builder, name: str, x: Array, R: Array, areas: Array, wall: WallProperties) -> int:
        """Write the nodes as bodies, free but at edges that are clamped; returns the first one's index."""
        held = {int(k) for edge in self.clamped for k in self.edge(edge, f"{name}.clamped: {name}")}
        first, turns, w = len(builder.rows["bodies"]), rods.quaternion(R), np.array(self.angular_velocity)
        speeds = np.array(self.velocity) + np.cross(w, x - x[0])
        own, axis, rest = w @ R, np.array([1.0, 0.0, 0.0]), np.zeros(3)
        inertias = (wall.inertia * areas)[:, None, None] * np.diag([1.0, 1.0, 2.0])
        for k, (place, mass, inertia) in enumerate(zip(x, (wall.mass * areas).tolist(), inertias, strict=True)):
            if k in held:
                q, at, motion, pose = -1, -1, rigid.DRIVEN, Pose(place, R[k], rest, rest)
            else:
                q, at = builder.coordinates([*place, *turns[k]], [*speeds[k], *own[k]])
                motion, pose = rigid.FREE, Pose(place, R[k], speeds[k], w)
            builder.poses.append(pose)
            builder.add(
                "bodies", motion=motion, iq=q, iv=at, mass=mass, inertia=inertia, axis=axis,
                R0=R[k], x0=place, rate=0.0, spin_inertia=float(inertia[0, 0]),
            )  # fmt: skip
        return first
