"""The tangent of every load on every kind of target against central differences, at a deformed and turned state."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import System, elements, parts
from evolvent.assembly.assembled import Assembly
from evolvent.equations import energy_momentum as flow
from evolvent.parts.base import unit
from evolvent.solvers.common.matrices import matrix_of
from evolvent.solvers.static.work import sparse_of
from evolvent.solvers.time.implicit import energy_momentum
from implicit.rigs import Equations

Array = np.ndarray

SOFT = elements.Material(young_modulus=2e3, poisson_ratio=0.3, density=100.0, thermal_expansion=1e-3)
SECTION = elements.Rectangle(thickness=0.05, width=0.08)
INERTIA = [[0.3, 0.02, -0.01], [0.02, 0.25, 0.03], [-0.01, 0.03, 0.2]]
VECTOR = (0.7, -1.1, 0.9)
#: Of position and velocity; without a potential.
LAW = ["-2*x*y + 0.5*vy + 0.3", "1.5*sin(z) - 0.4*vx*vz", "x - 3*z*y + 0.2*vz"]
#: Of position, angular velocity and attitude.
TURNING = ["r11*r23 - 0.3*vy*r31 + x", "0.8*r12*r12 - z*r33", "r21*vz*r13 - 0.4*r32"]
#: Names of the parts that are not loads.
FREE, SPIN, POINT, ROD, CABLE, BEAM, THREAD = "free", "spin", "point", "rod", "cable", "beam", "thread"


def add_target(system: System, name: str) -> None:
    """A body, point mass, rod, beam or thread that nothing holds."""
    if name == FREE:
        turned = unit((0.8, 0.3, -0.4, 0.2))
        system.add(parts.RigidBody(mass=2.0, inertia=INERTIA, position=(0.3, -0.2, 0.1), orientation=turned), name)
    elif name == SPIN:
        spin = {"motion": "spin", "axis": (0.1, 0.3, 1.0), "orientation": unit((0.9, 0.1, 0.2, -0.3))}
        system.add(parts.RigidBody(inertia=INERTIA, position=(-0.5, 0.1, 0.2), **spin), name)
    elif name == POINT:
        system.add(parts.Point(mass=0.7, position=(0.9, 0.4, -0.6)), name)
    elif name == ROD:
        curved = {"curvature": (0.3, -0.2, 0.5), "position": (0.2, 0.1, -0.3)}
        system.add(parts.Rod(length=1.0, section=SECTION, material=SOFT, elements=2, **curved), name)
    elif name == THREAD:
        system.add(parts.RigidBody(mass=2.0, inertia=INERTIA, position=(0.3, -0.2, 0.1)), "hub")
        drive = parts.ConstantDrive(rate=0.0, angle=20.0)
        system.add(parts.Reel(body="hub", centre=(0.5, 0.1, 0.2), radius=0.05, drive=drive), "reel")
        system.add(parts.Thread(reel="reel", length=1.2, line_density=0.1, tip_mass=0.2, nodes=4, stiffness=50.0), name)
    else:
        formulation = "cable" if name == CABLE else "assumed_strain"
        shape = {"formulation": formulation, "section": SECTION, "material": SOFT}
        system.add(parts.Beam(length=1.0, elements=2, position=(0.2, 0.1, -0.3), **shape), name)


def pair(target: str, load: parts.Part) -> tuple[Assembly, Assembly]:
    """The target with and without the load."""
    found = []
    for has_load in (True, False):
        system = System()
        add_target(system, target)
        if has_load:
            system.add(load, "load")
        found.append(system.assemble())
    return found[0], found[1]


def state(assembly: Assembly, rng: np.random.Generator, moving: float) -> Array:
    """A state off the start: deformed, turned by some 20 degrees, and with velocities."""
    model = assembly.model
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    y = assembly.y.copy()
    y[:n_q] += 0.05 * rng.standard_normal(n_q)
    y[n_q : n_q + n_v] = moving * rng.standard_normal(n_v)
    for row in model.bodies[model.bodies["motion"] == 2]:
        q = row["iq"] + 3
        y[q : q + 4] += 0.15 * rng.standard_normal(4)
        y[q : q + 4] /= np.linalg.norm(y[q : q + 4])
    return y


def columns(assembly: Assembly, y: Array, rate: float) -> tuple[Array, Array]:
    """Tangent and residuals of the displacements +-h of every unknown, for the differences: (n, n) and (n, 2, n)."""
    n = int(assembly.model.info.nv)
    assembly.model.switches[:] = assembly.s
    equations, none = Equations(assembly, 0.37, y, np.zeros(n), 0.0, rate), np.zeros(0)
    moved = [[equations.residual(s * H * e, none) for s in (1.0, -1.0)] for e in np.eye(n)]
    return equations.tangent(none), np.array(moved)


H = 1e-5


def off(pairs: tuple[Assembly, Assembly], rng: np.random.Generator, method: str) -> float:
    """Largest difference of the load's tangent from the differences of its forces, beside the largest of them."""
    moving, rate = (0.0, 0.0) if method == "static" else (0.5, 3.0)
    y = state(pairs[1], rng, moving)
    (K1, r1), (K0, r0) = (columns(assembly, y, rate) for assembly in pairs)
    r = r1 - r0
    exact, found = (r[:, 0] - r[:, 1]).T / (2.0 * H), K1 - K0
    return float(np.abs(found - exact).max() / max(np.abs(exact).max(), 1.0))


