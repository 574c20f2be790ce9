"""Rods with an inertia apart from their stiffness, unequal elements, forces per length, and bodies on their nodes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml

import evolvent
from book import Book
from evolvent import InputError, System, parts
from evolvent.assembly.families import owner
from evolvent.elements import Rectangle, SectionInertia
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from rods.building import ORIGIN, RUBBER, STRIP, cantilever

Array = np.ndarray
S = STRIP.properties(0.3)
EI = RUBBER.E * S.Iz
KEYS: dict[str, Any] = {"length": 1.0, "section": STRIP, "material": RUBBER, "elements": 4}
INERTIA = SectionInertia(mass_per_length=0.7, inertia_y=3e-4, inertia_z=2e-3, inertia_yz=2e-4, offset=(0.02, -0.05))
METHODS = [
    ("energy-momentum", {"step": 2e-3}, 1e-8),
    ("generalized-alpha", {"tolerance": 1e-6}, 1e-5),
    ("dopri5", {"tolerance": 1e-6}, 1e-5),
]


@pytest.mark.parametrize(("method", "options", "allowed"), METHODS)
def test_momenta_of_a_free_rod_with_section_inertia(
    method: str, options: dict[str, Any], allowed: float, book: Book
) -> None:
    """They keep their values; those at the start are of the lumped masses, which have all but x^2 exactly."""
    spin, L = np.array([0.7, -0.4, 1.1]), 2.0
    system = System()
    keys = KEYS | {"length": L, "elements": 3, "grading": (1.0, 2.0, 1.5)}
    system.add(parts.Rod(**keys, inertia=INERTIA, angular_velocity=tuple(spin)), "boom")
    found = system.simulate(until=0.02, every=2e-3, method=method, **options)["boom"]
    m, (b, c) = 0.7, INERTIA.offset
    yy, zz, yz = 2e-3 + m * b * b, 3e-4 + m * c * c, 2e-4 + m * b * c
    shares, along = parts.Rod(**keys).centres()
    x2 = m * float(np.sum(shares * (parts.Rod(**keys).arc + along) ** 2))
    x1 = m * L * L / 2.0
    second = np.array([[x2, x1 * b, x1 * c], [x1 * b, yy * L, yz * L], [x1 * c, yz * L, zz * L]])
    H = (np.trace(second) * np.eye(3) - second) @ spin
    P = np.cross(spin, [x1, m * L * b, m * L * c])
    error = max(
        np.abs(found.angular_momentum.values - H).max() / np.linalg.norm(H),
        np.abs(found.momentum.values - P).max() / np.linalg.norm(P),
    )
    assert x2 == pytest.approx(m * L**3 / 3.0, rel=0.1)
    book(
        "Dynamics", f"Free rod with offset mass and rotary inertia: momenta over 20 ms ({method})",
        reference="int r x v dm, int v dm", source="closed form", error=error, allowed=allowed,
    )  # fmt: skip


def test_torsion_with_a_polar_moment_of_its_own(book: Book) -> None:
    """A clamped chain of n lumps; without it the sum of both moments counts."""
    n, polar = 12, 1.5e-3
    own = {"mass_per_length": 0.7, "inertia_y": 1e-3, "inertia_z": 2e-3}
    k = np.arange(1, 4)
    exact = 2.0 * n * np.sqrt(RUBBER.shear_modulus * S.J) * np.sin((2 * k - 1) * np.pi / (4 * n))
    for inertia, about in ((SectionInertia(**own), 3e-3), (SectionInertia(**own, inertia_x=polar), polar)):
        system = System()
        system.add(parts.Rod(**KEYS | {"elements": n}, inertia=inertia), "rod")
        system.add(parts.Joint(a=ORIGIN, b="rod.root", type="clamp"), "clamp")
        found = system.modes(count=60)
        twists = found.participation[:, 3] ** 2 > 1e-6 * found.total_mass[3]
        error = np.abs(found.frequency[twists][:3] / (exact / np.sqrt(about)) - 1.0).max()
        assert error < 1e-6
        assert found.total_mass[3] == pytest.approx(about, rel=1e-9)
    book(
        "Modes", "Rod with a polar moment of its own, clamped: three torsion modes",
        reference="2 n/L sqrt(GJ/I) sin((2 k - 1) pi/(4 n))", source="closed form", error=error, allowed=1e-6,
    )  # fmt: skip


def test_the_mass_of_the_held_node_is_what_the_modes_of_a_clamped_rod_lack() -> None:
    """All modes and what the clamp holds have the whole mass, along and about every axis."""
    system = System()
    system.add(parts.Rod(**KEYS | {"elements": 20}, inertia=INERTIA), "rod")
    system.add(parts.Joint(a=ORIGIN, b="rod.root", type="clamp"), "clamp")
    found = system.modes(count=200)
    np.testing.assert_allclose(found.effective_mass.sum(axis=0) + found.held_mass, found.total_mass, rtol=1e-8)
    lump = 0.7 / 40.0
    np.testing.assert_allclose(found.held_mass[:3], lump, rtol=1e-8)
    assert found.total_mass[0] == pytest.approx(0.7)
    data = found.to_dataset()
    np.testing.assert_allclose(data.held_mass, lump, rtol=1e-8)
    np.testing.assert_allclose(data.held_inertia, found.held_mass[3:])
    assert "held by supports" in str(found)
    assert "whole structure" in str(found)


def test_offset_mass_twists_a_rod_in_gravity(book: Book) -> None:
    """Torque per length m g c: the tip turns by m g c L^2/(2 G J)."""
    m, g, c = 0.5, 0.01, 0.004
    system = System(gravity=(0.0, -g, 0.0))
    inertia = SectionInertia(mass_per_length=m, offset=(0.0, c))
    system.add(parts.Rod(**KEYS, inertia=inertia, grading=3.0), "rod")
    system.add(parts.Joint(a=ORIGIN, b="rod.root", type="clamp"), "clamp")
    q = system.equilibrium()["rod"].attitude.values[-1, -1]
    wanted = m * g * c / (2.0 * RUBBER.shear_modulus * S.J)
    book(
        "Statics of beams", "Mass centre beside the axis, twist under gravity (rod, graded, 4 elements)",
        reference="m g c L^2/(2 G J)", source="closed form", error=abs(abs(2.0 * q[1] / q[0]) / wanted - 1.0),
        allowed=1e-6,
    )  # fmt: skip


def frequencies(part: Any, count: int, **keys: Any) -> Array:
    system = System()
    system.add(part(**(KEYS | {"elements": count} | keys)), "rod")
    system.add(parts.Joint(a=ORIGIN, b="rod.root", type="clamp"), "clamp")
    return np.asarray(system.modes(count=6).frequency)


@pytest.mark.slow
def test_modes_with_an_offset_mass_are_those_of_a_beam(book: Book) -> None:
    """Bending and torsion are coupled by the offset; both models converge to the same frequencies."""
    own: dict[str, Any] = {"mass_per_length": 0.8, "inertia_y": 2e-4, "inertia_z": 1e-4}
    inertia = SectionInertia(**own, offset=(0.0, 0.04))
    rod, finer = (frequencies(parts.Rod, n, inertia=inertia) for n in (12, 24))
    limit = (16.0 * finer - rod) / 15.0
    coarse, fine = (frequencies(parts.Beam, n, inertia=inertia) for n in (12, 24))
    wanted = (4.0 * fine - coarse) / 3.0
    assert abs(frequencies(parts.Rod, 24, inertia=SectionInertia(**own)) / finer - 1.0).max() > 0.05
    book(
        "Modes", "Cantilever with an offset mass and rotary inertia: 6 frequencies (rod, limit)",
        reference="the limit of assumed_strain", source="beams of 12 and 24 elements",
        error=np.abs(limit / wanted - 1.0).max(), allowed=1e-3,
    )  # fmt: skip


def test_frequency_with_a_mass_per_length(book: Book) -> None:
    """A slender cantilever: 3.516015 sqrt(EI/(m L^4)), of equal and of unequal elements."""
    slender: dict[str, Any] = {
        "section": Rectangle(thickness=0.002, width=0.02),
        "inertia": SectionInertia(mass_per_length=3.0),
    }
    wanted = 3.5160153 * np.sqrt(RUBBER.E * slender["section"].properties(0.3).Iz / 3.0)
    for grading, allowed in ((1.0, 1e-4), (2.0, 2e-3)):
        found = frequencies(parts.Rod, 16, grading=grading, **slender)[0]
        book(
            "Modes", f"Slender cantilever with a mass per length of its own (rod, 16 elements, grading {grading:g})",
            reference="3.516015 sqrt(EI/m)/L^2", source="closed form", error=abs(found / wanted - 1.0),
            allowed=allowed,
        )  # fmt: skip


@pytest.mark.parametrize("grading", [1.0, 3.0, (1.0, 4.0, 2.0, 0.5)])
@pytest.mark.parametrize("tip", ["force", "line", "gravity"])
def test_graded_rods_are_exact_at_their_nodes(grading: Any, tip: str, book: Book) -> None:
    """Timoshenko's cantilever under a force at its tip, a force per length, and its weight."""
    f = 1e-4
    system = System(gravity=(0.0, f / (RUBBER.density * S.area), 0.0) if tip == "gravity" else ORIGIN)
    system.add(parts.Rod(**KEYS, grading=grading), "rod")
    system.add(parts.Joint(a=ORIGIN, b="rod.root", type="clamp"), "clamp")
    if tip == "force":
        system.add(parts.Load(at="rod.tip", force=(0.0, f, 0.0)), "load")
    elif tip == "line":
        system.add(parts.Load(along="rod", force=(0.0, f, 0.0)), "load")
    run = system.equilibrium()
    x = run["rod"].arc_node.values
    GA = S.shear_y * RUBBER.shear_modulus * S.area
    if tip == "force":
        wanted = f * (x**2 / 2.0 - x**3 / 6.0) / EI + f * x / GA
        assert run["rod"].bending_moment_z.values[-1] == pytest.approx(f * (1.0 - run["rod"].arc.values), rel=1e-5)
    else:
        wanted = f * (x**2 / 4.0 - x**3 / 6.0 + x**4 / 24.0) / EI + f * (x - x**2 / 2.0) / GA
        work = 0.5 * f**2 * (1.0 / 20.0 / EI + 1.0 / 3.0 / GA)  # of the exact shape; that of the rod is a little less
        assert run["rod"].energy_elastic.values[-1] == pytest.approx(work, rel=5e-3)
    if tip == "line":
        assert run["load"].force.values[-1] == pytest.approx((0.0, f, 0.0), abs=1e-12)
    names = {"force": "a force at its tip", "line": "a force per length", "gravity": "its weight"}
    kind = (
        {1.0: "4 equal", 3.0: "4 graded"}.get(grading, "4 unequal") if not isinstance(grading, tuple) else "4 unequal"
    )
    book(
        "Statics of beams", f"Cantilever under {names[tip]}: nodes (rod, {kind} elements)",
        reference="Timoshenko", source="closed form",
        error=np.abs(run["rod"].deflection.values[-1, :, 1] - wanted).max() / wanted[-1], allowed=2e-6,
    )  # fmt: skip


