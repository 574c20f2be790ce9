"""Fields on every mass: the orbital frame against Clohessy and Wiltshire, librations, tethers; laws of acceleration."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import evolvent
from book import Book
from evolvent import InputError, System, elements, parts
from families.case import swing
from helpers import rotation

CHAPTER = "Dynamics"
#: Mean motion, rad/s.
N = 0.8
METHODS: dict[str, dict[str, Any]] = {
    "dopri5": {"tolerance": 1e-10},
    "generalized-alpha": {"step": 2e-3},
    "energy-momentum": {"step": 2e-3, "spectral_radius": 1.0},
}
#: What motions may be off by the methods' steps, of their size.
ALLOWED = {"dopri5": 1e-8, "generalized-alpha": 2e-5, "energy-momentum": 2e-5}


def simulated(system: System, method: str, until: float = 4.0) -> Any:
    return system.simulate(until=until, every=0.25, method=method, **METHODS[method])


def in_orbit(**axes: Any) -> System:
    system = System()
    system.add(parts.Field(type="orbit", rate=N, **axes), "orbit")
    return system


def clohessy_wiltshire(t: np.ndarray, x0: np.ndarray, v0: np.ndarray) -> np.ndarray:
    """Place of a free point (nt, 3): radial, along the orbit, across it."""
    (x, y, z), (u, v, w), s, c = x0, v0, np.sin(N * t), np.cos(N * t)
    return np.stack(
        [
            (4.0 - 3.0 * c) * x + s / N * u + 2.0 / N * (1.0 - c) * v,
            6.0 * (s - N * t) * x + y - 2.0 / N * (1.0 - c) * u + (4.0 * s - 3.0 * N * t) / N * v,
            z * c + w * s / N,
        ],
        axis=-1,
    )


@pytest.mark.parametrize("method", METHODS)
def test_a_free_point_flies_as_clohessy_and_wiltshire_say(method: str, book: Book) -> None:
    x0, v0 = np.array([0.3, -0.2, 0.4]), np.array([0.1, 0.2, -0.3])
    system = in_orbit()
    system.add(parts.Point(mass=2.0, position=tuple(x0), velocity=tuple(v0)), "p")
    run = simulated(system, method)
    exact = clohessy_wiltshire(run["time"].values, x0, v0)
    book(
        CHAPTER, f"free point in a circular orbit ({method})", reference="solution in closed form",
        source="Clohessy & Wiltshire 1960", error=np.abs(run["p/position"].values - exact).max() / np.ptp(exact),
        allowed=ALLOWED[method],
    )  # fmt: skip
    scale = float(run["energy_kinetic"].max())
    assert float(np.abs(run["energy_defect"]).max()) < (1e-12 if method == "energy-momentum" else 1e-4) * scale


def test_axes_of_the_orbit() -> None:
    """The same motion with z radial and x along the orbit."""
    x0, v0 = np.array([0.3, -0.2, 0.4]), np.array([0.1, 0.2, -0.3])
    system = in_orbit(radial=(0.0, 0.0, 2.0), along=(1.0, 0.0, 0.0))
    turned = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    system.add(parts.Point(mass=2.0, position=tuple(turned @ x0), velocity=tuple(turned @ v0)), "p")
    run = simulated(system, "dopri5")
    exact = clohessy_wiltshire(run["time"].values, x0, v0) @ turned.T
    np.testing.assert_allclose(run["p/position"].values, exact, atol=1e-7)


@pytest.mark.parametrize("method", METHODS)
def test_a_rigid_body_librates(method: str, book: Book) -> None:
    """About the orbit's normal 2 theta swings as a pendulum: theta'' = -3/2 n^2 (Jy - Jx)/Jz sin(2 theta)."""
    J, start = (0.6, 1.0, 0.8), 0.5
    system = in_orbit()
    turned = (math.cos(0.5 * start), 0.0, 0.0, math.sin(0.5 * start))
    system.add(parts.RigidBody(mass=1.0, inertia=J, orientation=turned), "body")
    run = simulated(system, method)
    q = run["body/attitude"].values
    exact = 0.5 * swing(run["time"].values, 2.0 * start, N * math.sqrt(3.0 * (J[1] - J[0]) / J[2]))
    book(
        CHAPTER, f"libration of a rigid body in orbit ({method})", reference="elliptic functions", source="Hughes 1986",
        error=np.abs(2.0 * np.arctan2(q[:, 3], q[:, 0]) - exact).max() / start, allowed=10.0 * ALLOWED[method],
    )  # fmt: skip


