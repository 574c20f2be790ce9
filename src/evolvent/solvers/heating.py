"""Strain energies of heated beams, and the work done as their free strains change.

The solvers treat thermal strain as loads and take strain energies of the total strain. The strain energy of the total
strain less the free one differs from that by `energies`; the work of loads since the start differs by its change.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from evolvent.elements import rods
from evolvent.elements.forms import products
from evolvent.elements.thermal import STRETCHES
from evolvent.kernels import ancf_beams, thermal
from evolvent.kernels.profile import profile
from evolvent.model import Model

Array = np.ndarray


class Heated(NamedTuple):
    """Of a load: its beam or rod; changes of energies of strain and of bending, and work since the start, (nt,) J."""

    beam: int
    elastic: Array
    bending: Array
    work: Array


def amplitudes(model: Model, index: int, t: Array, factor: Array | float = 1.0) -> Array:
    """Amplitudes of a thermal load at the times t: (nt, 6)."""
    load = model.thermal_loads[index]
    T, y, z = (
        np.array([profile(float(time), at, model) if at >= 0 else 0.0 for time in t]) * factor
        for at in (int(load[key]) for key in ("temperature", "gradient_y", "gradient_z"))
    )
    return np.stack([T, T * T, y, y * T, z, z * T], axis=-1)


def energies(model: Model, index: int, t: Array, y: Array, factor: Array | float = 1.0) -> Heated:
    """Energies of a thermal load in states (nt, ny); `factor` is that of loads in equilibria.

    Notes
    -----
    With c = C (g - g0) of all elements the energies change by a . Q a/2 - a . c. The work is the integral of its
    derivative by a, by the trapezoidal rule over the samples.
    """
    load = model.thermal_loads[index]
    if load["rod"] >= 0:
        return _rod_energies(model, load, amplitudes(model, index, t, factor), y)
    beam, at, a = model.beams[load["beam"]], int(load["constants"]), amplitudes(model, index, t, factor)
    is_cable = bool(beam["kind"] == ancf_beams.CABLE)
    size, c, whole = 12 if is_cable else 24, np.zeros(a.shape), np.zeros((a.shape[1], a.shape[1]))
    for element in model.elements[int(beam["first_element"]) : int(beam["first_element"] + beam["elements"])]:
        m, iq = 3 if element["stretch"] else 6 if is_cable else 28, int(element["iq"])
        C = model.parameters[at : at + 6 * m].reshape(6, m)
        e, Q = y[:, iq : iq + size], model.parameters[at + 6 * m : at + 6 * m + 36]
        g = _stretches(e, model.H12[element["form"]]) if element["stretch"] else _products(e)
        c += g @ C.T - model.parameters[at + 6 * m + 36 : at + 6 * m + thermal.AFTER]
        whole += Q.reshape(6, 6)
        at += 6 * m + thermal.AFTER
    own = 0.5 * a * (a @ whole)
    changes = own - a * c  # C and Q do not couple stretch and bending
    work = np.zeros(t.size)
    if t.size:
        work[1:] = np.cumsum(-np.sum(np.diff(a, axis=0) * 0.5 * (c[1:] + c[:-1]), axis=1))
        work += own.sum(axis=1) - own[0].sum()
    return Heated(int(load["beam"]), changes.sum(axis=1), changes[:, STRETCHES:].sum(axis=1), work)


def free_rod_strains(model: Model, load: Any, a: Array) -> Array:
    """Free strains (nt, elements, 6) of a heated rod, of amplitudes (nt, 6)."""
    count, at = int(model.rods["elements"][load["rod"]]), int(load["constants"])
    found = np.zeros((len(a), count, 6))
    found[..., [0, 4, 5]] = a[:, [0, 4, 2]][:, None, :] * model.parameters[at : at + count][:, None] * [1.0, 1.0, -1.0]
    return found


def _rod_energies(model: Model, load: Any, a: Array, y: Array) -> Heated:
    """`energies` of a rod, whose energy is quadratic in the strains less the free ones."""
    row = model.rods[load["rod"]]
    elements = model.rod_elements[int(row["first_element"]) :][: int(row["elements"])]
    bodies = model.bodies[int(row["first_body"]) :][: int(row["elements"]) + 1]
    R = np.stack([rods.from_quaternions(y[:, b["iq"] + 3 : b["iq"] + 7]) for b in bodies], axis=1)
    arms = np.concatenate([elements["arm_a"], elements["arm_b"][-1:]])
    x = np.stack([y[:, b["iq"] : b["iq"] + 3] for b in bodies], axis=1) + np.einsum("tnij,nj->tni", R, arms)
    lengths, free = elements["length"], free_rod_strains(model, load, a)
    E = rods.strains(x, R, lengths) - elements["rest"]
    S, S_free = (np.einsum("n,nij,tnj->tni", lengths, elements["stiffness"], strain) for strain in (E, free))
    changes = 0.5 * (S_free * free - S_free * E - S * free)
    work = np.zeros(len(a))
    if len(a):
        pull = 0.5 * (S - S_free)
        work[1:] = np.cumsum(-np.einsum("tni,tni->t", pull[1:] + pull[:-1], np.diff(free, axis=0)))
    return Heated(int(load["rod"]), changes.sum(axis=(1, 2)), changes[..., 3:].sum(axis=(1, 2)), work)


def _products(e: Array) -> Array:
    """Products of the nodal vectors of an element, of coordinates (nt, 12 or 24): (nt, m)."""
    return np.array([products(row) for row in e])


def _stretches(e: Array, H: Array) -> Array:
    """Stretches at the points of an element of a cable_stretch, of coordinates (nt, 12): (nt, 3)."""
    v = np.stack([e[:, 3:6], e[:, 6:9] - e[:, :3], e[:, 9:]], axis=1)
    return np.asarray(np.linalg.norm(H[:3, :3] @ v, axis=-1))


def less_free_strain(model: Model, t: Array, y: Array, factor: Array | float, balance: Any) -> Any:
    """A balance with the strain energies of heated beams, and the work of loads by which they change."""
    if not model.thermal_loads.size:
        return balance
    found = balance.copy()
    for index in range(model.thermal_loads.size):
        heated = energies(model, index, t, y, factor)
        found["elastic"] += heated.elastic
        found["bending"] += heated.bending
        found["loads"] += heated.elastic - heated.elastic[:1]
    return found
