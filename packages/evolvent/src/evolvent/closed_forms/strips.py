"""A strip that winds on a hub, lies on it and springs off; see `evolvent.closed_forms`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import scipy

Array = np.ndarray
Rates = Callable[[float, Array], list[float]]


class Strip(NamedTuple):
    """A rib and its hub.

    Attributes
    ----------
    radius, length : float, m, R of the hub and L of the rib
    line_density : float, kg/m, m, mean over L
    bending_stiffness, axial_stiffness : float, N m2 and N, EI and EA, means over L
    taper : float, k, thickness of the tip over that of the root, linear between both
    """

    radius: float
    length: float
    line_density: float
    bending_stiffness: float
    axial_stiffness: float
    taper: float = 1.0


#: Share of the length at which the winding of a string ends; below 1, where its speed has no bound.
WOUND = 0.98
#: Mass damping above which the string's equations are stiff, 1/s.
STIFF = 2.0


class Winding(NamedTuple):
    """Motion of a string that is wound by a field torque.

    Attributes
    ----------
    time, tip_speed : (nt,) float, s and m/s
    swing, wrap : (nt,) float, rad, of the straight string about its hinge from outwards, at most pi/2 (tangent); of the
        hub that the string covers
    rate : (nt,) float, rad/s, of `swing`, then of `wrap`
    kinetic, work, drag : (nt,) float, J, kinetic energy, work of the field torque and loss by mass damping
    end_time : float, s, when the share `WOUND` of the length is wound; infinite if `longest` comes first
    """

    time: Array
    swing: Array
    wrap: Array
    rate: Array
    tip_speed: Array
    kinetic: Array
    work: Array
    drag: Array
    end_time: float


def string_winding(
    rib: Strip,
    torque: float,
    alpha: float,
    *,
    damped: Sequence[tuple[float, float]] | None = None,
    start_angle: float = 0.0,
    samples: int = 2001,
    longest: float = 1e6,
) -> Winding:
    """A string without bending stiffness: it swings straight to the hub's tangent, then winds as an involute.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    torque, alpha : float, N m and 1/s, T and the damping proportional to mass
    damped : sequence of (from, to), m, arc lengths of what is damped; all if left out
    start_angle : float, rad, from outwards, at which it starts from rest, positive in the winding sense
    samples, longest : int, times at which the motion is given; float, s, time after which it ends anyway

    Returns
    -------
    Winding
        Times, angles, speeds and energies of the motion, `samples` of them.

    Notes
    -----
    Derived here; the hinge is at the hub's surface. Swing by th, a rigid rod, moments about the hinge:

        th'' = c (1 + 3 R cos(th) / (2 L)) - alpha d th',   c = T / (m (R^2 L + L^3/3 + R L^2 cos(th)))

    Winding by ph, with a straight tail of length l = L - R ph along the tangent. A point at the distance s from the
    point of tangency moves across the tail at s ph', and the wound part rests, so that the kinetic energy is
    m l^3 ph'^2 / 6, the moment of the field m c l^3 / 3, and Lagrange's equation

        ph'' = 3 R ph'^2 / (2 l) + c - alpha d ph',   c = T / (m (R^2 L + l^3/3))

    where d is the damped share of int s^2 ds over the tail. Field and drag on all of it keep the tail straight; drag on
    a part bends it, so that this is an estimate then. The tip's speed l ph' grows as l^(-1/2) at the end: the whip of
    the last piece, which no mesh resolves. Strong damping makes the equations stiff: an implicit method is taken.
    """
    R, L, m = rib.radius, rib.length, rib.line_density
    quarter = 0.5 * math.pi

    def wound(_: float, y: Array) -> float:
        return float(R * (y[0] - quarter) - WOUND * L)

    wound.terminal = True  # type: ignore[attr-defined]
    method = {"method": "DOP853", "rtol": 1e-11} if alpha < STIFF else {"method": "Radau", "rtol": 1e-9}
    rates, begin = _string_rates(rib, torque, alpha, damped), [start_angle, 0.0, 0.0, 0.0]
    found = scipy.integrate.solve_ivp(
        rates, (0.0, longest), begin, events=wound, atol=1e-13, dense_output=True, **method
    )
    time = np.linspace(0.0, float(found.t[-1]), samples)
    turn, rate, work, drag = found.sol(time)
    wrap = np.maximum(turn - quarter, 0.0)
    tail = L - R * wrap
    return Winding(
        time=time,
        swing=np.minimum(turn, quarter),
        wrap=wrap,
        rate=rate,
        tip_speed=tail * rate,
        kinetic=m * tail**3 * rate**2 / 6.0,
        work=work,
        drag=drag,
        end_time=float(found.t[-1]) if found.status == 1 else math.inf,
    )


def _string_rates(rib: Strip, torque: float, alpha: float, damped: Sequence[tuple[float, float]] | None) -> Rates:
    """Rates of (swing and wrap, their rate, work of the field, work of the drag); equations of `string_winding`."""
    R, L, m = rib.radius, rib.length, rib.line_density

    def decay_of(wound: float) -> float:
        """Rate of decay alpha d of a straight tail from the arc length `wound` on."""
        if damped is None or wound >= L:
            return alpha
        own = sum(max(b - wound, 0.0) ** 3 - max(a - wound, 0.0) ** 3 for a, b in damped)
        return float(alpha * own / (L - wound) ** 3)

    def rates(_: float, y: Array) -> list[float]:
        cosine, wound = max(math.cos(min(y[0], 0.5 * math.pi)), 0.0), R * max(y[0] - 0.5 * math.pi, 0.0)
        tail, decay, speed = L - wound, decay_of(wound), y[1]
        inertia = m * tail**3 / 3.0
        c = torque / (m * R * R * L + inertia + m * R * L * L * cosine)
        # power of the field: c (z x r) . v over the tail, v = s th' across it, along which z x r is s + R cos(th)
        power = c * (inertia + 0.5 * m * R * L * L * cosine) * speed
        faster = 1.5 * R / tail * speed**2 if y[0] > 0.5 * math.pi else c * 1.5 * R * cosine / L
        return [speed, c + faster - decay * speed, power, decay * inertia * speed**2]

    return rates


def string_shape(rib: Strip, arc: Array, *, wrap: float, swing: float = 0.5 * math.pi, at: float = 0.0) -> Array:
    """Points of a string that is wound on the hub from its root on, with a straight tail.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    arc : (k,) float, m, from the root
    wrap, swing, at : float, rad, of the hub that it covers; of the tail from outwards; position of the root on the hub

    Returns
    -------
    (k, 2) float, m, from the hub's axis
    """
    R = rib.radius
    turn = np.minimum(np.asarray(arc) / R, wrap)
    tail = np.asarray(arc) - R * turn
    place, along = at + turn, at + turn + swing
    return np.stack([R * np.cos(place) + tail * np.cos(along), R * np.sin(place) + tail * np.sin(along)], axis=-1)


def wound_tension(rib: Strip, torque: float, arc: Array) -> Array:
    """Tension of the rib wound and held by a field torque without friction, N, at arc lengths from the root.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    torque : float, N m, field torque T that holds the rib
    arc : (k,) float, m, arc lengths s from the root, from 0 to L

    Returns
    -------
    (k,) float, N

    Notes
    -----
    At the radius R the field is T/(R M) per mass, M in all, along the hub; so N(s) = T/R (1 - M(s)/M) with the mass
    M(s) from the root to s. M(s)/M is x = s/L of a uniform rib, x (2 + (k - 1) x)/(1 + k) with a taper.
    """
    x, k = np.asarray(arc) / rib.length, rib.taper
    return torque / rib.radius * (1.0 - x * (2.0 + (k - 1.0) * x) / (1.0 + k))


def axial_stiffness_at(rib: Strip, arc: Array) -> Array:
    """EA at arc lengths from the root, N, of the mean EA and the taper.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    arc : (k,) float, m, arc lengths s from the root, from 0 to L

    Returns
    -------
    (k,) float, N

    Notes
    -----
    EA 2 (1 + (k - 1) s/L)/(1 + k), whose mean over L is EA: the thickness is linear.
    """
    x, k = np.asarray(arc) / rib.length, rib.taper
    return rib.axial_stiffness * 2.0 * (1.0 + (k - 1.0) * x) / (1.0 + k)


def wound_pressure(rib: Strip, torque: float, arc: Array) -> Array:
    """Normal force on the hub per length, N/m: tension over R (bending at a constant moment adds nothing).

    Parameters
    ----------
    rib : Strip, the rib and its hub
    torque : float, N m, field torque T that holds the rib
    arc : (k,) float, m, arc lengths s from the root, from 0 to L

    Returns
    -------
    (k,) float, N/m

    Notes
    -----
    A cord under the tension N on a cylinder presses it with N/R per length, N by `wound_tension`.
    """
    return wound_tension(rib, torque, arc) / rib.radius


def wound_contact_force(rib: Strip, torque: float) -> float:
    """Sum of the normal forces on the hub, N: the integral of the pressure.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    torque : float, N m, field torque T that holds the rib

    Returns
    -------
    float, N

    Notes
    -----
    T L / (2 R^2) of a uniform rib, T L / R^2 (1 + 2 k)/(3 (1 + k)) with a taper.
    """
    k = rib.taper
    return torque * rib.length / rib.radius**2 * (1.0 + 2.0 * k) / (3.0 * (1.0 + k))


def root_strain(rib: Strip, torque: float) -> float:
    """Strain at the root of the rib held by a field torque, the largest along it: T / (R EA), EA at the root.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    torque : float, N m, field torque T that holds the rib

    Returns
    -------
    float

    Notes
    -----
    The tension at the root is T/R (`wound_tension` at s = 0).
    """
    return torque / (rib.radius * float(axial_stiffness_at(rib, np.zeros(()))))


def bending_energy(rib: Strip) -> float:
    """Energy of bending of the wound rib, J: EI L / (2 R^2).

    Parameters
    ----------
    rib : Strip, the rib and its hub

    Returns
    -------
    float, J

    Notes
    -----
    EI/2 times the square of the curvature 1/R, over the length L.
    """
    return rib.bending_stiffness * rib.length / (2.0 * rib.radius**2)


def membrane_energy(rib: Strip, torque: float) -> float:
    """Energy of stretching of the rib held by a field torque, J: T^2 L / (6 R^2 EA), small strain.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    torque : float, N m, field torque T that holds the rib

    Returns
    -------
    float, J

    Notes
    -----
    The integral of N^2/(2 EA) over L with N = T/R (1 - s/L), that of `wound_tension` for a uniform rib.
    """
    return torque**2 * rib.length / (6.0 * rib.radius**2 * rib.axial_stiffness)


def deployment_speed(rib: Strip) -> float:
    """Speed of the tip while the rib unwinds by its own bending, m/s: v = sqrt(3 EI / m) / R.

    Parameters
    ----------
    rib : Strip, the rib and its hub

    Returns
    -------
    float, m/s

    Notes
    -----
    Derived here. The free tail of length l is straight and turns at v/l about the point of tangency: its kinetic
    energy m l^3 (v/l)^2 / 6 is the bending energy that it has released, EI l / (2 R^2), whatever l is. No damping, no
    stretch. The limit of a tail that is long beside R: the tail leaves the hub bent (`peel`), an error of order R/l.
    """
    return math.sqrt(3.0 * rib.bending_stiffness / rib.line_density) / rib.radius


def peel(rib: Strip) -> tuple[float, float]:
    """How the tail leaves the hub while the rib unwinds by its own bending, where the tail is long beside R.

    Parameters
    ----------
    rib : Strip, the rib and its hub

    Returns
    -------
    angle : float, rad, that the rib turns on by between the hub and its straight part: acos(2/3)
    offset : float, m, of the straight part's line from the axis: 4 R / 3

    Notes
    -----
    Derived here. Where the tail begins its tension is m v^2 / 2 = 3 EI / (2 R^2). There the rib is an elastica under
    that tension, EI phi'^2 / 2 = N (1 - cos phi), and leaves the hub with the curvature 1/R: 1 - cos phi = 1/3. Its
    bend lies on the outer side of the hub, which moves the line of the tail outwards, to R cos phi +
    2 sin(phi/2) sqrt(EI/N). The angular momentum agrees: m l^2 v / 3 grows by 2 EI / R, which is N times the offset.
    """
    cosine = 2.0 / 3.0
    bend = rib.radius * math.sqrt(2.0 / 3.0)  # sqrt(EI / N)
    return math.acos(cosine), rib.radius * cosine + 2.0 * math.sqrt(0.5 * (1.0 - cosine)) * bend


def deployed_length(rib: Strip, time: Array) -> Array:
    """Length of the free tail, m: l^2 = 2 v R t, since l' = R v / l; at most L.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    time : (nt,) float, s, since the release; before it the length is 0

    Returns
    -------
    (nt,) float, m

    Notes
    -----
    v is that of `deployment_speed`; valid where l is long beside R.
    """
    grown = 2.0 * deployment_speed(rib) * rib.radius * np.maximum(np.asarray(time, dtype=float), 0.0)
    return np.minimum(np.sqrt(grown), rib.length)


def deployed_tip_radius(rib: Strip, time: Array) -> Array:
    """Distance of the tip from the hub's axis until all is unwound, m: r^2 = R^2 + 2 v R t.

    Parameters
    ----------
    rib : Strip, the rib and its hub
    time : (nt,) float, s, since the release

    Returns
    -------
    (nt,) float, m

    Notes
    -----
    The straight tail l of `deployed_length` is tangent to the hub: r^2 = R^2 + l^2.
    """
    return np.hypot(rib.radius, deployed_length(rib, time))


def deployment_time(rib: Strip) -> float:
    """Time until all is unwound, s: L^2 / (2 v R).

    Parameters
    ----------
    rib : Strip, the rib and its hub

    Returns
    -------
    float, s

    Notes
    -----
    `deployed_length` reaches L.
    """
    return rib.length**2 / (2.0 * deployment_speed(rib) * rib.radius)
