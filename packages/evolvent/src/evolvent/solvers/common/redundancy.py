"""Constraints that repeat one another: their rank, and what lets solvers run with them.

Where the rows of the gradient G depend on one another, the multipliers are not unique. A compliance far below that of
what the constraints hold, g - c la = 0, takes those of least norm: at the solution c la is in the range of G, as g is.
Directions count with the size of the system, so that moments are forces at that distance. In motions the compliance
acts on multipliers that make no force alone, so that the constraints hold to round-off (`least_norm`).

The rank changes where joints are released, and may change where a latch locks: `Ranks` keeps what was found, and when.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import scipy

from evolvent import model as mdl
from evolvent.algebra import ordering, sparse_lu
from evolvent.algebra.sparse import LOST, SparseBlocks
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import row_owner
from evolvent.equations.implicit import residual, tangent
from evolvent.model.memory import take
from evolvent.model.powers import N_POWERS
from evolvent.solvers.common.sizes import length_of
from evolvent_base.errors import InputError

Array = np.ndarray

#: Most constraints whose rank is found from singular values; of more, it is that of the factors of the tangent.
MOST = 1500
#: Singular value, beside the largest, that is zero.
ZERO = 1e-9
#: Part in a dependence from which on a constraint counts as one of those that repeat one another.
_PART = 1e-6
#: Compliance beside that of a typical mass, and at least beside that of the lightest that takes part: round-off of its
#: pivots must be far below.
_COMPLIANCE, _ROUND_OFF = 1e-5, 2e-12
#: What multiplies a mass so that the stiffness beside it is round-off.
_HUGE = 1e40
#: What constraints may be off, beside the size of the system, before they contradict one another.
_CONTRADICTS = 1e-5


@dataclasses.dataclass(frozen=True)
class Redundancy:
    """Constraints that repeat one another.

    Attributes
    ----------
    constraints, rank : int, number of scalar constraints, and of independent ones
    names : list of str, parts whose constraints depend on one another
    rows : (n,) int, rows that take part, with what they are connected to
    held, sizes : (k,) int and float, all rows that hold as constraints, and what their multipliers, forces and moments,
        are multiplied by to count alike
    length : float, m, size of the system
    compliance : float, beside that of a typical mass
    """

    constraints: int
    rank: int
    names: list[str]
    rows: Array
    held: Array
    sizes: Array
    length: float
    compliance: float

    @property
    def text(self) -> str:
        """What is reported."""
        return (
            f"{self.rank} of {self.constraints} constraints are independent, those of {_listed(self.names)} are "
            f"redundant: their multipliers are those of minimum norm"
        )

    def contradiction(self, gaps: Array, t: float) -> str:
        """Why a run must end at t, by the gaps of all rows; '' where the constraints still agree."""
        off = float(np.abs(gaps[self.rows]).max(initial=0.0))
        if off <= _CONTRADICTS * self.length:
            return ""
        return (
            f"the constraints of {_listed(self.names)} are inconsistent at t = {t:.6g} s: they are "
            f"violated by {off:.3g}; remove a redundant one, give one of them a `stiffness`, or end the motion "
            f"before a position in which more of them depend on one another, such as all hinges in one plane: from "
            f"there it may go on in several ways"
        )


def _listed(names: list[str]) -> str:
    shown = ", ".join(repr(name) for name in names[:6])
    return shown + (f" and {len(names) - 6} others" if len(names) > 6 else "")


def undetermined(model: mdl.Model, matrix: SparseBlocks, t: float, y: Array, inertia: tuple[float, float]) -> int:
    """Number of unknowns that the tangent with masses leaves open at a state, by its factors, which stay in `matrix`.

    Parameters
    ----------
    inertia : c_mass (1/s2) so great that stiffness does not count, and a typical mass (kg)
    """
    c_mass, mass = inertia
    write_tangent(model, matrix, t, y, c_mass, c_mass * mass)
    return int(sparse_lu.factor(matrix))


def write_tangent(model: mdl.Model, matrix: SparseBlocks, t: float, y: Array, c_mass: float, scale: float) -> None:
    """Evaluate a model at a state, and write its tangent with masses, without multipliers."""
    n_v, n_j = int(model.info.nv), model.constraints.size
    la = np.zeros(n_j)
    residual(t, y, np.zeros(n_v), la, 0.0, 1.0, model, np.zeros(n_v + n_j), np.zeros(N_POWERS))
    tangent(t, y, la, c_mass, 0.0, scale, model, matrix)


@dataclasses.dataclass(frozen=True)
class Rank:
    """What was found of the constraints at a time.

    Attributes
    ----------
    since : float, s, from when on
    held : (nj,) bool, rows that hold as constraints; latches : int, number of latches and events until then
    slack : (nj,) float, compliance of the rows
    redundancy : Redundancy, None where the constraints are independent
    """

    since: float
    held: Array
    latches: int
    slack: Array
    redundancy: Redundancy | None


class Ranks:
    """Ranks of the constraints of a run: found at the start, and again after every release and latch.

    Attributes
    ----------
    found : list of Rank, in the order of time
    """

    def __init__(self, assembly: Assembly) -> None:
        self.assembly, self.model = assembly, assembly.model
        self.found: list[Rank] = []
        self._apart: mdl.Model | None = None

    @property
    def now(self) -> Redundancy | None:
        """What is redundant at present."""
        return self.found[-1].redundancy if self.found else None

    def is_due(self, t: float, latches: int) -> bool:
        """Whether constraints have been released or latches have locked since the rank was found."""
        rows = self.model.constraints
        if not rows.size:
            return False
        last = self.found[-1] if self.found else None
        own = rows["alone"] == 0
        return last is None or last.latches != latches or not np.array_equal(last.held[own], is_held(rows, t)[own])

    def find(
        self, t: float, y: Array, matrix: SparseBlocks, weight: Array, inertia: tuple[float, float], latches: int = 0
    ) -> None:
        """Find the rank at time t and state y; the entries of the matrix are lost.

        Parameters
        ----------
        weight, inertia : as of `allow` and `undetermined`

        Raises
        ------
        InputError
            As `allow` does.
        """
        rows, info = self.model.constraints, self.model.info
        rows["slack"], info.redundant, info.exact = 0.0, 0, 1
        held, found = is_held(rows, t), None
        if np.any(held) and undetermined(self.model_apart(), matrix, t, y, inertia) > 0:
            found = allow(self.assembly, matrix, weight, inertia[1], t, y)
        self.found.append(Rank(t, held, latches, rows["slack"].copy(), found))

    def model_apart(self) -> mdl.Model:
        """A model with the values of the run's at present, which may be evaluated."""
        if self._apart is None:
            self._apart = self.model.copy()
        else:
            take(self._apart, self.model)
        return self._apart

    def at(self, times: Array) -> Array:
        """Number of the rank in `found` that the constraints had at times (n,), s: (n,) int."""
        since = np.array([rank.since for rank in self.found])
        return np.asarray(np.maximum(np.searchsorted(since, times, side="right") - 1, 0))

    def use(self, number: int) -> None:
        """Give the model the compliance that its constraints had with a rank, and whether some were redundant."""
        if self.found:
            self.model.constraints["slack"] = self.found[number].slack
            self.model.info.redundant = int(self.found[number].redundancy is not None)

    @property
    def text(self) -> str:
        """What is reported, '' where nothing has been redundant."""
        texts: list[str] = []
        for k, rank in enumerate(self.found):
            if rank.redundancy is not None and rank.redundancy.text not in "; ".join(texts):
                since = f"from t = {rank.since:.6g} s on " if k > 0 else ""
                texts.append(since + rank.redundancy.text)
        return "; ".join(texts)

    @property
    def statistics(self) -> dict[str, int]:
        """Number of constraints and their rank where they were redundant first."""
        first = next((rank.redundancy for rank in self.found if rank.redundancy is not None), None)
        return {} if first is None else {"constraints": first.constraints, "rank": first.rank}


