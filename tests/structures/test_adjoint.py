"""The adjoint of runs is held by closed forms and by central differences of whole runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from evolvent import System, elements, parts
from evolvent.analysis import runs
from evolvent.analysis.gradient import CHANGE
from evolvent.analysis.settings import sample_times
from evolvent.equations.implicit import residual, tangent
from evolvent.model.powers import N_POWERS
from evolvent.solvers.common.matrices import matrix_for
from evolvent.solvers.sensitivity import adjoint as adjoint_module
from evolvent.solvers.sensitivity.adjoint import Adjoint
from evolvent.solvers.sensitivity.adjoint_support import are_smooth
from evolvent.solvers.sensitivity.colours import coloured, equations_of
from evolvent.solvers.sensitivity.patches import Sides
from evolvent.solvers.sensitivity.transposed import columns_of
from evolvent.solvers.sensitivity.windows import (
    LONGEST,
    NEXT,
    NODES,
    ROW_TOLERANCE,
    choose_nodes,
    lagrange_weights,
    window_error,
    windows_of,
)
from evolvent_base.errors import InputError
from structures.test_sensitivity import ALPHA, BOTH, ENERGY, differences, hinge, masses_in_a_row


def driven_wheel() -> System:
    """A motor follows an angle that grows, and turns a wheel against a spring."""
    found = System()
    found.add(parts.RigidBody(motion="spin", inertia=0.4), "wheel")
    found.add(parts.JointSpring(a="ground", b="wheel", stiffness=1.5), "hinge")
    drive = parts.ConstantDrive(rate=0.7, angle=0.6)
    found.add(parts.Motor(joint="hinge", motion=drive, position_gain=5.0, velocity_gain=0.3), "motor")
    return found


@pytest.mark.slow
@BOTH
def test_those_of_a_motor_that_is_driven_are_its_closed_form(method: str) -> None:
    """J x'' + c x' + (k + p) x = p (r + w t) + c w, from rest: derivatives of x by k and J."""
    end, keys = 0.8, {"hinge.stiffness": 1.5, "wheel.inertia": 0.4}

    def angle(k: float, J: float) -> float:
        p, c, r, w = 5.0, 0.3, 0.6, 0.7
        slope = p * w / (k + p)
        a, decay = (p * r + c * (w - slope)) / (k + p), 0.5 * c / J
        swing = math.sqrt((k + p) / J - decay**2)
        sine = -(slope + decay * a) / swing
        return a + slope * end + math.exp(-decay * end) * (sine * math.sin(swing * end) - a * math.cos(swing * end))

    settings: dict[str, Any] = {"until": end, "step": 1e-3, "method": method}
    forward, adjoint = (
        driven_wheel().sensitivity("hinge.angle.last", list(keys), mode=mode, **settings).dataset
        for mode in ("forward", "adjoint")
    )
    np.testing.assert_allclose(adjoint.derivative, forward.derivative, rtol=1e-6)
    for j, (key, at) in enumerate(keys.items()):
        sides = [angle(*[v * (1.0 + d * (name == key)) for name, v in keys.items()]) for d in (1e-4, -1e-4)]
        exact = (sides[0] - sides[1]) / (2e-4 * at)
        assert float(adjoint.derivative[0, j]) == pytest.approx(exact, rel=1e-4), key


def swinging_pair() -> System:
    """Two bodies that turn, one behind the other on spherical joints, pulled by a damped spring."""
    found, of_a, of_b = System(gravity=(0.0, 0.0, -9.81)), np.array([1.2, 5.2, 1.6]), np.array([-2.0, 2.8, 4.4])
    hinge_rate = np.cross(of_a, [1.0, 0.0, 0.0])
    for name, mass, x, turn, rate in (
        ("a", 2.0, 0.5, of_a, 0.5 * hinge_rate),
        ("b", 1.0, 1.5, of_b, hinge_rate + np.cross(of_b, [0.5, 0.0, 0.0])),
    ):
        own: dict[str, Any] = {"velocity": tuple(rate), "angular_velocity": tuple(turn)}
        found.add(parts.RigidBody(mass=mass, inertia=(0.1, 0.2, 0.25), position=(x, 0.0, 0.0), **own), name)
    found.add(parts.Joint(a="ground", b=("a", (-0.5, 0.0, 0.0)), type="spherical"), "root")
    found.add(parts.Joint(a=("a", (0.5, 0.0, 0.0)), b=("b", (-0.5, 0.0, 0.0)), type="spherical"), "middle")
    line: dict[str, Any] = {"stiffness": 40.0, "length": 0.2, "damping": 3.0}
    found.add(parts.Spring(a=(2.0, 0.3, 0.5), b=("b", (0.5, 0.1, 0.0)), **line), "line")
    return found


