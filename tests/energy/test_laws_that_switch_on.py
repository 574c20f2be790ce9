"""Users' laws under energy-momentum: their work is the line integral of the law, so piecewise laws keep energy."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import System, law, parts
from evolvent.equations.energy_momentum import measure, residual, tangent
from evolvent.solvers.static.work import sparse_of
from evolvent.solvers.time.implicit.energy_momentum import plan

METHOD = "energy-momentum"
#: Walls at +-0.5 of the stiffness k, by the coordinate that stands in the braces.
WALLS = "where({0} > 0.5, -k*({0} - 0.5), where({0} < -0.5, -k*({0} + 0.5), 0))"
K = {"k": 5e3}


@law
def walls(t, x, v, parameters, f):
    over = max(x[0] - 0.5, 0.0) + min(x[0] + 0.5, 0.0)
    f[0] = -parameters[0] * over
    return 0.5 * parameters[0] * over * over, 0.0


@law
def jumps(t, x, v, parameters):
    return -parameters[0] if x > 0.05 else 0.0


def point(**fields: object) -> System:
    system = System()
    system.add(parts.Point(mass=2.0, position=(0.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0)), "shuttle")
    return system


def by_force() -> System:
    system = point()
    system.add(parts.Load(at="shuttle", law=[WALLS.format("x"), "0", "0"], constants=K), "walls")
    return system


def by_spring() -> System:
    """Of a length of 10 m, on one side."""
    system = point()
    law = "-(" + WALLS.format("x") + ")"
    system.add(parts.Spring(a=(-10.0, 0.0, 0.0), b="shuttle", length=10.0, law=law, constants=K), "walls")
    return system


def by_custom_force() -> System:
    system = point()
    system.add(parts.CustomForce(points=["shuttle"], law=walls, parameters=(K["k"],)), "walls")
    return system


def by_field() -> System:
    system = point()
    law = ["(" + WALLS.format("x") + ")/2", "0", "0"]
    system.add(parts.Field(law=law, constants=K), "walls")
    return system


def by_motor() -> System:
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=0.01, velocity=(1.0, 0.0, 0.0)), "shuttle")
    system.add(parts.Joint(a="ground", b="shuttle", type="prismatic", axis=(1, 0, 0), position=(0, 0, 0)), "rail")
    system.add(parts.Motor(joint="rail", law=WALLS.format("x"), constants=K), "walls")
    return system


def by_torque() -> System:
    """A body that turns between walls at +-0.5 rad, by the sine and cosine of its angle."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=2.0, angular_velocity=(0.0, 0.0, 1.0)), "shuttle")
    system.add(
        parts.Load(at="shuttle", type="torque", law=["0", "0", WALLS.format("atan2(r21, r11)")], constants=K), "walls"
    )
    return system


def speed(run: object, name: str = "shuttle") -> np.ndarray:
    return np.asarray(run[name].velocity.values[:, 0])  # type: ignore[index]


