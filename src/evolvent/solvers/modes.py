"""modes(): how a structure vibrates about an equilibrium, at rest, turning steadily or in an orbital frame."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sparse

from evolvent import families
from evolvent.builder import Assembly
from evolvent.errors import EvolventError, InputError, RunFailed
from evolvent.families import bodies_of
from evolvent.kernels import fields, joint, loads, rigid, sides, springs
from evolvent.kernels.beam_loads import FIELD
from evolvent.solvers import equilibrium as eq
from evolvent.solvers.alpha_state import displace
from evolvent.solvers.eigenproblem import Problem, along_axes
from evolvent.solvers.laws import law_failure
from evolvent.solvers.modal import Modes
from evolvent.solvers.positions import rigid_motions
from evolvent.solvers.redundancy import independent
from evolvent.solvers.solution import Solution
from evolvent.solvers.static import solve_static
from evolvent.solvers.static_work import Work, velocity_slice

Array = np.ndarray


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
    time : float, s, at which loads act and drives stand
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
    equilibrium, Z and Gy are what accelerations of the turn, or of an orbital frame, add by position and velocity
    (Coriolis). Poles of velocities are those of the linear problem of twice the size; `Modes.unstable` shows which
    grow. A steady drift, as along an orbit, is a double zero and given once, as frequency 0. Of an acceleration field
    by a law the derivatives at rest count, without `damped` only the skew-symmetric part of those by velocity.
    Modes nearest to zero come from the inverse, shifted, by SciPy (ARPACK, or LAPACK for small systems). Of real modes
    of equal frequency, the first is the one that base motion along x excites, the next along y, z, then about x, y, z,
    where they are excited at all: a round beam bends in one plane at a time, rigid-body motion comes as translations
    and rotations. The objective damping of a cable's bending goes with the rate of the curvature's size, which has no
    linear part where a cable is straight. Frequencies below some 1e-7 times the highest one asked for are round-off and
    given as 0.
    """
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise InputError(f"count is {count!r}; it must be a whole number from 1")
    where = Where(equilibrium, y, time, rotating, centre)
    assembly, equilibrium, work, (M, C, K, G) = at_equilibrium(assembly, where, damped=damped)
    problem = Problem(M, C, K, G, work.balance.weight, conservative=is_conservative(work))
    pole, shape = problem.solve(count)
    if not np.iscomplexobj(shape):
        motions = rigid_motions(assembly, equilibrium.y[-1], np.zeros(3))
        shape = along_axes(-(pole**2).real, shape, M, motions)
    return Modes(pole=pole, shape=shape, equilibrium=equilibrium, assembly=assembly, M=M, G=G)


class Where(NamedTuple):
    """An equilibrium, or where to look for one: arguments of `modes`."""

    equilibrium: Solution | None
    y: Any
    time: float
    rotating: str | Sequence[float] | None
    centre: Sequence[float] | None


def at_equilibrium(
    assembly: Assembly, where: Where, *, damped: bool
) -> tuple[Assembly, Solution, Work, tuple[sparse.csr_matrix, ...]]:
    """The equilibrium that is given or found, an assembly with a copy of the model, and `matrices` there."""
    equilibrium, y, time, rotating, centre = where
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
        work.allow_redundant()
        work.balance.la[:] = equilibrium.la[-1]
        return assembly, equilibrium, work, matrices(work, damped=damped)
    except EvolventError:
        raise
    except Exception as error:
        raise RunFailed(law_failure(assembly, error), equilibrium) from error


# ------------------------------------------------------------------------------------------------ matrices


