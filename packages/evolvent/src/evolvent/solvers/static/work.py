"""A model at rest, and what is asked of its equilibria: tangents, masses, what nothing holds."""

from __future__ import annotations

import dataclasses
import weakref
from typing import Any

import numpy as np
import scipy

from evolvent import model as mdl
from evolvent.algebra import ordering, sparse_lu
from evolvent.algebra.singular import null_vectors
from evolvent.algebra.sparse import INNER, SparseBlocks, clear
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.blocks import of_part, owners
from evolvent.assembly.families import bodies_of, owner
from evolvent.compiled.pointer import zeros_record
from evolvent.equations.implicit import residual, tangent
from evolvent.equations.kept_fields import write_forces
from evolvent.kernels import rigid
from evolvent.kernels.blocks import ANGLE, POSITION, ROTATION, SCALAR, SLOPE, idle, indices
from evolvent.model.powers import N_POWERS
from evolvent.model.registry import along_axes, asked, families, frames_of
from evolvent.solvers.common import redundancy
from evolvent.solvers.common.matrices import check_covered, matrix_of
from evolvent.solvers.common.sizes import sizes
from evolvent.solvers.common.standing import end_ramps, freeze, stand_still
from evolvent.solvers.static import equilibrium as eq
from evolvent.solvers.static.steady_turn import check_turn
from evolvent_base.errors import InputError

Array = np.ndarray

#: Unknowns up to which free motions of unsymmetric tangents are looked for, and their singular values, of the largest.
MOST_DENSE, FREE = 600, 1e-14
#: Pivot of the scaled tangent that is round-off: a motion without resistance has one of either sign.
PIVOT_ROUND_OFF = 1e-13
#: Iterations of one step.
MOST_ITERATIONS = 25
#: Pivots of statics that may be deferred at most.
MOST_DEFERRED = 600
#: What multiplies a mass so that the stiffness beside it is round-off.
_HUGE = 1e40
#: Compliance of redundant constraints, beside that of the stiffest part or of the loads.
_STATIC_COMPLIANCE = 1e-10
#: Pivot, beside its column, that round-off leaves as it is; how often a compliance is raised tenfold for it.
RESOLVED, _RAISES = 1e-11, 4
#: Pivot of constraints, beside the largest, below which they are redundant.
REDUNDANT = 1e-9
#: Stiffness, beside the largest, below which coordinates are alike in what depends on what.
SOFT = 1e-8
#: Where the entries of matrices stand by rows, as of `_compressed`.
_rows_of: weakref.WeakKeyDictionary[SparseBlocks, tuple[Array, Array, Array]] = weakref.WeakKeyDictionary()


def spin_of(assembly: Assembly, rotating: Any, centre: Any) -> Array:
    """Rate and centre of a steady turn: (6,)."""
    spin = np.zeros(6)
    if rotating is None:
        return spin
    model = assembly.model
    if isinstance(rotating, str):
        body = model.bodies[assembly.index(rotating, "bodies")]
        if body["motion"] != rigid.DRIVEN:
            raise InputError(f"rotating is {rotating!r}; only a driven body's turn is given, a rate (3,) would be too")
        spin[:3], spin[3:] = body["R0"] @ body["axis"] * body["rate"], body["x0"]
    else:
        spin[:3] = _vector("rotating", rotating)
    if centre is not None:
        spin[3:] = _vector("centre", centre)
    axis, gravity = spin[:3], model.info.gravity
    if not np.any(axis):
        return spin
    if framed := {family for family, *_ in frames_of(model)}:
        name = next(name for name, found in assembly.names.items() if found[0] in framed)
        raise InputError(f"rotating does not support the field {name!r}; leave out rotating, or the field")
    if np.linalg.norm(np.cross(axis, gravity)) > 1e-9 * np.linalg.norm(axis) * np.linalg.norm(gravity):
        raise InputError(f"gravity {tuple(gravity)} is not along the axis of the steady turn, so nothing is steady")
    refuse_unsteady(assembly)
    for name, (family, index) in assembly.names.items():
        if family == "bodies" and model.bodies["motion"][index] == rigid.SPIN:
            own = model.bodies["R0"][index] @ model.bodies["axis"][index]
            if np.linalg.norm(np.cross(axis, own)) > 1e-9 * np.linalg.norm(axis):
                raise InputError(f"the axis of {name!r} is not along that of the steady turn")
    check_turn(assembly, spin)
    return spin


