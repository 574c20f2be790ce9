"""solve_static(): equilibria of an assembled model, by load steps or along an arc."""

from __future__ import annotations

import dataclasses
import math
import time as clock
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from evolvent import codecache, families, jit
from evolvent import model as mdl
from evolvent.builder import Assembly
from evolvent.errors import InputError
from evolvent.flow import needs
from evolvent.flow.implicit import residual, tangent
from evolvent.flow.powers import N_POWERS
from evolvent.kernels import contact, contact_laws, loads, rigid, sparse_lu, springs
from evolvent.kernels.flexible import NODE_VECTORS
from evolvent.kernels.layers import UNKNOWN
from evolvent.kernels.sparse import INNER, SparseBlocks, clear
from evolvent.parts.checks import number, positive
from evolvent.solvers import equilibrium as eq
from evolvent.solvers import ordering
from evolvent.solvers.implicit import matrix_of, redundant, sizes
from evolvent.solvers.laws import law_failure, refusing_laws, try_laws

Array = np.ndarray

#: Iterations of one step, and of a slide to an equilibrium.
MOST_ITERATIONS, MOST_SLIDES = 25, 2000
#: Load step below which there is no going on, and the first one.
SMALLEST_STEP, FIRST_STEP = 1e-6, 0.1
#: Load step above which none is accepted in which a slope turns by more than a right angle: it has turned over.
CAREFUL = 1e-3
#: Pivots of statics that may be deferred at most.
MOST_DEFERRED = 600
#: What multiplies a mass so that the stiffness beside it is round-off.
_HUGE = 1e40


@dataclasses.dataclass
class StaticSolution:
    """What `solve_static` returns; it prints nothing.

    Attributes
    ----------
    factor : (np,) float, load factors along the path
    y : (np, ny) float, states there as the assembly's `y`; their velocities are those of a steady turn, or zero
    la : (np, nj) float, multipliers of the joints: reactions, N (N m of directions)
    elastic, bending, contact, coupled : (np,) float, J
        Energies: all elastic ones, the part of bending in cables and of contact among them; hinges and penalties.
    loads : (np, nv) float, N, generalised loads on beams and weights
    cylinders, wrenches : as of `ImplicitSolution`, without impulses
    spin : (6,) float, rad/s and m, rate and centre of the steady turn
    time : float, s, at which feeds and loads stand
    free : list of str, parts that move without any resistance at the end; the equilibrium is then one of many
    unstable : int, independent directions in which the energy falls at the end; -1 where they were not counted
    status, message, statistics, wall_time, compile_time : as of `evolvent.solvers.Solution`
    """

    factor: Array
    y: Array
    la: Array
    elastic: Array
    bending: Array
    contact: Array
    coupled: Array
    loads: Array
    cylinders: Array
    wrenches: Array
    spin: Array
    time: float
    free: list[str]
    unstable: int
    status: str
    message: str
    statistics: dict[str, float]
    wall_time: float
    compile_time: float

    @property
    def success(self) -> bool:
        """Whether the whole load is carried."""
        return self.status == "success"


