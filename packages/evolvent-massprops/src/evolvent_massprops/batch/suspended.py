"""Rigid bodies on ground springs, integrated in compiled batches with fixed steps.

The cases of a block share their number of steps between samples; everything else is a case's own.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy

from evolvent.compiled import codecache
from evolvent_massprops.batch import rates
from evolvent_massprops.batch.loop import advance_block
from evolvent_massprops.batch.rates import DISSIPATED, N_SPRING, N_STATE, WIDTH


class Suspended(NamedTuple):
    """A rigid body on ground springs, with its state at the start.

    Attributes
    ----------
    mass : float, kg
    inertia : (3, 3) float, kg m2, about the centre of mass, body axes
    gravity : (3,) float, m/s2
    guided : bool, the x and z of the centre of mass and the yaw are held
    attachment : (n, 3) float, m, from the centre of mass, body axes
    ground, axis : (n, 3) float, m and 1: ground end, and unit axis of the mount
    stiffness, damping, length, lateral_stiffness, lateral_damping : (n,) float, N/m, N s/m, m
    state : (13,) float: position, quaternion, velocity, angular velocity, inertial frame
    """

    mass: float
    inertia: np.ndarray
    gravity: np.ndarray
    guided: bool
    attachment: np.ndarray
    ground: np.ndarray
    axis: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    length: np.ndarray
    lateral_stiffness: np.ndarray
    lateral_damping: np.ndarray
    state: np.ndarray


class Scheme(NamedTuple):
    """A fixed-step method.

    Attributes
    ----------
    order : int
    evaluations : int, of the right-hand side in a step
    A, b : (s, s), (s,) float, Runge-Kutta coefficients; empty for the modified Euler of the stand
    """

    order: int
    evaluations: int
    A: np.ndarray
    b: np.ndarray


METHODS = ("modified-euler", "rk4", "dop853")
#: Under which the compiled loop is remembered.
NAME = "batch"


@functools.cache
def scheme(method: str) -> Scheme:
    """Coefficients of a method of `METHODS`."""
    if method == "modified-euler":
        return Scheme(2, 2, np.zeros((0, 0)), np.zeros(0))
    if method == "rk4":
        A = np.diag([0.5, 0.5, 1.0], -1)
        return Scheme(4, 4, A, np.array([1.0, 2.0, 2.0, 1.0]) / 6.0)
    return Scheme(
        8, 12, np.ascontiguousarray(scipy.integrate.DOP853.A[:12, :12]), np.ascontiguousarray(scipy.integrate.DOP853.B)
    )


@functools.cache
def amplification(method: str) -> Callable[[float], tuple[float, float]]:
    """Modulus of a step's eigenvalue and relative error of the frequency of an oscillator, by theta = omega h."""
    kind = scheme(method)

    def step(theta: float) -> tuple[float, float]:
        if kind.b.size == 0:
            half = 1.0 - theta**2 / 8.0
            S = np.array(
                [[1.0 - theta**2 / 2.0 * half, theta * (1.0 - theta**2 / 4.0)], [-theta * half, 1.0 - theta**2 / 2.0]]
            )
            values = np.linalg.eigvals(S)
            z = complex(values[np.argmax(np.abs(values))])
            phase = abs(math.atan2(z.imag, z.real))
        else:
            stages = np.linalg.solve(np.eye(kind.b.size) - 1j * theta * kind.A, np.ones(kind.b.size))
            z = 1.0 + 1j * theta * complex(kind.b @ stages)
            phase = math.atan2(z.imag, z.real)
        return abs(z), phase / theta - 1.0

    return step


@functools.cache
def stability_limit(method: str) -> float:
    """Largest theta = omega h at which a step does not amplify an undamped oscillation by more than rounding."""
    modulus = amplification(method)
    theta = 0.05
    while modulus(theta + 0.01)[0] <= 1.0 + 1e-9:
        theta += 0.01
    return theta


@functools.cache
def accurate_step(method: str, accuracy: float) -> float:
    """Largest theta = omega h at which the relative error of the frequency stays within `accuracy`."""
    step = amplification(method)
    limit = 0.5 * stability_limit(method)
    thetas = np.geomspace(1e-5, limit, 600)
    good = [theta for theta in thetas if abs(step(float(theta))[1]) <= accuracy]
    return float(good[-1]) if good else 1e-5


