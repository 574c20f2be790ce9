"""Balance of heat of heated walls, the elements of a shell: sunlight, emission, conduction, capacity.

The temperature through the thickness h is start + sum c_i P_i(2 z/h), Legendre's polynomials P_0 to P_3: c_0 is the
mean, 2 c_1/h the gradient by which a wall bends, and the others do neither. With the capacity C per area and the
conductance k/h, and the heat g_t and g_b that come in through top and bottom (Galerkin),

    C/(2 i + 1) c_i' = g_t + (-1)^i g_b - k/h sum_j K_ij c_j,    K_ij = 2 int P_i' P_j' dx = K of `CONDUCTION`,
    g = a q |cos| of the lit face - e sigma (T^4 - T_s^4)

The slowest time constant of conduction is off by 0.06 % from h^2/(pi^2 k/(rho c)) of a wall without radiation. A step
of the run takes two stages of the L-stable method SDIRK2, in which the sunlight changes linearly from the normals at
its start to those at its end. Forces in a step take the temperatures that follow from those at its start and the rates
of the step before.
"""

import math

from numba import void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels.free_strains import BEGIN
from evolvent.kernels.profile import window
from evolvent.model import MODEL

USED_FOR = "heated_walls"
#: Stefan's and Boltzmann's constant, W/(m2 K4).
SIGMA = 5.670374419e-8
#: Polynomials of the temperature through the thickness.
TERMS = 4
#: Indices of the parameters of a balance: flux along the light, W/m2; start, end and ramp of the light, s;
#: absorptivities and emissivities of top and bottom; surroundings, K; capacity, J/(m2 K); conductance, W/(m2 K);
#: then those of `free_strains`.
START, END, RAMP, TOP, BOTTOM, EMITS, SPACE, CAPACITY, CONDUCTANCE = 3, 4, 5, 6, 7, 8, 10, 11, 12
#: Conduction: K_11 = K_13, K_22, K_33.
ODD, SECOND, THIRD = 4.0, 12.0, 24.0
_GAMMA = 1.0 - math.sqrt(0.5)
#: Newton's method for the temperatures of the faces, K.
_MOST, _WITHIN = 60, 1e-10


@inlined
def _director(b, y, model):
    """Third axis of body b in a state y, inertial axes."""
    q, R = model.bodies[b].iq, model.bodies[b].R
    if q < 0:
        return R[0, 2], R[1, 2], R[2, 2]
    w, i, j, k = y[q + 3], y[q + 4], y[q + 5], y[q + 6]
    return 2.0 * (i * k + w * j), 2.0 * (j * k - w * i), w * w - i * i - j * j + k * k


@inlined
def lit(n, y, model):
    """Sunlight that the top and the bottom of wall n take in a state y, W/m2, while it shines."""
    row = model.heated_walls[n]
    p = model.parameters[model.thermal_loads[row.load].light :]
    x = yy = z = 0.0
    for b in model.shell_elements[row.element].nodes:
        u, v, w = _director(b, y, model)
        x, yy, z = x + u, yy + v, z + w
    along = (p[0] * x + p[1] * yy + p[2] * z) / math.sqrt(x * x + yy * yy + z * z)
    return p[TOP] * max(-along, 0.0), p[BOTTOM] * max(along, 0.0)


@inlined
def _emitted(p, face, T):
    """Heat that a face (0 top, 1 bottom) of the temperature T loses, W/m2, and its derivative."""
    e = SIGMA * p[EMITS + face]
    return e * (T**4 - p[SPACE] ** 4), 4.0 * e * T**3


@inlined
def _faces(p, a, b, of_top, of_bottom, top, bottom, T, B):
    """Temperatures of top and bottom, T = of_top + a g_t + b g_b, B = of_bottom + b g_t + a g_b, g = lit - emitted.

    T, B : where Newton's method begins
    """
    for _ in range(_MOST):
        by_top, slope = _emitted(p, 0, T)
        by_bottom, slope_b = _emitted(p, 1, B)
        g, gb = top - by_top, bottom - by_bottom
        r, rb = T - of_top - a * g - b * gb, B - of_bottom - b * g - a * gb
        j11, j12, j21, j22 = 1.0 + a * slope, b * slope_b, b * slope, 1.0 + a * slope_b
        det = j11 * j22 - j12 * j21
        dT, dB = (j22 * r - j12 * rb) / det, (j11 * rb - j21 * r) / det
        T, B = max(T - dT, 0.5 * T), max(B - dB, 0.5 * B)
        if abs(dT) + abs(dB) <= _WITHIN:
            break
    return T, B


@inlined
def _balance(p, top, bottom, out):
    """Coefficients out : (4,) of the temperatures at which as much heat goes as comes, of sunlight on both faces."""
    k, T, B = p[CONDUCTANCE], out[0] + p[BEGIN] + out[1], out[0] + p[BEGIN] - out[1]
    for _ in range(_MOST):
        by_top, slope = _emitted(p, 0, T)
        by_bottom, slope_b = _emitted(p, 1, B)
        r, rb = top - by_top - k * (T - B), bottom - by_bottom + k * (T - B)
        det = (slope + k) * (slope_b + k) - k * k
        dT, dB = ((slope_b + k) * r + k * rb) / det, ((slope + k) * rb + k * r) / det
        T, B = max(T + dT, 0.5 * T), max(B + dB, 0.5 * B)
        if abs(dT) + abs(dB) <= _WITHIN:
            break
    out[0], out[1], out[2], out[3] = 0.5 * (T + B) - p[BEGIN], 0.5 * (T - B), 0.0, 0.0


