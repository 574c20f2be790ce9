"""Beams and rods whose stress-free shape is curved: no force in it, the energy of bending it, and its frequencies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from evolvent import InputError, System, parts
from evolvent.elements import Material, Rectangle

RIB = Rectangle(thickness="1 mm", width="20 mm")
STEEL = Material(young_modulus=2e11, poisson_ratio=0.3, density=7800.0)
EI = STEEL.E * RIB.properties(0.3).Iz
MASS = STEEL.density * RIB.properties(0.3).area
KEYS: dict[str, Any] = {"section": RIB, "material": STEEL}
BOTH = pytest.mark.parametrize("make", [parts.Beam, parts.Rod])
DISH = {"parabola": {"focal_length": 1.5, "offset": 0.2}}


def held(part: Any, *others: Any) -> System:
    system = System()
    system.add(part, "rib")
    system.add(parts.Joint(a=tuple(np.array(part.position)), b="rib.root", type="clamp"), "root")
    for k, other in enumerate(others):
        system.add(other, f"other {k + 1}")
    return system


def energy(part: Any) -> float:
    """Strain energy at the start, J."""
    system = System()
    system.add(part, "rib")
    return float(system.simulate(until=1e-9, every=1e-9, method="rk4", step=1e-9)["rib"].energy_elastic.values[0])


def wound(kind: type, radius: float, length: float, elements: int) -> tuple:
    """Nodes on a circle about (0, radius, 0), from the origin along x."""
    arc = np.linspace(0.0, length, elements + 1) / radius
    c, s, o = np.cos(arc), np.sin(arc), np.zeros_like(arc)
    x = radius * np.stack([s, 1.0 - c, o], axis=1)
    frame = [np.stack(one, axis=1) for one in ([c, s, o], [-s, c, o], [o, o, o + 1.0])]
    return tuple(map(tuple, np.stack([x, *frame], axis=1).tolist()))


@BOTH
def test_nodes_lie_on_the_parabola(make):
    f, offset, length = 1.5, 0.2, 3.0
    part = make(length=length, elements=5, shape=DISH, direction=(1.0, offset / (2.0 * f), 0.0), **KEYS)
    nodes = part.start_nodes() if make is parts.Beam else part.start_nodes()[0][:, None]
    x = nodes[:, 0, 0] + offset
    assert_allclose(nodes[:, 0, 1], (x**2 - offset**2) / (4.0 * f), atol=1e-12)
    for at, arc in zip(x, part.arc, strict=True):
        assert quad(lambda u: np.hypot(1.0, u / (2.0 * f)), offset, at)[0] == pytest.approx(arc, abs=1e-12)


def test_a_parabola_through_its_vertex_is_symmetric():
    ends = parts.Parabola(focal_length=0.7, offset=-1.0).plane(np.array([0.0, 0.5]))[1]
    half = float(quad(lambda u: np.hypot(1.0, u / 1.4), 0.0, 1.0)[0])
    places, angle = parts.Parabola(focal_length=0.7, offset=-1.0).plane(np.array([half, 2.0 * half]))
    assert_allclose(angle, [np.arctan(1.0 / 1.4), 2.0 * np.arctan(1.0 / 1.4)], rtol=1e-12)
    assert np.linalg.norm(places[1]) == pytest.approx(2.0, rel=1e-12)
    assert ends[0] == 0.0


@BOTH
def test_a_curved_rib_rests_without_load(make):
    found = held(make(length=2.0, elements=6, shape=DISH, **KEYS)).equilibrium()
    rib = found["rib"]
    assert np.abs(rib.bending_moment_z.values).max() < 1e-9 * EI
    assert np.abs(rib.axial_force.values).max() < 1e-9 * STEEL.E * RIB.properties(0.3).area
    assert np.abs(rib.tip_deflection.values).max() < 1e-9
    assert np.abs(rib.strain.values if "strain" in rib else 0.0).max() < 1e-12


@pytest.mark.slow
@BOTH
def test_winding_a_parabola_takes_the_energy_of_the_change_of_curvature(make, book):
    """EI/2 int (1/R - k(s))^2 ds, with the parabola's curvature k, from a quadrature."""
    R, f, length = 0.25, 0.5, 1.0
    shape = parts.Parabola(focal_length=f, offset=0.1)

    def curvature(s: float) -> float:
        u = 0.5 * (0.1 / f) if s == 0.0 else float(np.tan(shape.plane(np.array([s]))[1][0] + np.arctan(0.1 / (2 * f))))
        return 1.0 / (2.0 * f * (1.0 + u * u) ** 1.5)

    wanted = 0.5 * EI * quad(lambda s: (1.0 / R - curvature(s)) ** 2, 0.0, length)[0]
    errors = [
        energy(make(length=length, elements=n, shape=shape, nodes=wound(make, R, length, n), **KEYS)) / wanted - 1.0
        for n in (40, 80)
    ]
    assert abs(errors[1]) < max(0.5 * abs(errors[0]), 1e-7)
    book(
        "Wrapped rib", f"Winding energy of a {make.__name__.lower()} that is a parabola without stress",
        reference="EI/2 int (1/R - k)^2 ds", source="closed form", error=abs(errors[1]), allowed=1e-3,
    )  # fmt: skip


