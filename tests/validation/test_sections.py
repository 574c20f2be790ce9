"""Sections, section inertia, graded meshes and beams curved at rest, against closed forms."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import System, parts
from evolvent.elements import Angle, Arc, General, Rectangle, SectionInertia
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from static.composing import EI, STEEL, beam, nodes, sections, solved, tip_force

Array = np.ndarray
STATICS = "Statics of beams"


def bent(section: Any, force: tuple[float, float]) -> tuple[Array, float]:
    """Deflection (y, z) and twist of the tip of a clamped beam of 1 m under a force at its centroid.

    Bending by the tensor of second moments, shear at the shear centre, and twist by the force's arm about that.
    """
    s, E, G = section.properties(STEEL.nu), STEEL.E, STEEL.shear_modulus
    F = np.array(force)
    arm = np.array([s.centre_z, -s.centre_y])
    torque = float(arm @ F)
    bending = np.linalg.solve(3.0 * E * np.array([[s.Iz, s.Iyz], [s.Iyz, s.Iy]]), F)
    shear = F / (G * s.area * np.array([s.shear_y, s.shear_z]))
    return bending + shear + arm * torque / (G * s.J), torque / (G * s.J)


@pytest.mark.parametrize(
    ("name", "section", "force"),
    [
        ("angle 40 x 30 x 3 mm, force along y", Angle(height=0.04, width=0.03, thickness=0.003), (1.0, 0.0)),
        ("slit tube, force across the slit's plane", Arc(radius=0.02, angle=2 * math.pi, thickness=5e-4), (0.0, 0.1)),
        (
            "general section turned by 30 degrees",
            General(area=1e-4, Iy=1.75e-9, Iz=1.25e-9, Iyz=-math.sqrt(3.0) / 4.0 * 1e-9, J=1e-9), (0.5, 0.5),
        ),
    ],
)  # fmt: skip
def test_unsymmetric_sections(name: str, section: Any, force: tuple[float, float], book: Book) -> None:
    a = beam("assumed_strain", 32, section=section, more=tip_force(0.0, 1e-3 * force[0], 1e-3 * force[1]))
    tip = nodes(a, solved(solve_static(a)))[-1]
    wanted, twist = bent(section, force)
    turned = 0.5e3 * (tip[2, 2] - tip[3, 1])
    error = np.abs(1e3 * tip[0, 1:] - wanted).max() / np.abs(wanted).max()
    if twist:
        error = max(error, abs(turned / twist - 1.0))
    words = {"source": "closed form, Timoshenko and St Venant"}
    words["reference"] = f"{wanted[0]:.3e}, {wanted[1]:.3e} m/N, {twist:.3e} rad/N"
    book(STATICS, f"Cantilever, {name} (assumed_strain, 32 elements)", **words, error=error, allowed=1e-3)
    system = System()
    system.add(parts.Rod(length=1.0, section=section, material=STEEL, elements=4), "rod")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root", type="clamp"), "clamp")
    system.add(parts.Load(at="rod.tip", force=(0.0, 1e-3 * force[0], 1e-3 * force[1])), "load")
    found = system.equilibrium()["rod"]
    error = np.abs(1e3 * found.position.values.reshape(-1, 5, 3)[-1, -1, 1:] - wanted).max() / np.abs(wanted).max()
    book(STATICS, f"Cantilever, {name} (rod, 4 elements)", **words, error=error, allowed=1e-4)
    twisted = float(np.sum(found.twist.values.reshape(-1, 4)[-1]) * 0.25)
    assert 1e3 * twisted == pytest.approx(twist, rel=1e-3, abs=1e-9)


def test_principal_axes_of_an_angle_bend_without_deviation() -> None:
    """A force along a principal axis, through the shear centre, moves the tip along itself."""
    section = Angle(height=0.04, width=0.03, thickness=0.003)
    s = section.properties(0.3)
    larger, smaller, turn = s.principal()
    moments = np.array([[s.Iz, s.Iyz], [s.Iyz, s.Iy]])
    across = np.array([math.cos(turn), math.sin(turn)])
    assert moments @ across == pytest.approx(larger * across, rel=1e-12)
    assert (larger + smaller, larger * smaller) == pytest.approx((s.Iy + s.Iz, s.Iy * s.Iz - s.Iyz**2), rel=1e-12)
    plain = General(area=s.area, Iy=s.Iy, Iz=s.Iz, Iyz=s.Iyz, J=s.J)
    a = beam("assumed_strain", 8, section=plain, more=tip_force(0.0, *(1e-3 * across)))
    off = nodes(a, solved(solve_static(a)))[-1, 0, 1:]
    assert abs(off @ [-across[1], across[0]]) < 1e-6 * abs(off @ across)


INERTIA = SectionInertia(mass_per_length=0.7, inertia_y=3e-4, inertia_z=2e-3, inertia_yz=2e-4, offset=(0.02, -0.05))


@pytest.mark.parametrize(
    ("method", "options", "allowed"),
    [
        ("energy-momentum", {"step": 2e-3}, 1e-9),
        ("generalized-alpha", {"tolerance": 1e-6}, 1e-5),
        ("dopri5", {"tolerance": 1e-6}, 1e-5),
    ],
)
def test_momenta_of_a_free_beam_with_section_inertia(
    method: str, options: dict[str, float], allowed: float, book: Book
) -> None:
    """Of a rigid motion: int of r x v and of v over the mass, which keep their values as the beam moves on."""
    spin, L = np.array([0.7, -0.4, 1.1]), 2.0
    system = System()
    section = Rectangle(thickness=0.02, width=0.03)
    soft = STEEL.replaced(young_modulus=2e8)
    system.add(
        parts.Beam(length=L, section=section, material=soft, elements=2, inertia=INERTIA, angular_velocity=tuple(spin)),
        "boom",
    )
    run = system.simulate(until=0.02, every=2e-3, method=method, **options)
    m, (b, c) = 0.7, INERTIA.offset
    tensor = np.array([2e-3 + m * b * b, 3e-4 + m * c * c, 2e-4 + m * b * c])  # yy, zz, yz of the points
    x2, x1 = m * L**3 / 3.0, m * L * L / 2.0
    second = np.array(
        [[x2, x1 * b, x1 * c], [x1 * b, tensor[0] * L, tensor[2] * L], [x1 * c, tensor[2] * L, tensor[1] * L]]
    )
    H = (np.trace(second) * np.eye(3) - second) @ spin
    P = np.cross(spin, [x1, m * L * b, m * L * c])
    found = run["boom"]
    error = max(
        np.abs(found.angular_momentum.values - H).max() / np.linalg.norm(H),
        np.abs(found.momentum.values - P).max() / np.linalg.norm(P),
    )
    book(
        "Dynamics", f"Free beam with offset mass and rotary inertia: momenta over 20 ms ({method})",
        reference="int r x v dm, int v dm", source="closed form", error=error, allowed=allowed,
    )  # fmt: skip


def test_rotary_inertia_lowers_frequencies(book: Book) -> None:
    """Timoshenko's beam between pins, whose rotary inertia is ten times that of its section."""
    section = Rectangle(thickness=0.1, width=0.16)
    s, G = section.properties(STEEL.nu), STEEL.shear_modulus
    m, J, shear, bend = STEEL.density * s.area, 10.0 * STEEL.density * s.Iz, G * s.area * s.shear_y, STEEL.E * s.Iz

    def exact(J: float, k: float) -> float:
        K = np.array([[shear * k * k, -shear * k], [-shear * k, bend * k * k + shear]])
        return math.sqrt(np.linalg.eigvals(np.diag([1.0 / m, 1.0 / J]) @ K).min())

    wanted = np.array([exact(J, k * np.pi) for k in (1, 2)])
    assert wanted[1] < 0.95 * exact(J / 10.0, 2.0 * np.pi)
    errors = []
    for count in (16, 32):
        a = beam(
            "assumed_strain", count, ("spherical", "spherical"), section=section, inertia={"inertia_z": J},
        )  # fmt: skip
        found = modes(a, count=10)
        own = [abs(w - found.frequency).min() for w in wanted]
        nearest = np.array([found.frequency[np.argmin(abs(w - found.frequency))] for w in wanted])
        assert max(own) < 0.02 * wanted.max()
        errors.append(nearest / wanted - 1.0)
    limit = np.abs((4.0 * errors[1] - errors[0]) / 3.0).max()
    book(
        "Modes", "Pinned beam, rotary inertia apart from its stiffness: 2 frequencies (assumed_strain, limit)",
        reference=f"{wanted[0]:.6g}, {wanted[1]:.6g} rad/s", source="Timoshenko, closed form", error=limit,
        allowed=1e-4,
    )  # fmt: skip


