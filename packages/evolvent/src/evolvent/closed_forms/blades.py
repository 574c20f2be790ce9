"""Straight rigid blades on a spinning body; see `evolvent.closed_forms`."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeVar

import numpy as np
import scipy

from evolvent_base.errors import InputError

Array = np.ndarray
Length = TypeVar("Length", float, Array)

#: Lag beyond which a blade lies in the body, rad; its motion ends there.
WOUND_LAG = math.radians(100.0)

#: Torques that are tried, from half the slow limit on, each twice the one before: up to 64 times that limit.
MOST_DOUBLINGS = 8


class Rotor(NamedTuple):
    """A spinning body with blades.

    Attributes
    ----------
    inertia : float, kg m2, J of the body alone about the spin axis
    offset : float, m, L0, distance of the blades' hinges from the spin axis
    blades : int, N, their number
    line_density, tip_mass : float, kg/m and kg, rho and m_k of each blade
    """

    inertia: float
    offset: float
    blades: int
    line_density: float
    tip_mass: float


def blade_moments(rotor: Rotor, length: Length) -> tuple[Length, Length, Length]:
    """Mass M (kg), first moment S (kg m) and second moment I (kg m2) of a straight blade about its hinge.

    Parameters
    ----------
    rotor : Rotor, the body and its blades
    length : float or array, m, length l of a blade that is out

    Returns
    -------
    M, S, I : float or array, kg, kg m and kg m2

    Notes
    -----
    M = rho l + m_k, S = rho l^2/2 + m_k l, I = rho l^3/3 + m_k l^2.
    """
    rho, tip = rotor.line_density, rotor.tip_mass
    return rho * length + tip, length * (0.5 * rho * length + tip), length**2 * (rho * length / 3.0 + tip)


def rotor_inertia(rotor: Rotor, length: Length, lag: float = 0.0) -> Length:
    """Moment of inertia of body and blades about the spin axis, kg m2: J + N (M L0^2 + I + 2 L0 S cos d).

    Parameters
    ----------
    rotor : Rotor, the body and its blades
    length : float or array, m, length l of a blade that is out
    lag : float, rad, angle d by which the blades stay behind the radius through their hinges

    Returns
    -------
    float or array, kg m2

    Notes
    -----
    M, S and I of `blade_moments`; a point at s on a blade is at the distance sqrt(L0^2 + s^2 + 2 L0 s cos d).
    """
    M, S, I = blade_moments(rotor, length)  # noqa: E741
    L0 = rotor.offset
    return rotor.inertia + rotor.blades * (M * L0**2 + I + 2.0 * L0 * S * math.cos(lag))


def payout_lag(rotor: Rotor, speed: float, momentum: float) -> float:
    """Lag at the hub in steady pay-out on a free body, rad; negative for reeling in, NaN where there is none.

    Parameters
    ----------
    rotor : Rotor, the body and its blades
    speed : float, m/s, of the thread at the spool
    momentum : float, kg m2/s, angular momentum of body and blades, H; with 0 there is no steady lag

    Returns
    -------
    float, rad

    Notes
    -----
    sin d = 2 v J / (H L0). The blades' pull turns the body, N T L0 sin d = -J W', with W = H / J_t, J_t that of
    `rotor_inertia`, T = W^2 S, and J_t' = 2 N S v, both up to terms of the order L0 / l. At the start of a deployment
    H = J W0 gives sin d = 2 v / (L0 W0), which holds exactly on a body driven at W0, for any masses.
    """
    load, pull = 2.0 * speed * rotor.inertia, momentum * rotor.offset
    return math.asin(load / pull) if abs(load) < abs(pull) else math.nan


def lag_frequency(rotor: Rotor, length: float, rate: float) -> float:
    """Angular frequency of small oscillations of the lag about zero, rad/s, body and blades free; 0 without spin.

    Parameters
    ----------
    rotor : Rotor, the body and its blades
    length : float, m, length of a blade
    rate : float, rad/s, of body and blades, in either sense

    Returns
    -------
    float, rad/s

    Notes
    -----
    w^2 = W^2 L0 S (B + I + 2 L0 S) / (I B - L0^2 S^2), B = J/N + M L0^2: the linear equations of `spin_up_swing`.
    """
    M, S, I = blade_moments(rotor, length)  # noqa: E741
    B, LS = rotor.inertia / rotor.blades + M * rotor.offset**2, rotor.offset * S
    return abs(rate) * math.sqrt(LS * (B + I + 2.0 * LS) / (I * B - LS**2))


def spin_up_lag(rotor: Rotor, length: float, acceleration: float, rate: float) -> float:
    """Lag at which a blade stays behind a body that turns at `rate` (rad/s) and accelerates, rad; NaN beyond the limit.

    Parameters
    ----------
    rotor : Rotor, the body and its blades
    length : float, m, length of a blade
    acceleration, rate : float, rad/s2 and rad/s, a and W of the body

    Returns
    -------
    float, rad

    Raises
    ------
    InputError
        If rate and acceleration are both 0: then a blade is at rest with any lag.

    Notes
    -----
    Moments about the hinge, of the centrifugal and of the tangential inertial forces: W^2 L0 S sin d =
    a (I + L0 S cos d), or sqrt(W^4 + a^2) k sin(d - p) = a with tan p = a / W^2. The largest acceleration is
    W^2 k / sqrt(1 - k^2), at cos d = -k, just beyond 90 degrees, where the blade lies along the body: W^2 k there.
    """
    _, S, I = blade_moments(rotor, length)  # noqa: E741
    k = rotor.offset * S / I
    if rate == 0.0 and acceleration == 0.0:
        raise InputError("rate is 0 rad/s and acceleration is 0 rad/s2, with which any lag is one of rest; give either")
    sine = acceleration / (k * math.hypot(rate**2, acceleration))
    return math.atan2(acceleration, rate**2) + math.asin(sine) if abs(sine) <= 1.0 else math.nan


def slow_torque_limit(rotor: Rotor, length: float, rate: float) -> float:
    """Torque on the body at which the steady lag of rigid blades reaches 90 degrees, N m.

    Parameters
    ----------
    rotor : Rotor, the body and its blades
    length : float, m, length of a blade
    rate : float, rad/s, spin W of body and blades

    Returns
    -------
    float, N m

    Notes
    -----
    The acceleration W^2 k of `spin_up_lag` at d = 90 degrees times the inertia there: W^2 k (J + N (M L0^2 + I)). For a
    torque that grows slowly, beside the period of the lag, while W has not grown yet.
    """
    _, S, I = blade_moments(rotor, length)  # noqa: E741
    return rate**2 * rotor.offset * S / I * rotor_inertia(rotor, length, 0.5 * math.pi)


def step_acceleration_limit(rotor: Rotor, length: float, rate: float) -> float:
    """Angular acceleration, applied at once, with which the lag just reaches 90 degrees, rad/s2; W taken as constant.

    Parameters
    ----------
    rotor : Rotor, the body and its blades
    length : float, m, length of a blade
    rate : float, rad/s, spin W of body and blades

    Returns
    -------
    float, rad/s2

    Notes
    -----
    From I d'' = a (I + L0 S cos d) - W^2 L0 S sin d the energy integral d'^2 / 2 = a (d + k sin d) - W^2 k (1 - cos d)
    vanishes at 90 degrees for a = W^2 k / (pi/2 + k). `step_torque_limit` tends to J a for a heavy body and L0 << l:
    during a swing W grows by a share of the order of sqrt(k).
    """
    _, S, I = blade_moments(rotor, length)  # noqa: E741
    k = rotor.offset * S / I
    return rate**2 * k / (0.5 * math.pi + k)


def spin_up_swing(
    rotor: Rotor, length: float, torque: float, rate: float, *, ramp: float = 0.0, until: float | None = None
) -> tuple[Array, Array, Array]:
    """Rigid blades after a torque has been applied to their body, from straight blades on: two degrees of freedom.

    Parameters
    ----------
    rotor : Rotor, the body and its blades
    length : float, m, length of a blade
    torque : float, N m, on the body
    rate : float, rad/s, of body and blades at the start
    ramp : float, s, over which the torque grows as 3 s^2 - 2 s^3
    until : float, s, end of the motion; after the ramp one period of `lag_frequency` if left out, which a rate of 0
        does not have

    Returns
    -------
    time, lag, rate : (nt,) float, s, rad and rad/s, of the body; up to a lag of `WOUND_LAG`

    Raises
    ------
    InputError
        If the rate is 0 and `until` is left out.

    Notes
    -----
    With the angles p of the body and b = p - d of a blade, and the torque Q, Lagrange's equations are

        (J/N + M L0^2) p'' + L0 S (b'' cos d + b'^2 sin d) = Q/N,   I b'' + L0 S (p'' cos d - p'^2 sin d) = 0
    """
    M, S, I = blade_moments(rotor, length)  # noqa: E741
    LS, B = rotor.offset * S, rotor.inertia / rotor.blades + M * rotor.offset**2
    if until is None and rate == 0.0:
        raise InputError("rate is 0 rad/s, with which the lag has no period that ends the motion; give until")
    end = ramp + 2.0 * math.pi / lag_frequency(rotor, length, rate) if until is None else until

    def rates(t: float, y: Array) -> list[float]:
        s = min(t / ramp, 1.0) if ramp > 0.0 else 1.0
        grown = s * s * (3.0 - 2.0 * s)
        lag, spin, blade = y[0] - y[1], y[2], y[3]
        c, sine = LS * math.cos(lag), LS * math.sin(lag)
        f, g = torque * grown / rotor.blades - sine * blade**2, sine * spin**2
        D = B * I - c * c
        return [spin, blade, (I * f - c * g) / D, (B * g - c * f) / D]

    def wound(_: float, y: Array) -> float:
        return float(y[0] - y[1] - WOUND_LAG)

    wound.terminal = True  # type: ignore[attr-defined]
    begin = [0.0, 0.0, rate, rate]
    found = scipy.integrate.solve_ivp(
        rates, (0.0, end), begin, "DOP853", events=wound, rtol=1e-8, atol=1e-11, dense_output=True
    )
    time = np.linspace(0.0, float(found.t[-1]), 2001)
    y = found.sol(time)
    return time, y[0] - y[1], y[2]


def step_torque_limit(rotor: Rotor, length: float, rate: float, *, ramp: float = 0.0) -> float:
    """Largest torque on the body with which the lag of rigid blades stays below 90 degrees, N m, by `spin_up_swing`.

    Parameters
    ----------
    rotor : Rotor, the body and its blades
    length : float, m, length of a blade
    rate : float, rad/s, of body and blades at the start
    ramp : float, s, over which the torque grows; 0 applies it at once

    Returns
    -------
    float
        Infinite where no torque up to 64 times the `slow_torque_limit` reaches 90 degrees; 0 without spin, to which
        it tends as the square of the rate: the period of the lag then is long beside any ramp.
    """
    if rate == 0.0:
        return 0.0

    def over(torque: float) -> float:
        return float(spin_up_swing(rotor, length, torque, rate, ramp=ramp)[1].max()) - 0.5 * math.pi

    low = high = 0.5 * slow_torque_limit(rotor, length, rate)
    while over(low) > 0.0:
        low *= 0.5
    for _ in range(MOST_DOUBLINGS):
        if over(high) > 0.0:
            return float(scipy.optimize.brentq(over, low, high, rtol=1e-6))
        low, high = high, 2.0 * high
    return math.inf
