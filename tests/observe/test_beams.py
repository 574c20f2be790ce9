"""Beams: sections against statics, shapes against geometry, energies and momenta against integrals of the raw state."""

from __future__ import annotations

import math

import numpy as np
import pytest

from evolvent import System, elements, parts
from evolvent.elements import Circle, Material, Rectangle, Taper
from observe.seeing import Array, Seen, at_rest, close, run

THICK = Rectangle(thickness=0.02, width=0.03)
SOFT = Material(young_modulus=1e8, poisson_ratio=0.3, density=1000.0)
LENGTH = 1.0


def cantilever(force: tuple[float, float, float], couple: float = 0.0, **fields: object) -> Seen:
    """A clamped beam along x under a force, and a couple about x, at its tip."""
    system = System()
    given = {"length": LENGTH, "section": THICK, "material": SOFT, "elements": 16} | fields
    system.add(parts.Beam(**given), "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="clamp"), "root")
    system.add(parts.Load(at="beam.tip", force=force), "load")
    if couple:  # half of it by forces on each of the directions across
        system.add(parts.Load(at="beam.tip", slope=2, torque=(0.0, 0.0, 0.5 * couple)), "couple y")
        system.add(parts.Load(at="beam.tip", slope=3, torque=(0.0, -0.5 * couple, 0.0)), "couple z")
    return at_rest(system)


@pytest.mark.slow
def test_a_cantilever_of_a_full_beam() -> None:
    """On the section that faces the tip stands what is applied beyond: force F, moment (L - x) e_x x F."""
    F = np.array([0.003, 0.01, 0.02])
    found = cantilever(tuple(F), 0.004)
    close(found.of("beam", "axial_force")[0], F[0], part=0.05)
    close(found.of("beam", "shear_force_y")[0].reshape(-1, 2).mean(axis=1), F[1], part=0.02)
    close(found.of("beam", "shear_force_z")[0].reshape(-1, 2).mean(axis=1), F[2], part=0.02)
    arm = LENGTH - found.tree["beam"]["arc_element"].values
    close(found.of("beam", "torsional_moment")[0], 0.004, part=0.02)
    close(found.of("beam", "bending_moment_y")[0], -F[2] * arm, part=5e-3)
    close(found.of("beam", "bending_moment_z")[0], F[1] * arm, part=5e-3)
    # the joint holds its root with the opposite of the load
    close(found.of("root", "force")[0], -F, part=1e-6)
    tip = found.nodes("beam")[0, -1, 0]
    close(found.of("root", "moment")[0], -np.cross(tip, F) - np.array([0.004, 0.0, 0.0]), part=2e-3)
    s = THICK.properties(0.3)
    sag = F[1:] * LENGTH**3 / (3.0 * SOFT.E * np.array([s.Iz, s.Iy]))
    close(found.of("beam", "tip_deflection")[0, 1:], sag, part=0.02)
    close(found.of("beam", "tip_position")[0], tip)


def test_a_tapered_cantilever() -> None:
    """The moment follows from statics whatever the section; a constant curvature meets the stiffness of the middle."""
    section = Taper(root=Rectangle(thickness=0.03, width=0.03), tip=Rectangle(thickness=0.01, width=0.03))
    found = cantilever((0.0, 0.003, 0.0), section=section, elements=24)
    arm = LENGTH - found.tree["beam"]["arc_element"].values
    close(found.of("beam", "bending_moment_z")[0], 0.003 * arm, part=5e-3)


@pytest.mark.parametrize("formulation", ["cable", "cable_stretch"])
def test_a_cantilever_cable(formulation: str) -> None:
    found = cantilever((0.003, 0.01, 0.0), formulation=formulation, elements=8)
    close(found.of("beam", "axial_force")[0], 0.003, part=0.03)
    arm = LENGTH - found.tree["beam"]["arc"].values
    close(found.of("beam", "bending_moment")[0], 0.01 * arm, part=0.03)
    close(found.of("root", "force")[0], [-0.003, -0.01, 0.0], part=1e-6)


#: Formulation, the first element that is held against the force, and what that may be off: cables converge slowly.
FAR = [("assumed_strain", 0, 3.5e-3), ("cable", 1, 0.07), ("cable_stretch", 1, 0.07)]


@pytest.mark.parametrize(("formulation", "first", "part"), FAR)
def test_the_force_in_a_strip_that_bends_far(formulation: str, first: int, part: float) -> None:
    """A load F across the tip has the parts F sin(slope) along the strip and F cos(slope) across it, everywhere.

    The moment times the curvature, which the strain of the axis alone leaves out, is up to 1.3 F.
    """
    F, strip = 0.3, Rectangle(thickness=0.002, width=0.02)
    material = Material(young_modulus=7e10, poisson_ratio=0.0, density=1600.0)
    system = System()
    beam = parts.Beam(length=2.0, section=strip, material=material, elements=48, formulation=formulation)
    system.add(beam, "strip")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="strip.root", type="clamp"), "wall")
    system.add(parts.Load(at="strip.tip", force=(0.0, F, 0.0)), "load")
    found = at_rest(system)
    slope = found.of("strip", "slope")[0]
    turned = np.arctan2(slope[:, 1], slope[:, 0])
    assert turned[-1] > 0.5
    middle = 0.5 * (turned[1:] + turned[:-1])
    pull = found.of("strip", "axial_force")[0].reshape(-1, 2).mean(axis=1)
    np.testing.assert_allclose(pull[first:], F * np.sin(middle)[first:], atol=part * F)
    if formulation == "assumed_strain":
        shear = found.of("strip", "shear_force_y")[0].reshape(-1, 2).mean(axis=1)
        np.testing.assert_allclose(np.abs(shear), F * np.cos(middle), atol=part * F)


