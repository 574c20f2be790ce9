"""Beams and cables against cylinders: bounces, pressing, the capstan, sticking, and how runs end."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import null_space

from book import Book
from evolvent import InputError, System, elements, parts
from evolvent.assembly.assembled import Assembly
from evolvent.families.contact.part import SLIDING_DAMPING
from evolvent.solvers import Solution
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit
from implicit.rigs import Equations, coordinates, momenta, run

Array = np.ndarray
K, SPEED, HIGH = 1e4, 1.0, 0.05


def bar(law: str, damping: float, *, modulus: float = 1e12, count: int = 1) -> Assembly:
    """A stiff bar of 1 kg that falls end on onto a cylinder, without gravity."""
    nodes, rates = np.zeros((count + 1, 2, 3)), np.zeros((count + 1, 2, 3))
    nodes[:, 0, 1], nodes[:, 1, 1] = np.linspace(1.1 + HIGH, 1.0 + HIGH, count + 1), -1.0
    rates[:, 0, 1] = -SPEED
    system = System()
    section = elements.Rectangle(thickness=0.1, width=0.1)
    material = elements.Material(young_modulus=modulus, poisson_ratio=0.0, density=1000.0)
    beam = parts.Beam(
        length=0.1, section=section, material=material, elements=count, formulation="cable", nodes=nodes, rates=rates
    )
    system.add(beam, "bar")
    system.add(
        parts.Contact(
            a="bar", b="ground", shape=parts.Cylinder(radius=1.0), law=law, stiffness=K, damping=damping, points=1
        )
    )
    return system.assemble()


def bounced(assembly: Assembly, samples: Any, **options: Any) -> Solution:
    """Solve by energy-momentum; the run must end well."""
    solution = solve_energy(assembly, samples=samples, **options)
    assert solution.success, solution.message
    return solution


def restitution(assembly: Assembly, solution: Solution) -> float:
    found = momenta(assembly, solution)[:, 1]
    return float(-found[-1] / found[0])


def hunt_crossley(d: float) -> float:
    """Restitution by the equation of motion x'' = -K x (1 + d x')."""

    def out(t: float, s: Array) -> float:
        return s[0]

    out.terminal, out.direction = True, -1.0  # type: ignore[attr-defined]
    found = solve_ivp(
        lambda t, s: [s[1], -K * s[0] * max(1.0 + d * s[1], 0.0)], (0.0, 1.0), [0.0, SPEED], "DOP853", events=out,
        rtol=1e-12, atol=1e-14,
    )  # fmt: skip
    return float(-found.y_events[0][0][1])


ZETA = 20.0 / (2.0 * math.sqrt(K))


@pytest.mark.parametrize(
    ("law", "damping", "expected"),
    [
        ("hunt-crossley", 0.0, 1.0),
        ("hunt-crossley", 0.5, hunt_crossley(0.5)),
        ("paper", 20.0, math.exp(-ZETA * math.pi / math.sqrt(1.0 - ZETA**2))),
        ("paper", 10.0, 0.854468),
    ],
)
def test_restitution(law: str, damping: float, expected: float, book: Book) -> None:
    assembly = bar(law, damping)
    solution = run(assembly, [0.0, 0.04, 0.15], tolerance=1e-10 if law == "paper" else 1e-8)
    before = 0.5 * SPEED**2
    assert solution.balance.by_contact[-1] == pytest.approx(before * (1.0 - expected**2), abs=2e-4)
    source = "SciPy DOP853, 1e-12" if law == "hunt-crossley" and damping else "closed form"
    book(
        "Contact", f"Bounce of a bar, law {law}, damping {damping:g}", reference=f"restitution {expected:.6f}",
        source=source, error=abs(restitution(assembly, solution) - expected), allowed=1e-4, unit="of the speed",
    )  # fmt: skip


CONTACT_TIME = math.pi / math.sqrt(K)


@pytest.mark.parametrize(("count", "part"), [(1, 0.1), (1, 0.5), (1, 3.0), (4, 3.0), (10, 1.0), (20, 0.5), (20, 1.0)])
def test_the_conservative_law_bounces_elastically_at_any_step(count: int, part: float, book: Book) -> None:
    """Of a stiff bar, whose own vibration no step resolves, at steps of a tenth to three times the time of contact."""
    assembly = bar("conservative", 0.0, count=count)
    solution = bounced(assembly, [0.0, 0.04, 1.0], step=part * CONTACT_TIME, spectral_radius=1.0)
    assert np.abs(solution.energy_defect).max() < 1e-4 * 0.5 * SPEED**2
    book(
        "Contact", f"Bounce of a bar of {count} elements, law conservative, step of {part:g} contact times",
        reference="restitution 1", source="closed form", error=abs(restitution(assembly, solution) - 1.0),
        allowed=1e-7, unit="of the speed",
    )  # fmt: skip


@pytest.mark.parametrize("modulus", [1e5, 1e6, 1e8])
@pytest.mark.parametrize("part", [0.2, 0.35, 0.5])
def test_an_elastic_bar_bounces_at_large_steps_without_gain(modulus: float, part: float) -> None:
    """From as soft as the contact to a thousand times as stiff; dissipation takes up to a tenth of the speed."""
    fine = bar("conservative", 0.0, modulus=modulus, count=4)
    exact = restitution(fine, bounced(fine, [0.0, 0.04, 0.15], step=2e-4, spectral_radius=0.9))
    assembly = bar("conservative", 0.0, modulus=modulus, count=4)
    solution = bounced(assembly, [0.0, 0.04, 0.4], step=part * CONTACT_TIME)
    assert solution.energy_defect.max() < 1e-9 * 0.5 * SPEED**2
    assert exact - 0.1 < restitution(assembly, solution) < exact + 0.01


def test_a_gain_at_the_very_end_fails_too() -> None:
    """A step of a tenth of what the contact bears gains a quarter of the energy, whenever the run ends."""
    for end in (0.09, 0.1, 0.2):
        solution = solve_implicit(bar("hunt-crossley", 0.0), samples=[0.0, end], step=0.01, spectral_radius=0.9)
        assert solution.status == "failed"
        assert "gained" in solution.message


def test_contact_forces_and_reactions_are_those_of_rest() -> None:
    """A bar pressed on a cylinder: normal force, reaction of its hinge and wrench of the ground, by the lever."""
    system = System()
    material = elements.Material(young_modulus=1e9, poisson_ratio=0.0, density=1000.0)
    section = elements.Rectangle(thickness=0.02, width=0.02)
    beam = parts.Beam(
        length=1.0,
        section=section,
        material=material,
        elements=8,
        formulation="cable",
        position=(-1.0, 1.0, 0.0),
        mass_damping=10.0,
    )
    system.add(beam, "bar")
    system.add(parts.Joint(a=(-1.0, 1.0, 0.0), b="bar.root", type="revolute"))
    system.add(
        parts.Contact(
            a="bar", b="ground", shape=parts.Cylinder(radius=1.0), law="conservative", stiffness=1e4, damping=1e3,
            points=1,
        )
    )  # fmt: skip
    system.add(parts.Load(at="bar[4]", force=(0.0, -5.0, 0.0), ramp=0.5))
    assembly = system.assemble()
    solution = bounced(assembly, [0.0, 0.8, 1.2], tolerance=1e-5)
    assert solution.forces["contact_surfaces"]["normal"][-1, 0] == pytest.approx(2.5, rel=5e-3)
    assert abs(solution.la[-1, 1]) == pytest.approx(2.5, rel=5e-3)
    assert solution.wrenches[-1, 0, 1] == pytest.approx(-5.0, rel=5e-3)


def dragged() -> Assembly:
    """A bar, held at its root, that a growing load presses on a turning drum."""
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=0.5), "drum")
    material = elements.Material(young_modulus=1e9, poisson_ratio=0.0, density=1000.0)
    section = elements.Rectangle(thickness=0.02, width=0.02)
    beam = parts.Beam(
        length=0.5,
        section=section,
        material=material,
        elements=1,
        formulation="cable",
        position=(-0.5, 1.0, 0.0),
        mass_damping=5.0,
    )
    system.add(beam, "bar")
    system.add(parts.Joint(a=(-0.5, 1.0, 0.0), b="bar.root", type="revolute"))
    system.add(
        parts.Contact(
            a="bar", b="drum", shape=parts.Cylinder(radius=1.0), stiffness=1e4, damping=1.0, points=1, friction=0.3,
            bristle_stiffness=1e4,
        )
    )  # fmt: skip
    system.add(parts.Load(at="bar.tip", force=(0.0, -5.0, 0.0), ramp=0.5))
    return system.assemble()