@evolvent.law
def turning(t: float, x: Array, R: Array, w: Array, p: Array) -> tuple[float, float, float]:
    """`TURNING` in Python."""
    return (
        R[0, 0] * R[1, 2] - 0.3 * w[1] * R[2, 0] + x[0],
        0.8 * R[0, 1] * R[0, 1] - x[2] * R[2, 2],
        R[1, 0] * w[2] * R[0, 2] - 0.4 * R[2, 1],
    )  # fmt: skip


def placed() -> dict[str, tuple[str, parts.Part]]:
    """Forces and torques of every form at every kind of place."""
    places: dict[str, Any] = {
        "body": FREE, "body's point": (FREE, (0.1, 0.2, -0.3)), "spinning body": SPIN,
        "spinning body's point": (SPIN, (0.2, -0.1, 0.3)), "point": POINT, "rod's root": "rod.root",
        "rod's node": "rod[1]", "rod's tip": "rod.tip", "cable's root": "cable.root", "cable's node": "cable[1]",
        "beam's node": "beam[1]", "beam's tip": "beam.tip", "thread's tip": "thread.tip", "thread's node": "thread[2]",
    }  # fmt: skip
    constant = {"constant": 0.8}
    found: dict[str, tuple[str, parts.Part]] = {}
    for place, at in places.items():
        target = at[0] if isinstance(at, tuple) else at.partition(".")[0].partition("[")[0]
        for frame in ("inertial",) if target in (POINT, CABLE) else ("inertial", "body"):
            found[f"force, {place}, {frame}"] = target, parts.Load(at=at, force=VECTOR, frame=frame)
            found[f"profile, {place}, {frame}"] = (
                target, parts.Load(at=at, direction=VECTOR, profile=constant, frame=frame)
            )  # fmt: skip
            found[f"law, {place}, {frame}"] = target, parts.Load(at=at, law=LAW, frame=frame)
            if target not in (POINT, THREAD) and not isinstance(at, tuple):
                found[f"torque, {place}, {frame}"] = target, parts.Load(at=at, torque=VECTOR, frame=frame)
                found[f"torque by a law, {place}, {frame}"] = (
                    target,
                    parts.Load(at=at, type="torque", law=LAW, frame=frame),
                )
            if target in (FREE, SPIN, ROD) and not isinstance(at, tuple):
                for form, law in (("text", TURNING), ("Python", turning)):
                    load = parts.Load(at=at, type="torque", law=law, frame=frame)
                    found[f"torque by the attitude, {form}, {place}, {frame}"] = target, load
    return found


