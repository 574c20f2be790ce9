"""Threads on a mesh that moves: closed forms, the continuum, balances, orders, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from book import ROOT, Book
from evolvent import InputError, System, model as mdl, parts
from evolvent.assembly.assembled import Assembly
from evolvent.kernels.impulse import impulse, prepare
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import L0, R, Run, V, fitted_order, heliogyro, observe, run

Array = np.ndarray
CHAPTER = "Threads, reels, tethers"
#: Rates of a spool that pays out, stops and reels in (rad/s), and a free one with motor and friction.
REVERSING = parts.RampDrive(angle=20.0, rate=2.0, steps=((0.05, 0.1, 12.0), (0.2, 0.2, -12.0)))
BRAKED = parts.FreeSpool(
    inertia=2e-3, angle=20.0, rate=4.0, brake=0.1, profile={"table": [[0.0, 0.0], [0.2, 0.6], [0.4, -0.6], [0.6, 0.0]]}
)
FREE = parts.FreeSpool(inertia=2e-3, angle=20.0, rate=4.0, torque=0.02, viscous_damping=1e-3)


def craft(
    motion: str, drive: Any, *, damping: float = 0.0, gravity: Any = (0.0, 0.0, 0.0), thickness: float = 0.0
) -> Assembly:
    """A tumbling body with a reel off its centre; neither is symmetric."""
    system = System(gravity=gravity)
    turning: dict[str, Any] = {"motion": motion, "axis": (0.0, 0.6, 0.8), "inertia": 0.4, "rate": 2.0}
    if motion == "free":
        turning = {"mass": 4.0, "inertia": (0.3, 0.4, 0.5), "angular_velocity": (0.2, 0.5, 2.0)}
    system.add(parts.RigidBody(**turning), "ship")
    system.add(parts.Reel(body="ship", radius=0.05, centre=(0.5, 0.1, -0.05), drive=drive), "reel")
    thread = parts.Thread(
        reel="reel", length=2.0, line_density=0.1, nodes=5, tip_mass=0.2, stiffness=500.0, damping=damping,
        mesh="moving", thickness=thickness,
    )  # fmt: skip
    system.add(thread, "tether")
    return system.assemble()


def implicit(assembly: Assembly, t: Any, **options: Any) -> Run:
    """A run by generalized-alpha."""
    found = solve_implicit(assembly, samples=t, **options)
    assert found.success, found.message
    return Run(assembly, found, observe(assembly.model, found.t, found.y, found.s))


def blade(elements: int, **given: Any) -> Assembly:
    """The paper's heliogyro on a moving mesh, EA 2500 N whatever the number of elements."""
    own = {"stiffness": 500.0 * elements, "damping": 5e-5 * elements, "segments": "springs", "mesh": "moving"}
    return heliogyro(nodes=elements, **(own | given))


@pytest.mark.parametrize("motion", ["free", "spin", "driven"])
@pytest.mark.parametrize("drive", [REVERSING, FREE, BRAKED], ids=["both ways", "free", "brake"])
def test_balances(drive: Any, motion: str, book: Book) -> None:
    """Energy with what drive, motor, dampers and weight do, and momenta: to the error of the integration."""
    gravity = (0.0, 0.0, -9.81) if motion == "spin" else (0.0, 0.0, 0.0)
    found = run(craft(motion, drive, damping=0.1, gravity=gravity), np.linspace(0.0, 0.6, 11), rtol=1e-10, atol=1e-12)
    out = found.seen.spool[:, 0, 0]
    assert out.max() > (20.1 if drive is BRAKED else 21.5)
    assert drive is not REVERSING or out[-1] < out.max() - 1.0
    energy = np.abs(found.energy_defect).max() / found.energy.max()
    assert energy < 1e-8
    assert (found.solution.event_times.size > 0) == (drive is BRAKED and motion == "free")  # where it sticks and slips
    if motion == "free":
        H, P = found.momentum + found.wound_momentum, found.linear_momentum
        error = max(np.abs(H - H[0]).max() / np.linalg.norm(H[0]), np.abs(P - P[0]).max() / np.abs(P).max())
        if drive is BRAKED:
            assert error < 1e-8
            return
        name = "free spool" if drive is FREE else "pay-out and reeling in"
        book(
            CHAPTER, f"Moving mesh, {name}: momenta and energy", reference="conserved", source="closed form",
            error=max(error, energy), allowed=1e-8,
        )  # fmt: skip


