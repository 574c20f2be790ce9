"""The linear motion about an equilibrium, M u'' + C u' + K u + G^T la = 0, G u = 0: its matrices, and what grows."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from evolvent.algebra.eigenproblem import Eigenproblem
from evolvent.kernels import rigid
from evolvent.kernels.blocks import POSITION, RATE, ROTATION, SLOPE
from evolvent.model.registry import asked, frames_of
from evolvent.solvers.common.redundancy import independent_rows, is_held
from evolvent.solvers.common.standing import idle_nodes
from evolvent.solvers.static import equilibrium as eq
from evolvent.solvers.static.work import Work, rubs

Array = np.ndarray


def growing_motions(work: Work) -> Array | None:
    """Poles (k,) complex, 1/s, of the motions that grow about `work`'s state, fastest first; None where unknown.

    Of a pair of conjugate poles the one above the real axis. Dampers count. Where something rubs nothing is known.
    """
    if rubs(work.model):
        return None
    M, C, K, G = matrices(work)
    return Eigenproblem(M, C, K, G, work.balance.weight, conservative=False).growing()


def has_gyroscopic_forces(work: Work) -> bool:
    """Whether a steady turn, an orbital frame or wheels bring in forces that can stabilize where the energy rises."""
    turns: Any = np.any(work.balance.spin[:3]) or np.any(work.balance.y[work.model.wheels["iv"]])
    turns = turns or any(flows(work.model).size for flows in asked("state.flows").values())
    return bool(turns) or bool(frames_of(work.model))


def matrices(work: Work, *, damped: bool = True) -> tuple[scipy.sparse.csr_matrix, ...]:
    """M, C with the gyroscopic part, K with the turn's part, and the constraints' gradients G, about `work`'s state."""
    b, n_v = work.balance, work.n_v
    eq.unbalance(work.time, work.step, 1.0, 1.0, work.model, b, b.r)
    whole = work.tangent(0.0, 0.0)
    K = whole[:n_v, :n_v]
    M = work.mass()
    C = _dampers(work) if damped else _spin_of_wheels(work) + _flow(work)
    rows, gradients = work.model.constraints, whole[n_v:, :n_v]
    penalties = _penalties(work)
    G = gradients[np.flatnonzero(is_held(rows, work.time))]
    if work.redundancy is not None:
        G = G[independent_rows(G, work.redundancy.rank)]
    # impulses are sums over time, not motions, and no force moves thread on its spool
    rates = work.model.blocks["iv"][work.model.blocks["kind"] == RATE] - work.n_q
    idle = np.concatenate([rates, idle_nodes(work.model)])
    G = scipy.sparse.vstack([G, scipy.sparse.identity(n_v, format="csr")[idle]])
    # the multiplier of a penalty is its stiffness times its gap and its damping times the gap's rate
    g = gradients[penalties]
    K = K + g.T @ scipy.sparse.diags(rows["stiffness"][penalties]) @ g
    if damped:
        C = C + g.T @ scipy.sparse.diags(rows["damping"][penalties]) @ g
    if np.any(b.spin[:3]):
        K = K + work.turning_tangent()
        C = C + gyroscopic(work, M, b.spin[:3])
    if frames_of(work.model):
        C = C + frame_rates(work, M, damped=damped)
    return M, C.tocsr(), K, G.tocsr()


def _penalties(work: Work) -> Array:
    """Rows of constraint that are penalties and hold."""
    rows = work.model.constraints
    return np.flatnonzero((work.time <= rows["until"]) & (rows["stiffness"] > 0.0))


def softened(work: Work) -> list[tuple[float, scipy.sparse.csr_matrix]]:
    """What of K relaxes with each relaxation time about `work`'s state, whose stresses stay: times (s), (nv, nv).

    At the rate s of a motion, such as i w, the stiffness is K less the sum of these over 1 + s times their time.
    """
    b, n_v, found = work.balance, work.n_v, []
    penalties = _penalties(work)
    stiffness = scipy.sparse.diags(work.model.constraints["stiffness"][penalties])

    def tangent() -> scipy.sparse.csr_matrix:
        eq.unbalance(work.time, work.step, 1.0, 1.0, work.model, b, b.r)
        whole = work.tangent(0.0, 0.0)
        return whole[:n_v, :n_v] + whole[:n_v, n_v:][:, penalties] @ stiffness @ whole[n_v:, :n_v][penalties]

    whole = tangent()
    for memory in asked("statics.memory").values():
        for time, part in memory(work.model).softened():
            found.append((time, (whole - tangent()) / part))
    return found


