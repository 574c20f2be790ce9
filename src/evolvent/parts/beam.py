"""Flexible beam of ANCF elements: thin cable, or beam of 24 coordinates in four formulations."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from evolvent import elements, jit, units
from evolvent.builder import Builder
from evolvent.elements.sections import AnySection, CrossSection, MaterialOrName
from evolvent.errors import InputError
from evolvent.kernels import ancf, element_calls
from evolvent.kernels import flexible as kernels
from evolvent.parts.base import Arrays, Part, unit

CABLES = ("cable", "cable_stretch")
#: Nodal vectors: positions and slopes of all nodes.
Nodal = Annotated[
    tuple[tuple[units.Triple, ...], ...],
    Arrays(shape="of the shape (elements + 1, 4, 3), of a cable (elements + 1, 2, 3)"),
]


class Beam(Part):
    """A beam, straight without stress; places on it are "boom.root", "boom.tip" and its nodes, from "boom[0]".

    Parameters
    ----------
    length : float, m
        Length of the axis without stress.
    section : Rectangle, Tube, Rod, General or Taper
        Cross-section; y is the beam's normal, z the third direction.
    material : Material, or the name of a known one
        Isotropic and linearly elastic.
    elements : int
        Number of elements.
    formulation : {"assumed_strain", "elastic_line", "nu_split", "full", "cable", "cable_stretch"}
        A beam with bending, shear and torsion: assumed_strain does not lock, the other three are for comparison. A
        cable bends and stretches, but has no torsion; the two cables differ where they stretch by more than a per cent:
        by Green's strain (r'.r' - 1)/2 and r'', or by the stretch ``|r'| - 1`` and the curvature.
    position : (3,) float, m
        Root of a beam that starts straight, inertial axes.
    direction : (3,) float
        Of its axis, inertial axes.
    normal : (3,) float, optional
        Of its thickness (y of the section), inertial axes, across the axis; left out, as near to y as it can be.
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
        Shape without stress: straight, or as it starts (a cable's curvature is never without stress).
    mass_damping : float, 1/s
        Factor alpha of damping forces -alpha M e'.
    stiffness_damping : float, s
        Factor beta of damping forces -beta times the rate of the elastic ones.
    damping : {"objective", "paper"}
        Rate of the stresses, which a rigid rotation leaves zero, or K_e(e) e' (Yi et al. 2017), which damps that too.
    damped : list of int, optional
        Elements with damping, from 0; all if left out.
    """

    kind: Literal["beam"] = "beam"
    length: units.Length
    section: AnySection
    material: MaterialOrName
    elements: Annotated[int, units.Whole(least=1, most=100_000)]
    formulation: Literal["assumed_strain", "elastic_line", "nu_split", "full", "cable", "cable_stretch"] = (
        "assumed_strain"
    )
    position: units.Position = (0.0, 0.0, 0.0)
    direction: units.Direction = (1.0, 0.0, 0.0)
    normal: units.Direction | None = None
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

    def start(self, name: str = "beam") -> np.ndarray:
        """Coordinates at the start, (n + 1, vectors, 3)."""
        n = self.elements
        if self.nodes is not None:
            return self._nodal(name, "nodes")
        e1 = unit(self.direction)
        found = np.empty((n + 1, self.vectors, 3))
        found[:, 0] = np.array(self.position) + np.outer(np.linspace(0.0, self.length, n + 1), e1)
        found[:, 1] = e1
        if self.vectors == 4:
            e2 = _across(e1) if self.normal is None else unit(self.normal)
            if abs(e1 @ e2) > 1e-9:
                raise InputError(
                    f"{name}.normal is {self.normal!r}; it must be perpendicular to {name}.direction, "
                    f"{self.direction!r}"
                )
            found[:, 2], found[:, 3] = e2, np.cross(e1, e2)
        return found

    def start_rates(self, name: str = "beam") -> np.ndarray:
        """Rates of the coordinates at the start, (n + 1, vectors, 3)."""
        if self.rates is not None:
            for key in ("velocity", "angular_velocity"):
                if key in self.model_fields_set:
                    raise InputError(f"{name}.rates and {name}.{key} are both given; leave one of them out")
            return self._nodal(name, "rates")
        nodes = self.start(name)
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

    def along(self, nodes: ArrayLike) -> dict[str, np.ndarray]:
        """Strains, forces, moments and energy along the beam.

        Parameters
        ----------
        nodes : (..., n + 1, 2 or 4, 3) float, m and 1, coordinates of its nodes, of a run's states for example

        Returns
        -------
        dict
            `arc` (2 n,), m, from the root: two points of each element (Gauss's), at which its cubic is nearest to the
            shape that it stands for; and there (..., 2 n): `strain` of the axis; `force` along it, N; `shear_y`,
            `shear_z`, N; `torque`, N m; `bend_y`, `bend_z`, N m, moments of what bends it across y and z (of a cable
            `bend_y` is all); `energy`, J/m, stored per length. A cable has neither shear nor torque: zeros.

        Notes
        -----
        A beam's are those of `kernels.ancf.STRAINS` and `line_stiffness`, without what its formulation takes together;
        a cable's ``N = EA E |r'|`` and ``EI |r' x r''| / |r'|^2``, of `cable_stretch` ``EA (|r'| - 1)``.
        """
        x = np.asarray(nodes, dtype=float)
        if x.shape[-3:] != (self.elements + 1, self.vectors, 3):
            raise InputError(
                f"nodes has the shape {x.shape}; its last sizes must be {(self.elements + 1, self.vectors, 3)}"
            )
        flat = x.reshape(-1, *x.shape[-3:])
        at, n = 0.5 + 0.5 * np.array([-1.0, 1.0]) / math.sqrt(3.0), self.elements
        length, rest = self.length / n, self.start() if self.rest == "start" else None
        names = ("strain", "force", "shear_y", "shear_z", "torque", "bend_y", "bend_z", "energy")
        found = {name: np.zeros((len(flat), 2 * n)) for name in names}
        values = self._of_cable if self.vectors == 2 else self._of_beam
        for i in range(n):
            section = self.section.between(i / n, (i + 1) / n)
            for k, xi in enumerate(at):
                unloaded = None if rest is None else rest[None, i : i + 2]
                for name, value in values(flat[:, i : i + 2], unloaded, section, length, xi).items():
                    found[name][:, 2 * i + k] = value
        arc = (length * (np.arange(n)[:, None] + at)).ravel()
        return {"arc": arc, **{key: value.reshape(*x.shape[:-3], 2 * n) for key, value in found.items()}}

    def _of_beam(
        self, e: np.ndarray, rest: np.ndarray | None, section: CrossSection, length: float, xi: float
    ) -> dict[str, np.ndarray]:
        """What `along` gives at a point of elements of 24 coordinates (k, 2, 4, 3)."""
        off = self._beam_strains(e, length, xi)
        if rest is not None:
            off = off - self._beam_strains(rest, length, xi)
        forces = elements.line_stiffness(xi, section, self.material) * off
        keys = ("force", "shear_y", "shear_z", "torque", "bend_y", "bend_z")
        return {
            **dict(zip(keys, forces.T[:6], strict=True)),
            "strain": off[:, 0],
            "energy": 0.5 * np.sum(forces * off, axis=1),
        }

    def _of_cable(
        self, e: np.ndarray, rest: np.ndarray | None, section: CrossSection, length: float, xi: float
    ) -> dict[str, np.ndarray]:
        """What `along` gives at a point of cables (k, 2, 2, 3)."""
        s = section.at(xi).properties(self.material.nu)
        EA, EI = self.material.E * s.area, self.material.E * s.Iz
        stretch, bend = self._cable_strains(e, length, xi).T
        off = stretch if rest is None else stretch - self._cable_strains(rest, length, xi)[:, 0]
        force = EA * off
        if self.formulation == "cable":
            force = force * np.sqrt(np.maximum(1.0 + 2.0 * stretch, 0.0))
        return {"strain": off, "force": force, "bend_y": EI * bend, "energy": 0.5 * (EA * off**2 + EI * bend**2)}

    def _beam_strains(self, e: np.ndarray, length: float, xi: float) -> np.ndarray:
        """(k, 9) of elements (k, 2, 4, 3)."""
        found = np.zeros((len(e), 9))
        for row, one in zip(found, e.reshape(len(e), 24), strict=True):
            ancf.line_strains(np.ascontiguousarray(one), length, xi, row)
        return found

    def _cable_strains(self, e: np.ndarray, length: float, xi: float) -> np.ndarray:
        """Strain and curvature (k, 2) of elements (k, 2, 2, 3)."""
        slope, bend = (
            np.einsum("j,kji->ki", np.array(elements.axis_shape(length, xi, order=order)), e.reshape(len(e), 4, 3))
            for order in (1, 2)
        )
        square = np.einsum("ki,ki->k", slope, slope)
        strain = np.sqrt(square) - 1.0 if self.formulation == "cable_stretch" else 0.5 * (square - 1.0)
        return np.stack([strain, np.linalg.norm(np.cross(slope, bend), axis=1) / square], axis=1)

    def write(self, builder: Builder, name: str) -> None:
        """Write the beam into the families `beams` and `elements`, and its constants into the pools."""
        n, k = self.elements, self.vectors
        nodes = self.start(name)
        rates = self.start_rates(name)
        q, v = builder.coordinates(nodes.ravel().tolist(), rates.ravel().tolist())
        alpha, beta = self.mass_damping, self.stiffness_damping
        kind = kernels.CABLE if k == 2 else kernels.BEAM
        first = len(builder.rows["elements"])
        node = sum(row["nodes"] for row in builder.rows["beams"])
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
            length=self.length,
        )
        builder.names[name] = ("beams", index)
        tapered = type(self.section) is elements.Taper
        damped = set(range(n)) if self.damped is None else set(self.damped)
        if not damped <= set(range(n)):
            odd = next(k for k in self.damped or () if k not in range(n))
            raise InputError(f"{name}.damped holds {odd!r}; it must hold numbers of elements, from 0 to {n - 1}")
        form = mass = -1
        kinds = element_calls.CABLES if kind == kernels.CABLE else element_calls.BEAMS
        if self.formulation == "cable_stretch":
            kinds = element_calls.STRETCH_CABLES
            if beta > 0.0 and self.damping == element_calls.PAPER:
                raise InputError(f"{name}.damping is 'paper'; a cable_stretch has the objective one only")
        for i in range(n):
            if i == 0 or tapered or self.rest == "start":
                section = self.section.between(i / n, (i + 1) / n)
                rest = nodes[i : i + 2].ravel() if self.rest == "start" else None
                form, mass = self._constants(builder, self.length / n, section, rest)
            functions = kinds[self.damping if beta > 0.0 and i in damped else element_calls.ELASTIC]
            builder.add(
                "elements",
                beam=index,
                iq=q + 3 * k * i,
                iv=v + 3 * k * i,
                form=form,
                mass=mass,
                force=jit.slot(functions.force),
                tangent=jit.slot(functions.tangent),
                energy=jit.slot(functions.energy),
                length=self.length / n,
                alpha=alpha if i in damped else 0.0,
                beta=beta if i in damped else 0.0,
            )

    def _constants(
        self, builder: Builder, length: float, section: CrossSection, rest: np.ndarray | None
    ) -> tuple[int, int]:
        """Places of an element's form and mass in the pools."""
        if self.formulation in CABLES:
            parts = elements.cable_parts(length, section, self.material, rest=rest)
            whole = parts["membrane"] + parts["bending"]
            if self.formulation == "cable_stretch":
                whole = elements.cable_stretch_form(length, section, self.material, rest=rest)
            mass = builder.pooled(M12=elements.cable_mass(length, section, self.material))
            B = elements.cable_bending(length, section, self.material)
            form = builder.pooled(H12=whole.H, h12=whole.h, U12=whole.U0, bend12=parts["bending"].h, B12=B)
            return form, mass
        parts = elements.beam_parts(self.formulation, length, section, self.material, rest=rest)
        whole = parts["membrane"] + parts["bending"] + parts["torsion"] + parts["section"]
        mass = builder.pooled(M24=elements.beam_mass(length, section, self.material))
        return builder.pooled(H24=whole.H, h24=whole.h, U24=whole.U0, bend24=parts["bending"].H), mass


def _across(e1: np.ndarray) -> np.ndarray:
    """The unit vector across e1 that is nearest to y; to z, where e1 is along y."""
    near = np.array([0.0, 1.0, 0.0])
    if abs(e1[1]) > 1.0 - 1e-9:
        near = np.array([0.0, 0.0, 1.0])
    return unit(near - (near @ e1) * e1)


def node_of(builder: Builder, where: Any, key: str = "node") -> tuple[int, int, int, int]:
    """Index of a beam, its kind, and places of coordinates and velocities (as the builder counts) of one of its nodes.

    `where` is a reference such as "boom.root", "boom.tip" or "boom[5]"; `key` says what it is given for.
    """
    at = builder.place(where, key)
    if at.family != "beams":
        raise InputError(f"{key} is {where!r}; it must be a node of a beam, such as 'boom.tip' or 'boom[5]'")
    return at.row, at.beam, at.iq, at.iv
