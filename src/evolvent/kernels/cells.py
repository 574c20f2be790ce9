"""Elements as a model calls them, by address: force, tangent and energy of each kind, all with the same arguments.

Arguments are those of `kernels.ancf` and `kernels.cable`; what a kind does not need it ignores.
"""

from typing import Any, NamedTuple

from evolvent.jit import kernel
from evolvent.kernels import ancf, cable


class Functions(NamedTuple):
    """Functions of one kind of element, for `evolvent.jit.address`."""

    force: Any
    tangent: Any
    energy: Any


@kernel
def cable_force(e, u, b, H, h, B, work, f):
    """An elastic cable."""
    cable.cable_force(e, H, h, work, f)
    return 0.0


@kernel
def cable_tangent(e, u, b, c, H, h, B, work, K):
    """An elastic cable."""
    cable.cable_tangent(e, H, h, work, K)


@kernel
def damped_cable_force(e, u, b, H, h, B, work, f):
    """A cable with objective damping of membrane and bending."""
    return cable.cable_damped_force(e, u, b, H, h, work, f) + cable.add_bending_damping(e, u, b, B, f)


@kernel
def damped_cable_tangent(e, u, b, c, H, h, B, work, K):
    """A cable with objective damping of membrane and bending."""
    cable.cable_damped_tangent(e, u, b, c, H, h, work, K)
    cable.add_bending_damping_tangent(e, u, b, c, B, K)


@kernel
def paper_cable_force(e, u, b, H, h, B, work, f):
    """A cable with the paper's damping."""
    return cable.cable_paper_damped_force(e, u, b, H, h, work, f)


@kernel
def paper_cable_tangent(e, u, b, c, H, h, B, work, K):
    """A cable with the paper's damping."""
    cable.cable_paper_damped_tangent(e, u, b, c, H, h, work, K)


@kernel
def beam_force(e, u, b, H, h, B, work, f):
    """An elastic beam."""
    ancf.beam_force(e, H, h, work, f)
    return 0.0


@kernel
def beam_tangent(e, u, b, c, H, h, B, work, K):
    """An elastic beam."""
    ancf.beam_tangent(e, H, h, work, K)


@kernel
def damped_beam_force(e, u, b, H, h, B, work, f):
    """A beam with objective damping."""
    return ancf.beam_damped_force(e, u, b, H, h, work, f)


@kernel
def damped_beam_tangent(e, u, b, c, H, h, B, work, K):
    """A beam with objective damping."""
    ancf.beam_damped_tangent(e, u, b, c, H, h, work, K)


@kernel
def paper_beam_force(e, u, b, H, h, B, work, f):
    """A beam with the paper's damping."""
    return ancf.beam_paper_damped_force(e, u, b, H, h, work, f)


@kernel
def paper_beam_tangent(e, u, b, c, H, h, B, work, K):
    """A beam with the paper's damping."""
    ancf.beam_paper_damped_tangent(e, u, b, c, H, h, work, K)


ELASTIC, OBJECTIVE, PAPER = "elastic", "objective", "paper"
#: By kind of element and of damping.
CABLES = {
    ELASTIC: Functions(cable_force, cable_tangent, cable.cable_energy),
    OBJECTIVE: Functions(damped_cable_force, damped_cable_tangent, cable.cable_energy),
    PAPER: Functions(paper_cable_force, paper_cable_tangent, cable.cable_energy),
}
_STRETCH = Functions(cable.cable_stretch_force, cable.cable_stretch_tangent, cable.cable_stretch_energy)
STRETCH_CABLES = {ELASTIC: _STRETCH, OBJECTIVE: _STRETCH}
BEAMS = {
    ELASTIC: Functions(beam_force, beam_tangent, ancf.beam_energy),
    OBJECTIVE: Functions(damped_beam_force, damped_beam_tangent, ancf.beam_energy),
    PAPER: Functions(paper_beam_force, paper_beam_tangent, ancf.beam_energy),
}