def test_a_ball_keeps_its_rate_in_space() -> None:
    """Without a moment of the gradient: the gyroscopic moments of the frame alone."""
    w0, start = np.array([0.3, -0.5, 0.7]), np.array([0.0, 0.0, N])
    system = in_orbit()
    system.add(parts.RigidBody(mass=1.0, inertia=0.4, angular_velocity=tuple(w0)), "ball")
    run = simulated(system, "dopri5")
    R = np.array([rotation(q) for q in run["ball/attitude"].values])
    found = np.einsum("tij,tj->ti", R, run["ball/rate"].values)
    for t, w in zip(run["time"].values, found, strict=True):
        c, s = math.cos(N * t), math.sin(N * t)
        frame = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        np.testing.assert_allclose(w, frame @ (w0 + start) - start, atol=1e-8)


@pytest.mark.parametrize(("plane", "rate"), [("in", math.sqrt(3.0) * N), ("out of", 2.0 * N)])
@pytest.mark.parametrize("method", ["dopri5", "energy-momentum"])
def test_a_dumbbell_librates(plane: str, rate: float, method: str, book: Book) -> None:
    """In the plane of the orbit with sqrt(3) n, across it with 2 n; twice the angle swings as a pendulum.

    Across it only where the angle is small, for Coriolis forces couple both in its square.
    """
    start, arm = 0.4 if plane == "in" else 1e-3, 1.5
    across = np.array([0.0, 1.0, 0.0]) if plane == "in" else np.array([0.0, 0.0, 1.0])
    e = np.array([math.cos(start), 0.0, 0.0]) + math.sin(start) * across
    system = in_orbit()
    for name, sign in (("a", 1.0), ("b", -1.0)):
        system.add(parts.Point(mass=2.0, position=tuple(sign * arm * e)), name)
    system.add(parts.Joint(a="a", b="b", type="link", length=2.0 * arm), "rod")
    run = simulated(system, method)
    x = run["a/position"].values
    angle = np.arctan2(x @ across, x[:, 0])
    book(
        CHAPTER, f"libration of a dumbbell {plane} the plane of its orbit ({method})", reference="elliptic functions",
        source="frequencies sqrt(3) n and 2 n", error=np.abs(angle - 0.5 * swing(run["time"].values, 2.0 * start, rate))
        .max() / start, allowed=100.0 * ALLOWED[method],
    )  # fmt: skip


def tether(formulation: str, elements_: int, length: float, density: float) -> parts.Beam:
    section = elements.Rectangle(width=1e-3, thickness=1e-3)
    material = elements.Material(young_modulus=1e13, poisson_ratio=0.3, density=density / 1e-6)
    return parts.Beam(
        length=length, section=section, material=material, elements=elements_, formulation=formulation
    )  # fmt: skip


@pytest.mark.parametrize("formulation", ["cable", "assumed_strain"])
def test_tension_of_a_massive_tether(formulation: str, book: Book) -> None:
    """Upright with a mass at its end: 3 n^2 (m l + rho l^2/2) at the root."""
    length, mass, density = 10.0, 2.0, 0.3
    system = in_orbit()
    system.add(tether(formulation, 4, length, density), "tether")
    system.add(parts.Point(mass=mass, at="tether.tip"), "tip")
    system.add(parts.Joint(a="tether.root", b=(0.0, 0.0, 0.0), type="clamp"), "root")
    found = system.equilibrium()
    exact = 3.0 * N**2 * (mass * length + 0.5 * density * length**2)
    book(
        "Threads, reels, tethers", f"tension at the root of a massive tether in orbit ({formulation})",
        reference="3 n^2 (m l + rho l^2/2)", source="gravity gradient",
        error=abs(abs(float(found["root/force"].values[-1, 0])) / exact - 1.0), allowed=2e-5,
    )  # fmt: skip
    total = found["orbit/force"].values[-1]
    np.testing.assert_allclose(total, [exact, 0.0, 0.0], rtol=2e-5, atol=1e-9)


