"""Warnings about a case before it is run."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator

from evolvent import closed_forms, elements
from evolvent_papers.wrapped_rib.case import Case
from evolvent_papers.wrapped_rib.keys import ALPHA

#: Strain above which a run warns.
STRAIN_WARNED = 0.05
#: Relative error of the bending stiffness of the mesh above which a case warns.
STIFFNESS_OFF = 0.05
#: Depth, of the hub's radius, to which a rib may sink into it without a warning.
SUNK_WARNED = 0.01
#: Spectral radius above which a run with contact warns.
SPECTRAL_RADIUS_WARNED = 0.8
#: What a strain is beyond, in warnings.
BEYOND = "beyond the range of linear elasticity and of most materials"


@functools.lru_cache(maxsize=8)
def bending_stiffness_ratio(case: Case) -> float:
    """Effective over true stiffness of one element (of a taper, the thinnest) bent to the hub's radius or helix."""
    rib = case.rib
    bent = (rib.element_length, rib.section(rib.thinnest), rib.material)
    if rib.pitch > 0.0:
        return elements.helix_stiffness_ratio(rib.formulation, *bent, case.hub.radius, rib.pitch)
    return elements.bending_stiffness_ratio(rib.formulation, *bent, case.hub.radius)


def warnings(case: Case) -> list[str]:
    """Warnings about a case, a sentence each."""
    return [*_of_mesh(case), *_of_helix(case), *_of_drive(case), *_of_steps(case)]


def _of_mesh(case: Case) -> Iterator[str]:
    rib, R = case.rib, case.hub.radius
    ratio, cables = bending_stiffness_ratio(case), ("cable", "cable_stretch", "assumed_strain")
    if abs(ratio - 1.0) > STIFFNESS_OFF:
        off = f"{ratio:.3g}" if ratio < 100.0 else f"{ratio:.2e}"
        yield (
            f"bent to the hub's radius, the mesh is {off} times as stiff as the rib: each of {rib.elements} "
            f"{rib.formulation} elements spans {math.degrees(rib.element_length / R):.3g} deg; use more elements"
            + ("" if rib.formulation in cables else ", or rib.formulation: cable")
        )
    if rib.formulation == "full" and rib.poisson != 0.0:
        factor = (1.0 - rib.poisson) / ((1.0 + rib.poisson) * (1.0 - 2.0 * rib.poisson))
        yield (
            f"however fine the mesh, rib.formulation 'full' bends {factor:.3g} times too stiff at rib.poisson "
            f"{rib.poisson:g}; use nu_split, assumed_strain or cable"
        )
    half = 0.5 * case.contact_spacing
    depth = R - math.sqrt(R * R - half * half)  # of a straight rib between two contact points
    if depth > SUNK_WARNED * R:
        yield (
            f"contact points are {2.0 * half:.3g} m apart, between which the rib may sink {depth:.2g} m into the hub "
            f"without contact; use more contact.points"
        )


def _of_helix(case: Case) -> Iterator[str]:
    rib = case.rib
    if case.turns_overlap:
        yield (
            f"rib.pitch {rib.pitch:g} m is less than the rib's width on the hub, so that turns overlap in part and "
            f"pass through one another; use one of {case.clear_pitch:.4g} m or more, or 0"
        )


def _of_drive(case: Case) -> Iterator[str]:
    drive, strip, rib = case.drive, case.strip, case.rib
    if drive is not None and drive.kind == "tip" and drive.stretch > STRAIN_WARNED:
        yield f"drive.stretch {drive.stretch:g} is {BEYOND}"
    if drive is None or drive.torque is None:
        return
    torque = f"drive.torque {drive.torque:g} N m"
    strain = closed_forms.root_strain(strip, drive.torque)
    if strain > STRAIN_WARNED:
        yield f"{torque} strains the wound rib's root by {100.0 * strain:.3g} %, {BEYOND}"
    # the work T for each radian wound must exceed the bending energy, EI/(2 R) with EI of the mesh
    needed = bending_stiffness_ratio(case) * closed_forms.least_winding_torque(strip, rib.curvatures[1])
    if drive.kind == "torque" and case.phase == "wind" and drive.torque <= needed:
        takes = "EI/(2 R)" if rib.shape is None else "EI (1/R - k)/2 where its curvature k is largest"
        yield f"{torque} cannot wind the rib: bending it onto the hub takes {takes} = {needed:.3g} N m, EI of the mesh"
    turned = 0.5 * math.pi - rib.start_angle
    size = math.sqrt(strip.bending_stiffness * strip.radius / drive.torque)
    if rib.root == "clamp" and case.begins == "straight" and turned >= 0.1 and size <= rib.element_length:
        yield (
            f"the clamp is {math.degrees(turned):.3g} deg from the hub's tangent, to which the tension bends the "
            f"rib within {size:.2g} m, less than an element's {rib.element_length:.2g} m; use rib.root: hinge, or "
            f"rib.start_angle: 90 deg"
        )


def _of_steps(case: Case) -> Iterator[str]:
    solver, contact, damping = case.solver, case.contact, case.damping
    bounce = math.pi / case.contact_frequency
    if case.method == ALPHA and solver.step != "auto" and float(solver.step) > bounce:
        yield (
            f"solver.step {solver.step:g} s is too large for the contact, on which a contact point bounces in "
            f"{bounce:.2g} s; longer steps can add energy: see energy_defect, or use step: auto"
        )
    if case.method == ALPHA and contact.law == "paper" and contact.damping > 0.0:
        yield "contact.law 'paper' jumps at the touch, where an implicit step may have no solution; use hunt-crossley"
    if case.method == ALPHA and (solver.spectral_radius or 0.0) > SPECTRAL_RADIUS_WARNED:
        yield (
            f"solver.spectral_radius {solver.spectral_radius:g} keeps high-frequency vibration of the contact; use "
            f"about 0.3"
        )
    if damping.beta > 0.0 and damping.kind == "paper":
        yield "damping.kind 'paper' acts on rotations: a spinning rib gains or loses energy by damping.beta"
