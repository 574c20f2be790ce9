"""Reels, drums and threads against closed forms (shared/models/thread.md and shared/validation.md)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import j1

from book import Book
from evolvent import parts
from evolvent.analysis.system import System
from helpers import (
    L0,
    RHO,
    TIP,
    W0,
    J,
    L,
    R,
    V,
    across,
    derivative,
    eigenvalues,
    fitted_order,
    heliogyro,
    rotating_accelerations,
    run,
    steady_lag,
    stiffness_matrix,
)

G = 9.81


def straight(segments: str, out: float, spool: float, rate: float = W0, **thread: object) -> object:
    """A driven body, a thread `out` metres out along the lag of steady pay-out."""
    lag = steady_lag(rate, speed=spool * R)
    direction = (math.cos(lag), -math.sin(lag), 0.0)
    return heliogyro(motion="driven", rate=rate, spool=spool, out=out, direction=direction, segments=segments, **thread)


@pytest.mark.slow
@pytest.mark.parametrize(("out", "released"), [(1.35, 4.29), (3.0 * L / 20.0, 7.15)])
@pytest.mark.parametrize(("segments", "method"), [("inextensible", "dopri5"), ("springs", "rk4")])
def test_straight_blade_stays_straight(segments: str, method: str, out: float, released: float, book: Book) -> None:
    """Constant rate and drive: the straight blade at sin delta = 2 v / (L0 W) holds to 1e-6 rad through releases.

    For every distribution of mass (here the tip's) and every length; thread.md calls it the sharpest test of a reel.
    With springs it holds up to what their stretch makes swing, which goes with 1 / c: c = 1e7, the paper's, 2e-6 at
    1e6. From a part of a segment, and from whole segments; springs until a little after the first release, s.
    """
    t = np.linspace(0.0, released + 0.4 if segments == "springs" else 60.0, 401)
    options = {"rtol": 1e-10, "atol": 1e-12} if method == "dopri5" else {}
    seen = run(straight(segments, out, 3.5, stiffness=1e7, damping=1e-2), t, method, **options)
    releases = seen.solution.event_times.size
    assert releases >= (1 if segments == "springs" else 8)
    largest = 0.0
    for node in range(20):
        here = seen.solution.s[:, 0] > node
        x = seen.in_body(seen.seen.position)[:, node] - np.array([L0, 0.0, R])
        far = here & (np.linalg.norm(x, axis=1) > 1e-3)
        if not np.any(far):
            continue
        lag = np.arctan2(-x[far, 1], x[far, 0])
        largest = max(largest, np.max(np.abs(lag - steady_lag())))
        assert np.max(np.abs(x[far, 2])) < 1e-9
    book(
        "Threads, reels, tethers", f"Steady Coriolis lag through releases ({segments}, from {out:g} m)",
        reference="sin d = 2 v/(L0 W)", source="closed form", error=largest, allowed=1e-6, unit="rad",
    )  # fmt: skip


def test_blade_wraps_back_at_the_critical_pay_out_speed() -> None:
    """At v = L0 W / 2 the steady lag reaches 90 degrees, above it there is none (thread.md)."""
    assert math.degrees(steady_lag(speed=0.5 * L0 * W0)) == pytest.approx(90.0)
    assert math.degrees(steady_lag()) == pytest.approx(13.49, abs=0.005)
    t = np.linspace(0.0, 2.0, 101)
    lag = run(heliogyro(motion="driven", spool=1.1 * 0.5 * L0 * W0 / R, nodes=1), t).lag()
    assert lag[1:].max() > 90.0


def test_start_transient_of_a_point_mass(book: Book) -> None:
    """delta_s [1 - J1(2 sqrt(kappa t)) / sqrt(kappa t)], kappa = W0^2 L0 / v (thread.md).

    One node on a driven body, slow drive: the formula is linear in delta_s = 2e-3, its error of order delta_s^2.
    """
    lag_s = 2e-3
    speed = 0.5 * math.sin(lag_s) * L0 * W0
    kappa = W0**2 * L0 / speed
    t = np.linspace(0.0, 36.0 / kappa, 201)
    assembly = heliogyro(motion="driven", spool=speed / R, nodes=1, length=1e-4)
    lag = np.radians(run(assembly, t, rtol=1e-11, atol=1e-14).lag()[1:])
    z = np.sqrt(kappa * t[1:])
    expected = lag_s * (1.0 - j1(2.0 * z) / z)
    assert expected.max() > 1.04 * lag_s  # past the first overshoot
    assert np.max(np.abs(lag - expected)) < 1e-5 * lag_s
    book(
        "Threads, reels, tethers", "Start of a point mass on a reel", reference="d [1 - J1(2 sqrt(k t))/sqrt(k t)]",
        source="closed form, Bessel", error=np.max(np.abs(lag - expected)) / lag_s, allowed=1e-5,
    )  # fmt: skip


@pytest.mark.parametrize("nodes", [1, 5])
def test_lag_frequency(nodes: int, book: Book) -> None:
    """w^2 = W^2 L0 S (Jb + I + 2 L0 S) / (I Jb - L0^2 S^2), Jb = J / 2 + M L0^2 (thread.md), pay-out stopped.

    Exact for one node, swing 1e-4 rad; with five, which bend, the formula of the stiff blade is 1.5 % too high at most.
    """
    W, l0 = 2.0, 1.0 / nodes
    turn = 1e-4
    assembly = heliogyro(
        nodes=nodes, length=1.0, out=1.0, spool=0.0, rate=W, direction=(math.cos(turn), -math.sin(turn), 0.0)
    )
    m, x = np.full(nodes, RHO * l0), 1.0 - l0 * np.arange(nodes)
    m[0] = TIP + 0.5 * RHO * l0
    M, S, inertia = m.sum(), m @ x, m @ x**2
    Jb = J / 2.0 + M * L0**2
    w = math.sqrt(W**2 * L0 * S * (Jb + inertia + 2.0 * L0 * S) / (inertia * Jb - L0**2 * S**2))
    t = np.linspace(0.0, 4.0 * math.pi / w, 4001)
    lag = np.radians(run(assembly, t, rtol=1e-11, atol=1e-14).lag())
    if nodes == 1:
        book(
            "Threads, reels, tethers", "Lag frequency of a stiff blade on a spinning body (one node)",
            reference="w^2 of hub and blade", source="closed form",
            error=np.max(np.abs(lag - turn * np.cos(w * t))) / turn, allowed=1e-6, unit="of the swing",
        )  # fmt: skip
        assert np.max(np.abs(lag - turn * np.cos(w * t))) < 1e-6 * turn
        return
    up = np.flatnonzero((lag[:-1] > 0.0) & (lag[1:] <= 0.0))
    crossings = t[up] + lag[up] / (lag[up] - lag[up + 1]) * (t[1] - t[0])
    assert 2.0 * math.pi / np.diff(crossings)[0] == pytest.approx(w, rel=0.015)


def yoyo(stop: object = None) -> tuple[object, float, float, float]:
    """The yo-yo of validation.md, exactly on its closed form at a small length: assembly, K, m, time of the start."""
    inertia, drum, mass, w0, total = 300.0, 1.5, 6.0, 5.0, 9.0
    K = 1.0 + inertia / (mass * drum**2)
    free = 0.05
    rate = w0 * (K * drum**2 - free**2) / (K * drum**2 + free**2)
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=inertia, rate=rate), "body")
    wound = (total - free) / drum
    turning = rate + w0
    for k, side in enumerate((1.0, -1.0)):
        point = system.add(
            parts.Point(
                mass=0.5 * mass,
                position=(side * drum, -side * free, 0.0),
                velocity=(side * free * turning, side * drum * rate, 0.0),
            ),
            f"mass-{k}",
        )
        anchor = (side * math.cos(wound), side * math.sin(wound), 0.0)
        system.add(parts.Joint(a="body", b=point, type="link", length=total, drum=drum, anchor=anchor, sense=-1))
    if stop is not None:
        system.add(stop, "stop")
    return system.assemble(), K, drum, free / (drum * w0)


def test_yoyo_despin(book: Book) -> None:
    """I 300, R 1.5, two masses of 3 kg, 5 rad/s: to 1 rad/s l 5.901977, t 0.786930; to 0 l 7.228416, t 0.963789.

    validation.md: omega = w0 (K R^2 - l^2) / (K R^2 + l^2), K = 1 + I / (m R^2), l = R w0 t.
    """
    assembly, K, drum, start = yoyo()
    ends = np.array([0.786930, 0.963789])
    t = np.concatenate([np.linspace(0.0, 0.75, 51), ends - start])
    seen = run(assembly, t, rtol=1e-11, atol=1e-12)
    x = seen.y[:, 1:3]
    free = np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2 - drum**2)
    assert free == pytest.approx(drum * 5.0 * (t + start), rel=1e-8)
    rate = 5.0 * (K * drum**2 - free**2) / (K * drum**2 + free**2)
    assert seen.rate() == pytest.approx(rate, abs=1e-8)
    assert free[-2:] == pytest.approx([5.901977, 7.228416], abs=1e-5)
    assert seen.rate()[-2:] == pytest.approx([1.0, 0.0], abs=1e-5)
    book(
        "Threads, reels, tethers", "Yo-yo despin, to 1 rad/s and to rest", reference="omega of length",
        source="closed form", error=np.abs(seen.rate() - rate).max() / 5.0, allowed=2e-9,
    )  # fmt: skip


def test_pendulum_that_wraps_on_a_peg(book: Book) -> None:
    """R 0.1, L 1, from theta = 1 at rest: against theta'' = (R theta'^2 l - g l sin theta) / l^2 (validation.md)."""
    drum, length, theta = 0.1, 1.0, 1.0
    free = length - drum * theta
    tangent = -drum * np.array([math.cos(theta), math.sin(theta), 0.0])
    system = System(gravity=(0.0, -G, 0.0))
    bob = system.add(
        parts.Point(mass=1.0, position=tangent + free * np.array([math.sin(theta), -math.cos(theta), 0.0]))
    )
    whole = length + 2.0 * math.pi * drum  # with a turn more on the peg, which it needs where theta < 0
    system.add(parts.Joint(a="ground", b=bob, type="link", length=whole, drum=drum, anchor=(-1.0, 0.0, 0.0)))
    t = np.linspace(0.0, 5.0, 201)
    seen = run(system.assemble(), t, rtol=1e-11, atol=1e-12)

    def f(_: float, z: np.ndarray) -> list[float]:
        line = length - drum * z[0]
        return [z[1], (drum * z[1] ** 2 - G * math.sin(z[0])) / line]

    theta_t = solve_ivp(f, (0.0, 5.0), [theta, 0.0], "DOP853", t, rtol=1e-12, atol=1e-13).y[0]
    line = length - drum * theta_t
    x = -drum * np.cos(theta_t) + line * np.sin(theta_t)
    y = -drum * np.sin(theta_t) - line * np.cos(theta_t)
    assert theta_t.min() < -0.9
    assert seen.y[:, 0] == pytest.approx(x, abs=1e-8)
    assert seen.y[:, 1] == pytest.approx(y, abs=1e-8)
    book(
        "Threads, reels, tethers", "Pendulum that wraps on a peg, 5 s", reference="equation of one angle",
        source="SciPy DOP853, 1e-12", error=max(np.abs(seen.y[:, 0] - x).max(), np.abs(seen.y[:, 1] - y).max()),
        allowed=1e-8, unit="m",
    )  # fmt: skip


@pytest.mark.parametrize(("sense", "change"), [(1, -1.0), (-1, 1.0)])
def test_involute(sense: int, change: float, book: Book) -> None:
    """A point mass on a cord and a fixed cylinder: l^2 = l0^2 +- 2 R v0 t, tension m v0^2 / l (validation.md).

    The cord leaves the cylinder at (R, 0); the mass turns to the left about it, which winds a cord of sense +1 up and
    one of sense -1 off.
    """
    drum, free, speed, total = 0.2, 0.5, 1.5, 6.0
    system = System()
    start = parts.Point(mass=2.0, position=(drum, sense * free, 0.0), velocity=(-sense * speed, 0.0, 0.0))
    mass = system.add(start)
    wound = sense * (total - free) / drum
    anchor = (math.cos(wound), -math.sin(wound), 0.0)
    system.add(parts.Joint(a="ground", b=mass, type="link", length=total, drum=drum, anchor=anchor, sense=sense))
    assembly = system.assemble()
    t = np.linspace(0.0, 0.3 if change < 0.0 else 2.0, 51)
    seen = run(assembly, t, rtol=1e-11, atol=1e-12)
    squared = np.sum(seen.y[:, :3] ** 2, axis=1) - drum**2
    assert squared == pytest.approx(free**2 + change * 2.0 * drum * speed * t, rel=1e-8)
    f = derivative(assembly)
    for time, y, s2 in zip(t, seen.y, squared, strict=True):
        f(time, y)
        assert assembly.model.la[0] == pytest.approx(2.0 * speed**2 / math.sqrt(s2), rel=1e-8)
    book(
        "Threads, reels, tethers", f"Involute, cord wound {'up' if sense > 0 else 'off'}",
        reference="l^2 = l0^2 +- 2 R v t", source="closed form",
        error=np.abs(squared / (free**2 + change * 2.0 * drum * speed * t) - 1.0).max(), allowed=1e-8,
    )  # fmt: skip


def rope(nodes: int) -> float:
    """Length out after 1 s of a heavy rope with a weight on a drum (validation.md)."""
    system = System(gravity=(0.0, 0.0, -G))
    drive = parts.FreeSpool(inertia=0.5, angle=1.0 / 0.2)
    system.add(
        parts.Reel(body="ground", radius=0.2, drive=drive, payout_axis=(0.0, 0.0, -1.0), spool_axis=(0.0, 1.0, 0.0)),
        "drum",
    )
    system.add(
        parts.Thread(
            reel="drum",
            length=20.0,
            line_density=0.3,
            tip_mass=2.0,
            nodes=nodes,
            segments="inextensible",
            wound_mass="carried",
        )
    )
    assembly = system.assemble()
    seen = run(assembly, [0.0, 0.5, 1.0], rtol=1e-9, atol=1e-11)
    assert np.max(np.abs(seen.energy_defect)) < 1e-6 * abs(seen.energy).max()
    return float(0.2 * seen.seen.spool[-1, 0, 0])


def test_drum_with_heavy_rope_and_weight(book: Book) -> None:
    """I 0.5, R 0.2, lam 0.3, L 20, M 2, x0 1: x(1 s) = 1.55693233 (validation.md); better than first order in n.

    The rope out is short of its continuous mass by up to a node, hence no second order.
    """
    nodes = np.array([40, 80, 160, 320, 640])
    errors = np.abs(np.array([rope(n) for n in nodes]) - 1.55693233)
    assert errors[-1] < 4e-4
    assert fitted_order(1.0 / nodes, errors) > 1.15
    book(
        "Threads, reels, tethers", "Drum, heavy rope and weight after 1 s (640 nodes)", reference="1.55693233 m",
        source="closed form", error=errors[-1] / 1.55693233, allowed=2.6e-4, order=fitted_order(1.0 / nodes, errors),
        wanted="above 1",
    )  # fmt: skip


def test_solar_pressure_coning(book: Book) -> None:
    """Tip 2 q ln 2 / (m Omega^2) of a hubless thread under a small normal load q (validation.md).

    The static shape is found by Newton's method on the right-hand side; second order in n, q = 2 p w of a mirror.
    """
    omega, density, length, pressure, width = 3.0, 1e-3, 2.0, 4.56e-6, 0.1
    load = 2.0 * pressure * width
    exact = 2.0 * load * math.log(2.0) / (density * omega**2)
    errors = []
    counts = (10, 20, 40)
    for n in counts:
        system = System()
        system.add(parts.RigidBody(motion="driven", rate=omega), "hub")
        drive = parts.ConstantDrive(rate=0.0, angle=length / R)
        system.add(parts.Reel(body="hub", centre=(0.0, 0.0, -R), radius=R, drive=drive), "reel")
        thread = parts.Thread(reel="reel", length=length, line_density=density, nodes=n, segments="inextensible")
        system.add(thread, "blade")
        system.add(parts.Radiation(along="blade", pressure=pressure, width=width, specular=1.0))
        assembly = system.assemble()
        accelerations = rotating_accelerations(assembly, omega)
        q = assembly.y[: 3 * n].copy()
        flap = across(n, 2)
        for _ in range(4):
            force = flap.T @ accelerations(q, np.zeros_like(q))
            q = q + flap @ np.linalg.solve(stiffness_matrix(accelerations, q, flap), force)
            q = (q.reshape(-1, 3) / np.linalg.norm(q.reshape(-1, 3), axis=1)[:, None]).ravel()
        tip = length / n * q.reshape(-1, 3)[:, 2].sum()
        errors.append(abs(abs(tip) / exact - 1.0))
    assert errors[-1] < 1e-3
    assert fitted_order(1.0 / np.array(counts), errors) > 1.85
    book(
        "Threads, reels, tethers", "Coning under sunlight (40 nodes)", reference="tip 2 q ln 2/(m W^2)",
        source="closed form", error=errors[-1], allowed=1e-3, order=fitted_order(1.0 / np.array(counts), errors),
        wanted="2",
    )  # fmt: skip


def test_lumped_catenary(book: Book) -> None:
    """N rigid links, N - 1 equal masses, length 10, span 8: sag 2.7486 (4), 2.6686 (10), 2.6579 (20) (validation.md).

    The shape comes from statics solved apart (a horizontal pull H); the engine must find it at rest, with its tensions.
    """
    from scipy.optimize import brentq

    for n, sag in ((4, 2.7486015881), (10, 2.6686442582), (20, 2.6579156662)):
        ln = 10.0 / n
        up = 0.5 * (n - 2) - np.arange(n) + 0.5  # vertical pulls of the links, unit masses and gravity

        def directions(H: float, up: np.ndarray = up) -> np.ndarray:
            e = np.array([np.full(up.size, H), np.zeros(up.size), -up]).T
            return e / np.linalg.norm(e, axis=1)[:, None]

        H = brentq(lambda H: ln * directions(H)[:, 0].sum() - 8.0, 1e-3, 1e3, xtol=1e-14)  # noqa: B023
        x = np.cumsum(ln * directions(H), axis=0)
        assert -x[:, 2].min() == pytest.approx(sag, abs=1e-9)
        system = System(gravity=(0.0, 0.0, -1.0))
        previous: object = (0.0, 0.0, 0.0)
        for k in range(n - 1):
            point = system.add(parts.Point(mass=1.0, position=x[k]), f"p{k}")
            system.add(parts.Joint(a=previous, b=point, type="link", length=ln))
            previous = point
        system.add(parts.Joint(a=previous, b=(8.0, 0.0, 0.0), type="link", length=ln))
        assembly = system.assemble()
        dy = derivative(assembly)(0.0, assembly.y)
        assert np.max(np.abs(dy)) < 1e-9
        book(
            "Threads, reels, tethers", f"Lumped catenary of {n} links: acceleration at rest", reference="0",
            source="statics solved apart", error=np.max(np.abs(dy)), allowed=1e-9, unit="g",
        )  # fmt: skip
        assert np.sort(np.abs(assembly.model.la)) == pytest.approx(np.sort(np.hypot(H, up)), rel=1e-9)


@pytest.mark.parametrize(
    ("hub", "lowest", "axis", "expected"),
    [
        (0.0, 1, 2, (1.0, 6.0, 15.0)),
        (0.0, 0, 1, (0.0, 5.0, 14.0)),
        (0.1, 1, 2, (1.149310, 6.784231)),
    ],
)
def test_rotating_thread_modes(hub: float, lowest: int, axis: int, expected: tuple[float, ...], book: Book) -> None:
    """omega^2 / Omega^2 of a spinning thread: flap 1, 6, 15; lag 0, 5, 14; hub of 0.1 length: flap 1.149310, 6.784231.

    (validation.md.) Linearised right-hand side about the straight blade, all out; second order in n, extrapolated.
    """
    omega, counts, found = 2.0, (20, 40, 80), []
    for n in counts:
        system = System()
        system.add(parts.RigidBody(motion="driven", rate=omega), "hub")
        drive = parts.ConstantDrive(rate=0.0, angle=1.0 / R)
        system.add(parts.Reel(body="hub", centre=(hub, 0.0, -R), radius=R, drive=drive), "reel")
        system.add(parts.Thread(reel="reel", length=1.0, line_density=1e-3, nodes=n, segments="inextensible"))
        assembly = system.assemble()
        accelerations = rotating_accelerations(assembly, omega)
        matrix = stiffness_matrix(accelerations, assembly.y[: 3 * n].copy(), across(n, axis))
        found.append(eigenvalues(matrix)[: len(expected)] / omega**2)
    assert np.abs(found[-1] - expected).max() < 0.05
    if hub == 0.0:  # the stiff blade's own tilt has no error in space
        assert found[0][0] == pytest.approx(1.0 if lowest else 0.0, abs=1e-6)
    errors = np.abs(np.array(found)[:, 1] - expected[1])
    assert fitted_order(1.0 / np.array(counts), errors) == pytest.approx(2.0, abs=0.15)
    extrapolated = found[2] + (found[2] - found[1]) / 3.0
    assert extrapolated == pytest.approx(expected, abs=2e-3)
    numbers = ", ".join(f"{x:g}" for x in expected)
    book(
        "Modes", f"Thread that turns, {'flap' if axis == 2 else 'lag'}, hub {hub:g} L (extrapolated from 80 nodes)",
        reference=f"w^2/W^2 = {numbers}", source="closed form, Legendre", error=np.abs(extrapolated - expected).max(),
        allowed=2e-3, unit="W^2", order=fitted_order(1.0 / np.array(counts), errors), wanted="2",
    )  # fmt: skip


@pytest.mark.parametrize("axis", [1, 2])
def test_hanging_chain_modes(axis: int, book: Book) -> None:
    """10 equal masses on equal links: omega / sqrt(g / L) = 1.173855, 2.700842 (validation.md: zeros of L_10).

    The thread's tip has half a node's mass; a tip mass of rho l0 / 2 makes all equal.
    """
    n, density = 10, 0.5
    system = System(gravity=(G, 0.0, 0.0))
    drive = parts.ConstantDrive(rate=0.0, angle=2.0 / R)
    system.add(parts.Reel(body="ground", centre=(0.0, 0.0, -R), radius=R, drive=drive), "reel")
    tip = 0.5 * density * 2.0 / n
    system.add(
        parts.Thread(reel="reel", length=2.0, line_density=density, nodes=n, tip_mass=tip, segments="inextensible")
    )
    assembly = system.assemble()
    matrix = stiffness_matrix(rotating_accelerations(assembly, 0.0), assembly.y[: 3 * n].copy(), across(n, axis))
    found = np.sqrt(eigenvalues(matrix)[:2] / (G / 2.0))
    assert found == pytest.approx([1.173855, 2.700842], abs=1e-6)
    zeros = np.sort(np.roots(np.polynomial.laguerre.lag2poly([0.0] * n + [1.0])[::-1]).real)
    assert found == pytest.approx(np.sqrt(n * zeros[:2]), abs=1e-6)
    book(
        "Modes", f"Hanging chain of ten masses, {'across the plane' if axis == 2 else 'in the plane'}",
        reference="1.173855, 2.700842 sqrt(g/L)", source="closed form, Laguerre",
        error=np.abs(found / np.sqrt(n * zeros[:2]) - 1.0).max(), allowed=1e-6,
    )  # fmt: skip


def test_pay_out_speed_is_the_papers() -> None:
    """v = r phi' = 35 mm/s pays 5 m out in 142.857 s (thread.md)."""
    assert pytest.approx(0.035) == V
    assert pytest.approx(142.857, abs=1e-3) == L / V
