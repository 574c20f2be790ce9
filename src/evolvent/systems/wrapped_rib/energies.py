"""Energies, work and momenta of a run, as variables of its data set."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from evolvent.motion import rotation_matrices
from evolvent.systems.wrapped_rib.case import Case
from evolvent.systems.wrapped_rib.kinematics import Motion, along

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.builder import Assembly
    from evolvent.solvers import Solution


def energies_and_momenta(case: Case, assembly: Assembly, solution: Solution, motion: Motion) -> dict[str, xr.Variable]:
    """Energies, what dissipates them, momenta."""
    from evolvent.results import variable
    from evolvent.solvers import balance as eb

    rows = solution.balance
    kinetic, contact, coupled = rows.kinetic, rows.contact, rows.coupled
    elastic, bending = rows.elastic - contact, rows.bending
    if case.rib.formulation == "cable_stretch":
        bending = _stretch_bending(case, motion)
    elif case.rib.vectors == 4:
        bending = _bending(assembly, motion)
    work, gained = eb.work(rows), solution.energy_defect
    taken = np.stack(
        [
            rows.by_mass,
            rows.by_stiffness,
            rows.by_contact,
            rows.by_friction,
            rows.by_joints + rows.by_springs,
            -gained,
        ],
        axis=1,
    )
    largest = max(float(solution.energy.max()), float(np.abs(work).max()), 1e-300)
    linear, angular = _momenta(case, assembly, motion)
    time, axis = ("time",), ("time", "axis")
    return {
        "energy_kinetic": variable(time, kinetic, "J", "kinetic energy"),
        "energy_elastic": variable(time, elastic, "J", "strain energy of the ribs"),
        "energy_membrane": variable(time, elastic - bending, "J", "strain energy of all but bending"),
        "energy_bending": variable(time, bending, "J", "strain energy of bending"),
        "energy_contact": variable(time, contact, "J", "energy of the contacts' springs"),
        "energy_joints": variable(time, coupled, "J", "energy of springs in the hinges, and of penalties"),
        "energy_dissipated": variable(("time", "cause"), taken, "J", "energy taken so far, by what takes it"),
        "work_external": variable(time, work, "J", "work of the drive so far"),
        "energy_balance": variable(
            time,
            gained / largest,
            "1",
            "what the energy balance has gained over the largest energy; below zero, damping by the method itself",
            scale_J=largest,
        ),
        "linear_momentum": variable(axis, linear, "kg m s-1", "linear momentum of ribs and a free hub"),
        "angular_momentum": variable(axis, angular, "kg m2 s-1", "angular momentum about the inertial origin"),
    }


def _bending(assembly: Assembly, motion: Motion) -> np.ndarray:
    """Bending energy of beams of 24 coordinates, J : (nt,)."""
    from evolvent import elements
    from evolvent.elements.forms import products

    f = assembly.model.flexible
    i, j = np.triu_indices(7)
    total = np.zeros(motion.nodes.shape[0])
    for b in range(motion.nodes.shape[1]):
        beam = f.beams[assembly.index(f"rib-{b + 1}", "beams")]
        for c in range(int(beam["elements"])):
            element = f.elements[int(beam["first_element"]) + c]
            e = motion.nodes[:, b, c : c + 2].reshape(-1, 8, 3)
            v = e[:, 1:].copy()
            v[:, 3] -= e[:, 0]
            g = np.einsum("tpi,tpi->tp", v[:, i], v[:, j]) - products(elements.straight_beam(float(element["length"])))
            total += 0.5 * np.einsum("tp,pq,tq->t", g, f.bend24[int(element["form"])], g)
    return total


def _stretch_bending(case: Case, motion: Motion) -> np.ndarray:
    """Bending energy of cables with engineering strain, J : (nt,); 1/2 int EI k^2 dx at the elements' three points."""
    rib = case.rib
    at, weight = np.polynomial.legendre.leggauss(3)
    xi = 0.5 * (1.0 + at)
    slope, bend = along(motion.nodes, rib.element_length, xi, 1), along(motion.nodes, rib.element_length, xi, 2)
    squared = np.einsum("...i,...i->...", slope, slope)
    across = np.cross(slope, bend)
    curvature2 = np.einsum("...i,...i->...", across, across) / squared**2
    Iz = np.array([[rib.section(k).at(x).properties(rib.poisson).Iz for x in xi] for k in range(rib.elements)])
    EI = rib.young_modulus * Iz
    found: np.ndarray = 0.25 * rib.element_length * np.einsum("tbnk,nk,k->t", curvature2, EI, weight)
    return found


def _momenta(case: Case, assembly: Assembly, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Linear and angular momentum about the inertial origin, (nt, 3) each."""
    f = assembly.model.flexible
    pool = f.M12 if case.rib.vectors == 2 else f.M24
    P, H = np.zeros((motion.x.shape[0], 3)), np.zeros((motion.x.shape[0], 3))
    k = motion.nodes.shape[3]
    for b in range(motion.nodes.shape[1]):
        beam = f.beams[assembly.index(f"rib-{b + 1}", "beams")]
        mass = pool[f.elements["mass"][int(beam["first_element"]) : int(beam["first_element"]) + int(beam["elements"])]]
        e = np.concatenate([motion.nodes[:, b, :-1], motion.nodes[:, b, 1:]], axis=2)
        u = np.concatenate([motion.rates[:, b, :-1], motion.rates[:, b, 1:]], axis=2)
        p = np.einsum("cij,tcjx->tcix", mass, u)
        P += p[:, :, 0].sum(axis=1) + p[:, :, k].sum(axis=1)
        H += np.cross(e, p).sum(axis=(1, 2))
    hub = assembly.model.bodies[assembly.index("hub", "bodies")]
    if case.hub.motion == "free":
        P += hub["mass"] * motion.v
        H += hub["mass"] * np.cross(motion.x, motion.v)
        H += np.einsum("tij,jk,tk->ti", rotation_matrices(motion.q), hub["inertia"], motion.w)
    elif case.hub.motion != "fixed":
        H[:, 2] += hub["spin_inertia"] * motion.w[:, 2]
    return P, H
