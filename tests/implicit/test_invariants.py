"""Free crafts with ribs: momenta, energy, mirror symmetry, and an account that closes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import System, elements, parts
from evolvent.assembly.assembled import Assembly
from implicit.rigs import coordinates, momenta, run

Array = np.ndarray
STRIP = elements.Rectangle(thickness=0.01, width=0.03)
SOFT = elements.Material(young_modulus=1e7, poisson_ratio=0.3, density=1500.0)


def craft(
    *,
    ribs: int = 2,
    formulation: str = "cable",
    touching: bool = False,
    noise: float = 0.1,
    spin: float = 1.0,
    inward: float = 0.0,
    wobble: float = 0.3,
    kind: str = "clamp",
    rng: np.random.Generator | None = None,
    mirrored: bool = False,
    **cylinder: Any,
) -> Assembly:
    """A free hub that spins with ribs joined to it, straight out or along its rim, every node with a random velocity.

    Ribs turn about their roots by `inward` more than the hub, towards its rim.
    """
    system = System()
    w, v = np.array([wobble, 0.0, spin]), np.array([0.1, 0.2, 0.0]) * (not mirrored)
    hub = parts.RigidBody(mass=20.0, inertia=(2.0, 2.5, 3.0), velocity=v, angular_velocity=w)
    system.add(hub, "hub")
    noises: list[Array] = []
    for k in range(ribs):
        angle = 2.0 * np.pi * k / ribs
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        d = out if not touching else np.array([-out[1], out[0], 0.0]) + 0.05 * out
        d /= np.linalg.norm(d)
        n = np.array([-d[1], d[0], 0.0])
        vectors = 2 if formulation == "cable" else 4
        nodes = np.zeros((5, vectors, 3))
        nodes[:, 0] = 0.5 * out + np.outer(np.linspace(0.0, 2.0, 5), d)
        nodes[:, 1] = d
        if vectors == 4:
            nodes[:, 2], nodes[:, 3] = n, np.cross(d, n)
        rates = np.cross(w, nodes)
        rates[:, 0] += v
        rates += inward * np.cross([0.0, 0.0, 1.0], nodes - np.eye(vectors)[0][:, None] * nodes[0, 0])
        if rng is not None:
            extra = noise * rng.standard_normal(rates.shape)
            if mirrored and k == 1:
                extra = noises[0] * np.array([-1.0, -1.0, 1.0])  # half a turn about the axis
            extra[0] = 0.0
            noises.append(extra)
            rates += extra
        rib = f"rib{k}"
        system.add(
            parts.Beam(
                length=2.0, section=STRIP, material=SOFT, elements=4, formulation=formulation, nodes=nodes, rates=rates
            ),
            rib,
        )  # fmt: skip
        system.add(parts.Joint(a=("hub", tuple(0.5 * out)), b=f"{rib}.root", type=kind))
    if touching:
        fields: dict[str, Any] = {"stiffness": 1e4, "damping": 0.1, "skip": 1, "friction": 0.2} | cylinder
        system.add(
            parts.Contact(a=[f"rib{k}" for k in range(ribs)], b="hub", shape=parts.Cylinder(radius=0.5), **fields),
            "rim",
        )
    return system.assemble()


@pytest.mark.parametrize("formulation", ["cable", "assumed_strain"])
@pytest.mark.parametrize("options", [{"step": 2e-3}, {"tolerance": 1e-4}])
@pytest.mark.parametrize("ribs", [2, 3])
def test_momenta_of_a_free_craft(
    formulation: str, options: dict[str, float], ribs: int, rng: np.random.Generator
) -> None:
    kind = "clamp" if ribs == 2 else "revolute"
    assembly = craft(ribs=ribs, formulation=formulation, kind=kind, rng=rng)
    found = momenta(assembly, run(assembly, np.linspace(0.0, 1.0, 6), **options))
    for part in (found[:, :3], found[:, 3:]):
        assert np.abs(part[-1] - part[0]).max() < 1e-9 * np.linalg.norm(part[0])
        # samples between the ends of adaptive steps are interpolated
        assert np.abs(part - part[0]).max() < (1e-9 if "step" in options else 1e-5) * np.linalg.norm(part[0])


@pytest.mark.parametrize("options", [{"step": 1e-3}, {"tolerance": 1e-4}])
def test_momenta_with_contact(options: dict[str, float], rng: np.random.Generator) -> None:
    """Ribs wind onto the hub that they spin."""
    assembly = craft(ribs=3, touching=True, kind="spherical", spin=-0.5, inward=2.0, rng=rng)
    solution = run(assembly, np.linspace(0.0, 2.0, 201), **options)
    assert solution.forces["contact_surfaces"]["touching"][:, 0].max() >= 3
    assert np.abs(solution.forces["contact_surfaces"]["normal"][:, 0]).max() > 1.0
    found = momenta(assembly, solution)
    for part in (found[:, :3], found[:, 3:]):
        assert np.abs(part[-1] - part[0]).max() < 1e-9 * np.linalg.norm(part[0])
        assert np.abs(part - part[0]).max() < (1e-9 if "step" in options else 1e-4) * np.linalg.norm(part[0])


def test_momentum_through_release(rng: np.random.Generator) -> None:
    """A rib that is let go takes its share along."""
    system = System()
    w = np.array([0.0, 0.0, 2.0])
    system.add(parts.RigidBody(mass=5.0, inertia=1.0, angular_velocity=w), "hub")
    nodes = np.zeros((5, 2, 3))
    nodes[:, 0, 0] = 0.5 + np.linspace(0.0, 2.0, 5)
    nodes[:, 1, 0] = 1.0
    rib = parts.Beam(
        length=2.0, section=STRIP, material=SOFT, elements=4, formulation="cable", nodes=nodes, rates=np.cross(w, nodes)
    )
    system.add(rib, "rib")
    system.add(parts.Joint(a=("hub", (0.5, 0.0, 0.0)), b="rib.root", type="clamp", until=0.3))
    assembly = system.assemble()
    solution = run(assembly, np.linspace(0.0, 1.0, 11), step=1e-3)
    found = momenta(assembly, solution)
    assert np.abs(found - found[0]).max() < 1e-9 * np.linalg.norm(found[0])
    apart = coordinates(assembly, solution.y, "rib")[-1, 0, 0] - coordinates(assembly, solution.y, "hub")[-1, :3]
    assert np.linalg.norm(apart) > 1.0
    assert np.abs(solution.la[solution.t > 0.3001]).max() == 0.0


def test_loads_turn_an_isolated_craft_by_their_torque() -> None:
    """Angular momentum that is kept beside a load is what the load brings in: T t for a torque spread over a rib."""
    system = System()
    system.add(parts.RigidBody(mass=5.0, inertia=1.0), "hub")
    system.add(
        parts.Beam(length=2.0, section=STRIP, material=SOFT, elements=4, formulation="cable", position=(0.5, 0.0, 0.0)),
        "rib",
    )
    system.add(parts.Joint(a=("hub", (0.5, 0.0, 0.0)), b="rib.root", type="clamp"))
    system.add(parts.Load(along="rib", torque=(0.0, 0.0, 0.2), until=0.5))
    assembly = system.assemble()
    solution = run(assembly, [0.0, 0.25, 0.5, 0.75, 1.0], step=1e-3, spectral_radius=0.9)
    assert np.abs(momenta(assembly, solution)[:, 5] - 0.2 * np.minimum(solution.t, 0.5)).max() < 1e-6


def test_energy_without_numerical_damping_is_bounded(rng: np.random.Generator) -> None:
    assembly = craft(rng=rng)
    solution = run(assembly, np.linspace(0.0, 10.0, 101), step=1e-3, spectral_radius=1.0)
    energy = solution.balance.kinetic + solution.balance.elastic
    first, last = energy[:51], energy[50:]
    assert np.abs(energy / energy[0] - 1.0).max() < 2e-3
    assert abs(last.mean() / first.mean() - 1.0) < 3e-4


def test_mirrored_ribs_stay_mirrored(rng: np.random.Generator) -> None:
    """Two ribs that half a turn about the axis brings onto each other, contact and friction included."""
    assembly = craft(touching=True, kind="spherical", spin=-0.5, inward=2.0, wobble=0.0, rng=rng, mirrored=True)
    solution = run(assembly, np.linspace(0.0, 1.5, 16), step=1e-3)
    assert solution.forces["contact_surfaces"]["touching"][:, 0].max() >= 2
    one, other = (coordinates(assembly, solution.y, name) for name in ("rib0", "rib1"))
    assert np.abs(one * np.array([-1.0, -1.0, 1.0]) - other).max() < 1e-9


def test_the_account_closes_with_second_order(rng: np.random.Generator) -> None:
    """Damping of every cause, loads and gravity at once: what is left over falls by four."""
    worst = []
    for h in (4e-4, 2e-4, 1e-4):
        system = System(gravity=(0.0, -9.81, 0.0))
        inertia = (0.05, 0.06, 0.07)
        system.add(parts.RigidBody(motion="spin", inertia=inertia, rate=2.0), "hub")
        nodes = np.zeros((5, 2, 3))
        nodes[:, 0, 0] = 0.3 + np.linspace(0.0, 1.0, 5)
        nodes[:, 1, 0] = 1.0
        rates = np.cross([0.0, 0.0, 2.0], nodes)
        beam = parts.Beam(
            length=1.0, section=STRIP, material=SOFT, elements=4, formulation="cable", nodes=nodes, rates=rates,
            mass_damping=0.5, stiffness_damping=1e-3,
        )  # fmt: skip
        system.add(beam, "rib")
        system.add(parts.Joint(a=("hub", (0.3, 0.0, 0.0)), b="rib.root"))
        system.add(parts.JointSpring(a="hub", b="rib.root", stiffness=3.0, damping=0.02, low=-0.3, high=0.3, stop=9.0))
        system.add(parts.Point(mass=0.2, position=(1.3, 0.5, 0.0)), "bob")
        system.add(parts.Spring(a="bob", b=("hub", (0.0, 0.3, 0.0)), stiffness=40.0, damping=0.3))
        system.add(parts.Load(at="rib.tip", force=(0.0, 0.3, 0.1), start=0.1, until=0.4))
        system.add(parts.Load(along="rib", torque=(0.0, 0.0, 0.1), ramp=0.2))
        solution = run(system.assemble(), np.linspace(0.0, 0.6, 7), step=h, spectral_radius=0.9, newton=1e-12)
        assert all(solution.balance[-1][name] > 1e-4 for name in ("by_mass", "by_stiffness", "by_joints", "by_springs"))
        worst.append(float(np.abs(solution.energy_defect).max()))
    assert worst[-1] < 1e-3
    assert np.abs(np.log2(np.array(worst[:-1]) / worst[1:]) - 2.0).max() < 0.25


def test_a_free_mass_flies_straight() -> None:
    """A single mass has no inertia about its own centre, by which its angular momentum could be kept."""
    system = System()
    system.add(parts.Point(mass=0.3, position=(0.2, 1.5, 0.5), velocity=(-1.2, 0.0, 0.3)), "mass")
    solution = run(system.assemble(), np.linspace(0.0, 20.0, 5), step=1e-3)
    assert solution.y[:, 3:6] == pytest.approx(np.tile([-1.2, 0.0, 0.3], (5, 1)), abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
@pytest.mark.parametrize("part", ["spring", "hinge", "rod"])
def test_a_structure_at_rest_without_load_stays_at_rest(part: str, method: str) -> None:
    """Its energies are round-off, which is no gain."""
    system = System()
    if part == "rod":
        section, material = (
            elements.Tube(radius=0.005, thickness=0.001),
            elements.Material(young_modulus=70e9, density=2.7e3),
        )
        direction = (1.0, 2.0, 3.0)
        system.add(parts.Rod(length=1.0, elements=4, section=section, material=material, direction=direction), "rod")
    else:
        system.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.2, 0.3)), "a")
        system.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.2, 0.3), position=(1.0, 0.3, 0.1)), "b")
        spring = parts.Spring(a="a", b="b", stiffness=1e4)
        hinge = parts.Joint(a="a", b=("b", (0.1, 0.0, 0.0)), type="revolute", axis=(0.0, 0.0, 1.0))
        system.add(spring if part == "spring" else hinge, "between")
    found = system.simulate(until=0.1, every=0.01, method=method)
    assert found.attrs["status"] == "success"
    assert abs(found.energy).max() < 1e-20
