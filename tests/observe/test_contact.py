"""Contacts: forces of the points against the resultant, and both against the law written out here."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import System, elements, parts
from evolvent.families.contact.observer_surfaces import touching_span
from observe.seeing import Array, Seen, at_rest, close, run

SQUARE = elements.Rectangle(thickness=0.05, width=0.05)
SOFT = elements.Material(young_modulus=2e6, poisson_ratio=0.0, density=1000.0)
K, DAMPING, RADIUS, CENTRE = 2000.0, 0.5, 0.2, np.array([0.6, -0.2, 0.0])
POINTS = 3


def falling(law: str, exponent: float = 1.5) -> System:
    """A cable hinged at its root falls onto a cylinder on a body."""
    system = System(gravity=(0.0, -2.0, 0.0))
    system.add(parts.RigidBody(motion="driven", position=(0.1, 0.0, 0.0)), "base")
    beam = parts.Beam(length=1.0, section=SQUARE, material=SOFT, elements=4, formulation="cable", mass_damping=1.0)
    system.add(beam, "rod")
    pin = parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root", type="spherical", stiffness=1e5, damping=10.0)
    system.add(pin, "pin")
    drum = parts.Contact(
        a="rod", b=("base", tuple(CENTRE - [0.1, 0.0, 0.0])), shape=parts.Cylinder(radius=RADIUS - 0.01),
        stiffness=K, exponent=exponent, damping=DAMPING, law=law, points=POINTS, skip=1,
    )  # fmt: skip
    system.add(drum, "drum")
    return system


def places(found: Seen, *, rate: bool = False) -> Array:
    """Contact points (nt, n, 3) from the raw nodes: `POINTS` evenly in each element, without the first one of all."""
    nodes, h = found.nodes("rod", rate=rate), 0.25
    rows = []
    for i in range(4):
        for k in range(1, POINTS + 1):
            S = np.array(elements.axis_shape(h, k / POINTS))
            rows.append(
                S[0] * nodes[:, i, 0] + S[1] * nodes[:, i, 1] + S[2] * nodes[:, i + 1, 0] + S[3] * nodes[:, i + 1, 1]
            )
    return np.stack(rows[1:], axis=1)


@pytest.mark.parametrize(
    ("method", "law"), [("generalized-alpha", "hunt-crossley"), ("rk4", "hunt-crossley"), ("rk4", "conservative")]
)
def test_forces_of_contact_points(method: str, law: str) -> None:
    options = {"step": 1e-4} if method == "rk4" else {"step": 1e-3}
    found = run(falling(law), np.linspace(0.0, 0.5, 26), method, **options)
    x, v = places(found) - CENTRE, places(found, rate=True)
    off = np.hypot(x[..., 0], x[..., 1])
    gap = off - (RADIUS - 0.01)
    near = np.isfinite(found.of("drum", "gap"))
    close(found.of("drum", "gap")[near], gap[near])
    assert np.all(near[gap < 0.0])
    n = x * np.array([1.0, 1.0, 0.0]) / off[..., None]
    rate = np.sum(n * v, axis=-1)
    deep = np.maximum(-gap, 0.0)
    force = np.maximum(K * deep**1.5 * (1.0 - DAMPING * rate), 0.0)
    assert np.sum(force.max(axis=0) > 0.0) >= 2
    close(found.of("drum", "point_force"), force)
    arc = (np.arange(1, 12) + 1) / (4 * POINTS)
    close(found.tree["drum"]["arc"].values, arc)
    assert set(found.tree["drum"]["beam"].values) == {"rod"}
    # the resultant on the beam, and its moment about the body's origin, are of the same forces
    close(found.of("drum", "normal_force"), force.sum(axis=1), part=1e-9)
    resultant = np.einsum("tn,tnc->tc", force, n)
    close(found.of("drum", "force"), resultant, part=1e-9)
    at = places(found) - np.array([0.1, 0.0, 0.0])
    close(found.of("drum", "moment"), np.einsum("tn,tnc->tc", force, np.cross(at, n)), part=1e-9)
    close(found.of("drum", "points"), np.sum(gap < 0.0, axis=1))
    close(found.of("drum", "energy_elastic"), (K * deep**2.5 / 2.5).sum(axis=1))
    # nothing else acts on the body, by the opposite
    index = found.assembly.names["base"][1]
    close(found.solution.wrenches[:, index, :3], -found.of("drum", "force"))
    close(found.solution.wrenches[:, index, 3:], -found.of("drum", "moment"))
    fine = run(falling(law), np.linspace(0.0, 0.5, 1001), method, **options)
    whole = np.trapezoid(fine.of("drum", "normal_force"), fine.t)
    close(fine.of("drum", "impulse")[-1:], [whole], part=0.01)


ARC = np.arange(1, 41) / 10.0


@pytest.mark.parametrize("power", [2.0, 3.0])
@pytest.mark.parametrize(("first", "last"), [(1.234, 3.017), (1.251, 2.349)])
def test_a_span_of_contact_ends_within_a_spacing_where_the_gap_opens(power: float, first: float, last: float) -> None:
    gap = np.maximum(first - ARC, 0.0) ** power + np.maximum(ARC - last, 0.0) ** power
    gap = np.where(gap == 0.0, -1e-6, gap)
    gap[np.argmax(gap < 0.0) + 3] = 1e-3  # a polynomial departs from the surface
    gap[-1] = np.nan
    found = touching_span(ARC, np.stack([gap, np.full(40, np.nan), np.full(40, 0.1)]))
    close(np.array(found)[:, 1:], np.zeros((2, 2)))
    assert np.array(found)[:, 0] == pytest.approx([first, last], abs=1e-9 if power == 3.0 else 0.1)


def test_a_point_that_hovers_by_vibration_touches() -> None:
    gap = np.where(ARC > 3.0, 0.01, 1e-7)
    assert np.ravel(touching_span(ARC, gap[None])) == pytest.approx([0.0, 3.0], abs=0.1)


def test_a_span_of_contact_reaches_the_ends_of_the_beam() -> None:
    found = touching_span(ARC, np.full((1, 40), -1e-6))
    assert np.ravel(found) == pytest.approx([0.0, 4.0])
    assert np.ravel(touching_span(ARC[:1], np.full((1, 1), -1e-6))) == pytest.approx([0.1, 0.1])
    # the first elements are skipped: what touches begins at the first point
    assert np.ravel(touching_span(ARC[10:], np.full((1, 30), -1e-6))) == pytest.approx([1.0, 4.0])


def test_a_rod_wound_on_a_drum_touches_over_the_length_of_its_arc() -> None:
    """A cable of 1 m, wound on a drum of 0.2 m but for a straight tail of 0.3 m, its root on the drum."""
    radius, tail, n = 0.2, 0.3, 20
    arc = np.linspace(0.0, 1.0, n + 1)
    angle = np.minimum(arc, 1.0 - tail) / radius
    off = np.maximum(arc - (1.0 - tail), 0.0)[:, None]
    out, along = np.stack([np.cos(angle), np.sin(angle)], 1), np.stack([-np.sin(angle), np.cos(angle)], 1)
    flat = np.stack([(radius - 1e-4) * out + off * along, along], axis=1)
    nodes = np.concatenate([flat, np.zeros((n + 1, 2, 1))], axis=2)
    system = System()
    beam = {"length": 1.0, "section": SQUARE, "material": SOFT, "elements": n, "formulation": "cable", "nodes": nodes}
    system.add(parts.Beam(**beam), "rod")
    drum = parts.Contact(
        a="rod", b="ground", shape=parts.Cylinder(radius=radius), stiffness=K, points=4, initial_overlap=0.1
    )
    system.add(drum, "drum")
    found = run(system, np.array([0.0, 1e-4, 2e-4]), "rk4", step=1e-5)
    assert found.of("drum", "touching_length")[0] == pytest.approx(1.0 - tail, abs=0.0125)


def test_friction_holds_a_resting_rod() -> None:
    """A rod on two drums on an incline: bristles bear what pulls it down, and their energy counts."""
    g, along = 2.0, 0.1
    system = System(gravity=(0.0, -g, along))
    nodes = parts.Beam(length=1.0, section=SQUARE, material=SOFT, elements=2, formulation="cable").start_nodes()
    nodes[:, 0, 1] = -1e-3
    beam = parts.Beam(length=1.0, section=SQUARE, material=SOFT, elements=2, formulation="cable", nodes=nodes)
    system.add(beam, "rod")
    for name, x in (("left", 0.0), ("right", 1.0)):
        drum = parts.Contact(
            a="rod", b=(x, -1.0, 0.0), shape=parts.Cylinder(radius=1.0), stiffness=2500.0, friction=0.5,
            bristle_stiffness=800.0, points=1, initial_overlap=0.1,
        )  # fmt: skip
        system.add(drum, name)
    system.add(parts.Joint(a=tuple(nodes[0, 0]), b="rod.root", type="spherical"), "pin")
    found = at_rest(system)
    mass = 1000.0 * 0.05**2
    force = found.of("right", "force") + found.of("left", "force")
    assert force[0, 1] > 0.0
    pin = found.of("pin", "force")
    close((force + pin)[0], np.array([0.0, mass * g, -mass * along]), part=1e-6)
    close(found.of("right", "point_force").sum(axis=1), found.of("right", "normal_force"), part=1e-6)
    stored = 0.0
    for name in ("left", "right"):
        deep = np.maximum(-np.nan_to_num(found.of(name, "gap")), 0.0)
        stored = stored + found.of(name, "energy_elastic")
        assert found.of(name, "energy_elastic")[0] >= 0.5 * 2500.0 * np.sum(deep**2)
    close(stored, found.solution.balance.contact)


def test_layers() -> None:
    """A rod that lies on another one: its points' forces are the layer's normal force, half its weight."""
    import families.beams  # noqa: F401
    from families.case import CASES

    case = CASES["a layer on other turns"]()
    found = run(case.system(), case.times, "generalized-alpha", step=2e-3)
    force = found.of("layer", "point_force")
    close(force.sum(axis=1), found.of("layer", "normal_force"), part=1e-6)
    assert np.all((found.of("layer", "gap") < 0.0) == (force > 0.0))
    deep = np.maximum(-np.nan_to_num(found.of("layer", "gap")), 0.0)
    close(found.of("layer", "energy_elastic"), 0.5 * 20.0 * np.sum(deep**2, axis=1), part=1e-6)
    close(found.of("layer", "normal_force"), 20.0 * deep.sum(axis=1), part=1e-6)