def test_offset_mass_twists_a_beam_in_gravity(book: Book) -> None:
    """Torque per length m g c: the tip turns by m g c L^2/(2 G J)."""
    section = Rectangle(thickness=0.01, width=0.01)
    inertia = SectionInertia(mass_per_length=0.5, offset=(0.0, 0.004))
    a = beam("assumed_strain", 16, section=section, inertia=inertia, gravity=(0.0, -0.1, 0.0))
    tip = nodes(a, solved(solve_static(a)))[-1]
    wanted = 0.5 * 0.1 * 0.004 / (2.0 * STEEL.shear_modulus * section.properties(0.3).J)
    book(
        STATICS, "Mass centre beside the axis, twist under gravity (assumed_strain, 16 elements)",
        reference="m g c L^2/(2 G J)", source="closed form", error=abs(0.5 * (tip[2, 2] - tip[3, 1]) / wanted - 1.0),
        allowed=1e-3,
    )  # fmt: skip


@pytest.mark.parametrize("grading", [3.0, (3.0, 1.0, 2.0) * 8])
def test_graded_meshes(grading: Any, book: Book) -> None:
    """The elastica's tip, the moment along the beam and the weight of unequal elements."""
    count = 24
    spec = {"formulation": "cable", "count": count, "grading": grading}
    a = beam(**spec, more=tip_force(0.0, EI, 0.0))
    found = solved(solve_static(a))
    tip = nodes(a, found)[-1, 0]
    name = "last element 3 times the first" if grading == 3.0 else "lengths 3 : 1 : 2"
    book(
        STATICS, f"Elastica, P L^2/EI = 1, graded mesh, {name} (cable, {count} elements)",
        reference="tip 0.05643323, 0.30172077 L", source="closed form, elliptic integrals",
        error=max(abs(1.0 - tip[0] - 0.0564332363), abs(tip[1] - 0.3017207738)), allowed=2e-5, unit="L",
    )  # fmt: skip
    part = a.parts["beam"]
    lengths, arc = part.lengths, part.arc
    assert lengths[-1 if grading == 3.0 else 0] == pytest.approx(3.0 * lengths[0 if grading == 3.0 else 1])
    assert arc[[0, -1]].tolist() == [0.0, 1.0]
    r, moment = nodes(a, found)[:, 0], sections(a, found)["bending_moment"].mean(axis=1)
    assert moment == pytest.approx(EI * (tip[0] - 0.5 * (r[1:, 0] + r[:-1, 0])), abs=2e-3 * EI)


