"""Free spools on bodies that move: motor, brake, friction; tapes wound in a spiral."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp

from book import Book
from evolvent import InputError, System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.parts.registry import read_parts
from helpers import Run, fitted_order, run

G, RADIUS = 9.81, 0.05


def craft(segments: str, motion: str, *, thickness: float = 0.0, **drive: Any) -> Assembly:
    """A tumbling body with a reel off its centre; neither is symmetric."""
    system = System()
    turning: dict[str, Any] = {"motion": motion, "axis": (0.0, 0.6, 0.8), "inertia": 0.4, "rate": 2.0}
    if motion == "free":
        turning = {"mass": 4.0, "inertia": (0.3, 0.4, 0.5), "angular_velocity": (0.2, 0.5, 2.0)}
    system.add(parts.RigidBody(**turning), "ship")
    spool = parts.FreeSpool(**{"inertia": 2e-3, "angle": 1.02 / RADIUS, "rate": 1.0} | drive)
    system.add(parts.Reel(body="ship", radius=RADIUS, centre=(0.5, 0.1, -RADIUS), drive=spool), "reel")
    system.add(
        parts.Thread(
            reel="reel", length=2.0, line_density=0.1, nodes=8, tip_mass=0.2, stiffness=2000.0, segments=segments,
            wound_mass="carried", thickness=thickness,
        ),
        "tether",
    )  # fmt: skip
    return system.assemble()


DRIVES: dict[str, dict[str, Any]] = {
    "free": {},
    "motor": {"torque": 0.02, "law": "-0.01*v + 0.002*x*t", "viscous_damping": 1e-3, "friction_torque": 0.01},
    "brake": {"brake": 0.5, "profile": {"table": [[0.0, 0.0], [0.2, 0.6], [0.4, -0.6], [0.6, 0.0]]}},
    "tape": {"thickness": 1e-3},
}


@pytest.mark.parametrize("motion", ["free", "spin", "driven"])
@pytest.mark.parametrize("segments", ["springs", "inextensible"])
@pytest.mark.parametrize("drive", DRIVES)
def test_balances(drive: str, segments: str, motion: str) -> None:
    """Energy of all; momenta of a free body with its spool."""
    found = run(craft(segments, motion, **DRIVES[drive]), np.linspace(0.0, 0.8, 9), rtol=1e-9, atol=1e-11)
    assert found.solution.event_times.size > 0
    # the chains are held to the constraints of their lengths by projection
    assert np.abs(found.energy_defect).max() < (1e-7 if segments == "springs" else 1e-6) * found.energy[0]
    if motion == "free":
        H, P = found.momentum + found.wound_momentum - found.jumps, found.linear_momentum
        assert np.abs(H - H[0]).max() < 1e-8 * np.linalg.norm(H[0])
        assert np.abs(P - P[0]).max() < 1e-8 * np.abs(P).max()


def test_a_motor_turns_body_and_spool_against_each_other(book: Book) -> None:
    """Without a thread to speak of: w' = -tau/(J - I), phi'' = tau/I + tau/(J - I)."""
    J, inertia, torque = 0.5, 0.02, 0.03
    system = System()
    system.add(parts.RigidBody(mass=4.0, inertia=J), "ship")
    drive = parts.FreeSpool(inertia=inertia, torque=torque, angle=1.0)
    reel = parts.Reel(body="ship", radius=0.1, drive=drive, payout_axis=(1.0, 0.0, 0.0), spool_axis=(0.0, 0.0, 1.0))
    system.add(reel, "reel")
    system.add(parts.Thread(reel="reel", length=1.0, line_density=1e-12, nodes=1, stiffness=1e-9), "thread")
    t = np.linspace(0.0, 1.0, 5)
    found = run(system.assemble(), t, rtol=1e-11, atol=1e-13)
    rate = torque * t * (1.0 / inertia + 1.0 / (J - inertia))
    error = max(
        np.abs(found.rate() + torque * t / (J - inertia)).max() / (torque / (J - inertia)),
        np.abs(found.seen.spool[:, 0, 1] - rate).max() / rate[-1],
    )
    assert error < 1e-7
    book(
        "Threads, reels, tethers", "Motor of a spool on a free body: rates of both", reference="-tau t/(J - I)",
        source="closed form", error=error, allowed=1e-7,
    )  # fmt: skip


