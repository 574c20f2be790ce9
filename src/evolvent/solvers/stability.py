"""Highest frequency of an assembled model, and the largest step at which an explicit method is stable on it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from evolvent import model as mdl
from evolvent.builder import Assembly
from evolvent.flow.impulse import prepare
from evolvent.flow.needs import is_flexible, load_preparation
from evolvent.kernels import feed, rigid, springs, thread
from evolvent.solvers.explicit import Method


class Mode(NamedTuple):
    """The fastest mode: bounds of frequency (rad/s) and damping rate (1/s), its place; and the largest rate of all."""

    frequency: float
    damping_rate: float
    where: str
    largest_damping_rate: float


def fastest_mode(assembly: Assembly) -> Mode:
    """A bound of the highest frequency of the springs and threads of a model, all nodes taken as released.

    Beams, contacts and penalties count with what they have (see `evolvent.solvers.flexible`).

    Notes
    -----
    A spring k between a and b holds k (x_a - x_b)^2 <= 2 k (x_a^2 + x_b^2), so that the stiffness matrix is bounded by
    its diagonal blocks, counted twice where both ends move: omega^2 <= max over a of the largest eigenvalue of
    M_a^-1 K_aa. A uniform chain reaches this bound, 4 c / m. Damping is bounded in the same way.
    """
    model, y, s = assembly.model, assembly.y.copy(), assembly.s.copy()
    bodies, points = model.bodies, model.points
    load_preparation(model)
    prepare(0.0, y, s, model)
    body = np.zeros((2, bodies.size, 6, 6))
    point = np.zeros((2, points.size, 3, 3))
    moves = bodies["motion"] != rigid.DRIVEN
    _add_springs(model, y, moves, body, point)
    names = {found: name for name, found in assembly.names.items()}
    best = [(0.0, 0.0, "nothing")]
    for i in range(points.size):
        best.append(_largest(point[:, i] / points["mass"][i], names["points", i]))
    for p in range(model.threads.size):
        best += _thread_modes(model, p, names["threads", p], body)
    for i in (int(k) for k in np.flatnonzero(moves)):
        if bodies["motion"][i] == rigid.SPIN:
            n = bodies["R"][i] @ bodies["axis"][i]
            about = np.array([[[n @ body[a, i, 3:, 3:] @ n]] for a in range(2)])
            best.append(_largest(about / bodies["J"][i], names["bodies", i]))
        else:
            best.append(_largest(np.linalg.solve(bodies["M"][i], body[:, i]), names["bodies", i]))
    largest = 0.0
    if is_flexible(model):
        from evolvent.solvers.flexible import fastest_flexible_mode  # SciPy's sparse matrices take a moment to load

        square, own, place, largest = fastest_flexible_mode(assembly)
        best.append((square, own, place))
    squared, damping, where = max(best, key=lambda bound: (bound[0], -bound[1]))
    return Mode(math.sqrt(squared), damping, where, max(largest, *(bound[1] for bound in best)))


def _add_springs(model: mdl.Model, y: np.ndarray, moves: np.ndarray, body: np.ndarray, point: np.ndarray) -> None:
    """Diagonal blocks of stiffness and damping of all springs, tightened ones stiff across their line as well."""
    markers = model.markers
    for number, spring in enumerate(model.springs):
        ends = [int(spring["a"]), int(spring["b"])]
        x = [np.array(springs.marker_kinematics(y, markers, model.points, model.bodies, k)[:3]) for k in ends]
        free = [markers["kind"][k] == springs.ON_POINT or moves[markers["index"][k]] for k in ends]
        e = x[1] - x[0]
        length = float(np.linalg.norm(e))
        e = e / length if length > 0.0 else np.array([1.0, 0.0, 0.0])
        along = np.outer(e, e)
        tight = max(1.0 - float(spring["length"]) / length, 0.0) if length > 0.0 else 0.0
        stiffness, damping = float(spring["stiffness"]), float(spring["damping"])
        if spring["law"] != 0:
            stiffness, damping = _law_slopes(model, number, length - float(spring["length"]), max(length, 1e-3))
        across = np.eye(3) - np.outer(spring["axis"], spring["axis"])
        blocks = [
            stiffness * (along + tight * (np.eye(3) - along)) + float(spring["lateral_stiffness"]) * across,
            damping * along + float(spring["lateral_damping"]) * across,
        ]
        for k, position, moving in zip(ends, x, free, strict=True):
            index = markers["index"][k]
            for what in range(2):
                block = blocks[what] * (2.0 if all(free) else 1.0)
                if not moving:
                    continue
                if markers["kind"][k] == springs.ON_POINT:
                    point[what, index] += block
                else:
                    d = position - model.bodies["x"][index]
                    arm = np.array([[0.0, -d[2], d[1]], [d[2], 0.0, -d[0]], [-d[1], d[0], 0.0]])
                    J = np.hstack([np.eye(3), -arm])
                    body[what, index] += J.T @ block @ J


def _law_slopes(model: mdl.Model, k: int, extension: float, scale: float) -> tuple[float, float]:
    """Stiffness and damping of a spring with a law at the start, by central differences; never below zero."""

    def tension(e: float, rate: float) -> float:
        return float(springs.spring_tension(model.springs, k, e, rate, 0.0, model.parameters)[0])

    d = 1e-6 * scale
    stiffness = (tension(extension + d, 0.0) - tension(extension - d, 0.0)) / (2.0 * d)
    damping = (tension(extension, d) - tension(extension, -d)) / (2.0 * d)
    return max(stiffness, 0.0), max(damping, 0.0)


def _largest(blocks: np.ndarray, where: str) -> tuple[float, float, str]:
    values = [float(np.abs(np.linalg.eigvals(block)).max()) for block in blocks]
    return values[0], values[1], where


def _thread_modes(model: mdl.Model, p: int, name: str, body: np.ndarray) -> list[tuple[float, float, str]]:
    """Bounds of the nodes of thread p; its pull on the body is added to `body`."""
    row = model.threads[p]
    first, n, b = int(row["node"]), int(row["n"]), int(row["body"])
    masses = model.nodes["mass"][first : first + n]
    if row["kind"] == thread.SPRINGS:
        ends = np.where(np.arange(n) > 0, 4.0, 2.0)
        J = np.concatenate([row["X"], np.cross(row["d"], row["X"])])
        for what, value in enumerate((row["stiffness"], row["damping"])):
            body[what, b] += 2.0 * value * row["copies"] * np.outer(J, J)
        squared, damping = ends * row["stiffness"] / masses, ends * row["damping"] / masses
        if row["feed"] == feed.FREE:
            compliance = 2.0 * float(row["radius"]) ** 2 / float(row["spool_inertia"])
            squared, damping = (
                np.append(squared, compliance * row["stiffness"]),
                np.append(damping, compliance * row["damping"]),
            )
        return [(float(k), float(d), name) for k, d in zip(squared, damping, strict=True)]
    # links of fixed length: transverse only, by the tension of the whole thread straight at the present rate
    rate2 = float(np.sum(model.bodies["w"][b] ** 2))
    distance = float(np.linalg.norm(row["d"])) + row["segment"] * (n - np.arange(n))
    tension = np.cumsum(masses * (rate2 * distance + float(np.linalg.norm(model.info.gravity))))
    lighter = np.minimum(masses, np.roll(masses, -1))
    return [(4.0 * float(np.max(tension / lighter)) / float(row["segment"]), 0.0, name)]


def stability_polynomial(method: Method) -> list[float]:
    """Coefficients of R(z) = 1 + z b^T (I - z A)^-1 1 of an explicit method, from the highest power on."""
    power, found = np.ones(method.b.size), [1.0]
    for _ in range(method.b.size):
        found.append(float(method.b @ power))
        power = method.A @ power
    return found[::-1]


def amplification(coefficients: list[float], z: Any) -> Any:
    """|R(z)| of a complex number or an array, by Horner's rule."""
    found = 0.0 * z
    for coefficient in coefficients:
        found = found * z + coefficient
    return abs(found)