def solve_static(
    assembly: Assembly,
    *,
    y: Any = None,
    load_steps: int | Sequence[float] | None = None,
    arc_length: bool = False,
    time: float = 0.0,
    rotating: str | Sequence[float] | None = None,
    centre: Sequence[float] | None = None,
    tolerance: float = 1e-10,
    most_steps: int = 1000,
    progress: Callable[[float], None] | None = None,
) -> StaticSolution:
    """Find the equilibrium of an assembled model under its loads.

    Gravity, beam loads, forces and torques and a steady turn grow together with the load factor from 0 to 1, and what
    the start leaves unbalanced fades out meanwhile; steps are cut where Newton's method does not converge. Where no
    step leads on, the state slides down its energy to the next equilibrium.

    Parameters
    ----------
    assembly : Assembly; its initial state is left as it is
    y : (ny,) float, state to start from; the assembly's own if left out
    load_steps : int or sequence of float, optional
        Load factors on whose equilibria the path lands, n for 1/n, 2/n, ... 1; along an arc, the first step is 1/n.
    arc_length : bool
        Follow the path through limits of load and of displacement, from the equilibrium without load to where the
        factor first reaches 1 (Crisfield 1981, cylindrical).
    time : float, s, at which feeds stand and loads act; ramps count as over
    rotating : str or (3,) float, optional, rad/s
        A steady turn of everything, the ground included, about an axis: a driven body's, by its name, or a rate. Loads
        turn with it.
    centre : (3,) float, m, on that axis; the body's place or the origin if left out
    tolerance : float, correction at which an iteration has converged, beside the size of the system (or 1 for slopes)
    most_steps : int, after which the search is given up
    progress : called with the load factor reached

    Returns
    -------
    StaticSolution
        One that fails keeps what it reached, at least the state that it started from.

    Raises
    ------
    InputError
        For arguments out of range, parts without an implicit form, loads that cannot turn, redundant constraints.

    Notes
    -----
    Dampers rest, latches stay open. Friction acts where the path rubs.
    """
    targets = _targets(load_steps)
    tolerance = positive("tolerance", tolerance)
    time = number("time", time, allowed="a finite time, s")
    families.check(assembly, families.STATIC)
    try_laws(assembly, time, time)
    began = clock.perf_counter()
    with refusing_laws(assembly):
        work = Work(assembly, y, time, spin_of(assembly, rotating, centre))
    compile_time = clock.perf_counter() - began
    began = clock.perf_counter()
    with refusing_laws(assembly):
        work.refuse_redundant()
    search = _Search(work, tolerance, most_steps, progress)
    try:
        if arc_length:
            search.along_an_arc(FIRST_STEP if load_steps is None else targets[0])
        else:
            search.by_steps(targets, whole=load_steps is None)
    except KeyboardInterrupt:
        search.status, search.message = "interrupted", f"interrupted at load factor {search.reached:.6g}; {_KEPT}"
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
        failure = law_failure(assembly, error, [(work.time, work.balance.y, assembly.s)])
        search.status, search.message = "failed", f"beyond load factor {search.reached:.6g}, {failure}; {_KEPT}"
    wall_time = clock.perf_counter() - began
    codecache.mark_warm("statics")
    return search.solution(wall_time, compile_time)


_KEPT = "what was computed is kept"


def _targets(load_steps: int | Sequence[float] | None) -> Array:
    """Load factors to land on, the last of them 1."""
    if load_steps is None:
        return np.ones(1)
    if isinstance(load_steps, int) and not isinstance(load_steps, bool):
        if load_steps < 1:
            raise InputError(f"load_steps is {load_steps!r}; it must be a whole number from 1, or load factors")
        return np.arange(1, load_steps + 1) / load_steps
    try:
        found = np.array(load_steps, dtype=float)
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.ndim != 1 or not found.size or not np.all(np.diff(found, prepend=0.0) > 0.0) or found[-1] > 1.0:
        raise InputError(f"load_steps is {load_steps!r}; it must be load factors that increase, above 0 and up to 1")
    return found if found[-1] == 1.0 else np.append(found, 1.0)


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
    if np.linalg.norm(np.cross(axis, gravity)) > 1e-9 * np.linalg.norm(axis) * np.linalg.norm(gravity):
        raise InputError(f"gravity {tuple(gravity)} is not along the axis of the steady turn, so nothing is steady")
    for name, (family, index) in assembly.names.items():
        if family == "bodies" and model.bodies["motion"][index] == rigid.SPIN:
            own = model.bodies["R0"][index] @ model.bodies["axis"][index]
            if np.linalg.norm(np.cross(axis, own)) > 1e-9 * np.linalg.norm(axis):
                raise InputError(f"the axis of {name!r} is not along that of the steady turn")
    return spin


def _vector(name: str, value: Any) -> Array:
    try:
        found = np.array(value, dtype=float)
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.shape != (3,) or not np.all(np.isfinite(found)):
        raise InputError(f"{name} is {value!r}; it must be 3 finite numbers")
    return found


def at_rest(model: mdl.Model, time: float) -> mdl.Model:
    """A copy of a model for statics: driven bodies stand where they are at `time`, ramps are over, nothing latched."""
    copy = model.copy()
    flexible = copy.flexible
    rigid.kinematics(time, np.zeros(int(model.info.ny)), copy)
    driven = copy.bodies["motion"] == rigid.DRIVEN
    copy.bodies["rate"][driven] = 0.0
    for scratch in ("v", "w", "F"):
        copy.bodies[scratch] = 0.0
    flexible.beam_loads["ramp"] = 0.0
    flexible.contact_points["gap"], flexible.contact_points["carrier"] = np.inf, UNKNOWN
    flexible.contact_points["stick"] = 0.0
    flexible.contact_points["drag"] = 0.0
    flexible.hinges["latched"] = 0.0
    # what tells these apart is work over a step in time
    flexible.cylinders["law"][flexible.cylinders["law"] == contact_laws.CONSERVATIVE] = contact_laws.HUNT_CROSSLEY
    flexible.cylinders["stick_damping"] = 0.0
    flexible.cylinders["share"] = 1.0
    return copy


