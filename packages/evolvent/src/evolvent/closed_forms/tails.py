"""Ribs that lie on a hub but for a tail, and what it takes to wind them; see `evolvent.closed_forms`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy

from evolvent.closed_forms.strips import Array, Strip
from evolvent_base.errors import InputError

#: Root of the condition at the contact in `short_tail`: T l^3 / (EI L R).
SHORT_TAIL = 4.302826742393747


class HeldTail(NamedTuple):
    """Ribs at rest on the hub under a field torque, of one bending stiffness and length, with tails of several lengths.

    Attributes
    ----------
    tail, torque : (k,) float, m, length that does not lie on the hub, and N m, torque that holds it
    tip_radius : (k,) float, m, distance of the tip from the axis
    wrap : (k,) float, rad, angle wound, as if the tail were straight along the tangent: `wrap_angle` of results
    touching : (k,) float, rad, angle of the hub that the rib touches: `touching_angle` of results
    """

    tail: Array
    torque: Array
    tip_radius: Array
    wrap: Array
    touching: Array


def least_winding_torque(rib: Strip, curvature: float = 0.0) -> float:
    """Field torque below which a rib with a tail that is long beside R does not begin to wind, N m: EI (1/R - k)/2.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    curvature : float, 1/m, k of the rib without stress where it meets the hub, in the winding sense

    Returns
    -------
    float, N m

    Notes
    -----
    Winding by dph bends R dph of the rib from k to 1/R, which takes EI R (1/R - k)^2/2 dph. The tail rolls on the hub
    and turns by (1 - k R) dph; the torque does at most the work T (1 - k R) dph, if the rib moves slowly or loses
    energy. It is a necessary condition: the shorter the tail, the less of the torque acts on it, T (l^3/3) / (R^2 L +
    l^3/3) on a straight one. `winding_share` has the part of any tail.
    """
    return 0.5 * rib.bending_stiffness * (1.0 / rib.radius - curvature)


def winding_share(rib: Strip, places: Array) -> float:
    """Part of a field torque that turns a stiff tail about the place where it meets the hub.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    places : (n, 2) float, m
        Axis of the tail from the hub's axis, at evenly spaced arc lengths, the contact first.

    Returns
    -------
    float, from 0 to 1

    Notes
    -----
    The tail rolls: its points move by dth z x (r - p) about the contact p. The field T z x r / int r^2 ds of the whole
    rib does the work T dth int r . (r - p) ds / int r^2 ds, R^2 of each length on the hub. It is 1 - R O(1/l) of a
    long tail.
    """
    r = np.asarray(places, dtype=float)
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(r, axis=0), axis=1))])
    about = np.trapezoid(np.einsum("ni,ni->n", r, r - r[0]), arc)
    whole = np.trapezoid(np.einsum("ni,ni->n", r, r), arc) + rib.radius**2 * max(rib.length - arc[-1], 0.0)
    return float(about / whole)


def parabola_energy(rib: Strip, focal_length: float, root: float, tip: float) -> float:
    """Energy of bending, wound on the hub, of a rib whose stress-free shape is a parabola, J.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    focal_length : float, m, f of y = x^2/(4 f)
    root, tip : float, rad, angles of the tangent at the ends from that at the vertex

    Returns
    -------
    float, J

    Notes
    -----
    EI/2 int (1/R - k)^2 ds with k = cos(th)^3/(2 f) and k ds = dth: EI/2 [L/R^2 - 2 (th2 - th1)/R + S], S = int k dth
    = [sin th - sin(th)^3/3]/(2 f).
    """
    R, (low, high) = rib.radius, np.sin([root, tip])
    own = ((high - high**3 / 3.0) - (low - low**3 / 3.0)) / (2.0 * focal_length)
    return float(0.5 * rib.bending_stiffness * (rib.length / R**2 - 2.0 * (tip - root) / R + own))


def short_tail(rib: Strip, torque: float) -> float:
    """Length of the tip's end that a field torque does not lay on the hub, m: (4.3028 EI L R / T)^(1/3), l << R.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    torque : float, N m, field torque T, above 0

    Returns
    -------
    float, m

    Raises
    ------
    InputError
        For a torque that is not above 0, or leaves a tail that is longer than the rib.

    Notes
    -----
    Derived here. Near the hub the field is T/(R L) per length along the surface, and pulls with N = T (l - s)/(R L) at
    the distance s from the last contact. The height w above the hub follows EI w'''' = (N w')' - N/R with w = w' = w''
    = 0 at the contact and no moment and shear force at the tip, w'' = 1/R, w''' = 0. Integrated once, q = R w'/l +
    (1 - u)/2 with u = s/l follows Airy's equation q'' = b (1 - u) q, b = T l^3/(EI L R), with q = 1/2, q' = -1/2 at
    u = 0 and q' = 1/2 at u = 1: b = 4.3028.
    """
    if not torque > 0.0:
        raise InputError(f"torque is {torque:g} N m; it must be above 0")
    tail = float((SHORT_TAIL * rib.bending_stiffness * rib.length * rib.radius / torque) ** (1.0 / 3.0))
    if tail > rib.length:
        least = SHORT_TAIL * rib.bending_stiffness * rib.radius / rib.length**2
        raise InputError(
            f"torque is {torque:g} N m, which would leave a tail of {tail:.4g} m, longer than the rib of "
            f"{rib.length:g} m; it must be {least:.4g} N m or more"
        )
    return tail


def held_tails(rib: Strip, *, samples: int = 40, curvature: float = 0.0) -> HeldTail:
    """Tails of any length that a field torque holds at rest, as elastica; uniform ribs without friction.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    samples : int, number of tails, 2 or more, up to 4 R or the length of the rib
    curvature : float, 1/m, k of the tail without stress, in the winding sense, below 1/R

    Returns
    -------
    HeldTail
        The tails, of growing length, and what holds each.

    Raises
    ------
    InputError
        For a rib with a taper, fewer samples, and a greater curvature.
    ArithmeticError
        If the boundary-value problem is not solved.

    Notes
    -----
    The tail leaves the hub with the curvature 1/R, a free end under the field g m z x r, g m = T / int r^2 ds:

        x' = cos(ph), y' = sin(ph), EI (ph' - k) = M, M' = Fx sin(ph) - Fy cos(ph), F' = -g m z x r

    a boundary-value problem for (x, y, ph, M, F) and g m. Tails are longer until the rib would be pressed along its
    axis where it leaves the hub: what lies on the hub would then lift off, and the rib no longer rests in this shape.
    """
    if samples < 2:
        raise InputError(f"samples is {samples}; it must be 2 or more tails")
    if rib.taper != 1.0:
        raise InputError(f"the rib's taper is {rib.taper:g}; tails at rest are known of uniform ribs, of a taper of 1")
    whole, own = rib.length / rib.radius, curvature * rib.radius  # lengths in R, forces in EI/R^2
    if not own < 1.0:
        raise InputError(f"curvature is {curvature:g} 1/m; it must be below 1/R = {1.0 / rib.radius:.4g} 1/m")
    longest = min(4.0, whole)
    tails = np.linspace(min(0.1, longest / samples), longest, samples)
    found: list[tuple[float, ...]] = []
    field, u = SHORT_TAIL / tails[0] ** 3, np.linspace(0.0, 1.0, 60)
    nodes, values = u, np.array([1.0 + 0.0 * u, tails[0] * u, 0.5 * math.pi + 0.0 * u, 1.0 - u, 0.0 * u, 1.0 - u])
    values[3] *= 1.0 - own
    values[5] *= field * tails[0]
    for tail in tails:

        def rates(_: Array, v: Array, p: Array, length: float = tail) -> Array:
            c, s = np.cos(v[2]), np.sin(v[2])
            return length * np.array([c, s, v[3] + own, v[4] * s - v[5] * c, p[0] * v[1], -p[0] * v[0]])

        def ends(a: Array, b: Array, _: Array) -> Array:
            """What vanishes: it leaves the hub along the tangent with the curvature 1/R, and is free."""
            return np.array([a[0] - 1.0, a[1], a[2] - 0.5 * math.pi, a[3] + own - 1.0, b[3], b[4], b[5]])

        solution = scipy.integrate.solve_bvp(rates, ends, nodes, values, p=[field], tol=1e-6, max_nodes=4000)
        if not solution.success:
            raise ArithmeticError(f"the tail of {tail * rib.radius:.4g} m is not found: {solution.message}")
        nodes, values, field = solution.x, solution.y, float(solution.p[0])
        if values[5, 0] < 0.0:
            break
        x, y = values[:2]
        moment = field * (whole - tail + float(np.trapezoid(x * x + y * y, nodes * tail)))
        radius = math.hypot(x[-1], y[-1])
        wrap = whole - tail + math.atan2(y[-1], x[-1]) - math.acos(min(1.0 / radius, 1.0))
        torque = moment * rib.bending_stiffness / rib.radius
        found.append((tail * rib.radius, torque, radius * rib.radius, wrap, whole - tail))
        field *= (tail / (tail + tails[1] - tails[0])) ** 3
    return HeldTail(*np.array(found).T)


class SpunTail(NamedTuple):
    """A string on a hub that turns at a constant rate in a drag, at rest in the hub's axes.

    Attributes
    ----------
    tail, tip_radius : float, m, length that does not lie on the hub, and distance of the tip from the axis
    wrap : float, rad, angle wound, as if the tail were straight along the tangent: `wrap_angle` of results
    touching : float, rad, angle of the hub that the string touches: `touching_angle` of results
    tension : float, N, where the tail begins
    """

    tail: float
    tip_radius: float
    wrap: float
    touching: float
    tension: float


def spun_tail(rib: Strip, rate: float, alpha: float) -> SpunTail:
    """What a hub that turns at a constant rate leaves of a string in the air.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    rate, alpha : float, rad/s and 1/s, of the hub, and damping proportional to mass, the drag

    Returns
    -------
    SpunTail
        Where the drag is too slow to hold any of the string on the hub, as with alpha = 0, all of it is the tail.

    Raises
    ------
    InputError
        For a rate of 0, a negative drag, and numbers that are not finite.
    ArithmeticError
        If the shape is not found.

    Notes
    -----
    Derived here. In the hub's axes the force per mass is W^2 r outwards and alpha W r against the turn. With a complex
    number z for the place and the arc s from the tip inwards, F' = m W^2 (1 - i alpha/W) z and z' = -F / abs(F), from
    F = 0 at the tip to the place where the tail is tangent to a circle, the hub, or to that where it is as long beside
    the distance from the axis as the string is beside R, the hinge. The shape depends on alpha/W alone.
    Where alpha << W the moments of a tail that is nearly radial, N R = alpha m W r^3/3 with N = m W^2 r^2/2, give
    3 W R/(2 alpha).
    """
    if not (math.isfinite(rate) and rate != 0.0):
        raise InputError(f"rate is {rate:g} rad/s; it must be a finite number other than 0")
    if not (math.isfinite(alpha) and alpha >= 0.0):
        raise InputError(f"alpha is {alpha:g} 1/s; it must be a finite number, 0 or above")
    R, L = rib.radius, rib.length
    size = math.hypot(1.0, alpha / abs(rate))
    k, step = complex(1.0, -alpha / abs(rate)) / size, 1e-6 / size

    def rates(_: float, y: Array) -> list[float]:
        """By the arc over the distance from the axis, through which no step leads."""
        z, force = complex(y[0], y[1]), complex(y[2], y[3])
        r = abs(z)
        along, grown = -r * force / abs(force), r * k * z
        return [along.real, along.imag, grown.real, grown.imag, r]

    def tangent(_: float, y: Array) -> float:
        return float(y[0] * y[2] + y[1] * y[3])

    def hinge(_: float, y: Array) -> float:
        return float(y[4] * R - L * math.hypot(y[0], y[1]))

    tangent.terminal = hinge.terminal = True  # type: ignore[attr-defined]
    z, force = 1.0 - step * k, k * step
    begin = [z.real, z.imag, force.real, force.imag, step]
    found = scipy.integrate.solve_ivp(
        rates, (0.0, 100.0), begin, events=(tangent, hinge), method="DOP853", rtol=1e-10, atol=1e-15
    )
    if found.status != 1:
        raise ArithmeticError(f"the tail at {rate:g} rad/s in a drag of {alpha:g} 1/s is not found: {found.message}")
    x, y, fx, fy, arc = found.y[:, -1]
    scale = R / math.hypot(x, y)  # of the tip's radius, which is 1 above
    tail = min(float(arc) * scale, L)
    turned = abs(float(np.unwrap(np.arctan2(found.y[1], found.y[0]))[-1]))
    wrap = (L - tail) / R + turned - math.acos(min(R / scale, 1.0))
    pull = rib.line_density * size * (rate * scale) ** 2 * math.hypot(fx, fy)
    return SpunTail(tail=tail, tip_radius=scale, wrap=max(wrap, 0.0), touching=(L - tail) / R, tension=pull)