@BOTH
def test_winding_an_arc_onto_a_tighter_one(make):
    R, k0, length, n = 0.5, 0.8, 1.0, 24
    part = make(length=length, elements=n, curvature=(0.0, 0.0, k0), nodes=wound(make, R, length, n), **KEYS)
    assert energy(part) == pytest.approx(0.5 * EI * (1.0 / R - k0) ** 2 * length, rel=2e-3)


@pytest.mark.slow
@BOTH
def test_antisymmetric_mode_of_a_shallow_arch(make, book):
    """A shallow pinned arch swings antisymmetrically as the straight beam does: w = 4 pi^2 sqrt(EI/(m L^4))."""
    span = 1.0
    # 5 mm of rise: the arch's inextensible corrections are of the order (rise/span)^2
    shape = {"parabola": {"focal_length": span**2 / (16.0 * 5e-3), "offset": -0.5 * span}}
    slope = -4.0 * 5e-3 / span
    part = make(length=span, elements=24, shape=shape, direction=(1.0, slope, 0.0), **KEYS)
    system = System()
    system.add(part, "rib")
    nodes = part.start_nodes() if make is parts.Beam else part.start_nodes()[0][:, None]
    for end, node in (("root", nodes[0, 0]), ("tip", nodes[-1, 0])):
        system.add(parts.Joint(a=tuple(node), b=f"rib.{end}", type="revolute", axis=(0.0, 0.0, 1.0)), end)
    found = system.modes(count=8)
    wanted = 4.0 * np.pi**2 * np.sqrt(EI / MASS) / span**2
    w = found.frequency
    nearest = float(w[np.argmin(np.abs(w - wanted))])
    assert nearest == pytest.approx(wanted, rel=5e-3)
    # the first in-plane mode of the straight beam is not among them: the arch's axial stiffness raises it
    straight = np.pi**2 * np.sqrt(EI / MASS) / span**2
    assert np.abs(w / straight - 1.0).min() > 0.05
    book(
        "Modes", f"Antisymmetric mode of a shallow arch, {make.__name__.lower()}",
        reference="4 pi^2 sqrt(EI/(m L^4))", source="closed form", error=abs(nearest / wanted - 1.0), allowed=5e-3,
    )  # fmt: skip


@BOTH
@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"shape": DISH, "curvature": (0.0, 0.0, 1.0)}, r"rib\.shape and rib\.curvature are both given"),
        ({"shape": {"parabola": {"focal_length": 0.0}}}, "focal_length"),
        ({"shape": {"parabla": {"focal_length": 1.0}}}, "did you mean 'parabola'"),
        ({"shape": "parabola"}, "a mapping with one of the keys parabola"),
    ],
)
def test_refused_shapes(make, keys, message):
    with pytest.raises(InputError, match=message) as error:
        held(make(length=1.0, elements=4, **KEYS, **keys)).assemble()
    assert "\n" not in str(error.value)


def test_shapes_that_a_beam_refuses():
    with pytest.raises(InputError, match=r"rib\.shape is given and rib\.formulation is 'cable'; a cable is straight"):
        held(parts.Beam(length=1.0, elements=4, formulation="cable", shape=DISH, **KEYS)).assemble()
    nodes = wound(parts.Beam, 1.0, 1.0, 4)
    with pytest.raises(InputError, match=r"rib\.rest is 'start' and rib\.shape is given as well"):
        held(parts.Beam(length=1.0, elements=4, shape=DISH, nodes=nodes, rest="start", **KEYS)).assemble()
