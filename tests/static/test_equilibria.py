"""Equilibria against beam theory and other closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from elements.test_beam_theory import elastica
from evolvent import InputError, System, parts
from evolvent.elements import Material, Rectangle
from evolvent.kernels import rigid
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.plan import rows_of_part
from static.composing import EI, STEEL, STRIP, beam, nodes, solved, tip_force

# ------------------------------------------------------------------------------------------------ cantilevers


@pytest.mark.parametrize("formulation", ["assumed_strain", "elastic_line", "nu_split"])
def test_a_small_tip_load_bends_as_much_as_linear_curvature_lets_it(formulation, book):
    for n in (1, 2, 4, 8):
        a = beam(formulation, n, more=tip_force(0.0, 3e-6 * EI, 0.0))
        r = solved(solve_static(a))
        assert_allclose(nodes(a, r)[-1, 0, 1] / 1e-6, 1.0 - 0.25 / n**2, rtol=2e-5)
    book(
        "Statics of beams", f"Cantilever, small tip load ({formulation}, {n} elements)",
        reference="1 - 1/(4 n^2) of F L^3/3 EI", source="closed form",
        error=abs(nodes(a, r)[-1, 0, 1] / 1e-6 / (1.0 - 0.25 / n**2) - 1.0), allowed=2e-5,
    )  # fmt: skip


@pytest.mark.parametrize("formulation", ["cable", "cable_stretch"])
def test_a_cable_under_a_small_tip_load_is_exact_and_so_are_its_reactions_and_energy(formulation, book):
    a = beam(formulation, 3, more=tip_force(0.0, 3e-4 * EI, 0.0))
    r = solved(solve_static(a))
    assert_allclose(nodes(a, r)[-1, 0, 1], 1e-4, rtol=1e-5)
    book(
        "Statics of beams", f"Cantilever, small tip load ({formulation}, 3 elements)", reference="F L^3/3 EI",
        source="closed form", error=abs(nodes(a, r)[-1, 0, 1] / 1e-4 - 1.0), allowed=1e-5,
    )  # fmt: skip
    assert_allclose(r.la[-1][rows_of_part(a, "root")][:3], [0.0, 3e-4 * EI, 0.0], atol=1e-9 * EI)
    assert r.path.free == []
    assert r.path.factor[-1] == 1.0
    assert r.statistics["rejected_steps"] == 0
    a = beam(formulation, 16, more=tip_force(0.0, 3e-2 * EI, 0.0))
    r = solved(solve_static(a))
    assert_allclose([r.balance.elastic[-1], r.balance.bending[-1]], 0.5 * 3e-2 * EI * nodes(a, r)[-1, 0, 1], rtol=1e-3)


@pytest.mark.parametrize(("formulation", "count", "tolerance"), [("assumed_strain", 32, 1e-3), ("cable", 40, 3e-5)])
def test_a_large_tip_load_bends_to_an_elastica(formulation, count, tolerance, book):
    a = beam(formulation, count, more=tip_force(0.0, 10.0 * EI, 0.0))
    r = solved(solve_static(a, load_steps=[0.4]))
    tips = np.array([nodes(a, y)[-1, 0, :2] for y in r.y])
    assert_allclose(tips[r.path.factor == 0.4][0], elastica(4.0), atol=tolerance)
    assert_allclose(tips[-1], elastica(10.0), atol=tolerance)
    assert_allclose(tips[-1], (0.44500, 0.81061), atol=1e-3)  # Bisshopp & Drucker (1945)
    book(
        "Statics of beams", f"Elastica, P L^2/EI = 10 ({formulation}, {count} elements)",
        reference="tip 0.44500, 0.81061 L", source="shooting, SciPy; Bisshopp & Drucker 1945",
        error=np.abs(tips[-1] - elastica(10.0)).max(), allowed=tolerance, unit="L",
    )  # fmt: skip


@pytest.mark.parametrize(("formulation", "order"), [("assumed_strain", 2.0), ("cable", 4.0)])
def test_an_end_moment_rolls_a_strip_up_to_a_circle(formulation, order, book):
    def turned(system: System) -> None:
        system.add(parts.RigidBody(motion="free", mass=1.0, inertia=1.0, position=(1.0, 0.0, 0.0)), "grip")
        system.add(parts.Joint(a="grip", b="beam.tip", type="clamp"), "held")
        system.add(parts.Load(at="grip", torque=(0.0, 0.0, 2.0 * np.pi * EI)), "moment")
        if formulation == "cable":  # which knows no twist: nothing else holds the grip about its axis
            system.add(parts.Spring(a=(1.0, 0.0, 5.0), b="grip", stiffness=0.0, lateral_stiffness=0.0))

    gaps = []
    for n in (10, 20):
        a = beam(formulation, n, more=turned)
        r = solved(solve_static(a))
        gaps.append(np.linalg.norm(nodes(a, r)[-1, 0]))
    if formulation == "cable":
        assert_allclose(r.balance.elastic[-1], 0.5 * EI * (2.0 * np.pi) ** 2, rtol=1e-3)
        assert "grip" in r.path.free  # which a cable does not hold about its axis
    assert gaps[1] < (0.05 if formulation == "assumed_strain" else 1e-4)
    assert_allclose(np.log2(gaps[0] / gaps[1]), order, atol=0.4)
    book(
        "Statics of beams", f"Roll-up to a circle ({formulation}, 20 elements)", reference="tip back at the clamp",
        source="closed form", error=gaps[1], allowed=0.05 if formulation == "assumed_strain" else 1e-4, unit="L",
        order=np.log2(gaps[0] / gaps[1]), wanted=f"{order:g}",
    )  # fmt: skip


def princeton(load: float, angle: float, count: int = 8) -> np.ndarray:
    section = Rectangle(thickness=3.2024e-3, width=12.377e-3)
    a = beam(
        "assumed_strain", count, section=section, length=0.508,
        material=Material(young_modulus=71.7e9, poisson_ratio=0.31, density=2700.0),
        more=tip_force(0.0, load * np.sin(angle), load * np.cos(angle)),
    )  # fmt: skip
    return nodes(a, solved(solve_static(a)))[-1]


def test_the_princeton_beam(book):
    s, E, length, load = Rectangle(thickness=3.2024e-3, width=12.377e-3).properties(0.31), 71.7e9, 0.508, 13.345
    small = princeton(4.448e-3, np.pi / 4)[0]
    assert_allclose(small[1], 4.448e-3 * np.sin(np.pi / 4) * length**3 / (3 * E * s.Iz), rtol=0.01)
    assert_allclose(small[2], 4.448e-3 * np.cos(np.pi / 4) * length**3 / (3 * E * s.Iy), rtol=0.01)
    flat, edge, oblique = (princeton(load, a) for a in (np.pi / 2, 0.0, np.pi / 4))
    assert_allclose(flat[0][:2] / length, elastica(load * length**2 / (E * s.Iz)), atol=1e-3)
    assert_allclose(edge[0][2], load * length**3 / (3 * E * s.Iy), rtol=0.01)
    twist = np.degrees(np.arctan2(oblique[2][2], oblique[2][1]))
    assert 0.5 < abs(twist) < 6.0
    assert_allclose(oblique[0], princeton(load, np.pi / 4, count=16)[0], rtol=0.02)
    book(
        "Statics of beams", "Princeton beam, 13.345 N flatwise (assumed_strain, 8 elements)", reference="elastica",
        source="shooting, SciPy", error=np.abs(flat[0][:2] / length - elastica(load * length**2 / (E * s.Iz))).max(),
        allowed=1e-3, unit="L",
    )  # fmt: skip


@pytest.mark.slow
def test_a_deep_strip_buckles_sideways_at_the_load_of_theory(book):
    section = Rectangle(thickness=1e-3, width=5e-2)
    s = section.properties(STEEL.nu)
    unit = np.sqrt(STEEL.E * s.Iz * STEEL.shear_modulus * s.J)

    def lowest(factor: float) -> float:
        a = beam("assumed_strain", 32, section=section, more=tip_force(0.0, 0.0, -factor * unit))
        return modes(a, count=1).square[0]

    assert lowest(3.0) > 0.0 > lowest(4.5)
    book(
        "Statics of beams", "Lateral buckling (assumed_strain, 32 elements)", reference="4.0125993 sqrt(EI GJ)/L^2",
        source="closed form, Prandtl 1899", error=abs(brentq(lowest, 3.9, 4.1, xtol=1e-3) / 4.0125993 - 1.0),
        allowed=3e-3,
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ snapping

K, RISE, HALF = 1000.0, 0.2, 1.0
LIMIT = 4.5287174


def pyramid(load: float, below: float = 0.0):
    """Three springs from a circle to an apex, under a load; with a soft spring of that stiffness between them."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(0.0, 0.0, RISE)), "apex")
    for angle in 2.0 * np.pi * np.arange(3) / 3:
        system.add(parts.Spring(a=(HALF * np.cos(angle), HALF * np.sin(angle), 0.0), b="apex", stiffness=K))
    at = "apex"
    if below > 0.0:
        at = system.add(parts.Point(mass=1.0, position=(0.0, 0.0, RISE - 1.0)), "end")
        system.add(parts.Spring(a="apex", b="end", stiffness=below))
        system.add(parts.Spring(a=(0.0, 0.0, -5.0), b="end", lateral_stiffness=10.0, axis=(0.0, 0.0, 1.0)))
    system.add(parts.Load(at=at, force=(0.0, 0.0, -load)))
    return system.assemble()


