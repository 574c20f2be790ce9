"""Contact of points: gaps, normal laws and friction that sticks, each with its energy and its derivatives.

A gap is positive outside and negative where bodies overlap; a normal n points from the obstacle to the point, so that
a force f >= 0 pushes the point by f n. With rate = n . v, the derivatives of f n by the point's position x and
velocity v are

    f_gap n n^T + f_rate n (H v)^T + f H    and    f_rate n n^T,      H = d2 gap / dx2.
"""

import math

from evolvent.compiled.jit import inlined

#: Normal laws: of the paper; Hunt-Crossley; elastic work equal to the change of energy over a step.
PAPER, HUNT_CROSSLEY, CONSERVATIVE = 0, 1, 2

# ------------------------------------------------------------------------------------------------ gaps


@inlined
def may_touch(x, y, z, reach, cx, cy, cz, ax, ay, az, radius, half_length):
    """Whether any point within `reach` (m) of (x, y, z) may touch the cylinder of `cylinder_gap`: the coarse test.

    Never False where one does, to round-off.
    """
    dx, dy, dz = x - cx, y - cy, z - cz
    along = dx * ax + dy * ay + dz * az
    if abs(along) > half_length + reach:
        return False
    px, py, pz = dx - along * ax, dy - along * ay, dz - along * az
    limit = radius + reach
    return px * px + py * py + pz * pz <= limit * limit


@inlined
def cylinder_gap(x, y, z, cx, cy, cz, ax, ay, az, radius, half_length):
    """Gap between a point and a cylinder's surface.

    Parameters
    ----------
    x, y, z : float, m, the point
    cx, cy, cz : float, m, the middle of the cylinder
    ax, ay, az : float, its axis, a unit vector
    radius, half_length : float, m; `half_length` may be infinite

    Returns
    -------
    gap : float, m, negative inside, infinite beyond the ends
    nx, ny, nz : float, d gap / dx, the unit vector from the axis to the point; zero on the axis
    distance : float, m, from the axis

    Notes
    -----
    The ends do not push: a point that passes one in contact loses its contact energy.
    """
    dx, dy, dz = x - cx, y - cy, z - cz
    along = dx * ax + dy * ay + dz * az
    px, py, pz = dx - along * ax, dy - along * ay, dz - along * az
    distance = math.sqrt(px * px + py * py + pz * pz)
    scale = 1.0 / distance if distance > 0.0 else 0.0
    gap = distance - radius if abs(along) <= half_length else math.inf
    return gap, px * scale, py * scale, pz * scale, distance


@inlined
def cylinder_curvature(nx, ny, nz, ax, ay, az, distance):
    """H = d2 gap / dx2 = (I - n n^T - a a^T) / distance, 1/m: (xx, yy, zz, xy, xz, yz)."""
    f = 1.0 / distance if distance > 0.0 else 0.0
    return (
        f * (1.0 - nx * nx - ax * ax),
        f * (1.0 - ny * ny - ay * ay),
        f * (1.0 - nz * nz - az * az),
        f * (-nx * ny - ax * ay),
        f * (-nx * nz - ax * az),
        f * (-ny * nz - ay * az),
    )


@inlined
def point_position(y, at, S):
    """Position (or velocity) of a contact point of a beam, S . (the four vectors at `at`)."""
    return (
        S[0] * y[at[0]] + S[1] * y[at[1]] + S[2] * y[at[2]] + S[3] * y[at[3]],
        S[0] * y[at[0] + 1] + S[1] * y[at[1] + 1] + S[2] * y[at[2] + 1] + S[3] * y[at[3] + 1],
        S[0] * y[at[0] + 2] + S[1] * y[at[1] + 2] + S[2] * y[at[2] + 2] + S[3] * y[at[3] + 2],
    )


# ------------------------------------------------------------------------------------------------ normal laws


@inlined
def clear_point(point):
    """Clear what a contact point holds of the step's end."""
    point.force, point.along, point.across, point.by_normal = 0.0, 0.0, 0.0, 0.0
    point.damper1, point.gap1 = 0.0, math.inf
    d = point.drag1
    d[0] = d[1] = d[2] = 0.0


@inlined
def _power(x, n):
    """x^n; of the usual exponent 1, and of its integral, without the call that took 6 % of a contact's time."""
    if n == 1.0:
        return x
    if n == 2.0:
        return x * x
    return x**n