def test_tension_of_a_thread_with_a_tip_mass() -> None:
    """The same of a thread on a reel: the trapezoidal rule of its nodes is exact."""
    length, mass, density = 10.0, 2.0, 0.3
    system = in_orbit()
    system.add(parts.RigidBody(motion="driven"), "hub")
    drive = parts.ConstantDrive(rate=0.0, angle=length / 0.1)
    system.add(parts.Reel(body="hub", centre=(0.0, 0.0, -0.1), radius=0.1, drive=drive), "reel")
    system.add(
        parts.Thread(reel="reel", length=length, line_density=density, nodes=5, tip_mass=mass, stiffness=1e5,
                     damping=4000.0), "tether",
    )  # fmt: skip
    run = system.simulate(until=1.5, every=0.5, method="generalized-alpha", step=1e-3)
    exact = 3.0 * N**2 * (mass * length + 0.5 * density * length**2)
    place = run["tether/position"].values[-1]
    assert np.abs(place[np.argmax(place[:, 0])] - [length, 0.0, 0.0]).max() < 0.01
    assert float(run["tether/tension"].values[-1].max()) == pytest.approx(exact, rel=2e-3)
    assert "warning" not in run.attrs


def everything(gravity: Any = (0.0, 0.0, 0.0)) -> System:
    """A system with every kind of mass; the thread is paid out, what is wound is carried."""
    system = System(gravity=gravity)
    system.add(parts.RigidBody(mass=2.0, inertia=(0.2, 0.3, 0.4), angular_velocity=(0.1, 0.5, 1.0)), "body")
    system.add(parts.RigidBody(motion="spin", inertia=(0.2, 0.3, 0.4), axis=(1.0, 1.0, 0.0), rate=0.3), "wheel")
    system.add(parts.Point(mass=1.0, position=(1.0, 2.0, 3.0)), "point")
    reel = parts.Reel(body="body", radius=0.05, drive=parts.ConstantDrive(rate=4.0, angle=20.0))
    system.add(reel, "reel")
    system.add(
        parts.Thread(reel="reel", length=3.0, line_density=0.1, nodes=6, tip_mass=0.5, stiffness=500.0, damping=1.0,
                     wound_mass="carried"), "thread",
    )  # fmt: skip
    section = elements.Rectangle(width=0.02, thickness=0.01)
    material = elements.Material(young_modulus=2e7, poisson_ratio=0.0, density=1000.0)
    for name, formulation in (("beam", "assumed_strain"), ("cable", "cable")):
        system.add(
            parts.Beam(length=1.0, section=section, material=material, elements=2, formulation=formulation,
                       direction=(1.0, 1.0, 0.0), angular_velocity=(0.0, 0.0, 1.0)), name,
        )  # fmt: skip
    return system


@pytest.mark.slow
@pytest.mark.parametrize("method", ["dopri5", "generalized-alpha"])
def test_a_constant_field_is_gravity(method: str) -> None:
    """On points, bodies, beams, threads with tip masses and wound thread."""
    g = (0.3, -1.0, 0.5)
    options: dict[str, Any] = {"tolerance": 1e-9} if method == "dopri5" else {"step": 5e-3}
    falls = everything(g).simulate(until=0.2, every=0.1, method=method, **options)
    system = everything()
    system.add(parts.Field(law=["0.3", "-1", "0.5"]), "field")
    run = system.simulate(until=0.2, every=0.1, method=method, **options)
    for name in ("body", "wheel", "point", "thread", "beam", "cable"):
        for key in ("position", "attitude"):
            if key in falls[name]:
                np.testing.assert_allclose(run[f"{name}/{key}"], falls[f"{name}/{key}"], atol=1e-7, err_msg=name)
    assert float(run["work_loads"][-1]) == pytest.approx(float(falls["work_loads"][-1]), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["dopri5", "generalized-alpha"])
def test_the_balance_closes_in_orbit(method: str) -> None:
    """With every kind of mass, the spool's work on wound thread among it."""
    system = everything()
    system.add(parts.Field(type="orbit", rate=N), "orbit")
    options: dict[str, Any] = {"tolerance": 1e-9} if method == "dopri5" else {"step": 2e-3}
    run = system.simulate(until=0.5, every=2e-3, method=method, **options)
    defect, work = float(np.abs(run["energy_defect"]).max()), float(run["work_loads"][-1])
    assert defect < (1e-8 if method == "dopri5" else 2e-5) * float(run["energy_kinetic"].max())
    assert float(run["orbit/work"][-1]) == pytest.approx(work, rel=1e-3)