def load_at(z):
    length = np.hypot(HALF, z)
    return 3.0 * K * (np.hypot(HALF, RISE) - length) / length * z


def test_the_arc_goes_through_the_limits_of_load(book):
    r = solved(solve_static(pyramid(4.0 * LIMIT), arc_length=True, load_steps=50))
    z = r.y[:, 2]
    assert_allclose(4.0 * LIMIT * r.path.factor, load_at(z), atol=1e-9 * LIMIT)
    assert_allclose([r.path.factor[z > 0.0].max(), r.path.factor.min()], [0.25, -0.25], atol=2e-3)
    assert r.path.factor[-1] == 1.0
    assert z[-1] < -RISE
    assert np.all(np.diff(z) < 0.0)
    assert_allclose(r.balance.elastic, 1.5 * K * (np.hypot(HALF, z) - np.hypot(HALF, RISE)) ** 2, rtol=1e-9, atol=1e-20)
    book(
        "Statics of beams", "Snapping of three springs, arc length", reference="load of every point on the path",
        source="closed form", error=np.abs(4.0 * r.path.factor - load_at(z) / LIMIT).max(), allowed=1e-9,
        unit="limit load",
    )  # fmt: skip


def test_the_arc_goes_through_snap_back(book):
    soft = 5.0
    r = solved(solve_static(pyramid(4.0 * LIMIT, soft), arc_length=True, load_steps=50))
    apex, end = r.y[:, 2], r.y[:, 5]
    assert_allclose(4.0 * LIMIT * r.path.factor, load_at(apex), atol=1e-9 * LIMIT)
    assert_allclose(apex - end - 1.0, load_at(apex) / soft, atol=1e-9)
    assert np.diff(end).max() > 0.01  # the end goes back while the apex goes on
    assert r.statistics["steps"] < 400
    book(
        "Statics of beams", "Snap-back behind a soft spring, arc length", reference="load of every point on the path",
        source="closed form", error=np.abs(4.0 * r.path.factor - load_at(apex) / LIMIT).max(), allowed=1e-9,
        unit="limit load",
    )  # fmt: skip