@pytest.mark.parametrize("drive", [REVERSING, FREE], ids=["both ways", "free"])
def test_balances_of_a_tape(drive: Any, book: Book) -> None:
    """With a thickness, by which the radius of the spool follows its angle: momenta and energy."""
    assembly = craft("free", drive, damping=0.1, thickness=1e-3)
    found = run(assembly, np.linspace(0.0, 0.6, 11), rtol=1e-10, atol=1e-12)
    H, P = found.momentum + found.wound_momentum, found.linear_momentum
    error = max(np.abs(H - H[0]).max() / np.linalg.norm(H[0]), np.abs(P - P[0]).max() / np.abs(P).max())
    error = max(error, float(np.abs(found.energy_defect).max() / found.energy.max()))
    other = implicit(craft("free", drive, damping=0.1, thickness=1e-3), [0.0, 0.6], step=1e-4, spectral_radius=0.9)
    n_q = int(assembly.model.info.nq)
    assert other.y[-1, :n_q] == pytest.approx(found.y[-1, :n_q], abs=1e-4)
    if drive is FREE:
        book(
            CHAPTER, "Moving mesh, tape on a free spool: momenta and energy", reference="conserved",
            source="closed form", error=error, allowed=1e-8,
        )  # fmt: skip
    assert error < 1e-8


def test_a_thread_that_goes_slack() -> None:
    """The tip is thrown up: it falls freely until the thread is taut again; energy is kept throughout."""
    system, speed = System(gravity=(0.0, 0.0, -9.81)), 2.0
    down: dict[str, Any] = {"payout_axis": (0.0, 0.0, -1.0), "spool_axis": (0.0, 1.0, 0.0)}
    system.add(parts.Reel(body="ground", radius=0.1, drive=parts.ConstantDrive(rate=1.0, angle=10.0), **down), "reel")
    rope = parts.Thread(
        reel="reel", length=2.0, line_density=1e-4, tip_mass=1.0, nodes=3, stiffness=1.5e3, mesh="moving", slack=True
    )
    system.add(rope, "rope")
    assembly, t = system.assemble(), np.linspace(0.0, 0.6, 25)
    row = assembly.model.threads[0]
    tip = int(row["iv"]) + 2
    assembly.y[tip] = speed
    found = run(assembly, t, rtol=1e-8, atol=1e-10)
    z, free = found.y[:, int(row["iq"]) + 2], t < 0.38
    assert z[free] == pytest.approx(-1.0 + speed * t[free] - 0.5 * 9.81 * t[free] ** 2, abs=2e-4)
    assert found.seen.tension[free, 0] == pytest.approx(0.0, abs=1e-12)
    assert found.seen.tension.max() > 10.0
    assert found.seen.tension.min() >= 0.0
    assert np.abs(found.energy_defect).max() < 1e-5 * found.energy.max()


def in_orbit(rate: float, drive: Any, elements: int, *, mesh: str = "moving", **given: Any) -> System:
    """A tether from the ground of an orbital frame towards the zenith."""
    system = System()
    system.add(parts.Field(type="orbit", rate=rate), "orbit")
    system.add(parts.Reel(body="ground", radius=0.1, centre=(0.0, 0.0, -0.1), drive=drive), "reel")
    own: dict[str, Any] = {"length": 20.0, "line_density": 0.01, "tip_mass": 0.5, "stiffness": 500.0 * elements / 20.0}
    system.add(parts.Thread(reel="reel", nodes=elements, mesh=mesh, wound_mass="carried", **(own | given)), "tether")
    return system


