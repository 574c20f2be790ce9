"""Rods that pay out: closed forms, an independent model of the extruded beam, balances, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from book import Book
from evolvent import InputError, System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.elements import Material, Rectangle, Strip, Taper, TapeSection
from evolvent.kernels.drive import angles_of
from evolvent.solvers import solve
from evolvent.solvers.time.implicit.plan import solve_implicit
from helpers import fitted_order

Array = np.ndarray
WHOLE, THICKNESS, WIDTH = 1.0, 0.005, 0.04
MATERIAL = Material(young_modulus=1e8, poisson_ratio=0.3, density=1000.0)
SECTION = Rectangle(thickness=THICKNESS, width=WIDTH)
MU, EI = 1000.0 * THICKNESS * WIDTH, 1e8 * WIDTH * THICKNESS**3 / 12.0
#: Roots of cos b cosh b = -1.
BETA = np.array([1.8751040687119611, 4.694091132974174, 7.854757438237613, 10.995540734875467, 14.13716839104647,
                 17.278759532088234, 20.42035225104125, 23.561944901806445])  # fmt: skip


def moved(rate: float, start: float) -> dict[str, Any]:
    """A drive at a constant rate, m/s, from a length, m."""
    return {"constant": {"rate": rate, "angle": start}}


def boom(payout: Any, elements: int = 8, *, gravity: Any = (0.0, 0.0, 0.0), **keys: Any) -> System:
    """A rod clamped at its exit to the ground; y of its section is the thin direction."""
    system = System(gravity=gravity)
    own = {"length": WHOLE, "section": SECTION, "material": MATERIAL, "elements": elements}
    system.add(parts.Rod(**(own | keys), payout=payout), "rod")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root", type="clamp"), "clamp")
    return system


@pytest.mark.slow
def test_modes_over_the_free_length(book: Book) -> None:
    """Bending of a beam that is pulled through a guide: (beta/l)^2 sqrt(EI/mu) at any length; order 2."""
    meshes, errors = np.array([8, 16, 32]), []
    for elements in meshes:
        system, worst = boom({"expression": "0.25 + 0.75*t"}, int(elements)), 0.0
        for time, length in ((0.0, 0.25), (0.4, 0.55), (1.0, 1.0)):
            wanted = (BETA[:2] / length) ** 2 * np.sqrt(EI / MU)
            wanted /= np.sqrt(1.0 + (THICKNESS / length) ** 2 / 12.0 * np.array([4.65, 32.4]))  # rotary inertia, shear
            found = system.modes(count=6, time=time).frequency
            nearest = np.abs(found[:, None] / wanted - 1.0).min(axis=0)
            worst = max(worst, nearest.max())
        errors.append(worst)
    assert fitted_order(1.0 / meshes, np.array(errors)) == pytest.approx(2.0, abs=0.3)
    book(
        "Modes", "bending of a beam pulled through a guide, at three free lengths (rod that pays out, 32 elements)",
        reference="closed form", source="(beta/l)^2 sqrt(EI/mu)", error=errors[-1], allowed=2e-3,
    )  # fmt: skip


def extruded(times: Array, rate: float, start: float, load: float) -> Array:
    """Deflection of the tip of a cantilever that is extruded at a constant rate under a load per mass, m/s2.

    Notes
    -----
    Tabarrok, Leech and Kim (1974): w_tt + 2 v w_xt + v^2 w_xx + EI/mu w_xxxx = g, with eight modes of the cantilever of
    the length that is out, by Galerkin's method.
    """
    at, weight = np.polynomial.legendre.leggauss(80)
    x, weight = 0.5 * (at + 1.0), 0.5 * weight
    b = BETA[:, None]
    s = (np.sin(b) - np.sinh(b)) / (np.cos(b) + np.cosh(b))

    def modes(x: Array) -> tuple[Array, Array, Array]:
        c, d = b * x, s
        value = np.cosh(c) - np.cos(c) + d * (np.sinh(c) - np.sin(c))
        first = b * (np.sinh(c) + np.sin(c) + d * (np.cosh(c) - np.cos(c)))
        second = b**2 * (np.cosh(c) + np.cos(c) + d * (np.sinh(c) + np.sin(c)))
        return value, first, second

    p, p1, p2 = modes(x)
    M = (weight * p) @ p.T
    C1, K1, K2, F = (weight * (1 - x) * p) @ p1.T, (weight * (1 - x) * p) @ p1.T, 0.0, (weight * p).sum(axis=1)
    K2 = (weight * (1 - x) ** 2 * p) @ p2.T
    bending = M * BETA**4

    def right(t: float, y: Array) -> Array:
        length = start + rate * t
        lam, q, v = rate / length, y[: BETA.size], y[BETA.size :]
        force = load * F - 2.0 * lam * C1 @ v - lam**2 * (K2 - 2.0 * K1) @ q - EI / MU / length**4 * bending @ q
        return np.concatenate([v, np.linalg.solve(M, force)])

    run = solve_ivp(
        right, (0.0, times[-1]), np.zeros(2 * BETA.size), method="DOP853", t_eval=times, rtol=1e-9, atol=1e-12
    )
    return np.asarray(modes(np.ones(1))[0][:, 0] @ run.y[: BETA.size])


@pytest.mark.slow
@pytest.mark.parametrize(("rate", "start"), [(0.15, 0.5), (-0.15, 0.8)], ids=["out", "in"])
def test_an_extruded_beam(rate: float, start: float, book: Book) -> None:
    """The tip under its weight, put on at once, against Galerkin's method; order 2 of the elements."""
    errors, g = [], 1e-3
    for elements in (16, 32):
        system = boom(moved(rate, start), elements, gravity=(0.0, -g, 0.0))
        run = system.simulate(until=2.0, every=0.05, method="generalized-alpha", step=1e-3)
        t, w = np.asarray(run["time"]), np.asarray(run["rod"]["tip_position"])[:, 1]
        wanted = extruded(t, rate, start, -g)
        errors.append(float(np.abs(w - wanted).max() / np.abs(wanted).max()))
    assert errors[0] > 2.5 * errors[1]
    book(
        "Dynamics", f"tip of a beam that is {'extruded' if rate > 0.0 else 'drawn in'} under its weight "
        f"(rod that pays out, 32 elements)", reference="Galerkin's method, eight modes",
        source="Tabarrok, Leech & Kim 1974", error=errors[-1], allowed=1e-3,
    )  # fmt: skip


