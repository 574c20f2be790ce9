"""Geometrically exact rod."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from evolvent.assembly.assembled import Pose
from evolvent.assembly.builder import Builder
from evolvent.elements import OWN_INERTIA, rods
from evolvent.elements.inertia import SectionInertia
from evolvent.elements.sections import MaterialOrName, RodSection, SectionStiffness, TapeSection
from evolvent.elements.shapes import CrossSection, Strip
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent.families.beams.nodes import across
from evolvent.families.relaxation.family import add_branches, add_terms
from evolvent.families.rods import tape as tapes
from evolvent.kernels import rigid
from evolvent.kernels.drive import LEAST_OUT
from evolvent.parts.applies import Applies, given, left_out
from evolvent.parts.base import Arrays, Group, Part, Spread, unit
from evolvent.parts.curve import AnyCurve, check_curve, stress_free
from evolvent.parts.drive import FreeSpool, LineDrive
from evolvent.parts.mesh import check_grading, check_inertia, element_lengths, halved, node_arc
from evolvent_base import units
from evolvent_base.dense import product
from evolvent_base.errors import InputError
from evolvent_base.schema import Section

#: Largest angle between the ends of an element at the start, degrees.
LARGEST_TURN = 90.0
#: Positions and axes of all nodes.
RodNodes = Annotated[tuple[tuple[units.Triple, ...], ...], Arrays(shape="of the shape (elements + 1, 4, 3)")]


class Fold(Section):
    """A fold or coil of a rod at the start: an arc, straight before and after.

    Parameters
    ----------
    at : float, m
        Length from the root to its middle.
    angle : float, rad
        Angle by which it turns the rod about z, above 0 in opposite sense, with the edges of the section inside.
    radius : float, m, optional
        Of the arc; of a section that is a tape its own if left out.
    """

    at: units.Length
    angle: units.Angle
    radius: units.Length | None = None


class Rod(Part):
    """A geometrically exact rod (Reissner, Simo): extension, shear, bending and torsion, at any strain and rotation.

    Each node has a rotation: joints, forces, torques and springs refer to "arm.root", "arm.tip" and the nodes from
    "arm[0]" on as to points of a body.

    Parameters
    ----------
    length : float, m
        Length of the axis without stress.
    section : Rectangle, Tube, Circle, Angle, IBeam, Arc, General, Strip, Taper, SectionStiffness or TapeSection
        Cross-section; y is the rod's normal, z the third direction. A TapeSection, {tape: {radius, angle, thickness}},
        flattens where the rod is bent about z, so that folds form, move and snap.
    material : Material, or the name of a known one; none beside a section that is given by its stiffness matrix
        Linearly elastic: {young_modulus, poisson_ratio, density}, or aluminium, beryllium-copper, cfrp, cfrp-ud,
        cfrp-woven, elgiloy, invar, kapton, kevlar, mylar, steel, titanium.
    viscoelastic : mapping, optional
        Relaxation of the whole stiffness matrix by a Prony series, in place of that of the material.
    tension_twist : bool, optional
        Whether twist strains the outer fibres, so that tension resists twist: of a strip, rectangle, tube or circle; if
        left out, of a strip.
    payout : drive, optional
        Length that is out, a function of time, of which `length` is the whole: one of {constant: {rate: 0.1 m/s, angle:
        2 m}}, {ramp: ..}, {table: ..}, {expression: ..}, where `angle` is the length. Material flows out of the exit,
        where the root is, through a mesh that shares the length; the rest is a mass at the exit. At least a
        thousandth of `length` must be out.
    inertia : SectionInertia, optional
        Mass and moments of inertia per length, and position of the mass centre in the section; the stiffness is not
        affected. A section that is given by its stiffness matrix needs it.
    elements : int
        Number n of elements. In linear statics their nodes are exact, so that few are enough; for the error of
        frequencies modes have an estimate (``--mesh-error``, ``mesh_error=True``). Under a tension above 12 E I/l^2 of
        an element of length l its shape is unstable, which results warn of.
    grading : float or list of float
        Ratio of the length of the last element to that of the first, with a constant ratio between neighbours; or the
        relative lengths of all elements, from the root.
    position : (3,) float, m
        Position of the root at the start, inertial axes.
    direction : (3,) float
        Tangent of the axis at the root, inertial axes.
    normal : (3,) float, optional
        Direction of y of the section at the root, inertial axes, perpendicular to `direction`; if left out, as close to
        the inertial y axis as possible.
    curvature : (3,) float, 1/m
        Twist per length and curvatures about y and z of the stress-free shape, in the axes of the section; constant
        along the rod.
    shape : Parabola, optional
        Stress-free shape of another curvature, which bends towards y, in place of `curvature`:
        {parabola: {focal_length: 3 m, offset: 0.3 m}}.
    nodes : (n + 1, 4, 3) float, optional, m and 1
        Positions and unit axes x, y and z of the sections at the start, in place of `position`, `direction` and
        `normal`.
    folds : list of Fold, optional
        Arcs in which the rod is bent at the start, such as folds of a tape or a coil on a drum: [{at: 0.1 m, angle: 90
        deg, radius: 30 mm}].
    rest : {"straight", "start"}
        Stress-free shape where `nodes` are given: that of `curvature` or `shape`, or that of `nodes`.
    velocity : (3,) float, m/s
        Velocity of the root at the start, inertial axes.
    angular_velocity : (3,) float, rad/s
        Angular velocity of the whole rod about its root at the start, inertial axes.
    mass_damping : float, 1/s
        Factor alpha of damping forces -alpha M v.
    stiffness_damping : float, s
        Factor beta of the damping forces: beta times the stiffness times the rates of the strains.

    Notes
    -----
    The strains are those of the helix through both ends of an element; its energy is quadratic in them
    (`rod`). The masses are lumped: half of the mass and rotary inertia of an element to each of its
    nodes, with the centre of mass a sixth of the element from the node, which makes the lumped masses of equal elements
    accurate to fourth order in bending. Masses of a tapered rod are lumped by their own distribution. An element must
    not bend or twist by more than 120 degrees.
    """

    applies: ClassVar[Applies] = {
        "shape": (left_out("curvature"), left_out("payout")),
        "curvature": (left_out("shape"), left_out("payout")),
        "grading": (left_out("payout"),),
        "nodes": (left_out("payout"),),
        "mass_damping": (left_out("payout"),),
        "rest": (given("nodes"),),
        "position": (left_out("nodes"),),
        "direction": (left_out("nodes"),),
        "normal": (left_out("nodes"),),
        "folds": (left_out("nodes"), left_out("payout")),
    }
    kind: Literal["rod"] = "rod"
    group = Group.BODIES
    length: units.Length
    section: RodSection
    material: MaterialOrName | None = None
    viscoelastic: Viscoelastic | None = None
    tension_twist: bool | None = None
    payout: LineDrive | None = None
    inertia: SectionInertia | None = None
    elements: Annotated[int, units.Whole(least=1, most=100_000)]
    grading: units.Gradings = 1.0
    position: units.Position = (0.0, 0.0, 0.0)
    direction: units.Direction = (1.0, 0.0, 0.0)
    normal: units.Direction | None = None
    curvature: units.Curvatures = (0.0, 0.0, 0.0)
    shape: AnyCurve | None = None
    nodes: RodNodes | None = None
    folds: tuple[Fold, ...] = ()
    rest: Literal["straight", "start"] = "straight"
    velocity: units.Velocity = (0.0, 0.0, 0.0)
    angular_velocity: units.AngularVelocity = (0.0, 0.0, 0.0)
    mass_damping: units.RateOrZero = 0.0
    stiffness_damping: units.DurationOrZero = 0.0

    @property
    def lengths(self) -> np.ndarray:
        """Lengths of the elements, (n,), m, from the root."""
        return element_lengths(self.length, self.elements, self.grading)

    @property
    def arc(self) -> np.ndarray:
        """Length of the axis from the root to each node, (n + 1,), m."""
        return node_arc(self.length, self.elements, self.grading)

    def refined(self, name: str, parts: Mapping[str, Part]) -> Rod:
        """The rod with every element in halves."""
        return self.with_keys(**halved(self, name, ("nodes",)))

    def start_nodes(self, name: str = "rod", out: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Positions (n + 1, 3), m, and axes (n + 1, 3, 3), columns x, y and z, of the nodes at the start.

        Parameters
        ----------
        out : float, part of the length that is out
        """
        n = self.elements
        check_curve(name, self)
        if self.nodes is not None:
            for key in ("position", "direction", "normal", "folds"):
                if key in self.model_fields_set:
                    raise InputError(f"{name}.nodes and {name}.{key} are both given; leave one of them out")
            given = np.array(self.nodes, dtype=float)
            if given.shape != (n + 1, 4, 3):
                raise InputError(f"{name}.nodes has the shape {given.shape}; it must be {(n + 1, 4, 3)}")
            R = np.swapaxes(given[:, 1:], 1, 2)
            wrong = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2)) + np.abs(np.linalg.det(R) - 1.0)
            if wrong.max() > 1e-6:
                raise InputError(
                    f"{name}.nodes[{int(wrong.argmax())}] has axes that are not a right-handed set of three "
                    f"perpendicular unit vectors"
                )
            for _ in range(3):  # to the nearest rotation, as Newton and Schulz do
                R = product(R, 1.5 * np.eye(3) - 0.5 * product(np.swapaxes(R, 1, 2), R))
            return given[:, 0], R
        e1 = unit(self.direction)
        e2 = across(e1) if self.normal is None else unit(self.normal)
        if abs(e1 @ e2) > 1e-9:
            raise InputError(
                f"{name}.normal is {self.normal!r}; it must be perpendicular to {name}.direction, {self.direction!r}"
            )
        R0 = np.stack([e1, e2, np.cross(e1, e2)], axis=1)
        places, axes = self._folded(name) if self.folds else stress_free(self)
        places = places * out
        x = np.array(self.position) + np.array([product(R0, place) for place in places])
        return x, np.array([product(R0, turn) for turn in axes])

    def _folded(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Nodes with the folds, as of `stress_free`."""
        own = self.section.radius if isinstance(self.section, TapeSection) else None
        turn, reached = np.zeros(self.elements), 0.0
        for k, fold in enumerate(self.folds):
            radius = own if fold.radius is None else fold.radius
            if radius is None:
                raise InputError(
                    f"{name}.folds[{k}].radius is missing; only a section that is a tape has a radius of its own"
                )
            if fold.angle == 0.0:
                raise InputError(f"{name}.folds[{k}].angle is 0; it must not be 0: leave out a fold that does not turn")
            half = 0.5 * radius * abs(fold.angle)
            if fold.at - half < reached or fold.at + half > self.length:
                raise InputError(
                    f"{name}.folds[{k}] is from {fold.at - half:.6g} to {fold.at + half:.6g} m; it must be behind the "
                    f"fold before it and within the rod, from {reached:.6g} to {self.length:.6g} m"
                )
            reached = fold.at + half
            shares = np.diff(np.clip(self.arc, fold.at - half, reached)) / (2.0 * half)
            turn += fold.angle * shares
        places, axes = [np.zeros(3)], [np.eye(3)]
        for length, angle in zip(self.lengths, turn, strict=True):
            d, R = rods.advanced(np.array([0.0, 0.0, angle / length]), float(length))
            places.append(places[-1] + product(axes[-1], d))
            axes.append(product(axes[-1], R))
        return np.array(places), np.array(axes)

    def centres(self) -> tuple[np.ndarray, np.ndarray]:
        """Lengths (n + 1,), m, of the nodes' shares of the rod, and how far their middles are from the nodes, m.

        Notes
        -----
        An element gives half of its length to each node, with the middle a sixth of the element from it: a force per
        length that acts there has the moments q h^2/12 of the consistent loads. Of a rod that pays out the nodes have
        Gregory's weights, 3/8, 7/6 and 23/24 of an element from each end, with the middles at the nodes: mass and its
        first and second moments along the rod are exact.
        """
        before, after = np.append(0.0, self.lengths), np.append(self.lengths, 0.0)
        shares = 0.5 * (before + after)
        if self.payout is None:
            return shares, (after - before) / 6.0
        for weights in (shares, shares[::-1]) if self.elements > 1 else ():
            weights[:3] += np.array([-3.0, 4.0, -1.0]) / 24.0 * self.lengths[0]
        return shares, np.zeros_like(shares)

    def spread(self, name: str, on: str | int | None) -> Spread | None:
        """All nodes, with their lengths."""
        if on is not None:
            return None
        _, R = self.start_nodes(name)
        return Spread(np.arange(self.elements + 1), self.centres()[0], R[:, :, 0], surface=False)

    def arms(self) -> np.ndarray:
        """Nodes as seen from the centres of mass of their shares: (n + 1, 3), m, in the axes of the sections."""
        own = OWN_INERTIA if self.inertia is None else self.inertia
        return np.array([[-along, -own.offset[0], -own.offset[1]] for along in self._mass_centres()]) + 0.0

    def _mass_centres(self) -> np.ndarray:
        """How far the centres of mass of the nodes' shares are from the nodes along the rod: (n + 1,), m."""
        if self.payout is not None or self.section.between(0.0, 0.5) is self.section:
            return self.centres()[1]
        own, ends = OWN_INERTIA if self.inertia is None else self.inertia, self.arc / self.length
        mass, moment = np.zeros(self.elements + 1), np.zeros(self.elements + 1)
        for i, length in enumerate(self.lengths):
            piece = self.section.between(ends[i], ends[i + 1])
            for k, share in enumerate(rods.element_inertia(float(length), piece, self.material, own)):
                mass[i + k] += share.mass
                moment[i + k] += share.moment
        return np.asarray(moment / mass)

    def rest_strains(self, x: np.ndarray, R: np.ndarray) -> np.ndarray:
        """Strains (n, 6) of the shape without stress."""
        if self.rest == "start":
            return rods.strains(x, R, self.lengths)
        if self.shape is not None:
            return rods.strains(*stress_free(self), self.lengths)
        return np.tile([1.0, 0.0, 0.0, *self.curvature], (self.elements, 1))

    def write(self, builder: Builder, name: str) -> None:
        """Write the nodes into the family `bodies`, the rest into `rods` and `rod_elements`."""
        n, h, ends = self.elements, self.lengths, self.arc / self.length
        check_grading(name, self.grading, n)
        self._check_material(name)
        if self.inertia is not None:
            check_inertia(name, self.inertia, self.section, self.material)
        own = OWN_INERTIA if self.inertia is None else self.inertia
        drive, out, rate = self._write_payout(builder, name)
        part, paid = out / self.length, self.payout is not None
        h = part * h
        x, R = self.start_nodes(name, part)
        rest = self.rest_strains(x, R)
        turns = np.degrees(h * np.linalg.norm(rods.strains(x, R, h)[:, 3:], axis=1))
        turns = np.maximum(turns, np.degrees(h * np.linalg.norm(rest[:, 3:], axis=1)))
        if turns.max() > LARGEST_TURN:
            k = int(turns.argmax())
            raise InputError(
                f"{name}.elements is {n}, but the angle between the ends of element {k} is {turns[k]:.0f} deg; "
                f"at most {LARGEST_TURN:g} deg is allowed, use {int(n * turns[k] / 45.0) + 1} elements or more"
            )
        arms = self.arms()
        pieces = [self.section.between(*places) for places in itertools.pairwise(ends)]
        same = all(piece is self.section for piece in pieces) and not np.any(np.ptp(rest, axis=0))
        same = same and self.grading == 1.0
        stiffness, shares, sections, fibres = [], [], [], []
        for length, piece, strain in zip(h, pieces[: 1 if same else n], rest, strict=False):
            stiffness.append(rods.element_stiffness(float(length), piece, self.material, strain, taut=paid))
            shares.append(rods.element_inertia(float(length), piece, self.material, own))
            sections.append(rods.section_compliance(piece, self.material))
            fibres.append(self._fibres(name, piece))
        if same:
            stiffness, shares, sections, fibres = n * stiffness, n * shares, n * sections, n * fibres
        first_body, first = self._write_nodes(builder, x, R, shares), len(builder.rows["rod_elements"])
        if paid:
            self._spread(builder, first_body, R[0][:, 0], drive, (out, rate))
        strains = rods.strains(x, R, h)
        tape, tape_node = self._write_tape(builder, name, rest, strains[:, 5])
        terms = add_terms(builder, self._relaxation(name))
        for i in range(n):
            builder.add(
                "rod_elements", tape=tape, tape_node=tape_node + i, flows=int(paid), a=first_body + i,
                b=first_body + i + 1,
                length=float(h[i]), beta=self.stiffness_damping, heated=0, arm_a=arms[i], arm_b=arms[i + 1],
                uncoupled=int(rods.is_diagonal(stiffness[i])),
                stiffness=stiffness[i], rest=rest[i], section=sections[i], fibres=fibres[i],
                branch=add_branches(builder, terms, strains[i] - rest[i]), **terms,
                flat_branch=self._flat_branch(builder, terms, tape, tape_node + i, float(strains[i][5])),
            )  # fmt: skip
        node = len(builder.rows["beam_nodes"])
        places = (x - x[0]) @ R[0] if self.rest == "start" and self.nodes is not None else stress_free(self)[0]
        for place, share in zip(places, self.centres()[0] / self.length, strict=True):
            builder.add("beam_nodes", undeformed=place, share=share)
        index = builder.add(
            "rods", first_element=first, elements=n, first_body=first_body, first_node=node, length=self.length,
            tape=tape, alpha=self.mass_damping, payout=int(paid), relaxes=int(self._relaxation(name) is not None),
            **drive,
        )  # fmt: skip
        builder.names[name] = ("rods", index)

    def _write_payout(self, builder: Builder, name: str) -> tuple[dict[str, Any], float, float]:
        """Write the drive of the length; its fields of the record, the length that is out at the start and its rate."""
        if self.payout is None:
            none = {"drive": 0, "law": 0, "first": 0, "last": 0, "density": 0.0, "gyration": np.zeros((3, 3))}
            return none, self.length, 0.0
        key, own = f"{name}.payout", OWN_INERTIA if self.inertia is None else self.inertia
        if isinstance(self.payout, FreeSpool):
            raise InputError(f"{key} is a free spool, which a rod does not support; give a drive of the length")
        if isinstance(self.section, TapeSection):
            raise InputError(f"{key} is given, but the section of {name} is a tape, which flattens; leave one out")
        if self.section.between(0.0, 0.5) is not self.section:
            raise InputError(f"{name}.section is tapered, but {key} is given; give one section, or leave it out")
        for field in ("grading", "shape", "curvature", "rest", "nodes", "folds", "mass_damping"):
            if field in self.model_fields_set:
                raise InputError(f"{key} and {name}.{field} are both given; leave one of them out")
        if any(own.offset):
            raise InputError(f"{key} is given, but {name}.inertia.offset is {own.offset!r}; it must be (0, 0)")
        drive = self.payout.write(builder, key)
        out, rate, _ = self.payout.at(builder, drive, 0.0)
        if not LEAST_OUT * self.length * (1.0 - 1e-9) <= out <= self.length * (1.0 + 1e-9):
            raise InputError(
                f"{key} has {out:.6g} m out at the start; it must be from {LEAST_OUT * self.length:g} m "
                f"({LEAST_OUT:g} of {name}.length) to {self.length:g} m"
            )
        mass, about_y, about_z, product = own.values(self.section, self.material)
        polar = own.polar(self.section, self.material)
        gyration = np.array([[polar, 0, 0], [0, about_y, -product], [0, -product, about_z]])
        fields = {key: getattr(drive, key) for key in ("law", "first", "last")}
        return {"drive": drive.kind, **fields, "density": mass, "gyration": gyration}, out, rate

    def _spread(
        self, builder: Builder, first: int, along: np.ndarray, row: dict[str, Any], out: tuple[float, float]
    ) -> None:
        """Masses and velocities of the nodes of a rod that pays out; out : its length that is out, and the rate."""
        spans, parts = out[0] * self.centres()[0] / self.length, self.arc / self.length
        for i, (span, part) in enumerate(zip(spans, parts, strict=True)):
            body = builder.rows["bodies"][first + i]
            body["mass"] = row["density"] * (span + (self.length - out[0] if i == 0 else 0.0))
            body["inertia"] = span * row["gyration"]
            body["spin_inertia"] = float(body["inertia"][0, 0])
            v, speed = body["iv"], part * out[1] * along
            builder.v[v : v + 3] = [a + b for a, b in zip(builder.v[v : v + 3], speed, strict=True)]
            pose = builder.poses[first + i]
            builder.poses[first + i] = pose._replace(v=pose.v + speed)

    def _write_tape(self, builder: Builder, name: str, rest: np.ndarray, bent: np.ndarray) -> tuple[int, int]:
        """Write the coordinates of a section that flattens; returns 1 + its tape and first node, or 0, 0.

        Parameters
        ----------
        bent : (n,) float, 1/m, curvatures about z at the start, at which the coordinates make the energy least
        """
        if not isinstance(self.section, TapeSection):
            return 0, 0
        assert self.material is not None
        if np.any(rest[:, 3:]):
            key = "shape" if self.shape is not None else "rest" if self.rest == "start" else "curvature"
            raise InputError(
                f"{name}.{key} makes a rod that is curved without stress, but its section is a tape; one that flattens "
                f"must be straight without stress"
            )
        if self.material.shear is not None:
            raise InputError(
                f"{name}.material.shear is given, but the section of {name} is a tape, whose wall must be isotropic; "
                f"leave it out"
            )
        own = self.section.flattening(self.material)
        first = len(builder.rows["tape_nodes"])
        fields = own._asdict()
        del fields["mass"]
        tape = builder.add("tapes", first_node=first, nodes=self.elements + 1, **fields)
        shares = self.centres()[0]
        at_nodes = 0.5 * (np.append(bent[0], bent) + np.append(bent, bent[-1]))
        for share, x in zip(shares, at_nodes, strict=True):
            u = own.slenderness * float(x) ** 2
            N = float(tapes.profile(u, own.closed)[0]) if u > 0.0 else 1.0
            start = N * (own.transverse + own.poisson * float(x)) / (N + own.stretching * u)
            q, v = builder.coordinates([start], [0.0])
            builder.add("tape_nodes", iq=q, iv=v, mass=own.mass * float(share), alpha=self.mass_damping)
        return tape + 1, first

    def _flat_branch(self, builder: Builder, terms: dict[str, int], tape: int, node: int, x: float) -> int:
        """Write the branches of the flattening of an element; returns the first one, 0 of what has none."""
        if tape == 0:
            return 0
        own, nodes = builder.rows["tapes"][tape - 1], builder.rows["tape_nodes"][node : node + 2]
        a, b = (builder.q[row["iq"]] for row in nodes)
        root = math.sqrt(float(tapes.profile(own["slenderness"] * x * x, own["closed"])[0]))
        bent = [root * (own["transverse"] + own["poisson"] * x - one) for one in (a, b)]
        return add_branches(builder, terms, np.array([x, *bent, x * a, x * b, b - a]))

    @property
    def couples_twist(self) -> bool:
        """Whether tension resists twist."""
        return isinstance(self.section, Strip) if self.tension_twist is None else self.tension_twist

    def _fibres(self, name: str, piece: CrossSection) -> np.ndarray:
        """E A times the means of rho^2 and rho^4 of an element's section, (2,), N m2 and N m4; 0 without coupling."""
        if not self.couples_twist:
            return np.zeros(2)
        middle = piece.at(0.5)
        means = middle.fibre_means()
        if means is None or self.material is None:
            raise InputError(
                f"{name}.tension_twist is true, but {name}.section is of the kind {type(middle).__name__}; it needs a "
                f"strip, rectangle, tube or circle"
            )
        return self.material.E * middle.properties(self.material.nu).area * np.array(means)

    def _relaxation(self, name: str) -> Viscoelastic | None:
        """Relaxation of the rod, its own or that of its material; refused beside what cannot relax."""
        law = self.viscoelastic
        if self.material is not None and self.material.viscoelastic is not None:
            if law is not None:
                raise InputError(
                    f"{name}.viscoelastic and {name}.material.viscoelastic are both given; leave one of them out"
                )
            law = self.material.viscoelastic
        if law is None:
            return None
        others = {
            f"{name}.payout is given": self.payout is not None,
            f"{name} couples tension and twist (`tension_twist`)": self.couples_twist,
        }
        for what, is_so in others.items():
            if is_so:
                raise InputError(f"{what}, but {name} is viscoelastic; relaxation of that is not implemented")
        return law

    def _check_material(self, name: str) -> None:
        """Refuse a missing material, and one beside a stiffness matrix."""
        if not isinstance(self.section, SectionStiffness):
            if self.material is None:
                raise InputError(f"{name}.material is missing; only a section by its stiffness matrix has none")
            return
        if self.material is not None:
            raise InputError(
                f"{name}.material is given beside a section by its stiffness matrix, which has no material; leave it "
                f"out, and give the mass by {name}.inertia"
            )
        if self.inertia is None:
            raise InputError(
                f"{name}.inertia is missing; a section by its stiffness matrix needs mass_per_length, inertia_y and "
                f"inertia_z"
            )

    def _write_nodes(self, builder: Builder, x: np.ndarray, R: np.ndarray, shares: list) -> int:
        """Write the nodes as free bodies; returns the first one's index."""
        arms, w = self.arms(), np.array(self.angular_velocity)
        first = len(builder.rows["bodies"])
        centres = np.array([x[i] - product(R[i], arms[i]) for i in range(self.elements + 1)])
        velocities = np.array(self.velocity) + np.cross(w, centres - x[0])
        turns = rods.quaternion(R)
        for i, (centre, velocity) in enumerate(zip(centres, velocities, strict=True)):
            own = [share[1] for share in shares[max(i - 1, 0) : i]] + [share[0] for share in shares[i : i + 1]]
            mass, inertia = sum(s.mass for s in own), sum((s.inertia for s in own), np.zeros((3, 3)))
            q, v = builder.coordinates([*centre, *turns[i]], [*velocity, *product(R[i].T, w)])
            builder.poses.append(Pose(centre, R[i], velocity, w))
            builder.add(
                "bodies", motion=rigid.FREE, iq=q, iv=v, mass=mass, inertia=inertia,
                axis=np.array([1.0, 0.0, 0.0]), R0=R[i], x0=centre, rate=0.0, spin_inertia=inertia[0, 0],
            )  # fmt: skip
        return first