def test_derivatives_by_the_start_of_generalized_alpha_are_those_of_neighbours_that_start() -> None:
    """Of accelerations, those that the method starts with, and velocities that part from the constraints."""
    system, change = swinging_pair(), 1e-3  # large: accelerations of neighbours have the round-off of short times
    assembly = system._assembled()
    values = {"a.mass": 2.0, "a.inertia.0": 0.1, "line.stiffness": 40.0, "line.damping": 3.0, "gravity.2": -9.81}
    listed = []
    for key, at in values.items():
        sides = [system.with_values({key: at + side * change * abs(at)})._assembled() for side in (1.0, -1.0)]
        listed.append((key, change * abs(at), Sides.of(assembly, (sides[0], sides[1]), key)))
    samples = sample_times(0.01)
    adjoint = Adjoint(lambda: runs.plan(assembly, samples, method=ALPHA, step=2e-3)[0], listed)
    assert adjoint.run()[0] == "success"
    n, rng = adjoint.n_v, np.random.default_rng(1)
    by_start = np.zeros((3, 4 * n + 1))
    for k in range(3):
        by_start[k, (3 - k) * n : (4 - k) * n] = rng.uniform(-1.0, 1.0, n)
    found = adjoint._by_start(by_start, adjoint._linear(3))
    resolves = int(adjoint.start[2].loop.resolves)
    assert resolves == 1
    compared = by_start @ np.array([adjoint._begin_beside(one, resolves) for one in adjoint.parameters]).T
    for own, other, within in zip(found, compared, (1e-6, 1e-5, 1e-3), strict=True):
        np.testing.assert_allclose(own, other, rtol=0.0, atol=within * np.abs(other).max())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "change", "within"),
    [
        ("hinge.latch_time", 2e-3, 1e-6),
        ("hinge.angle.last", 1e-4, 1e-5),  # latches lock within 1e-10 rad, which is 2e-6 of these differences
    ],
)
def test_those_of_the_adjoint_through_a_latch_are_central_differences(name: str, change: float, within: float) -> None:
    """Of energy-momentum, with fixed steps."""
    keys = ["hinge.stiffness", "flap.inertia"]
    settings: dict[str, Any] = {"until": 1.5, "step": 0.01, "method": ENERGY, "spectral_radius": 0.9}
    found = hinge().sensitivity(name, keys, mode="adjoint", **settings).dataset
    for key in keys:
        compared = differences(hinge(), name, key, float(found["at"].sel(key=key)), change=change, **settings)
        assert float(found.derivative.sel(value=name, key=key)) == pytest.approx(compared, rel=within), key


def test_a_law_of_a_motor_is_refused_by_the_adjoint() -> None:
    found = driven_wheel()
    found.add(parts.Motor(joint="hinge", law="0.2 - 0.1*v"), "second")
    with pytest.raises(InputError, match="motors have a law, which the adjoint does not support"):
        found.sensitivity("hinge.angle.last", "wheel.inertia", until=0.1, step=0.01, method=ALPHA, mode="adjoint")


def test_a_key_may_be_changed_to_what_the_first_of_the_variants_has() -> None:
    """A changed system is given by its differences from the first one, of which the derived one is a variant."""
    settings: dict[str, Any] = {"until": 0.1, "step": 0.01, "method": ALPHA, "mode": "adjoint", "check": False}
    keys = ["m0.mass", "s1.stiffness"]
    first = masses_in_a_row(2).with_values({"m0.mass": 1.0 + CHANGE})
    first._assembled()
    variant, alone = first.with_values({"m0.mass": 1.0}), masses_in_a_row(2)
    found, compared = (
        one.sensitivity("m1.position.x.last", keys, **settings).dataset.derivative for one in (variant, alone)
    )
    np.testing.assert_array_equal(found, compared)


