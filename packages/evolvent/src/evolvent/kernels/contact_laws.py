"""Forces of a contact over an interval: normal laws and friction that sticks, with their energies and derivatives.

A gap is positive outside and negative where bodies overlap; a normal n points from the obstacle to the point, so that
a force f >= 0 pushes the point by f n. An interval of length 0 is a state. With rate = n . v, the derivatives of its
force f n by the point's position x and velocity v are

    f_gap n n^T + f_rate n (H v)^T + f H    and    f_rate n n^T,      H = d2 gap / dx2.

Over a step of length h that conserves energy, with V = K <delta>^(n + 1)/(n + 1), the contact's energy, its damping d,
and the rate (delta1 - delta0)/h

    lam = (V1 - V0)/(delta1 - delta0) (1 + d rate)+     does the work of V's change, less what the damping takes;
    lam = K <delta1>^n (1 + d rate)+                    the force of the step's end, never gives back more than V.

A point in contact at the step's start has the first, which is of second order; one that meets the surface has the
second under the law HUNT_CROSSLEY, which is easier to solve and makes a bounce shorter than the step partly plastic,
and the first under CONSERVATIVE. PAPER's damper takes c (delta1 - delta0)/h, depths of points outside being 0: what it
takes is never below 0, and its force does not jump.

Contact points of beams and contacts between bodies are records with the same fields. Of the step's start: gap, stick
(bristle), drag (friction), damper; of its end those with 1. The bristle's axes are fixed to the obstacle.
"""

import math

from evolvent.compiled.jit import inlined
from evolvent.model import having, not_negative

#: Normal laws: of the paper; Hunt-Crossley; elastic work equal to the change of energy over a step.
PAPER, HUNT_CROSSLEY, CONSERVATIVE = 0, 1, 2
#: What functions of contacts are used for, and those of turns of beams that lie on one another.
CONTACTS, TURNS = ("contact_surfaces", "body_contacts"), having("contact_surfaces", under=not_negative)
#: Depth of a contact, of the radius, at which the bound of the explicit step takes its stiffness.
DEPTH = 1e-3

# ------------------------------------------------------------------------------------------------ normal laws


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
def mean_force(gap0, gap1, stiffness, exponent):
    """(V1 - V0)/(delta1 - delta0), N, and its derivative by gap1; infinite gaps are outside.

    The mean of the elastic force between both ends of a step, inside or outside, whose work is the change of V. A point
    that was beyond the end of the obstacle counts as one that was at its surface.
    """
    mean, slope = _mean_power(-gap0, -gap1, exponent)
    return stiffness * mean, -stiffness * slope


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
def normal_force(law, gap, rate, gap_before, stiffness, exponent, damping, viscous):
    """Force of a state that pushes a point out of an obstacle; of CONSERVATIVE, a law of steps, that of HUNT_CROSSLEY.

    Parameters
    ----------
    law : int, PAPER, HUNT_CROSSLEY or CONSERVATIVE
    gap, rate : float, m and m/s
    gap_before, viscous : float, of `sliding_damper`
    stiffness : float, K, N/m^n
    exponent : float, n >= 1
    damping : float, c in N s/m for PAPER, d in s/m for the others

    Returns
    -------
    force : float, N, never negative but for PAPER
    d_gap : float, N/m, derivative by `gap`
    d_rate : float, N s/m, derivative by `rate`

    Notes
    -----
    With delta = -gap, beside the sliding damper:

    - PAPER, K delta^n + c delta' (Yi et al., 2017): jumps by c delta' at the first touch, and pulls before it parts.
    - HUNT_CROSSLEY, K delta^n (1 + d delta') (Hunt & Crossley, 1975), not below zero: its derivatives jump where it is
      clipped.
    """
    elastic, slope = elastic_force(gap, stiffness, exponent)
    drag, drag_rate = sliding_damper(gap_before, gap, rate, stiffness, exponent, viscous)
    if law == PAPER:
        if gap >= 0.0:
            return 0.0, 0.0, 0.0
        return elastic - damping * rate + drag, slope, drag_rate - damping
    force = elastic * (-damping * rate) + elastic
    if not (force > 0.0 and force + drag > 0.0):
        return 0.0, 0.0, 0.0
    return force + drag, slope * (-damping * rate) + slope, drag_rate - damping * elastic


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
def tangential(v, n):
    """The part of a vector across n: for displacements, and for the state of `friction` when the normal has turned."""
    along = v[0] * n[0] + v[1] * n[1] + v[2] * n[2]
    return v[0] - along * n[0], v[1] - along * n[1], v[2] - along * n[2]


