"""Derivatives of users' laws: by dual numbers (`evolvent.compiled.dual`), exact to round-off.

A law that calls what dual numbers cannot pass (a function compiled for floats alone, linear algebra, interpolation) has
none: it is differentiated by central differences with the steps below, and a warning names it (`compiled.laws`). Their
error is about 1e-10 of the law's size. Expressions have exact derivatives always, and so has what the package itself
evaluates. Under NUMBA_DISABLE_JIT there are no dual numbers.
"""

from evolvent.compiled.jit import inlined, kernel
from evolvent.compiled.lookups import (
    element_law_at,
    element_slope_at,
    force_law_at,
    force_slope_at,
    has_slope,
    spring_law_at,
    spring_slope_at,
)
from evolvent.compiled.views import local_vector

#: Steps of central differences, in parts of a quantity or of its size: of laws of few numbers, of laws between points.
STEP, ELEMENT_STEP = 1e-6, 1e-5


@kernel
def spring_law_slope(law, x, dx, v, dv, t, p, size):
    """Derivative of the law of a spring or a motor along (dx, dv) of x and v; `size` of both for differences."""
    if has_slope(law):
        return spring_slope_at(law)(x, dx, v, dv, t, p)
    slope = 0.0
    if dx != 0.0:
        d = STEP * max(size, abs(x))
        slope += dx * (spring_law_at(law)(x + d, v, t, p) - spring_law_at(law)(x - d, v, t, p)) / (2.0 * d)
    if dv != 0.0:
        d = STEP * max(size, abs(v))
        slope += dv * (spring_law_at(law)(x, v + d, t, p) - spring_law_at(law)(x, v - d, t, p)) / (2.0 * d)
    return slope


@inlined
def _force_difference(law, p, t, x, v, of, c):
    """Derivative of a force law by of[c], where `of` is x or v: three floats."""
    kept = of[c]
    step = STEP * (1.0 + abs(kept))
    of[c] = kept + step
    fx, fy, fz = force_law_at(law)(x, v, t, p)
    high = of[c]
    of[c] = kept - step
    gx, gy, gz = force_law_at(law)(x, v, t, p)
    scale = 1.0 / (high - of[c])
    of[c] = kept
    return scale * (fx - gx), scale * (fy - gy), scale * (fz - gz)


@inlined
def _seeds(d, x, v):
    """Values of x and v in the scratch d with derivatives that are zero, as laws for dual numbers take them."""
    n = x.size
    dx, dv = d[0 : 2 * n], d[2 * n : 2 * n + 6]
    for c in range(n):
        dx[2 * c], dx[2 * c + 1] = x[c], 0.0
    for c in range(3):
        dv[2 * c], dv[2 * c + 1] = v[c], 0.0
    return dx, dv


@kernel
def torque_law_turns(law, p, t, x, v, A, row):
    """A[row : row + 3, :3] = derivative of a torque's law by a turn of its body about the inertial axes.

    Parameters
    ----------
    x : (12,) float, position and rotation matrix R, row after row; dR = e x R of a turn about e
    """
    d, e = local_vector(), local_vector()
    dx, dv = _seeds(d, x, v)
    for c in range(3):
        i, j = (c + 1) % 3, (c + 2) % 3
        for k in range(3):
            e[3 * c + k], e[3 * i + k], e[3 * j + k] = 0.0, -x[3 + 3 * j + k], x[3 + 3 * i + k]
        if has_slope(law):
            for k in range(9):
                dx[7 + 2 * k] = e[k]
            fx, fy, fz = force_slope_at(law)(dx, dv, t, p)
        else:
            for k in range(9):
                d[k], d[9 + k] = x[3 + k] + STEP * e[k], x[3 + k] - STEP * e[k]
            fx, fy, fz = _turn_difference(law, p, t, x, v, d)
        A[row, c], A[row + 1, c], A[row + 2, c] = fx, fy, fz


