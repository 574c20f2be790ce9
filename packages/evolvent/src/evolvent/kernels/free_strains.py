"""Free strains of heated beams, rods and shells: amplitudes of thermal loads, and the strains that they alone make."""

from numba import void

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.kernels.profile import profile
from evolvent.model import MODEL, having, not_negative

USED_FOR = "thermal_loads"
#: Amplitudes of a load: T, T^2, Gy, Gy T, Gz, Gz T.
AMPLITUDES = 6
#: Of them of a shell: T, T^2, Gz, Gz T, whose normal is z.
SHELL_AMPLITUDES = 4
#: Of a balance of heat (`families.thermal.walls`): parameters without stress and at the start, K; thickness, m.
REFERENCE, BEGIN, THICKNESS = 13, 14, 15


@inlined
def _fill_amplitudes(t, factor, load, a, share, model):
    """a += `share` of the amplitudes at time t, times the load factor."""
    T = factor * profile(t, load.temperature, model) if load.temperature >= 0 else 0.0
    along_y = factor * profile(t, load.gradient_y, model) if load.gradient_y >= 0 else 0.0
    along_z = factor * profile(t, load.gradient_z, model) if load.gradient_z >= 0 else 0.0
    a[0] += share * T
    a[1] += share * T * T
    a[2] += share * along_y
    a[3] += share * along_y * T
    a[4] += share * along_z
    a[5] += share * along_z * T


@inlined
def fill_mean(t0, t1, factor, load, model):
    """The load's amplitudes: means of those at t0 and t1."""
    for j in range(AMPLITUDES):
        load.now[j] = 0.0
    _fill_amplitudes(t0, factor, load, load.now, 0.5, model)
    _fill_amplitudes(t1, factor, load, load.now, 0.5, model)


@indirect(void(REAL, REAL, REAL, MODEL), used_for=having("thermal_loads", rod=not_negative))
def heat_rods(t0, t1, factor, model):
    """Free strains of heated rods: means of those at t0 and t1, times `factor`, of which the rod takes forces.

    The parameters of a load hold, for each element, the expansion by temperature and gradients: a fibre at (y, z) grows
    by alpha (T + y Gy + z Gz), so that Gamma_x = alpha T, K_y = alpha Gz and K_z = -alpha Gy.
    """
    p = model.parameters
    for k in range(model.thermal_loads.size):
        load = model.thermal_loads[k]
        if load.rod < 0:
            continue
        fill_mean(t0, t1, factor, load, model)
        first = model.rods[load.rod].first_element
        for i in range(model.rods[load.rod].elements):
            free, alpha = model.rod_elements[first + i].free, p[load.constants + i]
            free[0], free[4], free[5] = alpha * load.now[0], alpha * load.now[4], -alpha * load.now[2]


@inlined
def _expand(row, T, TT, G, GT):
    """Temperature and gradient of an element of a shell, and its free measures by these and their products."""
    row.warmth, row.slope = T, G
    by = row.expansion
    for j in range(row.free.shape[0]):
        row.free[j] = T * by[0, j] + TT * by[1, j] + G * by[2, j] + GT * by[3, j]


@indirect(void(REAL, REAL, REAL, MODEL), used_for=having("thermal_loads", shell=not_negative))
def heat_shells(t0, t1, factor, model):
    """Free measures of the elements of heated shells: means of those at t0 and t1, times `factor`.

    The parameters of a load hold a factor of temperature and gradient for each element; temperatures of a balance of
    heat are those of the last evaluation of its walls.
    """
    p = model.parameters
    for k in range(model.thermal_loads.size):
        load = model.thermal_loads[k]
        if load.shell < 0:
            continue
        first = model.shells[load.shell].first_element
        if load.walls >= 0:
            at, sum_T, sum_G = p[load.light :], 0.0, 0.0
            for i in range(model.shells[load.shell].elements):
                c = model.heated_walls[load.walls + i].now
                T, G = factor * (at[BEGIN] - at[REFERENCE] + c[0]), factor * 2.0 * c[1] / at[THICKNESS]
                _expand(model.shell_elements[first + i], T, T * T, G, G * T)
                sum_T, sum_G = sum_T + T, sum_G + G
            for j in range(AMPLITUDES):
                load.now[j] = 0.0
            n = model.shells[load.shell].elements
            load.now[0], load.now[4] = sum_T / n, sum_G / n
            continue
        fill_mean(t0, t1, factor, load, model)
        for i in range(model.shells[load.shell].elements):
            c = p[load.constants + i]
            _expand(
                model.shell_elements[first + i], c * load.now[0], c * c * load.now[1], c * load.now[4],
                c * c * load.now[5],
            )  # fmt: skip


@indirect(void(REAL, REAL, MODEL))
def heat_beams(t, factor, model):
    """Free strains of heated beams at time t, times `factor`, into their records."""
    p = model.parameters
    for k in range(model.thermal_loads.size):
        load = model.thermal_loads[k]
        if load.beam < 0:
            continue
        fill_mean(t, t, factor, load, model)
        a, at = load.now, load.expansions
        first = model.beams[load.beam].first_element
        for i in range(first, first + model.beams[load.beam].elements):
            free, green = model.elements[i].free, 1.0 if model.elements[i].stretch == 0 else 0.0
            for j in range(free.shape[0]):  # see `evolvent.elements.thermal.free_strains`
                c = p[at + j]
                free[j, 0] = c * a[0] + 0.5 * green * c * c * a[1]
                free[j, 1] = green * (c * a[2] + c * c * a[3])
                free[j, 2] = green * (c * a[4] + c * c * a[5])
            at += free.shape[0]