@inlined
def friction(u, s, normal, coefficient, stiffness, damping, step):
    """Friction of a bristle that sticks or slips, with its state at the end of a step.

    Parameters
    ----------
    u : (3 floats) m, elastic displacement of the bristle at the beginning of the step, across the normal
    s : (3 floats) m, displacement of the point against the obstacle during the step, across the normal
    normal : float, N, normal force
    coefficient : float, mu
    stiffness : float, k, N/m, of the bristle
    damping : float, c, N s/m, of the bristle's own rate
    step : float, h, s; only read where `damping` is not zero

    Returns
    -------
    f : (3 floats) N, force on the point
    u : (3 floats) m, the state at the end
    slipping : bool
    t : (3 floats) direction of the trial force
    along, across : float, N/m: dF/ds = -(along t t^T + across (I - n n^T - t t^T))
    by_normal : float: dF/dN = -by_normal t

    Notes
    -----
    Return mapping, with K = k + c/h and the trial force T = k (u + s) + c s/h: where |T| <= mu N the bristle takes all
    of s, F = -T; else the point slips by (|T| - mu N) / K along t = T/|T|, and F = -mu N t. A stuck bristle is an
    elastic spring whose state is not touched: it cannot creep. Its energy is k u^2 / 2; without a normal force it is
    released. Over a step -F . s = change of energy + mu N times the slip + (c/h + k/2) |u1 - u0|^2, where
    k/2 |u1 - u0|^2 comes from taking the force at the step's end; balances take the mean of both ends (`end_point`).
    """
    zero = (0.0, 0.0, 0.0)
    if not normal > 0.0:
        return zero, zero, True, zero, 0.0, 0.0, 0.0
    K = bristle_slope(stiffness, damping, step)
    x, y, z = stiffness * u[0] + K * s[0], stiffness * u[1] + K * s[1], stiffness * u[2] + K * s[2]
    trial, limit = math.sqrt(x * x + y * y + z * z), coefficient * normal
    scale = 1.0 / trial if trial > 0.0 else 0.0
    t = (x * scale, y * scale, z * scale)
    if trial <= limit:
        return (-x, -y, -z), (u[0] + s[0], u[1] + s[1], u[2] + s[2]), False, t, K, K, 0.0
    slip = (trial - limit) / K
    after = (u[0] + s[0] - slip * t[0], u[1] + s[1] - slip * t[1], u[2] + s[2] - slip * t[2])
    return (-limit * t[0], -limit * t[1], -limit * t[2]), after, True, t, 0.0, limit * K * scale, coefficient


@inlined
def bristle_slope(stiffness, damping, step):
    """k + c/h, N/m, of a bristle over a step."""
    return stiffness + (damping / step if damping != 0.0 else 0.0)


# ------------------------------------------------------------------------------------------------ over an interval


@inlined
def clear_point(point):
    """Clear what a contact has of its last forces."""
    point.force, point.along, point.across, point.by_normal, point.damper1 = 0.0, 0.0, 0.0, 0.0, 0.0
    d, q = point.drag1, point.stick1
    for i in range(3):
        d[i] = q[i] = 0.0


@inlined
def depths(point, h):
    """Gaps of a contact point's law over an interval: those of a step less the depth that the point keeps, `rest`."""
    if h == 0.0:
        return point.gap, point.gap1
    point.rest1 = max(-point.gap1, 0.0)
    if not math.isfinite(point.gap):  # arrives
        return point.gap + point.rest, math.inf
    point.rest1 = min(point.rest, point.rest1)
    return point.gap + point.rest, point.gap1 + point.rest


@inlined
def press(point, row, gap0, gap1, rate, h, soft, chi, ratio):
    """Normal force over an interval (N), into the contact with its derivatives, and the part of it that filters (N).

    Parameters
    ----------
    row : record with the law
    gap0, gap1 : float, m, at both ends; rate : float, m/s, of a state
    h : float, s, 0 of a state
    soft, chi, ratio : float, of a step: factor of the stiffness; filter chi and ratio r of `equations.energy_momentum`
    """
    d_rate = filtered = 0.0
    if h == 0.0:
        force, d_gap, d_rate = normal_force(
            row.law, gap1, rate, gap0, row.stiffness, row.exponent, row.damping, point.viscous
        )
        point.damper1 = force - elastic_force(gap1, row.stiffness, row.exponent)[0]
    else:
        force, d_gap, filtered = _step_force(row, point.viscous, gap0, gap1, h, soft, chi, ratio * point.sank)
    point.force, point.d_gap, point.d_rate = force, d_gap, d_rate
    return force, filtered