def allow(assembly: Assembly, matrix: SparseBlocks, weight: Array, mass: float, t: float, y: Array) -> Redundancy:
    """Let the constraints of a model depend on one another: give them their share of the compliance.

    Parameters
    ----------
    assembly : of the run's own, whose joints are changed
    matrix : of which the last `factor` left unknowns open; its entries are lost
    weight, mass : (nv,) float, size of each unknown that counts as 1, and a typical mass, kg
    y : (ny,) float, state

    Raises
    ------
    InputError
        Where something beside the joints is undetermined, a driven joint is among them, or one holds what cannot move.
    """
    model, n_v = assembly.model, int(assembly.model.info.nv)
    unknowns = ordering.redundant_unknowns(matrix)
    if np.any(unknowns < n_v):
        raise InputError(redundant(assembly, matrix))
    unresolved = unknowns.size + int(matrix.counts[LOST])
    write_tangent(model.copy(), matrix, t, y, _HUGE, 1.0)
    values, places, columns = ordering.entries(matrix)
    whole = scipy.sparse.coo_matrix((values, (places, columns)), shape=(n_v + model.constraints.size,) * 2).tocsr()
    G, M = whole[n_v:, :n_v], whole[:n_v, :n_v] / _HUGE
    held_rows = model.constraints
    length = max(1.0, length_of(model, weight))
    held = np.flatnonzero(is_held(held_rows, t))
    scale = 1.0 / np.where(held_rows["turns"][held], 1.0, length)
    part = scipy.sparse.diags(scale) @ G[held] @ scipy.sparse.diags(weight)
    size = np.asarray(abs(part).max(axis=1).todense()).ravel() if held.size else np.zeros(0)
    for k in held[size <= 1e-12]:
        raise InputError(
            f"{row_owner(assembly, int(k))!r} is redundant: its ends cannot move in the constrained direction"
        )
    rank, share = _rank_of(part, size, unresolved)
    taking = held[share > _PART] if share is not None else held
    for k in taking:
        if held_rows["drives"][k]:
            name = row_owner(assembly, int(k))
            raise InputError(f"{name!r} is redundant: it drives a motion that other constraints already hold or drive")
    names = sorted({row_owner(assembly, int(k)) for k in taking})
    _, group = scipy.sparse.csgraph.connected_components(part @ part.T, directed=False)
    rows = held[np.isin(group, group[np.isin(held, taking)])]
    size = np.where(held_rows["turns"][rows], 1.0 / length**2, 1.0)
    yields = np.einsum("ij,ji->i", G[rows].toarray(), scipy.sparse.linalg.splu(M.tocsc()).solve(G[rows].T.toarray()))
    compliance = max(_COMPLIANCE, _ROUND_OFF * mass * float(np.max(yields / size)))
    held_rows["slack"][rows] = size * compliance
    info = model.info
    info.redundant = 1
    return Redundancy(held.size, rank, names, rows, held, 1.0 / scale, length, compliance)


