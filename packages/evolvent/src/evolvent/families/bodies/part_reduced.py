"""Reduced flexible body: a finite-element model by its matrices, on a floating frame."""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import PrivateAttr

from evolvent.assembly.assembled import Pose
from evolvent.assembly.builder import Builder
from evolvent.assembly.references import is_name
from evolvent.elements.reduced_files import READ, files_read, read_model
from evolvent.elements.reduced_models import MeanAxes, ReducedModel, mean_axes
from evolvent.elements.rods import quaternion
from evolvent.families.joints.part_rows import add_row
from evolvent.families.joints.part_sides import Side
from evolvent.kernels import gaps, rigid, sides
from evolvent.kernels.rotations import rotation_from_quaternion
from evolvent.parts.base import Group, Part, Spread, unit
from evolvent_base import units
from evolvent_base.dense import product
from evolvent_base.errors import InputError
from evolvent_base.file_keys import FileKey, digest

#: Rotations of a node: the axes of frame and node whose product it changes, its axis, and the sign.
_TURNS = ((0, 1, 2, -1.0), (0, 2, 1, 1.0), (1, 2, 0, -1.0))


@dataclasses.dataclass(frozen=True, eq=False)
class _Read:
    """A file's model, and in mean axes."""

    model: ReducedModel
    axes: MeanAxes


