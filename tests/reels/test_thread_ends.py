"""A thread whose outer end is fixed to a body or a point mass."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import InputError, System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.solvers import solve
from evolvent.solvers.common.observations import observe
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import Run, flying_apart, run, tangent_error

W = np.array((0.02, 0.1, 0.3))
R = 0.05
HOOK = np.array((1.5, 0.1, 0.0))


def tether(end: str = "body", *, rate: float = 4.0, nodes: int = 4, **thread: Any) -> Assembly:
    """A free ship that turns pays out a tether of 2 m, 1 m out, to a satellite of 5 kg."""
    system = System()
    system.add(parts.RigidBody(mass=40.0, inertia=(3.0, 4.0, 5.0), angular_velocity=tuple(W)), "ship")
    drive = parts.ConstantDrive(rate=rate, angle=1.0 / R)
    system.add(parts.Reel(body="ship", radius=R, centre=(0.5, 0.1, -R), drive=drive), "reel")
    given = {"length": 2.0, "line_density": 0.05, "nodes": nodes, "stiffness": 2000.0, "damping": 0.5}
    given |= {"wound_mass": "carried"} | thread
    off = np.array((0.2, 0.05, 0.0)) if end == "body" else np.zeros(3)
    moving = {"position": tuple(HOOK + off), "velocity": tuple(np.cross(W, HOOK + off) + np.array((0.2, 0.0, 0.0)))}
    if end == "tip":
        system.add(parts.Thread(reel="reel", tip_mass=5.0, **given), "tether")
        return system.assemble()
    if end == "point":
        system.add(parts.Point(mass=5.0, **moving), "satellite")
    else:
        body = parts.RigidBody(
            mass=5.0, inertia=(0.1, 0.2, 0.25), angular_velocity=tuple(W), points={"hook": tuple(-off)}, **moving
        )
        system.add(body, "satellite")
    place = "satellite" if end in ("point", "centre") else "satellite.hook"
    system.add(parts.Thread(reel="reel", end=place, **given), "tether")
    return system.assemble()


def sums(found: Run) -> tuple[np.ndarray, np.ndarray]:
    """Angular momentum less what releases brought in, and linear momentum."""
    return found.momentum + found.wound_momentum - found.jumps, found.linear_momentum


@pytest.mark.parametrize("end", ["body", "point"])
def test_balances(end: str, book: Book) -> None:
    """Paid out between two free bodies, through two releases: energy, linear and angular momentum."""
    found = run(tether(end), np.linspace(0.0, 4.0, 9), "dopri5", rtol=1e-9, atol=1e-11)
    assert found.solution.event_times.size >= 2
    H, P = sums(found)
    defect = np.abs(found.energy_defect).max() / found.energy[0]
    assert defect < 1e-6
    assert np.abs(H - H[0]).max() < 1e-9 * np.linalg.norm(H[0])
    assert np.abs(P - P[0]).max() < 1e-12
    book(
        "Threads, reels, tethers", f"Tether paid out from a free body to a {end}: balance of energy",
        reference="work of the spool", source="balance; momenta kept to 1e-9", error=defect, allowed=1e-6,
    )  # fmt: skip


def test_an_end_on_a_point_is_a_tip_mass() -> None:
    """And so is the centre of a body without that body's turning."""
    samples = np.linspace(0.0, 3.0, 7)
    found = {end: run(tether(end), samples, "rk4", step=1e-3) for end in ("tip", "point", "centre")}
    for end in ("point", "centre"):
        for node in range(3):
            x, exact = (f.seen.position[:, node] for f in (found[end], found["tip"]))
            assert np.abs(x - exact).max() < 2e-6, (end, node)  # the tip starts at the drive's speed as they do
        assert np.abs(found[end].seen.tension - found["tip"].seen.tension)[:, :3].max() < 1e-3