def test_the_account_of_a_sliding_point_closes() -> None:
    """What friction takes is mu N times the drum's way, with N as it grows; the account is open by h^2."""
    steps, opened = (2e-2, 1e-2, 5e-3), []
    for step in steps:
        solution = run(dragged(), np.linspace(0.0, 0.8, 9), step=step, spectral_radius=0.9)
        opened.append(np.abs(solution.energy_defect).max())
    way = 0.5 * (0.25 + 0.3)  # the load's ramp is half of it on average
    assert solution.balance.by_friction[-1] == pytest.approx(0.3 * 5.0 * way, rel=1e-3)
    assert solution.balance.drives[-1] == pytest.approx(0.3 * 5.0 * way, rel=1e-3)
    assert opened[-1] < 1e-6
    assert np.polyfit(np.log(steps), np.log(opened), 1)[0] == pytest.approx(2.0, abs=0.15)


@pytest.mark.parametrize("law", ["hunt-crossley", "paper"])
@pytest.mark.parametrize("step", [0.01, 0.05, 0.1])
def test_steps_far_too_large_for_the_contact_fail_and_say_so(law: str, step: float) -> None:
    solution = solve_implicit(bar(law, 0.0), samples=np.arange(0.0, 1.01, 0.05), step=step)
    kept = solution.energy_defect
    assert solution.status == "failed"
    assert "step" in solution.message
    assert "t = " in solution.message
    assert 2 <= kept.size == len(solution.y)