@pytest.mark.parametrize("formulation", ["assumed_strain", "cable", "cable_stretch"])
def test_a_circular_arc(formulation: str) -> None:
    """Curvature 1/R, and the moment EI/R, about z where it turns from x to y."""
    R = 2.0
    angle = np.linspace(0.0, LENGTH / R, 9)
    nodes = np.zeros((9, 4, 3))
    nodes[:, 0, :2] = np.stack([R * np.sin(angle), R * (1.0 - np.cos(angle))], axis=1)
    nodes[:, 1, :2] = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    nodes[:, 2, :2] = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    nodes[:, 3, 2] = 1.0
    cable = formulation != "assumed_strain"
    nodes = nodes[:, : 2 if cable else 4]
    system = System()
    given = {"length": LENGTH, "section": THICK, "material": SOFT, "elements": 8, "formulation": formulation}
    system.add(parts.Beam(nodes=nodes, **given), "beam")
    found = run(system, [0.0, 1e-6], step=1e-6)
    close(found.of("beam", "curvature")[0], 1.0 / R, part=2e-3)
    bent = SOFT.E * THICK.properties(0.3).Iz * LENGTH / (2.0 * R**2)
    close(found.of("beam", "energy_bending")[0], bent, part=5e-3)
    moment = SOFT.E * THICK.properties(0.3).Iz / R
    if cable:
        close(found.of("beam", "bending_moment")[0], moment, part=2e-3)
    else:
        close(found.of("beam", "bending_moment_z")[0], moment, part=2e-3)
        close(found.of("beam", "bending_moment_y")[0] + moment, moment, part=1e-9)
    # seen from its root it is off the straight line by R (1 - cos), R sin - s
    off = np.stack([R * np.sin(angle) - R * angle, R * (1.0 - np.cos(angle)), 0.0 * angle], axis=1)
    close(found.of("beam", "deflection")[0], off, part=1e-6)
    still = parts.Beam(nodes=nodes, rest="start", **given)
    system = System()
    system.add(still, "beam")
    found = run(system, [0.0, 1e-6], step=1e-6)
    close(found.of("beam", "deflection")[0] + 1.0, 1.0, part=1e-9)
    if not cable:  # a cable is straight at rest
        assert abs(found.of("beam", "energy_bending")[0]) < 1e-9 * bent