SHUTTLES = {
    "force": by_force, "spring": by_spring, "custom force": by_custom_force, "field": by_field, "motor": by_motor,
    "torque": by_torque,
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("step", [None, 0.03], ids=["adaptive", "fixed"])
@pytest.mark.parametrize("name", SHUTTLES)
def test_a_shuttle_between_two_walls_keeps_its_speed(name: str, step: float | None) -> None:
    """1 m/s (rad/s) for 20 s: the impact takes 1/0.016 of a fixed step. Nothing is filtered at radius 1."""
    fixed = {"step": step, "spectral_radius": 1.0} if step else {}
    run = SHUTTLES[name]().simulate(until=20.0, every=0.05, method=METHOD, **fixed)  # type: ignore[arg-type]
    rate = 0.5 * run["shuttle"].angular_momentum.values[:, 2] if name == "torque" else speed(run)
    assert np.abs(rate).max() < 1.0 + 1e-6
    assert np.abs(rate[-1]) == pytest.approx(1.0, abs=0.02)
    assert np.abs(run.energy_defect.values).max() < (1e-6 if step else 0.02)


@pytest.mark.parametrize("step", [0.1, 0.037])
def test_a_force_that_jumps_does_its_work(step: float) -> None:
    """A relay of 3 N towards the middle: 3 abs(x) + x'^2 is kept, whatever part of a step lies on either side."""
    system = System()
    system.add(parts.Point(mass=2.0, position=(0.4, 0.0, 0.0)), "ball")
    system.add(parts.Load(at="ball", law=["where(x > 0, -3, 3)", "0", "0"]), "relay")
    run = system.simulate(until=5.0, every=step, method=METHOD, step=step, spectral_radius=1.0)
    x, v = run["ball"].position.values[:, 0], run["ball"].velocity.values[:, 0]
    np.testing.assert_allclose(3.0 * np.abs(x) + v * v, 1.2, atol=1e-8)
    assert np.abs(run.energy_defect.values).max() < 1e-8


@pytest.mark.parametrize("path", ["point", "motor"])
def test_a_force_that_switches_on_within_a_step_gives_its_impulse(path: str) -> None:
    """4 N from 0.33 s on, by a law in whose text no corner of time can be found."""
    law, system = "where(sin(t) > sin(0.33), 4, 0)", System()
    if path == "point":
        system.add(parts.Point(mass=2.0, position=(0.0, 0.0, 0.0)), "shuttle")
        system.add(parts.Load(at="shuttle", law=[law, "0", "0"]), "push")
    else:
        system.add(parts.RigidBody(mass=2.0, inertia=0.01), "shuttle")
        system.add(parts.Joint(a="ground", b="shuttle", type="prismatic", axis=(1, 0, 0), position=(0, 0, 0)), "rail")
        system.add(parts.Motor(joint="rail", law=law), "push")
    run = system.simulate(until=1.0, every=0.25, method=METHOD, step=0.25, spectral_radius=1.0)
    np.testing.assert_allclose(speed(run), 2.0 * np.maximum(run.time.values - 0.33, 0.0), atol=1e-9)


def test_a_wall_that_a_step_would_jump_over_is_found() -> None:
    """A thin wall between the places at which a step of 0.9 m looks: the step is divided until it is seen."""
    law = "where(x > 0.95, where(x < 1.05, -2000*(x - 0.95), -0.0), 0)"
    system = point()
    system.add(parts.Load(at="shuttle", law=[law, "0", "0"]), "wall")
    run = system.simulate(until=1.8, every=0.9, method=METHOD, step=0.9, spectral_radius=1.0)
    assert run.ev.statistics["divided_steps"] > 0
    assert speed(run)[-1] == pytest.approx(-1.0, abs=1e-6)
    assert np.abs(run.energy_defect.values).max() < 1e-6


def test_a_mass_that_falls_on_a_law_rises_to_its_height() -> None:
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(parts.Point(mass=1.0, position=(0.0, 0.0, 1.0)), "mass")
    system.add(parts.Load(at="mass", law=["0", "0", "where(z < 0, -1e5*z, 0)"]), "soil")
    run = system.simulate(until=3.0, every=0.005, method=METHOD)
    z = run["mass"].position.values[:, 2]
    late = z[run.time.values > 0.6]
    assert late.max() == pytest.approx(1.0, abs=0.01)
    assert z.max() < 1.0 + 1e-6


@pytest.mark.slow
def test_a_rod_that_falls_on_soil_of_a_line_load_does_not_rise_above_its_height() -> None:
    run_system = System(gravity=(0.0, 0.0, -9.81))
    section = {"tube": {"radius": "10 mm", "thickness": "1 mm"}}
    run_system.add(parts.Rod(length=0.5, section=section, material="aluminium", elements=4, position=(0, 0, 1)), "rod")
    run_system.add(parts.Load(along="rod", law=["0", "0", "where(z < 0, -1e4*z, 0)"]), "soil")
    run = run_system.simulate(until=2.0, every=0.01, method=METHOD)
    assert run["rod"].tip_position.values[:, 2].max() < 1.0 + 1e-6


def test_a_motor_law_that_jumps_keeps_energy() -> None:
    """3 N towards 0.05 m from beyond it; a law in Python."""
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=0.01, position=(0.4, 0.0, 0.0)), "shuttle")
    joint = parts.Joint(a="ground", b="shuttle", type="prismatic", axis=(1, 0, 0), position=(0.4, 0, 0))
    system.add(joint, "rail")
    system.add(parts.Motor(joint="rail", law=jumps, parameters=(3.0,)), "push")
    run = system.simulate(until=3.0, every=0.1, method=METHOD, step=0.1, spectral_radius=1.0)
    assert np.abs(run.energy_defect.values).max() < 1e-8


@pytest.mark.parametrize("make", [by_force, by_spring, by_custom_force, by_field, by_motor], ids=lambda f: f.__name__)
@pytest.mark.parametrize("moved", [0.2, 0.46, 0.6])
def test_the_tangent_is_that_of_the_residual(make: object, moved: float) -> None:
    """Of increments from 0 over the wall at 0.5, or up to it; by differences. That of turns is inexact."""
    of = plan(make().assemble(), samples=[0.0, 1.0], step=0.5, spectral_radius=1.0)  # type: ignore[operator]
    model, work, matrix = of.assembly.model, of.workspace().step, of.matrix
    work.step.t, work.step.h, work.step.ratio = 0.0, 0.5, 0.0
    measure(0, model, work)
    n = int(model.info.nv)
    start = np.zeros(n)
    start[0] = moved

    def at(d: np.ndarray) -> np.ndarray:
        work.dq[:] = start + d
        residual(model, work)
        return 2.0 * np.array(work.r[:n])

    e = 1e-6 * np.eye(n)
    wanted = np.column_stack([(at(d) - at(-d)) / 2e-6 for d in e])
    at(np.zeros(n))
    model.info.compliance = 1.0
    tangent(1.0, model, work, matrix)
    found = sparse_of(matrix).toarray()[:n, :n]
    assert found[0, 0] == pytest.approx(wanted[0, 0], rel=1e-4)