def quarter(load: tuple[float, float, float], count: int) -> tuple[Array, Array]:
    """Displacement of the tip of a quarter of a circle of 1 m, clamped, and what Castigliano gives."""
    section = Rectangle(thickness=0.006, width=0.01)
    a = beam(
        "assumed_strain", count, section=section, length=0.5 * math.pi, curvature=(0.0, 0.0, 1.0),
        more=tip_force(*(1e-5 * np.array(load))),
    )  # fmt: skip
    s, E, G = section.properties(0.3), STEEL.E, STEEL.shear_modulus
    start = nodes(a, a.y)[-1, 0]
    assert start == pytest.approx([1.0, 1.0, 0.0], abs=1e-12)
    t, w = np.polynomial.legendre.leggauss(40)
    flexibility = np.zeros((3, 3))
    for angle, weight in zip(0.25 * np.pi * (1.0 + t), 0.25 * np.pi * w, strict=True):
        e1 = np.array([math.cos(angle), math.sin(angle), 0.0])
        axes = np.array([e1, [-e1[1], e1[0], 0.0], [0.0, 0.0, 1.0]])
        x, y, z = start - [math.sin(angle), 1.0 - math.cos(angle), 0.0]
        arm = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        for rows, stiff in ((axes @ arm, (G * s.J, E * s.Iy, E * s.Iz)),
                            (axes, (E * s.area, G * s.area * s.shear_y, G * s.area * s.shear_z))):  # fmt: skip
            flexibility += weight * rows.T @ np.diag(1.0 / np.array(stiff)) @ rows
    return 1e5 * (nodes(a, solved(solve_static(a)))[-1, 0] - start), flexibility @ load


@pytest.mark.parametrize(("where", "load"), [("in its plane", (0.1, 0.0, 0.0)), ("across it", (0.0, 0.0, 0.1))])
def test_a_quarter_circle(where: str, load: tuple[float, float, float], book: Book) -> None:
    (coarse, wanted), (fine, _) = quarter(load, 24), quarter(load, 48)
    for name, found, allowed in (("48 elements", fine, 1e-3), ("limit", (4.0 * fine - coarse) / 3.0, 5e-5)):
        book(
            STATICS, f"Quarter circle curved at rest, load {where} (assumed_strain, {name})",
            reference="tip, by bending, torsion, shear and stretch", source="Castigliano, closed form",
            error=np.abs(found - wanted).max() / np.abs(wanted).max(), allowed=allowed,
        )  # fmt: skip


def test_a_curved_and_twisted_beam_is_a_helix_and_stress_free() -> None:
    """Positions and slopes: r' = e1, e_i' = k x e_i; nothing is strained, whatever the mesh."""
    spec = parts.Beam(
        length=1.5, section=Rectangle(thickness=0.01, width=0.02), material="titanium", elements=12,
        curvature=(0.9, -0.4, 1.3), grading=2.0, direction=(0.0, 1.0, 0.0), normal=(1.0, 0.0, 0.0),
    )  # fmt: skip
    x, arc = spec.start_nodes(), spec.arc
    for (a, s), (b, u) in itertools.pairwise(zip(x, arc, strict=True)):
        h = u - s
        w = 0.9 * a[1] - 0.4 * a[2] + 1.3 * a[3]
        step = a[1:] + h * np.cross(w, a[1:]) + h * h / 2.0 * np.cross(w, np.cross(w, a[1:]))
        assert b[1:] == pytest.approx(step, abs=1.1 * (1.7 * h) ** 3 / 6.0)
        assert np.linalg.norm(b[0] - a[0]) == pytest.approx(h, rel=1.1 * (1.7 * h) ** 2 / 24.0)
    system = System()
    system.add(spec, "beam")
    assembly = system.assemble()
    along = sections(assembly, assembly.y)
    assert all(np.abs(along[key]).max() < 1e-9 for key in ("strain", "energy_density"))