def test_load_steps_slide_past_a_limit_to_what_holds():
    r = solved(solve_static(pyramid(1.5 * LIMIT)))
    z = brentq(lambda z: load_at(z) - 1.5 * LIMIT, -2.0 * RISE, -RISE)
    assert_allclose(r.y[-1, :3], [0.0, 0.0, z], atol=1e-9)
    assert "moved to another equilibrium" in r.message
    assert r.statistics["slides"] == 1


# ------------------------------------------------------------------------------------------------ cables and bars


def test_a_hanging_chain_is_a_catenary(book):
    section, length, span, n = Rectangle(thickness=1e-3, width=1e-3), 1.3, 1.0, 40
    # starts as a circular arc of that length
    half = brentq(lambda b: length * np.sin(b) / b - span, 0.1, 3.0)
    radius, angle = 0.5 * length / half, np.linspace(-half, half, n + 1)
    start = np.zeros((n + 1, 2, 3))
    start[:, 0, 0], start[:, 0, 2] = 0.5 * span + radius * np.sin(angle), radius * (np.cos(half) - np.cos(angle))
    start[:, 1, 0], start[:, 1, 2] = np.cos(angle), np.sin(angle)
    a = beam(
        "cable", n, ("spherical", "spherical"), section=section, length=length,
        material=Material(young_modulus=1e8, poisson_ratio=0.3, density=1e4),
        gravity=(0.0, 0.0, -9.81), nodes=start,
    )  # fmt: skip
    r = solved(solve_static(a))
    c = brentq(lambda c: 2.0 * c * np.sinh(0.5 * span / c) - length, 0.05, 5.0)
    place = nodes(a, r)[:, 0]
    depth = c * np.cosh(0.5 * span / c) - c * np.cosh((place[:, 0] - 0.5 * span) / c)
    assert_allclose(-place[:, 2], depth, atol=2e-3 * length)
    weight = 1e4 * 1e-6 * 9.81
    assert_allclose(r.la[-1][rows_of_part(a, "root")], [weight * c, 0.0, -0.5 * weight * length], atol=0.01 * weight)
    book(
        "Statics of beams", "Catenary (cable, 40 elements, with its bending stiffness)",
        reference="shape of a perfect chain", source="closed form", error=np.abs(-place[:, 2] - depth).max() / length,
        allowed=2e-3, unit="L",
    )  # fmt: skip


