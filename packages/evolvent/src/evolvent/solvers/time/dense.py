"""States between the ends of a step: samples cut no step."""

from __future__ import annotations

from evolvent.compiled.jit import inlined
from evolvent.equations.implicit import momenta
from evolvent.kernels import rigid
from evolvent.kernels.between import scale_between, vector_at
from evolvent.kernels.blocks import RATE, ROTATION, SLOPE
from evolvent.kernels.calls import interpolate_at


@inlined
def interpolate(theta, h, y0, y1, model, y):
    """State y at the part `theta` of a step of length h from y0 to y1.

    Notes
    -----
    Coordinates, and the quaternions of free bodies, lie on the cubics that have the values and rates of both ends
    (Hermite), velocities are the rates of these cubics: errors of the fourth and the third order. Quaternions have the
    length 1. What has no rate lies on a straight line. On the cubics a beam or thread that turns would be stretched by
    a fourth power of the angle, and by what the velocities of the method miss, which are large forces where it is
    stiff: lengths of slopes, and those between nodes (`Samples.interpolate`), lie on straight lines, as forces do.
    """
    for i in range(y.size):
        y[i] = y0[i] + theta * (y1[i] - y0[i])
    if theta >= 1.0:
        return
    blocks = model.blocks
    for k in range(blocks.size):
        kind, q, v = blocks[k].kind, blocks[k].iq, blocks[k].iv
        if kind == ROTATION:
            _attitude(theta, h, y0, y1, q, v, y)
        elif kind != RATE:
            for i in range(blocks[k].count):
                y[q + i], y[v + i] = cubic(theta, h, y0[q + i], y1[q + i], y0[v + i], y1[v + i])
            if kind == SLOPE:
                scale = scale_between(theta, vector_at(y0, q), vector_at(y1, q), vector_at(y, q))
                for i in range(3):
                    y[q + i] *= scale
    calls = model.samples_interpolate_calls
    for k in range(calls.size):
        interpolate_at(model, calls[k])(theta, y0, y1, model, y)


@inlined
def momenta_between(theta, t, h, y0, y1, model, start, out):
    """Momenta at the part `theta` of a step of length h from t, y0 to y1, on a straight line; bodies are at y1 then.

    Parameters
    ----------
    start : (6,) float, scratch; out : (6,) float, as of `momenta`

    Notes
    -----
    Velocities on the cubics between the ends of a step that turns the system by the angle a are off by the share a^2/8,
    so that the momenta of the states there are not those which the method keeps.
    """
    if theta < 1.0:
        rigid.kinematics(t, y0, model)
        momenta(y0, model, start)
    rigid.kinematics(t + h, y1, model)
    momenta(y1, model, out)
    if theta < 1.0:
        for i in range(6):
            out[i] = start[i] + theta * (out[i] - start[i])


@inlined
def cubic(theta, h, a, b, da, db):
    """Value and rate of the cubic from a to b whose rates at the ends are da and db."""
    u, d = 1.0 - theta, b - a
    p, q = h * da - d, d - h * db
    value = u * a + theta * b + theta * u * (u * p + theta * q)
    return value, (d + (1.0 - 2.0 * theta) * (u * p + theta * q) + theta * u * (q - p)) / h


@inlined
def _rate(y, q, v):
    """Rate of the quaternion at q, whose body turns at the rate at v (body axes): (4 floats)."""
    a, b, c, d = y[q], y[q + 1], y[q + 2], y[q + 3]
    x, w, z = 0.5 * y[v], 0.5 * y[v + 1], 0.5 * y[v + 2]
    return -b * x - c * w - d * z, a * x + c * z - d * w, a * w + d * x - b * z, a * z + b * w - c * x


@inlined
def _attitude(theta, h, y0, y1, q, v, y):
    """Quaternion at q by its cubic, brought to length 1, and the angular velocity (body axes) that it turns at."""
    along = y0[q] * y1[q] + y0[q + 1] * y1[q + 1] + y0[q + 2] * y1[q + 2] + y0[q + 3] * y1[q + 3]
    s = 1.0 if along >= 0.0 else -1.0  # q and -q are one attitude
    d0, d1 = _rate(y0, q, v), _rate(y1, q, v)
    a, da = cubic(theta, h, y0[q], s * y1[q], d0[0], s * d1[0])
    b, db = cubic(theta, h, y0[q + 1], s * y1[q + 1], d0[1], s * d1[1])
    c, dc = cubic(theta, h, y0[q + 2], s * y1[q + 2], d0[2], s * d1[2])
    d, dd = cubic(theta, h, y0[q + 3], s * y1[q + 3], d0[3], s * d1[3])
    y[q], y[q + 1], y[q + 2], y[q + 3] = a, b, c, d
    rigid.normalise_quaternion(y, q)
    n = 2.0 / (a * a + b * b + c * c + d * d)
    y[v] = n * (a * db - b * da - c * dd + d * dc)
    y[v + 1] = n * (a * dc + b * dd - c * da - d * db)
    y[v + 2] = n * (a * dd - b * dc + c * db - d * da)