@pytest.mark.parametrize("grading", [1.0, 4.0])
def test_graded_rods_bend_by_large_angles(grading: float) -> None:
    """The roll-up is exact for any lengths; strains are those of the elements' own lengths."""
    torque = parts.Load(at="rod.tip", torque=(0.0, 0.0, np.pi * EI))
    run = cantilever(torque, elements=8, grading=grading).equilibrium()
    assert run["rod"].tip_position.values[-1] == pytest.approx((0.0, 2.0 / np.pi, 0.0), abs=1e-8)
    assert run["rod"].curvature_z.values[-1] == pytest.approx(np.full(8, np.pi), rel=1e-8)
    assert run["rod"].curvature.values[-1] == pytest.approx(np.full(9, np.pi), rel=1e-6)
    assert run["rod"].energy_elastic.values[-1] == pytest.approx(0.5 * EI * np.pi**2, rel=1e-8)


def test_a_graded_rod_is_heated() -> None:
    """A free expansion alpha T(x) of unequal elements: the tip moves by its integral, without force."""
    system = System()
    material = RUBBER.model_copy(update={"thermal_expansion": 1e-4})
    system.add(parts.Rod(**(KEYS | {"material": material}), grading=(1.0, 3.0, 2.0, 2.0)), "rod")
    system.add(parts.Joint(a=ORIGIN, b="rod.root", type="clamp"), "clamp")
    heat = parts.ThermalLoad(part="rod", temperature={"constant": 10.0}, along=((0.0, 0.0), (1.0, 1.0)))
    system.add(heat, "heat")
    run = system.equilibrium()
    assert run["rod"].tip_deflection.values[-1, 0] == pytest.approx(5e-4, rel=1e-6)
    assert run["rod"].strain.values[-1] == pytest.approx(np.zeros(4), abs=1e-10)
    assert run["heat"].free_strain.values[-1] == pytest.approx(1e-3 * run["rod"].arc.values, rel=1e-9)


