"""Threads that go slack, and threads on free spools, under generalized-alpha."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from book import Book
from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.solvers.common.observations import observe
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import Run, fitted_order, flying_apart, run, tangent_columns

G, RADIUS = 9.81, 0.05


def implicit(assembly: Assembly, samples: Any, **options: Any) -> Run:
    """Solve and observe; the run must end well."""
    found = solve_implicit(assembly, samples=samples, **{"spectral_radius": 0.9} | options)
    assert found.success, found.message
    return Run(assembly, found, observe(assembly.model, found.t, found.y, found.s))  # type: ignore[arg-type]


# ------------------------------------------------------------------------------------------------ slack


def two_ends(damping: float = 0.0) -> Assembly:
    """A body and a point mass, 5 cm too far apart for the thread between them."""
    system = System()
    system.add(parts.RigidBody(mass=4.0, inertia=1.0), "ship")
    drive = parts.ConstantDrive(rate=0.0, angle=10.0)
    system.add(parts.Reel(body="ship", radius=0.1, centre=(0.0, 0.0, -0.1), drive=drive), "reel")
    system.add(parts.Point(mass=1.5, position=(1.05, 0.0, 0.0)), "end")
    thread = {"stiffness": 30.0, "damping": damping, "slack": True, "end": "end"}
    system.add(parts.Thread(reel="reel", length=1.0, line_density=1e-9, nodes=1, **thread), "thread")
    return system.assemble()


def swinging(*, nodes: int, stiffness: float, damping: float = 0.0, slack: bool = True) -> Assembly:
    """A mass that falls past its reel into the thread, and swings."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.RigidBody(motion="driven"), "hub")
    drive = parts.ConstantDrive(rate=0.0, angle=10.0)
    reel = parts.Reel(body="hub", radius=0.1, payout_axis=(0.0, 0.0, -1.0), spool_axis=(0.0, 1.0, 0.0), drive=drive)
    system.add(reel, "reel")
    system.add(
        parts.Thread(
            reel="reel", length=1.0, line_density=0.1, tip_mass=0.5, nodes=nodes, stiffness=stiffness, damping=damping,
            slack=slack, direction=(0.6, 0.0, 0.8), boundary_segment="constant",
        ),
        "thread",
    )  # fmt: skip
    return system.assemble()


@pytest.mark.parametrize("damping", [0.0, 3.0])
@pytest.mark.parametrize("options", [{"step": 1e-3}, {"tolerance": 1e-7}], ids=["step", "tolerance"])
def test_a_slack_thread_lets_its_end_fly(options: dict[str, float], damping: float, book: Book) -> None:
    """Its tension is never below zero: its damper does not push either, and takes what the spring releases."""
    t = np.linspace(0.0, 2.0, 21)
    found = implicit(two_ends(damping), t, **options)
    per_mass = 1.0 / 4.0 + 1.0 / 1.5
    exact = 0.05 * flying_apart(t, 30.0 * per_mass, damping * per_mass)
    model = found.assembly.model
    apart = found.y[:, int(model.points["iq"][0])] - found.y[:, int(model.bodies["iq"][1])]
    error = np.abs(apart - 1.0 - exact).max() / 0.05
    allowed = 2e-4 if damping == 0.0 else 1e-3  # the force has a corner where the pull ends
    assert error < allowed
    assert found.seen.tension.min() >= 0.0
    assert np.all(found.seen.tension[t > 0.36] == 0.0)
    assert np.abs(found.solution.energy_defect).max() < 2e-4 * found.energy[0]
    how = "steps of 1 ms" if "step" in options else "tolerance 1e-7"
    book(
        "Threads, reels, tethers",
        f"Thread that goes slack between two bodies, damping {damping:g} N s/m (generalized-alpha, {how})",
        source="closed form", reference="damped oscillation while it pulls, then free flight", error=error,
        allowed=allowed,
    )  # fmt: skip


