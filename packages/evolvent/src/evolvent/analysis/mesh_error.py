"""The error of the mesh: the same structure with every element in halves, and Richardson's extrapolation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy

from evolvent.analysis.variation import Composed
from evolvent.assembly.references import split_reference
from evolvent.parts.base import Part, Reference
from evolvent.solvers.modal.modal import VibrationModes
from evolvent.view import show
from evolvent_base.errors import InputError
from evolvent_base.schema import marks

if TYPE_CHECKING:
    import xarray as xr


Array = np.ndarray
#: Order p in the length of the elements of results of beams, rods and threads.
ORDER = 2
#: Modes of the finer mesh that are looked for beside those of the coarse one.
MORE = 6
#: Least agreement of the shapes (MAC) of one mode on both meshes.
ALIKE = 0.3


class MeshError(NamedTuple):
    """What the mesh does to a value; NaN where it is unknown.

    Attributes
    ----------
    extrapolated : float array, f_2n + (f_2n - f_n)/(2^p - 1) of the values with n and 2 n elements, p = 2
    relative : float array, without unit, (f_n - extrapolated)/|extrapolated|; of a vector by its length, above 0
    """

    extrapolated: Array
    relative: Array


def richardson(coarse: Array, fine: Array) -> MeshError:
    """Of values (...) on both meshes."""
    found = fine + (fine - coarse) / (2**ORDER - 1)
    size, off = np.abs(found), coarse - found
    return MeshError(found, np.divide(off, size, out=np.where(off == 0.0, 0.0, np.nan), where=size > 0.0))


def refined(system: Composed) -> Composed:
    """The system with every element of its parts in halves along each side; references to nodes follow.

    Raises
    ------
    InputError
        If there are none, or a part cannot be refined; the sentence names it.
    """
    finer = {name: part.refined(name, system.parts) for name, part in system.parts.items()}
    changed = {name for name, part in system.parts.items() if finer[name] is not part}
    if not changed:
        raise InputError("mesh_error is given, but no part has elements, as a beam, a rod, a thread or a shell has")
    found = system.copy()
    for name, part in finer.items():
        found.replace(name, _renumbered(part, system.parts, changed))
    return found


def _renumbered(part: Part, parts: Mapping[str, Part], changed: set[str]) -> Part:
    """A part whose references to nodes, "boom[5]", name the same places on the finer mesh, "boom[10]"."""

    def same(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(same, value))
        if isinstance(value, str):
            name, node = split_reference(value)
            if isinstance(node, int) and name in changed:
                return f"{name}[{parts[name].refined_node(node)}]"
        return value

    keys = {}
    for key, field in type(part).model_fields.items():
        if any(isinstance(mark, Reference) for mark in marks(field)):
            before = getattr(part, key)
            if (after := same(before)) != before:
                keys[key] = after
    return part.with_keys(**keys) if keys else part


def of_modes(coarse: VibrationModes, fine: VibrationModes, parts: Mapping[str, Part]) -> MeshError:
    """Of the frequencies (k,), Hz, of modes that are paired by their shapes.

    Notes
    -----
    The pairs have the best agreement of displacements and rotations at all points that both meshes have, together with
    the least difference of frequencies. Modes that agree with none, or do not oscillate, have no estimate.
    """
    names = {name: _refined_name(name, parts) for name in coarse._points}
    both = [(name, finer) for name, finer in names.items() if finer in fine._points]
    a, b = _shapes(coarse, [name for name, _ in both]), _shapes(fine, [finer for _, finer in both])
    f, g = coarse.frequency_hz, fine.frequency_hz
    size = np.outer(np.sum(np.abs(a) ** 2, axis=1), np.sum(np.abs(b) ** 2, axis=1))
    alike = np.abs(a.conj() @ b.T) ** 2 / np.maximum(size, 1e-300)
    apart = np.abs(f[:, None] - g) / np.maximum(np.maximum(f[:, None], g), 1e-300)
    rows, columns = scipy.optimize.linear_sum_assignment(1.0 - alike + apart)
    partner = np.full(f.size, np.nan)
    partner[rows] = np.where((alike[rows, columns] > ALIKE) | (apart[rows, columns] < 1e-3), g[columns], np.nan)
    size = np.abs(coarse.pole)
    still = size <= 1e-6 * np.max(size, initial=0.0)
    partner[still] = f[still]
    partner[~still & (f == 0.0)] = np.nan  # which grow or decay without oscillating
    return richardson(f, partner)


def _shapes(found: VibrationModes, names: Sequence[str]) -> Array:
    """Displacements over the structure's size, and rotations, of points by their names: (k, m)."""
    points = {name: found._points[name] for name in names}
    position = np.array([place.position for place in points.values()])
    size = float(np.max(np.ptp(position, axis=0), initial=0.0)) or 1.0
    columns = []
    for place in points.values():
        for T, unit in ((place.displacement, size), (place.rotation, 1.0)):
            if T is not None:
                columns.append(found.shape[:, place.where] @ T.T / unit)
    return np.hstack(columns)


def _refined_name(name: str, parts: Mapping[str, Part]) -> str:
    """Name of a point on the finer mesh."""
    part, node = split_reference(name)
    return f"{part}[{parts[part].refined_node(node)}]" if isinstance(node, int) and part in parts else name


def note(coarse: xr.DataTree, fine: xr.DataTree, parts: Mapping[str, Part]) -> None:
    """Give what the parts of an equilibrium show attributes `extrapolated`, in their unit, and `mesh_error`.

    Joints at the nodes of a seam are no parts of the system, and at other places on the finer mesh.
    """
    for part, name in shown(coarse):
        if part not in parts:
            continue
        value, finer = (np.asarray(run[part][name].to_numpy()[-1]) for run in (coarse, fine))
        best = richardson(value, finer).extrapolated
        off, size = float(np.linalg.norm(value - best)), float(np.linalg.norm(best))
        coarse[part][name].attrs |= {"extrapolated": best, "mesh_error": off / size if size > 0.0 else 0.0}


def shown(run: xr.DataTree) -> list[tuple[str, str]]:
    """Parts and variables that are numbers or vectors, of what the parts of a run show."""
    names = [(part, name) for part in run.children for name in show.plots_of(run, part)]
    return [(part, name) for part, name in names if set(run[part][name].dims) <= {"time", "axis"}]


def lines(run: xr.DataTree) -> list[tuple[str, str]]:
    """Labels and texts of the estimates in an equilibrium, for the screen."""
    found = []
    for part, name in shown(run):
        attrs: dict[Any, Any] = dict(run[part][name].attrs)
        if "mesh_error" in attrs:
            values = ", ".join(f"{x:.6g}" for x in np.atleast_1d(attrs["extrapolated"]))
            text = f"{100.0 * attrs['mesh_error']:.2g} %, extrapolated {values} {attrs.get('units', '')}"
            found.append((f"{part}.{name}, mesh error", text.strip()))
    return found
