"""Rods beyond what they hold: drives that leave their lengths, elements that bend or pull too far; and rods at rest."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.elements import rods
from evolvent.elements.sections import TapeSection
from evolvent.elements.shapes import Strip
from evolvent.kernels.drive import LEAST_OUT, ROUND_OFF, angles_of, set_ramp
from evolvent.kernels.rotations import rotation_from_quaternion
from evolvent_base.errors import InputError

Array = np.ndarray
#: Angle between the ends of an element, degrees, from which messages name it: that of an element at the start, at most.
#: Beyond 120 degrees strains are not defined; a step or a load factor that fails below this angle has other causes.
LARGE = 90.0


def check_lengths(assembly: Any, times: Array) -> None:
    """Refuse a drive that pays out more than its rod's length, or leaves too little of it (`Drives.check`)."""
    model = assembly.model
    for name, (family, index) in assembly.names.items():
        if family != "rods" or model.rods["payout"][index] == 0:
            continue
        row, out = model.rods[index], angles_of(model.rods[index], model, times)
        whole = float(row["length"])
        wrong = np.flatnonzero((out > whole * (1.0 + ROUND_OFF)) | (out < whole * (LEAST_OUT - ROUND_OFF)))
        if wrong.size:
            k = int(wrong[0])
            raise InputError(
                f"{name}.payout has {out[k]:.6g} m out at about {times[k]:.6g} s; it must be from "
                f"{LEAST_OUT * whole:g} m ({LEAST_OUT:g} of `length`) to {whole:g} m; shorten `until`, or change the "
                f"drive"
            )


def freeze(model: Any, time: float) -> Any:
    """The model with rods that stand at their lengths of a time (`Drives.freeze`)."""
    paid = np.flatnonzero(model.rods["payout"] != 0)
    if not paid.size:
        return model
    found = model._replace(rods=model.rods.copy())
    for p in paid:
        length = angles_of(model.rods[p], model, np.array([time]))[0]
        found = set_ramp(found, found.rods[p : p + 1], "", length, 0.0)
    return found


def lengthen(assembly: Any, time: float, y: Array, s: Array, given: bool) -> None:
    """Spread rods that pay out, whose nodes are those of the start, over the lengths of a time (`Drives.place`)."""
    model = assembly.model
    for row in model.rods[model.rods["payout"] != 0] if time != 0.0 and not given else ():
        start, now = angles_of(row, model, np.array([0.0, time]))
        at = model.bodies["iq"][int(row["first_body"]) :][: int(row["elements"]) + 1, None] + np.arange(3)
        y[at] = y[at[0]] + now / start * (y[at] - y[at[0]])


def bending_hint(model: Any, y: Array) -> Iterator[tuple[int, str]]:
    """The element with the largest angle between its ends, from `LARGE` on (`Notes.hint`)."""
    worst, found = LARGE, []
    for k, row in enumerate(model.rods):
        R = np.empty((int(row["elements"]) + 1, 3, 3))
        for i in range(len(R)):
            q = int(model.bodies["iq"][row["first_body"] + i]) + 3
            rotation_from_quaternion(*y[q : q + 4], R[i])
        if not np.all(np.isfinite(R)):
            continue
        turns = np.degrees(np.linalg.norm(rods.strains(np.zeros((len(R), 3)), R, 1.0)[:, 3:], axis=1))
        if turns.max() >= worst:
            worst = float(turns.max())
            what = f"element {int(turns.argmax())} of {{name}} is bent or twisted by {worst:.0f} deg (limit: 120 deg)"
            found = [(k, f"{what}: use more `elements`")]
    yield from found


def beyond_tension(solution: Any) -> Iterator[str]:
    """Sentences on rods whose tension is above 12 E I/L^2 of an element, an unstable shape (`Notes.limits`).

    Notes
    -----
    The tension follows from the chords of the elements, of which bending leaves out a little. The residual bending
    flexibility is one of shear (`evolvent.elements.rods`), and a rod that shears buckles under such a tension.
    """
    model, parts = solution.assembly.model, solution.assembly.parts
    for name, (family, index) in solution.assembly.names.items():
        if family != "rods" or isinstance(section := parts[name].section, Strip):
            continue
        row = model.rods[index]
        if row["payout"] != 0:  # whose elements have no residual flexibility
            continue
        first = int(row["first_element"])
        own = model.rod_elements[first : first + int(row["elements"])]
        bodies, arms = np.append(own["a"], own["b"][-1]), np.vstack([own["arm_a"], own["arm_b"][-1]])
        nodes = _places(solution.y, model.bodies["iq"][bodies], arms)
        strain = np.linalg.norm(np.diff(nodes, axis=1), axis=2) / own["length"] - own["rest"][:, 0]
        strain[:, own["heated"] != 0] = 0.0  # whose strain is not that of tension alone
        bends = own["section"][:, 4, 4]
        if not isinstance(section, TapeSection):
            bends = np.maximum(bends, own["section"][:, 5, 5])
        limit = 12.0 / (bends * own["length"] ** 2)
        share = strain / own["section"][:, 0, 0] / limit
        if share.size and share.max() > 1.0:
            n = int(np.argmax(share.max(axis=1) > 1.0))  # the first; its chords turn away later
            k = int(share[n].argmax())
            yield (
                f"{name!r} has a tension of {share[n, k] * limit[k]:.3g} N in element {k} at t = "
                f"{solution.t[n]:.6g} s, above 12 E I/L^2 = {limit[k]:.3g} N, beyond which its shape is unstable; use "
                f"shorter elements, the section 'strip' or a Thread"
            )


def _places(y: Array, iq: Array, arms: Array) -> Array:
    """Places (nt, n, 3) of points on bodies whose coordinates, position and quaternion, start at iq (n,)."""
    found: Array = y[:, iq[:, None] + np.arange(3)]
    off = np.flatnonzero(np.any(arms != 0.0, axis=1))
    if off.size:  # whose rotation counts
        attitude = y[:, iq[off, None] + 3 + np.arange(4)]
        attitude /= np.linalg.norm(attitude, axis=2, keepdims=True)
        across = 2.0 * np.cross(attitude[..., 1:], arms[off])
        found[:, off] += arms[off] + attitude[..., :1] * across + np.cross(attitude[..., 1:], across)
    return found