@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_slack_and_taut_again(damping: float) -> None:
    """A mass that falls into its thread again and again, as Dormand-Prince has it; energy balances."""
    t = np.linspace(0.0, 1.0, 21)
    given: dict[str, Any] = {"nodes": 3, "stiffness": 400.0, "damping": damping}
    exact = run(swinging(**given), t, rtol=1e-10, atol=1e-12)
    slack = np.any(exact.seen.tension == 0.0, axis=1)
    assert 5 < slack.sum() < 20
    found = implicit(swinging(**given), t, tolerance=1e-7)
    assert np.abs(found.seen.position - exact.seen.position).max() < 5e-4
    assert np.abs(found.solution.energy_defect).max() < 1e-4 * exact.energy.max()
    assert found.seen.tension.min() >= 0.0
    assert exact.seen.tension.min() >= 0.0


def test_stiff_segments_that_go_slack() -> None:
    """Segments of 1e7 N/m; a step of RK4 would be 50 us at most. Impacts are resolved, and gain no energy."""
    found = implicit(swinging(nodes=3, stiffness=1e7, damping=10.0), np.linspace(0.0, 1.0, 41), tolerance=1e-7)
    assert found.solution.statistics["steps"] < 20_000  # their vibration is resolved in its rates
    away = np.linalg.norm(found.seen.position[:, 0] - (0.1, 0.0, 0.0), axis=-1)
    assert away.min() < 0.7
    assert away.max() < 1.0 + 5e-3
    assert np.abs(found.solution.energy_defect).max() < 1e-2 * np.abs(found.solution.energy).max()


# ------------------------------------------------------------------------------------------------ free spools


def craft(motion: str, *, thickness: float = 0.0, slack: bool = False, end: bool = False, **drive: Any) -> Assembly:
    """A tumbling body with a reel off its centre; neither is symmetric."""
    system = System()
    turning: dict[str, Any] = {"motion": motion, "axis": (0.0, 0.6, 0.8), "inertia": 0.4, "rate": 2.0}
    if motion == "free":
        turning = {"mass": 4.0, "inertia": (0.3, 0.4, 0.5), "angular_velocity": (0.2, 0.5, 2.0)}
    system.add(parts.RigidBody(**turning), "ship")
    spool = parts.FreeSpool(**{"inertia": 2e-3, "angle": 1.02 / RADIUS, "rate": 1.0} | drive)
    system.add(parts.Reel(body="ship", radius=RADIUS, centre=(0.5, 0.1, -RADIUS), drive=spool), "reel")
    more: dict[str, Any] = {"tip_mass": 0.2}
    if end:
        place = parts.RigidBody(
            mass=1.0,
            inertia=0.1,
            position=(1.62, 0.1, 0.0),
            velocity=(0.1, 3.0, 0.0),
            points={"hook": (-0.1, 0.0, 0.0)},
        )
        system.add(place, "load")
        more = {"end": "load.hook"}
    system.add(
        parts.Thread(
            reel="reel", length=2.0, line_density=0.1, nodes=8, stiffness=2000.0, wound_mass="carried",
            thickness=thickness, slack=slack, boundary_segment="constant", **more,
        ),
        "tether",
    )  # fmt: skip
    return system.assemble()


DRIVES: dict[str, dict[str, Any]] = {
    "free": {},
    "motor": {"torque": 0.02, "law": "-0.01*v + 0.002*x*t", "viscous_damping": 1e-3, "friction_torque": 0.01},
    "brake": {"brake": 0.5, "profile": {"table": [[0.0, 0.0], [0.2, 0.6], [0.4, -0.6], [0.6, 0.0]]}},
    "slack tape": {"thickness": 1e-3, "slack": True},
}


