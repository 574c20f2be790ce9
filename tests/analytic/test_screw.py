"""Screw joints against closed forms, under all methods."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, parts
from evolvent.families.joints import joint
from evolvent.solvers import Solution, solve
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import solve_implicit

G, M, J, PITCH = 9.81, 2.0, 0.05, 0.3
METHODS = ("rk4", "generalized-alpha", "energy-momentum")


def nut(pitch: float | None = PITCH, **fields: Any) -> System:
    """A nut on a fixed screw along z, whose centre is on its axis."""
    system = System(gravity=(0.0, 0.0, -G))
    system.add(parts.RigidBody(mass=M, inertia=(0.03, 0.04, J), position=(0.1, 0.2, 0.0)), "nut")
    system.add(parts.Joint(a="ground", b=("nut", (0.0, 0.0, 0.0)), type="screw", pitch=pitch, **fields), "screw")
    return system


def solved(system: System, times: Any, method: str, step: float) -> Solution:
    """A run that ends well."""
    assembly = system.assemble()
    if method == "rk4":
        found = solve(assembly, samples=times, method="rk4", step=step)
    elif method == "generalized-alpha":
        found = solve_implicit(assembly, samples=times, step=step, spectral_radius=0.9)
    else:
        found = solve_energy(assembly, samples=times, step=step, spectral_radius=1.0)
    assert found.success, found.message
    return found


@pytest.mark.parametrize("pitch", [PITCH, -PITCH])
@pytest.mark.parametrize("method", METHODS)
def test_a_nut_runs_down_its_screw(method: str, pitch: float) -> None:
    """z'' = -g/(1 + J/(m p^2)), p = pitch/2 pi, by more than a turn; the screw carries m (g + z'')."""
    p = pitch / (2.0 * math.pi)
    a = -G / (1.0 + J / (M * p * p))
    times = np.linspace(0.0, 1.2, 7)
    found = solved(nut(pitch), times, method, 2.5e-3 if method == "energy-momentum" else 5e-3)
    loose = 10.0 if method == "energy-momentum" else 1.0
    z, w = found.y[:, 2], found.y[:, int(found.assembly.model.info.nq) + 5]
    assert z == pytest.approx(0.5 * a * times**2, abs=1e-4 * loose * abs(pitch))
    assert w == pytest.approx(a * times / p, abs=2e-4 * loose * abs(a / p))
    assert abs(z[-1]) > 1.0 * abs(pitch)
    la = found.la[-1, found.assembly.model.joints["kind"] == joint.GEAR]
    assert np.abs(la) == pytest.approx(M * (G + a), rel=1e-3)


def test_a_screw_on_a_free_body() -> None:
    """A body that tumbles with a nut on it keeps energy and momentum; explicit and implicit motions are the same."""
    ends = {}
    for method in METHODS:
        system = System()
        w = np.array([0.3, -0.4, 0.6])
        system.add(parts.RigidBody(mass=3.0, inertia=(0.2, 0.3, 0.25), angular_velocity=tuple(w)), "frame")
        place, axis = np.array([0.3, 0.1, 0.0]), np.array([0.6, 0.0, 0.8])
        turns = w + 2.0 * axis
        v = np.cross(w, place) + 2.0 * PITCH / (2.0 * math.pi) * axis
        moves = {"velocity": tuple(v), "angular_velocity": tuple(turns)}
        system.add(parts.RigidBody(mass=M, inertia=(0.03, 0.04, J), position=tuple(place), **moves), "nut")
        held = parts.Joint(a="frame", b=("nut", (0.0, 0.0, 0.0)), type="screw", axis=tuple(axis), pitch=PITCH)
        system.add(held, "screw")
        found = solved(system, [0.0, 0.5], method, 0.01)
        ends[method] = found.y[-1, : int(found.assembly.model.info.nq)]
        if method != "generalized-alpha":
            defect = np.abs(found.energy_defect).max() / found.balance.kinetic[0]
            assert defect < (1e-7 if method == "rk4" else 1e-12)
    for method in METHODS[1:]:
        assert np.abs(ends[method] - ends["rk4"]).max() < 2e-4


def test_a_torque_holds_a_load() -> None:
    """T = F pitch/2 pi in equilibrium."""
    system = nut()
    system.add(parts.Load(at="nut", torque=(0.0, 0.0, M * G * PITCH / (2.0 * math.pi))), "key")
    found = solve_static(system.assemble())
    assert found.success, found.message
    assert np.abs(found.y[-1, 2]) < 1e-9


def test_results_of_a_screw() -> None:
    """Travel, angle over a turn, force and moment of the thread on the nut."""
    run = nut().simulate(until=1.2, every=0.2, method="energy-momentum", step=5e-3)
    screw, p = run["screw"], PITCH / (2.0 * math.pi)
    assert screw.travel.values == pytest.approx(p * screw.angle.values, abs=1e-9)
    assert abs(screw.angle.values[-1]) > 2.0 * math.pi
    a = -G / (1.0 + J / (M * p * p))
    assert screw.force.values[-1] == pytest.approx([0.0, 0.0, M * (G + a)], abs=0.02)
    assert screw.moment.values[-1] == pytest.approx([0.0, 0.0, J * a / p], abs=0.02)


def test_what_a_screw_refuses() -> None:
    with pytest.raises(InputError, match=r"screw.pitch is None; a screw joint needs its travel a turn"):
        nut(None).assemble()
    system = System()
    system.add(parts.Point(mass=1.0), "bob")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="screw", pitch=0.1), "screw")
    with pytest.raises(InputError, match="screw"):
        system.assemble()
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=0.1), "body")
    system.add(parts.Joint(a="ground", b=("body", (0.0, 0.0, 0.0)), pitch=0.1), "pin")
    with pytest.raises(InputError, match=r"pin.pitch is given, but pin.type is 'spherical', not 'screw'"):
        system.assemble()
