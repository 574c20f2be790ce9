"""Capstan, bounce and pressing against closed forms."""

from __future__ import annotations

import math

from book import Book
from evolvent import System, parts
from evolvent.elements import Material, Rectangle
from evolvent.kernels import contact_laws
from evolvent.solvers.static.static import solve_static

CHAPTER = "Contact"


def test_capstan_of_sixteen_nodes(book: Book) -> None:
    """Nodes of equal turn d about to slip: each passes on (cos d/2 + mu sin d/2)/(cos d/2 - mu sin d/2)."""
    mu, n = 0.3, 16
    half, tension = 0.5 * math.pi / n, 1.0
    for _ in range(n):
        following = tension
        for _ in range(100):
            normal = (tension + following) * math.sin(half)
            force = contact_laws.friction((0.0, 0.0, 0.0), (-0.1, 0.0, 0.0), normal, mu, 1e4, 0.0, 0.1)[0][0]
            following = tension + force / math.cos(half)
        tension = following
    book(
        CHAPTER, "Capstan, half a turn on 16 nodes, mu 0.3 (kernel)", reference="ratio 2.5748538568",
        source="closed form", error=abs(tension / 2.5748538568 - 1.0), allowed=1e-9,
    )  # fmt: skip


def test_a_tip_moment_lays_a_strip_on_a_circle(book: Book) -> None:
    """A moment of EI/R bends a strip to the circle of radius R that it is tangent to, which then need not push."""
    radius, section, material = (
        0.5,
        Rectangle(thickness=1e-3, width=2e-2),
        Material(young_modulus=2e11, poisson_ratio=0.3, density=7800.0),
    )
    moment = material.E * section.properties(0.3).Iz / radius
    force = []
    for part in (1.0, 1.05):
        system = System()
        strip = parts.Beam(
            length=1.0,
            section=section,
            material=material,
            elements=24,
            formulation="cable",
            position=(0.0, radius, 0.0),
        )
        system.add(strip, "strip")
        system.add(parts.Joint(a=(0.0, radius, 0.0), b="strip.root", type="clamp"))
        system.add(parts.RigidBody(mass=1.0, inertia=1.0, position=(1.0, radius, 0.0)), "grip")
        system.add(parts.Joint(a="grip", b="strip.tip", type="clamp"))
        system.add(parts.Load(at="grip", torque=(0.0, 0.0, -part * moment)))
        system.add(parts.Spring(a=(1.0, radius, 5.0), b="grip", stiffness=0.0, lateral_stiffness=0.0))
        system.add(parts.Contact(a="strip", b="ground", shape=parts.Cylinder(radius=radius), stiffness=1e4, points=4))
        r = solve_static(system.assemble())
        assert r.success, r.message
        force.append(r.forces["contact_surfaces"]["normal"][-1, 0] / (moment / radius))
    assert force[1] > 50.0 * force[0]  # what is more than that presses
    book(
        CHAPTER, "Strip laid on a circle by a tip moment (cable, 24 elements)", reference="no force at M = EI/R",
        source="closed form", error=force[0], allowed=2e-3, unit="M/R",
    )  # fmt: skip


def test_bounce(book: Book) -> None:
    """m 1, k 1e4, c 10 by the law that may pull: a damped oscillator for half a swing, or until its force is zero."""
    k, c = 1e4, 10.0
    ratio = c / (2.0 * math.sqrt(k))
    w = math.sqrt(k) * math.sqrt(1.0 - ratio**2)
    for case, wanted, end in (
        ("no gap", 0.854468, math.pi / w),
        ("no force", 0.858758, (math.pi - 2.0 * math.asin(ratio)) / w),
    ):
        n = 2000
        h, gap, speed = end / n, -1e-300, -1.0

        def slope(g: float, v: float) -> float:
            return contact_laws.normal_force(contact_laws.PAPER, min(g, -1e-300), v, 0.0, k, 1.0, c, 0.0)[0]

        for _ in range(n):
            k1, l1 = speed, slope(gap, speed)
            k2, l2 = speed + 0.5 * h * l1, slope(gap + 0.5 * h * k1, speed + 0.5 * h * l1)
            k3, l3 = speed + 0.5 * h * l2, slope(gap + 0.5 * h * k2, speed + 0.5 * h * l2)
            k4, l4 = speed + h * l3, slope(gap + h * k3, speed + h * l3)
            gap += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            speed += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4)
        left = gap if case == "no gap" else slope(gap, speed)
        assert abs(left) < 1e-4
        book(
            CHAPTER, f"Bounce on a spring and damper, leaving at {case} (kernel)", reference=f"restitution {wanted}",
            source="closed form", error=abs(speed / wanted - 1.0), allowed=1e-6,
        )  # fmt: skip