def stability_limit(method: Method, mode: Mode, duration: float) -> float:
    """Largest step (s) at which the fastest mode does not grow, damping included, and no smaller step lets it grow.

    Notes
    -----
    Heun's method has no stable step for an undamped mode, |R|^2 = 1 + z^4 / 4 on the imaginary axis: growth by a
    twentieth over the whole `duration` is accepted of any method.
    """
    if mode.frequency == 0.0 and mode.largest_damping_rate == 0.0:
        return math.inf
    half = 0.5 * mode.damping_rate
    root = np.sqrt(complex(half * half - mode.frequency**2))
    poles = [complex(-half + root), complex(-half - root), complex(-mode.largest_damping_rate)]
    polynomial = stability_polynomial(method)

    def stable(h: Any) -> Any:
        found = h > 0.0
        for pole in poles:
            found = found & (amplification(polynomial, h * pole) <= 1.0 + 0.05 * h / duration)
        return found

    scale = max(mode.frequency, mode.largest_damping_rate)
    if not stable(0.01 / scale):
        scale *= 100.0 * max(1.0, (mode.frequency * duration) ** (1 / 3))
    grows = np.flatnonzero(~stable(0.01 * np.arange(1, 801) / scale))
    low = 0.01 * (int(grows[0]) if grows.size else 800) / scale
    high = low + 0.01 / scale
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low
