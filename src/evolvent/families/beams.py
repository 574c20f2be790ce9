"""Beams, their nodes and elements."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.model.family import ENERGY, EVERY, Family, Kind, record, where
from evolvent.model.shares import ELASTIC, Elastic, Rule, Shares

Array = np.ndarray
_3, _33 = (3,), (3, 3)


def _unforced(model: Any) -> dict[str, Array]:
    H, h = np.zeros_like(model.H), np.zeros_like(model.h)
    forms = model.elements["form"][model.elements["stretch"] != 0]  # whose first rows are no stiffness
    H[forms, :3], h[forms] = model.H[forms, :3], model.h[forms]
    return {"H": H, "h": h}


def _stiff(whole: Any, bare: Any, index: int) -> dict[str, Array]:
    return {name: getattr(whole, name) for name in ("H", "h", "thermal_loads")}


# beams; a node's coordinates stand together, node after node; first_node: number of the first among
# the nodes of all beams and rods; paper: 1 where the damping is the paper's, which a turn of the whole feels; held:
# 1 where rows of constraint act on its nodes; axes: rows x along, y and z of the root
BEAMS = Family(
    "beams",
    record(
        "kind iq iv nodes first_element elements first_node paper held", "length",
        "kinetic elastic bending linear angular axes", linear=_3, angular=_3, axes=_33,
    ),
    order=150,
    results={
        "kinetic": ("energy_kinetic", "J", "kinetic energy"),
        "elastic": ("energy_elastic", "J", "strain energy"),
        "bending": ("energy_bending", "J", "strain energy of bending"),
        "linear": ("momentum", "kg m s-1", "linear momentum, inertial axes"),
        "angular": ("angular_momentum", "kg m2 s-1", "angular momentum about the inertial origin"),
        "axes": ("root_axes", "1", "axes of the root, rows x along, y and z across, inertial axes"),
    },
    kinds=(
        Kind("a beam", which=where("paper", 0), symmetric=True),
        Kind(
            "a beam with the paper's damping", EVERY - {ENERGY}, "use `damping` 'objective', or generalized-alpha",
            which=where("paper", 1),
            symmetric=True,
        ),
    ),
    isolated=lambda found, records: not np.any(found["paper"] != 0) and not np.any(records("elements")["alpha"] != 0.0),
    local=True,
    reads_inertia=False,
    smooth=True,
    shares=Shares((Rule(ELASTIC),), place=10, unforced=_unforced, elastic=Elastic(_stiff)),
    conserved="beams",
    stiff=lambda _: "beams are stiff",
)  # fmt: skip

# nodes of beams and rods; undeformed: position without stress, from the root, in its axes; share: part of the rod
BEAM_NODES = Family(
    "beam_nodes",
    record(
        "", "undeformed share", "x v slope deflection curvature", undeformed=_3, x=_3, v=_3, slope=_3, deflection=_3
    ),
    order=160,
    results={
        "x": ("position", "m", "positions of the nodes, inertial axes"),
        "v": ("velocity", "m s-1", "velocities of the nodes, inertial axes"),
        "slope": ("slope", "1", "{slopes}, inertial axes"),
        "deflection": (
            "deflection",
            "m",
            "deflections of the nodes from the shape without stress, in the axes of the root (x along, y and z across)",
        ),
        "curvature": ("curvature", "m-1", "{curvature} at the nodes"),
    },
    of="beams",
)  # fmt: skip

# form, bending, mass: indices in the pools of the model, bending of the form of that alone; force, tangent,
# energy: indices (`jit.slot`) of `kernels.element_calls`; stretch: 1 of a cable with engineering strain;
# section: index among the parameters of what `beam_strains` needs; changes: of products, stretches and curvatures
# over the step before, then over this one (`ancf.force_of`); free: strains by heat at `beam_strains.POINTS`; the
# others are in `RESULTS`
ELEMENTS = Family(
    "elements",
    record(
        "beam iq iv form bending mass force tangent energy stretch section", "length alpha beta thickness",
        "changes free strain axial_force energy_density shear_force_y shear_force_z bending_moment torsional_moment "
        "bending_moment_y bending_moment_z free_strain free_curvature_y free_curvature_z",
        changes=(56,), free=(5, 3),
        **dict.fromkeys(
            ("strain", "axial_force", "energy_density", "shear_force_y", "shear_force_z", "bending_moment",
             "free_strain", "free_curvature_y", "free_curvature_z"), (2,)
        ),
    ),
    order=170,
    results={
        "strain": ("strain", "1", "strain of the axis"),
        "axial_force": ("axial_force", "N", "force along the axis, positive where it pulls,"),
        "energy_density": ("energy_density", "J m-1", "strain energy per length"),
        "shear_force_y": ("shear_force_y", "N", "shear force along y {section},"),
        "shear_force_z": ("shear_force_z", "N", "shear force along z {section},"),
        "torsional_moment": ("torsional_moment", "N m", "moment about x {section},"),
        "bending_moment_y": ("bending_moment_y", "N m", "moment about y {section},"),
        "bending_moment_z": ("bending_moment_z", "N m", "moment about z {section},"),
        "bending_moment": ("bending_moment", "N m", "size of the bending moment"),
        "free_strain": ("free_strain", "1", "strain of the axis without stress"),
        "free_curvature_y": ("free_curvature_y", "m-1", "curvature towards z without stress"),
        "free_curvature_z": ("free_curvature_z", "m-1", "curvature towards y without stress"),
    },
    of="beams",
)  # fmt: skip
