"""Observations of temperatures of beams and rods: free strains, and what they take from the strains of the beams."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.elements.thermal import free_strains
from evolvent.parts.beam import GAUSS
from evolvent.results.observe.variables import Observed
from evolvent.results.observe.view import View
from evolvent.solvers import heating

Array = np.ndarray


def free_strain(view: View, index: int, at: Any) -> Array | None:
    """Free strain and curvatures of a beam (nt, elements, points, 3) at points of each element; None without a load."""
    model = view.model
    found = None
    for k in np.flatnonzero(model.flexible.thermal_loads["beam"] == index):
        load, beam = _parts(view, int(k))
        a = heating.amplitudes(model, int(k), view.t, view.load_factor)
        expansion = float(beam.material.thermal_expansion)
        places = (beam.arc[:-1, None] + beam.lengths[:, None] * np.asarray(at)) / beam.length
        factors = np.ravel(load.factor(places))
        F = np.array([free_strains(expansion * c, green=beam.formulation != "cable_stretch") for c in factors])
        found = np.einsum("psj,tj->tps", F, a).reshape(view.t.size, *places.shape, 3)
    return found


def _parts(view: View, index: int) -> tuple[Any, Any]:
    """A thermal load and its beam, as the user wrote them."""
    names = view.assembly.names
    name = next(name for name, found in names.items() if found == ("thermal_loads", index))
    load = view.part(name)
    return load, view.part(load.beam)


def observe_thermal_load(view: View, name: str) -> Observed:
    """Temperatures, free strains and curvatures, and the work done as they change."""
    found, index = Observed(), view.index(name)
    load, beam = _parts(view, index)
    a = heating.amplitudes(view.model, index, view.t, view.load_factor)
    found.scalar("temperature", a[:, 0], "K", "change of the temperature of the axis, where `along` is 1")
    found.scalar("gradient_y", a[:, 2], "K m-1", "gradient of the temperature along y, where `along` is 1")
    found.scalar("gradient_z", a[:, 4], "K m-1", "gradient of the temperature along z, where `along` is 1")
    row = view.model.flexible.thermal_loads[index]
    if row["rod"] >= 0:
        _observe_rod(load, beam, heating.free_rod_strains(view.model, row, a), a, found)
        _observe_work(view, index, found)
        return found
    strain = free_strain(view, int(row["beam"]), GAUSS)
    assert strain is not None
    strain = strain.reshape(view.t.size, -1, 3)
    where = "at two points of each element"
    arc = (beam.arc[:-1, None] + beam.lengths[:, None] * np.asarray(GAUSS)).ravel()
    factors = load.factor(arc / beam.length)
    found.along("temperature_change", "section", np.outer(a[:, 0], factors), "K", f"change of temperature {where}")
    found.along("free_strain", "section", strain[..., 0], "1", f"strain of the axis without stress {where}")
    if beam.vectors == 4:
        found.along("free_curvature_y", "section", strain[..., 2], "m-1", f"curvature towards z without stress {where}")
        found.along("free_curvature_z", "section", strain[..., 1], "m-1", f"curvature towards y without stress {where}")
    found.coordinate("arc", "section", arc, "m", "length from the root to the two points of each element")
    _observe_work(view, index, found)
    return found


def _observe_rod(load: Any, rod: Any, strain: Array, a: Array, found: Observed) -> None:
    """Temperatures and free strains of the elements of a rod."""
    where = "of each element"
    found.along(
        "temperature_change",
        "section",
        np.outer(a[:, 0], load.means(rod.arc / rod.length)),
        "K",
        f"change of temperature {where}",
    )
    found.along("free_strain", "section", strain[..., 0], "1", f"strain of the axis without stress {where}")
    found.along("free_curvature_y", "section", strain[..., 4], "m-1", f"curvature about y without stress {where}")
    found.along("free_curvature_z", "section", strain[..., 5], "m-1", f"curvature about z without stress {where}")
    arc = 0.5 * (rod.arc[1:] + rod.arc[:-1])
    found.coordinate("arc", "section", arc, "m", "length from the root to the elements' middles")


def _observe_work(view: View, index: int, found: Observed) -> None:
    """The work done as the free strain changes."""
    heated = heating.energies(view.model, index, view.t, view.y, view.load_factor)
    text = "work done as the free strain changes, since the first sample, by the trapezoidal rule over the samples"
    found.scalar("work", heated.work, "J", text)
    found.plots, found.plots_along = ["temperature"], ["free_strain"]
