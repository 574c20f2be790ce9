"""Users' laws between places: equal to the springs that they rebuild, balances that close, refusals."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
import pytest

from evolvent import InputError, System, law, parts
from evolvent.results.observe import observe
from evolvent.solvers import Solution, solve
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.plan import solve_implicit
from evolvent_base import units
from families.lumped import tie
from implicit.test_body_hinges import METHODS, integrated
from implicit.test_tangent import beam, bodies, disturbed, worst

Array = np.ndarray


@law
def spring(t, x, v, p, f):  # type: ignore[no-untyped-def]
    """Stiffness, damping and length of a spring between two points."""
    dx, dy, dz = x[3] - x[0], x[4] - x[1], x[5] - x[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    ex, ey, ez = dx / length, dy / length, dz / length
    rate = ex * (v[3] - v[0]) + ey * (v[4] - v[1]) + ez * (v[5] - v[2])
    tension = p[0] * (length - p[2]) + p[1] * rate
    f[0], f[1], f[2] = tension * ex, tension * ey, tension * ez
    f[3], f[4], f[5] = -tension * ex, -tension * ey, -tension * ez
    return 0.5 * p[0] * (length - p[2]) ** 2, p[1] * rate * rate


@law
def membrane(t, x, v, p, f):  # type: ignore[no-untyped-def]
    """A triangle that resists changes of its area: c (A - A0)^2/2."""
    ax, ay, az = x[3] - x[0], x[4] - x[1], x[5] - x[2]
    bx, by, bz = x[6] - x[0], x[7] - x[1], x[8] - x[2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    twice = math.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / twice, ny / twice, nz / twice
    off = 0.5 * twice - p[1]
    s = 0.5 * p[0] * off
    # dA/db = n x a/2, dA/da = b x n/2
    f[3], f[4], f[5] = -s * (by * nz - bz * ny), -s * (bz * nx - bx * nz), -s * (bx * ny - by * nx)
    f[6], f[7], f[8] = -s * (ny * az - nz * ay), -s * (nz * ax - nx * az), -s * (nx * ay - ny * ax)
    for c in range(3):
        f[c] = -f[3 + c] - f[6 + c]
    return 0.5 * p[0] * off * off, 0.0


def connected(law: bool, *, gravity: float = 0.0) -> System:
    """Two bodies and a point, joined by springs or by laws that say the same."""
    system = System(gravity=(0.0, 0.0, -gravity))
    system.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.2, 0.3)), "hub")
    system.add(
        parts.RigidBody(mass=1.0, inertia=(0.1, 0.2, 0.3), position=(2.0, 0.0, 0.0), angular_velocity=(0.0, 0.2, 1.0)),
        "panel",
    )
    system.add(parts.RigidBody(motion="spin", inertia=0.4, position=(1.0, 1.0, 0.0)), "wheel")
    system.add(parts.Point(mass=0.5, position=(1.0, -1.0, 0.5)), "mass")
    ends: list[tuple[Any, Any, float]] = [
        (("hub", (0.0, 0.2, 0.0)), ("panel", (0.0, 0.3, 0.1)), 1.5),
        (("hub", (0.3, 0.0, 0.1)), "mass", 1.0),
        ("mass", (1.0, -2.0, 0.0), 0.8),
        (("wheel", (0.3, 0.1, 0.0)), "panel", 1.2),
    ]
    for k, (a, b, length) in enumerate(ends):
        if law:
            system.add(parts.CustomForce(points=[a, b], law=spring, parameters=(50.0, 0.3, length)), f"spring {k}")
        else:
            system.add(parts.Spring(a=a, b=b, stiffness=50.0, damping=0.3, length=length), f"spring {k}")
    return system


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rk4", "dopri5", "alpha-step"])
def test_equal_to_springs(method: str) -> None:
    times = np.linspace(0.0, 1.0, 5)
    plain, own = (integrated(connected(law).assemble(), times, method) for law in (False, True))
    n = int(plain.assembly.model.info.nq + plain.assembly.model.info.nv)
    assert np.abs(own.y[:, :n] - plain.y[:, :n]).max() < (1e-10 if method == "alpha-step" else 1e-12)
    assert own.energy == pytest.approx(plain.energy, rel=1e-10)
    assert np.abs(own.energy_defect).max() < 1e-4 * own.energy[0]
    for name in (f"spring {k}" for k in range(4)):
        a, b = (observe(found)[name].variables for found in (plain, own))
        x, f = b["position"].values, b["force"].values
        along = (x[:, 1] - x[:, 0]) / np.linalg.norm(x[:, 1] - x[:, 0], axis=1)[:, None]
        assert np.einsum("ij,ij->i", f[:, 0], along) == pytest.approx(a["force"].values, rel=1e-8, abs=1e-8)
        assert np.abs(f[:, 0] + f[:, 1]).max() < 1e-12
        assert b["energy_elastic"].values == pytest.approx(25.0 * a["extension"].values ** 2, rel=1e-8, abs=1e-9)


def test_modes_equal_to_those_of_springs() -> None:
    a, b = (modes(connected(law).assemble(), count=16) for law in (False, True))
    assert a.square[-1] > 100.0
    assert b.square == pytest.approx(a.square, rel=1e-8, abs=1e-6)
    a, b = (modes(connected(law).assemble(), count=16, damped=True) for law in (False, True))
    moving = np.abs(a.pole) > 0.1
    assert moving.sum() == 4  # one a spring, at rest
    assert b.pole[moving] == pytest.approx(a.pole[moving], rel=1e-7)


def test_a_force_on_a_beams_tip() -> None:
    """A cantilever and a spring without length pull on its tip: k d/(k + 3 E I/L^3)."""
    k, d, EI = 0.1, 1e-3, 2e6 * 0.02**4 / 12.0
    system = System()
    system.add(beam("cable"), "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="clamp"), "root")
    system.add(parts.CustomForce(points=["beam.tip", (1.0, d, 0.0)], law=tie, parameters=(k,)), "tie")
    found = solve_static(system.assemble())
    assert found.success, found.message
    force = observe(found)["tie"].variables["force"].values[-1]
    sunk = k * d / (k + 3.0 * EI)
    assert observe(found)["tie"].variables["position"].values[-1, 0] == pytest.approx([1.0, sunk, 0.0], abs=1e-6)
    assert force[0] == pytest.approx([0.0, k * (d - sunk), 0.0], abs=1e-7)


@pytest.mark.slow
def test_tangent_against_differences(rng: np.random.Generator) -> None:
    """Points of every kind: bodies of all motions, points, a beam's node, the ground."""
    system = System()
    bodies(system)
    system.add(beam("cable", position=(0.3, -0.2, 0.1)), "cable")
    system.add(beam("assumed_strain", position=(1.0, 1.0, 0.0)), "beam")
    points: list[Any] = [("free", (0.1, 0.3, -0.2)), "cable[1]", ("spin", (0.3, 0.2, 0.1))]
    system.add(parts.CustomForce(points=points, law=membrane, parameters=(300.0, 0.1)))
    system.add(
        parts.CustomForce(
            points=["point", "beam.tip", ("driven", (0.2, 0.1, 0.0))], law=membrane, parameters=(300.0, 0.1)
        )
    )
    system.add(parts.CustomForce(points=["free", (1.0, 2.0, 3.0)], law=spring, parameters=(200.0, 0.0, 1.0)))
    assert worst(disturbed(system.assemble(), rng), np.zeros(0)) < 1e-7


