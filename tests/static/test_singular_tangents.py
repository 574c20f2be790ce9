"""Equilibria of closed loops of rigid hinges, which repeat one another's constraints: against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy
from scipy.optimize import brentq

import evolvent as ev
from evolvent import cases, parts
from evolvent.algebra.singular import Scaled, null_vectors
from evolvent_base.errors import RunFailed

BAR, HUB_MASS, BAR_MASS, STIFFNESS = 2.65, 0.2, 0.6, 20.0
#: Elevation of the bars at which the angle of a pivot is 0, and at the start, rad.
OPEN, START = math.radians(30.0), math.radians(60.0)
UNLATCHED = dict.fromkeys(("latch", "latch_stiffness", "latch_damping"))


def ring(count: int, start: float, gravity: float, **spring: float | None) -> ev.System:
    """Pantographs of the case `ring-antenna` in a ring, with rigid hinges at the hubs; keys of the springs, or None."""
    found = cases.content_of("ring-antenna")
    c, s = math.cos(math.pi / count), math.sin(math.pi / count)
    high, radius = BAR * math.sin(start), BAR * math.cos(start) / (2.0 * s)
    own = {name: part for name, part in found["parts"].items() if name != "net"}
    for part in own.values():
        if "repeat" in part:
            part["repeat"] = part["repeat"] | {"count": count}
        if part["kind"] == "joint" and part["type"] == "revolute":
            part["axis"] = [c, s, 0.0]
            for key in ("stiffness", "rotational_stiffness", "damping"):
                part.pop(key, None)
    own["pivot"]["axis"] = [-c, -s, 0.0]
    own["top"]["position"], own["foot"]["position"] = [radius, 0.0, high], [radius, 0.0, 0.0]
    own["boom"]["a"] = [radius, 0.0, 0.0]
    for name, sense in (("rise", -1.0), ("fall", 1.0)):
        turn = {"euler": [0.0, sense * start, 0.5 * math.pi + math.pi / count], "order": "xyz"}
        own[name] |= {"position": [radius * c * c, radius * c * s, 0.5 * high], "orientation": turn}
    keys = own["spring"] | {"start": 2.0 * (start - OPEN), **spring}
    own["spring"] = {key: value for key, value in keys.items() if value is not None}
    return ev.load({"system": "structure", "parts": own, "gravity": [0.0, 0.0, -gravity]})


@pytest.mark.parametrize(("count", "gravity"), [(3, 0.5), (5, 0.0), (14, 0.5)])
def test_ring_of_rigid_hinges(count: int, gravity: float) -> None:
    """Springs at all pivots carry the weight: 2 k (a - a0) + (hub + bar) g L cos f = 0, a = 2 (f - 30 deg)."""
    rest = math.radians(50.0)
    found = ring(count, START, gravity, rest=rest, **UNLATCHED).equilibrium()

    def moment(f: float) -> float:
        weight = (HUB_MASS + BAR_MASS) * gravity
        return 2.0 * STIFFNESS * (2.0 * (f - OPEN) - rest) + weight * BAR * math.cos(f)

    f = float(brentq(moment, OPEN, START, xtol=1e-14))
    heights = np.array([found[f"top {n + 1}"].position.values[0, 2] for n in range(count)])
    angles = np.array([found[f"spring {n + 1}"].angle.values[0] for n in range(count)])
    np.testing.assert_allclose(angles, 2.0 * (f - OPEN), atol=1e-9)
    np.testing.assert_allclose(heights, BAR * math.sin(f), rtol=1e-9)
    assert found.attrs["message"].startswith("the whole load is carried; ")
    assert f"{24 * count - 1} of " in found.attrs["message"]


def test_ring_that_floats() -> None:
    """Free motions beside redundant constraints: springs at rest without weight, nothing that holds it with weight."""
    rest = math.radians(50.0)
    floats, falls = (ring(4, START, gravity, rest=rest, **UNLATCHED) for gravity in (0.0, 0.5))
    for system in (floats, falls):
        system.remove("boom")
    found = floats.equilibrium()
    assert "against 6 motions" in found.attrs["message"]
    assert [found[f"spring {n}"].angle.values[0] for n in (1, 2, 3, 4)] == pytest.approx([rest] * 4, abs=1e-9)
    with pytest.raises(RunFailed, match="nothing holds 'top 1'"):
        falls.equilibrium()


@pytest.mark.parametrize("count", [3, 13])
def test_latched_ring_of_rigid_hinges(count: int) -> None:
    """Springs of 20 N m/rad, whose rest is at -60 deg, against latches of 100 kN m/rad."""
    found = ring(count, OPEN, 0.0).equilibrium()
    angles = [found[f"spring {n + 1}"].angle.values[0] for n in range(count)]
    assert angles == pytest.approx([-STIFFNESS * math.radians(60.0) / (1e5 + STIFFNESS)] * count, rel=1e-9)


@pytest.mark.parametrize(("free", "symmetric"), [(0, True), (1, True), (9, True), (3, False)])
def test_solution_without_null_vectors(free: int, symmetric: bool) -> None:
    """Against singular values of the dense matrix: number of null vectors, and the least solution."""
    rng = np.random.default_rng(free)
    n = 40
    U = np.linalg.qr(rng.standard_normal((n, n)))[0]
    V = U if symmetric else np.linalg.qr(rng.standard_normal((n, n)))[0]
    values = np.append(rng.uniform(0.1, 1.0, n - free) * rng.choice([-1.0, 1.0], n - free), np.zeros(free))
    A = U @ np.diag(values) @ V.T * np.outer(scales := rng.uniform(0.5, 2.0, n), scales)
    r = rng.standard_normal(n) * scales
    scaled = Scaled(scipy.sparse.csr_matrix(A))
    found, smallest = scaled.null(1e-10)
    assert found.shape == (n, free)
    assert smallest > 1e-3
    B = scaled.B.toarray()
    np.testing.assert_allclose(B @ found, 0.0, atol=1e-12)
    wanted = np.linalg.pinv(B, rcond=1e-10) @ (r / scaled.size) / scaled.size
    np.testing.assert_allclose(scaled.solve(r, found) * scaled.size, wanted * scaled.size, rtol=1e-9, atol=1e-9)


def test_null_vectors_whose_pivots_differ_by_decades() -> None:
    """Three chains of springs that nothing holds: their last pivots are round-off, or exactly zero."""
    chain = scipy.sparse.diags([np.full(9, -1.0), np.r_[1.0, np.full(8, 2.0), 1.0], np.full(9, -1.0)], [-1, 0, 1])
    A = scipy.sparse.block_diag([chain, chain / 3.0, chain * 7.7], format="csr")
    found = null_vectors(A, 1e-10)
    assert found.shape == (30, 3)
    np.testing.assert_allclose(A @ found, 0.0, atol=1e-12)


def test_platform_on_parallel_cranks() -> None:
    """Four cranks on a platform, of which any two would do: k (a - a0) + (M + 2 m) g l cos a = 0."""
    length, mass, crank, stiffness = 0.8, 3.0, 0.4, 40.0
    system, axis = ev.System(gravity=(0.0, 0.0, -9.81)), (0.0, 1.0, 0.0)
    start = math.radians(50.0)
    along = np.array([math.cos(start), 0.0, math.sin(start)]) * length
    places = [np.array([x, y, 0.0]) for x in (0.0, 1.0) for y in (0.0, 0.5)]
    middle = np.mean(places, axis=0) + along
    system.add(parts.RigidBody(mass=mass, shape={"box": (1.0, 0.5, 0.02)}, position=middle), "platform")
    for k, place in enumerate(places):
        turn = {"axis": axis, "angle": -start}
        shape = {"box": (length, 0.02, 0.02)}
        body = parts.RigidBody(mass=crank, shape=shape, position=place + 0.5 * along, orientation=turn)
        system.add(body, f"crank {k}")
        foot, tip = (-0.5 * length, 0.0, 0.0), (0.5 * length, 0.0, 0.0)
        system.add(parts.Joint(a=tuple(place), b=(f"crank {k}", foot), type="revolute", axis=axis), f"foot {k}")
        ends = {"a": ("platform", tuple(place + along - middle)), "b": (f"crank {k}", tip)}
        system.add(parts.Joint(type="revolute", axis=axis, **ends), f"tip {k}")
    spring = parts.JointSpring(joint="foot 0", stiffness=stiffness, start=0.0, rest=0.0)
    system.add(spring, "spring")
    found = system.equilibrium()

    def moment(angle: float) -> float:
        return stiffness * (angle - start) + (mass + 2.0 * crank) * 9.81 * length * math.cos(angle)

    angle = float(brentq(moment, start - 1.5, start, xtol=1e-14))
    assert float(found["platform"].position.values[0, 2]) == pytest.approx(length * math.sin(angle), rel=1e-9)