def hoist(brake: float, *, rate: float = 0.0, **drive: Any) -> System:
    """A weight of 1.5 kg on a drum of 0.1 m and 0.02 kg m2; the thread's own mass is in the weight's node."""
    system = System(gravity=(0.0, 0.0, -G))
    spool = parts.FreeSpool(inertia=0.02, angle=5.0, rate=rate, brake=brake, **drive)
    reel = parts.Reel(body="ground", radius=0.1, drive=spool, payout_axis=(0.0, 0.0, -1.0), spool_axis=(0.0, 1.0, 0.0))
    system.add(reel, "drum")
    thread = parts.Thread(reel="drum", length=4.0, line_density=1e-9, tip_mass=1.5, nodes=1, segments="inextensible")
    system.add(thread, "rope")
    return system


WEIGHT = 1.5 * G * 0.1  # N m about the drum
INERTIA = 0.02 + 1.5 * 0.1**2


def test_a_brake_that_slips_and_one_that_holds(book: Book) -> None:
    slips = hoist(1.0).simulate(until=0.8, every=0.1, method="dopri5", tolerance=1e-10)
    exact = (WEIGHT - 1.0) / INERTIA * slips.time.values
    error = np.abs(slips["drum"].rate.values - exact).max() / exact[-1]
    assert error < 1e-7
    holds = hoist(2.0).simulate(until=0.8, every=0.1, method="dopri5")
    assert np.all(holds["drum"].rate.values == 0.0)
    assert np.all(holds["drum"].stuck.values == 1.0)
    assert holds["drum"].friction_torque.values == pytest.approx(-WEIGHT, rel=1e-8)
    book(
        "Threads, reels, tethers", "Drum with a weight and a brake that slips: rate",
        reference="(m g r - tau) t/(I + m r^2)", source="closed form", error=error, allowed=1e-7,
    )  # fmt: skip


@pytest.mark.parametrize("method", ["dopri5", "rk4"])
def test_a_brake_stops_the_drum(method: str, book: Book) -> None:
    """From 3 rad/s it stops after v (I + m r^2)/(tau - m g r), and stays."""
    step = {"step": 0.01} if method == "rk4" else {"rtol": 1e-10, "atol": 1e-12}
    found = run(hoist(2.0, rate=3.0).assemble(), np.linspace(0.0, 0.6, 25), method, **step)
    stop = 3.0 * INERTIA / (2.0 - WEIGHT)
    assert found.solution.event_times == pytest.approx([stop], rel=1e-6)
    angle = found.seen.spool[-1, 0, 0]
    assert angle == pytest.approx(5.0 + 1.5 * stop, rel=1e-7)
    assert np.abs(found.energy_defect).max() < 1e-7 * found.energy[0]
    book(
        "Threads, reels, tethers", f"Brake stops a drum with a weight ({method}): time",
        reference="v (I + m r^2)/(tau - m g r)", source="closed form",
        error=abs(found.solution.event_times[0] / stop - 1.0), allowed=1e-6,
    )  # fmt: skip


def test_a_brake_lets_go_when_its_torque_is_exceeded() -> None:
    """A motor's torque grows by 1 N m/s; then by steps, forwards and backwards."""
    found = run(hoist(2.0, profile={"table": [[0.0, 0.0], [2.0, 2.0]]}).assemble(), np.linspace(0.0, 0.8, 9))
    assert found.solution.event_times == pytest.approx([2.0 - WEIGHT], abs=1e-7)
    over = found.t - (2.0 - WEIGHT)
    assert found.seen.spool[:, 0, 1] == pytest.approx(np.where(over > 0.0, 0.5 * over**2 / INERTIA, 0.0), abs=1e-6)
    jumps = {"table": [[0.0, 0.0], [0.3, 0.0], [0.3, 1.0], [0.4, 1.0], [0.4, -4.0], [2.0, -4.0]]}
    for method, options in (("dopri5", {}), ("rk4", {"step": 0.01})):
        found = run(hoist(2.0, profile=jumps).assemble(), [0.0, 0.3, 0.4, 0.45], method, **options)
        up, stop, down = WEIGHT - 1.0, 6.0 - WEIGHT, WEIGHT - 2.0  # N m: slips up, stops, slips back
        left = 0.05 - 0.1 * up / stop  # s, from the stop on
        exact = [0.0, 0.0, 0.1 * up / INERTIA, left * down / INERTIA]
        assert found.seen.spool[:, 0, 1] == pytest.approx(exact, abs=1e-6)