def spinning(payout: Any, *, motion: str = "spin", offset: float = 0.1, **keys: Any) -> System:
    """A stiff rod that is extruded along x out of a hub, from the distance `offset` from its spin axis z."""
    stiff = Material(young_modulus=1e12, poisson_ratio=0.3, density=1000.0)
    own = {"length": WHOLE, "section": SECTION, "material": stiff, "elements": 4}
    system, rate = System(), keys.pop("rate", 2.0)
    system.add(parts.RigidBody(motion=motion, axis=(0.0, 0.0, 1.0), inertia=0.05, rate=rate), "hub")
    rod = parts.Rod(
        **(own | keys), payout=payout, position=(offset, 0.0, 0.0), velocity=(0.0, offset * rate, 0.0),
        angular_velocity=(0.0, 0.0, rate),
    )  # fmt: skip
    system.add(rod, "rod")
    system.add(parts.Joint(a="hub", b="rod.root", type="clamp"), "clamp")
    return system


def deployed(assembly: Assembly, t: Array) -> Array:
    """Lengths of the only rod that are out at the times t, m."""
    return angles_of(assembly.model.rods[0], assembly.model, t)


def test_angular_momentum_of_a_spinning_hub(book: Book) -> None:
    """I(t) W is constant, out and back in, with the rest at the exit and the inertia of the sections."""
    b, ramp = 0.1, {"ramp": {"angle": 0.2, "steps": [[0.1, 0.4, 0.3], [0.6, 0.8, -0.3], [1.5, 0.4, 0]]}}
    assembly = spinning(ramp, offset=b).assemble()
    found = solve_implicit(assembly, samples=np.linspace(0.0, 2.0, 21), step=2.5e-4, newton=1e-12)
    assert found.success, found.message
    out = deployed(assembly, found.t)
    W = found.y[:, int(assembly.model.bodies["iv"][assembly.names["hub"][1]])]
    across = MU / 12.0 * THICKNESS**2
    inertia = 0.05 + MU * ((b + out) ** 3 - b**3) / 3.0 + MU * (WHOLE - out) * b**2 + across * out
    assert out.max() > 0.36
    assert out[-1] < 0.33
    error = float(np.abs(W * inertia / (W[0] * inertia[0]) - 1.0).max())
    book(
        "Dynamics", "spin of a hub that extrudes a stiff rod and draws it in (4 elements)", reference="I W constant",
        source="closed form", error=error, allowed=1e-6,
    )  # fmt: skip