@inlined
def _step_force(row, viscous, gap0, gap1, h, soft, chi, sank):
    """Normal force over a step, its derivative by the gap at the end, and the filter's part of it.

    Parameters
    ----------
    viscous : float, kg^(1/2), of `sliding_damper`
    chi, sank : float, of the filter, and how far the point sank over the step before, of this step's length, m
    """
    stiffness, exponent, stays, none = soft * row.stiffness, row.exponent, math.isfinite(gap0), (0.0, 0.0, 0.0)
    if gap0 < 0.0 or row.law == CONSERVATIVE:
        elastic, slope = mean_force(gap0, gap1, stiffness, exponent)
    else:
        elastic, slope = elastic_force(gap1, stiffness, exponent)
    drag = d_rate = filtered = 0.0
    if viscous != 0.0 and stays:
        drag, d_rate = sliding_damper(gap0, gap1, (gap1 - gap0) / h, stiffness, exponent, viscous)
    if row.law == PAPER:  # by the change of the depth, which does not jump where the point arrives
        if not math.isfinite(gap1):  # it has slid past the edge of the surface
            return none
        if stays:
            elastic += drag + row.damping / h * (min(gap0, 0.0) - min(gap1, 0.0))
            slope += (d_rate - (row.damping if gap1 < 0.0 else 0.0)) / h
        return elastic, slope, 0.0
    if row.damping != 0.0 and elastic != 0.0 and stays:
        factor = 1.0 + row.damping * (gap0 - gap1) / h
        if not factor > 0.0:
            return none
        elastic, slope = elastic * factor, slope * factor - elastic * row.damping / h
    elastic, slope = elastic + drag, slope + d_rate / h
    if drag != 0.0 and elastic <= 0.0:
        return none
    if is_filtered(row, gap0):
        # the change of the depth, whose work is exact also where the point leaves
        part = 1.0 if gap1 < 0.0 else gap0 / (gap0 - gap1)
        k = 0.5 * chi * stiffness
        filtered = k * part * (gap0 - min(gap1, 0.0) - sank)
        if elastic + filtered <= 0.0:
            return none
        elastic, slope = elastic + filtered, slope - (k if gap1 < 0.0 else filtered / (gap1 - gap0))
    return elastic, slope, filtered


@inlined
def is_filtered(row, gap0):
    """Whether the filter acts on a point: one that is in contact, with a stiffness that is a constant."""
    return row.law == HUNT_CROSSLEY and row.exponent == 1.0 and gap0 < 0.0


@inlined
def from_axes(axes, q):
    """Vector with the components q along three axes."""
    a, b, c = axes
    return (
        a[0] * q[0] + b[0] * q[1] + c[0] * q[2],
        a[1] * q[0] + b[1] * q[1] + c[1] * q[2],
        a[2] * q[0] + b[2] * q[1] + c[2] * q[2],
    )


@inlined
def into_axes(axes, v):
    """Components of a vector along three axes."""
    a, b, c = axes
    return (
        a[0] * v[0] + a[1] * v[1] + a[2] * v[2],
        b[0] * v[0] + b[1] * v[1] + b[2] * v[2],
        c[0] * v[0] + c[1] * v[1] + c[2] * v[2],
    )


@inlined
def body_axes(R):
    """Axes of a body, the columns of its rotation matrix (of a step: of the mean of both ends)."""
    return (R[0, 0], R[1, 0], R[2, 0]), (R[0, 1], R[1, 1], R[2, 1]), (R[0, 2], R[1, 2], R[2, 2])