def test_viscous_friction_limits_the_rate() -> None:
    """The rate goes to m g r/c as 1 - exp(-c t/(I + m r^2))."""
    c = 0.4
    found = run(hoist(0.0, viscous_damping=c).assemble(), np.linspace(0.0, 0.5, 6), rtol=1e-10, atol=1e-12)
    exact = WEIGHT / c * (1.0 - np.exp(-c * found.t / INERTIA))
    assert found.seen.spool[:, 0, 1] == pytest.approx(exact, rel=1e-6)
    assert np.abs(found.energy_defect).max() < 1e-7 * np.abs(found.energy).max()


# ------------------------------------------------------------------------------------------------ tapes

TAPE, CORE, OUTER, DENSITY, LOAD = 20.0, 0.1, 0.3, 0.3, 2.0
THICKNESS = math.pi * (OUTER**2 - CORE**2) / TAPE


def tape(nodes: int, drive: Any) -> Run:
    """A heavy tape with a weight on a drum, 1 s."""
    system = System(gravity=(0.0, 0.0, -G))
    reel = parts.Reel(
        body="ground", radius=OUTER, drive=drive, payout_axis=(0.0, 0.0, -1.0), spool_axis=(0.0, 1.0, 0.0)
    )
    system.add(reel, "drum")
    thread = parts.Thread(
        reel="drum", length=TAPE, line_density=DENSITY, tip_mass=LOAD, nodes=nodes, segments="inextensible",
        wound_mass="carried", thickness=THICKNESS,
    )  # fmt: skip
    system.add(thread, "tape")
    return run(system.assemble(), np.linspace(0.0, 1.0, 5), rtol=1e-9, atol=1e-11)


def test_length_of_a_spiral(book: Book) -> None:
    """The length paid out is that of an Archimedean spiral: int r dphi, r^2 = core^2 + wound thickness/pi."""
    system = System()
    reel = parts.Reel(body="ground", radius=OUTER, drive=parts.ConstantDrive(rate=20.0, angle=3.0))
    system.add(reel, "drum")
    system.add(
        parts.Thread(reel="drum", length=TAPE, line_density=0.3, segments="inextensible", thickness=THICKNESS), "tape"
    )
    found = system.simulate(until=3.0, every=0.5)
    angle, out = found["drum"].angle.values, found["tape"].deployed_length.values
    exact = solve_ivp(
        lambda _, length: np.sqrt(CORE**2 + (TAPE - length) * THICKNESS / math.pi), (0.0, angle[-1]), [0.0],
        t_eval=angle, rtol=1e-12, atol=1e-14,
    ).y[0]  # fmt: skip
    error = np.abs(out - exact).max() / exact[-1]
    assert error < 1e-10
    assert found["drum"].radius.values == pytest.approx(np.sqrt(CORE**2 + (TAPE - out) * THICKNESS / math.pi))
    book(
        "Threads, reels, tethers", "Tape on a spiral spool: length against angle",
        reference="R^2 = core^2 + w thickness/pi", source="differential equation", error=error, allowed=1e-10,
    )  # fmt: skip