@inlined
def contact_energy(gap, stiffness, exponent):
    """V = K delta^(n + 1) / (n + 1), J, of the penetration delta = max(-gap, 0)."""
    return stiffness * _power(-gap, exponent + 1.0) / (exponent + 1.0) if gap < 0.0 else 0.0


@inlined
def elastic_force(gap, stiffness, exponent):
    """K delta^n = -dV/d gap, N, and its derivative by the gap."""
    if gap >= 0.0:
        return 0.0, 0.0
    force = stiffness * _power(-gap, exponent)
    return force, exponent * force / gap


@inlined
def normal_force(law, gap, rate, gap_before, stiffness, exponent, damping):
    """Force that pushes a point out of an obstacle.

    Parameters
    ----------
    law : int, PAPER, HUNT_CROSSLEY or CONSERVATIVE
    gap, rate : float, m and m/s, at the end of the step
    gap_before : float, m, at its beginning; only CONSERVATIVE reads it
    stiffness : float, K, N/m^n
    exponent : float, n >= 1
    damping : float, c in N s/m for PAPER, d in s/m for the others

    Returns
    -------
    force : float, N, never negative but for PAPER
    d_gap : float, N/m, derivative by `gap` at a fixed `gap_before`
    d_rate : float, N s/m, derivative by `rate`

    Notes
    -----
    With delta = -gap:

    - PAPER, K delta^n + c delta' (Yi et al., 2017): jumps by c delta' at the first touch, and pulls before it parts.
    - HUNT_CROSSLEY, K delta^n (1 + d delta') (Hunt & Crossley, 1975), not below zero.
    - CONSERVATIVE, (V1 - V0) / (delta1 - delta0) + K delta1^n d delta1', not below zero: the mean of the elastic force
      between the step's two ends, inside or outside, so that its work over the step is the change of V. The damping
      takes energy out of every step for sure where `rate` is that of the step, (gap - gap_before) / h. A point that was
      beyond the end of the obstacle counts as one that was at its surface.

    Only the damping of PAPER jumps; the derivatives of HUNT_CROSSLEY and CONSERVATIVE jump where the force is clipped.
    """
    elastic, slope = elastic_force(gap, stiffness, exponent)
    if law == PAPER:
        if gap >= 0.0:
            return 0.0, 0.0, 0.0
        return elastic - damping * rate, slope, -damping
    force = elastic * (-damping * rate)
    d_gap = slope * (-damping * rate)
    d_rate = -damping * elastic
    if law == CONSERVATIVE:
        mean, d_mean = _mean_power(-gap_before, -gap, exponent)
        force += stiffness * mean
        d_gap -= stiffness * d_mean
    else:
        force += elastic
        d_gap += slope
    if not force > 0.0:
        return 0.0, 0.0, 0.0
    return force, d_gap, d_rate


@inlined
def sliding_damper(gap_before, gap, rate, stiffness, exponent, viscous):
    """Force by which the normal motion of a point that can slide is damped, and its derivative by the rate.

    Parameters
    ----------
    gap_before, gap, rate : float, m and m/s, at the beginning and the end of a step, and at its end
    viscous : float, kg^(1/2), 2 zeta sqrt(m) of the share zeta of critical damping, and the point's mass m; or 0

    Notes
    -----
    -c rate with c = viscous sqrt(-d f/d gap) by the depth at the step's beginning, where the point is in contact: a
    first touch is no jump. Where the point parts, the whole force is clipped before that. Friction alone makes
    sliding unstable: it couples the normal and the axial motion of the points by forces without a potential, and two
    modes of near frequencies draw energy from the sliding (Hoffmann et al., Mech. Res. Commun. 29 (2002), 197-205).
    """
    if viscous == 0.0 or not (gap_before < 0.0 and gap < 0.0):
        return 0.0, 0.0
    c = viscous * math.sqrt(-elastic_force(gap_before, stiffness, exponent)[1])
    return -c * rate, -c


@inlined
def pushing_force(law, gap, rate, gap_before, stiffness, exponent, damping, viscous):
    """Normal force of a point at the end of a step that began at `gap_before`, as `normal_force` returns it.

    Of CONSERVATIVE, which takes the mean over a step, that of HUNT_CROSSLEY; with `sliding_damper`.
    """
    law = HUNT_CROSSLEY if law == CONSERVATIVE else law
    force, d_gap, d_rate = normal_force(law, gap, rate, gap, stiffness, exponent, damping)
    drag, drag_rate = sliding_damper(gap_before, gap, rate, stiffness, exponent, viscous)
    if law != PAPER and not force + drag > 0.0:
        return 0.0, 0.0, 0.0
    return force + drag, d_gap, d_rate + drag_rate


