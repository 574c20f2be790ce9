"""Motion of ribs and hub, and what follows from it alone: strain, curvature, wrap angle."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from evolvent.systems.wrapped_rib.case import Case
from evolvent.systems.wrapped_rib.start import Start, hermite

if TYPE_CHECKING:
    from evolvent.builder import Assembly
    from evolvent.solvers import Solution


class Motion(NamedTuple):
    """Nodes and rates of all ribs (nt, ribs, n + 1, vectors, 3); position, quaternion, rates and angle of the hub."""

    nodes: np.ndarray
    rates: np.ndarray
    x: np.ndarray
    q: np.ndarray
    v: np.ndarray
    w: np.ndarray
    angle: np.ndarray


def motion_of(case: Case, begin: Start, assembly: Assembly, solution: Solution) -> Motion:
    """Motion of ribs and hub in a solution."""
    model, y, t = assembly.model, solution.y, solution.t
    k = case.rib.vectors
    shape = (t.size, case.rib.elements + 1, k, 3)
    size = 3 * k * (case.rib.elements + 1)
    nodes, rates = [], []
    for b in range(case.rib.count):
        beam = model.flexible.beams[assembly.index(f"rib-{b + 1}", "beams")]
        iq, iv = int(beam["iq"]), int(model.flexible.elements["iv"][beam["first_element"]])
        nodes.append(y[:, iq : iq + size].reshape(shape))
        rates.append(y[:, iv : iv + size].reshape(shape))
    hub = model.bodies[assembly.index("hub", "bodies")]
    iq, iv = int(hub["iq"]), int(hub["iv"])
    x = np.tile(begin.hub.position, (t.size, 1))
    v, w = np.zeros((t.size, 3)), np.zeros((t.size, 3))
    if case.hub.motion == "free":
        x, q = y[:, iq : iq + 3], y[:, iq + 3 : iq + 7]
        v, w = y[:, iv : iv + 3], y[:, iv + 3 : iv + 6]
        angle = np.unwrap(2.0 * np.arctan2(q[:, 3], q[:, 0]))
        angle += begin.hub.angle - angle[0]
    else:
        angle = np.full(t.size, begin.hub.angle)
        if case.hub.motion != "fixed":
            angle = angle + y[:, iq]
            w[:, 2] = y[:, iv]
        zero = np.zeros(t.size)
        q = np.stack([np.cos(0.5 * angle), zero, zero, np.sin(0.5 * angle)], axis=1)
    return Motion(np.stack(nodes, axis=1), np.stack(rates, axis=1), x, q, v, w, angle)


def along(nodes: np.ndarray, length: float, xi: np.ndarray, order: int = 0) -> np.ndarray:
    """Places on all elements, or their derivatives by arc length, at xi : (k,); (nt, ribs, elements, k, 3)."""
    e = nodes[..., :2, :][..., None, :]
    return hermite(xi, length, e[:, :, :-1, 0], e[:, :, :-1, 1], e[:, :, 1:, 0], e[:, :, 1:, 1], order=order)


def strain_of(nodes: np.ndarray, length: float, per: int, *, engineering: bool) -> np.ndarray:
    """Strain of the axis at `per` points of each element and the tip : (nt, ribs, elements per + 1).

    Notes
    -----
    Means of Green's strain (r,x . r,x - 1)/2, or of the engineering one |r,x| - 1, over the elements, by the rule with
    which they take it, and straight lines between the elements' middles: what varies within an element is mostly what
    its cubic adds to a bent shape.
    """
    at, weight = np.polynomial.legendre.leggauss(3)
    slope = along(nodes, length, 0.5 * (1.0 + at), 1)
    squared = np.einsum("...i,...i->...", slope, slope)
    mean = (np.sqrt(squared) - 1.0 if engineering else 0.5 * (squared - 1.0)) @ (0.5 * weight)
    if mean.shape[-1] == 1:
        return np.repeat(mean, per + 1, axis=-1)
    place = np.arange(mean.shape[-1] * per + 1) / per - 0.5
    left = np.clip(place.astype(int), 0, mean.shape[-1] - 2)
    share = place - left
    found: np.ndarray = mean[..., left] * (1.0 - share) + mean[..., left + 1] * share
    return found


def curvature(motion: Motion, R: np.ndarray, length: float, xi: np.ndarray) -> np.ndarray:
    """Turn about the hub's axis per length without stress at xi : (nt, ribs, elements, k), 1/m, positive as it winds.

    Notes
    -----
    The straight line through Gauss's two points, at which an element's cubic is nearest to the shape that it stands
    for.
    """
    at, _ = np.polynomial.legendre.leggauss(2)
    slope, bend = along(motion.nodes, length, 0.5 * (1.0 + at), 1), along(motion.nodes, length, 0.5 * (1.0 + at), 2)
    across = np.einsum("tbnki,ti->tbnk", np.cross(slope, bend), R[:, :, 2])
    turn = across / np.einsum("...i,...i->...", slope, slope)
    mean, tilt = turn.mean(axis=-1), 0.5 * (turn[..., 1] - turn[..., 0]) / at[1]
    found: np.ndarray = mean[..., None] + tilt[..., None] * (2.0 * xi - 1.0)
    return found


def joined(values: np.ndarray) -> np.ndarray:
    """(..., elements, k + 1) with both ends of each as (..., elements k + 1), means where elements meet."""
    found = values[..., :-1].reshape(*values.shape[:-2], -1)
    found = np.concatenate([found, values[..., -1, -1:]], axis=-1)
    k = values.shape[-1] - 1
    found[..., k:-1:k] = 0.5 * (values[..., 1:, 0] + values[..., :-1, -1])
    return found


def wrap_angle(case: Case, motion: Motion, R: np.ndarray) -> np.ndarray:
    """Angle of the hub that each rib covers, rad.

    Notes
    -----
    Of a straight tail along the tangent: the tip's angle about the axis from the root on, followed along the rib, less
    acos(R/r) of its distance r; negative where the rib lies the other way round.
    """
    xi = np.arange(8) / 8
    inner = along(motion.nodes, case.rib.element_length, xi)
    path = np.concatenate([inner.reshape(*inner.shape[:2], -1, 3), motion.nodes[:, :, -1:, 0]], axis=2)
    own = np.einsum("tji,tbnj->tbni", R, path - motion.x[:, None, None])
    angle = np.unwrap(np.arctan2(own[..., 1], own[..., 0]), axis=-1)
    radius = np.maximum(np.hypot(own[..., -1, 0], own[..., -1, 1]), case.hub.radius)
    turned, tail = angle[..., -1] - angle[..., 0], np.arccos(case.hub.radius / radius)
    found: np.ndarray = np.sign(turned) * np.clip(np.abs(turned) - tail, 0.0, None)
    return found