def test_root_of_an_extruded_spinning_rod(book: Book) -> None:
    """Tension mu W^2 l (b + l/2) less mu v^2, shear 2 mu W v l, moment mu W v l^2 at the exit of a driven hub."""
    b, v, W = 0.1, 0.2, 2.0
    system = spinning(
        {"ramp": {"angle": 0.3, "steps": [[0, 0.4, v]]}}, motion="driven", offset=b, rate=W, stiffness_damping=1e-5
    )
    run = system.simulate(until=1.0, every=0.05, method="generalized-alpha", step=1e-3)
    rod, t = run["rod"], np.asarray(run["time"])
    out = np.asarray(rod["deployed_length"])
    force, moment = np.asarray(run["clamp"]["force"]), np.asarray(run["clamp"]["moment"])
    assert "tension" not in run.attrs["message"]
    radial = force[:, 0] * np.cos(W * t) + force[:, 1] * np.sin(W * t)
    across = -force[:, 0] * np.sin(W * t) + force[:, 1] * np.cos(W * t)
    stowed = MU * (WHOLE - out) * W**2 * b
    found = np.abs(np.stack([radial, across, moment[:, 2]]))[:, t >= 0.4]
    wanted = np.stack(
        [MU * W**2 * out * (b + 0.5 * out) - MU * v**2 + stowed, 2 * MU * W * v * out, MU * W * v * out**2]
    )[:, t >= 0.4]
    errors = np.abs(found / wanted - 1.0).max(axis=1)
    book(
        "Dynamics", "force and Coriolis moment at the exit of a spinning rod that is extruded",
        reference="closed form", source="mu W^2 l (b + l/2), 2 mu W v l, mu W v l^2", error=float(errors.max()),
        allowed=3e-4,
    )  # fmt: skip


def craft(payout: Any, gravity: Any = (0.0, 0.0, 0.0)) -> System:
    """A free body that tumbles with a rod clamped to it, off its axes."""
    system, w = System(gravity=gravity), (0.1, 0.3, 1.0)
    system.add(parts.RigidBody(mass=1.0, inertia=(0.01, 0.02, 0.03), angular_velocity=w), "craft")
    rod = parts.Rod(
        length=0.5, section=SECTION, material=MATERIAL, elements=3, payout=payout, position=(0.1, 0.0, 0.0),
        direction=(0.8, 0.6, 0.0), angular_velocity=w, velocity=np.cross(w, (0.1, 0.0, 0.0)),
    )  # fmt: skip
    system.add(rod, "rod")
    system.add(parts.Joint(a="craft", b="rod.root", type="clamp"), "clamp")
    return system


BOTH_WAYS = {"ramp": {"angle": 0.2, "rate": 0.2, "steps": [[0.05, 0.05, -0.3]]}}


@pytest.mark.slow
@pytest.mark.parametrize("falls", [False, True], ids=["free", "falling"])
def test_balances(falls: bool, book: Book) -> None:
    """Energy with the work of drive and weight, and momenta of a free craft: to the error of the integration."""
    gravity = (0.0, -9.81, 0.0) if falls else (0.0, 0.0, 0.0)
    run = craft(BOTH_WAYS, gravity).simulate(until=0.15, every=0.01, method="dopri5", tolerance=1e-9)
    energy = float(np.abs(run["energy_defect"]).max() / run["energy_moved"].max())
    H, P, t = (np.asarray(run[name]) for name in ("angular_momentum", "momentum", "time"))
    out = np.asarray(run["rod"]["deployed_length"])
    assert out.max() > 0.21
    assert out[-1] < out.max() - 2e-3
    if falls:
        mass = 1.0 + 0.5 * MU
        assert np.abs(P - P[0] - mass * np.outer(t, gravity)).max() < 1e-9 * mass * 9.81
        assert energy < 1e-8
        return
    error = max(np.abs(H - H[0]).max() / np.linalg.norm(H[0]), np.abs(P - P[0]).max() / np.abs(P).max())
    book(
        "Dynamics", "momenta and energy of a craft whose rod is extruded and drawn in", reference="conserved",
        source="closed form", error=max(float(error), energy), allowed=1e-8,
    )  # fmt: skip


