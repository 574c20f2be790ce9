"""Checks of an assembled model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from evolvent.assembly import needs
from evolvent.assembly.assembled import Array, Assembly
from evolvent.base.errors import InputError
from evolvent.flow.impulse import prepare
from evolvent.kernels import ancf_beams, constraint_rows


def factored_masses(beams: Array, elements: Array, masses: Sequence[Array]) -> Array:
    """L D L^T of the beams' masses, which couple nodal vectors of neighbouring nodes: see `Model.masses`."""
    found = [np.zeros((0, 8))]
    for beam in beams:
        k = ancf_beams.NODE_VECTORS[beam["kind"]]
        n, w = k * int(beam["nodes"]), 2 * k - 1
        band = np.zeros((w + 1, n))  # band[i - j, j] = M[i, j], i >= j
        for c in range(beam["elements"]):
            M = masses[elements["mass"][beam["first_element"] + c]]
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
    joints, kinds = model.joints, {name: family for name, (family, _) in assembly.names.items()}
    held = [(k, name) for k, name in enumerate(assembly.joint_parts) if kinds.get(name) in ("links", "guides")]
    if not held:
        return
    needs.load(model, prepare)
    prepare(0.0, y, s, model)
    for k, name in sorted(held, key=lambda one: kinds[one[1]]):
        gap, rate, length = (float(joints[field][k]) for field in ("gap", "rate", "value"))
        moves = abs(rate) > 1e-6 * max(1.0, np.abs(y).max())
        if kinds[name] == "guides":
            if moves:
                raise InputError(f"guide {name!r}: the body moves against it, at {rate:.6g}, at the start")
        elif abs(gap) > 1e-6 * length:
            raise InputError(
                f"link {name!r}: its ends are {length + gap:.9g} m apart at the start, its length is {length:.9g} m"
            )
        elif moves:
            raise InputError(
                f"link {name!r}: its ends part at {rate:.6g} m/s at the start; give velocities that keep it"
            )
    until, own = joints["until"].copy(), [k for k, _ in held]
    joints["until"] = -np.inf  # other joints may be released, and implicit methods support what is redundant
    joints["until"][own] = until[own]
    bad = redundant_part(assembly)
    joints["until"] = until
    if bad:
        raise InputError(f"{kinds[bad][:-1]} {bad!r} is redundant: the other constraints already imply it")


def redundant_part(assembly: Assembly, t: float = 0.0) -> str:
    """Name of a part whose row of constraint other rows imply at the start t, under explicit methods; else nothing."""
    model, y, s = assembly.model, assembly.y.copy(), assembly.s.copy()
    needs.load(model, prepare)
    prepare(t, y, s, model)
    bad = constraint_rows.build_rows(t, y, s, model)
    if bad < 0:
        return ""
    index = int(model.rows["index"][bad])
    if model.rows["kind"][bad] == constraint_rows.JOINT:
        return assembly.joint_parts[index]
    return next(name for name, found in assembly.names.items() if found == ("threads", index))