def test_a_bar_stretches_under_its_turn(book):
    section, material, rate = (
        Rectangle(thickness=0.02, width=0.02),
        Material(young_modulus=7e5, poisson_ratio=0.3, density=1000.0),
        0.5,
    )
    a = beam("cable", 8, section=section, material=material)
    r = solved(solve_static(a, rotating=(0.0, 0.0, rate)))
    assert_allclose(nodes(a, r)[-1, 0, 0] - 1.0, 1000.0 * rate**2 / (3.0 * 7e5), rtol=1e-3)
    # velocities are those of the turn
    n_q = int(a.model.info.nq)
    assert_allclose(r.y[-1, n_q + 48 : n_q + 51], [0.0, rate * nodes(a, r)[-1, 0, 0], 0.0], atol=1e-12)
    book(
        "Statics of beams", "Bar that turns, small strain (cable, 8 elements)", reference="rho W^2 L^3/3 E",
        source="closed form", error=abs((nodes(a, r)[-1, 0, 0] - 1.0) / (1000.0 * rate**2 / (3.0 * 7e5)) - 1.0),
        allowed=1e-3,
    )  # fmt: skip


def test_a_cantilever_leans_on_a_cylinder(book):
    section, material = (
        Rectangle(thickness=0.01, width=0.02),
        Material(young_modulus=1e9, poisson_ratio=0.3, density=1000.0),
    )

    def prop(system: System) -> None:
        # under the tip: only its last contact point touches
        system.add(
            parts.Contact(
                a="beam", b=(1.0, 0.0, -0.05), shape=parts.Cylinder(radius=0.05, axis=(0.0, 1.0, 0.0)),
                stiffness=1e6, points=1,
            ), "prop",
        )  # fmt: skip

    a = beam("cable", 8, section=section, material=material, gravity=(0.0, 0.0, -9.81), more=prop)
    r = solved(solve_static(a))
    weight = 1000.0 * 2e-4 * 9.81
    # 3/8 of a propped cantilever's load
    assert_allclose(r.forces["contact_surfaces"]["normal"][-1, 0], 0.375 * weight, rtol=3e-3)
    assert_allclose(r.la[-1][rows_of_part(a, "root")][2], -0.625 * weight, rtol=3e-3)
    assert r.forces["contact_surfaces"]["touching"][-1, 0] == 1.0
    book(
        "Contact", "Propped cantilever under its weight, by contact", reference="3/8 of the weight",
        source="closed form", error=abs(r.forces["contact_surfaces"]["normal"][-1, 0] / (0.375 * weight) - 1.0),
        allowed=3e-3,
    )  # fmt: skip


