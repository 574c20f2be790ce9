"""modes(): how a structure vibrates about an equilibrium, at rest or turning steadily."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sparse
from scipy.sparse.linalg import LinearOperator, eigs, eigsh, splu

from evolvent import families
from evolvent.builder import Assembly
from evolvent.errors import EvolventError, InputError, RunFailed
from evolvent.kernels import joint, loads, rigid, sides, springs
from evolvent.kernels.beam_loads import FIELD
from evolvent.kernels.flexible import NODE_VECTORS
from evolvent.solvers import equilibrium as eq
from evolvent.solvers.alpha_state import displace
from evolvent.solvers.laws import law_failure
from evolvent.solvers.solution import Solution
from evolvent.solvers.static import solve_static
from evolvent.solvers.static_work import Work, places_of

Array = np.ndarray

#: Up to so many free directions modes are found by dense algebra; half as many where velocities count.
DENSE = 300
#: Asymmetry, beside the largest entries of rows, that is taken as round-off.
SYMMETRIC = 1e-12
#: Poles below this part of the shift are zero where zeros are double.
ZERO = 1e-6
#: What a square of a frequency may owe to round-off, in parts of the sum of all products behind it.
ROUND_OFF = 1e-14


@dataclasses.dataclass(frozen=True)
class Modes:
    """What `modes` returns, slowest first.

    Attributes
    ----------
    pole : (k,) complex, s of u = shape exp(s t), real part in 1/s, imaginary part in rad/s
        One of each conjugate pair; real above 0, a motion that grows without oscillating.
    shape : (k, nv) float or complex, displacements of the velocities' coordinates
        In m, rad of a body's rotation, 1 of a beam's slopes, each per square root of kg: u^H M u = 1, M in kg and kg
        m2; the largest one is real.
    equilibrium : Solution, whose last state the modes are about
    assembly : Assembly
    """

    pole: Array
    shape: Array
    equilibrium: Solution
    assembly: Assembly = dataclasses.field(repr=False)

    @property
    def frequency(self) -> Array:
        """Damped angular frequencies, rad/s, in the frame that turns: (k,)."""
        return self.pole.imag

    @property
    def decay_rate(self) -> Array:
        """Decay rates of the amplitude, 1/s; below zero of a motion that grows: (k,)."""
        return -self.pole.real + 0.0

    @property
    def damping_ratio(self) -> Array:
        """Decay rate over the modulus of the pole, without unit: (k,)."""
        size = np.abs(self.pole)
        return np.divide(self.decay_rate, size, out=np.zeros_like(size), where=size > 0.0)

    @property
    def square(self) -> Array:
        """-Re s^2, rad2/s2 : (k,); below zero where the equilibrium is unstable."""
        return -(self.pole**2).real

    def of(self, name: str) -> Array:
        """Shapes of one part, units as of `shape`.

        Parameters
        ----------
        name : str

        Returns
        -------
        (k, nodes, vectors, 3) of a beam, places and slopes; (k, 3) of a point; (k, 6) of a free body, displacement in
        inertial axes and rotation in body axes; (k, 1) of a spinning body, its angle
        """
        model = self.assembly.model
        family, index = self.assembly.names.get(name, (None, 0))
        if family is None:
            self.assembly.index(name)
        where = None if family is None else places_of(model, family, index)
        if where is None:
            raise InputError(f"{name!r} is one of the {family} and does not move")
        found = self.shape[:, where]
        if family != "beams":
            return found
        return found.reshape(len(found), -1, NODE_VECTORS[model.flexible.beams["kind"][index]], 3)


def modes(
    assembly: Assembly,
    *,
    equilibrium: Solution | None = None,
    y: Any = None,
    time: float = 0.0,
    rotating: str | Sequence[float] | None = None,
    centre: Sequence[float] | None = None,
    count: int = 10,
    damped: bool = False,
) -> Modes:
    """Find the slowest modes about an equilibrium, with its stresses, loads and steady turn.

    Parameters
    ----------
    assembly : Assembly
    equilibrium : Solution of `solve_static` for the same assembly, optional; its last state, turn and time are taken
    y : (ny,) float, state to look for the equilibrium from, where none is given; the assembly's own if left out
    time : float, s, at which loads act and feeds stand
    rotating : str or (3,) float, optional, rad/s, as of `solve_static`
    centre : (3,) float, optional, m, as of `solve_static`
    count : int, how many modes; fewer where fewer directions are free
    damped : bool, whether dampers count

    Returns
    -------
    Modes
        Frequencies in rad/s, decay rates in 1/s, damping ratios without unit; the slowest first.

    Raises
    ------
    InputError
        For arguments out of range, and what `solve_static` refuses.
    RunFailed
        If there is no equilibrium; `run` holds the `Solution`.

    Notes
    -----
    M u'' + (C + Gy) u' + (K + Z) u + G^T la = 0, G u = 0: K is the tangent with the stresses and multipliers of the
    equilibrium, Z and Gy are what accelerations of the turn add by place and velocity (Coriolis). Modes nearest to zero
    come from the inverse, shifted, by SciPy (ARPACK, or LAPACK for small systems). The objective damping of a cable's
    bending goes with the rate of the curvature's size, which has no linear part where a cable is straight.
    """
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise InputError(f"count is {count!r}; it must be a whole number from 1")
    families.check(assembly, families.MODES)
    assembly = dataclasses.replace(assembly, model=assembly.model.copy())
    if equilibrium is None:
        equilibrium = solve_static(assembly, y=y, time=time, rotating=rotating, centre=centre)
    elif y is not None or rotating is not None or centre is not None or time != 0.0:
        raise InputError("give an equilibrium, or y, time, rotating and centre to find one, not both")
    if equilibrium.path is None:
        raise InputError(f"equilibrium is a motion by {equilibrium.method}; it must be a solution of solve_static")
    if not equilibrium.success:
        raise RunFailed(f"there is no equilibrium to vibrate about: {equilibrium.message}", equilibrium)
    assembly = dataclasses.replace(assembly, s=equilibrium.s[-1].copy())
    try:
        work = Work(assembly, equilibrium.y[-1], float(equilibrium.t[-1]), equilibrium.path.spin)
        work.balance.la[:] = equilibrium.la[-1]
        M, C, K, G = matrices(work, damped=damped)
    except EvolventError:
        raise
    except Exception as error:
        raise RunFailed(law_failure(assembly, error), equilibrium) from error
    problem = _Problem(M, C, K, G, work.balance.weight, conservative=_conservative(work))
    pole, shape = problem.solve(count)
    return Modes(pole=pole, shape=shape, equilibrium=equilibrium, assembly=assembly)


# ------------------------------------------------------------------------------------------------ matrices


def matrices(work: Work, *, damped: bool = True) -> tuple[sparse.csr_matrix, ...]:
    """M, C with the gyroscopic part, K with the turn's part, and the constraints' gradients G, about `work`'s state."""
    b, n_v = work.balance, work.n_v
    eq.unbalance(work.time, work.step, 1.0, 1.0, work.model, b, b.r)
    whole = work.tangent(0.0, 0.0)
    K = whole[:n_v, :n_v]
    M = work.mass()
    C = work.damping() if damped else sparse.csr_matrix((n_v, n_v))
    joints, gradients = work.model.flexible.joints, whole[n_v:, :n_v]
    held = np.array([joint.holds(work.time, joints, k) for k in range(work.n_j)], dtype=bool)
    penalties = np.flatnonzero(held & (joints["stiffness"] > 0.0))
    G = gradients[np.flatnonzero(held & (joints["stiffness"] == 0.0))]
    K = _completed(work, K)
    # the multiplier of a penalty is its stiffness times its gap and its damping times the gap's rate
    g = gradients[penalties]
    K = K + g.T @ sparse.diags(joints["stiffness"][penalties]) @ g
    if damped:
        C = C + g.T @ sparse.diags(joints["damping"][penalties]) @ g
    if np.any(b.spin[:3]):
        K = K + work.turning_tangent()
        C = C + gyroscopic(work, M)
    return M, C.tocsr(), K, G.tocsr()