@pytest.mark.parametrize("load", ["constant", "profile", "law"])
@pytest.mark.parametrize("method", ["energy-momentum", "generalized-alpha"])
def test_work_of_a_line_load_on_a_rod_that_flies(load: str, method: str) -> None:
    """Energy of the rod less its start is the work of the load; momentum is the impulse of a constant load."""
    loads: dict[str, dict[str, Any]] = {
        "constant": {"force": (0.0, 3.0, 1.0)},
        "profile": {"direction": (0.0, 0.6, 0.8), "profile": {"table": [[0.0, 0.0], [0.1, 4.0]]}},
        "law": {"law": ["-c*vx", "-c*vy", "-c*vz"], "constants": {"c": 2.0}},
    }
    system = System()
    system.add(parts.Rod(**KEYS, grading=2.0, inertia=INERTIA, angular_velocity=(0.3, 0.0, 4.0)), "rod")
    system.add(parts.Load(along="rod", **loads[load]), "load")
    again = evolvent.load(yaml.safe_load(system.to_yaml(until=0.1, every=1e-3)))
    assert again.parts == system.parts
    run = again.simulate(until=0.1, every=1e-3, method=method, step=5e-4)
    rod = run["rod"]
    total = rod.energy_kinetic.values + rod.energy_elastic.values
    work = run["load"].work.values
    assert total - total[0] == pytest.approx(work, abs=5e-3 * np.abs(work).max())
    if load == "constant":
        change = rod.momentum.values[-1] - rod.momentum.values[0]
        assert change == pytest.approx((0.0, 0.3, 0.1), abs=1e-6)