@pytest.mark.parametrize("formulation", ["assumed_strain", "cable"])
def test_the_deflection_turns_with_a_spinning_hub(formulation: str) -> None:
    """A rod on a hub that turns steadily: stretched by rho w^2 L^3/(3 E) and not bent, wherever it points."""
    hard, w = Material(young_modulus=1e9, poisson_ratio=0.0, density=1000.0), 6.0
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=w), "hub")
    plain = parts.Beam(length=LENGTH, section=THICK, material=hard, elements=4, formulation=formulation)
    system.add(plain.replaced(rates=np.cross([0.0, 0.0, w], plain.start_nodes()), stiffness_damping=1e-3), "rod")
    system.add(parts.Joint(a="hub", b="rod.root", type="clamp"), "root")
    found = run(system, np.linspace(0.0, 4.0, 81), tolerance=1e-6, spectral_radius=0.4)
    off, late = found.of("rod", "tip_deflection"), found.t > 1.0
    stretch = 1000.0 * w**2 * LENGTH**3 / (3.0 * 1e9)
    close(off[late, 0], stretch, part=0.05)
    assert np.abs(off[late, 1:]).max() < 1e-4  # Coriolis forces of the stretch at the start leave a little
    x = found.nodes("rod")[:, :, 0]
    reach = np.linalg.norm(x[:, -1], axis=1)
    close(off[:, 0], reach * np.cos(off[:, 1] / reach) - LENGTH, part=1e-3)  # seen along the root's axis
    # a rod that turns as a whole
    mass = 1000.0 * THICK.thickness * THICK.width * LENGTH
    close(found.of("rod", "energy_kinetic")[late], mass * LENGTH**2 * w**2 / 6.0, part=1e-3)
    close(found.of("rod", "angular_momentum")[late, 2], mass * LENGTH**2 * w / 3.0, part=1e-3)
    close(np.linalg.norm(found.of("rod", "momentum")[late], axis=1), 0.5 * mass * LENGTH * w, part=1e-3)
    close(found.of("rod", "axial_force")[late, 0], 0.5 * mass / LENGTH * w**2 * LENGTH**2, part=0.06)
    # the hub holds it by the force m w^2 L/2 inwards
    inwards = -x[:, -1] / reach[:, None] * (0.5 * mass * w**2 * LENGTH)
    close(found.of("root", "force")[late], inwards[late], part=0.02)


def hermite(xi: Array, h: float) -> Array:
    """Shape functions of r_p, r_p', r_q, r_q' on the axis."""
    return np.stack(
        [1 - 3 * xi**2 + 2 * xi**3, h * (xi - 2 * xi**2 + xi**3), 3 * xi**2 - 2 * xi**3, h * (xi**3 - xi**2)]
    )