def test_colours_of_a_plate_follow_from_its_elements() -> None:
    """Six coordinates of each of the nine nodes around one: no more than the largest set of them with an equation."""
    material = elements.Material(young_modulus=2e7, poisson_ratio=0.3, density=1000.0)
    found = System()
    found.add(parts.Shell(size=(1.0, 1.0), elements=(6, 6), thickness=0.01, material=material), "plate")
    equations = equations_of(found._assembled())
    assert max(len(own) for own in equations) == 54
    groups = coloured(equations, range(len(equations)))
    assert len(groups) == 54
    for own in groups:
        rows = np.concatenate([equations[j] for j in own])
        assert np.unique(rows).size == rows.size


@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_interpolated_matrices_give_the_same_derivatives(damping: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """A smooth motion; windows reach their largest size."""
    system, samples = masses_in_a_row(4), sample_times(0.04)
    system = system.with_values({f"s{k}.damping": damping for k in range(4)})
    assembly, counts = system._assembled(), []
    sides = [system.with_values({"m1.mass": 1.0 + side * 1e-6})._assembled() for side in (1.0, -1.0)]
    found = []
    for smooth in (True, False):
        monkeypatch.setattr(adjoint_module, "are_smooth", lambda _, smooth=smooth: smooth)
        adjoint = Adjoint(
            lambda: runs.plan(assembly, samples, method=ALPHA, step=5e-5)[0],
            [("m1.mass", 1e-6, Sides.of(assembly, (sides[0], sides[1]), "m1.mass"))],
        )
        assert adjoint.run()[0] == "success"
        by_sample = np.zeros((1, samples.size, 2 * adjoint.n_v))
        by_sample[0, -1, 0] = 1.0
        found.append(adjoint.gradients(by_sample, np.zeros((1, 0))))
        counts.append(int(adjoint.windows.counts[NEXT]))
    assert counts[0] == LONGEST, counts
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


@pytest.mark.parametrize(("size", "turn"), [(8, 0.06), (16, 0.03), (64, 0.01)])
def test_the_error_of_a_window_is_that_of_all_its_steps(size: int, turn: float) -> None:
    """Of a row that swings, at any phase: wherever its fifth derivative, or itself, passes zero."""
    one = np.array([0, 1]), np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64)
    windows, steps = windows_of(one, 1, 1, True), np.arange(1001 - size, 1001)
    choose_nodes(1000, size, windows)
    windows.K[:] = 1.0
    ratios = []
    for phase in np.linspace(0.0, np.pi, 73):
        row = np.cos(turn * (1000 - steps) + phase)
        windows.rows[:, 0, 0] = row[windows.steps - steps[0]]
        error, largest = window_error(False, windows), np.abs(windows.rows[:, 0, 0]).max()
        found = []
        for n in steps:
            lagrange_weights(n, windows)
            found.append(windows.weights @ windows.rows[:NODES, 0, 0])
        ratios.append(np.abs(found - row).max() / (ROW_TOLERANCE * largest * error))
    assert max(ratios) < 1.5, max(ratios)


def test_forces_with_kinks_are_evaluated_in_each_step() -> None:
    """Cords, which only pull, and motors."""
    assert are_smooth(masses_in_a_row(2)._assembled().model)
    slack = masses_in_a_row(2)
    slack.add(parts.Spring(a="m0", b="m1", stiffness=10.0, length=2.0, slack=True), "cord")
    assert not are_smooth(slack._assembled().model)
    stopped = driven_wheel()
    assert not are_smooth(stopped._assembled().model)  # of a motor


def test_columns_contain_all_entries_of_a_tangent() -> None:
    """No entry of the tangent outside the columns is nonzero."""
    assembly = swinging_pair()._assembled()
    room = matrix_for(assembly)
    _, _, place = columns_of(equations_of(assembly), room)
    model, y = assembly.model.copy(), assembly.y
    n = int(model.info.nv) + model.constraints.size
    residual(
        0.0,
        y,
        np.ones(int(model.info.nv)),
        np.ones(n - int(model.info.nv)),
        0.0,
        1.0,
        model,
        np.zeros(n),
        np.zeros(N_POWERS),
    )
    tangent(0.0, y, np.ones(n - int(model.info.nv)), 1.0, 1.0, 1.0, model, room)
    outside = np.ones(room.values.size, dtype=bool)
    outside[place] = False
    assert np.any(room.values)
    assert not np.any(room.values[outside])