@pytest.mark.parametrize("motion", ["free", "spin", "driven"])
@pytest.mark.parametrize("drive", [*DRIVES, "end", "stuck"])
def test_tangent(drive: str, motion: str, rng: np.random.Generator) -> None:
    """Against central differences of the residual, all unknowns."""
    given: dict[str, Any] = {"stuck": {"brake": 0.5, "rate": 0.0}, "end": {"end": True}}
    assembly = craft(motion, **(given | DRIVES)[drive])
    model, y, s = assembly.model, assembly.y.copy(), assembly.s
    model.switches[:] = s
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    out = 3 * int(s[0])
    y[int(model.threads["iq"][0]) :][:out] += 0.01 * rng.standard_normal(out)
    size = 1e-8 if drive == "stuck" else 1e-6
    found, differences = tangent_columns(assembly, y, rng, mass=100.0, size=size)
    spool = int(model.threads["spool_v"][0]) - n_q
    for k in range(n_v):
        assert np.abs(differences[:, k] - found[:, k]).max() < 1e-3 * np.abs(found[:, k]).max() + 2.0
    assert differences[spool, spool] == pytest.approx(found[spool, spool], rel=1e-4)


@pytest.mark.parametrize("motion", ["free", "spin", "driven"])
@pytest.mark.parametrize("drive", [*DRIVES, "end"])
def test_as_dormand_prince_has_it(drive: str, motion: str) -> None:
    """Coordinates and releases; energy of all, momenta of a free body with its spool and what its thread ends at."""
    given, t = ({"end": True} if drive == "end" else DRIVES[drive]), np.linspace(0.0, 0.8, 9)
    t = 0.75 * t if drive == "end" else t
    exact = run(craft(motion, **given), t, rtol=1e-9, atol=1e-11)
    found = implicit(craft(motion, **given), t, step=5e-4)
    n_q = int(found.assembly.model.info.nq)
    assert np.abs(found.y - exact.y)[:, :n_q].max() < 1e-3
    kinds = exact.solution.event_kinds[exact.solution.event_kinds < 2]  # the explicit method has those of the brake
    assert found.solution.event_kinds.tolist() == kinds.tolist()
    assert found.solution.event_times == pytest.approx(
        exact.solution.event_times[exact.solution.event_kinds < 2], abs=1e-3
    )
    assert np.abs(found.solution.energy_defect).max() < 3e-4 * found.energy.max()
    if motion == "free":
        H, P = found.momentum + found.wound_momentum - found.jumps, found.linear_momentum
        assert np.abs(H - H[0]).max() < 2e-4 * np.linalg.norm(H[0])
        assert np.abs(P - P[0]).max() < 2e-4 * np.abs(P).max()


def test_order_of_a_free_spool() -> None:
    """Up to the release of a node, at which the tension at the spool jumps; its time is found by the steps."""
    t, steps, errors = np.linspace(0.0, 0.55, 12), [2e-3, 1e-3, 5e-4], []
    exact = run(craft("free"), t, rtol=1e-10, atol=1e-12)
    for step in steps:
        found = implicit(craft("free"), t, step=step)
        errors.append(np.abs(found.seen.spool - exact.seen.spool)[:, 0, 0].max())
    assert fitted_order(steps, errors) == pytest.approx(2.0, abs=0.2)


def hoist(brake: float, *, rate: float = 0.0, stiffness: float = 1e6, **drive: Any) -> System:
    """A weight of 1.5 kg on a drum of 0.1 m and 0.02 kg m2, on a rope of springs."""
    system = System(gravity=(0.0, 0.0, -G))
    spool = parts.FreeSpool(inertia=0.02, angle=5.0, rate=rate, brake=brake, **drive)
    system.add(parts.RigidBody(motion="driven"), "wall")
    reel = parts.Reel(body="wall", radius=0.1, drive=spool, payout_axis=(0.0, 0.0, -1.0), spool_axis=(0.0, 1.0, 0.0))
    system.add(reel, "drum")
    rope = parts.Thread(
        reel="drum", length=4.0, line_density=1e-9, tip_mass=1.5, nodes=1, stiffness=stiffness, damping=300.0
    )
    system.add(rope, "rope")
    return system