def matrices(work: Work, *, damped: bool = True) -> tuple[sparse.csr_matrix, ...]:
    """M, C with the gyroscopic part, K with the turn's part, and the constraints' gradients G, about `work`'s state."""
    b, n_v = work.balance, work.n_v
    eq.unbalance(work.time, work.step, 1.0, 1.0, work.model, b, b.r)
    whole = work.tangent(0.0, 0.0)
    K = whole[:n_v, :n_v]
    M = work.mass()
    C = _dampers(work) if damped else sparse.csr_matrix((n_v, n_v))
    joints, gradients = work.model.flexible.joints, whole[n_v:, :n_v]
    held = np.array([joint.holds(work.time, joints, k) for k in range(work.n_j)], dtype=bool)
    penalties = np.flatnonzero(held & (joints["stiffness"] > 0.0))
    G = gradients[np.flatnonzero(held & (joints["stiffness"] == 0.0))]
    if work.redundancy is not None:
        G = independent(G, work.redundancy.rank)
    K = _completed(work, K)
    # the multiplier of a penalty is its stiffness times its gap and its damping times the gap's rate
    g = gradients[penalties]
    K = K + g.T @ sparse.diags(joints["stiffness"][penalties]) @ g
    if damped:
        C = C + g.T @ sparse.diags(joints["damping"][penalties]) @ g
    if np.any(b.spin[:3]):
        K = K + work.turning_tangent()
        C = C + gyroscopic(work, M, b.spin[:3])
    if work.model.fields.size:
        C = C + field_rates(work, M, damped=damped)
    return M, C.tocsr(), K, G.tocsr()


def field_rates(work: Work, M: sparse.csr_matrix, *, damped: bool) -> sparse.csr_matrix:
    """Derivatives of the forces of fields by velocities: Coriolis terms of an orbital frame, and those of a law.

    Without `damped` only the gyroscopic (skew-symmetric) part of a law's derivative is taken.
    """
    found = sparse.csr_matrix((work.n_v, work.n_v))
    for row in work.model.fields:
        if row["kind"] == fields.ORBIT:
            found = found + row["scale"] * gyroscopic(work, M, row["w"])
            continue
        with_field, scale = work.damping(), float(row["scale"])
        row["scale"] = 0.0
        own = with_field - work.damping()
        row["scale"] = scale
        found = found + (own if damped else 0.5 * (own - own.T))
    return found


def _dampers(work: Work) -> sparse.csr_matrix:
    """Derivative of the forces by velocities at rest, without those of fields (`field_rates`)."""
    scale = work.model.fields["scale"].copy()
    work.model.fields["scale"] = 0.0
    found = work.damping()
    work.model.fields["scale"] = scale
    return found


def _rubs(model: Any) -> bool:
    return any(
        bool(np.any(rows["friction"] > 0.0)) for rows in (model.flexible.cylinders, model.flexible.body_contacts)
    )


def is_conservative(work: Work) -> bool:
    """Whether no load turns with what it loads, and nothing rubs: K is symmetric then."""
    model = work.model
    if np.any(model.flexible.custom_forces["symmetric"] == 0.0):
        return False
    if np.any(model.flexible.beam_loads["kind"] == FIELD) or _rubs(model):
        return False
    if np.any(model.fields["kind"] == fields.LAW):
        return False
    if np.any(families.follows(model.flexible.beam_loads)) or np.any(model.loads["law"] != 0):
        return False
    if np.any(model.loads["kind"] == loads.PANEL):
        return False
    for load in model.loads[model.loads["kind"] >= loads.AT_MARKER]:
        marker = model.markers[load["target"]]
        on_free = marker["kind"] == springs.ON_BODY and model.bodies["motion"][marker["index"]] == rigid.FREE
        if on_free and (load["kind"] == loads.TORQUE or model.parameters[load["first"] + loads.FRAME] != 0.0):
            return False
    return True


