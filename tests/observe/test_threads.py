"""Threads and reels: against the raw state, and against springs written out here."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import evolvent
from evolvent import System, parts
from evolvent.analysis.settings import sample_times
from evolvent.families.threads.observer import curvature
from observe.seeing import Array, Seen, close, derivative, matrices, run

#: Cases of the heliogyro, and the motion of its body.
CASES = {
    "springs": {"blade.segments": "springs", "solver.duration": "3 s", "blade.nodes": 10},
    "inextensible": {
        "blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "6 s", "blade.nodes": 20,
    },
    "backwards": {
        "blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "3 s", "blade.nodes": 20,
        "body.rate": "-6 rad/s",
    },
    "implicit": {"blade.segments": "springs", "solver.method": "generalized-alpha", "solver.duration": "3 s",
                 "blade.nodes": 10},
    "free": {
        "blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "3 s", "blade.nodes": 20,
        "body.motion": "free", "body.mass": "2 kg",
    },
}  # fmt: skip


def heliogyro(overrides: dict[str, str]) -> Seen:
    """A run of the heliogyro: its solution, and the tree of that."""
    system = evolvent.load("heliogyro", overrides)
    settings = dict(system.settings)
    times = sample_times(settings.pop("until"), settings.pop("every"))
    del settings["fine"]
    return run(system, times, settings.pop("method"), **settings)


@pytest.mark.parametrize("which", list(CASES))
def test_a_blade_of_the_heliogyro(which: str) -> None:
    """Lag (19), tension at the spool, length and spool from positions in body axes, energies and momenta."""
    found = heliogyro(CASES[which])
    row, count = found.assembly.model.threads[0], found.solution.s[:, 0]
    name, reel, body = "blade-1", "reel-1", found.tree["body"]
    n, R = int(row["n"]), matrices(body["attitude"].values)
    released = count[:, None] > np.arange(n)
    arm = found.of(name, "position") - body["position"].values[:, None]
    x, y, z = np.moveaxis(np.einsum("tji,tnj->tni", R, arm) - [0.05, 0.0, 0.01], -1, 0)
    seen = released & (np.sqrt(x**2 + y**2 + z**2) > 1e-9)
    behind = -y if found.assembly.parts["body"].rate >= 0.0 else y
    if which == "free":
        behind = -y
    close(found.of(name, "lag"), np.where(seen, np.arctan2(np.hypot(y, z), x), np.nan), part=1e-7)
    close(found.of(name, "signed_lag"), np.where(seen, np.arctan2(behind, x), np.nan), part=1e-7)
    close(found.of(name, "tip_lag"), found.of(name, "signed_lag")[:, 0])
    close(found.of(name, "released"), released)
    close(found.of(name, "separated"), 0.0)
    tension = found.of(name, "tension")
    hub = np.array([values[max(k - 1, 0)] if k else 0.0 for values, k in zip(tension, count, strict=True)])
    close(found.of(name, "hub_tension"), hub)
    close(found.of(name, "deployed_length"), 0.035 * found.t)
    close(found.of(reel, "angle"), 3.5 * found.t)
    close(found.of(reel, "rate"), 3.5)
    close(found.of(reel, "torque"), 0.01 * hub)
    # the pull acts along the last segment, at the point of departure
    line, pull = found.of(name, "line"), found.of(name, "hub_force")
    Q = np.einsum("tij,j->ti", R, [0.05, 0.0, 0.01]) + body["position"].values
    close(line[:, -1], Q)
    close(found.of(name, "hub_position"), Q)
    late = np.flatnonzero(count > 0)[5:]
    last = np.array([found.of(name, "position")[k, count[k] - 1] for k in late]) - Q[late]
    close(pull[late], hub[late, None] * last / np.linalg.norm(last, axis=1)[:, None], part=1e-7)
    # energies and momenta: the blades' own and the body's are all there is
    root = found.tree
    blades = [k for k in root.children if k.startswith("blade")]
    kinetic = body["energy_kinetic"].values + sum(found.of(k, "energy_kinetic") for k in blades)
    close(kinetic, root["energy_kinetic"].values)
    close(sum(found.of(k, "energy_elastic") for k in blades) + 1.0, root["energy_elastic"].values + 1.0)
    total = body["angular_momentum"].values[:, 2] + sum(found.of(k, "angular_momentum")[:, 2] for k in blades)
    mass = float(found.assembly.parts["body"].mass or 0.0)
    total = total + mass * np.cross(body["position"].values, body["velocity"].values)[:, 2]
    close(total, root["angular_momentum"].values[:, 2], part=1e-9)


def test_curvature_of_a_circle() -> None:
    """1/r at all inner points, none at the ends and where points coincide."""
    angle = np.array([[0.0, 0.3, 0.5, 0.9, 0.9]])
    x = np.stack([2.5 * np.cos(angle), 2.5 * np.sin(angle), np.zeros((1, 5))], axis=-1)
    assert curvature(x)[0] == pytest.approx([np.nan, 0.4, 0.4, np.nan, np.nan], nan_ok=True)


def hanging(drive: object) -> System:
    system = System(gravity=(0.0, 0.0, -2.0))
    system.add(parts.RigidBody(motion="driven"), "base")
    reel = parts.Reel(
        body="base",
        radius=0.1,
        drive=drive,
        centre=(0.0, 0.1, 0.0),
        payout_axis=(0.0, 0.0, -1.0),
        spool_axis=(1.0, 0.0, 0.0),
    )
    system.add(reel, "reel")
    thread = parts.Thread(
        reel="reel",
        length=1.0,
        line_density=0.1,
        tip_mass=0.2,
        nodes=5,
        stiffness=400.0,
        damping=2.0,
        boundary_segment="constant",
    )
    system.add(thread, "thread")
    return system


def test_tensions_of_springs_under_both_methods() -> None:
    """Each segment pulls with c (length - l0) + d length', also under the implicit method, and both runs agree."""
    seen = {}
    for method, options in (("rk4", {"step": 5e-4}), ("generalized-alpha", {"step": 1e-3})):
        found = run(hanging(parts.ConstantDrive(rate=1.0, angle=5.0)), np.linspace(0.0, 1.0, 21), method, **options)
        x, v = (a.reshape(21, 5, 3) for a in (found.state("thread", 15), found.state("thread", 15, rate=True)))
        tension, count = found.of("thread", "tension"), found.solution.s[:, 0]
        for k in range(21):
            for i in range(int(count[k]) - 1):
                e = x[k, i] - x[k, i + 1]
                length = np.linalg.norm(e)
                wanted = 400.0 * (length - 0.2) + 2.0 * (v[k, i] - v[k, i + 1]) @ e / length
                assert tension[k, i] == pytest.approx(wanted, abs=1e-9)
            last = int(count[k]) - 1  # the boundary segment is let out by the spool
            Q = np.array([0.0, 0.0, 0.0]) + found.assembly.model.threads["departure"][0]
            e = x[k, last] - Q
            length, out = np.linalg.norm(e), 0.1 * (5.0 + found.t[k]) - 0.2 * last
            rate = v[k, last] @ e / length - 0.1 * (np.array([0.0, 0.0, -1.0]) @ e) / length
            assert tension[k, last] == pytest.approx(400.0 * (length - out) + 2.0 * rate, abs=1e-8)
            assert np.all(np.isnan(tension[k, last + 1 :]))
        close(found.of("thread", "deployed_length"), 0.1 * (5.0 + found.t))
        close(found.of("reel", "rate"), 1.0)
        close(found.of("reel", "torque"), 0.1 * found.of("thread", "hub_tension"))
        rows = count[:, None] > np.arange(5)
        masses = np.array([0.2 + 0.01, 0.02, 0.02, 0.02, 0.02])
        kinetic = 0.5 * np.sum(np.where(rows, masses * np.sum(v**2, axis=-1), 0.0), axis=1)
        close(found.of("thread", "energy_kinetic"), kinetic)
        close(found.of("thread", "momentum"), np.sum(np.where(rows[..., None], masses[:, None] * v, 0.0), axis=1))
        seen[method] = found
    one, two = (seen[m].of("thread", "hub_tension") for m in seen)
    close(one[2:], two[2:], part=0.15)
    close(one.mean(), two.mean(), part=0.02)