WEIGHT = 1.5 * G * 0.1  # N m about the drum
INERTIA = 0.02 + 1.5 * 0.1**2


def test_a_weight_unwinds_a_drum(book: Book) -> None:
    """Constant acceleration, with a brake that slips; held by one that does not, without measurable creep."""
    for brake in (0.0, 1.0):
        found = hoist(brake).simulate(until=0.8, every=0.1, method="generalized-alpha", tolerance=1e-8)
        # the brake holds until the rope is stretched: the motion starts a millisecond late
        exact = (WEIGHT - brake) / INERTIA * found.time.values[1:]
        late = found["drum"].rate.values[1] - exact[0]
        assert 0.0 <= late < 0.03 if brake else abs(late) < 1e-4
        error = np.abs(found["drum"].rate.values[1:] - exact - late).max() / exact[-1]
        assert error < 2e-5
        energy = np.abs(found.energy_defect.values).max() / (WEIGHT * 0.5 * exact[-1] * 0.8)
        assert energy < 1e-4
        book(
            "Threads, reels, tethers", f"Drum with a weight, brake of {brake:g} N m (generalized-alpha): rate",
            reference="(m g r - tau) t/(I + m r^2)", source="closed form", error=error, allowed=2e-5,
        )  # fmt: skip
    holds = hoist(2.0, stiffness=1e4).simulate(until=0.8, every=0.1, fine=False, method="generalized-alpha")
    assert np.abs(holds["drum"].angle.values - 5.0).max() < 1e-6
    assert np.all(holds["drum"].stuck.values == 1.0)
    assert holds["drum"].friction_torque.values[4:] == pytest.approx(-WEIGHT, rel=1e-3)


@pytest.mark.parametrize("options", [{"step": 1e-3}, {"tolerance": 1e-7}], ids=["step", "tolerance"])
def test_a_brake_stops_the_drum(options: dict[str, float], book: Book) -> None:
    """From 3 rad/s it stops after v (I + m r^2)/(tau - m g r), and stays."""
    found = implicit(hoist(2.0, rate=3.0).assemble(), np.linspace(0.0, 0.6, 25), **options)
    stop = 3.0 * INERTIA / (2.0 - WEIGHT)
    error = abs(found.seen.spool[-1, 0, 0] - 5.0 - 1.5 * stop) / (1.5 * stop)
    assert error < 3e-3
    assert np.abs(found.seen.spool[found.t > stop + 0.01, 0, 1]).max() < 1e-3
    assert np.abs(found.solution.energy_defect).max() < 1e-3 * found.energy[0]
    how = "steps of 1 ms" if "step" in options else "tolerance 1e-7"
    book(
        "Threads, reels, tethers", f"Brake stops a drum with a weight (generalized-alpha, {how}): angle",
        reference="v^2 (I + m r^2)/2 (tau - m g r)", source="closed form", error=error, allowed=3e-3,
    )  # fmt: skip


def test_a_brake_lets_go_when_its_torque_is_exceeded() -> None:
    """A motor's torque grows by 1 N m/s."""
    given = hoist(2.0, stiffness=1e4, profile={"table": [[0.0, 0.0], [2.0, 2.0]]}).assemble()
    found = implicit(given, np.linspace(0.0, 0.8, 9), step=1e-3)
    over = found.t - (2.0 - WEIGHT)
    exact = np.where(over > 0.0, 0.5 * over**2 / INERTIA, 0.0)
    assert found.seen.spool[:, 0, 1] == pytest.approx(exact, abs=5e-3)


def test_the_end_of_the_thread() -> None:
    """A spool that outruns its thread fails the run with one sentence; with `separates` the thread leaves instead."""
    found = solve_implicit(hoist(0.0).assemble(), samples=np.linspace(0.0, 2.0, 21), step=2e-3)
    assert not found.success
    assert "outruns its thread" in found.message
    assert found.t.size > 5
