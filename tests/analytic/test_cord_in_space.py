"""Cords on drums in space, their release, and what follows when they have unwound."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from evolvent import InputError, System, parts
from evolvent.families.joints.cord import drum_cord

EXACT = {"method": "dopri5", "tolerance": 1e-10}
G = 9.81


def shortest(R: float, sense: int, angle: float, d: np.ndarray, pieces: int = 60) -> float:
    """Length of the shortest polygon that winds by about `angle` from (R, 0, 0) round a cylinder about z to d.

    Its corners lie on the cylinder, at any angles and heights; the last piece is free.
    """

    def length(x: np.ndarray) -> float:
        angles, heights = np.append(0.0, sense * x[:pieces]), np.append(0.0, x[pieces:])
        arcs = np.hypot(R * np.diff(angles), np.diff(heights))
        last = np.array([R * math.cos(angles[-1]), R * math.sin(angles[-1]), heights[-1]])
        return float(arcs.sum() + np.linalg.norm(d - last))

    part = np.linspace(0.0, 1.0, pieces + 1)[1:]
    # in the plane of the unrolled cylinder the corners of a shortest way are in line: their number does not matter
    found = minimize(length, np.append(angle * part, 0.3 * d[2] * part), method="L-BFGS-B", options={"maxiter": 5000})
    return float(found.fun)


@pytest.mark.parametrize(("sense", "turned", "height"), [(1, 0.8, 0.6), (-1, 2.5, -0.4), (1, 1.7, 0.0)])
def test_the_length_is_that_of_the_shortest_way(sense: int, turned: float, height: float) -> None:
    R, free = 0.4, 0.9
    r = np.array([math.cos(turned), sense * math.sin(turned), 0.0])
    e = sense * np.cross([0.0, 0.0, 1.0], r)
    d = R * r + free * e + np.array([0.0, 0.0, height])
    whole = math.hypot(R * turned + free, height)
    length, _, p, e3, _, _ = drum_cord(R, float(sense), whole, tuple(d), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    assert length == pytest.approx(whole, rel=1e-12)
    assert length == pytest.approx(shortest(R, sense, turned, d, pieces=4), rel=1e-6)
    assert math.hypot(p[0], p[1]) == pytest.approx(R, rel=1e-12)
    assert e3[2] == pytest.approx(height / whole, abs=1e-12)  # one slope on the drum and beside it


def test_derivatives_of_the_length() -> None:
    """First and second derivatives by the place of the free end, by central differences."""
    R, n, zero, h = 0.3, (0.0, 0.6, 0.8), (1.0, 0.0, 0.0), 1e-4
    rng = np.random.default_rng(4)
    for _ in range(5):
        d = rng.normal(size=3)
        d *= 1.1 / np.linalg.norm(np.cross(n, d))
        whole = drum_cord(R, 1.0, 2.0 + rng.random(), tuple(d), n, zero)[0]

        def found(x: np.ndarray, whole: float = whole) -> tuple:
            return drum_cord(R, 1.0, whole, tuple(x), n, zero)

        _, free, _, e, q, bend = found(d)
        slope = [(found(d + h * u)[0] - found(d - h * u)[0]) / (2.0 * h) for u in np.eye(3)]
        assert np.allclose(e, slope, atol=1e-7)
        second = [(np.array(found(d + h * u)[3]) - np.array(found(d - h * u)[3])) / (2.0 * h) for u in np.eye(3)]
        assert np.allclose((np.eye(3) - np.outer(e, e)) / free + bend * np.outer(q, q), second, atol=1e-6)


def tetherball(R: float = 0.2, L: float = 2.0, wound: float = 1.5) -> tuple[System, np.ndarray]:
    """A mass on a cord round an upright post, and its start: angle wound, height, rates."""
    start = np.array([wound, -0.7, 1.2, 0.4])
    psi, z, psi1, z1 = start
    c = math.sqrt(L * L - z * z)
    s, r = c - R * psi, np.array([math.cos(psi), math.sin(psi), 0.0])
    e, up = np.array([-r[1], r[0], 0.0]), np.array([0.0, 0.0, 1.0])
    system = System(gravity=(0.0, 0.0, -G))
    bob = parts.Point(mass=0.8, position=R * r + s * e + z * up, velocity=-z * z1 / c * e - s * psi1 * r + z1 * up)
    system.add(bob, "bob")
    system.add(
        parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="link", length=L, drum=R, anchor=(1.0, 0.0, 0.0), sense=1), "cord"
    )
    return system, start


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "allowed"),
    [
        (EXACT, 1e-7),
        ({"method": "generalized-alpha", "step": 1e-3}, 2e-4),
        ({"method": "energy-momentum", "step": 1e-3}, 2e-4),
    ],
)
def test_a_mass_that_winds_on_a_post_in_space(options: dict, allowed: float) -> None:
    """Lagrange's equations in the angle wound and the height z.

    T = m (z'^2 L^2/c^2 + s^2 psi'^2)/2, c^2 = L^2 - z^2, s = c - R psi.
    """
    R, L = 0.2, 2.0
    system, start = tetherball(R, L)

    def rates(_: float, x: np.ndarray) -> list[float]:
        psi, z, psi1, z1 = x
        c = math.sqrt(L * L - z * z)
        s = c - R * psi
        second = (c / L) ** 2 * (-(z1**2) * z * L**2 / c**4 - s * psi1**2 * z / c - G)
        return [psi1, z1, (R * psi1**2 + 2.0 * z * z1 * psi1 / c) / s, second]

    run = system.simulate(until=1.5, every=0.1, **options)
    exact = solve_ivp(rates, (0.0, 1.5), start, t_eval=run.time.values, rtol=1e-11, atol=1e-12).y
    psi, z = exact[:2]
    s = np.sqrt(L * L - z * z) - R * psi
    place = np.stack([R * np.cos(psi) - s * np.sin(psi), R * np.sin(psi) + s * np.cos(psi), z], axis=1)
    assert np.abs(run["bob"].position.values - place).max() < allowed
    assert np.ptp(psi) > 1.0
    assert np.ptp(z) > 0.3


def yo_yo(nutation: float, **release: object) -> System:
    """Two masses on cords round a free body that nutates, in radians."""
    J, It, w0, R, m, length, free = 20.0, 16.0, 2.0 * math.pi, 0.5, 0.5, 3.0, 0.05
    w = np.array([J * w0 * math.tan(nutation) / It, 0.0, w0])
    system = System()
    system.add(parts.RigidBody(mass=150.0, inertia=(It, It, J), angular_velocity=tuple(w)), "body")
    for k, sign in ((1, 1.0), (2, -1.0)):
        place = np.array([sign * R, -sign * free, 0.0])
        system.add(parts.Point(mass=m, position=tuple(place), velocity=tuple(np.cross(w, place))), f"mass {k}")
        at = (length - free) / R
        cord = parts.Joint(
            a="body", b=f"mass {k}", type="link", length=length, drum=R, sense=-1,
            anchor=(sign * math.cos(at), sign * math.sin(at), 0.0), **release
        )  # fmt: skip
        system.add(cord, f"cord {k}")
    return system


def kept(run) -> tuple[float, float]:
    """Drift of energy and angular momentum over what was there."""
    H = run.angular_momentum.values
    return float(np.abs(run.energy_defect.values).max() / run.energy_moved.values[-1]), float(
        np.linalg.norm(H - H[0], axis=1).max() / np.linalg.norm(H[0])
    )


@pytest.mark.slow
def test_a_yo_yo_on_a_nutating_body_keeps_energy_and_momentum() -> None:
    exact = yo_yo(math.radians(4.0)).simulate(until=0.8, every=0.1, **EXACT)
    assert max(kept(exact)) < 1e-8
    found = {
        (method, step): yo_yo(math.radians(4.0)).simulate(until=0.8, every=0.1, method=method, step=step, **more)
        for method, more in (("generalized-alpha", {}), ("energy-momentum", {"spectral_radius": 1.0}))
        for step in (1e-3, 5e-4)
    }
    assert max(kept(found["energy-momentum", 1e-3])) < 1e-9
    for method in ("generalized-alpha", "energy-momentum"):
        last = [found[method, h]["body"].rate.values[-1] for h in (1e-3, 5e-4)]
        off = [np.abs(one - exact["body"].rate.values[-1]).max() for one in last]
        assert off[1] < 2e-3
        assert math.log2(off[0] / off[1]) == pytest.approx(2.0, abs=0.3)
    assert np.abs(exact["cord 1"].ends.values[:, 0, 2]).max() > 0.01  # the cords do leave the plane


@pytest.mark.slow
def test_release_by_time_and_by_event() -> None:
    """After the release the masses fly straight on and the body keeps its angular momentum."""
    by_time = yo_yo(0.05, until=0.4).simulate(until=0.6, every=0.05, **EXACT)
    system = yo_yo(0.05)
    plain = system.simulate(until=0.4, every=0.1, **EXACT)
    late = by_time.sel(time=slice(0.45, None))
    assert np.ptp(late["mass 1"].velocity.values, axis=0).max() < 1e-9
    assert np.abs(late["cord 1"].tension.values).max() == 0.0
    before = plain["mass 1"].velocity.values[-1]
    assert late["mass 1"].velocity.values[0] == pytest.approx(before, abs=1e-6)
    assert max(kept(by_time)) < 1e-8
    system = yo_yo(0.05, released_by="out")
    place = {f"{c}{k}": f"{part}.position.{c}" for k, part in enumerate(("body", "mass 1")) for c in "xyz"}
    law = "sqrt((x1 - x0)**2 + (y1 - y0)**2 + (z1 - z0)**2) - 1.2"
    system.add(parts.Event(law=law, variables=place), "out")
    by_event = system.simulate(until=0.6, every=0.01, **EXACT)
    pulls = by_event["cord 1"].tension.values != 0.0
    apart = np.linalg.norm(by_event["mass 1"].position.values - by_event["body"].position.values, axis=1)
    assert np.array_equal(pulls[apart > 1.21], np.zeros(np.sum(apart > 1.21), dtype=bool))
    assert pulls[(apart < 1.19) & (apart > 0.55)].all()
    assert max(kept(by_event)) < 1e-8


def test_a_cord_that_has_unwound_swings_about_its_anchor_and_winds_on_in_the_other_sense() -> None:
    """A mass of constant speed v: involute, circle about the anchor, and involute again, each by its closed form."""
    R, v, L, wound = 0.2, 1.0, 1.0, 0.5
    s0 = L - R * wound
    r = np.array([math.cos(wound), math.sin(wound), 0.0])
    e = np.array([-r[1], r[0], 0.0])
    system = System()
    system.add(parts.Point(mass=1.0, position=R * r + s0 * e, velocity=v * r), "bob")  # unwinds
    system.add(
        parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="link", length=L, drum=R, anchor=(1.0, 0.0, 0.0), sense=1), "cord"
    )
    # s^2 grows by 2 R v t until L; then half a turn about (R, 0, 0), and s^2 falls by 2 R v t
    first, half = (L * L - s0 * s0) / (2.0 * R * v), math.pi * L / v
    for options in (EXACT, {"method": "energy-momentum", "step": 2e-3}):
        end = first + half + 0.8
        run = system.simulate(until=end, every=end / 40, **options)
        t, x = run.time.values, run["bob"].position.values
        assert np.linalg.norm(run["bob"].velocity.values, axis=1) == pytest.approx(v, rel=1e-5)
        length = np.sqrt(np.sum(x * x, axis=1) - R * R)
        wanted = np.where(
            t < first, np.sqrt(s0 * s0 + 2.0 * R * v * t), np.sqrt(np.abs(L * L - 2.0 * R * v * (t - first - half)))
        )
        on = (t < first) | (t > first + half)
        assert length[on] == pytest.approx(wanted[on], rel=1e-4)
        about = np.linalg.norm(x - [R, 0.0, 0.0], axis=1)
        assert about[~on] == pytest.approx(L, rel=1e-6)
        assert run["cord"].wound_length.values[~on] == pytest.approx(0.0, abs=1e-6)
        assert run["cord"].tension.values[~on] == pytest.approx(v * v / L, rel=1e-3)


def test_statics_and_modes_of_a_mass_that_hangs_from_a_drum() -> None:
    """Swing across the axis about the point where the cord leaves, along it about a longer arm: R psi + s."""
    R, s, psi = 0.2, 0.8, math.pi / 2.0
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.Point(mass=0.5, position=(-R, 0.0, -s)), "bob")
    # the axis is y; the cord is fixed on top of the drum
    system.add(
        parts.Joint(
            a=(0.0, 0.0, 0.0),
            b="bob",
            type="link",
            length=s + R * psi,
            drum=R,
            axis=(0.0, 1.0, 0.0),
            anchor=(0.0, 0.0, 1.0),
            sense=-1,
        ),
        "cord",
    )
    w = np.sort(system.modes(count=2).frequency)
    assert w == pytest.approx(np.sqrt([G / (s + R * psi), G / s]), rel=1e-6)


def test_refused_cords() -> None:
    system = System()
    system.add(parts.Point(mass=1.0, position=(0.1, 0.0, 0.7)), "bob")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="link", length=1.0, drum=0.2), "cord")
    with pytest.raises(InputError, match=r"inside the drum of radius 0\.2 m"):
        system.assemble()
    system = yo_yo(0.0, released_by="nothing")
    with pytest.raises(InputError, match="refers to 'nothing'"):
        system.assemble()


def test_the_cord_turns_with_its_drum() -> None:
    """The same motion in any orientation of the whole."""
    system, _ = tetherball()
    turned = Rotation.from_rotvec([0.3, -0.5, 0.8])
    given = system.parts["bob"]
    other = System(gravity=tuple(turned.apply([0.0, 0.0, -G])))
    place, velocity = turned.apply(given.position), turned.apply(given.velocity)
    other.add(parts.Point(mass=0.8, position=tuple(place), velocity=tuple(velocity)), "bob")
    axes = {"axis": tuple(turned.apply([0.0, 0.0, 1.0])), "anchor": tuple(turned.apply([1.0, 0.0, 0.0]))}
    other.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="link", length=2.0, drum=0.2, sense=1, **axes), "cord")
    runs = [one.simulate(until=0.5, every=0.1, **EXACT)["bob"].position.values for one in (system, other)]
    assert np.allclose(turned.apply(runs[0]), runs[1], atol=1e-8)
