"""Composing and observing, shared by the tests of physics."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent import model as mdl, parts
from evolvent.algebra.sparse import OUTSIDE
from evolvent.analysis.system import System
from evolvent.assembly.assembled import Assembly
from evolvent.equations import implicit as equations
from evolvent.equations.rhs import rhs
from evolvent.kernels import blocks
from evolvent.model.powers import N_POWERS
from evolvent.solvers import Solution, solve
from evolvent.solvers.common.observations import Observations, observe
from evolvent.solvers.static import equilibrium
from evolvent.solvers.static.work import Work, sparse_of
from evolvent.solvers.time.implicit.plan import matrix_of

Array = np.ndarray

#: Data of Tenenbaum (2014): J kg m2, W0 rad/s, L0 m, r m, spool rad/s, rho kg/m, L m, tip kg.
J, W0, L0, R, SPOOL, RHO, L, TIP = 0.004, 6.0, 0.05, 0.01, 3.5, 0.000735, 5.0, 0.0005
#: Speed of the drive, m/s, and the time that it takes to pay the thread out, s.
V = R * SPOOL
END = L / V


class Run(NamedTuple):
    """An assembly, what the solver returned and what can be read off it."""

    assembly: Assembly
    solution: Solution
    seen: Observations

    @property
    def t(self) -> Array:
        return self.solution.t

    @property
    def y(self) -> Array:
        return self.solution.y

    @property
    def accounts(self) -> Array:
        """(nt, N_ACCOUNTS) accounts."""
        return accounts(self.assembly, self.solution.y)

    @property
    def energy(self) -> Array:
        """(nt,) kinetic and elastic energy, J."""
        return self.seen.inventory[:, mdl.KINETIC] + self.seen.inventory[:, mdl.ELASTIC]

    @property
    def energy_defect(self) -> Array:
        """(nt,) energy less what the accounts booked since the first sample, J."""
        a = self.accounts
        booked = a[:, mdl.SPOOL] + a[:, mdl.LOAD] + a[:, mdl.DRIVE] + a[:, mdl.RELEASE] - a[:, mdl.DISSIPATED]
        return (self.energy - self.energy[0]) - (booked - booked[0])

    @property
    def momentum(self) -> Array:
        """(nt, 3) angular momentum of bodies and released thread about the origin, kg m2/s."""
        return self.seen.inventory[:, mdl.H_BODY : mdl.H_BODY + 3] + self.released_momentum

    @property
    def released_momentum(self) -> Array:
        return self.seen.inventory[:, mdl.H_RELEASED : mdl.H_RELEASED + 3]

    @property
    def wound_momentum(self) -> Array:
        return self.seen.inventory[:, mdl.H_WOUND : mdl.H_WOUND + 3]

    @property
    def linear_momentum(self) -> Array:
        """(nt, 3) linear momentum, kg m/s."""
        return self.seen.inventory[:, mdl.P_ALL : mdl.P_ALL + 3]

    @property
    def jumps(self) -> Array:
        """(nt, 3) angular momentum that events brought in."""
        return self.accounts[:, mdl.JUMP_ANGULAR : mdl.JUMP_ANGULAR + 3]

    def rate(self, body: int = 1) -> Array:
        """(nt,) rate of a body about Z, rad/s."""
        return self.seen.body_rate[:, body, 2]

    def in_body(self, vectors: Array, body: int = 1) -> Array:
        """(nt, n, 3) inertial vectors in a body's axes."""
        return np.einsum("tji,tnj->tni", self.seen.body_rotation[:, body], vectors)

    def lag(self, node: int = 0, departure: Sequence[float] = (L0, 0.0, R), body: int = 1) -> Array:
        """(nt,) signed lag angle of a node of the first thread in the plane of the spin, degrees (eq. 19)."""
        x = self.in_body(self.seen.position - self.seen.body_position[:, [body]], body)[:, node] - np.array(departure)
        return np.degrees(np.arctan2(-x[:, 1], x[:, 0]))


def accounts(assembly: Assembly, y: Array) -> Array:
    """The accounts of states (see `evolvent.model`)."""
    return y[..., int(assembly.model.info.nq + assembly.model.info.nv) :]