def spread() -> dict[str, tuple[str, parts.Part]]:
    """Loads on whole parts, and fields."""
    found: dict[str, tuple[str, parts.Part]] = {}
    for target in (FREE, SPIN):
        light = {"area": 2.0, "normal": (0.3, 0.2, 0.9), "pressure": 1.5, "specular": 0.5, "diffuse": 0.3}
        for side in (1.0, -1.0):
            direction = (side * 0.4, side * 0.1, side * 1.0)
            panel = parts.Radiation(at=(target, (0.1, 0.2, -0.3)), direction=direction, **light)
            found[f"light {side:g}, {target}"] = target, panel
    for target in (ROD, CABLE, BEAM):
        found[f"line, {target}"] = target, parts.Load(along=target, force=VECTOR)
        found[f"line by a law, {target}"] = target, parts.Load(along=target, law=LAW)
        heat = {"temperature": {"constant": 3.0}} | ({} if target == CABLE else {"gradient_y": {"constant": 40.0}})
        found[f"heat, {target}"] = target, parts.ThermalLoad(part=target, **heat)
    for target in (CABLE, BEAM):
        spread_torque = {"torque": tuple(0.6 * unit((0.2, 0.3, 1.0))), "centre": (0.1, -0.3, 0.2), "pitch": 0.7}
        found[f"torque, {target}"] = target, parts.Load(along=target, **spread_torque)
        found[f"slope, {target}"] = target, parts.Load(at=f"{target}.tip", slope=1, torque=VECTOR)
    for target in (FREE, SPIN, POINT, ROD, CABLE, BEAM, THREAD):
        found[f"orbit, {target}"] = target, parts.Field(type="orbit", rate=0.9)
        found[f"field, {target}"] = target, parts.Field(law=LAW)
    for frame in ("inertial", "body"):
        found[f"line, thread, {frame}"] = THREAD, parts.Load(along=THREAD, force=VECTOR, frame=frame)
    found["line by a law, thread"] = THREAD, parts.Load(along=THREAD, law=LAW)
    return found


LOADS = placed() | spread()


@pytest.mark.slow
@pytest.mark.parametrize("method", ["static", "generalized-alpha"])
@pytest.mark.parametrize("name", LOADS)
def test_tangent_of_a_load(name: str, method: str, rng: np.random.Generator) -> None:
    """Without what turns of a body within a step change: the state is that of the step's start."""
    assert off(pair(*LOADS[name]), rng, method) < 1e-6


def step_columns(assembly: Assembly, dq: Array) -> tuple[Array, Array]:
    """As `columns`, of a step of energy-momentum with the increments dq; residuals are doubled."""
    plan = energy_momentum.plan(assembly, samples=[0.0, 1.0], step=0.01)
    model, work = plan.assembly.model, plan.workspace().step
    work.step.t, work.step.h, work.step.ratio = 0.0, 0.01, 0.0
    flow.measure(0, model, work)

    def residual(d: Array) -> Array:
        work.dq[:] = dq + d
        flow.residual(model, work)
        return 2.0 * work.r.copy()

    moved = [[residual(s * H * e) for s in (1.0, -1.0)] for e in np.eye(dq.size)]
    residual(np.zeros(dq.size))
    matrix = matrix_of(model)
    flow.tangent(1.0, model, work, matrix)
    return sparse_of(matrix).toarray(), np.array(moved)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, (target, _) in LOADS.items() if target != THREAD])
def test_tangent_of_a_load_over_a_step(name: str, rng: np.random.Generator) -> None:
    """Of energy-momentum, but for the angle turned in the step, 1e-3."""
    pairs = pair(*LOADS[name])
    y = state(pairs[1], rng, 0.0)
    dq = 1e-3 * rng.standard_normal(int(pairs[1].model.info.nv))
    (K1, r1), (K0, r0) = (step_columns(dataclasses.replace(assembly, y=y), dq) for assembly in pairs)
    exact, found = ((r1 - r0)[:, 0] - (r1 - r0)[:, 1]).T / (2.0 * H), K1 - K0
    assert np.abs(found - exact).max() < 1e-2 * max(np.abs(exact).max(), 1.0)