def gyroscopic(work: Work, M: sparse.csr_matrix, rate: Array) -> sparse.csr_matrix:
    """Forces of velocities in a frame that turns at `rate` (3,).

    They are 2 M W x u', and of a free body's rotation J w^ - (J w)^ + w^ J.
    """
    model, n_v = work.model, work.n_v
    W = _skew(rate)
    turns = sparse.lil_matrix((n_v, n_v))
    own = []
    for family, index in work.assembly.names.values():
        where = velocity_slice(model, family, index)
        if where is None:
            continue
        if family in ("bodies", "rods"):
            for b in bodies_of(model, family, index):
                body = model.bodies[b]
                if body["motion"] == rigid.FREE:
                    at = int(body["iv"]) - work.n_q
                    turns[at : at + 3, at : at + 3] = 2.0 * W
                    J, w = body["inertia"], body["R"].T @ rate
                    own.append((at + 3, J @ _skew(w) - _skew(J @ w) + _skew(w) @ J))
            continue
        for first in range(where.start, where.stop, 3):
            turns[first : first + 3, first : first + 3] = 2.0 * W
    found = (M @ turns.tocsr()).tolil()
    for first, block in own:
        found[first : first + 3, first : first + 3] = block
    return found.tocsr()


def _skew(a: Array) -> Array:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def _attached(model: Any) -> set[int]:
    """Bodies on which anything but elements of rods acts."""
    f, markers = model.flexible, model.markers
    found = [markers["index"][markers["kind"] == springs.ON_BODY], f.hinges["body"], f.cylinders["body"]]
    for rows, index in ((f.joints, f.joints["index"]), (f.custom_points, f.custom_points["index"])):
        found.append(index[rows["on"] == sides.ON_BODY])
    found.append(f.hinges["other"][f.hinges["on"] == sides.ON_BODY])
    return {int(b) for b in np.concatenate([np.ravel(one) for one in found])}


def _completed(work: Work, K: sparse.csr_matrix) -> sparse.csr_matrix:
    """K with what the tangent of Newton's method leaves out, by differences of the forces.

    That is columns and rows of bodies (and of points, where a user's law may pull), and how loads follow the shape.
    """
    b, model, f = work.balance, work.model, work.model.flexible
    own: list[int] = []
    by_law = np.any(model.springs["law"] != 0) or f.custom_forces.size
    families = ("bodies", "points") if by_law else ("bodies",)
    for family, index in work.assembly.names.values():
        if family == "rods":  # whose own tangent is complete
            for body in sorted(set(bodies_of(model, family, index)) & _attached(model)):
                where = velocity_slice(model, "bodies", body)
                own.extend(range(where.start, where.stop) if where else ())
            continue
        where = velocity_slice(model, family, index) if family in families else None
        if where is not None:
            own.extend(range(where.start, where.stop))
    if by_law:  # nodes of beams that a spring pulls
        for point in model.points[model.points["mass"] == 0.0]:
            own.extend(range(int(point["iv"]) - work.n_q, int(point["iv"]) - work.n_q + 3))
    ends = {int(v) for v in f.hinges["iv"][f.hinges["on"] == sides.ON_COORDINATES]}
    for cylinder in f.cylinders[model.bodies["motion"][f.cylinders["body"]] != rigid.DRIVEN]:
        ends.update(f.contact_points["iv"][int(cylinder["first"]) : int(cylinder["last"])].ravel().tolist())
    facing = {v - work.n_q + c for v in ends for c in range(3)} if own else set()
    following: set[int] = set()
    for push in f.beam_loads[f.beam_loads["kind"] == FIELD]:
        where = velocity_slice(model, "beams", int(push["beam"]))
        following.update(range(work.n_v)[where] if where else ())
    if not own and not following:
        return K
    rest, spin = b.y.copy(), b.spin.copy()
    b.spin[:] = 0.0
    closeness = 1e-7 if f.body_contacts.size else 1e-3  # bodies that touch stay in contact

    def forces(at: int, step: float) -> Array:
        b.d[:] = 0.0
        b.d[at] = step
        b.y[:] = rest
        displace(b.y, b.d, model, b.y)
        eq.unbalance(work.time, work.step, 1.0, 1.0, model, b, b.r)
        return np.array([b.r[: work.n_v], f.P])

    def derivative(at: int) -> Array:
        h = closeness * b.weight[at]
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