# ------------------------------------------------------------------------------------------------ batches


def warm_up() -> None:
    """Compile the loop, or load it."""
    one = np.ones(1)
    still = Suspended(
        mass=1.0, inertia=np.eye(3), gravity=np.zeros(3), guided=False, attachment=np.zeros((1, 3)),
        ground=np.array([[0.0, 1.0, 0.0]]), axis=np.array([[0.0, 1.0, 0.0]]), stiffness=one, damping=one, length=one,
        lateral_stiffness=one, lateral_damping=one, state=np.eye(13)[3],
    )  # fmt: skip
    integrate([still], every=1.0, samples=2, steps=1, method="rk4")
    codecache.mark_warm(NAME)


def integrate(
    cases: Sequence[Suspended],
    *,
    every: float,
    samples: int,
    steps: int,
    method: str = "dop853",
    progress: Callable[[float], None] | None = None,
) -> np.ndarray:
    """States of many bodies at evenly spaced times.

    Parameters
    ----------
    cases : sequence of Suspended, all with the same number of springs
    every : float, s, between samples
    samples : int, the start among them
    steps : int, of the method between two samples
    method : one of `METHODS`
    progress : called with the time reached (s, of all blocks together), a few times a second at most

    Returns
    -------
    (n, samples, 14) float
        Position, quaternion, velocity, angular velocity (inertial frame) and dissipated energy; not a number from where
        a state was not finite any more.
    """
    kind = scheme(method)
    n_springs = len(cases[0].stiffness)
    states = np.empty((len(cases), samples, N_STATE))
    K = np.empty((max(kind.b.size + 1, 2), N_STATE, WIDTH))
    blocks = range(0, len(cases), WIDTH)
    at_once = max(1, min(samples - 1, int(2e5 / (steps * kind.evaluations))))
    for number, first in enumerate(blocks):
        part = cases[first : first + WIDTH]
        bodies, springs = _pack(part, n_springs)
        out = np.empty((samples, N_STATE, WIDTH))
        out[0] = bodies["y"][0]
        for begin in range(1, samples, at_once):
            end = min(begin + at_once, samples)
            advance_block(bodies, springs, kind.A, kind.b, every / steps, steps, K, out[begin:end])
            if progress is not None:
                progress((number * samples + end - 1) / len(blocks) * every)
        states[first : first + len(part)] = np.moveaxis(out[:, :, : len(part)], 2, 0)
    return states


def _pack(cases: Sequence[Suspended], n_springs: int) -> tuple[Any, np.ndarray]:
    """One block; columns without a case repeat the first."""
    bodies = np.zeros(1, dtype=rates.BODIES)
    springs = np.zeros((n_springs, N_SPRING, WIDTH))
    block = bodies[0]
    for c in range(WIDTH):
        case = cases[c] if c < len(cases) else cases[0]
        block["y"][:DISSIPATED, c] = case.state
        block["compliance"][0, c] = 1.0 / case.mass
        block["gravity"][:, c] = case.gravity
        block["guided"][0, c] = float(case.guided)
        for name, tensor in (("inertia", case.inertia), ("inverse", np.linalg.inv(case.inertia))):
            T = np.asarray(tensor)
            block[name][:, c] = T[0, 0], T[1, 1], T[2, 2], T[0, 1], T[0, 2], T[1, 2]
        springs[:, rates.ATTACHMENT : rates.ATTACHMENT + 3, c] = case.attachment
        springs[:, rates.GROUND : rates.GROUND + 3, c] = case.ground
        springs[:, rates.AXIS : rates.AXIS + 3, c] = case.axis
        springs[:, rates.STIFFNESS, c] = case.stiffness
        springs[:, rates.DAMPING, c] = case.damping
        springs[:, rates.LENGTH, c] = case.length
        springs[:, rates.LATERAL, c] = case.lateral_stiffness
        springs[:, rates.LATERAL_DAMPING, c] = case.lateral_damping
    return bodies, springs
