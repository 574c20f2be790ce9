"""Springs, rigid bodies and points on nodes of beams by name, and clamps of all coordinates of a node."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

from book import Book
from evolvent import InputError, System, parts
from evolvent.elements import Material, Rectangle, beam_form, beam_mass
from evolvent.elements.forms import products, straight_beam
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from static.composing import EI, STEEL, STRIP, nodes, solved

Array = np.ndarray
MASS = STEEL.density * 2e-5  # of the strip, 1 m long


def cantilevers(count: int, **places: float) -> System:
    """Cantilevers of 1 m along x, each at its height z."""
    system = System()
    for name, z in places.items():
        system.add(
            parts.Beam(
                length=1.0, section=STRIP, material=STEEL, elements=count, formulation="cable", position=(0.0, 0.0, z)
            ),
            name,
        )
        system.add(parts.Joint(a=(0.0, 0.0, z), b=f"{name}.root", type="clamp"), f"root of {name}")
    return system


def tip_condition(beta: float, stiffness: float, mass: float, inertia: float, offset: float) -> float:
    """Zero at beta L of a cantilever (EI, L, rho A are 1) with a spring and a rigid body at its tip.

    w = C (cosh - cos) + D (sinh - sin); at the tip the shear -w''' and the moment w'' move the body, its mass centre
    `offset` beyond the tip: forces k w - m w^2 (w + d w'), and moments -m w^2 d (w + d w') - J w^2 w'.
    """
    ch, c, sh, s = math.cosh(beta), math.cos(beta), math.sinh(beta), math.sin(beta)
    square = beta**4
    rows = []
    for w, w1, w2, w3 in (
        (ch - c, beta * (sh + s), beta**2 * (ch + c), beta**3 * (sh - s)),
        (sh - s, beta * (ch - c), beta**2 * (sh + s), beta**3 * (ch + c)),
    ):
        force = stiffness * w - mass * square * (w + offset * w1)
        moment = -mass * square * offset * (w + offset * w1) - inertia * square * w1
        rows.append((w2 + moment, w3 - force))
    return float(np.linalg.det(np.array(rows)))


def least(stiffness: float = 0.0, mass: float = 0.0, inertia: float = 0.0, offset: float = 0.0) -> float:
    """Square of the lowest frequency of `tip_condition`."""
    at = np.linspace(0.05, 6.0, 600)
    values = [tip_condition(b, stiffness, mass, inertia, offset) for b in at]
    first = next(i for i in range(599) if values[i] * values[i + 1] < 0.0)
    return brentq(tip_condition, at[first], at[first + 1], (stiffness, mass, inertia, offset), xtol=1e-14) ** 4


@pytest.mark.slow
def test_two_cantilevers_on_one_spring(book: Book) -> None:
    """Tip to tip: both in step do not feel the spring, against one another each feels twice its stiffness."""
    k, d = 40.0, 0.3
    system = System()
    for name, y in (("low", 0.0), ("high", d)):
        system.add(
            parts.Beam(
                length=1.0, section=STRIP, material=STEEL, elements=12, formulation="cable", position=(0.0, y, 0.0)
            ),
            name,
        )
        system.add(parts.Joint(a=(0.0, y, 0.0), b=f"{name}.root", type="clamp"), f"root of {name}")
    system.add(parts.Spring(a="low.tip", b="high[12]", stiffness=k), "spring")
    found = modes(system.assemble(), count=12)
    across = [
        w for w, x in zip(found.square, found["low"].shape[:, -1, 0], strict=True) if abs(x[1]) > 0.5 * np.abs(x).max()
    ]
    unit = EI / MASS
    wanted = np.array([least(), least(2.0 * k / EI)]) * unit
    book(
        "Modes", "Two cantilevers, a spring from tip to tip (cable, 12 elements)",
        reference=f"{math.sqrt(wanted[0]):.5g}, {math.sqrt(wanted[1]):.5g} rad/s", source="closed form",
        error=np.abs(np.sqrt(np.array(across[:2]) / wanted) - 1.0).max(), allowed=1e-4,
    )  # fmt: skip


def test_springs_on_nodes_keep_momenta_and_energy(book: Book) -> None:
    """Two free beams that fly apart, a spring from a node to a node."""
    run = {}
    for method in ("energy-momentum", "generalized-alpha", "dopri5"):
        system = System()
        for name, y, v in (("low", 0.0, -0.2), ("high", 0.3, 0.3)):
            system.add(
                parts.Beam(
                    length=1.0, section=Rectangle(thickness=0.02, width=0.02), formulation="cable", elements=2,
                    material=Material(young_modulus=1e6, density=1000.0), position=(0.0, y, 0.0),
                    velocity=(0.0, v, 0.1 * v),
                ),
                name,
            )  # fmt: skip
        system.add(parts.Spring(a="low.tip", b="high[1]", stiffness=3.0), "spring")
        options = {"step": 2e-3} if method == "energy-momentum" else {"tolerance": 1e-7}
        run[method] = system.simulate(until=1.0, every=0.1, method=method, **options)
    exact = run["dopri5"]
    for method, allowed in (("energy-momentum", 2e-4), ("generalized-alpha", 2e-4)):
        off = run[method]["low"].position.values - exact["low"].position.values
        assert np.abs(off).max() < allowed
        force = run[method]["spring"].force.values - exact["spring"].force.values
        assert np.abs(force).max() < 2e-3 * np.abs(exact["spring"].force.values).max()
    for found in run.values():
        assert np.abs(found.energy_defect.values).max() < 1e-5 * found.energy.values.max()
    found = run["energy-momentum"]
    drift = [
        np.abs(values - values[0]).max() / np.abs(values[0]).max()
        for values in (found.momentum.values, found.angular_momentum.values)
    ]
    book(
        "Dynamics", "Two free beams, a spring between their nodes: momenta over 1 s (energy-momentum, 500 steps)",
        reference="those of the start", source="invariant", error=max(drift), allowed=1e-9,
    )  # fmt: skip


def headed(formulation: str, count: int, *, by_joint: bool = False, **fields: Any) -> System:
    """A cantilever along x with a body whose mass centre is 0.1 m beyond the tip."""
    system = System(gravity=fields.pop("gravity", (0.0, 0.0, 0.0)))
    system.add(
        parts.Beam(length=1.0, section=STRIP, material=STEEL, elements=count, formulation=formulation, **fields), "boom"
    )
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="boom.root", type="clamp"), "root")
    body = {"mass": 0.2, "inertia": 0.003, "position": (1.1, 0.0, 0.0)}
    if by_joint:
        system.add(parts.RigidBody(**body), "head")
        system.add(parts.Joint(a=("head", (-0.1, 0.0, 0.0)), b="boom.tip", type="clamp"), "neck")
    else:
        system.add(parts.RigidBody(**body, at="boom.tip"), "head")
    return system


@pytest.mark.parametrize(("formulation", "count", "allowed"), [("cable", 8, 1e-5), ("assumed_strain", 32, 2e-3)])
def test_frequency_with_a_body_at_the_tip(formulation: str, count: int, allowed: float, book: Book) -> None:
    found = modes(headed(formulation, count).assemble(), count=2)
    lowest = found.frequency[found.frequency > 0.1][0]  # a cable's tip turns freely about its axis
    wanted = math.sqrt(least(0.0, 0.2 / MASS, 0.003 / MASS, 0.1) * EI / MASS)
    book(
        "Modes", f"Cantilever with a rigid body on its tip, offset and inertia ({formulation}, {count} elements)",
        reference=f"{wanted:.6g} rad/s", source="closed form", error=abs(lowest / wanted - 1.0),
        allowed=allowed,
    )  # fmt: skip


def test_a_body_at_a_node_weighs_on_it(book: Book) -> None:
    """Deflection (W/3 + W d/2 + own/8)/EI, and the clamp holds the weight and its moment."""
    g = 1e-4
    system = headed("cable", 8, gravity=(0.0, -g, 0.0))
    a = system.assemble()
    found = nodes(a, solved(solve_static(a)), "boom")[-1, 0, 1]
    wanted = -g * (0.2 / 3.0 + 0.2 * 0.1 / 2.0 + MASS / 8.0) / EI
    book(
        "Statics of beams", "Cantilever with the weight of a rigid body 0.1 m beyond its tip (cable, 8 elements)",
        reference="W (L^3/3 + d L^2/2)/EI + q L^4/(8 EI)", source="closed form", error=abs(found / wanted - 1.0),
        allowed=1e-5,
    )  # fmt: skip
    held = system.equilibrium()["head"]
    assert held.force.values.ravel() == pytest.approx([0.0, 0.2 * g, 0.0], abs=1e-9)
    assert held.moment.values.ravel() == pytest.approx([0.0, 0.0, 0.2 * g * 0.1], abs=1e-9)


@pytest.mark.parametrize("formulation", ["cable", "assumed_strain"])
def test_a_body_at_a_node_starts_and_moves_as_one_on_a_joint(formulation: str) -> None:
    """Also where the beam turns as a whole: velocities of the body are those of the section."""
    spin = (0.0, 0.4, 0.9)
    system = headed(formulation, 3, angular_velocity=spin)
    a = system.assemble()
    row = a.model.bodies[a.index("head")]
    x = a.y[row["iq"] :][:3]
    assert a.y[row["iv"] :][:6] == pytest.approx([*np.cross(spin, x), *spin], abs=1e-14)
    one, other = (
        headed(formulation, 3, by_joint=by_joint).simulate(until=0.1, every=0.05, method="energy-momentum", step=5e-3)
        for by_joint in (False, True)
    )
    assert one["head"].position.values == pytest.approx(other["head"].position.values, abs=1e-12)
    assert one["head"].force.values == pytest.approx(-other["neck"].force.values, abs=1e-9)


def bending_modes(formulation: str, count: int, section: Rectangle, material: Material) -> Array:
    """Squares of frequencies of a straight beam whose first node has no coordinates left."""
    h = 1.0 / count
    form, M = beam_form(formulation, h, section, material), np.kron(beam_mass(h, section, material), np.eye(3))
    e = straight_beam(h).astype(complex)
    J = np.array([products(e + 1e-30j * d).imag / 1e-30 for d in np.eye(24)]).T
    K = J.T @ form.H @ J  # without stress
    whole = np.zeros((2, 12 * (count + 1), 12 * (count + 1)))
    for i in range(count):
        here = slice(12 * i, 12 * i + 24)
        whole[0, here, here] += K
        whole[1, here, here] += M
    return np.asarray(eigh(whole[0, 12:, 12:], whole[1, 12:, 12:], eigvals_only=True))


@pytest.mark.parametrize("formulation", ["assumed_strain", "full"])
def test_a_clamp_of_all_coordinates(formulation: str, book: Book) -> None:
    """The modes are those of the matrices without the node's twelve coordinates; a clamp of the section is softer."""
    section, material = (
        Rectangle(thickness=0.1, width=0.15),
        Material(young_modulus=1e7, poisson_ratio=0.3, density=1e3),
    )
    wanted = np.sqrt(bending_modes(formulation, 3, section, material)[:8])
    lowest = {}
    for hold in ("all", "section"):
        system = System()
        system.add(
            parts.Beam(length=1.0, section=section, material=material, elements=3, formulation=formulation), "boom"
        )
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="boom.root", type="clamp", hold=hold), "root")
        lowest[hold] = modes(system.assemble(), count=8).frequency
    assert np.all(lowest["section"] < wanted * (1.0 + 1e-9))
    assert np.any(lowest["section"] < wanted * (1.0 - 1e-4))
    book(
        "Modes", f"Clamp of all coordinates of a node: 8 frequencies ({formulation}, 3 elements)",
        reference="matrices without these coordinates", source="SciPy eigh",
        error=np.abs(lowest["all"] / wanted - 1.0).max(), allowed=1e-7,
    )  # fmt: skip


def test_refusals() -> None:
    system = cantilevers(2, boom=0.0)
    system.add(parts.Joint(a=(1.0, 0.0, 0.0), b="boom.tip", type="spherical", hold="all"), "held")
    with pytest.raises(InputError, match=r"^held\.hold is given, but held\.type is 'spherical', not 'clamp'$"):
        system.assemble()


def test_a_law_on_a_node_vibrates_as_the_spring_that_it_is() -> None:
    found = []
    for given in ({"stiffness": 40.0}, {"law": "k*x", "constants": {"k": 40.0}}):
        system = cantilevers(6, boom=0.0)
        system.add(parts.Spring(a=(1.0, 0.2, 0.0), b="boom.tip", length=0.2, **given), "spring")
        found.append(modes(system.assemble(), count=4).frequency)
    assert found[1] == pytest.approx(found[0], rel=1e-6)
    assert found[0].max() > 1.01 * modes(cantilevers(6, boom=0.0).assemble(), count=4).frequency.max()


def test_a_spring_sideways_to_its_mount_holds_a_node() -> None:
    """Lateral stiffness k against a force F at the tip: F = (3 EI/L^3 + k) w."""
    system = cantilevers(8, boom=0.0)
    system.add(
        parts.Spring(a=(1.5, 0.0, 0.0), b="boom[8]", stiffness=1.0, lateral_stiffness=20.0, axis=(1, 0, 0)), "stay"
    )
    system.add(parts.Load(at="boom.tip", force=(0.0, 0.0, 1e-4)), "push")
    tip = system.equilibrium()["boom"].tip_position.values.ravel()[2]
    assert tip == pytest.approx(1e-4 / (3.0 * EI + 20.0), rel=1e-4)


def test_moment_of_a_clamp_of_all_coordinates() -> None:
    """It holds the force and its moment, as any clamp."""
    system = System()
    system.add(parts.Beam(length=1.0, section=STRIP, material=STEEL, elements=4), "boom")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="boom.root", type="clamp", hold="all"), "root")
    system.add(parts.Load(at="boom.tip", force=(0.0, 1e-3, 2e-3)), "push")
    found = system.equilibrium()
    assert found["root"].force.values.ravel() == pytest.approx([0.0, -1e-3, -2e-3], abs=1e-9)
    wanted = -np.cross(found["boom"].tip_position.values.ravel(), [0.0, 1e-3, 2e-3])
    assert found["root"].moment.values.ravel() == pytest.approx(wanted, abs=1e-9)