def test_a_body_hangs_from_springs_that_hold_it_sideways_only_when_pulled():
    system = System(gravity=(0.0, -9.80665, 0.0))
    system.add(parts.RigidBody(motion="free", mass=15190.0, inertia=(3703.0, 43920.0, 43920.0)), "body")
    for x, z in ((2.0, 0.9), (2.0, -0.9), (-2.0, -0.9), (-2.0, 0.9)):
        system.add(parts.Spring(a=(x, 0.5, z), b=("body", (x, 0.0, z)), stiffness=740250.0, length=0.5))
    r = solved(solve_static(system.assemble()))
    assert_allclose(r.y[-1, :3], [0.0, -15190.0 * 9.80665 / 4 / 740250.0, 0.0], atol=1e-12)
    assert r.statistics["slides"] == 0


def test_cables_and_beams_stand_in_one_model():
    system = System()
    for name, y0, formulation in (("thin", 0.0, "cable"), ("whole", 1.0, "assumed_strain")):
        system.add(
            parts.Beam(
                length=1.0, section=STRIP, material=STEEL, elements=4, formulation=formulation, position=(0.0, y0, 0.0)
            ),
            name,
        )
        system.add(parts.Joint(a=(0.0, y0, 0.0), b=f"{name}.root", type="clamp"))
        system.add(parts.Load(at=f"{name}.tip", force=(0.0, 3e-4 * EI, 0.0)))
    a = system.assemble()
    r = solved(solve_static(a))
    assert_allclose(nodes(a, r, "thin")[-1, 0, 1], 1e-4, rtol=1e-5)
    assert_allclose(nodes(a, r, "whole")[-1, 0, 1] - 1.0, 1e-4 * (1.0 - 0.25 / 16), rtol=1e-5)


@pytest.mark.parametrize(("formulation", "ways"), [("cable", 2), ("assumed_strain", 1)])
def test_a_strut_beyond_the_load_of_euler_is_told_to_be_unstable(formulation, ways):
    for part, wanted in ((0.99, 0), (1.02, ways)):
        r = solved(solve_static(beam(formulation, 12, more=tip_force(-0.25 * np.pi**2 * EI * part, 0.0, 0.0))))
        assert r.path.unstable == wanted
        assert ("unstable" in r.message) == (wanted > 0)


@pytest.mark.parametrize("start", [(0.0, -0.5), (0.35, -0.35)])
def test_what_gravity_holds_is_not_named_as_free(start):
    """A pendulum has stiffness by its weight alone; a wheel beside it, which a torque turns, has none."""
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.1), position=(start[0], 0.0, start[1])), "bob")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="revolute", axis=(0.0, 1.0, 0.0)), "pin")
    system.add(parts.RigidBody(motion="spin", inertia=1.0, axis=(0.0, 1.0, 0.0), position=(0.0, 3.0, 0.0)), "wheel")
    a = solved(solve_static(system.assemble()))
    assert_allclose(np.linalg.norm(a.y[-1][:2]), 0.0, atol=1e-9)  # below its pin
    assert a.message.endswith("nothing holds 'wheel' against one motion")
    system.add(parts.Load(at="wheel", torque=(0.0, 1.0, 0.0)), "push")
    r = solve_static(system.assemble())
    assert not r.success
    assert r.path.free == ["wheel"]
    assert r.message == "nothing holds 'wheel' against one motion, on which 'push' acts at t = 0 s (argument `time`)"


