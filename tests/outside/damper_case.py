"""The case of the rotary damper in the table of families: two wheels on springs with a damper between them."""

from __future__ import annotations

from typing import Any

import numpy as np
from rotary_damper import RotaryDamper

from evolvent import System, parts
from families.case import Array, Case, columns, coordinates, of

INERTIA, STIFFNESS, REST, DAMPING = np.array([0.4, 0.7]), 3.0, 0.5, 0.2


def wheels(**given: Any) -> System:
    """Two wheels, each on a spring, with a damper between them."""
    found = System()
    for n in (0, 1):
        found.add(parts.RigidBody(motion="spin", inertia=INERTIA[n], position=(float(n), 0.0, 0.0)), f"wheel {n}")
        spring: dict[str, Any] = {"stiffness": STIFFNESS * (n + 1), "rest": REST * (1 - n)}
        found.add(parts.JointSpring(a="ground", b=f"wheel {n}", **spring), f"hinge {n}")
    found.add(RotaryDamper(a="wheel 0", b="wheel 1", **{"damping": DAMPING} | given), "damper")
    return found


@of("a rotary damper")
def case() -> Case:
    """The wheels, by the eigenvectors of the linear equations."""
    K, C = np.diag([STIFFNESS, 2.0 * STIFFNESS]), DAMPING * np.array([[1.0, -1.0], [-1.0, 1.0]])
    M = np.diag(1.0 / INERTIA)
    poles, shapes = np.linalg.eig(np.block([[np.zeros((2, 2)), np.eye(2)], [-M @ K, -M @ C]]))
    still = np.array([REST, 0.0])
    shares = np.linalg.solve(shapes, np.concatenate([-still, [0.0, 0.0]]))

    def motion(t: Array) -> Array:
        return np.asarray(still + np.real(np.exp(np.outer(t, poles)) * shares @ shapes.T)[:, :2])

    def seen(assembly: Any, y: Array) -> Array:
        return columns(*(coordinates(assembly, y, f"wheel {n}")[..., 0] for n in (0, 1)))

    return Case(
        part="damper", system=wheels, seen=seen, motion=motion, end=3.0, step=2e-3, still=still,
        poles=poles[poles.imag > 0.0],
        damped=True,
    )  # fmt: skip