@inlined
def _turn_difference(law, p, t, x, v, ends):
    """Central difference of a torque's law between two rotation matrices, `ends`; x is left as it was."""
    kept = ends[18:27]
    for k in range(9):
        kept[k], x[3 + k] = x[3 + k], ends[k]
    fx, fy, fz = force_law_at(law)(x, v, t, p)
    for k in range(9):
        x[3 + k] = ends[9 + k]
    gx, gy, gz = force_law_at(law)(x, v, t, p)
    for k in range(9):
        x[3 + k] = kept[k]
    scale = 0.5 / STEP
    return scale * (fx - gx), scale * (fy - gy), scale * (fz - gz)


@kernel
def add_force_law_gradient(law, p, t, x, v, c_x, c_v, scale, A, row):
    """A[row : row + 3, :3] += scale (c_x df/dx + c_v df/dv) of a force law; x and v are left as they were."""
    dx, dv = _seeds(local_vector(), x, v)
    for c in range(3):
        if has_slope(law):
            dx[2 * c + 1], dv[2 * c + 1] = c_x, c_v
            fx, fy, fz = force_slope_at(law)(dx, dv, t, p)
            dx[2 * c + 1] = dv[2 * c + 1] = 0.0
        else:
            fx = fy = fz = 0.0
            if c_x != 0.0:
                gx, gy, gz = _force_difference(law, p, t, x, v, x, c)
                fx, fy, fz = c_x * gx, c_x * gy, c_x * gz
            if c_v != 0.0:
                gx, gy, gz = _force_difference(law, p, t, x, v, v, c)
                fx, fy, fz = fx + c_v * gx, fy + c_v * gy, fz + c_v * gz
        A[row, c] += scale * fx
        A[row + 1, c] += scale * fy
        A[row + 2, c] += scale * fz


@inlined
def force_law_gradient(law, p, t, x, v, c_x, c_v, A, row):
    """A[row : row + 3, :3] = c_x df/dx + c_v df/dv of a force law; x and v are left as they were."""
    for c in range(3):
        A[row + c, 0] = A[row + c, 1] = A[row + c, 2] = 0.0
    add_force_law_gradient(law, p, t, x, v, c_x, c_v, 1.0, A, row)


@kernel
def add_element_law_gradient(law, p, t, work, m, at, size, scale, K):
    """Add scale times the derivatives of the forces of a law between points by the numbers from work[at] on to K.

    Parameters
    ----------
    work : scratch: positions x and velocities v, (m,) each; 8 m more numbers are overwritten
    at : 0 for the derivatives by x, m for those by v; size : of these numbers, for differences
    K : (m, m) float
    """
    x, v, f, g = work[0:m], work[m : 2 * m], work[2 * m : 3 * m], work[3 * m : 4 * m]
    dx, dv, df = work[4 * m : 6 * m], work[6 * m : 8 * m], work[8 * m : 10 * m]
    exact = has_slope(law)
    for i in range(m if exact else 0):
        dx[2 * i], dx[2 * i + 1], dv[2 * i], dv[2 * i + 1] = x[i], 0.0, v[i], 0.0
    for j in range(m):
        if exact:
            seed = 4 * m + 2 * at + 2 * j + 1
            for i in range(2 * m):
                df[i] = 0.0
            work[seed] = 1.0
            element_slope_at(law)(t, dx, dv, p, df)
            work[seed] = 0.0
            for i in range(m):
                K[i, j] += scale * df[2 * i + 1]
            continue
        for i in range(m):
            f[i] = g[i] = 0.0
        kept, step = work[at + j], ELEMENT_STEP * size
        work[at + j] = kept + step
        element_law_at(law)(t, x, v, p, f)
        high = work[at + j]
        work[at + j] = kept - step
        element_law_at(law)(t, x, v, p, g)
        part = scale / (high - work[at + j])
        work[at + j] = kept
        for i in range(m):
            K[i, j] += part * (f[i] - g[i])
