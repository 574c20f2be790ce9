"""A stored hinge and a stored coil, released: the same problems stated again and integrated by SciPy."""

from __future__ import annotations

import math
from typing import Any

import pytest
import scipy

from book import Book
from evolvent import System, parts
from viscoelastic_rods import bent_rod

CHAPTER = "Relaxation and storage"
PRONY = [(0.3, 0.5), (0.3, 1e4)]
STIFFNESS, REST, INERTIA = 2.0, 0.5, 0.5
STORED, RELEASED, UNTIL = 1e3, 0.2, 1.2


def hinge() -> System:
    """A panel held at zero by a clamp for `STORED` and for `RELEASED` more."""
    system = System(sections={"store": {"time": STORED}})
    system.add(parts.RigidBody(mass=2.0, inertia=(0.3, 0.3, INERTIA)), "panel")
    system.add(parts.Joint(a="ground", b="panel", type="revolute", axis=(0, 0, 1), position=(0, 0, 0)), "hinge")
    spring = parts.JointSpring(joint="hinge", stiffness=STIFFNESS, rest=REST, viscoelastic={"prony": PRONY})
    system.add(spring, "spring")
    system.add(parts.Joint(a="ground", b="panel", type="clamp", position=(0, 0, 0), until=RELEASED), "hold-down")
    return system


def angle_by_scipy() -> float:
    """The angle at `UNTIL`: the dashpots of all branches through storage, then with the motion."""

    def rates(_: float, z: Any, free: float) -> list[float]:
        x, v, *dashpots = z
        left = 1.0 - sum(share for share, _ in PRONY)
        branches = sum(share * (x - REST - own) for (share, _), own in zip(PRONY, dashpots, strict=True))
        torque = -STIFFNESS * (left * (x - REST) + branches)
        flows = [(x - REST - own) / time for (_, time), own in zip(PRONY, dashpots, strict=True)]
        return [free * v, free * torque / INERTIA, *flows]

    z = [0.0] * 4
    for until, free in ((STORED + RELEASED, 0.0), (UNTIL - RELEASED, 1.0)):
        found = scipy.integrate.solve_ivp(rates, (0.0, until), z, "Radau", args=(free,), rtol=1e-11, atol=1e-14)
        z = found.y[:, -1]
    return float(z[0])


@pytest.mark.parametrize("method", ["generalized-alpha", "energy-momentum"])
def test_a_stored_and_released_hinge(method: str, book: Book) -> None:
    exact, errors = angle_by_scipy(), []
    for step in (0.01, 0.005):
        run = hinge().simulate(until=UNTIL, every=UNTIL, fine=False, method=method, step=step, spectral_radius=1.0)
        errors.append(abs(float(run["spring"].angle.values[-1]) / exact - 1.0))
    order = math.log2(errors[0] / errors[1])
    assert order == pytest.approx(2.0, abs=0.1)
    book(
        CHAPTER, f"Hinge stored for 1000 s and released, two terms ({method})", reference="angle 1 s after the release",
        source="SciPy, Radau", error=errors[1], allowed=5e-5, order=order, wanted="2",
    )  # fmt: skip


def test_a_stored_and_released_coil(book: Book) -> None:
    """A rod bent to a curvature, held for one relaxation time and released, with a force on its tip at once."""
    curvature, force, modulus, radius = 2.0, 0.3, 1e9, 0.005
    area, second = math.pi * radius**2, 0.25 * math.pi * radius**4
    kept = curvature * 0.6 * (1.0 - math.exp(-1.0))
    shear = 0.886 * modulus / 2.6 * area

    def end(moment: float) -> Any:
        def rates(_: float, y: Any) -> list[float]:
            c, s = math.cos(y[2]), math.sin(y[2])
            along, across = 1.0 - force * s / (modulus * area), -force * c / shear
            dx, dy = along * c - across * s, along * s + across * c
            return [dx, dy, y[3] / (modulus * second) + kept, dx * force]

        start = [0.0, 0.0, 0.0, moment]
        return scipy.integrate.solve_ivp(rates, (0.0, 1.0), start, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]

    exact = end(scipy.optimize.brentq(lambda moment: end(moment)[3], -1.0, 1.0, xtol=1e-15))[:2]
    system = bent_rod({"prony": [(0.6, 1.0)]}, curvature=curvature, elements_=16)
    system.sections["store"] = {"time": 1.0}
    system.replace("tip", parts.Joint(a="ground", b="rod.tip", type="clamp", until=0.5))
    system.add(parts.Load(at="rod.tip", direction=(0, -1, 0), profile={"constant": force}), "load")
    found = system.equilibrium(time=1.0)["rod"].position.values[-1, -1, :2]
    book(
        CHAPTER, "Coiled rod held for one relaxation time, released and loaded (16 elements): tip", allowed=2e-7,
        reference="rod of Reissner with the curvature kept", source="SciPy DOP853, shooting", unit="m",
        error=float(math.hypot(*(found - exact))),
    )  # fmt: skip