def _conservative(work: Work) -> bool:
    """Whether no load turns with what it loads, and nothing rubs: K is symmetric then."""
    model = work.model
    if np.any(model.flexible.custom_forces["symmetric"] == 0.0):
        return False
    if np.any(model.flexible.beam_loads["kind"] == FIELD) or np.any(model.flexible.cylinders["friction"] > 0.0):
        return False
    for load in model.loads[model.loads["kind"] >= loads.AT_MARKER]:
        marker = model.markers[load["target"]]
        on_free = marker["kind"] == springs.ON_BODY and model.bodies["motion"][marker["index"]] == rigid.FREE
        if on_free and (load["kind"] == loads.TORQUE or model.parameters[load["first"] + 3] != 0.0):
            return False
    return True


def gyroscopic(work: Work, M: sparse.csr_matrix) -> sparse.csr_matrix:
    """Forces of velocities in the frame that turns: 2 M W x u', of a free body's rotation J w^ - (J w)^ + w^ J."""
    model, n_v = work.model, work.n_v
    W = _skew(work.balance.spin[:3])
    turns = sparse.lil_matrix((n_v, n_v))
    own = []
    for family, index in work.assembly.names.values():
        where = places_of(model, family, index)
        if where is None:
            continue
        if family == "bodies":
            body = model.bodies[index]
            if body["motion"] == rigid.FREE:
                turns[where.start : where.start + 3, where.start : where.start + 3] = 2.0 * W
                J, w = body["inertia"], body["R"].T @ work.balance.spin[:3]
                own.append((where.start + 3, J @ _skew(w) - _skew(J @ w) + _skew(w) @ J))
            continue
        for first in range(where.start, where.stop, 3):
            turns[first : first + 3, first : first + 3] = 2.0 * W
    found = (M @ turns.tocsr()).tolil()
    for first, block in own:
        found[first : first + 3, first : first + 3] = block
    return found.tocsr()