def refuse_unsteady(assembly: Assembly, *, orbits: bool = False) -> None:
    """Refuse what does not support a steady turn, or an orbital frame (`Statics.unsteady`)."""
    for name, unsteady in asked("statics.unsteady").items():
        for k, why in unsteady(assembly.model, orbits):
            raise InputError(why.format(name=repr(owner(assembly, name, k))))


def _vector(name: str, value: Any) -> Array:
    try:
        found = np.array(value, dtype=float)
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.shape != (3,) or not np.all(np.isfinite(found)):
        raise InputError(f"{name} is {value!r}; it must be 3 finite numbers")
    return found


def rubs(model: mdl.Model) -> bool:
    """Whether friction of contacts acts, which statics take by displacements."""
    own = ((name, mask) for name, mask in asked("friction.rubs").items() if name in asked("contacts.presses"))
    return any(bool(np.any(mask(getattr(model, name)))) for name, mask in own)


def at_rest(model: mdl.Model, time: float) -> mdl.Model:
    """A copy of a model for statics: driven bodies and spools stand where they are at `time`, ramps are over."""
    copy = model.copy()
    stand_still(copy, time)
    end_ramps(copy)
    for prepare in asked("statics.at_rest").values():
        prepare(copy)
    return freeze(copy, time)


class Work:
    """A copy of a model at rest, and room to look for its equilibria."""

    def __init__(self, assembly: Assembly, y: Any, time: float, spin: Array) -> None:
        self.assembly, self.time = assembly, float(time)
        self.model = model = at_rest(assembly.model, time)
        self.n_q, self.n_v = int(model.info.nq), int(model.info.nv)
        self.n_j = model.constraints.size
        if self.n_v == 0:
            raise InputError("nothing in the system can move")
        self.matrix = matrix_of(model, spare=spare_of(model))
        n_u = self.n_v + self.n_j
        self.step = 1.0 if rubs(model) else -1.0
        self.redundancy: redundancy.Redundancy | None = None
        #: Compliance of redundant constraints that pivots need.
        self.compliance = 0.0
        start = np.array(assembly.y if y is None else y, dtype=float)
        if start.shape != assembly.y.shape or not np.all(np.isfinite(start)):
            raise InputError(f"y has the shape {start.shape}; it must be {assembly.y.shape}, finite numbers")
        spins = model.blocks["iv"][np.isin(model.blocks["family"], _spinning())]
        spinning = start[spins]
        start[self.n_q :] = 0.0
        start[spins] = spinning
        weight, _ = sizes(assembly)
        #: Indices in the state of all slopes of beams, (n, 3).
        self.slopes = indices(model.blocks[model.blocks["kind"] == SLOPE], "iq")
        nodes = of_part(model, "bodies", [b for own in along_axes(model) for b in own])
        #: Indices in the state of the quaternions of all nodes along axes, (n, 4).
        self.turns = indices(nodes[nodes["kind"] == ROTATION], "iq", 4)
        #: What each equation stands for: of threads' nodes all copies, so that tangents are symmetric, (nu,).
        self.copies = np.ones(n_u)
        for family in families().values():
            if "copies" in (family.record.names or ()):
                for index, row in enumerate(family.records(model)):
                    self.copies[velocities_of(model, family.name, index)] = row["copies"]
        unknowns = {name: np.zeros(n_u) for name in ("r", "p", "x", "z", "start")}
        moves = {name: np.zeros(self.n_v) for name in ("a", "d", "total", "before")}
        self.balance = eq.StaticWorkspace(
            y=start,
            la=np.zeros(self.n_j),
            weight=weight,
            is_moment=_moments(model),
            history=np.full((MOST_ITERATIONS + 1, eq.N_HISTORY), np.nan),
            powers=np.zeros(N_POWERS),
            booked=np.zeros(N_POWERS),
            spin=spin,
            parameters=model.parameters.copy(),
            gravity=np.array(model.info.gravity),
            loop=zeros_record(eq.LOOP),
            **unknowns,
            **moves,
        )
        model.switches[:] = assembly.s
        needs.load(model, eq.balance, eq.relax, eq.follow, eq.probe, eq.accept, write_forces)
        # friction is that of displacements from here on
        b = self.balance
        residual(self.time, b.y, b.a, b.la, 0.0, 1.0, model, b.r, b.powers)
        self._check_rest()
        for name, settle in asked("statics.settle").items():
            if getattr(model, name).size:
                settle(model, b.y)
        self.couple(first=True)

    def couple(self, *, first: bool = False) -> None:
        """Order the tangent again where contacts have come to touch whose ends it does not couple (`Coupling.always`).

        first : whether it has not been filled yet
        """
        layered = asked("coupling.layered")
        changes = any(families()[name].coupling.always and np.any(mask(getattr(self.model, name)))
                      for name, mask in layered.items())  # fmt: skip
        if changes and (first or self.matrix.counts[INNER] > 0):
            self.matrix = matrix_of(self.model, spare=spare_of(self.model), layers=True)

    def _check_rest(self) -> None:
        """Refuse what does not stay at rest."""
        for name, found in asked("statics.not_at_rest").items():
            for k, why in found(self.model):
                raise InputError(f"at t = {self.time:.6g} s {owner(self.assembly, name, k)!r} {why}")

    def allow_redundant(self) -> None:
        """Allow constraints that others imply: the tangent with masses is singular only by them."""
        b, model = self.balance, self.model
        self.probe(0.0, 1e12)
        if b.loop.loose <= 0:
            return
        own, mass = dataclasses.replace(self.assembly, model=model), sizes(self.assembly)[1]
        self.redundancy = redundancy.allow(own, self.matrix, b.weight, mass, self.time, b.y)
        self.probe(1.0)
        length = self.redundancy.length
        load = float(np.max(np.abs(model.P) * b.weight, initial=0.0))
        energy = max(float(b.loop.stiffest), load) or mass * length**2
        info = model.info
        info.compliance = _STATIC_COMPLIANCE / self.redundancy.compliance * length**2 / energy
        for _ in range(_RAISES):
            if self.probe(1.0) >= 0 and b.loop.quality > RESOLVED:
                break
            info.compliance *= 10.0
        self.compliance = float(info.compliance)

    def probe(self, factor: float, shift: float = 0.0) -> int:
        """Unbalance and factors of the tangent of the state."""
        return int(eq.probe(self.time, self.step, factor, shift, self.model, self.matrix, self.balance))

    def tangent(self, c_mass: float, c_rate: float) -> scipy.sparse.csr_matrix:
        """Tangent of the last unbalance, constraints included, by velocities and then joints; the turn is left out."""
        b = self.balance
        tangent(self.time, b.y, b.la, c_mass, c_rate, 1.0, self.model, self.matrix)
        check_covered(self.model, self.matrix)
        return scipy.sparse.csr_matrix(scipy.sparse.diags(self.copies) @ sparse_of(self.matrix))

    def turning_tangent(self) -> scipy.sparse.csr_matrix:
        """What the accelerations of the turn add to the tangent, (nv, nv)."""
        clear(self.matrix)
        eq.add_turning_tangent(1.0, self.balance.spin, self.balance.y, self.model, self.matrix)
        return scipy.sparse.csr_matrix(scipy.sparse.diags(self.copies) @ sparse_of(self.matrix))[: self.n_v, : self.n_v]

    def whole_tangent(self, factor: float) -> scipy.sparse.csr_matrix:
        """Tangent of the last unbalance, by velocities and then joints, with that of the turn at a load factor."""
        K = self.tangent(0.0, 0.0)
        if not np.any(self.balance.spin[:3]):
            return K
        turning = factor * self.turning_tangent()
        return K + scipy.sparse.block_diag([turning, scipy.sparse.csr_matrix((self.n_j, self.n_j))], format="csr")

    @property
    def rows(self) -> Array:
        """Unknowns of the multipliers."""
        return self.n_v + np.arange(self.n_j)

    def mass(self) -> scipy.sparse.csr_matrix:
        """Mass matrix, (nv, nv)."""
        return self._part(_HUGE, 0.0)

    def damping(self) -> scipy.sparse.csr_matrix:
        """Derivative of the forces by velocities at rest, (nv, nv)."""
        return self._part(0.0, _HUGE)

    def _part(self, c_mass: float, c_rate: float) -> scipy.sparse.csr_matrix:
        found = self.tangent(c_mass, c_rate)[: self.n_v, : self.n_v] / _HUGE
        found.data[np.abs(found.data) < 1e-25 * np.abs(found.data).max(initial=0.0)] = 0.0
        found.data[np.abs(found.data) < 1e-28] = 0.0
        found.eliminate_zeros()
        return found

    def falling_directions(self) -> int:
        """In how many independent directions the energy falls about the last state (full load); -1 if unknown."""
        whole = self.tangent(0.0, 0.0)
        held = np.flatnonzero(redundancy.is_held(self.model.constraints, self.time))
        G = whole[self.n_v :, : self.n_v][held]
        K = whole[: self.n_v, : self.n_v]
        if np.any(self.balance.spin[:3]):
            K = K + self.turning_tangent()
        return falling(K, G.toarray())

    def carry(self) -> bool:
        """Set the multipliers to those that carry most of the whole load in this state; False of large systems.

        What only weight holds, as a pendulum, is held by the multipliers: without load nothing shows it.
        """
        b = self.balance
        if self.n_v + self.n_j > MOST_DENSE:
            return False
        b.la[:] = 0.0
        self.probe(1.0)
        held = np.flatnonzero(redundancy.is_held(self.model.constraints, self.time))
        across = self.tangent(0.0, 0.0)[: self.n_v, self.n_v :].toarray()[:, held]
        weight = b.weight[: self.n_v]
        b.la[held] = np.linalg.lstsq(weight[:, None] * across, -weight * b.r[: self.n_v], rcond=1e-9)[0]
        return True

    def free_motions(self, factor: float) -> list[str]:
        """Which parts move without resistance, by the tangent."""
        b = self.balance
        if self.probe(factor) < 0 or b.loop.loose == 0:
            return []
        count = int(b.loop.loose)
        M = self.mass()
        self.probe(factor)
        K = self.tangent(0.0, 0.0)[: self.n_v, : self.n_v].diagonal()
        m = M.diagonal()
        shift = 1e-9 * float(np.median(np.abs(K[K != 0.0] / m[K != 0.0]))) if np.any(K) else 1.0
        if self.probe(factor, shift) != 0:
            return []
        X = np.random.default_rng(0).standard_normal((self.n_v, count))
        for _ in range(3):
            for j in range(count):
                b.x[:] = 0.0
                b.x[: self.n_v] = M @ X[:, j]
                sparse_lu.solve(self.matrix, b.x)
                X[:, j] = b.x[: self.n_v]
            X = np.linalg.qr(X / b.weight[:, None])[0] * b.weight[:, None]
        return self.moved(X)

    def unsymmetric_free_motions(self) -> tuple[int, list[str]]:
        """How many motions an unsymmetric tangent leaves free, and the parts that they move.

        The forces of constraints turn with such a motion: pivots of one row do not show it, singular values do.
        """
        X = null_vectors(self.whole_tangent(1.0), FREE)
        return X.shape[1], self.moved(X[: self.n_v]) if X.size else []

    def moved(self, X: Array) -> list[str]:
        """Names of the parts that the motions X (nv, k) move."""
        size = np.abs(X / self.balance.weight[:, None]).max(axis=1)
        found = []
        for name, (family, index) in self.assembly.names.items():
            if size[velocities_of(self.model, family, index)].max(initial=0.0) > 0.05 * size.max():
                found.append(name)
        return found

    def loads_on(self, parts: list[str]) -> list[str]:
        """Names of the loads that act on parts, or on their bodies."""
        model, names = self.model, self.assembly.names
        found = []
        acting = asked("statics.acts_on")
        for name, (family, index) in names.items():
            target = acting[family](model, index, self.balance.parameters, self.time) if family in acting else None
            if target is not None and any(_holds(model, names[part], target) for part in parts):
                found.append(name)
        return found