@pytest.mark.parametrize("end", [None, ("ground", (10.0, 1.0, 0.5))], ids=["free", "fixed"])
def test_energy_in_an_orbital_frame(end: Any) -> None:
    """The work of the frame's forces on all of the thread, with what is wound, and of the drive."""
    drive = parts.RampDrive(angle=100.0, rate=2.0, steps=((0.5, 1.0, 8.0), (2.0, 1.0, -8.0)))
    given = {"direction": (1.0, 0.2, 0.1)} if end is None else {"end": end, "damping": 1.0}
    found = run(in_orbit(0.5, drive, 6, **given).assemble(), np.linspace(0.0, 4.0, 9), rtol=1e-10, atol=1e-12)
    assert np.abs(found.energy_defect).max() < 1e-8 * found.energy.max()
    assert np.ptp(found.energy) > 0.01 * found.energy.max()


def test_librations_of_a_tether(book: Book) -> None:
    """In an orbital frame: 2 n across the orbit, sqrt(3) n within it, of second order in the elements."""
    rate, errors, elements = 1e-3, [], np.array([4, 8, 16])
    for n in elements:
        drive = parts.ConstantDrive(rate=0.0, angle=150.0)
        found = modes(in_orbit(rate, drive, int(n), stiffness=1e3 * int(n)).assemble(), count=2).frequency / rate
        errors.append(np.abs(found / np.array([math.sqrt(3.0), 2.0]) - 1.0))
    orders = fitted_order(1.0 / elements, np.array(errors)[:, 0])
    assert orders == pytest.approx(2.0, abs=0.15)
    book(
        "Modes", "Librations of a tether in orbit (moving mesh, 16 elements)", reference="sqrt(3) n and 2 n",
        source="closed form", error=errors[-1].max(), allowed=5e-4, order=orders, wanted="2",
    )  # fmt: skip


