"""A free rigid body over a thousand seconds under the adaptive method."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evolvent import parts
from evolvent.analysis.system import System
from evolvent.solvers import solve


@pytest.mark.parametrize("rate", [(0.01, 1.0, 0.01), (0.7, -0.4, 0.5)])
def test_energy_and_momentum_to_1e10_over_1000_s(rate, book):
    J = np.array([1.0, 2.0, 3.0])
    system = System()
    system.add(
        parts.RigidBody(mass=1.0, inertia=tuple(J), angular_velocity=rate, velocity=(0.1, 0.2, 0.3)), name="body"
    )
    samples = np.linspace(0.0, 1000.0, 501)
    solution = solve(system.assemble(), samples=samples, method="dopri5", rtol=1e-11, atol=1e-13)
    w = solution.y[:, 10:13]
    energy = 0.5 * np.sum(J * w * w, axis=1)
    R = Rotation.from_quat(solution.y[:, [4, 5, 6, 3]]).as_matrix()
    momentum = np.einsum("tij,tj->ti", R, J * w)
    assert solution.success
    assert energy == pytest.approx(energy[0], rel=1e-10)
    assert np.abs(momentum - momentum[0]).max() < 1e-10 * np.linalg.norm(momentum[0])
    assert solution.y[:, :3] == pytest.approx(np.outer(samples, (0.1, 0.2, 0.3)), abs=1e-9)
    book(
        "Rigid bodies", f"Free body for 1000 s, energy, from rates {rate}", reference="constant", source="invariant",
        error=np.abs(energy / energy[0] - 1.0).max(), allowed=1e-10,
    )  # fmt: skip
    book(
        "Rigid bodies", f"Free body for 1000 s, angular momentum, from rates {rate}", reference="constant",
        source="invariant", error=np.abs(momentum - momentum[0]).max() / np.linalg.norm(momentum[0]), allowed=1e-10,
    )  # fmt: skip
