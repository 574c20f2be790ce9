"""Room for the tangent of a model."""

from __future__ import annotations

from evolvent import model as mdl
from evolvent.algebra import ordering
from evolvent.algebra.sparse import OUTSIDE, SparseBlocks
from evolvent.assembly.assembled import Assembly
from evolvent.model.registry import asked, of_others
from evolvent.solvers.common import graph
from evolvent_base.errors import InputError

#: Redundant rows of joints that can be named.
MOST_REDUNDANT = 64


def matrix_of(model: mdl.Model, *, spare: int | None = None, layers: bool = False) -> SparseBlocks:
    """Room for the tangent of a model, and for `spare` deferred pivots; by default what redundant joints may need.

    Turns that lie on one another are inner unknowns; those that do so at present are coupled directly if `layers`. So
    is what a torque spread over a beam couples.
    """
    inner = sum(own(getattr(model, name)) for name, own in asked("implicit.inner").items())
    if spare is None:
        spare = min(model.constraints.size, MOST_REDUNDANT)
    return ordering.matrix_of(graph.pattern_of(model, layers=layers), spare=spare, inner=inner)


def matrix_for(assembly: Assembly) -> SparseBlocks:
    """`matrix_of` the model of an assembly; variants of a system share the order of its blocks."""
    shared = assembly.shared
    if shared is None or assembly.model.info.releases:
        return matrix_of(assembly.model)
    if "matrix" not in shared:
        shared["matrix"] = matrix_of(assembly.model)
    found: SparseBlocks = shared["matrix"].copy()
    return found


def check_covered(model: mdl.Model, matrix: SparseBlocks) -> None:
    """Refuse a tangent of families of other packages with entries that have no place in its storage, and are left out.

    The package's own families leave out what only slows Newton's method.

    Raises
    ------
    InputError
        If a family's forces couple more than its `ends` say.
    """
    if matrix.counts[OUTSIDE] and any(getattr(model, name).size for name in of_others()):
        raise InputError(
            f"{matrix.counts[OUTSIDE]} entries of the tangent couple parts that the `ends` of no family couple; a "
            f"family must state all that a record acts on"
        )
