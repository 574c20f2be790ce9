"""SciPy: the equations of the line and of the body as a user writes them in NumPy, under solve_ivp."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy
from scipy.integrate import solve_ivp


def version() -> str:
    return scipy.__version__


def line(spec: dict[str, Any]) -> tuple[Callable, np.ndarray, Callable]:
    """Rates, first state and the bob's place of a state."""
    nodes = np.array(spec["nodes"])
    n = spec["segments"]
    h = spec["length"] / n
    k, c = spec["EA"] / h, spec["BA"] / h
    mass = np.full(n + 1, spec["density"] * h)
    mass[-1] = 0.5 * mass[-1] + spec["bob"]

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        x, v = y.reshape(2, n + 1, 3)
        d, dv = x[1:] - x[:-1], v[1:] - v[:-1]
        long = np.sqrt(np.einsum("ij,ij->i", d, d))
        t = d / long[:, None]
        pull = (k * (long - h) + c * np.einsum("ij,ij->i", t, dv))[:, None] * t
        a = np.zeros_like(x)
        a[:-1] += pull
        a[1:] -= pull
        a /= mass[:, None]
        a[:, 2] -= spec["gravity"]
        a[0] = 0.0
        return np.concatenate([v.ravel(), a.ravel()])

    return rates, np.concatenate([nodes.ravel(), 0.0 * nodes.ravel()]), lambda y: y[3 * n : 3 * n + 3]


def rotation(q: np.ndarray) -> np.ndarray:
    """Rotation matrix of a quaternion, scalar part first."""
    w, x, y, z = q / np.sqrt(q @ q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def body(spec: dict[str, Any]) -> tuple[Callable, np.ndarray, Callable]:
    """Rates, first state (place, quaternion, velocity, angular velocity in body axes), a corner's place of a state."""
    corners, inertia = np.array(spec["corners"]), np.array(spec["inertia"])
    ground = corners + np.array([0.0, 0.0, spec["height"]])
    weight = np.array([0.0, 0.0, -spec["mass"] * spec["gravity"]])

    def rates(_: float, s: np.ndarray) -> np.ndarray:
        x, q, v, w = s[:3], s[3:7], s[7:10], s[10:]
        R = rotation(q)
        arms = corners @ R.T
        d = ground - x - arms
        long = np.sqrt(np.einsum("ij,ij->i", d, d))
        pulls = (spec["stiffness"] * (long - spec["natural"]) / long)[:, None] * d
        torque = R.T @ np.cross(arms, pulls).sum(axis=0)
        dq = 0.5 * np.array(
            [
                -q[1] * w[0] - q[2] * w[1] - q[3] * w[2],
                q[0] * w[0] + q[2] * w[2] - q[3] * w[1],
                q[0] * w[1] + q[3] * w[0] - q[1] * w[2],
                q[0] * w[2] + q[1] * w[1] - q[2] * w[0],
            ]
        )
        dw = (torque - np.cross(w, inertia * w)) / inertia
        return np.concatenate([v, dq, (pulls.sum(axis=0) + weight) / spec["mass"], dw])

    start = np.concatenate([np.zeros(3), [1.0, 0.0, 0.0, 0.0], np.zeros(3), spec["spin"]])
    return rates, start, lambda s: s[:3] + rotation(s[3:7]) @ corners[0]


def centre(spec: dict[str, Any]) -> tuple[Callable, np.ndarray, Callable]:
    """The body, with the place of its centre."""
    rates, start, _ = body(spec)
    return rates, start, lambda s: s[:3]


EQUATIONS = {"line": line, "body": body, "centre": centre}


def tight(work: str, spec: dict[str, Any], rtol: float) -> np.ndarray:
    """Places at the samples but the first, under DOP853."""
    rates, start, place = EQUATIONS[work](spec)
    times = spec["samples"]
    found = solve_ivp(rates, (0.0, times[-1]), start, "DOP853", times[1:], rtol=rtol, atol=1e-2 * rtol)
    return np.array([place(y) for y in found.y.T])


def prepare(work: str, spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    """RK45 that is held at the step: first and largest step are it, and the tolerance refuses none."""
    rates, start, place = EQUATIONS[work](spec)
    times = spec["samples"]

    def run() -> dict[str, Any]:
        y, steps, places = start, 0, []
        for a, b in itertools.pairwise(times):
            end = b - 1e-9 * step  # lest round-off adds a step
            found = solve_ivp(rates, (a, end), y, "RK45", rtol=1e6, atol=1e6, first_step=step, max_step=step)
            if not found.success:
                return {"places": places, "steps": steps, "stopped": found.message}
            y, steps = found.y[:, -1], steps + found.t.size - 1
            places.append(place(y).tolist())
        return {"places": places, "steps": steps}

    return run
