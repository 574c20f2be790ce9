"""Guides and lateral stiffness of springs in the general engine."""

import numpy as np
import pytest

from evolvent import InputError, parts
from evolvent.analysis.system import System
from evolvent.solvers import solve

INERTIA = (0.3, 0.5, 0.4)


def test_a_guided_body_falls_along_what_is_left():
    """Held along x and z it falls freely along y, whatever its spin."""
    system = System(gravity=(1.0, -9.81, 2.0))
    system.add(parts.RigidBody(mass=2.0, inertia=INERTIA, angular_velocity=(1.0, 2.0, -0.5)), name="body")
    system.add(parts.Joint(a="ground", b="body", type="guide", axis=(1.0, 0.0, 0.0)))
    system.add(parts.Joint(a="ground", b="body", type="guide", axis=(0.0, 0.0, 1.0)))
    solution = solve(system.assemble(), samples=np.linspace(0.0, 1.0, 5), method="dopri5", rtol=1e-10, atol=1e-12)
    assert solution.success
    assert solution.y[:, [0, 2]] == pytest.approx(0.0, abs=1e-14)
    assert solution.y[:, 1] == pytest.approx(-0.5 * 9.81 * solution.t**2, abs=1e-10)


def test_an_axis_held_across_leaves_a_free_turn_about_the_others():
    """With e_x held across z, the body is a pendulum of two angles: its energy is kept and e_x stays in the plane."""
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=INERTIA, angular_velocity=(1.5, 0.0, 0.7)), name="body")
    system.add(parts.Joint(a="ground", b="body", type="guide", axis=(0.0, 0.0, 1.0), axis_b=(1.0, 0.0, 0.0)))
    solution = solve(system.assemble(), samples=np.linspace(0.0, 20.0, 41), method="dopri5", rtol=1e-10, atol=1e-12)
    assert solution.success
    q = solution.y[:, 3:7]
    assert 2.0 * (q[:, 1] * q[:, 3] - q[:, 0] * q[:, 2]) == pytest.approx(0.0, abs=1e-10)
    assert solution.statistics["energy_defect"] < 1e-8
    w = solution.y[:, 10:13]
    assert 0.5 * np.sum(np.array(INERTIA) * w * w, axis=1) == pytest.approx(
        0.5 * (0.3 * 1.5**2 + 0.4 * 0.7**2), rel=1e-8
    )


def test_lateral_stiffness_alone_swings_a_body_at_its_frequency():
    """sqrt(k_l / m) across a spring without axial stiffness."""
    system = System()
    system.add(
        parts.RigidBody(mass=2.0, inertia=INERTIA, position=(0.0, -1.0, 0.0), velocity=(0.1, 0.0, 0.0)), name="body"
    )
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="body", lateral_stiffness=8.0, axis=(0.0, 1.0, 0.0)))
    solution = solve(system.assemble(), samples=np.linspace(0.0, 3.0, 31), method="dopri5", rtol=1e-10, atol=1e-12)
    assert solution.y[:, 0] == pytest.approx(0.05 * np.sin(2.0 * solution.t), abs=1e-9)
    assert solution.statistics["energy_defect"] < 1e-8


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (lambda: parts.Joint(a="ground", b="fixed", type="guide", axis=(1.0, 0.0, 0.0)), ["only a free body"]),
        (lambda: parts.Joint(a="ground", b="body", type="guide", axis=(0.0, 0.0, 0.0)), ["not all zero"]),
        (
            lambda: parts.Joint(a="ground", b="body", type="guide", axis=(1.0, 0.0, 0.0), axis_b=(1.0, 0.0, 0.0)),
            ["perpendicular"],
        ),
        (lambda: parts.Joint(a="ground", b="body", type="guide", axis=(0.0, 1.0, 0.0)), ["moves against it"]),
        (lambda: parts.Spring(a="body", b=(0.0, 1.0, 0.0), lateral_stiffness=1.0), ["on the ground"]),
    ],
)
def test_bad_parts_are_refused(part, words):
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=INERTIA, velocity=(0.0, 1.0, 0.0)), name="body")
    system.add(parts.RigidBody(motion="driven"), name="fixed")

    def build():
        system.add(part(), name="held")
        system.assemble()

    with pytest.raises(InputError) as error:
        build()
    for word in words:
        assert word in str(error.value)


def test_a_guide_given_twice_is_redundant():
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=INERTIA), name="body")
    for name in ("first", "second"):
        system.add(parts.Joint(a="ground", b="body", type="guide", axis=(1.0, 0.0, 0.0)), name=name)
    with pytest.raises(InputError, match="redundant"):
        system.assemble()
