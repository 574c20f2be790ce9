"""Energies of heated beams: what their strain energies have less than those of the whole strains.

The solvers count thermal strain as loads, beside the energies of the whole strains. Less the free strains, the strain
energy changes by `energies`, and the work of loads by as much since the start.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from evolvent import jit
from evolvent.elements.forms import products
from evolvent.elements.thermal import STRETCHES
from evolvent.kernels import flexible, thermal
from evolvent.kernels.profile import profile
from evolvent.model import Model

Array = np.ndarray


class Heated(NamedTuple):
    """Of a load: its beam; what energies of strain and of bending change by (nt,), J; power of its forces (nt,), W."""

    beam: int
    elastic: Array
    bending: Array
    power: Array


def amplitudes(model: Model, index: int, t: Array, factor: Array | float = 1.0) -> Array:
    """Amplitudes of a thermal load at the times t: (nt, 6)."""
    load = model.flexible.thermal_loads[index]
    jit.load([profile])
    T, y, z = (
        np.array([profile(float(time), at, model) if at >= 0 else 0.0 for time in t]) * factor
        for at in (int(load[key]) for key in ("temperature", "gradient_y", "gradient_z"))
    )
    return np.stack([T, T * T, y, y * T, z, z * T], axis=-1)


def energies(model: Model, index: int, t: Array, y: Array, factor: Array | float = 1.0) -> Heated:
    """Energies of a thermal load in states (nt, ny); `factor` is that of loads in equilibria."""
    load, f = model.flexible.thermal_loads[index], model.flexible
    beam, at, a = f.beams[load["beam"]], int(load["constants"]), amplitudes(model, index, t, factor)
    is_cable = bool(beam["kind"] == flexible.CABLE)
    size, found = 12 if is_cable else 24, np.zeros((3, t.size))
    first, last = slice(0, STRETCHES), slice(STRETCHES, thermal.AMPLITUDES)
    for element in f.elements[int(beam["first_element"]) : int(beam["first_element"] + beam["elements"])]:
        m = 3 if element["stretch"] else 6 if is_cable else 28
        C = model.parameters[at : at + 6 * m].reshape(6, m)
        Q = model.parameters[at + 6 * m : at + 6 * m + 36].reshape(6, 6)
        rest = model.parameters[at + 6 * m + 36 : at + 6 * m + 42]
        iq, iv = int(element["iq"]), int(element["iv"])
        H = f.H12[element["form"]] if element["stretch"] else None
        g, rate = _measures(y[:, iq : iq + size], y[:, iv : iv + size], H)
        off = g @ C.T - rest
        for k, part in enumerate((first, last)):
            found[k] += 0.5 * np.einsum("ti,ij,tj->t", a[:, part], Q[part, part], a[:, part])
            found[k] -= np.einsum("ti,ti->t", a[:, part], off[:, part])
        found[2] += np.einsum("ti,ti->t", a, rate @ C.T)
        at += 6 * m + thermal.AFTER
    return Heated(int(load["beam"]), found[0] + found[1], found[1], found[2])


def _measures(e: Array, u: Array, H: Array | None) -> tuple[Array, Array]:
    """Products of nodal vectors, or stretches where H of a cable_stretch is given, and their rates: (nt, m) each."""
    if H is None:
        h = 1e-20
        moved = np.array([products(x + 1j * h * v) for x, v in zip(e, u, strict=True)])
        return moved.real, moved.imag / h
    v, w = (np.stack([x[:, 3:6], x[:, 6:9] - x[:, :3], x[:, 9:]], axis=1) for x in (e, u))
    a, b = H[:3, :3] @ v, H[:3, :3] @ w
    stretch = np.linalg.norm(a, axis=-1)
    return stretch, np.einsum("tpi,tpi->tp", a, b) / stretch


def less_free_strain(model: Model, t: Array, y: Array, factor: Array | float, balance: Any) -> Any:
    """A balance with the strain energies of heated beams, and the work of loads by which they change."""
    if not model.flexible.thermal_loads.size:
        return balance
    found = balance.copy()
    for index in range(model.flexible.thermal_loads.size):
        heated = energies(model, index, t, y, factor)
        found["elastic"] += heated.elastic
        found["bending"] += heated.bending
        found["loads"] += heated.elastic - heated.elastic[:1]
    return found