class Work:
    """A copy of a model at rest, and room to look for its equilibria."""

    def __init__(self, assembly: Assembly, y: Any, time: float, spin: Array) -> None:
        self.assembly, self.time = assembly, float(time)
        self.model = model = at_rest(assembly.model, time)
        self.n_q, self.n_v = int(model.info.nq), int(model.info.nv)
        self.n_j = model.flexible.joints.size
        if self.n_v == 0:
            raise InputError("nothing in the system can move")
        self.matrix = matrix_of(model, spare=spare_of(model))
        n_u = self.n_v + self.n_j
        self.step = 1.0 if np.any(model.flexible.cylinders["friction"] > 0.0) else -1.0
        start = np.array(assembly.y if y is None else y, dtype=float)
        if start.shape != assembly.y.shape or not np.all(np.isfinite(start)):
            raise InputError(f"y has the shape {start.shape}; it must be {assembly.y.shape}, finite numbers")
        start[self.n_q :] = 0.0
        weight, _ = sizes(assembly)
        slopes = [
            int(row["iq"]) + 3 * k
            for row in model.flexible.beams
            for k in range(NODE_VECTORS[row["kind"]] * int(row["nodes"]))
            if k % NODE_VECTORS[row["kind"]] > 0
        ]
        #: Places in the state of all slopes of beams, (n, 3).
        self.slopes = np.add.outer(np.array(slopes, dtype=np.int64), np.arange(3))
        unknowns = {name: np.zeros(n_u) for name in ("r", "p", "x", "z", "start")}
        moves = {name: np.zeros(self.n_v) for name in ("a", "d", "total", "before")}
        self.balance = eq.Balance(
            y=start,
            la=np.zeros(self.n_j),
            weight=weight,
            powers=np.zeros(N_POWERS),
            spin=spin,
            parameters=model.parameters.copy(),
            tally=np.zeros(eq.N_TALLY, dtype=np.int64),
            clock=np.zeros(eq.N_CLOCK),
            **unknowns,
            **moves,
        )
        jit.load((*needs.balance(model), *eq.functions()))
        # friction is that of displacements from here on
        b = self.balance
        residual(self.time, b.y, b.a, b.la, 0.0, 1.0, model, b.r, b.powers)
        if model.flexible.cylinders.size:
            contact.end_contact_step(b.y, model)

    def refuse_redundant(self) -> None:
        """Refuse constraints that others imply: the tangent with masses is singular only by them."""
        b = self.balance
        self.probe(0.0, 1e12)
        if b.tally[eq.LOOSE] > 0:
            raise InputError(redundant(self.assembly, self.matrix))

    def probe(self, factor: float, shift: float = 0.0) -> int:
        """Unbalance and factors of the tangent of the state."""
        return int(eq.probe(self.time, self.step, factor, shift, self.model, self.matrix, self.balance))

    def tangent(self, c_mass: float, c_rate: float) -> sparse.csr_matrix:
        """Tangent of the last unbalance, constraints included, by velocities and then joints; the turn is left out."""
        b = self.balance
        tangent(self.time, b.y, b.la, c_mass, c_rate, 1.0, self.model, self.matrix)
        return sparse_of(self.matrix)

    def turning_tangent(self) -> sparse.csr_matrix:
        """What the accelerations of the turn add to the tangent, (nv, nv)."""
        clear(self.matrix)
        eq.add_turning_tangent(1.0, self.balance.spin, self.model, self.matrix)
        return sparse_of(self.matrix)[: self.n_v, : self.n_v]

    @property
    def rows(self) -> Array:
        """Unknowns of the multipliers."""
        return self.n_v + np.arange(self.n_j)

    def mass(self) -> sparse.csr_matrix:
        """Mass matrix, (nv, nv)."""
        return self._part(_HUGE, 0.0)

    def damping(self) -> sparse.csr_matrix:
        """Derivative of the forces by velocities at rest, (nv, nv)."""
        return self._part(0.0, _HUGE)

    def _part(self, c_mass: float, c_rate: float) -> sparse.csr_matrix:
        found = self.tangent(c_mass, c_rate)[: self.n_v, : self.n_v] / _HUGE
        found.data[np.abs(found.data) < 1e-25 * np.abs(found.data).max(initial=0.0)] = 0.0
        found.data[np.abs(found.data) < 1e-28] = 0.0
        found.eliminate_zeros()
        return found

    def falling_directions(self) -> int:
        """In how many independent directions the energy falls about the last state (full load); -1 if that is unknown.

        Notes
        -----
        Negative pivots of K + gamma G^T G, eliminated along its diagonal (Sylvester).
        """
        whole = self.tangent(0.0, 0.0)
        joints = self.model.flexible.joints
        held = [k for k in range(self.n_j) if joints["stiffness"][k] == 0.0 and self.time <= joints["until"][k]]
        G = whole[self.n_v :, : self.n_v][held]
        K = whole[: self.n_v, : self.n_v]
        if np.any(self.balance.spin[:3]):
            K = K + self.turning_tangent()
        size = abs(K).max(axis=1).toarray().ravel()
        D = sparse.diags(1.0 / np.sqrt(np.where(size > 0.0, size, 1.0)))
        A = D @ (0.5 * (K + K.T)) @ D
        if held:
            G = G @ D
            A = A + 1e4 * (G.T @ sparse.diags(1.0 / np.asarray(G.multiply(G).sum(axis=1)).ravel()) @ G)
        try:
            lu = splu(A.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError:  # a pivot is zero
            return -1
        return int(np.sum(lu.U.diagonal() < 0.0)) if np.array_equal(lu.perm_r, lu.perm_c) else -1

    def free_motions(self, factor: float) -> list[str]:
        """Which parts the tangent lets go without resistance."""
        b = self.balance
        if self.probe(factor) < 0 or b.tally[eq.LOOSE] == 0:
            return []
        count = int(b.tally[eq.LOOSE])
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
        size = np.abs(X / b.weight[:, None]).max(axis=1)
        found = []
        for name, (family, index) in self.assembly.names.items():
            where = places_of(self.model, family, index)
            if where is not None and size[where].max(initial=0.0) > 0.05 * size.max():
                found.append(name)
        return found


def places_of(model: mdl.Model, family: str, index: int) -> slice | None:
    """Velocities of a part that moves, as the model counts them; None of one that does not."""
    n_q = int(model.info.nq)
    if family == "beams":
        row = model.flexible.beams[index]
        first = int(row["iv"]) - n_q
        return slice(first, first + 3 * NODE_VECTORS[row["kind"]] * int(row["nodes"]))
    if family == "points":
        first = int(model.points["iv"][index]) - n_q
        return slice(first, first + 3)
    if family == "bodies" and model.bodies["motion"][index] != rigid.DRIVEN:
        first = int(model.bodies["iv"][index]) - n_q
        return slice(first, first + (6 if model.bodies["motion"][index] == rigid.FREE else 1))
    return None


def spare_of(model: mdl.Model) -> int:
    """Pivots that statics may defer: without masses a beam or a body may be held by its joints only."""
    bodies = int(np.sum(model.bodies["motion"] != rigid.DRIVEN))
    return min(6 * (model.flexible.beams.size + bodies) + 3 * model.points.size, MOST_DEFERRED)


def sparse_of(matrix: SparseBlocks) -> sparse.csr_matrix:
    """A matrix before it is factored, inner unknowns included; by velocities and then joints."""
    values, rows, columns = ordering.entries(matrix)
    n = matrix.place.size
    found = sparse.coo_matrix((values, (rows, columns)), shape=(n, n)).tocsr()
    found.eliminate_zeros()
    inner = int(matrix.counts[INNER])
    if inner:
        B, C = (sparse.csr_matrix(part[matrix.place, :inner]) for part in (matrix.B, matrix.C))
        found = found + B @ C.T
    return found


class _Search:
    """The path so far, and how it goes on."""

    def __init__(self, work: Work, tolerance: float, most: int, progress: Callable[[float], None] | None) -> None:
        self.work, self.tolerance, self.most, self.progress = work, tolerance, most, progress
        self.kept: list[tuple[Any, ...]] = []
        self.status, self.message = "success", "the whole load is carried"
        self.reached, self.steps, self.rejected, self.slides = 0.0, 0, 0, 0
        self.worst = 1.0
        self.free: list[str] = []
        self.unstable = -1

    # ------------------------------------------------------------------------------------------ one step

    def _balance(self, factor: float, share: float = 1.0) -> int:
        w = self.work
        return int(
            eq.balance(w.time, w.step, factor, share, self.tolerance, MOST_ITERATIONS, w.model, w.matrix, w.balance)
        )

    def _state(self) -> tuple[Array, Array, Array]:
        b = self.work.balance
        return b.y.copy(), b.la.copy(), b.before.copy()

    def _back(self, state: tuple[Array, Array, Array]) -> None:
        b = self.work.balance
        b.y[:], b.la[:], b.before[:] = state

    def _turned_over(self, before: Array) -> bool:
        """Whether a beam's slope points against where it pointed before."""
        slopes = self.work.slopes
        return bool(np.any(np.einsum("ij,ij->i", before[slopes], self.work.balance.y[slopes]) < 0.0))

    def _keep(self, factor: float) -> None:
        """Accept the state, and keep it as a point of the path."""
        w = self.work
        b, f = w.balance, w.model.flexible
        energies = np.zeros(5)
        eq.accept(w.time, w.model, b, energies)
        b.clock[eq.FACTOR] = self.reached = factor
        self.worst = min(self.worst, float(b.clock[eq.QUALITY]))
        cylinders = np.zeros((f.cylinders.size, 9))
        for k in range(f.cylinders.size):
            row = f.cylinders[k]
            cylinders[k, :6], cylinders[k, 6], cylinders[k, 8] = row["F"], row["normal"], row["touching"]
        y = b.y.copy()
        add_turn(w.model, b.spin * math.sqrt(max(factor, 0.0)), y)
        self.kept.append((factor, y, b.la.copy(), energies, f.P.copy(), cylinders, w.model.bodies["F"].copy()))
        if self.progress is not None:
            self.progress(factor)

    def _slide(self, factor: float) -> bool:
        """Slide to an equilibrium at a factor, then balance."""
        w = self.work
        b = w.balance
        self.slides += 1
        m = w.mass().diagonal()
        w.probe(factor)
        ratio = np.abs(b.r[: w.n_v]) / (m * b.weight)
        shift, goal = max(float(ratio.max()) / 0.05, 1e-12), 1e-3
        for _ in range(4):
            found = eq.relax(w.time, w.step, factor, shift, goal, MOST_SLIDES, w.model, w.matrix, b)
            if found < 0:
                return False
            state = self._state()
            if self._balance(factor) >= 0:
                return True
            self._back(state)
            shift *= goal
        return False

    # ------------------------------------------------------------------------------------------ by load steps

    def by_steps(self, targets: Array, *, whole: bool) -> None:
        """Land on every target; the start's unbalance fades out on the way, or before where targets are given."""
        w, b = self.work, self.work.balance
        w.probe(0.0)
        b.start[:] = b.r
        balanced = b.clock[eq.LAST] == 0.0
        if not whole:
            if not self._advance(lambda s: (0.0, s), np.ones(1)):
                return
            balanced = True
            b.start[:] = 0.0
        if balanced:
            eq.unbalance(w.time, w.step, 0.0, 1.0, w.model, b, b.r)
            self._keep(0.0)
        self._advance(lambda s: (s, s), targets)

    def _advance(self, at: Callable[[float], tuple[float, float]], targets: Array) -> bool:
        """Go from 0 over the targets in steps that follow from how they converge; at(s) = (factor, share)."""
        reached, step = 0.0, min(FIRST_STEP, float(targets[0]))
        for target in targets:
            while reached < target:
                if self.steps + self.rejected >= self.most:
                    return self._fail(at(reached)[0], f"{self.most} steps were not enough")
                lands = reached + step >= target * (1.0 - 1e-12)
                s = float(target) if lands else reached + step
                state = self._state()
                found = self._balance(*at(s))
                if found < 0 or (s - reached > CAREFUL and self._turned_over(state[0])):
                    self._back(state)
                    self.rejected += 1
                    step = 0.25 * (s - reached)
                    if step >= SMALLEST_STEP:
                        continue
                    if not self._slide(at(1.0)[0]):
                        self._back(state)
                        return self._fail(at(reached)[0], self._why(found, at(s)[0]))
                    self._keep(at(1.0)[0])
                    self.message = f"no path of equilibria leads on from load factor {at(reached)[0]:.4g}; it slid"
                    return self._end(at(1.0)[0])
                self.steps += 1
                reached = s
                step = max(step, 0.0) * (2.0 if found <= 5 else 1.0 if found <= 9 else 0.5)
                if at(s)[0] > 0.0 or at(s)[1] == 1.0:
                    self._keep(at(s)[0])
        return self._end(at(1.0)[0])

    def _end(self, factor: float) -> bool:
        """Say what is loose or unstable at the end."""
        w = self.work
        if factor < 1.0:
            return True
        count = w.probe(factor)
        if count == 0:
            self.unstable = w.falling_directions()
            if self.unstable > 0:
                self.message += f"; it is unstable in {_ways(self.unstable)}"
            return True
        self.free = w.free_motions(factor)
        if self.free:
            self.message += f"; nothing holds {_names(self.free)} against {_motions(count)}"
        return True

    # ------------------------------------------------------------------------------------------ along an arc

    def along_an_arc(self, first: float) -> None:
        """From the equilibrium without load to a factor of 1."""
        w, b = self.work, self.work.balance
        w.probe(0.0)
        b.start[:] = b.r
        if not self._advance(lambda s: (0.0, s), np.ones(1)):
            return
        b.start[:] = 0.0
        self.kept.clear()
        self._keep(0.0)
        state = self._state()
        if self._balance(1e-3 * first) < 0:
            self._fail(0.0, self._why(eq.NO_CONVERGENCE, 1e-3 * first))
            return
        length = 1e3 * math.sqrt(float(np.mean((b.total / b.weight) ** 2)))
        if length == 0.0:
            self._balance(1.0)
            self._keep(1.0)
            return
        self._back(state)
        longest, shortest = 4.0 * length, 1e-6 * length
        b.before[:] = 0.0
        while True:
            if self.steps + self.rejected >= self.most:
                self._fail(self.reached, f"{self.most} steps along the arc were not enough")
                return
            state, factor = self._state(), self.reached
            found = eq.follow(w.time, w.step, length, self.tolerance, MOST_ITERATIONS, w.model, w.matrix, b)
            sharp = found >= 0 and length > 1e2 * shortest and self._cosine(state[2]) < 0.5
            if found < 0 or sharp:
                self._back(state)
                b.clock[eq.FACTOR] = factor
                self.rejected += 1
                length *= 0.5 if sharp else 0.25
                if length < shortest:
                    self._fail(factor, self._why(int(found), factor))
                    return
                continue
            self.steps += 1
            now = float(b.clock[eq.FACTOR])
            if factor < 1.0 <= now:
                b.before[:] = b.total
                if self._balance(1.0) < 0:
                    self._fail(factor, self._why(eq.NO_CONVERGENCE, 1.0))
                    return
                self.steps += 1
                self._keep(1.0)
                self._end(1.0)
                return
            b.before[:] = b.total
            self._keep(now)
            length = min(length * min(2.0, max(0.5, math.sqrt(4.0 / max(found, 1)))), longest)

    def _cosine(self, before: Array) -> float:
        b = self.work.balance
        p, q = b.total / b.weight, before / b.weight
        size = math.sqrt((p @ p) * (q @ q))
        return float(p @ q) / size if size > 0.0 else 1.0

    # ------------------------------------------------------------------------------------------ the end

    def _why(self, code: int, factor: float) -> str:
        """Why a step failed, in words."""
        w, b = self.work, self.work.balance
        found = w.probe(self.reached)
        if found > 0:
            free = w.free_motions(self.reached)
            if free:
                self.free = free
                return f"nothing holds {_names(free)} against {_motions(found)}{self._acting(free)}"
        if code == eq.NOT_FINITE:
            return f"the state stopped being finite at load factor {factor:.6g}"
        if code in (eq.SINGULAR, eq.UNBALANCED) or b.clock[eq.QUALITY] < 1e-11:
            return f"the tangent is singular at load factor {factor:.6g}: a limit of the load, or something is not held"
        return f"Newton's method does not converge beyond load factor {self.reached:.6g}; arc_length may lead on"

    def _acting(self, free: list[str]) -> str:
        """Which loads act on parts that nothing holds, in words."""
        w = self.work
        model, names = w.model, w.assembly.names
        found = []
        for name, (family, index) in names.items():
            if family == "beam_loads":
                push = model.flexible.beam_loads[index]
                acts = push["value"] != 0.0 and push["start"] <= w.time < push["end"]
                target = ("beams", int(push["beam"]))
            elif family == "loads" and model.loads["kind"][index] >= loads.AT_MARKER:
                row = model.loads[index]
                p, marker = w.balance.parameters[row["first"] : row["last"]], model.markers[row["target"]]
                acts = np.any(p[:3]) and p[4] <= w.time < p[5]
                target = ("bodies" if marker["kind"] == springs.ON_BODY else "points", int(marker["index"]))
            else:
                continue
            if acts and any(names[part] == target for part in free):
                found.append(name)
        if not found:
            return ""
        acts = "acts" if len(found) == 1 else "act"
        return f", on which {_names(found)} {acts} at t = {w.time:g} s (argument `time`)"

    def _fail(self, factor: float, why: str) -> bool:
        if not self.kept:  # a search that reaches nothing keeps where it stood
            self._keep(factor)
        self.reached = factor
        self.status, self.message = "failed", why
        return False

    def solution(self, wall_time: float, compile_time: float) -> StaticSolution:
        """Everything that was kept."""
        w = self.work
        columns = list(zip(*self.kept, strict=True)) if self.kept else [()] * 7
        energies = np.array(columns[3]).reshape(-1, 5)
        n_p, f = len(self.kept), w.model.flexible
        shapes = ((n_p,), (n_p, w.balance.y.size), (n_p, w.n_j))
        factor, y, la = (np.array(c, dtype=float).reshape(s) for c, s in zip(columns[:3], shapes, strict=True))
        return StaticSolution(
            factor=factor,
            y=y,
            la=la,
            elastic=energies[:, 1],
            bending=energies[:, 2],
            contact=energies[:, 3],
            coupled=energies[:, 4],
            loads=np.array(columns[4]).reshape(n_p, w.n_v),
            cylinders=np.array(columns[5]).reshape(n_p, f.cylinders.size, 9),
            wrenches=np.array(columns[6]).reshape(n_p, w.model.bodies.size, 6),
            spin=w.balance.spin,
            time=w.time,
            free=self.free,
            unstable=self.unstable,
            status=self.status,
            message=self.message,
            statistics={
                "steps": self.steps,
                "rejected_steps": self.rejected,
                "iterations": int(w.balance.tally[eq.ITERATIONS]),
                "factorizations": int(w.balance.tally[eq.FACTORED]),
                "slides": self.slides,
                "smallest_pivot": self.worst,
            },
            wall_time=wall_time,
            compile_time=compile_time,
        )


def _names(names: list[str]) -> str:
    return " and ".join(repr(name) for name in names[:4]) + (" and others" if len(names) > 4 else "")


def _ways(count: int) -> str:
    return "one way" if count == 1 else f"{count} ways"


def _motions(count: int) -> str:
    return "one motion" if count == 1 else f"{count} motions"


def add_turn(model: mdl.Model, spin: Array, y: Array) -> None:
    """Velocities of a steady turn into a state."""
    w, c = spin[:3], spin[3:]
    if not np.any(w):
        return
    for row in model.flexible.beams:
        vectors, n = NODE_VECTORS[row["kind"]], int(row["nodes"])
        e = y[row["iq"] : row["iq"] + 3 * vectors * n].reshape(n, vectors, 3).copy()
        e[:, 0] -= c
        first = int(row["iv"])
        y[first : first + e.size] = np.cross(w, e).ravel()
    for row in model.points:
        y[row["iv"] :][:3] = np.cross(w, y[row["iq"] :][:3] - c)
    for row in model.bodies:
        if row["motion"] == rigid.FREE:
            y[row["iv"] :][:3] = np.cross(w, y[row["iq"] :][:3] - c)
            y[row["iv"] + 3 :][:3] = row["R"].T @ w
        elif row["motion"] == rigid.SPIN:
            y[row["iv"]] = (row["R"] @ row["axis"]) @ w
