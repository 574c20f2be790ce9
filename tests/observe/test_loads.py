"""Loads: their values, and their work against displacements and the solver's own account."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import System, elements, parts
from observe.seeing import EXPLICIT, IMPLICIT, Seen, close, run

METHODS = pytest.mark.parametrize("method", [EXPLICIT, IMPLICIT])
SQUARE = elements.Rectangle(thickness=0.05, width=0.05)
SOFT = elements.Material(young_modulus=2e7, poisson_ratio=0.0, density=1000.0)


def account(found: Seen) -> Any:
    """Work of loads since the start, as the solver counts it."""
    values = found.solution.balance.loads
    return values - values[0]


@METHODS
def test_a_force_on_a_point(method: str) -> None:
    """Between two times, which are samples: work F . (x1 - x0)."""
    system, F = System(), np.array([0.5, 0.0, 1.0])
    system.add(parts.Point(mass=2.0, velocity=(0.1, 0.2, 0.0)), "ball")
    system.add(parts.Load(at="ball", force=tuple(F), start=0.2, until=0.7), "push")
    found = run(system, np.linspace(0.0, 1.0, 101), method, **({"step": 5e-3} if method == IMPLICIT else {}))
    acts = (found.t >= 0.2 - 1e-9) & (found.t < 0.7 - 1e-9)
    x = found.state("ball", 3)
    close(found.of("push", "force"), acts[:, None] * F)
    close(found.of("push", "position"), x)
    close(found.of("push", "power"), acts * (found.state("ball", 3, rate=True) @ F))

    wanted = (x[np.clip(np.arange(101), 20, 70)] - x[20]) @ F
    close(found.of("push", "work"), wanted, part=1e-4)
    close(found.of("push", "work"), account(found), part=1e-3)


@METHODS
def test_a_torque_and_a_force_in_body_axes(method: str) -> None:
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.2, 0.3, 0.4), angular_velocity=(0.5, 0.0, 2.0)), "hub")
    system.add(parts.Load(at="hub", torque=(0.0, 0.1, 0.3), frame="body"), "motor")
    system.add(parts.Load(at=("hub", (0.5, 0.0, 0.0)), force=(0.0, 1.0, 0.2), frame="body"), "jet")
    found = run(system, np.linspace(0.0, 2.0, 801), method, **({"step": 1e-3} if method == IMPLICIT else {}))
    R, w = found.rotation("hub"), found.state("hub", 3, at=3, rate=True)
    torque, force, arm = np.array([0.0, 0.1, 0.3]), np.array([0.0, 1.0, 0.2]), np.array([0.5, 0.0, 0.0])
    close(found.of("motor", "torque"), R @ torque)
    close(found.of("motor", "power"), w @ torque)
    close(found.of("jet", "force"), R @ force)
    close(found.of("jet", "position"), found.state("hub", 3) + R @ arm)
    own = np.einsum("tji,tj->ti", R, found.state("hub", 3, rate=True)) + np.cross(w, arm)
    close(found.of("jet", "power"), own @ force)
    close(found.of("motor", "work") + found.of("jet", "work"), account(found), part=1e-4)


def flying(**fields: Any) -> System:
    system = System()
    plain = parts.Beam(length=1.0, section=SQUARE, material=SOFT, elements=4, **fields)
    system.add(plain.replaced(rates=np.cross([0.0, 0.0, 1.5], plain.start_nodes()), position=(0.3, 0.1, 0.0)), "rod")
    return system


LOADS = {
    "point": parts.Load(at="rod.tip", force=(0.3, 1.0, 0.0), start=0.1, until=0.4, ramp=0.1),
    "slope": parts.Load(at="rod[2]", slope=1, torque=(0.0, 0.2, 0.0), ramp=0.2),
    "line": parts.Load(along="rod", force=(0.0, 1.0, 0.5), ramp=0.1, until=0.35),
    "spread": parts.Load(along="rod", torque=(0.0, 0.3, 0.4), centre=(0.2, 0.1, 0.0), ramp=0.1),
}


@pytest.mark.parametrize("which", list(LOADS))
@pytest.mark.parametrize("formulation", ["cable", "assumed_strain"])
def test_loads_on_beams(which: str, formulation: str) -> None:
    """Work of one load against the solver's account of all."""
    load, system = LOADS[which], flying(formulation=formulation)
    system.add(load, "load")
    found = run(system, np.linspace(0.0, 0.5, 501), step=2.5e-4)
    close(found.of("load", "work"), account(found), part=2e-3)
    s = np.clip((found.t - load.start) / load.ramp, 0.0, 1.0)
    share = np.where(
        (found.t >= load.start) & (found.t < (np.inf if load.until is None else load.until)),
        s * s * (3.0 - 2.0 * s),
        0.0,
    )
    nodes, mid = found.nodes("rod"), found.of("load", "position")
    if which == "point":
        close(found.of("load", "force"), share[:, None] * np.array(load.force))
        close(mid, nodes[:, -1, 0])
    elif which == "slope":
        close(found.of("load", "generalized_force"), share[:, None] * np.array(load.torque))
        close(mid, nodes[:, 2, 0])
    elif which == "line":
        close(found.of("load", "force"), share[:, None] * np.array(load.force))  # of a metre
        xi, weights = np.polynomial.legendre.leggauss(4)
        middle = sum(
            0.125 * w * np.tensordot(np.array(elements.axis_shape(0.25, 0.5 + 0.5 * at)), np.stack(
                [nodes[:, i, 0], nodes[:, i, 1], nodes[:, i + 1, 0], nodes[:, i + 1, 1]]), axes=1)
            for i in range(4) for at, w in zip(xi, weights, strict=True)
        )  # fmt: skip
        close(mid, middle)
    else:
        close(found.of("load", "torque"), 0.5 * share[:, None] * np.array([0.0, 0.6, 0.8]))


