"""Modes far slower than the round-off of stiff directions: zeros counted by shape, answers that keep with `count`."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose
from scipy import sparse

import evolvent
from evolvent import InputError, System, parts
from evolvent.algebra.eigenproblem import Eigenproblem
from evolvent.elements import Circle


def wire(kind: type, *, elements: int, radius: float, length: float, rate: float) -> System:
    """A wire on a spherical joint of a hub that turns, a mass at its tip: its twist has no stiffness."""
    system = System()
    system.add(parts.RigidBody(motion="driven", axis=(0.0, 0.0, 1.0), rate=rate), "hub")
    wire = kind(
        length=length, position=(0.5, 0.0, 0.0), section=Circle(radius=radius), material="steel", elements=elements,
        angular_velocity=(0.0, 0.0, rate), velocity=(0.0, 0.5 * rate, 0.0),
    )  # fmt: skip
    system.add(wire, "wire")
    system.add(parts.Joint(a="hub", b="wire.root", type="spherical"), "joint")
    system.add(parts.Point(mass=2.0, at="wire.tip"), "tip")
    return system


@pytest.mark.slow
@pytest.mark.parametrize("kind", [parts.Beam, parts.Rod])
def test_modes_of_a_turning_wire_are_those_of_every_count(kind):
    """One zero, the pendulum's frequencies W sqrt(R S/I) and W sqrt(1 + R S/I), and the same modes for every count."""
    rate, length, radius, root = 0.1, 20.0, 0.01, 0.5
    system = wire(kind, elements=20, radius=radius, length=length, rate=rate)
    every = system.modes(count=60, rotating="hub").frequency
    mass = 7850.0 * math.pi * radius**2
    S, moment = mass * length**2 / 2 + 2.0 * length, mass * length**3 / 3 + 2.0 * length**2
    ratio = root * S / moment
    assert every[0] < 1e-6
    assert_allclose(every[1:3], [rate * math.sqrt(ratio), rate * math.sqrt(1.0 + ratio)], rtol=2e-3)
    for count in (1, 2, 3, 6, 20):
        found = system.modes(count=count, rotating="hub").frequency
        assert_allclose(found[1:], every[1:count], rtol=1e-5)
        assert found[0] < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("kind", [parts.Beam, parts.Rod])
@pytest.mark.parametrize("spring", ["about the axis", "across a body", "by a motor"])
def test_twist_on_a_weak_spring_is_right_or_refused(kind, spring):
    """sqrt(k/J) of the polar moment of inertia; a spring that is below the round-off of bending is named."""
    refused, arm = [], 0.05
    for rate in (3.0, 0.05, 5e-4):
        system = wire(kind, elements=10, radius=0.01, length=10.0, rate=0.1)
        inertia = 7850.0 * math.pi * 0.01**4 / 2 * 10.0
        if spring == "across a body":
            turn = {"position": (10.5, 0.0, 0.0), "angular_velocity": (0.0, 0.0, 0.1), "velocity": (0.0, 1.05, 0.0)}
            system.add(parts.RigidBody(mass=0.1, inertia=(1e-3, 1e-3, 1e-3), **turn), "body")
            system.add(parts.Joint(a=("body", (0.0, 0.0, 0.0)), b="wire.tip", type="clamp"))
            inertia += 1e-3
            for side in (1.0, -1.0):
                pull = parts.Spring(
                    a=("hub", (10.5, side * arm, side)), b=("body", (0.0, side * arm, 0.0)), length=1.0,
                    stiffness=0.5 * inertia * rate**2 / arm**2,
                )  # fmt: skip
                system.add(pull)
        else:
            k, zero = inertia * rate**2, {"zero": (0.0, 1.0, 0.0)} if kind is parts.Beam else {}
            own = k if spring == "about the axis" else 0.0
            hinge = parts.JointSpring(a="hub", b="wire.root", axis=(1.0, 0.0, 0.0), stiffness=own, **zero)
            system.add(hinge, "spring")
            if spring == "by a motor":
                hold = {"constant": {"rate": 0.0, "angle": 0.0}}
                system.add(parts.Motor(joint="spring", motion=hold, position_gain=k))
        try:
            found = system.modes(count=8, rotating="hub").frequency
        except InputError as error:
            refused.append((rate, str(error)))
        else:
            assert np.min(np.abs(found / rate - 1.0)) < 2e-3
    assert refused
    assert all(rate < 0.5 and "'spring" in text and "is lost in round-off" in text for rate, text in refused)


def chain(squares: np.ndarray, gyroscopic: float) -> Eigenproblem:
    """Uncoupled oscillators, turned into one another at random, with a gyroscopic coupling of the two slowest."""
    n = squares.size
    Q = np.linalg.qr(np.random.default_rng(7).standard_normal((n, n)))[0]
    C = np.zeros((n, n))
    C[0, 1], C[1, 0] = -gyroscopic, gyroscopic
    M, C, K = np.eye(n), Q @ C @ Q.T, (Q * squares) @ Q.T
    none = sparse.csr_matrix((0, n))
    return Eigenproblem(*map(sparse.csr_matrix, (M, C, 0.5 * (K + K.T))), none, np.ones(n), conservative=True)


@pytest.mark.parametrize("gyroscopic", [0.0, 0.3])
@pytest.mark.parametrize("n", [20, 400])
def test_slow_modes_beside_fast_ones(n, gyroscopic):
    """Squares from 1 to 1e8: what the shift of many modes leaves of the slowest ones is corrected."""
    squares = np.geomspace(1.0, 1e8, n)
    problem = chain(squares, gyroscopic)
    a, b = squares[:2]
    sums = a + b + gyroscopic**2
    low = np.sqrt(0.5 * (sums + np.array([-1.0, 1.0]) * math.sqrt(sums**2 - 4.0 * a * b)))
    wanted = np.sort(np.concatenate([low, np.sqrt(squares[2:])]))
    for count in (1, 5, 15):
        pole, _ = problem.solve(count)
        assert_allclose(np.abs(pole), wanted[:count], rtol=1e-5)


def test_a_motion_without_stiffness_that_strains_a_part_is_refused():
    n = 6
    K = sparse.diags([0.0, *np.geomspace(1.0, 1e3, n - 1)]).tocsr()
    none = sparse.csr_matrix((0, n))
    for C in (sparse.csr_matrix((n, n)), 1e-3 * sparse.eye(n, format="csr")):
        problem = Eigenproblem(
            sparse.eye(n, format="csr"), C, K, none, np.ones(n), conservative=True,
            strains=lambda V, noise, lost: "boom" if np.any(np.abs(V[0]) > 0.5) else "",
        )  # fmt: skip
        with pytest.raises(InputError, match="'boom' is lost in round-off"):
            problem.solve(2)


def test_links_that_may_spin_about_themselves_have_zeros_beside_a_motion_that_grows():
    """Andrews' mechanism: its links between two spherical joints spin freely, and its equilibrium is unstable."""
    found = evolvent.load("andrews-mechanism").modes(count=4)
    M, G = found.M.toarray(), found.G.toarray()
    Z = scipy.linalg.null_space(G)
    assert Z.shape[1] == 4
    assert_allclose(found.pole[:3], 0.0, atol=0.0)
    u = found.shape[3].real
    assert found.pole[3].real > 0.0
    spins = Z - np.outer(u, u @ M @ Z) / (u @ M @ u)  # what is left of all motions spins 3 links alone
    moved = np.linalg.norm(spins.reshape(-1, 6, Z.shape[1])[:, :3], axis=(1, 2))
    assert np.all(moved < 1e-6 * np.linalg.norm(spins))