def test_a_beam_pressed_on_a_cylinder(book: Book) -> None:
    """It lies on as far as the moment reaches EI/R, which F does at the arm EI/(R F) from its end."""
    R, F, thickness = 5.0, 0.25, 0.01
    material = elements.Material(young_modulus=6e7, poisson_ratio=0.0, density=1000.0)
    section = elements.Rectangle(thickness=thickness, width=0.1)
    EI = 6e7 * 0.1 * thickness**3 / 12.0
    system = System()
    beam = parts.Beam(
        length=1.0,
        section=section,
        material=material,
        elements=40,
        formulation="cable",
        position=(0.0, R, 0.0),
        mass_damping=10.0,
    )
    system.add(beam, "beam")
    system.add(parts.Joint(a=(0.0, R, 0.0), b="beam.root", type="clamp"))
    system.add(
        parts.Contact(a="beam", b="ground", shape=parts.Cylinder(radius=R), stiffness=1e6, damping=0.1, points=5)
    )
    system.add(parts.Load(at="beam.tip", force=(0.0, -F, 0.0), ramp=0.5))
    assembly = system.assemble()
    solution = run(assembly, [0.0, 1.0, 3.0], tolerance=1e-5)
    points = solution.assembly.model.contact_points
    y = solution.y[-1]
    places = np.array([sum(c["S"][j] * y[c["iq"][j] : c["iq"][j] + 3] for j in range(4)) for c in points])
    force = points["force"]
    last = places[force > 0.0][-1, 0]
    near = places[:, 0] > last - 0.1  # the end's reaction is spread by what gives way
    end = float(force[near] @ places[near, 0] / force[near].sum())
    tip = coordinates(assembly, y, "beam")[-1, 0]
    on = math.asin(end / R) * R  # along the beam
    nodes = coordinates(assembly, y, "beam")[: int(0.8 * 40 * on), 1]
    angles = np.unwrap(np.arctan2(nodes[:, 1], nodes[:, 0]))
    curvature = -np.polyfit(np.arange(angles.size) / 40.0, angles, 1)[0]
    assert force[near].sum() == pytest.approx(F, rel=0.03)
    assert curvature == pytest.approx(1.0 / R, rel=0.01)
    assert F * (tip[0] - end) == pytest.approx(EI / R, rel=0.01)
    book(
        "Contact", "Beam pressed on a circle (cable, 40 elements): where contact ends", reference="L - EI/(P R)",
        source="closed form, Euler-Bernoulli", error=abs(F * (tip[0] - end) / (EI / R) - 1.0), allowed=0.01,
    )  # fmt: skip
    book(
        "Contact", "Beam pressed on a circle (cable, 40 elements): concentrated force there", reference="P",
        source="closed form, Euler-Bernoulli", error=abs(force[near].sum() / F - 1.0), allowed=0.03,
    )  # fmt: skip
    book(
        "Contact", "Beam pressed on a circle (cable, 40 elements): curvature", reference="1/R",
        source="closed form, Euler-Bernoulli", error=abs(curvature * R - 1.0), allowed=0.01,
    )  # fmt: skip