@inlined
def _stage(p, s, top, bottom, c):
    """Solve c = base + s c' for the coefficients c : (4,), which hold the base; s : length of the stage, s."""
    u, k = s / p[CAPACITY], p[CONDUCTANCE]
    a11, a13, a31, a33 = 1.0 + 3.0 * u * k * ODD, 3.0 * u * k * ODD, 7.0 * u * k * ODD, 1.0 + 7.0 * u * k * THIRD
    det, left = a11 * a33 - a13 * a31, 1.0 + 5.0 * u * k * SECOND
    first, third = (a33 * c[1] - a13 * c[3]) / det, (a11 * c[3] - a31 * c[1]) / det
    second = c[2] / left
    by_even, of_first, of_third = 5.0 * u / left, u * (3.0 * a33 - 7.0 * a13) / det, u * (7.0 * a11 - 3.0 * a31) / det
    even, odd = u + by_even, of_first + of_third
    mean, half = c[0] + p[BEGIN] + second, first + third
    T, B = _faces(p, even + odd, even - odd, mean + half, mean - half, top, bottom, mean + half, mean - half)
    g, gb = top - _emitted(p, 0, T)[0], bottom - _emitted(p, 1, B)[0]
    c[0], c[1] = c[0] + u * (g + gb), first + of_first * (g - gb)
    c[2], c[3] = second + by_even * (g + gb), third + of_third * (g - gb)


@indirect(void(REAL, REAL, VECTOR, MODEL))
def advance_walls(t, h, y, model):
    """Temperatures of all walls at the end of a step of length h that ends at t in the state y, into their records."""
    for n in range(model.heated_walls.size):
        row = model.heated_walls[n]
        p = model.parameters[model.thermal_loads[row.load].light :]
        top, bottom = lit(n, y, model)
        before, c, base = row.before, row.now, row.work
        inner = t - (1.0 - _GAMMA) * h
        shines = window(inner, p[START], p[END], p[RAMP])
        first, last = (1.0 - _GAMMA) * shines, _GAMMA * shines
        for i in range(TERMS):
            c[i] = row.kept[i]
        _stage(p, _GAMMA * h, first * before[0] + last * top, first * before[1] + last * bottom, c)
        for i in range(TERMS):
            c[i] = base[i] = row.kept[i] + (1.0 - _GAMMA) / _GAMMA * (c[i] - row.kept[i])
        shines = window(t, p[START], p[END], p[RAMP])
        _stage(p, _GAMMA * h, shines * top, shines * bottom, c)
        for i in range(TERMS):
            row.rate[i], row.kept[i] = (c[i] - row.kept[i]) / h, c[i]
        row.time, before[0], before[1] = t, top, bottom


@indirect(void(REAL, VECTOR, MODEL))
def start_walls(t, y, model):
    """A run begins, or goes on, at t in the state y, with the temperatures that stand among its accounts."""
    for n in range(model.heated_walls.size):
        row = model.heated_walls[n]
        for i in range(TERMS):
            row.kept[i], row.rate[i] = y[row.account + i], 0.0
        row.time, row.steady = t, 0.0
        row.before[0], row.before[1] = lit(n, y, model)


@indirect(void(REAL, VECTOR, MODEL))
def predict_walls(t, y, model):
    """Temperatures at a time t of the step that is under way; in statics those of the balance in the state y."""
    for n in range(model.heated_walls.size):
        row = model.heated_walls[n]
        if row.steady == 0.0:
            for i in range(TERMS):
                row.now[i] = row.kept[i] + (t - row.time) * row.rate[i]
            continue
        p = model.parameters[model.thermal_loads[row.load].light :]
        shines, (top, bottom) = window(t, p[START], p[END], p[RAMP]), lit(n, y, model)
        _balance(p, shines * top, shines * bottom, row.now)


@indirect(void(VECTOR, MODEL))
def load_walls(y, model):
    """Temperatures that stand among the accounts of a state."""
    for n in range(model.heated_walls.size):
        for i in range(TERMS):
            model.heated_walls[n].now[i] = y[model.heated_walls[n].account + i]


@indirect(void(REAL, VECTOR, MODEL))
def note_walls(t, y, model):
    """Results of all walls at a sample, after `load_walls`: temperatures of the faces, and the sunlight they take."""
    for n in range(model.heated_walls.size):
        row = model.heated_walls[n]
        p = model.parameters[model.thermal_loads[row.load].light :]
        shines, (top, bottom) = window(t, p[START], p[END], p[RAMP]), lit(n, y, model)
        row.absorbed_top, row.absorbed_bottom = shines * top, shines * bottom
        mean, half = p[BEGIN] + row.now[0] + row.now[2], row.now[1] + row.now[3]
        row.top, row.bottom = mean + half, mean - half