@pytest.mark.parametrize("end", ["point", "body"])
@pytest.mark.parametrize("method", ["rk4", "alpha"])
def test_two_bodies_on_one_segment(end: str, method: str, book: Book) -> None:
    """A stretched segment between a body and an end: 1 m + 5 cm cos(w t), w^2 = c (1/M + 1/m)."""
    M, m, rho, c = 4.0, 1.5, 0.2, 30.0
    system = System()
    system.add(parts.RigidBody(mass=M, inertia=1.0), "ship")
    drive = parts.ConstantDrive(rate=0.0, angle=10.0)
    system.add(parts.Reel(body="ship", radius=0.1, centre=(0.0, 0.0, -0.1), drive=drive), "reel")
    if end == "point":
        system.add(parts.Point(mass=m, position=(1.05, 0.0, 0.0)), "end")
    else:
        system.add(parts.RigidBody(mass=m, inertia=1.0, position=(1.05, 0.0, 0.0)), "end")
    system.add(parts.Thread(reel="reel", length=1.0, line_density=rho, nodes=1, stiffness=c, end="end"), "thread")
    assembly, t = system.assemble(), np.linspace(0.0, 3.0, 13)
    if method == "rk4":
        solution = run(assembly, t, "rk4", step=2e-3).solution
    else:
        solution = solve_implicit(assembly, samples=t, step=1e-3, spectral_radius=1.0)
        assert solution.success, solution.message
    w = np.sqrt(c * (1.0 / M + 1.0 / (m + 0.5 * rho)))
    first = int((assembly.model.points if end == "point" else assembly.model.bodies)["iq"][0 if end == "point" else 2])
    apart = solution.y[:, first] - solution.y[:, int(assembly.model.bodies["iq"][1])]
    error = np.abs(apart - 1.0 - 0.05 * np.cos(w * t)).max() / 0.05
    allowed = 1e-8 if method == "rk4" else 1e-4
    assert error < allowed
    book(
        "Threads, reels, tethers", f"Two bodies on a stretched thread, end on a {end} ({method})",
        reference="cos(w t), w^2 = c (1/M + 1/m)", source="closed form", error=error, allowed=allowed,
    )  # fmt: skip


@pytest.mark.parametrize("damping", [0.0, 3.0])
def test_a_slack_thread_lets_its_end_fly(damping: float, book: Book) -> None:
    """Stretched by 5 cm it pulls its ends together until it is slack; then they fly on. Energy balances.

    With damping that is where the damper would push harder than the spring pulls, before the natural length.
    """
    M, m, c = 4.0, 1.5, 30.0
    system = System()
    system.add(parts.RigidBody(mass=M, inertia=1.0), "ship")
    drive = parts.ConstantDrive(rate=0.0, angle=10.0)
    system.add(parts.Reel(body="ship", radius=0.1, centre=(0.0, 0.0, -0.1), drive=drive), "reel")
    system.add(parts.Point(mass=m, position=(1.05, 0.0, 0.0)), "end")
    thread = {"stiffness": c, "damping": damping, "slack": True, "end": "end"}
    system.add(parts.Thread(reel="reel", length=1.0, line_density=1e-9, nodes=1, **thread), "thread")
    t = np.linspace(0.0, 2.0, 21)
    found = run(system.assemble(), t, rtol=1e-10, atol=1e-12)
    assert np.abs(found.energy_defect).max() < 1e-7 * found.energy[0]
    assert found.seen.tension.min() >= 0.0
    exact = flying_apart(t, c * (1.0 / M + 1.0 / m), damping * (1.0 / M + 1.0 / m))
    apart = (
        found.y[:, int(found.assembly.model.points["iq"][0])] - found.y[:, int(found.assembly.model.bodies["iq"][1])]
    )
    error = np.abs(apart - 1.0 - 0.05 * exact).max() / 0.05
    assert error < 1e-6
    book(
        "Threads, reels, tethers", f"Thread that goes slack between two bodies, damping {damping:g} N s/m",
        source="closed form", reference="damped oscillation while it pulls, then free flight", error=error,
        allowed=1e-6,
    )  # fmt: skip


def test_generalized_alpha_as_rk4_has_it() -> None:
    samples = np.linspace(0.0, 3.0, 7)
    exact = run(tether(), samples, "rk4", step=1e-3)
    solution = solve_implicit(tether(), samples=samples, step=2e-3, spectral_radius=0.9)
    assert solution.success, solution.message
    assembly = solution.assembly
    found = Run(assembly, solution, observe(assembly.model, solution.t, solution.y, solution.s))  # type: ignore[arg-type]
    np.testing.assert_allclose(found.seen.position[:, 0], exact.seen.position[:, 0], atol=2e-4)
    H, P = sums(found)
    assert np.abs(H - H[0]).max() < 1e-5 * np.linalg.norm(H[0])
    assert np.abs(P - P[0]).max() < 1e-5
    assert np.abs(found.energy_defect).max() < 1e-3 * found.energy[0]


@pytest.mark.parametrize(("end", "nodes"), [("body", 4), ("point", 4), ("body", 1)])
def test_tangent(end: str, nodes: int, rng: np.random.Generator) -> None:
    """Against central differences of the residual, all unknowns."""
    assembly = tether(end, nodes=nodes)
    y = assembly.y.copy()
    y[int(assembly.model.bodies["iq"][1])] -= 0.02  # stretched
    assert tangent_error(assembly, y, rng) < 2e-4


