"""Elements as a model calls them, by address: force, tangent and energy of each kind, all with the same arguments.

A force and a tangent are those over an interval, as of `ancf.force_of` and `ancf.tangent_of`; a state is one of length
0. What a kind does not need it ignores. An element is elastic where its damping b is 0.
"""

from typing import Any, NamedTuple

from numba import void

from evolvent.compiled.jit import MATRIX, REAL, VECTOR, indirect
from evolvent.families.beams import cable
from evolvent.kernels import ancf
from evolvent.kernels.ancf import INTERVAL
from evolvent.kernels.ancf_beams import GROUP_ENERGIES, GROUP_FORCES

_FORCE = REAL(VECTOR, VECTOR, INTERVAL, REAL, MATRIX, VECTOR, MATRIX, VECTOR, VECTOR, VECTOR)
_TANGENT = void(VECTOR, VECTOR, INTERVAL, REAL, REAL, MATRIX, VECTOR, MATRIX, VECTOR, VECTOR, MATRIX)
_ENERGY = REAL(VECTOR, MATRIX, VECTOR, REAL, VECTOR)


class Functions(NamedTuple):
    """Functions of one kind of element, called by address.

    group_forces and group_energies evaluate consecutive elements with equal constants (forces: without damping); None
    if a kind does not have them.
    """

    force: Any
    tangent: Any
    energy: Any
    group_forces: Any = None
    group_energies: Any = None


@indirect(_FORCE, disjoint=True)
def cable_force(e, u, interval, b, H, h, B, changes, work, f):
    """A cable with objective damping of membrane and bending."""
    power = ancf.force_of(e, u, interval, b, H, h, cable.N, changes, work, f)
    return power + cable.add_bending_losses(e, u, interval, b, B, changes, f)


@indirect(_TANGENT, disjoint=True)
def cable_tangent(e, u, interval, b, c, H, h, B, changes, work, K):
    """A cable with objective damping of membrane and bending."""
    ancf.tangent_of(e, u, interval, b, c, H, h, cable.N, changes, work, K)
    cable.add_bending_losses_tangent(e, u, interval, b, c, B, K)


@indirect(_FORCE, disjoint=True)
def paper_cable_force(e, u, interval, b, H, h, B, changes, work, f):
    """A cable with the paper's damping, bending included; at states only."""
    return ancf.paper_damped_force_of(e, u, b, H, h, cable.N, work, f)


@indirect(_TANGENT, disjoint=True)
def paper_cable_tangent(e, u, interval, b, c, H, h, B, changes, work, K):
    """A cable with the paper's damping, bending included; at states only."""
    ancf.paper_damped_tangent_of(e, u, b, c, H, h, cable.N, work, K)


@indirect(_FORCE, disjoint=True)
def beam_force(e, u, interval, b, H, h, B, changes, work, f):
    """A beam with objective damping."""
    return ancf.force_of(e, u, interval, b, H, h, ancf.N, changes, work, f)


@indirect(_TANGENT, disjoint=True)
def beam_tangent(e, u, interval, b, c, H, h, B, changes, work, K):
    """A beam with objective damping."""
    ancf.tangent_of(e, u, interval, b, c, H, h, ancf.N, changes, work, K)


@indirect(_FORCE, disjoint=True)
def paper_beam_force(e, u, interval, b, H, h, B, changes, work, f):
    """A beam with the paper's damping; at states only."""
    return ancf.paper_damped_force_of(e, u, b, H, h, ancf.N, work, f)


@indirect(_TANGENT, disjoint=True)
def paper_beam_tangent(e, u, interval, b, c, H, h, B, changes, work, K):
    """A beam with the paper's damping; at states only."""
    ancf.paper_damped_tangent_of(e, u, b, c, H, h, ancf.N, work, K)


@indirect(_FORCE, disjoint=True)
def stretch_force(e, u, interval, b, H, h, B, changes, work, f):
    """A cable with engineering strain."""
    return cable.stretch_force(e, u, interval, b, H, h, B, changes, work, f)


@indirect(_TANGENT, disjoint=True)
def stretch_tangent(e, u, interval, b, c, H, h, B, changes, work, K):
    """A cable with engineering strain."""
    cable.stretch_tangent(e, u, interval, b, c, H, h, B, changes, work, K)


@indirect(GROUP_FORCES, disjoint=True)
def stretch_forces(y, a, scale, n, H, h, M, work, F):
    """Group of cable elements with engineering strain."""
    cable.stretch_forces(y, a, scale, n, H, h, M, work, F)


@indirect(GROUP_ENERGIES, disjoint=True)
def stretch_energies(y, u, n, H, h, bending_H, bending_h, M, work, out):
    """Group of cable elements with engineering strain."""
    cable.stretch_energies(y, u, n, H, h, bending_H, bending_h, M, work, out)


@indirect(_ENERGY, disjoint=True)
def cable_energy(e, H, h, U0, work):
    """Any cable but those with engineering strain."""
    return ancf.energy_of(e, H, h, U0, cable.N, work)


@indirect(_ENERGY, disjoint=True)
def stretch_energy(e, H, h, U0, work):
    """A cable with engineering strain."""
    return cable.stretch_energy(e, H, h, U0, work)


@indirect(_ENERGY, disjoint=True)
def beam_energy(e, H, h, U0, work):
    """Any beam."""
    return ancf.energy_of(e, H, h, U0, ancf.N, work)


#: Kinds of damping.
OBJECTIVE, PAPER = "objective", "paper"
#: By kind of element and of damping.
CABLES = {
    OBJECTIVE: Functions(cable_force, cable_tangent, cable_energy),
    PAPER: Functions(paper_cable_force, paper_cable_tangent, cable_energy),
}
STRETCH_CABLES = {
    OBJECTIVE: Functions(stretch_force, stretch_tangent, stretch_energy, stretch_forces, stretch_energies)
}
BEAMS = {
    OBJECTIVE: Functions(beam_force, beam_tangent, beam_energy),
    PAPER: Functions(paper_beam_force, paper_beam_tangent, beam_energy),
}