MU, BETA, RADIUS, TAIL = 0.3, 0.5 * math.pi, 0.1, 0.1


def capstan(
    *, turning: float = 0.0, pull: float | None = None, speed: float = 0.0, n: int = 48, **contact: float
) -> Assembly:
    """A thin cable round a quarter of a cylinder: 1 N along -y at its root; held, pulled or carried along -x."""
    length = BETA * RADIUS + 2.0 * TAIL
    nodes, s = np.zeros((n + 1, 2, 3)), np.linspace(0.0, length, n + 1)
    for k in range(n + 1):
        a = min(max((s[k] - TAIL) / RADIUS, 0.0), BETA)
        past = s[k] - TAIL - a * RADIUS
        nodes[k, 1, :2] = -math.sin(a), math.cos(a)
        nodes[k, 0, :2] = RADIUS * np.array([math.cos(a), math.sin(a)]) + past * nodes[k, 1, :2]
    system = System()
    if turning:
        system.add(parts.RigidBody(motion="driven", rate=turning), "drum")
    section = elements.Rectangle(thickness=5e-4, width=1e-2)
    material = elements.Material(young_modulus=1e8, poisson_ratio=0.0, density=1000.0)
    beam = parts.Beam(
        length=length,
        section=section,
        material=material,
        elements=n,
        formulation="cable",
        nodes=nodes,
        mass_damping=20.0,
    )
    system.add(beam, "cable")
    system.add(
        parts.Contact(
            a="cable", b="drum" if turning else "ground", shape=parts.Cylinder(radius=RADIUS), stiffness=1e5,
            points=2, friction=MU, bristle_stiffness=1e4, bristle_damping=1.0, **{"damping": 1.0} | contact,
        )
    )  # fmt: skip
    system.add(parts.Load(at="cable.root", force=(0.0, -1.0, 0.0), ramp=0.05))
    if pull is not None:
        system.add(parts.Load(at="cable.tip", force=(-pull, 0.0, 0.0), ramp=0.05))
    else:
        drive = parts.RampDrive(steps=((0.1, 0.05, speed),)) if speed else parts.ConstantDrive(rate=0.0)
        system.add(
            parts.Joint(a="ground", b="cable.tip", type="point-on-line", drive=drive, axis=(-1.0, 0.0, 0.0)), "hand"
        )
    return system.assemble()