def _skew(a: Array) -> Array:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def _completed(work: Work, K: sparse.csr_matrix) -> sparse.csr_matrix:
    """K with what the tangent of Newton's method leaves out, by differences of the forces.

    That is columns and rows of bodies (and of points, where a user's law may pull), and how loads follow the shape.
    """
    b, model, f = work.balance, work.model, work.model.flexible
    own: list[int] = []
    by_law = np.any(model.springs["law"] != 0) or f.custom_forces.size
    families = ("bodies", "points") if by_law else ("bodies",)
    for family, index in work.assembly.names.values():
        where = places_of(model, family, index) if family in families else None
        if where is not None:
            own.extend(range(where.start, where.stop))
    ends = {int(v) for v in f.hinges["iv"][f.hinges["on"] == sides.ON_COORDINATES]}
    for cylinder in f.cylinders[model.bodies["motion"][f.cylinders["body"]] != rigid.DRIVEN]:
        ends.update(f.contact_points["iv"][int(cylinder["first"]) : int(cylinder["last"])].ravel().tolist())
    facing = {v - work.n_q + c for v in ends for c in range(3)} if own else set()
    following: set[int] = set()
    for push in f.beam_loads[f.beam_loads["kind"] == FIELD]:
        where = places_of(model, "beams", int(push["beam"]))
        following.update(range(work.n_v)[where] if where else ())
    if not own and not following:
        return K
    rest, spin = b.y.copy(), b.spin.copy()
    b.spin[:] = 0.0

    def forces(at: int, step: float) -> Array:
        b.d[:] = 0.0
        b.d[at] = step
        b.y[:] = rest
        displace(b.y, b.d, model, b.y)
        eq.unbalance(work.time, work.step, 1.0, 1.0, model, b, b.r)
        return np.array([b.r[: work.n_v], f.P])

    def derivative(at: int) -> Array:
        h = 1e-3 * b.weight[at]
        near, far = ((forces(at, s * h) - forces(at, -s * h)) / (2.0 * s * h) for s in (1.0, 2.0))
        return (4.0 * near - far) / 3.0

    K = K.tolil()
    for at in sorted({*own, *facing, *following}):
        by_force, by_load = derivative(at)
        column = K[:, [at]].toarray().ravel()
        wanted = column.copy()
        if at in own:
            wanted = by_force
        else:
            if at in following:
                wanted -= by_load
            wanted[own] = by_force[own]
        # what the tangent has it has without the differences' errors
        wrong = np.abs(wanted - column) > 1e-8 * max(np.abs(wanted).max(), np.abs(column).max())
        K[:, [at]] = np.where(wrong, wanted, column)[:, None]
    b.y[:], b.spin[:] = rest, spin
    eq.unbalance(work.time, work.step, 1.0, 1.0, model, b, b.r)
    return K.tocsr()