@inlined
def rub(y, at, point, row, axes, n, s, v, normal, step):
    """Friction on a contact over an interval, what its slip takes, the energy of its bristle, and its displacement.

    Parameters
    ----------
    y, at : the bristle at the start stands in the state at `at` >= 0, else in the contact
    axes, n : of the bristle, and the unit normal, inertial axes
    s : m, displacement over the step; v : m/s, velocity, which damps a bristle that sticks where `step` is infinite:
        within an explicit step; of both the part across n counts
    normal : float, N; step : float, s, length of the step that ends here, 0 or less without one

    Returns
    -------
    f, slip, held : force (N, inertial axes), J, J
    slide : m, displacement across n in the bristle's axes

    Notes
    -----
    The force is that of the step's end, and never gives back more than the bristle's energy.
    """
    damping, q = row.bristle_damping if step > 0.0 else 0.0, point.stick
    bristle = (y[at], y[at + 1], y[at + 2]) if at >= 0 else (q[0], q[1], q[2])
    u, slid = from_axes(axes, bristle), tangential(s, n)
    f, u1, slipping, t, along, across, by_normal = friction(
        tangential(u, n), slid, normal, row.friction, row.bristle_stiffness, damping, step
    )
    if row.bristle_damping > 0.0 and step == math.inf and not slipping:
        c, limit, v = row.bristle_damping, row.friction * normal, tangential(v, n)
        f = (f[0] - c * v[0], f[1] - c * v[1], f[2] - c * v[2])
        size = math.sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2])
        scale = limit / size if size > limit else 1.0
        f = (scale * f[0], scale * f[1], scale * f[2])
    before, q1, d, way = bristle_energy(point, row), point.stick1, point.drag1, point.t
    q1[0], q1[1], q1[2] = into_axes(axes, u1)
    d[0], d[1], d[2] = into_axes(axes, f)
    way[0], way[1], way[2] = t
    point.along, point.across, point.by_normal = along, across, by_normal
    K = bristle_slope(row.bristle_stiffness, damping, step)
    share = row.bristle_stiffness / K if K > 0.0 else 0.0
    point.tilt = n[0] * (s[0] + share * u[0]) + n[1] * (s[1] + share * u[1]) + n[2] * (s[2] + share * u[2])
    after = 0.5 * row.bristle_stiffness * (q1[0] * q1[0] + q1[1] * q1[1] + q1[2] * q1[2])
    work = f[0] * slid[0] + f[1] * slid[1] + f[2] * slid[2]
    return f, -work - (after - before), after, into_axes(axes, slid)


@inlined
def drag_slope(point, i, j):
    """-d(friction)_i/ds_j of a contact at a constant normal force, N/m."""
    n, t = point.n, point.t
    square, tt = n[0] * n[0] + n[1] * n[1] + n[2] * n[2], t[i] * t[j]
    return point.along * tt + point.across * ((1.0 if i == j else 0.0) - n[i] * n[j] / square - tt)


@inlined
def normal_slope(point, slope, g, i, j):
    """-d(force)_i/ds_j of a contact by its normal force, which changes by slope g, and by the friction that follows."""
    return -slope * (point.n[i] - point.by_normal * point.t[i]) * g[j]


@inlined
def slope_by(point, slope, g, i, j):
    """-d(force)_i/ds_j of a contact whose normal stays, N/m."""
    return drag_slope(point, i, j) + normal_slope(point, slope, g, i, j)


@inlined
def bristle_energy(point, row):
    """Energy of a bristle at the start of a step, J."""
    q = point.stick
    return 0.5 * row.bristle_stiffness * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2])


@inlined
def end_point(point, row, gap0, gap1, slide):
    """Make the end of a step the start of the next; what friction and normal damping took by mean forces (J, J).

    Parameters
    ----------
    gap0, gap1 : float, m, of the step's law; slide : displacement over the step, m, in the bristle's axes

    Notes
    -----
    Of forces at states friction takes their work over the step less what the bristles keep, -F . s - (U1 - U0), with
    the mean F of both ends as of the work of all else: with the force of the end alone the energy balance would gain in
    proportion to the step. A step that conserves energy has its own balance (`press`, `rub`).
    """
    slip = damped = 0.0
    point.sank = gap0 - gap1 if is_filtered(row, gap0) and gap1 < 0.0 else 0.0
    if math.isfinite(gap0) and math.isfinite(gap1):
        damped = -0.5 * (point.damper + point.damper1) * (gap1 - gap0)
    point.gap, point.damper = point.gap1, point.damper1
    half, u, u1, d, d1 = 0.5 * row.bristle_stiffness, point.stick, point.stick1, point.drag, point.drag1
    for i in range(3):
        slip -= 0.5 * (d[i] + d1[i]) * slide[i]
        new = u1[i] if point.force > 0.0 else 0.0
        slip += half * (u[i] * u[i] - new * new)
        u[i], d[i] = new, d1[i]
    return slip, damped


def bound_of(row, radius):
    """Stiffness (N/m) and damping (N s/m) of a contact for the bound of the explicit step. Not compiled.

    Of laws with an exponent above 1 the stiffness is that at the depth `DEPTH`; radius : str, name of its field.
    """
    stiffness = row["exponent"] * row["stiffness"] * (DEPTH * row[radius]) ** (row["exponent"] - 1.0)
    damping = row["damping"] if row["law"] == PAPER else 0.0
    if row["friction"] > 0.0:
        stiffness, damping = max(stiffness, row["bristle_stiffness"]), max(damping, row["bristle_damping"])
    return stiffness, damping