def test_energy_momentum_keeps_the_balance_exactly() -> None:
    """A body on a beam in orbit: the field's work is what the quadratic potential says, at any step."""
    system = in_orbit()
    section = elements.Rectangle(width=0.02, thickness=0.01)
    material = elements.Material(young_modulus=2e7, poisson_ratio=0.0, density=1000.0)
    system.add(parts.Beam(length=1.0, section=section, material=material, elements=2, direction=(1.0, 1.0, 0.3),
                          angular_velocity=(0.1, 0.5, 1.0)), "beam")  # fmt: skip
    system.add(parts.RigidBody(mass=2.0, inertia=(0.02, 0.03, 0.04), angular_velocity=(0.1, 0.5, 1.0)), "body")
    system.add(parts.Joint(a="body", b="beam.root", type="clamp"), "joint")
    run = system.simulate(until=1.0, every=0.1, method="energy-momentum", step=0.02, spectral_radius=1.0)
    assert float(np.abs(run["energy_defect"]).max()) < 1e-10 * float(run["energy_kinetic"].max())


@pytest.mark.slow
def test_a_python_law_and_files(tmp_path: Any) -> None:
    @evolvent.law
    def drag(x: Any, v: Any, t: float, p: Any) -> tuple[float, float, float]:
        return -p[0] * v[0], -p[0] * v[1], -p[0] * v[2]

    system = System()
    system.add(parts.Field(law=drag, parameters=(2.0,)), "drag")
    system.add(parts.Point(mass=3.0, velocity=(1.0, 0.0, 0.0)), "p")
    run = system.simulate(until=1.0, method="dopri5", tolerance=1e-9)
    assert float(run["p/velocity"][-1, 0]) == pytest.approx(math.exp(-2.0), rel=1e-7)
    # the orbit of a space station, from a file
    text = (
        "system: structure\nparts:\n  orbit: {kind: field, type: orbit, radius: 6778 km, gravitational_parameter: "
        "3.986004418e14 m^3/s^2, radial: [0, 0, 1], along: [1, 0, 0]}\n  sat: {kind: point, mass: 1 kg}\n"
    )
    path = tmp_path / "case.yaml"
    path.write_text(text)
    read = evolvent.load(path)
    assert read.parts["orbit"].mean_motion() == pytest.approx(1.1314e-3, rel=1e-4)
    path.write_text(read.to_yaml())
    assert evolvent.load(path).parts["orbit"] == read.parts["orbit"]


@evolvent.law
def broken(x: Any, v: Any, t: float, p: Any) -> tuple[float, float, float]:
    return p[3], 0.0, 0.0


def test_refusals() -> None:
    point = parts.Point(mass=1.0)

    def refused(
        words: str, *fields: Any, call: str = "assemble", gravity: Any = (0.0, 0.0, 0.0), **options: Any
    ) -> None:
        system = System(gravity=gravity)
        system.add(point, "p")
        for k, field in enumerate(fields):
            system.add(field, f"f{k}")
        with pytest.raises(InputError, match=words):
            getattr(system, call)(**options)

    orbit = parts.Field(type="orbit", rate=1.0)
    refused("'f1' is an orbit, and so is 'f0'; a system has one at most", orbit, orbit)
    refused("gravity is .*, but 'f0' is an orbit", orbit, gravity=(0.0, 0.0, -9.81))
    refused(
        "f0.along is .*; it must be perpendicular to f0.radial",
        parts.Field(type="orbit", rate=1.0, along=(1.0, 1.0, 0.0)),
    )
    refused("f0.rate and f0.radius are both given", parts.Field(type="orbit", rate=1.0, radius=7e6))
    refused("f0.gravitational_parameter is missing", parts.Field(type="orbit", radius=7e6))
    refused("f0.rate is missing", parts.Field(type="orbit"))
    refused("rotating does not support the field 'f0'", orbit, call="equilibrium", rotating=(0.0, 0.0, 1.0))
    refused("'f0' at t = 0 s: the law 'broken'", parts.Field(law=broken), call="simulate", until=1.0)

    @evolvent.law
    def short(x: Any, v: Any) -> tuple[float, float, float]:
        return 0.0, 0.0, 0.0

    refused("f0.law is the law 'short' .*, which takes 2 arguments", parts.Field(law=short))