def sliding_viscosity(share, mass):
    """`viscous` of `sliding_damper`, kg^(1/2), by the share of critical damping and the mass of the point, kg."""
    return 2.0 * share * math.sqrt(mass)


@inlined
def _mean_power(a, b, n):
    """Mean of max(s, 0)^n for s between a and b, and its derivative by b."""
    if (a <= 0.0 and b <= 0.0) or b == -math.inf:
        return 0.0, 0.0
    if a == -math.inf:
        a = 0.0
    middle, half = 0.5 * (a + b), 0.5 * (b - a)
    if abs(half) > 0.1 * middle:
        before = _power(a, n) if a > 0.0 else 0.0
        after = _power(b, n) if b > 0.0 else 0.0
        mean = (after * b - before * a) / ((n + 1.0) * (b - a))
        return mean, (after - mean) / (b - a)
    # nearby ends would cancel: the sum over i of binomial(n + 1, 2 i + 1) e^(2 i) / (n + 1), times middle^n
    e = half / middle
    term, total, derivative = 1.0, 1.0, 0.0
    for i in range(7):
        term *= (n - 2 * i) * (n - 2 * i - 1) / ((2 * i + 2) * (2 * i + 3)) * e
        derivative += (2 * i + 2) * term
        term *= e
        total += term
    power = _power(middle, n)
    return power * total, 0.5 * power / middle * (n * total + derivative * (1.0 - e))


# ------------------------------------------------------------------------------------------------ friction


@inlined
def tangential(x, y, z, nx, ny, nz):
    """The part of a vector across n: for displacements, and for the state of `friction` when the normal has turned."""
    along = x * nx + y * ny + z * nz
    return x - along * nx, y - along * ny, z - along * nz


@inlined
def friction(ux, uy, uz, sx, sy, sz, normal, coefficient, stiffness, damping, step):
    """Friction of a bristle that sticks or slips, with its state at the end of a step.

    Parameters
    ----------
    ux, uy, uz : float, m, elastic displacement u of the bristle at the beginning of the step, across the normal
    sx, sy, sz : float, m, displacement s of the point against the obstacle during the step, across the normal
    normal : float, N, normal force
    coefficient : float, mu
    stiffness : float, k, N/m, of the bristle
    damping : float, c, N s/m, of the bristle's own rate
    step : float, h, s; only read where `damping` is not zero

    Returns
    -------
    fx, fy, fz : float, N, force on the point
    ux, uy, uz : float, m, the state at the end
    slipping : bool
    dissipated : float, J, work of the slip, mu N times its length
    tx, ty, tz : float, direction t of the trial force
    along, across : float, N/m: dF/ds = -(along t t^T + across (I - n n^T - t t^T))
    by_normal : float: dF/dN = -by_normal t

    Notes
    -----
    Return mapping, with K = k + c/h and the trial force T = k (u + s) + c s/h: where |T| <= mu N the bristle takes all
    of s, F = -T; else the point slips by (|T| - mu N) / K along t = T/|T|, and F = -mu N t. A stuck bristle is an
    elastic spring whose state is not touched: it cannot creep. Its energy is k u^2 / 2; without a normal force it lets
    go. Over a step -F . s = change of energy + dissipated + (c/h + k/2) |u1 - u0|^2, where k/2 |u1 - u0|^2 comes from
    taking the force at the step's end; accounts take the mean of both ends (`touch.end_contact_step`).
    """
    if not normal > 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, True, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    K = stiffness + (damping / step if damping != 0.0 else 0.0)
    x = stiffness * ux + K * sx
    y = stiffness * uy + K * sy
    z = stiffness * uz + K * sz
    trial, limit = math.sqrt(x * x + y * y + z * z), coefficient * normal
    scale = 1.0 / trial if trial > 0.0 else 0.0
    tx, ty, tz = x * scale, y * scale, z * scale
    if trial <= limit:
        return -x, -y, -z, ux + sx, uy + sy, uz + sz, False, 0.0, tx, ty, tz, K, K, 0.0
    slip = (trial - limit) / K
    return (
        -limit * tx,
        -limit * ty,
        -limit * tz,
        ux + sx - slip * tx,
        uy + sy - slip * ty,
        uz + sz - slip * tz,
        True,
        limit * slip,
        tx,
        ty,
        tz,
        0.0,
        limit * K * scale,
        coefficient,
    )