@pytest.mark.slow
def test_deployment_in_orbit_on_both_meshes() -> None:
    """Angle and distance of the tip against 80 lumped masses on a material mesh."""
    drive, t = parts.RampDrive(angle=20.0, rate=0.5, steps=((20.0, 20.0, 0.1),)), np.linspace(0.0, 100.0, 6)
    tips = []
    for mesh, nodes in (("moving", 8), ("material", 80)):
        system = in_orbit(0.05, drive, nodes, mesh=mesh, damping=20.0 * nodes / 80.0)
        found = system.simulate(until=100.0, every=20.0, method="generalized-alpha", step=1e-2, spectral_radius=0.3)
        tips.append(found["tether"].tip_position.values)
    assert np.ptp(tips[0][:, 1]) > 0.2
    assert t.size == len(tips[0])
    assert tips[0] == pytest.approx(tips[1], abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("drive", [REVERSING, FREE], ids=["both ways", "free"])
def test_generalized_alpha_is_of_second_order(drive: Any) -> None:
    """State and balance against those of Dormand and Prince's method."""
    t, steps, errors, defects = [0.0, 0.25], np.array([1e-3, 5e-4, 2.5e-4]), [], []
    exact = run(craft("free", drive, damping=0.1), t, rtol=1e-11, atol=1e-13)
    n_q = int(exact.assembly.model.info.nq)
    for step in steps:
        found = implicit(craft("free", drive, damping=0.1), t, step=float(step), spectral_radius=0.9)
        errors.append(np.abs(found.y[-1, :n_q] - exact.y[-1, :n_q]).max())
        defects.append(np.abs(found.energy_defect).max())
    assert fitted_order(steps, np.array(errors)) == pytest.approx(2.0, abs=0.15)
    assert fitted_order(steps, np.array(defects)) == pytest.approx(2.0, abs=0.3)


def test_an_impulse_on_the_body() -> None:
    """Linear and angular momentum of the whole change by it, and the nodes' velocities jump with the exit."""
    assembly = craft("free", REVERSING)
    model, y, s = assembly.model, assembly.y.copy(), assembly.s.copy()
    before = observe(model, np.zeros(1), y[None], s[None]).inventory[0]
    prepare(0.0, y, s, model)
    ship = int(assembly.names["ship"][1])
    model.bodies["F"][ship] = (0.3, -0.2, 0.1, 0.02, 0.05, -0.04)
    impulse(y, s, model)
    after = observe(model, np.zeros(1), y[None], s[None]).inventory[0]
    angular = [slice(at, at + 3) for at in (mdl.H_BODY, mdl.H_RELEASED, mdl.H_WOUND)]
    assert after[mdl.P_ALL :][:3] - before[mdl.P_ALL :][:3] == pytest.approx([0.3, -0.2, 0.1], abs=1e-12)
    gained = sum(after[at] - before[at] for at in angular)
    assert gained == pytest.approx([0.02, 0.05, -0.04], abs=1e-12)


def test_time_reversed() -> None:
    """Without damping and with all velocities turned round, what was paid out is reeled in, back to the start."""
    t = [0.0, 0.3]
    there = run(craft("free", parts.ConstantDrive(angle=20.0, rate=8.0)), t, rtol=1e-11, atol=1e-13)
    back = craft("free", parts.ConstantDrive(angle=22.4, rate=-8.0))
    n_q, n_v = int(back.model.info.nq), int(back.model.info.nv)
    back.y[:n_q], back.y[n_q : n_q + n_v] = there.y[-1, :n_q], -there.y[-1, n_q : n_q + n_v]
    found = run(back, t, rtol=1e-11, atol=1e-13)
    assert found.y[-1, :n_q] == pytest.approx(there.y[0, :n_q], abs=1e-8)
    assert found.y[-1, n_q : n_q + n_v] == pytest.approx(-there.y[0, n_q : n_q + n_v], abs=1e-6)


@pytest.mark.parametrize("sense", [1.0, -1.0], ids=["out", "in"])
def test_steady_lag(sense: float, book: Book) -> None:
    """On a hub at a constant rate a straight blade at sin(lag) = 2 v/(L0 W) stays so, at any length, both ways."""
    rate, lag = 6.0, sense * math.asin(2.0 * V / (L0 * 6.0))
    drive = parts.ConstantDrive(rate=sense * V / R, angle=(0.5 if sense > 0.0 else 2.0) / R)
    direction = (math.cos(lag), -math.sin(lag), 0.0)
    assembly = blade(4, motion="driven", rate=rate, drive=drive, direction=direction, copies=1, stiffness=2e5)
    found = implicit(assembly, np.linspace(0.0, 30.0, 31), step=1e-3, spectral_radius=0.9)
    assert abs(found.seen.spool[-1, 0, 0] - found.seen.spool[0, 0, 0]) * R == pytest.approx(1.05)
    error = max(np.abs(np.radians(found.lag(node)) / lag - 1.0).max() for node in range(4))
    book(
        CHAPTER, f"Straight blade at the steady lag, {'paid out' if sense > 0.0 else 'reeled in'} (moving mesh)",
        reference="sin(lag) = 2 v/(L0 W)", source="closed form", error=error, allowed=3e-4,
    )  # fmt: skip


def test_order_in_the_elements(book: Book) -> None:
    """From the steady lag the drive slows down to half its speed in 2 s: lag of the tip against 32 elements."""
    t, elements, lag = [0.0, 1.0, 2.0, 3.0], np.array([2, 4, 8]), math.asin(2.0 * V / (L0 * 6.0))
    drive = parts.RampDrive(angle=1.0 / R, rate=V / R, steps=((0.1, 2.0, 0.5 * V / R),))
    given: dict[str, Any] = {"direction": (math.cos(lag), -math.sin(lag), 0.0), "motion": "driven", "copies": 1}
    runs = [
        implicit(blade(int(n), drive=drive, stiffness=2e4 * n, **given), t, step=1e-3, spectral_radius=0.9)
        for n in (*elements, 32)
    ]
    errors = np.array([np.abs(found.lag() - runs[-1].lag()).max() for found in runs[:-1]])
    order = fitted_order(1.0 / elements, errors)
    assert order == pytest.approx(2.0, abs=0.15)
    book(
        CHAPTER, "Blade whose pay-out slows down, lag of the tip (moving mesh, 8 elements)", reference="32 elements",
        source="the same mesh, finer", error=errors[-1], allowed=2e-4, unit="deg", order=order, wanted="2",
    )  # fmt: skip


def test_drum_with_heavy_rope_and_weight(book: Book) -> None:
    """I 0.5, R 0.2, lam 0.3, L 20, M 2, x0 1: x(1 s) = 1.55693233 (validation.md); EA 1e6 N, one element."""
    system = System(gravity=(0.0, 0.0, -9.81))
    down: dict[str, Any] = {"payout_axis": (0.0, 0.0, -1.0), "spool_axis": (0.0, 1.0, 0.0)}
    system.add(parts.Reel(body="ground", radius=0.2, drive=parts.FreeSpool(inertia=0.5, angle=5.0), **down), "drum")
    rope = parts.Thread(
        reel="drum", length=20.0, line_density=0.3, tip_mass=2.0, nodes=1, stiffness=5e4, damping=5.0, mesh="moving"
    )
    system.add(rope)
    found = implicit(system.assemble(), [0.0, 0.5, 1.0], step=1e-3, spectral_radius=0.3)
    assert np.abs(found.energy_defect).max() < 1e-4 * found.energy.max()
    book(
        CHAPTER, "Drum, heavy rope and weight after 1 s (moving mesh, 1 element)", reference="1.55693233 m",
        source="closed form", error=abs(0.2 * found.seen.spool[-1, 0, 0] / 1.55693233 - 1.0), allowed=1e-4,
    )  # fmt: skip


@pytest.mark.slow
def test_modes_of_a_tether_that_turns(book: Book) -> None:
    """Without a hub: flap 1, 6, 15 and lag 0, 5, 14 of the spin squared, of second order in the elements."""
    W, errors, elements = 2.0, [], np.array([8, 16, 32])
    for n in elements:
        system = System()
        system.add(parts.RigidBody(motion="driven", rate=W, axis=(0.0, 0.0, 1.0)), "hub")
        drive = parts.ConstantDrive(rate=0.0, angle=10.0)
        system.add(parts.Reel(body="hub", centre=(0.0, 0.0, -0.1), radius=0.1, drive=drive), "reel")
        thread = parts.Thread(reel="reel", length=2.0, nodes=int(n), line_density=0.1, stiffness=5e5 * n, mesh="moving")
        system.add(thread)
        square = (modes(system.assemble(), rotating="hub", count=8).frequency / W) ** 2
        square = square[square > 0.5][:5]  # without the free turn
        assert square[0] == pytest.approx(1.0, abs=1e-6)  # exactly, of any chain that stays straight
        errors.append(np.abs(square[1:] / np.array([5.0, 6.0, 14.0, 15.0]) - 1.0))
    orders = fitted_order(1.0 / elements, np.array(errors)[:, 0])
    assert orders == pytest.approx(2.0, abs=0.15)
    book(
        "Modes", "Thread that turns without a hub: 5, 6, 14, 15 times the spin squared (moving mesh, 32 elements)",
        reference="Legendre polynomials", source="closed form", error=errors[-1].max(), allowed=2e-2, order=orders,
        wanted="2",
    )  # fmt: skip


@pytest.mark.slow
def test_tension_does_not_ring() -> None:
    """Third differences over 0.1 s of the tension at the exit, beside it: 5e-5 on a moving mesh, 0.045 on another."""
    t, ripples = np.linspace(10.0, 20.0, 101), {}
    for mesh, nodes in (("moving", 8), ("material", 20)):
        system = System()
        system.add(parts.RigidBody(motion="spin", inertia=0.004, rate=6.0), "hub")
        drive = parts.ConstantDrive(rate=3.5, angle=0.5)
        system.add(parts.Reel(body="hub", centre=(L0, 0.0, 0.0), radius=R, drive=drive), "reel")
        thread = parts.Thread(
            reel="reel", multiplicity=2, length=5.0, line_density=0.000735, tip_mass=0.0005, nodes=nodes,
            stiffness=500.0 * nodes, damping=5e-5 * nodes, wound_mass="carried", mesh=mesh,
        )  # fmt: skip
        system.add(thread, "blade")
        found = system.simulate(until=20.0, every=0.1, method="generalized-alpha", step=2.5e-3, spectral_radius=0.3)
        hub = np.interp(t, found.time.values, found["blade"].hub_tension.values)
        ripples[mesh] = np.abs(np.diff(hub, 3)).max() / hub.mean()
    page = " ".join((ROOT / "docs" / "theory" / "moving-nodes.md").read_text(encoding="utf-8").split())
    assert "are 5e-5 of the tension; with 20 nodes on a material mesh they are 0.045" in page
    assert ripples["moving"] == pytest.approx(5e-5, rel=0.3)
    assert ripples["material"] == pytest.approx(0.045, rel=0.2)
    assert ripples["material"] > 100.0 * ripples["moving"]


def test_what_is_refused() -> None:
    def composed(*, drive: Any = None, **given: Any) -> System:
        system = System()
        reel = parts.Reel(body="ground", radius=0.1, drive=drive or parts.ConstantDrive(rate=1.0, angle=5.0))
        system.add(reel, "reel")
        own: dict[str, Any] = {"length": 1.0, "line_density": 0.1, "nodes": 2, "mesh": "moving"}
        system.add(parts.Thread(reel="reel", **(own | given)), "tether")
        return system

    def built(**given: Any) -> Assembly:
        return composed(**given).assemble()

    with pytest.raises(InputError, match=r"mesh is 'moving'; it needs tether.segments 'springs', not 'inextensible'"):
        built(segments="inextensible")
    for given in ({"separates": True}, {"boundary_segment": "by-length"}):
        key = next(iter(given))
        with pytest.raises(InputError, match=rf"tether.{key} is .*, which mesh 'moving' does not support"):
            built(**given)
    with pytest.raises(InputError, match=r"0 m are out at the start; start with at least 0.001 m \(`angle` of reel"):
        built(drive=parts.ConstantDrive(rate=1.0))
    with pytest.raises(InputError, match=r"leaves too little of the thread 'tether' out .* needs 0.001 m"):
        composed(drive=parts.ConstantDrive(rate=-1.0, angle=5.0)).simulate(until=6.0, every=1.0, step=0.01)
    orbiting = composed(drive=parts.FreeSpool(inertia=1.0, angle=5.0))
    orbiting.add(parts.Field(type="orbit", rate=1e-3), "orbit")
    with pytest.raises(InputError, match=r"wound_mass 'carried' on a free spool, which the field 'orbit' does not"):
        orbiting.assemble()


@pytest.mark.parametrize("torque", [0.0, -0.5])
def test_a_free_spool_stops_the_run_at_the_ends(torque: float) -> None:
    """A hanging weight pulls all of the thread out, or a motor winds all but a thousandth of it."""
    system = System(gravity=(0.0, 0.0, -9.81))
    down: dict[str, Any] = {"payout_axis": (0.0, 0.0, -1.0), "spool_axis": (0.0, 1.0, 0.0)}
    drive = parts.FreeSpool(inertia=1e-2, angle=10.0, torque=torque)
    system.add(parts.Reel(body="ground", radius=0.05, drive=drive, **down), "drum")
    rope = parts.Thread(
        reel="drum", length=2.0, line_density=0.1, tip_mass=0.2, nodes=3, stiffness=500.0, mesh="moving"
    )
    system.add(rope)
    found = solve_implicit(system.assemble(), samples=[0.0, 5.0], step=1e-3)
    assert not found.success
    assert "outruns its thread" in found.message
