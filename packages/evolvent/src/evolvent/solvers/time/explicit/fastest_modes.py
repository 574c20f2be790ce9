"""Beams and penalties under explicit methods: their fastest mode."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.blocks import owner_of
from evolvent.assembly.families import owner
from evolvent.equations.rhs import rhs
from evolvent.kernels import contact_laws
from evolvent.kernels.ancf_beams import beam_rates
from evolvent.kernels.blocks import ANGLE, MOVES, POSITION, ROTATION, SCALAR, SLOPE, block_at
from evolvent.kernels.impulse import jump, prepare
from evolvent.model import Model
from evolvent.model.registry import asked, families

#: Up to so many velocities the eigenvalues are those of the whole matrix.
_DENSE = 120
#: Displacement (m, or 1 of slopes and turns) of the central differences of forces.
STEP = 1e-6


def fastest_explicit_mode(assembly: Assembly) -> tuple[float, float, str, float]:
    """Square of the highest frequency (rad2/s2), damping rate of that mode (1/s), where it is, largest damping rate.

    Of the model as it starts, with every contact point in contact, across its beam, and every stop reached,
    every latch locked.

    Notes
    -----
    Largest eigenvalues of M^-1 K and M^-1 C, whose products are central differences of the accelerations: everything
    that makes forces counts. Threads are left to their own bounds.
    """
    model = assembly.model
    n_v = int(model.info.nv)
    saved = {name: getattr(model, name).copy() for name in asked("stability.stiffest")}
    accelerations = _accelerations(assembly)
    touching = _contact_products(assembly)
    moves = displaceable(model)[2]
    zero = np.zeros(n_v)

    def stiff(x: np.ndarray) -> np.ndarray:
        d = STEP * moves * x / max(float(np.abs(x).max()), 1e-300)
        scale = 0.5 * float(np.abs(x).max()) / STEP
        return moves * (scale * (accelerations(-d, zero) - accelerations(d, zero)) + touching(0, moves * x))

    def damped(x: np.ndarray) -> np.ndarray:
        d = STEP * moves * x / max(float(np.abs(x).max()), 1e-300)
        scale = 0.5 * float(np.abs(x).max()) / STEP
        return moves * (scale * (accelerations(zero, -d) - accelerations(zero, d)) + touching(1, moves * x))

    try:
        for stiffen in asked("stability.stiffest").values():
            stiffen(model)
        squared, shape = _largest(stiff, n_v)
        damping = damped(shape)
        largest = _largest(damped, n_v)[0] if np.any(damping) else 0.0
    finally:
        for name, records in saved.items():
            getattr(model, name)[:] = records
    own = float(shape @ damping / (shape @ shape)) if squared > 0.0 else 0.0
    return max(squared, 0.0), max(own, 0.0), _location(assembly, int(np.argmax(np.abs(shape)))), max(largest, 0.0)


def _largest(product: Callable[[np.ndarray], np.ndarray], n: int) -> tuple[float, np.ndarray]:
    """Largest real eigenvalue of a matrix given by its products, and its vector."""
    if n <= _DENSE:
        values, vectors = np.linalg.eig(np.array([product(e) for e in np.eye(n)]).T)
    else:
        start = np.random.default_rng(0).standard_normal(n)
        operator = scipy.sparse.linalg.LinearOperator((n, n), matvec=product, dtype=float)
        try:
            values, vectors = scipy.sparse.linalg.eigs(
                operator, k=1, which="LM", v0=start, ncv=40, tol=1e-5, maxiter=100
            )
        except scipy.sparse.linalg.ArpackError:  # a power iteration never fails, it is only late
            x = start
            for _ in range(1000):
                x = product(x / np.linalg.norm(x))
            return float(np.linalg.norm(x)), x
    best = int(np.argmax(values.real))
    return float(values[best].real), np.array(vectors[:, best].real)


def displaceable(model: Model) -> tuple[np.ndarray, list[tuple[int, int]], np.ndarray]:
    """What is displaced in the differences of accelerations.

    Returns
    -------
    places : (nv,) int, coordinates that belong to velocities; -1 of turns, and of what is not displaced
    turning : list of pairs of int, first coordinate of each quaternion, and first of its velocities
    moving : (nv,) float, 1 of velocities that are free, 0 of those that a switch holds
    """
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    places, turning, moving = np.full(n_v, -1), list[tuple[int, int]](), np.ones(n_v)
    for block in model.blocks:
        iq, iv, size = int(block["iq"]), int(block["iv"]) - n_q, int(block["count"])
        if block["switch"] != MOVES:
            moving[iv : iv + size] = 0.0
        if block["kind"] == ROTATION:
            turning.append((iq, iv))
        elif block["kind"] in (POSITION, SLOPE, ANGLE) or (block["kind"] == SCALAR and _has_no_bound(block)):
            places[iv : iv + size] = np.arange(iq, iq + size)
    return places, turning, moving


def _accelerations(assembly: Assembly) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Accelerations of the start displaced by (a, b), changes of coordinates and rates by velocity."""
    model = assembly.model
    needs.load(model, rhs)
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    y, dy, s = assembly.y.copy(), np.zeros_like(assembly.y), assembly.s.copy()
    places, turning, _ = displaceable(model)
    moved = np.flatnonzero(places >= 0)
    turns = np.array(turning, dtype=np.int64).reshape(-1, 2)
    quaternions, vectors = turns[:, :1] + np.arange(4), turns[:, 1:] + np.arange(3)
    starts = assembly.y[quaternions]
    w, u = starts[:, :1], starts[:, 1:]
    half = 0.5 * u

    def accelerations(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        y[:] = assembly.y
        y[places[moved]] += a[moved]
        y[n_q : n_q + n_v] += b
        if turning:  # to first order, which is enough for differences
            d, found = a[vectors], starts.copy()
            found[:, 0] -= [float(one @ turn) for one, turn in zip(half, d, strict=True)]
            crossed = u[:, [1, 2, 0]] * d[:, [2, 0, 1]] - u[:, [2, 0, 1]] * d[:, [1, 2, 0]]
            found[:, 1:] += 0.5 * (w * d + crossed)
            lengths = np.sqrt([float(one @ one) for one in found])
            y[quaternions] = found / lengths[:, None]
        rhs(0.0, y, s, model, dy)
        return dy[n_q : n_q + n_v].copy()

    return accelerations


def _has_no_bound(block: np.record) -> bool:
    """Whether no bound is known of the modes of what a block belongs to."""
    return families()[owner_of(block)[0]].stability.bound is None


def touches(model: Model) -> bool:
    """Whether contacts count whose stiffness is added to that of the rates."""
    return bool(model.contact_surfaces.size)


def _contact_products(assembly: Assembly) -> Callable[[int, np.ndarray], np.ndarray]:
    """M^-1 times the stiffness (0) or damping (1) of all contact points, held across the beam, times a vector."""
    model, y = assembly.model, assembly.y
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    if not touches(model):
        return lambda what, x: np.zeros_like(x)
    contacts = model.contact_points
    columns = contacts["iv"][:, None, :] - n_q + np.arange(3)[None, :, None]  # check, component, vector
    S = np.broadcast_to(contacts["S"][:, None, :], columns.shape)
    rows = np.broadcast_to(np.arange(3 * contacts.size).reshape(-1, 3, 1), columns.shape)
    G = scipy.sparse.csr_matrix((S.ravel(), (rows.ravel(), columns.ravel())), shape=(3 * contacts.size, n_v))
    along = np.array([y[q[1] : q[1] + 3] + y[q[3] : q[3] + 3] for q in contacts["iq"]])
    along /= np.linalg.norm(along, axis=1)[:, None]
    values = np.zeros((2, contacts.size))
    for row in model.contact_surfaces:
        values[:, row["first"] : row["last"]] += np.array(contact_laws.bound_of(row, "radius"))[:, None]
    dy, still, s0 = np.zeros_like(y), y.copy(), assembly.s.copy()
    still[n_q : n_q + n_v] = 0.0
    needs.load(model, prepare, jump)

    def product(what: int, x: np.ndarray) -> np.ndarray:
        s = (G @ x).reshape(-1, 3)
        s = values[what][:, None] * (s - np.sum(along * s, axis=1)[:, None] * along)
        prepare(0.0, still, s0, model)
        model.F[:] = -(G.T @ s.ravel())
        model.P[:] = 0.0
        dy[:] = 0.0
        beam_rates(still, model, dy)
        moved = still.copy()
        jump(moved, s0, model, dy)  # which the rows of constraint answer
        return moved[n_q : n_q + n_v]

    return product


def _location(assembly: Assembly, velocity: int) -> str:
    """Name of the part that a velocity belongs to."""
    return owner(assembly, *owner_of(block_at(assembly.model, velocity)))