def _rank_of(part: Any, size: Array, unresolved: int) -> tuple[int, Array | None]:
    """Rank of the gradients, and the largest part of each row in a dependence; None where there are too many rows."""
    n = part.shape[0]
    if n > MOST:
        return n - unresolved, None
    U, values, _ = np.linalg.svd((scipy.sparse.diags(1.0 / size) @ part).toarray(), full_matrices=n > part.shape[1])
    rank = min(int(np.sum(values > ZERO * values[0])), n - 1)
    return rank, np.abs(U[:, rank:]).max(axis=1)


def independent_rows(G: scipy.sparse.csr_matrix, rank: int) -> Array:
    """As many rows of gradients as their rank, which span those of all: (rank,) int, increasing."""
    norms = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
    _, order = scipy.linalg.qr((scipy.sparse.diags(1.0 / norms) @ G).toarray().T, mode="r", pivoting=True)
    return np.asarray(np.sort(order[:rank]))


def is_held(rows: Array, t: float) -> Array:
    """Which rows are constraints that hold at t, no penalties: (nj,) bool."""
    found: Array = (rows["stiffness"] == 0.0) & (t <= rows["until"])
    return found


def redundant(assembly: Assembly, matrix: SparseBlocks) -> str:
    """Which constraints repeat what others say."""
    rows = ordering.redundant_unknowns(matrix) - int(assembly.model.info.nv)
    names = sorted({row_owner(assembly, int(k)) for k in rows if k >= 0})
    return (
        f"{' and '.join(repr(n) for n in names) or 'a constraint'} is redundant: the others already impose "
        f"{len(rows)} of its constraints"
    )