def test_the_defect_falls_with_the_square_of_the_step() -> None:
    """Of generalized-alpha, energy and angular momentum."""
    steps, defects = np.array([1e-3, 5e-4, 2.5e-4]), []
    for step in steps:
        run = craft(BOTH_WAYS).simulate(until=0.15, every=0.15, method="generalized-alpha", step=float(step))
        H = np.asarray(run["angular_momentum"])
        defects.append(np.abs(H - H[0]).max())
    assert fitted_order(steps, np.array(defects)) == pytest.approx(2.0, abs=0.3)


@pytest.mark.slow
def test_time_reversed() -> None:
    """With all velocities turned round, what was extruded is drawn in, back to the start."""
    there = craft(moved(0.2, 0.2)).assemble()
    done = solve(there, samples=[0.0, 0.01], method="dopri5", rtol=1e-11, atol=1e-13)
    back = craft(moved(-0.2, 0.202)).assemble()
    n_q, n_v = int(back.model.info.nq), int(back.model.info.nv)
    back.y[:n_q], back.y[n_q : n_q + n_v] = done.y[-1, :n_q], -done.y[-1, n_q : n_q + n_v]
    found = solve(back, samples=[0.0, 0.01], method="dopri5", rtol=1e-11, atol=1e-13)
    assert found.y[-1, :n_q] == pytest.approx(done.y[0, :n_q], abs=1e-8)


def test_the_weight_of_what_is_out() -> None:
    """Tip in equilibrium -mu g l^4/(8 EI) at the lengths of several times; light acts on what is out."""
    system = boom({"expression": "0.25 + 0.5*t"}, 16, gravity=(0.0, -0.1, 0.0))
    for time in (0.0, 0.5, 1.0):
        run, out = system.equilibrium(time=time), 0.25 + 0.5 * time
        tip = float(np.asarray(run["rod"]["tip_position"])[-1, 1])
        assert tip == pytest.approx(-MU * 0.1 * out**4 / (8.0 * EI), rel=5e-3)
        assert float(np.asarray(run["rod"]["deployed_length"])[-1]) == pytest.approx(out)
    lit = boom({"expression": "0.25 + 0.5*t"}, 4, section=Strip(thickness=THICKNESS, width=WIDTH))
    lit.add(parts.Radiation(along="rod", pressure=1e-6, direction=(0.0, 1.0, 0.0), specular=1.0), "light")
    force = np.abs(np.asarray(lit.equilibrium(time=1.0)["clamp"]["force"])[-1, 1])
    assert force == pytest.approx(2.0 * 1e-6 * WIDTH * 0.75, rel=1e-6)