def run(assembly: Assembly, samples: Any, method: str = "dopri5", **options: Any) -> Run:
    """Solve and observe; the run must end well."""
    solution = solve(assembly, samples=samples, method=method, **options)
    assert solution.success, solution.message
    return Run(assembly, solution, observe(assembly.model, solution.t, solution.y, solution.s))


def heliogyro(
    *,
    motion: str = "spin",
    copies: int = 2,
    out: float = 0.0,
    spool: float = SPOOL,
    rate: float = W0,
    drive: Any = None,
    gravity: Sequence[float] = (0.0, 0.0, 0.0),
    loads: Callable[[System], None] | None = None,
    **thread: Any,
) -> Assembly:
    """The paper's heliogyro: one thread for two on a body that spins about Z, `out` metres already out."""
    system = System(gravity=gravity)
    system.add(parts.RigidBody(motion=motion, inertia=J, rate=rate), "hub")
    drive = parts.ConstantDrive(rate=spool, angle=out / R) if drive is None else drive
    system.add(parts.Reel(body="hub", centre=(L0, 0.0, 0.0), radius=R, drive=drive), "reel")
    given: dict[str, Any] = {
        "length": L,
        "line_density": RHO,
        "tip_mass": TIP,
        "nodes": 20,
        "segments": "inextensible",
        "stiffness": 1e4,
        "damping": 1e-3,
    }
    given |= {"boundary_segment": "constant"} | thread
    system.add(parts.Thread(reel="reel", multiplicity=copies, **given), "blade")
    if loads is not None:
        loads(system)
    return system.assemble()


def derivative(assembly: Assembly, s: Array | None = None) -> Callable[[float, Array], Array]:
    """The right-hand side as SciPy wants it."""
    switches = assembly.s.copy() if s is None else s

    def f(t: float, y: Array) -> Array:
        dy = np.empty_like(y)
        rhs(t, np.ascontiguousarray(y), switches, assembly.model, dy)
        return dy

    return f


def rotating_accelerations(assembly: Assembly, omega: float) -> Callable[[Array, Array], Array]:
    """Second derivatives, seen in a frame turning at `omega` about Z, of a model all of whose coordinates are vectors.

    The function takes q and q' in that frame; a = v' - 2 W x q' - W x (W x q), v = q' + W x q.
    """
    n = int(assembly.model.info.nq)
    f = derivative(assembly)
    W = np.array([0.0, 0.0, omega])

    def accelerations(q: Array, rate: Array) -> Array:
        x, w = q.reshape(-1, 3), rate.reshape(-1, 3)
        y = assembly.y.copy()
        y[:n], y[n : 2 * n] = q, (w + np.cross(W, x)).ravel()
        a = f(0.0, y)[n : 2 * n].reshape(-1, 3)
        return (a - 2.0 * np.cross(W, w) - np.cross(W, np.cross(W, x))).ravel()

    return accelerations


def stiffness_matrix(accelerations: Callable[[Array, Array], Array], q: Array, basis: Array, h: float = 1e-5) -> Array:
    """-d(acceleration)/dq at rest in `q` along the columns of an orthonormal `basis`, by central differences.

    Directions must keep the constraints to first order; what they break is even in h and cancels.
    """
    rest = np.zeros_like(q)
    columns = [(accelerations(q + h * e, rest) - accelerations(q - h * e, rest)) / (2.0 * h) for e in basis.T]
    return -basis.T @ np.array(columns).T


def across(n: int, axis: int) -> Array:
    """Basis of the displacements of n vectors along one axis: (3 n, n)."""
    basis = np.zeros((3 * n, n))
    basis[3 * np.arange(n) + axis, np.arange(n)] = 1.0
    return basis


def eigenvalues(matrix: Array) -> Array:
    """Real eigenvalues, ascending; complex ones are refused."""
    values = np.linalg.eigvals(matrix)
    assert np.abs(values.imag).max() <= 1e-6 * np.abs(values).max()
    return np.sort(values.real)