def falling(K: Any, G: Array) -> int:
    """In how many independent directions that constraints G (m, n) allow the energy falls by K (n, n); -1 if unknown.

    Notes
    -----
    Negative pivots of K on the moves that the constraints allow, eliminated along its diagonal (Sylvester). The
    constraints are eliminated exactly: a penalty would have to be much stiffer than the softest bending of a rod is
    soft beside its extension, which leaves no digits for the latter.
    """
    A = 0.5 * (K + K.T)
    if len(G):
        T = _allowed_moves(G, abs(K).max(axis=1).toarray().ravel())
        A = T.T @ A @ T
    if A.shape[0] == 0:
        return 0
    size = abs(A).max(axis=1).toarray().ravel()
    d = 1.0 / np.sqrt(np.where(size > 0.0, size, 1.0))
    A = A.tocoo()
    A = scipy.sparse.csc_matrix((d[A.row] * A.data * d[A.col], (A.row, A.col)), shape=A.shape)
    try:
        lu = scipy.sparse.linalg.splu(
            A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:  # a pivot is zero
        return -1
    return int(np.sum(lu.U.diagonal() < -PIVOT_ROUND_OFF)) if np.array_equal(lu.perm_r, lu.perm_c) else -1


def _allowed_moves(G: Array, size: Array) -> Any:
    """A basis of the null space of constraints G (m, n): a sparse matrix (n, n - rank).

    Coordinates of small `size`, a stiffness, depend on the others: those of bodies follow the beams that hold them.
    """
    used = np.flatnonzero(np.any(G != 0.0, axis=0))
    scale = np.sqrt(np.maximum(size[used], SOFT * float(size.max(initial=1.0))))
    _, R, order = scipy.linalg.qr(G[:, used] / scale, mode="economic", pivoting=True)
    pivots = np.abs(np.diagonal(R))
    rank = int(np.sum(pivots > REDUNDANT * pivots[0]))
    depends, rest = used[order[:rank]], used[order[rank:]]
    follow = -scipy.linalg.solve_triangular(R[:rank, :rank], R[:rank, rank:])
    follow *= scale[order[rank:]] / scale[order[:rank], None]
    follow[np.abs(follow) < 1e-14 * np.abs(follow).max(initial=0.0)] = 0.0
    free = np.setdiff1d(np.arange(size.size), depends)
    i, j = np.nonzero(follow)
    rows, columns = np.concatenate([free, depends[i]]), np.concatenate([free, rest[j]])
    values = np.concatenate([np.ones(free.size), follow[i, j]])
    return scipy.sparse.csr_array((values, (rows, np.searchsorted(free, columns))), shape=(size.size, free.size))


def _spinning() -> list[int]:
    """Codes of families whose rates go on in statics."""
    return [code for code, name in enumerate(owners()) if any(own.spins for own in families()[name].state.unknowns)]


def _moments(model: mdl.Model) -> Array:
    """1 of velocities that are turns or rates of slopes, whose forces are moments, 0 of the others: (nv,)."""
    found = np.ones(int(model.info.nv), dtype=np.int64)
    found[indices(model.blocks[model.blocks["kind"] == POSITION], "iv") - int(model.info.nq)] = 0
    return found


def _blocks_of(model: mdl.Model, family: str, index: int) -> tuple[Array, Array]:
    """Blocks of the nodes of a part that moves, or its own, and those of its inner coordinates."""
    own, bodies = of_part(model, family, [index]), bodies_of(model, family, index)
    if len(bodies) and family != "bodies":
        return of_part(model, "bodies", bodies), own
    return own[own["kind"] < SCALAR], own[:0]


def velocities_of(model: mdl.Model, family: str, index: int) -> Array:
    """Velocities of a part, (n,) int as the model counts them: of its nodes, then modal and transverse ones."""
    own = np.concatenate(_blocks_of(model, family, index))
    found = [np.arange(row["iv"], row["iv"] + row["count"]) for row in own]
    return np.concatenate([np.zeros(0, dtype=int), *found]) - int(model.info.nq)


def velocity_slice(model: mdl.Model, family: str, index: int) -> slice | None:
    """Velocities of the nodes of a part, or its own, as the model counts them; None of one that does not move."""
    own, n_q = _blocks_of(model, family, index)[0], int(model.info.nq)
    return slice(int(own["iv"][0]) - n_q, int(own["iv"][-1] + own["count"][-1]) - n_q) if own.size else None


def spare_of(model: mdl.Model) -> int:
    """Pivots that statics may defer: without masses a beam or a body may be held by its joints only."""
    loose = (own.loose(family.records(model)) for family in families().values() for own in family.state.unknowns)
    return min(sum(loose), MOST_DEFERRED)


def sparse_of(matrix: SparseBlocks) -> scipy.sparse.csr_matrix:
    """A matrix before it is factored, inner unknowns included; by velocities and then joints."""
    if matrix not in _rows_of:
        _rows_of[matrix] = _compressed(matrix)
    order, columns, starts = _rows_of[matrix]
    n = matrix.place.size
    found = scipy.sparse.csr_matrix((matrix.values[order], columns, starts), shape=(n, n), copy=True)
    found.eliminate_zeros()
    inner = int(matrix.counts[INNER])
    if inner:
        B, C = (scipy.sparse.csr_matrix(part[matrix.place, :inner]) for part in (matrix.B, matrix.C))
        found = found + B @ C.T
    return found


def _compressed(matrix: SparseBlocks) -> tuple[Array, Array, Array]:
    """Entries of a matrix by rows: their places in its values, their columns, (nz,), and where rows start, (n + 1,)."""
    _, rows, columns = ordering.entries(matrix)
    order = np.lexsort((columns, rows))
    starts = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=matrix.place.size))])
    return order, columns[order], starts


def add_turn(model: mdl.Model, spin: Array, y: Array) -> None:
    """Velocities of a steady turn into a state."""
    w, c = spin[:3], spin[3:]
    if not np.any(w):
        return
    for block in model.blocks[~idle(model, model.switches)]:
        q, v, b = int(block["iq"]), int(block["iv"]), block["owner"]
        if block["kind"] == POSITION:
            y[v : v + 3] = np.cross(w, y[q : q + 3] - c)
        elif block["kind"] == SLOPE:
            y[v : v + 3] = np.cross(w, y[q : q + 3])
        elif block["kind"] == ROTATION:
            y[v : v + 3] = model.bodies["R"][b].T @ w
        elif block["kind"] == ANGLE:
            y[v] = (model.bodies["R"][b] @ model.bodies["axis"][b]) @ w


def _holds(model: Any, part: tuple[str, int], target: tuple[str, int]) -> bool:
    """Whether what a load acts on belongs to a part."""
    return part == target or (target[0] == "bodies" and target[1] in bodies_of(model, *part))