def test_a_free_spool() -> None:
    """It turns by the thread's pull: J phi'' = r T, and its energy is the thread's."""
    drive = parts.FreeSpool(inertia=0.01, angle=5.0, rate=0.5)
    found = run(hanging(drive), np.linspace(0.0, 0.3, 601), "rk4", step=1e-4)
    model = found.assembly.model
    at = int(model.threads["spool_q"][0]), int(model.threads["spool_v"][0])
    angle, rate = (found.solution.y[:, k] for k in at)
    close(found.of("reel", "angle"), angle)
    close(found.of("reel", "rate"), rate)
    smooth: Array = np.flatnonzero(np.all([np.roll(found.solution.s[:, 0], k)[2:-2] == found.solution.s[2:-2, 0]
                                           for k in range(-3, 4)], axis=0))  # fmt: skip
    wanted = 0.01 * derivative(found.t, rate)
    close(found.of("reel", "torque")[2:-2][smooth], wanted[smooth], part=5e-3)
    v = found.state("thread", 15, rate=True).reshape(-1, 5, 3)
    rows = found.solution.s[:, :1] > np.arange(5)
    masses = np.array([0.21, 0.02, 0.02, 0.02, 0.02])
    kinetic = 0.5 * np.sum(np.where(rows, masses * np.sum(v**2, axis=-1), 0.0), axis=1) + 0.5 * 0.01 * rate**2
    close(found.of("thread", "energy_kinetic"), kinetic)