def test_slopes_do_not_turn_over():
    # a soft cable on a fast hub stretches by more than half; its root's slope could flip under the clamp
    section, material = (
        Rectangle(thickness=3e-4, width=0.03),
        Material(young_modulus=5e6, poisson_ratio=0.3, density=1600.0),
    )
    a = beam("cable_stretch", 40, section=section, material=material, length=12.0, gravity=(0.0, 0.0, -9.81))
    r = solved(solve_static(a, rotating=(0.0, 0.0, 4.0)))
    assert r.path.unstable == 0
    assert np.all(np.diff(nodes(a, r)[:, 0, 0]) > 0.0)
    assert np.all(nodes(a, r)[:, 1, 0] > 0.0)


# ------------------------------------------------------------------------------------------------ what is refused


def test_what_nothing_holds_is_named():
    loose = solve_static(beam("assumed_strain", 4, ()))
    assert loose.success
    assert loose.path.free == ["beam"]
    assert "nothing holds 'beam' against 6 motions" in loose.message
    falls = solve_static(beam("assumed_strain", 4, (), gravity=(0.0, 0.0, -9.81)))
    assert falls.status == "failed"
    assert "nothing holds 'beam' against 6 motions" in falls.message
    assert falls.path.factor.tolist() == [0.0]  # where it stood
    hangs = solve_static(beam("assumed_strain", 4, ("spherical",), gravity=(0.0, 0.0, -9.81)))
    assert hangs.success
    assert hangs.y[-1, 12 * 4 + 2] < -0.99  # it swings down


def test_redundant_joints_are_named_and_share_what_they_carry():
    def twice(system: System) -> None:
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root"), "again")

    once, found = solve_static(beam("cable", 4)), solve_static(beam("cable", 4, more=twice))
    assert found.success
    assert "constraints are independent, those of 'again'" in found.message
    assert found.y[-1] == pytest.approx(once.y[-1], abs=1e-8)
    assert found.statistics["constraints"] - found.statistics["rank"] == 3
    first, again = found.la[-1, :3], found.la[-1, -3:]
    assert first == pytest.approx(again, rel=1e-6, abs=1e-9)
    assert first + again == pytest.approx(once.la[-1, :3], rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"load_steps": 0}, "load_steps is 0"),
        ({"load_steps": [0.5, 0.2]}, "load_steps is"),
        ({"load_steps": [0.5, 1.5]}, "load_steps is"),
        ({"tolerance": 0.0}, "tolerance is 0.0"),
        ({"time": float("nan")}, "time is nan"),
        ({"y": [1.0]}, "y has the shape"),
        ({"rotating": (1.0, 2.0)}, "rotating is"),
        ({"rotating": (1.0, 0.0, 0.0)}, "gravity .* is not along the axis"),
        ({"rotating": "hub"}, "only a driven body's turn"),
        ({"rotating": (0.0, 0.0, 1.0)}, "the axis of 'hub' is not along"),
    ],
)
def test_bad_arguments(options, told):
    def hub(system: System) -> None:
        system.add(parts.RigidBody(motion="spin", inertia=1.0, axis=(1.0, 0.0, 0.0)), "hub")

    a = beam("cable", 2, gravity=(0.0, 0.0, -9.81), more=hub)
    assert a.model.bodies["motion"][a.index("hub", "bodies")] == rigid.SPIN
    with pytest.raises(InputError, match=told):
        solve_static(a, **options)


def test_a_search_that_takes_too_long_is_given_up():
    r = solve_static(beam("cable", 8, more=tip_force(0.0, 10.0 * EI, 0.0)), most_steps=3)
    assert r.status == "failed"
    assert "3 steps were not enough" in r.message
    assert 0.0 < r.path.factor[-1] < 1.0