def fitted_order(steps: Sequence[float], errors: Sequence[float]) -> float:
    """Slope of log error over log step."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def rotation(quaternion: Sequence[float]) -> Array:
    """Rotation matrix of a quaternion, scalar part first."""
    w, x, y, z = np.array(quaternion) / np.linalg.norm(quaternion)
    u = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * u + 2.0 * u @ u


def steady_lag(rate: float = W0, offset: float = L0, speed: float = V) -> float:
    """Lag of a blade in steady pay-out, rad: sin delta = 2 v / (L0 W)."""
    return math.asin(2.0 * speed / (offset * rate))


def tangent_columns(
    assembly: Assembly, y: Array, rng: np.random.Generator, *, mass: float = 10.0, rate: float = 3.0, size: float = 1e-6
) -> tuple[Array, Array]:
    """The implicit tangent without multipliers, and central differences of the residual by steps of `size`: (nv, nv).

    The assembly's switches hold. Accelerations are random. `mass` and `rate` are the changes of accelerations and
    velocities by the increments.
    """
    model = assembly.model
    model.switches[:] = assembly.s
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    a, la, powers = rng.standard_normal(n_v), np.zeros(0), np.zeros(N_POWERS)
    matrix, r = matrix_of(model), np.zeros(n_v)

    def residual(d: Array) -> Array:
        moved = y.copy()
        blocks.displace(y, d, False, model, moved)
        moved[n_q : n_q + n_v] = y[n_q : n_q + n_v] + rate * d
        equations.residual(0.0, moved, a + mass * d, la, 0.0, 1.0, model, r, powers)
        return r.copy()

    residual(np.zeros(n_v))
    equations.tangent(0.0, y, la, mass, rate, 1.0, model, matrix)
    assert matrix.counts[OUTSIDE] == 0
    columns = [(residual(size * e) - residual(-size * e)) / (2.0 * size) for e in np.eye(n_v)]
    return sparse_of(matrix).toarray(), np.stack(columns, axis=1)


def tangent_error(assembly: Assembly, y: Array, rng: np.random.Generator) -> float:
    """Largest difference of the implicit tangent from central differences, a share of the tangent's largest entry."""
    found, differences = tangent_columns(assembly, y, rng)
    return float(np.abs(differences - found).max() / np.abs(found).max())


def flying_apart(t: np.ndarray, square: float, rate: float) -> np.ndarray:
    """Extension of a thread between two masses that are released at 1, where it may only pull.

    The solution of x'' + rate x' + square x = 0 while square x + rate x' is above 0, then free flight.

    Parameters
    ----------
    t : (nt,) float, s
    square, rate : float, 1/s2 and 1/s, stiffness and damping over the reduced mass; underdamped
    """
    decay = 0.5 * rate
    w = np.sqrt(square - decay**2)

    def moving(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x = np.exp(-decay * at) * (np.cos(w * at) + decay / w * np.sin(w * at))
        return x, -np.exp(-decay * at) * square / w * np.sin(w * at)

    # square x + rate x' = 0 where cos(w t) = decay/w sin(w t)
    free = np.arctan2(w, decay) / w
    x, v = moving(free)
    return np.where(t < free, moving(np.minimum(t, free))[0], x + v * (t - free))


def stiffness_by_differences(work: Work, step: float) -> tuple[Array, Array]:
    """Derivatives of all forces (nv, nv) and of the constraints' gaps (nj, nv) about `work`'s state, of fourth order.

    By central differences over once and twice `step`.
    """
    b, model, n = work.balance, work.model, work.n_v
    rest, columns = b.y.copy(), np.empty((n, b.r.size))
    for j in range(n):
        sides = []
        for moved in (step, -step, 2.0 * step, -2.0 * step):
            b.d[:] = 0.0
            b.d[j], b.y[:] = moved, rest
            blocks.displace(b.y, b.d, False, model, b.y)
            equilibrium.unbalance(work.time, work.step, 1.0, 1.0, model, b, b.r)
            sides.append(b.r.copy())
        columns[j] = (8.0 * (sides[0] - sides[1]) - (sides[2] - sides[3])) / (12.0 * step)
    b.y[:] = rest
    equilibrium.unbalance(work.time, work.step, 1.0, 1.0, model, b, b.r)
    return columns[:, :n].T, columns[:, n:].T