def test_a_body_on_a_node_of_a_rod() -> None:
    """`at` clamps it there; the equilibrium is that of a joint."""
    mass, g = 0.05, 0.1

    def sag(at: bool) -> Array:
        system = System(gravity=(0.0, -g, 0.0))
        system.add(parts.Rod(**KEYS, angular_velocity=(0.0, 0.0, 2.0)), "rod")
        system.add(parts.Joint(a=ORIGIN, b="rod.root", type="revolute"), "pin")
        if at:
            system.add(parts.RigidBody(mass=mass, inertia=1e-4, at="rod.tip"), "end")
        else:
            moves = {"velocity": (0.0, 2.0, 0.0), "angular_velocity": (0.0, 0.0, 2.0)}
            system.add(parts.RigidBody(mass=mass, inertia=1e-4, position=(1.0, 0.0, 0.0), **moves), "end")
            system.add(parts.Joint(a="end", b="rod.tip", type="clamp"), "seat")
        run = system.simulate(until=0.05, every=0.05, method="energy-momentum", step=1e-3)
        assert run["end"].position.values[-1] == pytest.approx(run["rod"].tip_position.values[-1], abs=1e-9)
        return np.asarray(run["rod"].tip_position.values[-1])

    assert sag(True) == pytest.approx(sag(False), abs=1e-10)