def test_a_torque_spread_over_a_beam_turns_a_stiff_rod() -> None:
    """About its end: J w' = T, J = m L^2/3, and the power is T w."""
    system = System()
    hard = elements.Material(young_modulus=1e10, poisson_ratio=0.0, density=1000.0)
    system.add(parts.Beam(length=1.0, section=SQUARE, material=hard, elements=2, formulation="cable"), "rod")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root", type="revolute"), "pin")
    system.add(parts.Load(along="rod", torque=(0.0, 0.0, 0.6)), "motor")
    found = run(system, np.linspace(0.0, 2.0, 101), step=2e-3, spectral_radius=0.4)
    rate = 0.6 / (2.5 / 3.0) * found.t
    close(found.of("motor", "power"), 0.6 * rate, part=5e-3)
    close(found.of("motor", "work"), 0.3 * rate * found.t, part=5e-3)


THREAD = {
    "wind": parts.Load(along="thread", force=(0.02, 0.05, 0.01)),
    "air": parts.Load(
        along="thread", law=["-c*vx - a*z", "-c*vy + a*x", "-c*vz + a*t"], constants={"c": 0.3, "a": 0.02}
    ),
    "light": parts.Radiation(along="thread", pressure=0.2, width=0.1, direction=(0.0, 3.0, 4.0), specular=0.6),
    "jet": parts.Load(along="thread", force=(0.03, 0.0, 0.0), frame="body"),
}


@pytest.mark.parametrize("method", ["rk4", IMPLICIT])
def test_loads_along_a_thread(method: str) -> None:
    """Resultants from the raw state of the nodes, on a base that turns; their works are the solver's account."""
    system = System()
    system.add(parts.RigidBody(motion="driven", rate=0.5), "base")
    reel = {"centre": (0.0, 0.1, 0.0), "payout_axis": (0.0, 0.0, -1.0), "spool_axis": (1.0, 0.0, 0.0)}
    drive = parts.ConstantDrive(rate=1.0, angle=5.0)
    system.add(parts.Reel(body="base", radius=0.1, drive=drive, **reel), "reel")
    system.add(
        parts.Thread(reel="reel", length=1.0, line_density=0.1, nodes=5, stiffness=400.0, damping=2.0, tip_mass=0.2),
        "thread",
    )
    for name, load in THREAD.items():
        system.add(load, name)
    samples = np.linspace(0.0, 1.0, 401)
    found = run(system, samples, method, step=5e-4 if method == "rk4" else 2.5e-3)
    x, v = (found.state("thread", 15, rate=rate).reshape(-1, 5, 3) for rate in (False, True))
    count, t = found.solution.s[:, 0], found.t
    span = np.where(count[:, None] > np.arange(5), np.array([0.1, 0.2, 0.2, 0.2, 0.2]), 0.0)
    Q = found.assembly.model.threads["departure"][0]
    inner = np.concatenate([x[:, 1:], x[:, :1]], axis=1)
    inner[np.arange(t.size), count - 1] = Q
    outer = np.concatenate([x[:, :1], x[:, :-1]], axis=1)
    turned = np.stack([np.cos(0.5 * t), np.sin(0.5 * t), 0.0 * t], axis=1)
    normal = np.cross(outer - inner, turned[:, None])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    sun = np.array([0.0, 0.6, 0.8])
    c = normal @ sun
    per_length = {
        "wind": np.broadcast_to([0.02, 0.05, 0.01], x.shape),
        "air": -0.3 * v + 0.02 * np.stack([-x[..., 2], x[..., 0], np.broadcast_to(t[:, None], c.shape)], axis=-1),
        "light": 0.02 * np.abs(c)[..., None] * (0.4 * sun + 1.2 * c[..., None] * normal),
        "jet": np.broadcast_to(0.03 * turned[:, None], x.shape),
    }
    for name, force in per_length.items():
        close(found.of(name, "force"), np.einsum("tn,tnc->tc", span, force))
        close(found.of(name, "power"), np.einsum("tn,tnc,tnc->t", span, force, v))
        close(found.of(name, "position"), np.einsum("tn,tnc->tc", span, x) / span.sum(axis=1)[:, None])
        assert found.tree[name].attrs["plots"] == '["force"]'
    assert count[0] == 3
    assert count[-1] == 4
    close(sum(found.of(name, "work") for name in THREAD), account(found), part=2e-3)


@pytest.mark.parametrize("copies", [1, 2])
def test_a_load_on_copies_of_a_thread_does_work_on_all(copies: int) -> None:
    system = System()
    system.add(parts.RigidBody(inertia=0.004, motion="spin", rate=6.0), "wheel")
    drive = parts.ConstantDrive(rate=3.5, angle=100.0)
    system.add(parts.Reel(body="wheel", centre=(0.05, 0.0, 0.0), radius=0.01, drive=drive), "reel")
    thread = parts.Thread(
        reel="reel", length=2.0, line_density=7e-4, nodes=3, multiplicity=copies, segments="inextensible"
    )
    system.add(thread, "blade")
    system.add(parts.Load(along="blade", force=(0.0, 0.0, 1e-3)), "wind")
    found = run(system, np.linspace(0.0, 0.05, 101), "dopri5")
    assert found.of("wind", "work")[-1] > 0.0
    close(found.of("wind", "work"), account(found), part=1e-3)
    assert ("of one copy" in found.tree["wind"]["force"].attrs["long_name"]) == (copies == 2)