class ReducedBody(Part):
    """A flexible body by stiffness and mass matrices of a reduced finite-element model; it may move and turn freely.

    Its interface nodes are points for joints, springs, forces and threads: "panel.root", by the names in the file, or
    by number, "panel[0]". Nodes "root 0", "root 1" and so on are an edge, "panel.root", for seams and loads along it.
    Between its nodes it deforms linearly.

    Parameters
    ----------
    file : str
        File of the model, .npz or .json, or the name of a shipped one, solar-panel: stiffness and mass (n, n),
        positions (p, 3) of the interface nodes in the model's axes, and, if given, names of the nodes, recovery (r, n)
        with recovery_names and recovery_units. The coordinates are three displacements and three rotations of each
        node, then any others (Craig-Bampton modes). Or matrices of Nastran, .op4, .op2, or DMIG entries in .pch, .bdf,
        .dat or .nas; these need the package pyyeti.
    bulk : str, optional
        Bulk data of Nastran with the grids and scalar points of the matrices, where they are not in the file itself or
        beside it, with the same name and .asm, .pch, .bdf, .dat or .nas.
    length_unit : float, m
        Unit of length of the file: 1 mm where that is in millimetres.
    mass_unit : float, kg
        Unit of mass of the file: 1 t where that is in tonnes, as with newtons and millimetres. Times are in seconds.
    expected_mass : float, kg, optional
        Mass that the model must have within 1 %: a check of its units.
    damping_ratio : float
        Damping of all modes of the free body, as a share of critical damping.
    position : (3,) float, m
        Of the origin of the model's axes at the start, inertial axes.
    orientation : (4,) float, or mapping
        Quaternion from the model's axes to inertial axes at the start, scalar part first; or as of a rigid body.
    velocity : (3,) float, m/s
        Of the origin of the model's axes at the start, inertial axes.
    angular_velocity : (3,) float, rad/s
        At the start, the model's axes.

    Notes
    -----
    Displacements from the floating frame and rotations of nodes must stay small; motions of the frame may be of any
    size. The kinetic energy is that of the undeformed body and of the deformation beside it: forces by the spin on the
    deformation (centrifugal, Coriolis) and stiffening by spin are left out, so that rates must stay well below the
    lowest frequency. See `evolvent.kernels.reduced`.
    """

    kind: Literal["reduced-body"] = "reduced-body"
    group = Group.BODIES
    file: Annotated[str, FileKey(endings=READ, reads=files_read)]
    bulk: Annotated[str, FileKey()] | None = None
    length_unit: units.Length = 1.0
    mass_unit: units.Mass = 1.0
    expected_mass: units.Mass | None = None
    damping_ratio: units.Fraction = 0.0
    position: units.Position = (0.0, 0.0, 0.0)
    orientation: units.Quaternion = (1.0, 0.0, 0.0, 0.0)
    velocity: units.Velocity = (0.0, 0.0, 0.0)
    angular_velocity: units.AngularVelocity = (0.0, 0.0, 0.0)

    _found: _Read | None = PrivateAttr(default=None)

    @property
    def model(self) -> ReducedModel:
        """The model of the file, SI units, checked; of a part of an assembled system as it was read then."""
        return self._contents().model

    @property
    def axes(self) -> MeanAxes:
        """The model in mean axes."""
        return self._contents().axes

    def _contents(self) -> _Read:
        if self._found is not None:
            return self._found
        paths = [*files_read(self.file), *([self.bulk] if self.bulk else [])]
        return _read(self.file, self.bulk, self.length_unit, self.mass_unit, tuple(map(digest, paths)))

    def spread(self, name: str, on: str | int | None) -> Spread | None:
        """Nodes "root 0", "root 1" and so on of the edge "root", with their lengths, in this order."""
        names, nodes = self.model.names, list[int]()
        while isinstance(on, str) and (one := f"{on} {len(nodes)}") in names:
            nodes.append(names.index(one))
        if len(nodes) < 2:
            return None
        R = np.empty((3, 3))
        rotation_from_quaternion(*unit(self.orientation), R)
        along = np.diff(self.model.positions[nodes], axis=0) @ R.T
        lengths = np.linalg.norm(along, axis=1)
        if not np.all(lengths > 0.0):
            k = int(lengths.argmin())
            raise InputError(f"{name} has nodes '{on} {k}' and '{on} {k + 1}' at one place; an edge needs a length")
        shares = 0.5 * (np.append(lengths, 0.0) + np.append(0.0, lengths))
        sums = np.concatenate([along[:1], along[1:] + along[:-1], along[-1:]])
        return Spread(np.array(nodes), shares, np.array([unit(one) for one in sums]), surface=False)

    def write(self, builder: Builder, name: str) -> None:
        """Write frame and nodes into the family `bodies`, modes into `modes`, and rows that hold the nodes."""
        read = self._contents()
        model, own = read.model, read.axes
        self._check(name, model)
        kept = self.model_copy()  # results are those of the model that was read now
        object.__setattr__(kept, "__pydantic_private__", {"_found": read})
        builder.specs[name] = kept
        R = np.empty((3, 3))
        rotation_from_quaternion(*unit(self.orientation), R)
        w = product(R, np.array(self.angular_velocity))
        first = self._add_body(builder, own.centre, R, w, own.mass, own.inertia)
        for s in model.positions:
            self._add_body(builder, s, R, w, own.node_mass, own.node_inertia * np.eye(3))
        count, mass = own.square.size, own.mass + len(model.positions) * own.node_mass
        iq, iv = builder.coordinates([0.0] * count, [0.0] * count)
        first_mode = len(builder.rows["modes"])
        for square in own.square:
            damping = 2.0 * self.damping_ratio * math.sqrt(square) * mass
            builder.add("modes", stiffness=mass * float(square), damping=damping)
        index = builder.add(
            "reduced_bodies", first_body=first, nodes=len(model.positions), first_mode=first_mode, modes=count, iq=iq,
            iv=iv, mass=mass,
        )  # fmt: skip
        for k, s in enumerate(model.positions):
            self._hold(builder, index, first, first + 1 + k, s - own.centre, own.shapes[6 * k : 6 * k + 6])
        builder.names[name] = ("reduced_bodies", index)
        builder.body_points[name] = dict.fromkeys(model.names)

    def _check(self, name: str, model: ReducedModel) -> None:
        """Refuse names that cannot be references, and a mass that is not the expected one."""
        for point in model.names:
            if not is_name(point):
                raise InputError(f"{self.file!r} calls a node {point!r}; a name must start with a letter and hold "
                                 f"letters, digits, '-', '_' and blanks")  # fmt: skip
        Z = model.rigid_motions[:, 0]
        mass = float(Z @ model.mass @ Z)
        if self.expected_mass is not None and abs(mass - self.expected_mass) > 0.01 * self.expected_mass:
            raise InputError(
                f"{name}.expected_mass is {self.expected_mass:.6g} kg, but {self.file!r} has {mass:.6g} kg; give the "
                f"units of the file by {name}.length_unit and {name}.mass_unit"
            )

    def _add_body(self, builder: Builder, place: Any, R: Any, w: Any, mass: float, inertia: Any) -> int:
        """Add a free body at a place of the model, with the model's axes."""
        d = product(R, place)
        x, v = np.array(self.position) + d, np.array(self.velocity) + np.cross(w, d)
        q, at = builder.coordinates([*x, *quaternion(R)], [*v, *self.angular_velocity])
        builder.poses.append(Pose(x, R, v, w))
        return builder.add(
            "bodies", motion=rigid.FREE, iq=q, iv=at, mass=mass, inertia=inertia, axis=np.array([1.0, 0.0, 0.0]),
            R0=R, x0=x, rate=0.0, spin_inertia=float(inertia[0, 0]),
        )  # fmt: skip

    def _hold(self, builder: Builder, index: int, frame: int, node: int, s: Any, shapes: Any) -> None:
        """Add the rows that hold a node: three displacements in the axes of the frame, and three rotations."""

        def side(body: int, local: Any) -> Side:
            return Side(sides.ON_BODY, body, -1, -1, local, np.zeros(3), None)

        def shape_of(shape: Any) -> dict[str, Any]:
            return {"reduced": 1 + index, "mode_shape": builder.parameters(shape)[0]}

        centre, axes = np.zeros(3), np.eye(3)
        for i in range(3):
            ends, along = (side(frame, centre), side(node, centre)), side(frame, axes[i])
            add_row(builder, gaps.ALONG, *ends, direction=along, value=float(s[i]), **shape_of(shapes[i]))
        for a, b, c, sign in _TURNS:
            ends = side(frame, axes[a]), side(node, axes[b])
            add_row(builder, gaps.DIRECTION, *ends, **shape_of(sign * shapes[3 + c]))

    def observe(self, view: Any, name: str, found: Any) -> None:
        """Add results of the recovery matrix of the file: combinations of the coordinates, over all samples."""
        model, row = self.model, view.model.reduced_bodies[view.index(name)]
        q = view.coordinates(int(row["iq"]), int(row["modes"]))
        values = q @ (model.recovery @ self.axes.shapes).T
        for k, (result, unit_of) in enumerate(zip(model.recovery_names, model.recovery_units, strict=True)):
            found.scalar(result.replace(" ", "_"), values[:, k], unit_of, f"{result}, by the recovery matrix")


@functools.lru_cache(maxsize=32)
def _read(path: str, bulk: str | None, length: float, mass: float, _: tuple[str, ...]) -> _Read:
    """A model and its mean axes, read and checked once for each content of the files."""
    model = read_model(path, length, mass, bulk)
    return _Read(model, mean_axes(model, repr(path)))