def triangle() -> System:
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(0.1, 0.2, 0.15), angular_velocity=(0.5, 0.2, -0.4)), "hub")
    system.add(parts.Point(mass=0.5, position=(1.5, 0.1, 0.0), velocity=(0.0, 0.5, 0.3)), "p")
    system.add(parts.Point(mass=0.7, position=(0.3, 1.2, 0.2), velocity=(0.4, 0.0, -0.2)), "q")
    system.add(
        parts.CustomForce(points=[("hub", (0.2, 0.1, 0.0)), "p", "q"], law=membrane, parameters=(40.0, 0.5)), "skin"
    )
    return system


def test_forces_are_those_of_the_energy(rng: np.random.Generator) -> None:
    x, f, g = rng.standard_normal(9), np.zeros(9), np.zeros(9)
    p, v, h = np.array([40.0, 0.5]), np.zeros(9), 1e-6
    membrane(0.0, x, v, p, f)
    for k in range(9):
        e = np.eye(9)[k] * h
        slope = (membrane(0.0, x + e, v, p, g)[0] - membrane(0.0, x - e, v, p, g)[0]) / (2.0 * h)
        assert f[k] == pytest.approx(-slope, rel=1e-6, abs=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_a_membrane_keeps_energy_and_momentum(method: str) -> None:
    solution, allowed = integrated(triangle().assemble(), np.linspace(0.0, 2.0, 9), method), METHODS[method][1]
    assert np.ptp(solution.balance.kinetic) > 0.1 * solution.energy[0]
    assert np.abs(solution.energy_defect).max() < 20.0 * allowed * solution.energy[0]
    assert np.abs(solution.momentum.drift_linear).max() < 1e-10
    assert np.abs(solution.momentum.drift_angular[-1]).max() < (1e-9 if "alpha" in method else 10.0 * allowed)
    assert np.abs(solution.momentum.drift_angular).max() < (1e-9 if method == "alpha-step" else 1e-5)


def test_explicit_and_implicit_agree() -> None:
    exact = integrated(triangle().assemble(), np.linspace(0.0, 1.0, 3), "dopri5")
    n = int(exact.assembly.model.info.nq)
    for method in ("alpha-step", "alpha-tolerance"):
        found = integrated(triangle().assemble(), np.linspace(0.0, 1.0, 3), method)
        assert np.abs(found.y[:, :n] - exact.y[:, :n]).max() < 1e-4


@law
def push(t, x, v, p, f):  # type: ignore[no-untyped-def]
    """A force that follows the point's velocity and gives it energy."""
    power = 0.0
    for c in range(3):
        f[c] = p[0] * v[c]
        power -= f[c] * v[c]
    return 0.0, power


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_law_that_gives_energy(method: str) -> None:
    """v = v0 exp(k t/m); what it gives is a loss below zero, so that the balance closes."""
    system = System()
    system.add(parts.Point(mass=2.0, velocity=(1.0, 0.0, 0.0)), "mass")
    system.add(parts.CustomForce(points=["mass"], law=push, parameters=(1.0,)), "push")
    solution = integrated(system.assemble(), [0.0, 1.0], method)
    grown = math.exp(0.5)
    assert solution.y[-1, 3] == pytest.approx(grown, rel=20.0 * METHODS[method][1])
    assert solution.balance.by_springs[-1] == pytest.approx(1.0 - grown**2, rel=20.0 * METHODS[method][1])


# ------------------------------------------------------------------------------------------------ parts from outside


class Tie(parts.CustomForce):
    """A spring between two points whose length is that of the start."""

    kind: Literal["tie"] = "tie"  # type: ignore[assignment]
    stiffness: units.Stiffness

    def law_and_parameters(self, positions: Array) -> tuple[Any, tuple[float, ...]]:
        return spring, (self.stiffness, 0.0, float(np.linalg.norm(positions[1] - positions[0])))


def test_a_part_from_outside() -> None:
    system = System()
    system.add(parts.Point(mass=2.0, position=(1.0, 0.0, 0.0)), "mass")
    system.add(Tie(points=[(0.0, 0.0, 0.0), "mass"], stiffness="8 N/m"), "tie")
    assert list(Tie(points=["mass", ("hub", (0.0, 0.0, 1.0))], stiffness=1.0).references()) == ["mass", "hub"]
    frequency = modes(system.assemble(), count=3).frequency
    assert frequency[-1] == pytest.approx(2.0, rel=1e-9)


# ------------------------------------------------------------------------------------------------ refusals


@law
def too_far(t, x, v, p, f):  # type: ignore[no-untyped-def]
    f[7] = 1.0
    return 0.0, 0.0


@law
def not_finite(t, x, v, p, f):  # type: ignore[no-untyped-def]
    f[0] = p[0] / (x[0] - x[0])
    return 0.0, 0.0


@law
def late(t, x, v, p, f):  # type: ignore[no-untyped-def]
    if t > 0.5:
        raise ValueError("the table ends")
    return 0.0, 0.0


def held(**fields: Any) -> System:
    system = System()
    system.add(parts.Point(mass=1.0), "mass")
    system.add(parts.CustomForce(**fields), "element")
    return system


@pytest.mark.slow
def test_bad_laws() -> None:
    for one, parameters, words in (
        (too_far, (), r"'element' at t = 0 s: the law 'too_far' \(.*\) fails: IndexError: .*; 0 parameters are given"),
        (spring, (), r"'element' at t = 0 s: the law 'spring' .* fails: .*0 parameters are given"),
        (not_finite, (1.0,), r"the law 'not_finite' .* writes \[.*\] to f; forces must be finite numbers"),
    ):
        system = held(points=["mass", (1.0, 0.0, 0.0)], law=one, parameters=parameters)
        for run in (
            lambda system=system: solve(system.assemble(), samples=[0.0, 1.0], method="dopri5"),
            lambda system=system: solve_implicit(system.assemble(), samples=[0.0, 1.0]),
            lambda system=system: solve_static(system.assemble()),
        ):
            with pytest.raises(InputError, match=words):
                run()


@pytest.mark.parametrize("method", METHODS)
def test_a_law_that_raises_later(method: str) -> None:
    options = METHODS[method][0]
    run: Any = solve if "method" in options else solve_implicit
    found: Solution = run(held(points=["mass"], law=late).assemble(), samples=[0.0, 0.25, 1.0], **options)
    assert found.status == "failed"
    assert "'element'" in found.message
    assert "the table ends" in found.message
    assert found.t.size == 2


def test_bad_parts() -> None:
    with pytest.raises(InputError, match=r"element.points is empty"):
        held(points=[], law=late).assemble()
    with pytest.raises(InputError, match=r"element.law is missing"):
        held(points=["mass"]).assemble()
    with pytest.raises(InputError, match=r"'moss'.*did you mean 'mass'"):
        held(points=["mass", "moss"], law=late).assemble()
    with pytest.raises(InputError, match=r"CustomForce.law is 'x'; it must be a function under @evolvent.law"):
        parts.CustomForce(points=["mass"], law="x")
    with pytest.raises(InputError, match=r"a function that is no law; decorate it with @evolvent\.law"):
        held(points=["mass"], law=lambda t, x, v, p, f: (0.0, 0.0)).assemble()

    @law
    def energy_alone(t, x, v, p, f):  # type: ignore[no-untyped-def]
        return 0.0

    words = r"element\.law: the law 'energy_alone' .* returns 1 number; it must be law\(t, x, v, parameters, f\) -> "
    with pytest.raises(InputError, match=words):
        held(points=["mass"], law=energy_alone).assemble()

    @law
    def nothing(t, x, v, p, f):  # type: ignore[no-untyped-def]
        f[0] = 1.0

    with pytest.raises(InputError, match=r"the law 'nothing' .* returns nothing; it must be law"):
        held(points=["mass"], law=nothing).assemble()


@law
def pull(t, x, v, p, f):  # type: ignore[no-untyped-def]
    f[0] -= x[0]
    return 0.5 * x[0] ** 2, 0.0


def test_a_law_without_parameters_before_an_expression() -> None:
    """The expression's program stands where the law's parameters would begin."""
    system = held(points=["mass"], law=pull)
    system.add(parts.Spring(a=(5.0, 0.0, 0.0), b="mass", law="k*x", constants={"k": 3.0}, length=5.0), "spring")
    assert modes(system.assemble(), count=3).frequency[-1] == pytest.approx(2.0, rel=1e-8)
