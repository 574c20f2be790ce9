"""Elements as a model calls them, by address: force, tangent and energy of each kind, all with the same arguments.

Arguments are those of `kernels.ancf` and `kernels.cable`; what a kind does not need it ignores.
"""

from typing import Any, NamedTuple

from numba import void

from evolvent.compiled.jit import MATRIX, REAL, VECTOR, indirect
from evolvent.kernels import ancf, cable

_FORCE = REAL(VECTOR, VECTOR, REAL, MATRIX, VECTOR, MATRIX, VECTOR, VECTOR)
_TANGENT = void(VECTOR, VECTOR, REAL, REAL, MATRIX, VECTOR, MATRIX, VECTOR, MATRIX)
_ENERGY = REAL(VECTOR, MATRIX, VECTOR, REAL, VECTOR)


class Functions(NamedTuple):
    """Functions of one kind of element, called by address."""

    force: Any
    tangent: Any
    energy: Any


@indirect(_FORCE, disjoint=True)
def cable_force(e, u, b, H, h, B, work, f):
    """An elastic cable."""
    cable.cable_force(e, H, h, work, f)
    return 0.0


@indirect(_TANGENT, disjoint=True)
def cable_tangent(e, u, b, c, H, h, B, work, K):
    """An elastic cable."""
    cable.cable_tangent(e, H, h, work, K)


@indirect(_FORCE, disjoint=True)
def damped_cable_force(e, u, b, H, h, B, work, f):
    """A cable with objective damping of membrane and bending."""
    return cable.cable_damped_force(e, u, b, H, h, work, f) + cable.add_bending_damping(e, u, b, B, f)


@indirect(_TANGENT, disjoint=True)
def damped_cable_tangent(e, u, b, c, H, h, B, work, K):
    """A cable with objective damping of membrane and bending."""
    cable.cable_damped_tangent(e, u, b, c, H, h, work, K)
    cable.add_bending_damping_tangent(e, u, b, c, B, K)


@indirect(_FORCE, disjoint=True)
def paper_cable_force(e, u, b, H, h, B, work, f):
    """A cable with the paper's damping."""
    return cable.cable_paper_damped_force(e, u, b, H, h, work, f)


@indirect(_TANGENT, disjoint=True)
def paper_cable_tangent(e, u, b, c, H, h, B, work, K):
    """A cable with the paper's damping."""
    cable.cable_paper_damped_tangent(e, u, b, c, H, h, work, K)


@indirect(_FORCE, disjoint=True)
def beam_force(e, u, b, H, h, B, work, f):
    """An elastic beam."""
    ancf.beam_force(e, H, h, work, f)
    return 0.0


@indirect(_TANGENT, disjoint=True)
def beam_tangent(e, u, b, c, H, h, B, work, K):
    """An elastic beam."""
    ancf.beam_tangent(e, H, h, work, K)


@indirect(_FORCE, disjoint=True)
def damped_beam_force(e, u, b, H, h, B, work, f):
    """A beam with objective damping."""
    return ancf.beam_damped_force(e, u, b, H, h, work, f)


@indirect(_TANGENT, disjoint=True)
def damped_beam_tangent(e, u, b, c, H, h, B, work, K):
    """A beam with objective damping."""
    ancf.beam_damped_tangent(e, u, b, c, H, h, work, K)


@indirect(_FORCE, disjoint=True)
def paper_beam_force(e, u, b, H, h, B, work, f):
    """A beam with the paper's damping."""
    return ancf.beam_paper_damped_force(e, u, b, H, h, work, f)


@indirect(_TANGENT, disjoint=True)
def paper_beam_tangent(e, u, b, c, H, h, B, work, K):
    """A beam with the paper's damping."""
    ancf.beam_paper_damped_tangent(e, u, b, c, H, h, work, K)


@indirect(_FORCE, disjoint=True)
def stretch_force(e, u, b, H, h, B, work, f):
    """A cable with engineering strain, damped or not."""
    return cable.cable_stretch_force(e, u, b, H, h, B, work, f)


@indirect(_TANGENT, disjoint=True)
def stretch_tangent(e, u, b, c, H, h, B, work, K):
    """A cable with engineering strain, damped or not."""
    cable.cable_stretch_tangent(e, u, b, c, H, h, B, work, K)


@indirect(_ENERGY, disjoint=True)
def cable_energy(e, H, h, U0, work):
    """Any cable but those with engineering strain."""
    return cable.cable_energy(e, H, h, U0, work)


@indirect(_ENERGY, disjoint=True)
def stretch_energy(e, H, h, U0, work):
    """A cable with engineering strain."""
    return cable.cable_stretch_energy(e, H, h, U0, work)


@indirect(_ENERGY, disjoint=True)
def beam_energy(e, H, h, U0, work):
    """Any beam."""
    return ancf.beam_energy(e, H, h, U0, work)


ELASTIC, OBJECTIVE, PAPER = "elastic", "objective", "paper"
#: By kind of element and of damping.
CABLES = {
    ELASTIC: Functions(cable_force, cable_tangent, cable_energy),
    OBJECTIVE: Functions(damped_cable_force, damped_cable_tangent, cable_energy),
    PAPER: Functions(paper_cable_force, paper_cable_tangent, cable_energy),
}
_STRETCH = Functions(stretch_force, stretch_tangent, stretch_energy)
STRETCH_CABLES = {ELASTIC: _STRETCH, OBJECTIVE: _STRETCH}
BEAMS = {
    ELASTIC: Functions(beam_force, beam_tangent, beam_energy),
    OBJECTIVE: Functions(damped_beam_force, damped_beam_tangent, beam_energy),
    PAPER: Functions(paper_beam_force, paper_beam_tangent, beam_energy),
}