@pytest.mark.slow
def test_capstan_pulled(book: Book) -> None:
    """Force ratio e^(mu beta); pulled so slowly that nothing else counts."""
    solution = run(capstan(speed=0.01), [0.0, 0.1, 0.5, 0.8], tolerance=1e-5)
    assert np.abs(solution.la[2:, 0]) == pytest.approx(math.exp(MU * BETA), rel=0.01)
    assert solution.balance.by_friction[-1] > 0.0
    book(
        "Contact", "Capstan, a quarter of a turn, cable pulled (48 elements)", reference="e^(mu beta)",
        source="closed form", error=np.abs(np.abs(solution.la[2:, 0]) / math.exp(MU * BETA) - 1.0).max(), allowed=0.01,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_turning_drum_drags_the_cable(way: float, book: Book) -> None:
    """The held end bears e^(mu beta) of the load where the drum turns away from it, else its inverse."""
    solution = run(capstan(turning=0.5 * way), [0.0, 0.5, 0.8], tolerance=1e-5)
    assert np.abs(solution.la[1:, 0]) == pytest.approx(math.exp(-way * MU * BETA), rel=0.01)
    book(
        "Contact", f"Capstan, the drum turns, {'towards' if way > 0 else 'away from'} the load",
        reference="e^(+- mu beta)", source="closed form",
        error=np.abs(np.abs(solution.la[1:, 0]) / math.exp(-way * MU * BETA) - 1.0).max(), allowed=0.01,
    )  # fmt: skip


def slipping_modes(assembly: Assembly, solution: Solution) -> Array:
    """Eigenvalues, 1/s, of the linear motion about the last state of a run, where all points that press slide on."""
    model, y = assembly.model, solution.y[-1]
    n_v, points = int(model.info.nv), model.contact_points
    bristles = np.linalg.norm(points["stick"], axis=1)[:, None]
    points["anchor"] -= 1e-3 * points["stick"] / np.where(bristles > 0.0, bristles, 1.0)  # backwards by 1 mm

    def tangent(c_mass: float, c_rate: float) -> Array:
        return Equations(assembly, solution.t[-1], y, np.zeros(n_v), c_mass, c_rate, 1e-6).tangent(solution.la[-1])

    K = tangent(0.0, 0.0)
    C, M, free = tangent(0.0, 1.0) - K, tangent(1.0, 0.0) - K, null_space(K[n_v:, :n_v])
    K, C, M = (free.T @ found[:n_v, :n_v] @ free for found in (K, C, M))
    zero, one = np.zeros_like(M), np.eye(len(M))
    return np.asarray(np.linalg.eigvals(np.block([[zero, one], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])))


@pytest.mark.slow
@pytest.mark.parametrize("n", [16, 24])
@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_damping_of_contact_points_takes_what_makes_sliding_vibrate(way: float, n: int) -> None:
    """Friction couples normal and axial modes of 40 to 75 krad/s, which grow unless they are damped."""
    growth = {}
    for share in (0.0, SLIDING_DAMPING):
        assembly = capstan(turning=0.5 * way, n=n, damping=0.0, sliding_damping=share)
        solution = run(assembly, [0.0, 0.4], tolerance=1e-4)
        modes = slipping_modes(solution.assembly, solution)
        growth[share] = modes[np.argmax(modes.real)]
    assert growth[0.0].real > 100.0
    assert 3e4 < abs(growth[0.0].imag) < 1e5
    assert growth[SLIDING_DAMPING].real < 0.02 * growth[0.0].real


@pytest.mark.slow
@pytest.mark.parametrize("solve", [solve_implicit, solve_energy])
def test_a_small_tolerance_does_not_make_friction_ring(solve: Any) -> None:
    """Without the damping, e^(mu beta) is off by 8 to 11 %, and the steps stay at 3 us.

    The mean over 0.2 s: the tension vibrates by 0.4 %, and is off by less than 1e-4.
    """
    solution = solve(capstan(turning=0.5, n=16), samples=[0.0, *np.linspace(0.2, 0.4, 401)], tolerance=1e-6)
    assert solution.success, solution.message
    assert np.abs(solution.la[1:, 0]).mean() == pytest.approx(math.exp(-MU * BETA), rel=1e-3)
    assert solution.statistics["steps"] < 80_000


@pytest.mark.slow
def test_what_sticks_does_not_creep(book: Book) -> None:
    assembly = capstan(pull=1.2)
    solution = run(assembly, [0.0, 1.0, 2.0, 10.0], tolerance=1e-5)
    places = coordinates(assembly, solution.y, "cable")[:, :, 0]
    assert np.abs(places[3] - places[2]).max() < 1e-7
    assert np.abs(places[3] - places[0])[:, :2].max() < 0.01
    book(
        "Contact", "Cable that sticks on a drum, 8 s", reference="no creep", source="closed form",
        error=np.abs(places[3] - places[2]).max(), allowed=1e-7, unit="m",
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ ends


@pytest.mark.parametrize("rho", [-0.1, 1.1, math.nan])
def test_a_spectral_radius_out_of_range_is_refused(rho: float) -> None:
    with pytest.raises(InputError, match="spectral_radius"):
        solve_implicit(bar("paper", 0.0), samples=[0.0, 1.0], spectral_radius=rho)


def test_an_interrupt_keeps_the_samples() -> None:
    def stop(t: float) -> None:
        raise KeyboardInterrupt

    solution = solve_implicit(bar("paper", 0.0), samples=np.linspace(0.0, 100.0, 100001), step=1e-3, progress=stop)
    assert solution.status == "interrupted"
    assert 1 <= solution.t.size < 100001
    assert solution.t.size == len(solution.y) == len(solution.balance)
    assert solution.t[-1] <= float(solution.message.split("t = ")[1].split(" s")[0]) + 1e-6


def test_adaptive_runs_land_on_samples_and_times() -> None:
    """States at samples are those of a run without the others."""
    few = run(bar("hunt-crossley", 0.5), [0.0, 0.3], tolerance=1e-7)
    many = run(
        bar("hunt-crossley", 0.5), [0.0, *np.sort(np.random.default_rng(3).uniform(0.0, 0.3, 50)), 0.3], tolerance=1e-7
    )
    assert np.abs(many.y[-1, :12] - few.y[-1, :12]).max() < 1e-4
    free = many.t < HIGH / SPEED
    assert np.abs(many.y[free, 1] - (1.1 + HIGH - SPEED * many.t[free])).max() < 1e-9
