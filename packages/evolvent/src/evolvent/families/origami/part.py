"""Origami: a sheet of rigid or flexible facets that folds along creases."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import PrivateAttr

from evolvent.assembly.builder import Builder
from evolvent.elements.fold_files import Crease, Pattern, path_of, read
from evolvent.elements.laminates import WallProperties, WallSection
from evolvent.elements.rods import quaternion
from evolvent.elements.sections import MaterialOrName
from evolvent.families.origami.facet import Facet, Fold, Hinge, HingeSpring, inertia_of
from evolvent.families.origami.folding import EDGES, Folded, edge_of, state
from evolvent.families.shells.part import Shell
from evolvent.kernels.rotations import rotation_from_quaternion
from evolvent.parts.applies import Applies, given, left_out, one_of, refuse_unfit
from evolvent.parts.base import Group, Part, unit
from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.file_keys import FileKey, digest

Array = np.ndarray
#: Most that a vertex of a frame may be off the state of rigid facets, beside the size of the pattern.
_OFF = 1e-3
#: Largest fold angle, rad: at half a turn facets lie on one another.
_LARGEST = math.pi - 1e-3
#: Keys of flexible facets.
_OF_SHELLS = ("rigid", "elements", "mass_damping", "stiffness_damping")
FacetNumber = Annotated[int, units.Whole(least=0, most=100_000)]
FacetNumbers = tuple[FacetNumber, ...]


class Origami(Part):
    """A sheet of facets that folds along creases, by a crease pattern in a file of FOLD.

    Facets are rigid bodies or shells "sheet facet 0", "sheet facet 1" and so on, by their numbers in the file, to which
    other parts may refer. Creases are joints "sheet crease 5", by the numbers of the edges, with springs "sheet
    crease 5 spring" where they have a stiffness, damping or latch; of flexible facets they are seams.

    Parameters
    ----------
    file : str
        Crease pattern (.fold), or the name of a shipped one, miura-8x8: the key frame is the flat pattern, with
        vertices_coords, edges_vertices and edges_assignment, and faces_vertices unless the edges enclose the facets.
        Creases M, V and U are hinges, F and J do not fold, along C the sheet is cut.
    length_unit : float, m, optional
        Unit of length of a file without frame_unit; 1 m if left out.
    fold_angle : float, rad
        Fold angle at the start of the crease that folds most; those of the others follow from the rigid facets, as the
        sheet folds from flat in the senses of the assignments, or those of edges_foldAngle.
    frame : str, optional
        Title, or number from 1, of one of file_frames, in whose folded state the sheet starts, at its places.
    facets : {"rigid", "flexible"}
        flexible: facets of four vertices are shells, others stay rigid.
    rigid : list of int
        Numbers of facets that stay rigid beside flexible ones, such as those to which other parts are fixed.
    elements : int
        Elements of a flexible facet along each of its sides.
    thickness : float, m, optional
        Of a homogeneous wall.
    material : Material, or the name of a known one, optional
        Of a homogeneous wall.
    section : Laminate or MatrixWall, optional
        In place of thickness and material, as of a shell.
    stiffness : float, N/rad
        Torque of creases per angle and per length.
    damping : float, N s/rad
        Torque of creases per rate of the angle and per length.
    rest : float, rad
        Fold angle of the sheet, counted as `fold_angle`, at which the creases have no torque; flat if left out.
    latch : float, rad, optional
        Fold angle of the sheet, counted as `fold_angle`, at which each crease locks permanently.
    latch_stiffness : float, N/rad
        Of the latch, per length.
    latch_damping : float, N s/rad
        Of the latch, per length.
    base : int
        Facet that starts where it is in the flat pattern, or in `frame`.
    position : (3,) float, m
        Of the origin of the pattern or frame at the start, inertial axes.
    orientation : (4,) float, or mapping
        Quaternion from the axes of the pattern or frame to inertial axes at the start, scalar part first, or as of a
        rigid body. From axis 3 of the pattern its facets are counterclockwise, and valleys rise towards it.
    held : list of int
        Numbers of facets that stand still; they are rigid.
    mass_damping : float, 1/s
        Of flexible facets, as of a shell.
    stiffness_damping : float, s
        Of flexible facets, as of a shell.

    Notes
    -----
    A fold angle is 0 of flat facets, positive of valleys, negative of mountains, and half a turn where facets lie on
    one another. Facets may pass one another but where a `Contact` of two flexible ones says that they touch, and
    `faceOrders` is not read. Hinges of rigid facets round a vertex depend on one another: their multipliers are of
    least norm. Round an inner vertex with flexible facets the last of the seams holds directions alone. Creases of
    flexible facets latch by the mean angle along the edge, all nodes at once.
    """

    applies: ClassVar[Applies] = {
        "fold_angle": (left_out("frame"),),
        **{key: (one_of("facets", "flexible"),) for key in _OF_SHELLS},
        "thickness": (left_out("section"),),
        "material": (left_out("section"),),
        "latch_stiffness": (given("latch"),),
        "latch_damping": (given("latch"),),
    }
    always_allowed: ClassVar[tuple[str, ...]] = _OF_SHELLS  # so that one key makes facets flexible
    kind: Literal["origami"] = "origami"
    group = Group.BODIES
    writes_others = True
    file: Annotated[str, FileKey(reads=lambda name: [path_of(name)])]
    length_unit: units.Length | None = None
    fold_angle: units.Angle = 0.0
    frame: str | None = None
    facets: Literal["rigid", "flexible"] = "rigid"
    rigid: FacetNumbers = ()
    elements: Annotated[int, units.Whole(least=1, most=100)] = 2
    thickness: units.Length | None = None
    material: MaterialOrName | None = None
    section: WallSection | None = None
    stiffness: units.FoldStiffnessOrZero = 0.0
    damping: units.FoldDampingOrZero = 0.0
    rest: units.Angle = 0.0
    latch: units.Angle | None = None
    latch_stiffness: units.FoldStiffnessOrZero = 0.0
    latch_damping: units.FoldDampingOrZero = 0.0
    base: FacetNumber = 0
    position: units.Position = (0.0, 0.0, 0.0)
    orientation: units.Quaternion = (1.0, 0.0, 0.0, 0.0)
    held: FacetNumbers = ()
    mass_damping: units.RateOrZero = 0.0
    stiffness_damping: units.DurationOrZero = 0.0

    _kept: Pattern | None = PrivateAttr(default=None)

    @property
    def pattern(self) -> Pattern:
        """The flat crease pattern, in the unit of the file; of a part of an assembled system as it was read then."""
        return self._kept or read(self.file, self._digest)

    @property
    def _digest(self) -> str:
        return digest(path_of(self.file))

    def scale(self, name: str = "sheet") -> float:
        """Unit of length of the file, m."""
        own = self.pattern.unit
        if own is not None and self.length_unit is not None and abs(own - self.length_unit) > 1e-12 * own:
            raise InputError(
                f"{name}.length_unit is {self.length_unit!r} m, but frame_unit of {self.file!r} is {own!r} m"
            )
        return own or self.length_unit or 1.0

    def folded(self, name: str, key: str = "fold_angle") -> Folded:
        """The state with the fold angle of a key, or of the frame at the start, in the unit of the file."""
        angle = getattr(self, key)
        if not 0.0 <= angle <= _LARGEST:
            raise InputError(
                f"{name}.{key} is {math.degrees(angle):.6g} deg; it must be from 0 deg (flat) to below 180 deg, of "
                f"mountains too"
            )
        largest = self.frame if key == "fold_angle" and self.frame is not None else float(angle)
        return state(self.file, self._digest, self.base, largest, _OFF)

    def wall(self, name: str = "sheet") -> WallProperties:
        """Stiffness and inertia of the wall."""
        own = {key: getattr(self, key) for key in ("thickness", "material", "section") if key in self.model_fields_set}
        return Shell(size=(1.0, 1.0), elements=(1, 1), **own).wall(name)

    def refined(self, name: str, parts: Mapping[str, Part]) -> Part:
        """The sheet with twice as many elements along each side of its facets; of rigid ones itself."""
        return self if self.facets == "rigid" else self.with_keys(elements=2 * self.elements)

    def _check(self, name: str) -> None:
        """Refuse keys that do not belong together, and facets that there are not."""
        refuse_unfit(name, self)
        count = len(self.pattern.facets)
        for key, own in (("base", (self.base,)), ("held", self.held), ("rigid", self.rigid)):
            for facet in own:
                if facet >= count:
                    raise InputError(
                        f"{name}.{key} has the facet {facet}; {self.file!r} has facets from 0 to {count - 1}"
                    )
        if self.latch is not None and self.latch_stiffness == 0.0:
            raise InputError(f"{name}.latch_stiffness is 0.0; a latch needs one above 0 N/rad")

    def _is_rigid(self, facet: int) -> bool:
        """Whether a facet is a rigid body."""
        alone = facet in self.rigid or facet in self.held or len(self.pattern.facets[facet]) != len(EDGES)
        return self.facets == "rigid" or alone

    def write(self, builder: Builder, name: str) -> None:
        """Write the facets, as rigid bodies or shells, and the creases, as joints with springs or seams."""
        self._check(name)
        kept = self.model_copy()
        object.__setattr__(kept, "__pydantic_private__", {"_kept": self.pattern})
        builder.specs[name] = kept
        found, scale, R = self.folded(name), self.scale(name), np.empty((3, 3))
        rotation_from_quaternion(*unit(self.orientation), R)
        start = Folded(found.angles, R @ found.R, scale * (found.t @ R.T) + np.array(self.position))
        if self.facets == "rigid" and not np.any(np.abs(found.angles) > 0.0) and self._is_vertex_inside():
            raise InputError(
                f"{name} starts flat with rigid facets: there they may move in several ways; give {name}.fold_angle, "
                f"such as 5 deg, or flexible facets"
            )
        x, wall = scale * self.pattern.x, self.wall(name)
        for k, facet in enumerate(self.pattern.facets):
            part = self._body(start, x, facet, k, wall) if self._is_rigid(k) else self._shell(start, x, facet, k)
            self._write(builder, name, f"{name} facet {k}", part)
        rests = self.folded(name, "rest").angles
        latches, met = None if self.latch is None else self.folded(name, "latch").angles, self._met()
        for k, crease in enumerate(self.pattern.creases):
            if crease.left in self.held and crease.right in self.held:
                continue
            angles = {"start": float(start.angles[k]), "rest": float(rests[k])}
            if latches is not None:
                angles["latch"] = float(latches[k])
            if self._is_rigid(crease.left) and self._is_rigid(crease.right):
                self._write_joint(builder, name, start, crease, angles)
            else:
                self._write_seam(builder, name, crease, angles, met[k])
        builder.part = name
        builder.names[name] = ("origami", 0)

    def _met(self) -> list[set[int]]:
        """Vertices of each seam at which the joints written before it already hold both of its facets together."""
        creases, held = self.pattern.creases, dict[tuple[int, int], int]()

        def holder(vertex: int, facet: int) -> int:
            while (vertex, facet) in held:
                facet = held[vertex, facet]
            return facet

        found: list[set[int]] = [set() for _ in creases]
        rigid = [self._is_rigid(one.left) and self._is_rigid(one.right) for one in creases]
        for k in sorted(range(len(creases)), key=lambda k: not rigid[k]):
            for vertex in (creases[k].begin, creases[k].end):
                a, b = (holder(vertex, facet) for facet in (creases[k].left, creases[k].right))
                if a != b:
                    held[vertex, a] = b
                else:
                    found[k].add(vertex)
        return found

    def _is_vertex_inside(self) -> bool:
        """Whether creases form a loop."""
        return len(self.pattern.creases) >= len(self.pattern.facets)

    @staticmethod
    def _write(builder: Builder, name: str, called: str, part: Part) -> None:
        """Write a part of the sheet."""
        if called in builder.specs:
            raise InputError(f"{called!r} is a part, and what {name!r} calls one of its own; rename one of them")
        builder.write(called, part)

    def _body(self, start: Folded, x: Array, facet: tuple[int, ...], k: int, wall: WallProperties) -> Facet:
        """A rigid facet, with the axes of the pattern."""
        corners = x[list(facet)]
        mass, centre, inertia = inertia_of(corners, wall)
        own = np.pad(corners - centre, ((0, 0), (0, 1)))
        motion: Any = {"motion": "driven"} if k in self.held else {"mass": mass, "inertia": inertia.tolist()}
        return Facet(
            position=start.at(k, centre).tolist(), orientation=quaternion(start.R[k]).tolist(), corners=own.tolist(),
            thickness=wall.thickness, **motion,
        )  # fmt: skip

    def _shell(self, start: Folded, x: Array, facet: tuple[int, ...], k: int) -> Shell:
        """A flexible facet: side 1 from its first vertex to the second."""
        a, b, c, d = x[list(facet)]
        u, v = np.meshgrid(*[np.linspace(0.0, 1.0, self.elements + 1)[:, None]] * 2, indexing="ij")
        u, v = u[..., None], v[..., None]
        flat = (1.0 - v) * ((1.0 - u) * a + u * b) + v * ((1.0 - u) * d + u * c)
        keys = ("thickness", "material", "section", "mass_damping", "stiffness_damping")
        own: Any = {key: getattr(self, key) for key in keys if key in self.model_fields_set}
        normals = np.broadcast_to(start.R[k, :, 2], (*flat.shape[:2], 3))
        return Shell(
            nodes=start.at(k, flat).tolist(), normals=normals.tolist(), direction=start.R[k, :, 0].tolist(),
            elements=(self.elements, self.elements), **own,
        )  # fmt: skip

    def _write_joint(
        self, builder: Builder, name: str, start: Folded, crease: Crease, angles: dict[str, float]
    ) -> None:
        """A hinge of rigid facets, whose angle is the fold angle."""
        called, ends = f"{name} crease {crease.edge}", self.scale(name) * self.pattern.x[[crease.begin, crease.end]]
        axis = start.at(crease.right, ends[1]) - start.at(crease.right, ends[0])
        place, length = start.at(crease.right, ends.mean(axis=0)), float(np.linalg.norm(axis))
        keys: Any = {"type": "revolute", "axis": axis.tolist()} if crease.folds else {"type": "clamp"}
        a, b = f"{name} facet {crease.right}", f"{name} facet {crease.left}"
        self._write(builder, name, called, Hinge(a=a, b=b, position=place.tolist(), **keys))
        if crease.folds and self._acts:
            own = {key: length * getattr(self, key) for key in ("stiffness", "damping")}
            if self.latch is not None:
                own |= {key: length * getattr(self, key) for key in ("latch_stiffness", "latch_damping")}
            self._write(builder, name, f"{called} spring", HingeSpring(joint=called, **angles, **own))

    @property
    def _acts(self) -> bool:
        """Whether creases have springs."""
        return bool(self.stiffness or self.damping or self.latch is not None)

    def _write_seam(self, builder: Builder, name: str, crease: Crease, angles: dict[str, float], met: set[int]) -> None:
        """A seam of which one side or both are flexible; the angle of its springs is the fold angle, or against it."""
        sides = [(crease.right, crease.left, crease.end), (crease.left, crease.right, crease.begin)]
        own, other, begin = next(side for side in sides if not self._is_rigid(side[0]))
        word, along = edge_of(self.pattern.facets[own], begin)
        b = f"{name} facet {other}"
        if not self._is_rigid(other):
            b += f".{edge_of(self.pattern.facets[other], crease.begin)[0]}"
        # about the edge of its facet as it goes on counterclockwise the angle is against the fold angle
        keys: dict[str, Any] = {} if crease.folds else {"type": "clamp"}
        if crease.folds and self._acts:
            keys = {key: -along * angle for key, angle in angles.items()}
            keys |= {"stiffness": self.stiffness, "damping": self.damping}
            if self.latch is not None:
                keys |= {"latch_stiffness": self.latch_stiffness, "latch_damping": self.latch_damping}
                keys["latches"] = "edge"
        ends = {self.elements * ((vertex == begin) != (along > 0.0)) for vertex in met}
        seam = Fold(a=f"{name} facet {own}.{word}", b=b, met=tuple(ends), **keys)
        self._write(builder, name, f"{name} crease {crease.edge}", seam)