def frame_rates(work: Work, M: scipy.sparse.csr_matrix, *, damped: bool) -> scipy.sparse.csr_matrix:
    """Derivatives of forces on all masses by velocities: Coriolis terms of an orbital frame, and those of a law.

    Without `damped` only the gyroscopic (skew-symmetric) part of a law's derivative is taken.
    """
    found = scipy.sparse.csr_matrix((work.n_v, work.n_v))
    for _, rate, row in frames_of(work.model):
        if rate is not None:
            found = found + row["scale"] * gyroscopic(work, M, rate)
            continue
        with_field, scale = work.damping(), float(row["scale"])
        row["scale"] = 0.0
        own = with_field - work.damping()
        row["scale"] = scale
        found = found + (own if damped else 0.5 * (own - own.T))
    return found


def _dampers(work: Work) -> scipy.sparse.csr_matrix:
    """Derivative of the forces by velocities at rest, without those on all masses (`frame_rates`)."""
    kept = [(row, float(row["scale"])) for _, _, row in frames_of(work.model)]
    for row, _ in kept:
        row["scale"] = 0.0
    found = work.damping()
    for row, scale in kept:
        row["scale"] = scale
    return found


def _spin_of_wheels(work: Work) -> scipy.sparse.csr_matrix:
    """Derivative of w x h by the rates of bodies, h the momentum of their wheels: gyroscopic, so no damper."""
    found = scipy.sparse.lil_matrix((work.n_v, work.n_v))
    for wheel in work.model.wheels:
        body, h = work.model.bodies[wheel["body"]], wheel["inertia"] * work.balance.y[wheel["iv"]] * wheel["axis"]
        if body["motion"] == rigid.FREE:
            turn = slice(int(body["iv"]) + 3 - work.n_q, int(body["iv"]) + 6 - work.n_q)
            found[turn, turn] -= _skew(h)
    return found.tocsr()


def _flow(work: Work) -> scipy.sparse.csr_matrix:
    """Gyroscopic part of the derivative by velocities of what material flows through."""
    rows, found = np.zeros(work.n_v), scipy.sparse.csr_matrix((work.n_v, work.n_v))
    for flows in asked("state.flows").values():
        rows[flows(work.model) - work.n_q] = 1.0
    if not np.any(rows):
        return found
    own, only = _dampers(work), scipy.sparse.diags(rows)
    return only @ (0.5 * (own - own.T)) @ only


def gyroscopic(work: Work, M: scipy.sparse.csr_matrix, rate: Array) -> scipy.sparse.csr_matrix:
    """Forces of velocities in a frame that turns at `rate` (3,).

    They are 2 M W x u', of a free body's rotation J w^ - (J w)^ + w^ J, and between it and a wheel S w x n.
    """
    model, n_v = work.model, work.n_v
    W = _skew(rate)
    turns = scipy.sparse.lil_matrix((n_v, n_v))
    own = []
    for block in model.blocks:
        at = int(block["iv"]) - work.n_q
        rows = slice(at, at + 3)
        if block["kind"] in (POSITION, SLOPE):
            turns[rows, rows] = 2.0 * W
        elif block["kind"] == ROTATION:
            body = model.bodies[block["owner"]]
            J, w = body["inertia"], body["R"].T @ rate
            own.append((rows, rows, J @ _skew(w) - _skew(J @ w) + _skew(w) @ J))
    for wheel in model.wheels:
        body, at = model.bodies[wheel["body"]], int(wheel["iv"]) - work.n_q
        across, first = wheel["inertia"] * np.cross(body["R"].T @ rate, wheel["axis"]), int(body["iv"]) - work.n_q
        turn, spin = slice(first + 3, first + 6), slice(at, at + 1)
        if body["motion"] == rigid.SPIN:
            across, turn = across @ body["axis"][:, None], slice(first, first + 1)
        own += [(turn, spin, across[:, None]), (spin, turn, -across[None])]
    found = (M @ turns.tocsr()).tolil()
    for rows, columns, block in own:
        found[rows, columns] = block
    return found.tocsr()


def _skew(a: Array) -> Array:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