@pytest.mark.parametrize("formulation", ["assumed_strain", "cable", "cable_stretch"])
@pytest.mark.parametrize("method", ["generalized-alpha", "rk4"])
def test_energies_and_momenta_are_integrals(formulation: str, method: str, rng: np.random.Generator) -> None:
    """Of a beam that flies and wobbles: sums over points of its axis and sections, from the raw nodes."""
    section = Circle(radius=0.02)
    plain = parts.Beam(length=LENGTH, section=section, material=SOFT, elements=3, formulation=formulation)
    k = plain.vectors
    rates = np.cross([0.3, -0.4, 1.0], plain.start_nodes()) + 0.02 * rng.normal(size=(4, k, 3))
    system = System()
    system.add(plain.replaced(rates=rates, position=(0.5, 0.2, 0.0)), "beam")
    options = {"step": 1e-5} if method == "rk4" else {"step": 1e-3}
    found = run(system, np.linspace(0.0, 0.02, 5), method, **options)
    e, v = found.nodes("beam"), found.nodes("beam", rate=True)
    s = section.properties(SOFT.nu)
    h, (xi, weights) = LENGTH / 3, np.polynomial.legendre.leggauss(6)
    xi, weights = 0.5 + 0.5 * xi, 0.5 * weights
    S = hermite(xi, h)
    kinetic, P, H = 0.0, 0.0, 0.0
    for i in range(3):
        x, u = (
            np.einsum("jg,tjc->tgc", S, np.concatenate([a[:, i, :2], a[:, i + 1, :2]], axis=1)) for a in (e, v)
        )  # of the axis
        dm = SOFT.density * s.area * h * weights
        kinetic = kinetic + 0.5 * np.einsum("g,tgc,tgc->t", dm, u, u)
        P = P + np.einsum("g,tgc->tc", dm, u)
        H = H + np.einsum("g,tgc->tc", dm, np.cross(x, u))
        if k == 4:  # its sections: moments of inertia of area times the rates of r,y and r,z
            for which, second in ((2, s.Iz), (3, s.Iy)):
                p, q = 1.0 - xi[:, None], xi[:, None]
                at, of = (a[:, i, which, None] * p + a[:, i + 1, which, None] * q for a in (e, v))
                dI = SOFT.density * second * h * weights
                kinetic = kinetic + 0.5 * np.einsum("g,tgc,tgc->t", dI, of, of)
                H = H + np.einsum("g,tgc->tc", dI, np.cross(at, of))
    close(found.of("beam", "energy_kinetic"), kinetic, part=1e-9)
    close(found.of("beam", "momentum"), P, part=1e-9)
    close(found.of("beam", "angular_momentum"), H, part=1e-9)
    if k == 2:
        xi3, w3 = np.polynomial.legendre.leggauss(3)
        stored = 0.0
        for i in range(3):
            p, q = e[:, i], e[:, i + 1]
            for at, weight in zip(0.5 + 0.5 * xi3, 0.5 * w3, strict=True):
                c = np.array(elements.axis_shape(h, at, order=1)), np.array(elements.axis_shape(h, at, order=2))
                a, b = (f[0] * p[:, 0] + f[1] * p[:, 1] + f[2] * q[:, 0] + f[3] * q[:, 1] for f in c)
                aa = np.sum(a * a, axis=1)
                if formulation == "cable":
                    strain, bend = 0.5 * (aa - 1.0), np.sum(b * b, axis=1)
                else:
                    strain, bend = np.sqrt(aa) - 1.0, np.sum(np.cross(a, b) ** 2, axis=1) / aa**2
                stored = stored + 0.5 * h * weight * SOFT.E * (s.area * strain**2 + s.Iz * bend)
        close(found.of("beam", "energy_elastic"), stored, part=1e-6)


def test_shapes_and_rates_of_nodes_are_those_of_the_state() -> None:
    system = System(gravity=(0.0, -9.81, 0.0))
    system.add(parts.Beam(length=LENGTH, section=THICK, material=SOFT, elements=3), "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="revolute"), "root")
    found = run(system, np.linspace(0.0, 0.3, 7))
    nodes, rates = found.nodes("beam"), found.nodes("beam", rate=True)
    close(found.of("beam", "position"), nodes[:, :, 0])
    close(found.of("beam", "velocity"), rates[:, :, 0])
    close(found.of("beam", "slope"), nodes[:, :, 1])
    close(found.of("beam", "tip_speed"), np.linalg.norm(rates[:, -1, 0], axis=1))
    assert found.tree["beam"]["arc_node"].values.tolist() == pytest.approx([0.0, 1 / 3, 2 / 3, 1.0])
    # the deflection seen from the root: its axes, rows
    y, z = nodes[:, 0, 2], nodes[:, 0, 3]
    X = np.cross(y, z) / np.linalg.norm(np.cross(y, z), axis=1)[:, None]
    along = np.einsum("ti,tni->tn", X, nodes[:, :, 0] - nodes[:, :1, 0])
    close(found.of("beam", "deflection")[:, :, 0] + 1.0, along - np.linspace(0.0, 1.0, 4) + 1.0)
    assert math.isclose(found.t[-1], 0.3)
