"""Checks of an assembled model."""

from __future__ import annotations

import numpy as np

from evolvent.assembly import needs
from evolvent.assembly.assembled import Array, Assembly
from evolvent.base.errors import InputError
from evolvent.flow.impulse import prepare
from evolvent.kernels import constraint_rows, flexible


def factored_masses(beams: Array, elements: Array, pools: dict[str, Array]) -> Array:
    """L D L^T of the beams' masses, which couple nodal vectors of neighbouring nodes: see `Flexible.masses`."""
    found = [np.zeros((0, 8))]
    for beam in beams:
        k = flexible.NODE_VECTORS[beam["kind"]]
        pool, n, w = pools["M12" if k == 2 else "M24"], k * int(beam["nodes"]), 2 * k - 1
        band = np.zeros((w + 1, n))  # band[i - j, j] = M[i, j], i >= j
        for c in range(beam["elements"]):
            M = pool[elements["mass"][beam["first_element"] + c]]
            for j in range(2 * k):
                band[: 2 * k - j, k * c + j] += M[j:, j]
        rows = np.zeros((n, 8))
        for c in range(n):
            rows[c, 0], below = 1.0 / band[0, c], min(w, n - 1 - c)
            for i in range(1, below + 1):
                rows[c + i, i] = band[i, c] / band[0, c]
            for j in range(1, below + 1):
                band[: below + 1 - j, c + j] -= rows[c + j, j] * band[j : below + 1, c]
        found.append(rows)
    return np.concatenate(found)


def off_axis(axis: Array, vector: Array) -> bool:
    """Whether a vector has a part across an axis."""
    return bool(np.linalg.norm(np.cross(axis, vector)) > 1e-9 * np.linalg.norm(vector))


def check_constraints(assembly: Assembly) -> None:
    """Refuse redundant links and guides, and those that the start does not meet, by name."""
    model, y, s = assembly.model, assembly.y.copy(), assembly.s.copy()
    if model.links.size == 0 and model.guides.size == 0:
        return
    by_index = {index: name for name, (family, index) in assembly.names.items() if family == "links"}
    guides = {index: name for name, (family, index) in assembly.names.items() if family == "guides"}
    needs.load(model, prepare)
    prepare(0.0, y, s, model)
    for k in range(model.guides.size):
        rate = constraint_rows.guide_geometry(model.guides, model.bodies, k)[1]
        if abs(rate) > 1e-6 * max(1.0, np.abs(y).max()):
            raise InputError(f"guide {guides[k]!r}: the body moves against it, at {rate:.6g}, at the start")
    for k in range(model.links.size):
        geometry = constraint_rows.link_geometry(y, model, k)
        length, gap, rate = model.links["length"][k], geometry[0] - model.links["length"][k], geometry[1]
        if abs(gap) > 1e-6 * length:
            raise InputError(
                f"link {by_index[k]!r}: its ends are {geometry[0]:.9g} m apart at the start, its length is "
                f"{length:.9g} m"
            )
        if abs(rate) > 1e-6 * max(1.0, np.abs(y).max()):
            raise InputError(
                f"link {by_index[k]!r}: its ends part at {rate:.6g} m/s at the start; give velocities that keep it"
            )
    bad = constraint_rows.build_rows(y, s, model)
    if bad >= 0:
        kind, index = int(model.rows["kind"][bad]), int(model.rows["index"][bad])
        if kind == constraint_rows.GUIDE:
            raise InputError(f"guide {guides[index]!r} is redundant: the other constraints already imply it")
        name = by_index.get(index, "a thread")
        raise InputError(f"link {name!r} is redundant: the other constraints already imply it")