def refused(*added: Any, kind: Any = parts.Rod, **keys: Any) -> str:
    system = System()
    system.add(kind(**(KEYS | keys)), "arm")
    for k, part in enumerate(added):
        system.add(part, f"part {k}")
    with pytest.raises(InputError) as error:
        system.assemble()
    return str(error.value)


def test_refusals() -> None:
    assert "arm.grading has 3 values; it must be one value, or 4" in refused(grading=(1.0, 2.0, 3.0))
    words = "arm.inertia.inertia_yz is 1 kg m; its square must be below"
    assert words in refused(inertia=SectionInertia(inertia_yz=1.0))
    for polar in (1.7e-3, 2.5e-3):  # 1.75e-3 is the difference of the principal moments, 2.3e-3 the sum
        words = "arm.inertia.inertia_x is 0.00"
        assert words in refused(inertia=INERTIA.model_copy(update={"inertia_x": polar}))
    assert "arm.inertia.inertia_x is given; the sections of a Beam are plane" in refused(
        kind=parts.Beam, inertia=INERTIA.model_copy(update={"inertia_x": 2e-3})
    )
    torque = parts.Load(along="arm", torque=(0.0, 0.0, 1.0))
    assert "is 'arm', a rod, which a spread torque does not support; give a torque" in refused(torque)
    assert "force is missing; give force, torque, direction and profile, or law" in refused(parts.Load(along="arm"))
    late = parts.Load(along="arm", force=(0.0, 1.0, 0.0), start=2.0, until=1.0)
    assert "it must be after part 0.start, 2.0 s" in refused(late)
    assert "no node 9" in refused(parts.RigidBody(mass=1.0, inertia=1.0, at="arm[9]"))
    moving = parts.RigidBody(mass=1.0, inertia=1.0, at="arm.tip", velocity=(1.0, 0.0, 0.0))
    assert "the body moves with the node" in refused(moving)


def bent_by(load: Any, gravity: tuple[float, float, float] = ORIGIN) -> Array:
    """Nodes of a curved, graded rod that bends by about its own length."""
    system = System(gravity=gravity)
    system.add(parts.Rod(**KEYS, grading=(1.0, 3.0, 2.0, 2.0), curvature=(0.3, 0.0, 0.5)), "rod")
    system.add(parts.Joint(a=ORIGIN, b="rod.root", type="clamp"), "clamp")
    if load is not None:
        system.add(load, "load")
    return np.asarray(system.equilibrium()["rod"].position.values[-1])


def test_a_line_load_is_a_weight() -> None:
    """A force per length m g, constant, by a profile and by a law, has the equilibrium of the weight."""
    g = 40.0
    weight = g * RUBBER.density * S.area
    wanted = bent_by(None, gravity=(0.0, 0.0, -g))
    assert wanted[-1, 2] < -0.2
    push = (0.0, 0.0, -weight)
    for keys in (
        {"force": push},
        {"direction": (0.0, 0.0, -2.0), "profile": {"constant": weight}},
        {"law": ["0", "0", "-p"], "constants": {"p": weight}},
    ):
        assert bent_by(parts.Load(along="rod", **keys)) == pytest.approx(wanted, abs=1e-7)


def test_line_loads_close_the_energy_balance() -> None:
    """Energies less the work of the loads stay exactly what they are in the energy-momentum method, in large steps."""
    system = System()
    system.add(parts.Rod(**KEYS, grading=2.0, inertia=INERTIA, angular_velocity=(0.3, 0.0, 4.0)), "rod")
    system.add(parts.Load(along="rod", force=(0.0, 30.0, 10.0), ramp=0.05, until=0.3), "load")
    assembly = system.assemble()
    assert all(owner(assembly, "loads", k) == "load" for k in range(5))
    found = solve_energy(assembly, samples=np.linspace(0.0, 0.5, 51), step=1e-2, spectral_radius=1.0)
    assert found.success, found.message
    balance = found.kept.balance
    off = balance.kinetic + balance.elastic - balance.loads
    assert np.abs(off - off[0]).max() < 1e-8 * np.abs(balance.loads).max()
    assert np.abs(balance.loads).max() > 1.0