def test_results() -> None:
    """The end's force is the tension of the outermost segment; loads on the thread act on the end as well."""
    system = System()
    system.add(parts.RigidBody(motion="driven"), "hub")
    drive = parts.ConstantDrive(rate=0.0, angle=10.0)
    system.add(parts.Reel(body="hub", radius=0.1, centre=(0.0, 0.0, -0.1), drive=drive), "reel")
    system.add(parts.Point(mass=1.0, position=(1.02, 0.0, 0.0)), "end")
    system.add(parts.Thread(reel="reel", length=1.0, line_density=0.1, nodes=2, stiffness=100.0, end="end"), "thread")
    system.add(parts.Load(along="thread", force=(0.0, 0.0, 2.0)), "wind")
    found = system.simulate(until=0.1, every=0.05, method="rk4", step=1e-3)
    tension = float(found["thread"].tension[0, 0])
    assert tension == pytest.approx(1.0)
    assert found["thread"].end_force[0].values == pytest.approx([-tension, 0.0, 0.0])
    lifted = float(found["end"].position[-1, 2])
    assert lifted == pytest.approx(0.5 * 2.0 * 0.25 / (1.0 + 0.1 * 0.25) * 0.1**2, rel=0.1)
    assert found["thread"].tip_position.values == pytest.approx(found["end"].position.values)


def _with(end: Any, **thread: Any) -> System:
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=1.0, points={"own": (0.0, 1.0, 0.0)}), "ship")
    system.add(parts.RigidBody(mass=1.0, inertia=1.0, position=(2.0, 0.0, 0.0)), "satellite")
    beam = {"length": 1.0, "section": {"tube": {"radius": 0.01, "thickness": 1e-3}}, "material": "cfrp", "elements": 2}
    system.add(parts.Beam(position=(2.0, 0.0, 0.0), **beam), "boom")
    reel = parts.Reel(body="ship", radius=0.1, centre=(0.0, 0.0, -0.1), drive=parts.ConstantDrive(rate=1.0, angle=20.0))
    system.add(reel, "reel")
    system.add(parts.Thread(reel="reel", end=end, length=5.0, line_density=0.1, **thread), "tether")
    return system


@pytest.mark.parametrize(
    ("end", "thread", "message"),
    [
        ("boom.root", {}, r"tether.end is 'boom.root', a node of a beam.*add a Point with at='boom.root'"),
        ("satelite", {}, "did you mean 'satellite'"),
        ("reel", {}, "tether.end is 'reel'; 'reel' is a Reel, not a body, point or beam"),
        ("ship.own", {}, "tether.end is 'ship.own', on the body of 'reel' itself"),
        ("satellite", {"segments": "inextensible"}, "tether.end is 'satellite'; it needs tether.segments 'springs'"),
        ("satellite", {"segments": "inextensible", "slack": True}, "tether.slack is true; it needs tether.segments"),
        ("satellite", {"direction": (1.0, 0.0, 0.0)}, "tether.direction and tether.end are both given"),
        (("satellite", (1.0, 0.0, 0.0)), {}, r"3 m from where.*but the .* is 2 m.*reel.drive.angle to 30 rad"),
    ],
)
def test_refusals(end: Any, thread: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        _with(end, **thread).assemble()


def test_reeling_in_an_end_stops_the_run() -> None:
    """Reeled in whole, there is no thread left."""
    found = solve(tether(rate=-4.0, nodes=2), samples=[0.0, 8.0], method="rk4", step=2e-3)
    assert not found.success
    assert "reels in what is already wound" in found.message


@pytest.mark.parametrize("mesh", ["material", "moving"])
def test_an_end_on_a_body_driven_along_a_line(mesh: str) -> None:
    """The drive of the body accelerates the mass at the thread's end too: the energy balance closes."""
    system = System()
    drive = parts.RampDrive(rate=0.0, steps=((0.05, 0.2, 0.5),))
    cart = parts.RigidBody(motion="driven", position=(1.8, 0.0, 0.0), drive=drive, direction=(1.0, 0.0, 0.0))
    system.add(cart, "cart")
    still = parts.ConstantDrive(angle=18.0, rate=0.0)
    system.add(parts.Reel(body="ground", radius=0.1, centre=(0.0, 0.0, -0.1), drive=still), "reel")
    thread = parts.Thread(
        reel="reel", length=2.0, line_density=0.1, nodes=5, stiffness=2500.0, damping=1.0, mesh=mesh, end="cart",
        tip_mass=0.05,
    )  # fmt: skip
    system.add(thread, "tether")
    found = run(system.assemble(), np.linspace(0.0, 0.3, 4), "rk4", step=5e-4)
    assert np.abs(found.energy_defect).max() < 1e-8 * found.energy.max()
