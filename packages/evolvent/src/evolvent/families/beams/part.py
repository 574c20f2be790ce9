"""Flexible beam of ANCF elements: thin cable, or beam of 24 coordinates in four formulations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np

from evolvent import elements
from evolvent.assembly.builder import Builder
from evolvent.compiled import lookups
from evolvent.elements.inertia import SectionInertia
from evolvent.elements.sections import AnySection, MaterialOrName
from evolvent.elements.shapes import CrossSection
from evolvent.families.beams import element_calls
from evolvent.families.beams.beam_strains import POINTS
from evolvent.families.beams.family_bends import add_bends
from evolvent.families.beams.family_relaxation import add_relaxation
from evolvent.families.beams.nodes import across
from evolvent.families.relaxation.family import add_terms
from evolvent.kernels import ancf_beams as kernels
from evolvent.parts.applies import Applies, given, left_out
from evolvent.parts.base import Arrays, Group, Part, unit
from evolvent.parts.curve import AnyCurve, check_curve, is_curved, stress_free
from evolvent.parts.mesh import check_grading, check_inertia, element_lengths, halved, node_arc
from evolvent_base import units
from evolvent_base.dense import product
from evolvent_base.errors import InputError

CABLES = ("cable", "cable_stretch")
#: Nodal vectors: positions and slopes of all nodes.
Nodal = Annotated[
    tuple[tuple[units.Triple, ...], ...],
    Arrays(shape="of the shape (elements + 1, 4, 3), of a cable (elements + 1, 2, 3)"),
]


class Beam(Part):
    """A beam, straight or with initial curvature; points on it: "boom.root", "boom.tip", its nodes from "boom[0]" on.

    Parameters
    ----------
    length : float, m
        Length of the axis without stress.
    section : Rectangle, Tube, Circle, Angle, IBeam, Arc, General or Taper
        Cross-section; y is the beam's normal, z the third direction.
    material : Material, or the name of a known one
        Linearly elastic: {young_modulus, poisson_ratio, density}, or aluminium, beryllium-copper, cfrp, cfrp-ud,
        cfrp-woven, elgiloy, invar, kapton, kevlar, mylar, steel, titanium.
    inertia : SectionInertia, optional
        Mass and moments of inertia per length, and position of the mass centre in the section; the stiffness is not
        affected.
    elements : int
        Number n of elements. Those of the default formulation are too stiff in bending: a cantilever by 25 %/n^2 under
        a force at its tip, by 33 %/n^2 under its weight (2 of them by 6 and 8 %, 6 by 1 %). With few elements take a
        Rod, or ask for an estimate by the option ``--mesh-error`` (``mesh_error=True``) of modes and equilibrium.
    grading : float or list of float
        Ratio of the length of the last element to that of the first, with a constant ratio between neighbours; or the
        relative lengths of all elements, from the root.
    formulation : {"assumed_strain", "elastic_line", "nu_split", "full", "cable", "cable_stretch"}
        A beam with bending, shear and torsion: assumed_strain does not lock, the other three are for comparison. A
        cable bends and stretches, but has no torsion; the two cables differ where they stretch by more than a per cent:
        by Green's strain (r'.r' - 1)/2 and r'', or by the stretch ``|r'| - 1`` and the curvature. The first may be
        viscoelastic; what it keeps turns with its plane of bending.
    position : (3,) float, m
        Root of a beam that starts straight, inertial axes.
    direction : (3,) float
        Direction of its axis, for a curved beam at the root, inertial axes.
    normal : (3,) float, optional
        Of its thickness (y of the section), inertial axes, across the axis; left out, as near to y as it can be.
    curvature : (3,) float, 1/m
        Twist per length about the axis, and curvatures about y and z of the section, of the stress-free shape, constant
        along the beam. The beam also starts in this shape, unless `nodes` are given. A positive third value alone is an
        arc that bends towards y.
    shape : Parabola, optional
        Stress-free shape of another curvature, which bends towards y, in place of `curvature`:
        {parabola: {focal_length: 3 m, offset: 0.3 m}}.
    nodes : (n + 1, 2 or 4, 3) float, optional, m and 1
        Nodal vectors at the start in place of a straight beam: of a cable position r and slope r,x, of a beam r, r,x,
        r,y and r,z, by arc length without stress.
    velocity : (3,) float, m/s
        Of the root at the start, inertial axes.
    angular_velocity : (3,) float, rad/s
        At which the whole beam turns about its root at the start, inertial axes.
    rates : (n + 1, 2 or 4, 3) float, optional, m/s and 1/s
        Rates of the nodal vectors at the start, in place of `velocity` and `angular_velocity`.
    rest : {"straight", "start"}
        Shape without stress: straight (or of `curvature` or `shape`), or as it starts (a cable's curvature is never
        without stress).
    mass_damping : float, 1/s
        Factor alpha of damping forces -alpha M e'.
    stiffness_damping : float, s
        Factor beta of damping forces -beta times the rate of the elastic ones.
    damping : {"objective", "paper"}
        Rate of the stresses, which a rigid rotation leaves zero, or K_e(e) e' (Yi et al. 2017), which damps that too.
    damped : list of int, optional
        Elements with damping, from 0; all if left out.
    """

    applies: ClassVar[Applies] = {
        "rates": (given("nodes"),),
        "shape": (left_out("curvature"),),
        "curvature": (left_out("shape"),),
        "velocity": (left_out("rates"),),
        "angular_velocity": (left_out("rates"),),
        "damping": (given("stiffness_damping"),),
        "damped": (given("stiffness_damping", "mass_damping"),),
    }
    kind: Literal["beam"] = "beam"
    group = Group.BODIES
    length: units.Length
    section: AnySection
    material: MaterialOrName
    inertia: SectionInertia | None = None
    elements: Annotated[int, units.Whole(least=1, most=100_000)]
    grading: units.Gradings = 1.0
    formulation: Literal["assumed_strain", "elastic_line", "nu_split", "full", "cable", "cable_stretch"] = (
        "assumed_strain"
    )
    position: units.Position = (0.0, 0.0, 0.0)
    direction: units.Direction = (1.0, 0.0, 0.0)
    normal: units.Direction | None = None
    curvature: units.Curvature = (0.0, 0.0, 0.0)
    shape: AnyCurve | None = None
    nodes: Nodal | None = None
    velocity: units.Velocity = (0.0, 0.0, 0.0)
    angular_velocity: units.AngularVelocity = (0.0, 0.0, 0.0)
    rates: Nodal | None = None
    rest: Literal["straight", "start"] = "straight"
    mass_damping: units.RateOrZero = 0.0
    stiffness_damping: units.DurationOrZero = 0.0
    damping: Literal["objective", "paper"] = "objective"
    damped: tuple[Annotated[int, units.Whole(least=0, most=100_000)], ...] | None = None

    @property
    def vectors(self) -> int:
        """Vectors of a node: 2 of a cable, 4 of a beam."""
        return 2 if self.formulation in CABLES else 4

    @property
    def lengths(self) -> np.ndarray:
        """Lengths of the elements, (n,), m, from the root."""
        return element_lengths(self.length, self.elements, self.grading)

    @property
    def arc(self) -> np.ndarray:
        """Length of the axis from the root to each node, (n + 1,), m."""
        return node_arc(self.length, self.elements, self.grading)

    def rest_nodes(self, name: str = "beam") -> np.ndarray | None:
        """Coordinates of the shape without stress, (n + 1, vectors, 3), wherever it lies; None if it is straight."""
        if self.rest == "start":
            return self.start_nodes(name)
        return self._curved(np.zeros(3), np.eye(3)) if is_curved(self) else None

    def _check(self, name: str) -> None:
        """Refuse keys that contradict one another."""
        cable = self.vectors != 4
        check_grading(name, self.grading, self.elements)
        check_curve(name, self)
        key = "curvature" if self.shape is None else "shape"
        if cable and is_curved(self):
            raise InputError(
                f"{name}.{key} is given and {name}.formulation is {self.formulation!r}; a cable is straight at rest"
            )
        if self.inertia is None:
            return
        if cable and (given := sorted(self.inertia.model_fields_set - {"mass_per_length"})):
            raise InputError(
                f"{name}.inertia.{given[0]} is given, but {name}.formulation is {self.formulation!r}; a cable has a "
                f"mass per length alone"
            )
        if self.inertia.inertia_x is not None:
            raise InputError(
                f"{name}.inertia.inertia_x is given; the sections of a Beam are plane, with the sum of inertia_y and "
                f"inertia_z about its axis; leave it out, or use a Rod"
            )
        check_inertia(name, self.inertia, self.section, self.material)

    def refined(self, name: str, parts: Mapping[str, Part]) -> Beam:
        """The beam with every element in halves."""
        keys = halved(self, name, ("nodes", "rates"))
        if self.damped is not None:
            keys["damped"] = tuple(half for i in self.damped for half in (2 * i, 2 * i + 1))
        return self.with_keys(**keys)

    def start_nodes(self, name: str = "beam") -> np.ndarray:
        """Coordinates at the start, (n + 1, vectors, 3)."""
        self._check(name)
        if self.nodes is not None:
            return self._nodal(name, "nodes")
        e1 = unit(self.direction)
        found = np.empty((self.elements + 1, self.vectors, 3))
        found[:, 0] = np.array(self.position) + np.outer(self.arc, e1)
        found[:, 1] = e1
        if self.vectors == 4:
            e2 = across(e1) if self.normal is None else unit(self.normal)
            if abs(e1 @ e2) > 1e-9:
                raise InputError(
                    f"{name}.normal is {self.normal!r}; it must be perpendicular to {name}.direction, "
                    f"{self.direction!r}"
                )
            found[:, 2], found[:, 3] = e2, np.cross(e1, e2)
            if is_curved(self):
                found = self._curved(np.array(self.position), np.array([e1, e2, np.cross(e1, e2)]).T)
        return found

    def _curved(self, root: np.ndarray, R: np.ndarray) -> np.ndarray:
        """Nodes of the stress-free shape (n + 1, 4, 3) from the place `root` on, with the axes R (3, 3) there."""
        places, axes = stress_free(self)
        positions = root + np.array([product(R, place) for place in places])
        slopes = np.array([product(R, A).T for A in axes])
        return np.concatenate([positions[:, None], slopes], axis=1)

    def start_rates(self, name: str = "beam") -> np.ndarray:
        """Rates of the coordinates at the start, (n + 1, vectors, 3)."""
        if self.rates is not None:
            for key in ("velocity", "angular_velocity"):
                if key in self.model_fields_set:
                    raise InputError(f"{name}.rates and {name}.{key} are both given; leave one of them out")
            return self._nodal(name, "rates")
        nodes = self.start_nodes(name)
        arms = nodes.copy()
        arms[:, 0] -= nodes[0, 0]
        found: np.ndarray = np.cross(np.array(self.angular_velocity), arms)
        found[:, 0] += np.array(self.velocity)
        return found

    def _nodal(self, name: str, key: str) -> np.ndarray:
        """`nodes` or `rates` as (n + 1, vectors, 3) float."""
        found, wanted = np.array(getattr(self, key), dtype=float), (self.elements + 1, self.vectors, 3)
        if found.shape != wanted:
            raise InputError(f"{name}.{key} has the shape {found.shape}; it must be {wanted}")
        return found

    def write(self, builder: Builder, name: str) -> None:
        """Write the beam into the families `beams` and `elements`, and its constants into the pools."""
        n, k = self.elements, self.vectors
        nodes, rates, unloaded = self.start_nodes(name), self.start_rates(name), self.rest_nodes(name)
        q, v = builder.coordinates(nodes.ravel().tolist(), rates.ravel().tolist())
        alpha, beta = self.mass_damping, self.stiffness_damping
        kind = kernels.CABLE if k == 2 else kernels.BEAM
        first = len(builder.rows["elements"])
        node = len(builder.rows["beam_nodes"])
        for place in self._shape(unloaded):
            builder.add("beam_nodes", undeformed=place)
        index = builder.add(
            "beams",
            kind=kind,
            iq=q,
            iv=v,
            nodes=n + 1,
            first_element=first,
            elements=n,
            first_node=node,
            paper=int(beta > 0.0 and self.damping == element_calls.PAPER),
            relaxes=int(self.material.viscoelastic is not None),
            length=self.length,
        )
        builder.names[name] = ("beams", index)
        tapered = type(self.section) is elements.Taper
        damped = set(range(n)) if self.damped is None else set(self.damped)
        if not damped <= set(range(n)):
            odd = next(k for k in self.damped or () if k not in range(n))
            raise InputError(f"{name}.damped holds {odd!r}; it must hold numbers of elements, from 0 to {n - 1}")
        form = bending = mass = constants = -1
        kinds = element_calls.CABLES if kind == kernels.CABLE else element_calls.BEAMS
        if self.formulation == "cable_stretch":
            kinds = element_calls.STRETCH_CABLES
            if beta > 0.0 and self.damping == element_calls.PAPER:
                raise InputError(f"{name}.damping is 'paper'; a cable_stretch has the objective one only")
        lengths, ends = self.lengths, self.arc / self.length
        for i in range(n):
            if i == 0 or tapered or unloaded is not None or self.grading != 1.0:
                section = self.section.between(ends[i], ends[i + 1])
                rest = None if unloaded is None else unloaded[i : i + 2].ravel()
                form, bending, mass = self._constants(builder, float(lengths[i]), section, rest)
                constants = self._write_sections(builder, float(lengths[i]), section, rest)
            functions = kinds[self.damping if beta > 0.0 and i in damped else element_calls.OBJECTIVE]
            builder.add(
                "elements",
                beam=index,
                iq=q + 3 * k * i,
                iv=v + 3 * k * i,
                form=form,
                bending=bending,
                mass=mass,
                force=lookups.slot(functions.force),
                tangent=lookups.slot(functions.tangent),
                energy=lookups.slot(functions.energy),
                group_forces=0 if functions.group_forces is None else lookups.slot(functions.group_forces),
                group_energies=0 if functions.group_energies is None else lookups.slot(functions.group_energies),
                stretch=int(self.formulation == "cable_stretch"),
                section=constants,
                length=float(lengths[i]),
                alpha=alpha if i in damped else 0.0,
                beta=beta if i in damped else 0.0,
            )
        if self.material.viscoelastic is not None:
            self._write_relaxation(builder, name, first, nodes, unloaded)

    def _write_relaxation(
        self, builder: Builder, name: str, first: int, nodes: np.ndarray, unloaded: np.ndarray | None
    ) -> None:
        """Write the relaxation of the elements from `first` on; refuses what has none."""
        if self.formulation == "cable_stretch":
            raise InputError(
                f"{name}.material is viscoelastic and {name}.formulation is 'cable_stretch', whose relaxation is not "
                f"implemented: use 'cable', a formulation with sections, or a Rod"
            )
        if self.stiffness_damping > 0.0 and self.damping == element_calls.PAPER:
            raise InputError(f"{name}.material is viscoelastic, but {name}.damping is 'paper'; use 'objective'")
        if unloaded is None:
            straight = np.concatenate([np.zeros((1, 3)), np.eye(3)])[: self.vectors]
            unloaded = np.tile(straight, (self.elements + 1, 1, 1))
            unloaded[:, 0, 0] = self.arc
        starts, rests = (np.stack([one[i : i + 2].ravel() for i in range(self.elements)]) for one in (nodes, unloaded))
        terms = add_terms(builder, self.material.viscoelastic)
        add_relaxation(builder, terms, first, starts, rests)
        if self.vectors != 4:
            add_bends(builder, terms, first, self.lengths.tolist(), starts)

    def _shape(self, unloaded: np.ndarray | None) -> np.ndarray:
        """Nodes of the shape without stress (n + 1, 3) from the root, in its axes; straight where none is given."""
        if unloaded is None:
            return self.arc[:, None] * np.array([1.0, 0.0, 0.0])
        root = unloaded[0]
        has_section = self.vectors == 4
        e1 = unit(np.cross(root[2], root[3]) if has_section else root[1])
        e2 = np.cross((0.0, 0.0, 1.0) if abs(e1[2]) < 0.9 else (0.0, 1.0, 0.0), e1)  # as of `beam_strains`
        e2 = unit(root[2] if has_section else e2)
        return (unloaded[:, 0] - root[0]) @ np.array([e1, e2, np.cross(e1, e2)]).T

    def _constants(
        self, builder: Builder, length: float, section: CrossSection, rest: np.ndarray | None
    ) -> tuple[int, int, int]:
        """Indices in the pools of an element's form, of its bending alone, and of its mass."""
        inertia = elements.OWN_INERTIA if self.inertia is None else self.inertia
        if self.formulation in CABLES:
            stretch = self.formulation == "cable_stretch"
            split = elements.cable_stretch_parts if stretch else elements.cable_parts
            make = elements.cable_stretch_form if stretch else elements.cable_form
            bent = split(length, section, self.material, rest=rest)["bending"]
            whole = make(length, section, self.material, rest=rest)
            mass = builder.pooled(M=elements.cable_mass(length, section, self.material, inertia))
            B = elements.cable_bending(length, section, self.material)
            form, bending = (builder.pooled(H=of.H, h=of.h, U0=of.U0, B=B) for of in (whole, bent))
            return form, bending, mass
        parts = elements.beam_parts(self.formulation, length, section, self.material, rest=rest)
        whole = parts["membrane"] + parts["bending"] + parts["torsion"] + parts["section"]
        mass = builder.pooled(M=elements.beam_mass(length, section, self.material, inertia))
        form, bending = (
            builder.pooled(H=of.H, h=of.h, U0=of.U0, B=np.zeros((2, 4))) for of in (whole, parts["bending"])
        )
        return form, bending, mass

    def _write_sections(self, builder: Builder, length: float, section: CrossSection, rest: np.ndarray | None) -> int:
        """Write what `beam_strains` needs of an element into the parameters; returns the index of the first."""
        found: list[float] = []
        start = np.zeros(9)
        for xi in POINTS:
            if rest is not None:
                start = elements.line_strains(self.formulation, length, xi, rest)
            if self.vectors != 4:
                s = section.at(xi).properties(self.material.nu)
                found += [self.material.E * s.area, self.material.E * s.Iz, start[0]]
            else:
                found += [*elements.section_stiffness(xi, section, self.material).ravel(), *start]
        return builder.parameters(found)[0]