# ------------------------------------------------------------------------------------------------ eigenproblem


class _Problem:
    """The eigenproblem of M, C, K under G u = 0."""

    def __init__(self, M: Any, C: Any, K: Any, G: Any, weight: Array, *, conservative: bool) -> None:
        self.M, self.C, self.K, self.n = M.tocsc(), C.tocsc(), K.tocsc(), K.shape[0]
        scale = abs(K).max(axis=1).toarray().ravel()
        size = G.shape[0]
        norms = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel()) if size else np.zeros(0)
        typical = float(np.median(scale[scale > 0.0])) if np.any(scale) else 1.0
        self.G = sparse.diags(typical / norms) @ G if size else G
        self.size = self.n - size
        m = M.diagonal()
        self.fastest = float(np.max(np.abs(K.diagonal()) / m)) or 1.0  # of free bodies alone any shift serves
        off = abs(K - K.T)
        bound = sparse.diags(1.0 / np.maximum(scale, 1e-300))
        self.symmetric = C.nnz == 0 and (conservative or float((bound @ off).max()) <= SYMMETRIC)
        if self.symmetric:
            self.K = (0.5 * (K + K.T)).tocsc()
        self.weight = weight
        self.rng = np.random.default_rng(1)

    def inverse(self, s2: float, s: float = 0.0) -> Any:
        """Function f -> u of (K + s C + s2 M) u + G^T la = f, G u = 0."""
        A = self.K + s * self.C + s2 * self.M
        if self.G.shape[0]:
            A = sparse.bmat([[A, self.G.T], [self.G, None]])
        lu = splu(A.tocsc())
        n, extra = self.n, self.G.shape[0]

        def solve(f: Array) -> Array:
            whole = np.zeros((n + extra, *f.shape[1:]))
            whole[:n] = f
            return lu.solve(whole)[:n]

        return solve

    def noise(self, V: Array) -> Array:
        """Squares of frequencies that round-off alone may give to shapes: (k,)."""
        size = np.abs(V)
        return ROUND_OFF * np.einsum("ij,ij->j", size, abs(self.K) @ size) / self._norms(V)

    def _norms(self, V: Array) -> Array:
        """v^H M v : (k,)."""
        return np.einsum("ij,ij->j", V.conj(), self.M @ V).real

    def shift(self, count: int) -> float:
        """A square near those of the modes that are wanted, rad2/s2, by subspace iteration."""
        p = min(count + 4, self.size)
        S = self.K if self.symmetric else 0.5 * (self.K + self.K.T)
        X = self.rng.standard_normal((self.n, p)) * self.weight[:, None]
        s2 = self.fastest
        for _ in range(40):
            X = self.inverse(s2)(self.M @ X)
            X /= np.linalg.norm(X / self.weight[:, None], axis=0)
            X = np.linalg.qr(X / self.weight[:, None])[0] * self.weight[:, None]
            values, v = scipy.linalg.eigh(X.T @ (S @ X), X.T @ (self.M @ X))
            X = X @ v
            values = np.maximum(np.abs(values), self.noise(X))
            target = float(np.sort(values)[count - 1])
            if target > 0.2 * s2:
                return target
            if target == 0.0:
                return s2
            s2 = target
        return s2

    def solve(self, count: int) -> tuple[Array, Array]:
        """Poles and shapes."""
        s2 = self.shift(min(count, self.size))
        if self.symmetric:
            return self._undamped(min(count, self.size), s2)
        return self._general(count, s2)

    def _undamped(self, count: int, s2: float) -> tuple[Array, Array]:
        inverse = self.inverse(s2)
        if self.size <= DENSE or count >= self.size - 1:
            Z = self._free()
            M = Z.T @ (self.M @ Z)
            L = np.linalg.cholesky(0.5 * (M + M.T))
            B = L.T @ (Z.T @ inverse(Z @ L))
            mu, v = scipy.linalg.eigh(0.5 * (B + B.T))
            V = Z @ scipy.linalg.solve_triangular(L.T, v)
            keep = np.argsort(-np.abs(mu))[:count]
            mu, V = mu[keep], V[:, keep]
            squares = 1.0 / mu - s2
        else:
            operator = LinearOperator((self.n, self.n), matvec=lambda f: inverse(f.ravel()), dtype=float)

            def find() -> tuple[Array, Array]:
                v0 = inverse(self.M @ self.rng.standard_normal(self.n))
                found, v = eigsh(self.K, k=count, M=self.M, sigma=-s2, v0=v0, OPinv=operator)
                return 1.0 / (found + s2), v

            mu, V = _all_of(find)
            squares = 1.0 / mu - s2
        order = np.argsort(squares)[:count]
        squares, V = squares[order], V[:, order]
        squares[np.abs(squares) <= self.noise(V)] = 0.0
        pole = np.where(squares >= 0.0, 1j, 1.0) * np.sqrt(np.abs(squares))
        V = V / np.sqrt(self._norms(V))
        largest = np.argmax(np.abs(V / self.weight[:, None]), axis=0)
        return pole, (V * np.sign(V[largest, range(V.shape[1])])).T

    def _free(self) -> Array:
        """Orthonormal basis of the directions that the constraints leave: (n, size)."""
        if not self.G.shape[0]:
            return np.eye(self.n)
        Q, _ = np.linalg.qr(self.G.toarray().T, mode="complete")
        return Q[:, self.G.shape[0] :]

    def _general(self, count: int, s2: float) -> tuple[Array, Array]:
        """Of [u, v/s]: with s the shift, u' = v; pairs of poles of which one is kept."""
        s = math.sqrt(s2)
        inverse = self.inverse(s2, s)
        n = self.n

        def apply(x: Array) -> Array:
            u, v = x[:n], s * x[n:]
            w = -inverse(self.C @ u + s * (self.M @ u) + self.M @ v)
            return np.concatenate([w, (u + s * w) / s])

        if 2 * self.size <= DENSE or 2 * count + 8 >= 2 * self.size - 2:
            Z = self._free()
            whole = scipy.linalg.block_diag(Z, Z)
            mu, v = np.linalg.eig(whole.T @ apply(whole))
            V = (whole @ v)[:n]
        else:
            operator = LinearOperator((2 * n, 2 * n), matvec=lambda f: apply(f.ravel()), dtype=float)

            def find() -> tuple[Array, Array]:
                u, v = inverse(self.M @ self.rng.standard_normal((n, 2))).T
                v0 = np.concatenate([u / np.linalg.norm(u), v / np.linalg.norm(v)])
                found: tuple[Array, Array] = eigs(operator, k=2 * count + 8, v0=v0, which="LM")
                return found

            mu, V = _all_of(find)
            V = V[:n]
        keep = np.abs(mu) > 1e-13 * np.abs(mu).max()
        mu, V = mu[keep], V[:, keep]
        pole = s + 1.0 / mu
        pole[np.abs(pole) <= np.maximum(np.sqrt(self.noise(V)), ZERO * s)] = 0.0
        keep = np.flatnonzero(pole.imag >= 0.0)
        zero = keep[pole[keep] == 0.0]
        keep = np.concatenate([zero[::2], keep[pole[keep] != 0.0]])  # zeros are double
        keep = keep[np.argsort(np.abs(pole[keep]), kind="stable")][:count]
        pole, V = pole[keep], V[:, keep]
        pole.imag[np.abs(pole.imag) <= 1e-9 * np.abs(pole)] = 0.0
        V = V / np.sqrt(self._norms(V))
        largest = np.argmax(np.abs(V / self.weight[:, None]), axis=0)
        phase = V[largest, range(V.shape[1])]
        return pole, (V * (np.abs(phase) / phase)).T


def _all_of(find: Callable[[], tuple[Array, Array]]) -> tuple[Array, Array]:
    """Eigenvalues and vectors of several calls of `find`, each from another start, until nothing is new.

    One start of a Krylov method sees one vector of a multiple eigenvalue, but for what round-off brings in.
    """
    values, vectors = find()
    for _ in range(8):
        added = False
        for value, x in zip(*(lambda e: (e[0], e[1].T))(find()), strict=True):
            same = vectors[:, np.abs(values - value) <= 1e-6 * np.abs(value)]
            rest = x - same @ np.linalg.lstsq(same, x, rcond=None)[0] if same.shape[1] else x
            if np.linalg.norm(rest) > 1e-3 * np.linalg.norm(x):
                values = np.append(values, value)
                vectors = np.column_stack([vectors, rest / np.linalg.norm(rest)])
                added = True
        if not added:
            break
    return values, vectors