@pytest.mark.slow
def test_a_rod_as_a_thread(book: Book) -> None:
    """A strip of hardly any bending stiffness, paid out from a spinning hub, lags as a thread on a moving mesh does."""
    b, W, section = 0.5, 2.0, Strip(thickness=1e-4, width=1e-2)
    material = Material(young_modulus=1e8, poisson_ratio=0.3, density=1000.0)
    lags = []
    for kind in ("rod", "thread"):
        system, r = System(), 1.0 if kind == "rod" else 0.05
        system.add(parts.RigidBody(motion="driven", axis=(0.0, 0.0, 1.0), inertia=1.0, rate=W), "hub")
        drive = {"ramp": {"angle": 0.5 / r, "steps": [[0.5, 2.0, 0.1 / r]]}}
        if kind == "rod":
            blade: Any = parts.Rod(
                length=2.0, section=section, material=material, elements=32, payout=drive, position=(b, 0.0, 0.0),
                velocity=(0.0, b * W, 0.0), angular_velocity=(0.0, 0.0, W), normal=(0.0, 1.0, 0.0),
                stiffness_damping=1e-3,
            )  # fmt: skip
            system.add(blade, "blade")
            root = parts.Joint(a="hub", b="blade.root", type="universal", axis=(0, 1, 0), axis_b=(0, 0, 1))
            system.add(root, "root")
        else:
            system.add(parts.Reel(body="hub", radius=r, centre=(b, 0.0, -r), drive=drive), "reel")
            k = 1e8 * 1e-6 * 32 / 2.0
            blade = parts.Thread(
                reel="reel", length=2.0, line_density=1e-3, nodes=32, stiffness=k, damping=1e-3 * k, mesh="moving"
            )
            system.add(blade, "blade")
        run = system.simulate(until=6.0, every=1.0, fine=False, method="generalized-alpha", step=2e-3)
        t, x = np.asarray(run["time"]), np.asarray(run["blade"]["position"])[:, -1 if kind == "rod" else 0]
        across = -np.sin(W * t) * x[:, 0] + np.cos(W * t) * x[:, 1]
        along = np.cos(W * t) * x[:, 0] + np.sin(W * t) * x[:, 1] - b
        lags.append(np.arctan2(across, along))
    error = float(np.abs(lags[0] - lags[1]).max() / np.abs(lags[1]).max())
    book(
        "Dynamics", "lag of a slender strip that a spinning hub pays out (32 elements)",
        reference="thread on a moving mesh", source="32 nodes", error=error, allowed=1e-3,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"payout": parts.FreeSpool(inertia=1.0)}, r"rod\.payout is a free spool"),
        ({"payout": moved(0.1, 1.5)}, r"1\.5 m out at the start; it must be from 0\.001 m"),
        ({"payout": moved(0.1, 0.0)}, r"0 m out at the start"),
        ({"curvature": (0.0, 0.0, 0.1)}, r"rod\.payout and rod\.curvature are both given"),
        ({"mass_damping": 0.1}, r"rod\.payout and rod\.mass_damping"),
        ({"grading": 2.0}, r"rod\.payout and rod\.grading"),
        ({"section": Taper(root=SECTION, tip=Rectangle(thickness=0.004, width=0.04))}, r"rod\.section is tapered"),
        ({"section": TapeSection(radius=0.02, angle=1.5, thickness=1e-4)}, r"the section of rod is a tape"),
        ({"inertia": {"offset": (0.01, 0.0)}}, r"rod\.inertia\.offset is"),
    ],
)
def test_what_is_refused(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        boom(**({"payout": moved(0.1, 0.5)} | keys)).assemble()


def test_what_is_refused_of_runs_and_other_parts() -> None:
    """Lengths beyond the whole, energy-momentum, places on the mesh, line loads, heat."""
    with pytest.raises(InputError, match=r"rod\.payout has 1\.\d+ m out at about \d"):
        boom(moved(0.1, 0.5)).simulate(until=10.0, every=1.0, method="generalized-alpha")
    with pytest.raises(InputError, match="energy-momentum does not support; use generalized-alpha"):
        boom(moved(0.1, 0.5)).simulate(until=1.0, every=1.0, method="energy-momentum")
    with pytest.raises(InputError, match=r"'rod' is a rod that pays out, through which sensitivities"):
        boom(moved(0.1, 0.5)).sensitivity(
            "rod.tip_speed.last", "rod.stiffness_damping", until=0.1, method="generalized-alpha", step=0.01
        )
    for part, words in (
        (parts.Load(at="rod[3]", force=(0.0, 1.0, 0.0)), r"a node of a mesh through which material flows"),
        (parts.Load(along="rod", force=(0.0, 1.0, 0.0)), r"a load along 'rod', whose length changes"),
        (parts.ThermalLoad(part="rod", temperature={"constant": 3.0}), r"on which thermal loads are not supported"),
    ):
        system = boom(moved(0.1, 0.5))
        system.add(part, "load")
        with pytest.raises(InputError, match=words):
            system.assemble()