def from_a_satellite(drive: parts.RampDrive, *, spool_axis: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> System:
    """A reel on a satellite that spins about z pays out a thread of nearly no mass with an end mass of 1 kg."""
    system = System()
    inertia = (15.0, 20.0, 20.0)
    system.add(parts.RigidBody(mass=100.0, inertia=inertia, angular_velocity=(0.0, 0.0, 0.5)), "satellite")
    system.add(
        parts.Reel(
            body="satellite", radius=0.05, centre=(0.5, 0.0, 0.0), payout_axis=(1.0, 0.0, 0.0), spool_axis=spool_axis,
            drive=drive,
        ),
        "reel",
    )  # fmt: skip
    thread = parts.Thread(
        reel="reel",
        length=10.0,
        line_density=1e-6,
        nodes=10,
        tip_mass=1.0,
        segments="inextensible",
        direction=(1, 0, 0),
    )
    system.add(thread, "tether")
    return system


@pytest.mark.slow
def test_lag_of_a_thread_whose_spool_turns_about_the_spin_axis() -> None:
    """Rate of the satellite and lag of the end mass: those of two bodies on a straight thread, by SciPy."""
    every, spin_up = 1.0, 5.0
    run = from_a_satellite(parts.RampDrive(rate=0.0, angle=10.0, steps=[(0.0, spin_up, 2.0)])).simulate(
        until=60.0, every=every, tolerance=1e-9
    )
    M, J, m = 100.0, 20.0, 1.0
    arm = np.array([0.5, -0.05])  # the thread leaves at the spool's centre + radius (X x Y)

    def length(t: float) -> tuple[float, float, float]:
        """Of the thread, its rate and acceleration: the spool's rate grows by a quintic step."""
        s = min(t / spin_up, 1.0)
        angle = 10.0 + 2.0 * (spin_up * (s**6 - 3.0 * s**5 + 2.5 * s**4) + max(t - spin_up, 0.0))
        growth = 30.0 * s**4 - 60.0 * s**3 + 30.0 * s**2
        return 0.05 * angle, 0.1 * (6.0 * s**5 - 15.0 * s**4 + 10.0 * s**3), 0.1 * growth / spin_up

    def rates(t: float, y: Array) -> list[float]:
        th, w, al, al_t = y
        q = np.array([[np.cos(th), -np.sin(th)], [np.sin(th), np.cos(th)]]) @ arm
        across, e = np.array([-q[1], q[0]]), np.array([np.cos(al), np.sin(al)])
        moment, (L, L_t, L_tt) = q[0] * e[1] - q[1] * e[0], length(t)
        T = (w * w * (q @ e) - L_tt + L * al_t**2) / (1.0 / M + 1.0 / m + moment * (across @ e) / J)
        w_t = T * moment / J
        hook = T * e / M + w_t * across - w * w * q  # acceleration of the point where the thread leaves
        return [w, w_t, al_t, -(hook @ np.array([-e[1], e[0]]) + 2.0 * L_t * al_t) / L]

    found = solve_ivp(rates, (0.0, 60.0), [0.0, 0.5, 0.0, 0.5], t_eval=run.time.values, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(run["satellite"].rate.sel(axis="z"), found.y[1], rtol=0.0, atol=2e-6)
    np.testing.assert_allclose(run["tether"].tip_lag, found.y[0] - found.y[2], rtol=0.0, atol=2e-5)
    assert abs(run["tether"].tip_lag).max() > 0.5  # it swings far in the plane of the spin
    assert "warning" not in run.attrs


def test_lag_on_a_body_that_does_not_spin() -> None:
    """Without a plane of the spin the signed lag is that in the plane of pay-out axis and spool axis."""
    system = System()
    system.add(parts.RigidBody(mass=1e6, inertia=1e6), "satellite")
    drive = parts.RampDrive(rate=0.0, angle=10.0)
    system.add(parts.Reel(body="satellite", radius=0.05, drive=drive, spool_axis=(0.0, 1.0, 0.0)), "reel")
    thread = parts.Thread(reel="reel", length=10.0, line_density=1.0, nodes=20, segments="inextensible")
    system.add(thread, "tether")
    system.add(parts.Load(along="tether", force=(1.0, 0.2, 0.0)), "wind")
    found = system.simulate(until=0.3)["tether"]
    assert float(found.lag.max()) > 0.005
    np.testing.assert_allclose(found.tip_lag, -found.lag.isel(node=0), atol=1e-9)


def test_a_thread_that_pushes_is_warned_of() -> None:
    """A spool that speeds up by 1 m/s2 pushes an end mass that flies off by 0.25 m/s2: the warning names the thread."""
    system = from_a_satellite(parts.RampDrive(rate=0.0, angle=10.0, steps=[(0.0, 1.0, 20.0)]))
    warning = system.simulate(until=5.0).attrs["warning"]
    assert warning.startswith("'tether' pushes where a thread would go slack: tension below zero in ")


@pytest.mark.parametrize(("speed", "warned"), [(0.05, False), (0.15, True), (0.2, True), (0.4, True)])
def test_a_tether_that_is_paid_out_too_fast_is_warned_of(speed: float, warned: bool) -> None:
    """No steady lag exists above 0.125 m/s: the tension falls below zero by less than a thousandth of its largest."""
    system = System()
    satellite = parts.RigidBody(mass=100.0, inertia=(15.0, 20.0, 20.0), angular_velocity=(0.0, 0.0, 0.5))
    system.add(satellite, "satellite")
    drive = parts.RampDrive(rate=0.0, angle=10.0, steps=[(0.0, 5.0, speed / 0.05)])
    axes = {"payout_axis": (1.0, 0.0, 0.0), "spool_axis": (0.0, 0.0, 1.0)}
    system.add(parts.Reel(body="satellite", radius=0.05, centre=(0.5, 0.0, 0.0), drive=drive, **axes), "reel")
    thread = parts.Thread(reel="reel", length=11.0, line_density=1e-3, tip_mass=1.0, segments="inextensible")
    system.add(thread, "tether")
    run = system.simulate(until=10.0 / speed, every=0.25)
    assert (float(run["tether"].hub_tension.min()) < 0.0) is warned
    assert ("pushes where a thread would go slack" in run.attrs.get("warning", "")) is warned