def test_drum_with_a_heavy_tape(book: Book) -> None:
    """Energy gives the speed: [M + lam x + (I + k)/R^2] v^2/2 = M g y + lam g (x^2 - x0^2)/2, k of the annulus."""
    inertia, start = 0.5, 1.0
    c = 0.5 * THICKNESS / math.pi
    first = (OUTER - math.sqrt(OUTER**2 - 2.0 * c * start)) / c

    def speed(x: float) -> float:
        square = CORE**2 + (TAPE - x) * THICKNESS / math.pi
        k = 0.5 * DENSITY * (TAPE - x) * (CORE**2 + square)
        work = LOAD * G * (x - start) + 0.5 * DENSITY * G * (x**2 - start**2)
        return math.sqrt(2.0 * work / (LOAD + DENSITY * x + (inertia + k) / square))

    # x = start + u^2, whose rate does not vanish at the start
    def rate(_: float, u: np.ndarray) -> list[float]:
        u0 = max(float(u[0]), 1e-6)
        return [speed(start + u0 * u0) / (2.0 * u0)]

    exact = start + solve_ivp(rate, (0.0, 1.0), [1e-6], rtol=1e-10, atol=1e-12).y[0, -1] ** 2
    nodes, errors = np.array([40, 80, 160]), []
    for n in nodes:
        found = tape(n, parts.FreeSpool(inertia=inertia, angle=first))
        phi = found.seen.spool[-1, 0, 0]
        errors.append(abs(OUTER * phi - 0.5 * c * phi**2 - exact) / exact)
        assert np.abs(found.energy_defect).max() < 1e-6 * np.abs(found.energy).max()
    assert errors[-1] < 2e-3
    assert fitted_order(1.0 / nodes, np.array(errors)) > 0.9
    book(
        "Threads, reels, tethers", "Drum, heavy tape on a spiral and weight after 1 s (160 nodes)",
        reference="energy of the annulus", source="differential equation", error=errors[-1], allowed=2e-3,
        order=fitted_order(1.0 / nodes, np.array(errors)), wanted="about 1",
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ files, refusals

FILE = """
ship: {kind: rigid-body, mass: 4 kg, inertia: 0.5 kg m^2}
satellite: {kind: rigid-body, mass: 1 kg, inertia: 0.1 kg m^2, position: [1, 0, 0 m], points: {hook: [-10, 0, 0 cm]}}
reel:
  kind: reel
  body: ship
  radius: 10 cm
  centre: [0, 0, -10 cm]
  drive:
    free: {inertia: 1 g m^2, angle: 9 rad, brake: 10 mN m, friction_torque: 1 mN m, viscous_damping: 1e-4 N m s/rad,
           profile: {ramp: {final: 20 mN m, duration: 1 s}}, law: -k*v, constants: {k: 0.001}}
tether: {kind: thread, reel: reel, length: 5 m, line_density: 1 g/m, thickness: 0.1 mm, end: satellite.hook,
         stiffness: 100 N/m, nodes: 5}
"""


def test_a_file() -> None:
    """The file is the program, there and back; it runs."""
    found = read_parts(yaml.safe_load(FILE))
    drive = found["reel"].drive
    assert (drive.inertia, drive.brake, drive.friction_torque, drive.viscous_damping) == (1e-3, 0.01, 1e-3, 1e-4)
    again = read_parts(yaml.safe_load(yaml.safe_dump({name: part.as_keys() for name, part in found.items()})))
    assert again == found
    system = System()
    c = 0.25 * 1e-4 / math.pi
    angle = 0.9 * 2.0 / (0.1 + math.sqrt(0.01 - 4.0 * c * 0.9))
    for name, part in found.items():
        own = part if name != "reel" else part.replaced(drive=drive.replaced(angle=angle))
        system.add(own, name)
    ran = system.simulate(until=0.5, every=0.1, method="rk4")
    assert {"motor_torque", "friction_torque", "stuck", "radius"} <= set(ran["reel"].data_vars)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"inertia": 2.0}, r"reel.drive.inertia is 2.0 kg m2; the inertia of 'ship' includes it; it must be below"),
        ({"brake": -0.1}, "FreeSpool.brake is -0.1"),
        ({"friction_torque": -0.1}, "FreeSpool.friction_torque is -0.1"),
        ({"thickness": 4e-3}, r"tether.thickness is 0.004 m, which leaves no core.*below 0.0039"),
    ],
)
def test_refusals(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        craft("springs", "free", **changes)


def slow_tape(rate: float, length: float) -> System:
    """A thin stiff tape that a drive pays out at a constant rate from a body that is turned slowly, in a spiral."""
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=0.1, axis=(0.0, 0.0, 1.0)), "hub")
    drive = parts.ConstantDrive(rate=rate)
    system.add(
        parts.Reel(
            body="hub", radius=0.03, centre=(0.5, 0, 0), payout_axis=(1, 0, 0), spool_axis=(0, 0, 1), drive=drive
        ),
        "reel",
    )
    system.add(
        parts.Thread(
            reel="reel",
            length=length,
            line_density=6e-3,
            nodes=7,
            stiffness=1.5e4,
            damping=0.15,
            thickness=3e-4,
        ),
        "tape",
    )
    return system


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [None, 1e-5])
def test_the_work_of_a_drive_where_nodes_leave(tolerance: float | None) -> None:
    """A node leaves with a short pull that no step resolves: it is no work. The explicit method resolves it."""
    run = slow_tape(2.7, 4.3).simulate(
        until=30.0, every=0.6, method="generalized-alpha", tolerance=tolerance, fine=False
    )
    exact = slow_tape(2.7, 4.3).simulate(until=30.0, every=0.6, method="rk4", fine=False)
    for name in ("work_spools", "work_drives"):
        largest = float(np.abs(exact[name].values).max())
        assert np.abs(run[name].values - exact[name].values).max() < 0.05 * largest, name
    apart = run["tape"].position.values[-1, 0] - exact["tape"].position.values[-1, 0]
    assert np.linalg.norm(apart) < 1e-2
