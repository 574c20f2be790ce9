"""modes(): how a structure vibrates about an equilibrium, at rest, turning steadily or in an orbital frame."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy

from evolvent.algebra.eigenproblem import Eigenproblem
from evolvent.algebra.relaxation import RELAXATION, RelaxingProblem
from evolvent.algebra.subspaces import along_axes
from evolvent.assembly import families
from evolvent.assembly.assembled import Assembly
from evolvent.kernels.blocks import ROTATION, indices
from evolvent.model import family
from evolvent.model.registry import asked, frames_of
from evolvent.solvers.common.coordinates import with_positions
from evolvent.solvers.common.laws import law_failure
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.common.standing import freeze, hold
from evolvent.solvers.modal.modal import VibrationModes
from evolvent.solvers.modal.positions import rigid_motions
from evolvent.solvers.modal.resolution import Naming
from evolvent.solvers.static.linear_motion import matrices, softened
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.static.work import Work, refuse_unsteady
from evolvent_base.errors import EvolventError, InputError, RunFailed

Array = np.ndarray
#: What is said of modes of viscoelastic parts, with and without damping.
BY_LAW = (
    "Viscoelastic parts vibrate by their law at the pole of each mode; motions that decay without oscillating are left "
    "out."
)
AT_ONCE = (
    "Viscoelastic parts vibrate with their instantaneous stiffness and without loss; damped modes take their law at "
    "each frequency."
)
#: Part of the stiffness of a body against rotation that counts about its other axes where round-off is judged.
TURNED = 0.01


def modes(
    assembly: Assembly,
    *,
    equilibrium: Solution | None = None,
    y: Any = None,
    time: float = 0.0,
    rotating: str | Sequence[float] | None = None,
    centre: Sequence[float] | None = None,
    relaxed: bool = False,
    count: int = 10,
    damped: bool = False,
) -> VibrationModes:
    """Find the slowest modes about an equilibrium, with its stresses, loads and steady turn.

    Parameters
    ----------
    assembly : Assembly
    equilibrium : Solution of `solve_static` for the same assembly, optional; its last state, turn and time are taken
    y : (ny,) float, state to look for the equilibrium from, where none is given; the assembly's own if left out
    time : float, s, at which loads act and drives stand
    rotating : str or (3,) float, optional, rad/s, as of `solve_static`
    centre : (3,) float, optional, m, as of `solve_static`
    relaxed : bool, whether the equilibrium is that after all relaxation, as of `solve_static`
    count : int, how many modes; fewer where fewer directions are free
    damped : bool, whether dampers and the losses of viscoelastic parts count

    Returns
    -------
    VibrationModes
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
    (Coriolis); Gy has the gyroscopic moments of reaction wheels as well, at their rates at the start. Poles of
    velocities are those of the linear problem of twice the size; `VibrationModes.warning` says which grow. A steady
    drift, as along an orbit, is a double zero and given once, as frequency 0. Of an acceleration field by a law the
    derivatives at rest count, without `damped` only the skew-symmetric part of those by velocity.
    Viscoelastic parts have their instantaneous stiffness where modes are not damped, so that these are real, orthogonal
    and have effective masses; the stresses are those of the equilibrium. Damped modes are by the law at each of them:
    M s^2 + C s + K - sum D/(1 + s tau), D what relaxes with the time tau, is singular at the pole s, by Newton's method
    from the elastic modes. Motions that decay without oscillating, such as those of relaxation itself, are left out
    then; motions that grow, such as creep beyond the critical load of the relaxed stiffness, are not.
    Modes nearest to zero come from the inverse, shifted, by SciPy (ARPACK, or LAPACK for small systems). Of real modes
    of equal frequency, the first is the one that base motion along x excites, the next along y, z, then about x, y, z,
    where they are excited at all: a round beam bends in one plane at a time, rigid-body motion comes as translations
    and rotations. The objective damping of a cable's bending goes with the rate of the curvature's size, which has no
    linear part where a cable is straight. Motions without stiffness, which the joints leave to the parts as rigid
    bodies, are found first and given as frequency 0; so are frequencies below the round-off of the stiffness of their
    own shape, unless they strain a beam, a rod or a spring. Those, and modes whose equations are off by more than 1e-5,
    are refused by the name of what moves.
    """
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise InputError(f"count is {count!r}; it must be a whole number from 1")
    where = Where(equilibrium, y, time, rotating, centre, relaxed)
    assembly, equilibrium, work, (M, C, K, G) = at_equilibrium(assembly, where, damped=damped)
    naming = Naming(work, M)
    problem = Eigenproblem(
        M, C, K, G, work.balance.weight, conservative=families.has_symmetric_stiffness(work.model),
        where=naming.where, strains=naming.strains, rigid=naming.rigid(work.balance.weight),
        coarse=of_turns(work.model, K),
    )  # fmt: skip
    motions = rigid_motions(assembly, equilibrium.y[-1], np.zeros(3))

    def turned(pole: Array, shape: Array) -> Array:
        return shape if np.iscomplexobj(shape) else along_axes(-(pole**2).real, shape, M, motions)

    note = ""
    if assembly.relaxations and damped:
        times, parts = zip(*softened(work), strict=True)
        left = min(law.left for _, law in assembly.relaxations.values())
        pole, shape = RelaxingProblem(problem, times, parts, left, turned).solve(count)
        note = BY_LAW
    else:
        pole, shape = problem.solve(count)
        shape = turned(pole, shape)
        note = AT_ONCE if assembly.relaxations else ""
    causes = (*problem.causes, *([RELAXATION] if note == BY_LAW else [])) if np.iscomplexobj(shape) else ()
    return VibrationModes(
        pole=pole, shape=shape, equilibrium=equilibrium, assembly=assembly, M=M, G=G, causes=causes, note=note
    )


def of_turns(model: Any, K: Any) -> Array:
    """A part of the largest stiffness of a body or node against rotation, whose round-off is in that about every axis.

    A link between two joints has nothing else in its spin: in the body's axes its entries of K are round-off alone.
    """
    at = indices(model.blocks[model.blocks["kind"] == ROTATION], "iv") - int(model.info.nq)
    found = np.zeros(K.shape[0])
    found[at] = TURNED * np.abs(K.diagonal())[at].max(axis=1, keepdims=True, initial=0.0)
    return found


class Where(NamedTuple):
    """An equilibrium, or where to look for one: arguments of `modes`."""

    equilibrium: Solution | None
    y: Any
    time: float
    rotating: str | Sequence[float] | None
    centre: Sequence[float] | None
    relaxed: bool = False


def at_equilibrium(
    assembly: Assembly, where: Where, *, damped: bool
) -> tuple[Assembly, Solution, Work, tuple[scipy.sparse.csr_matrix, ...]]:
    """The equilibrium that is given or found, an assembly with a copy of the model, and `matrices` there."""
    equilibrium, y, time, rotating, centre, relaxed = where
    families.check(assembly, family.MODES)
    if any(rate is not None for _, rate, _ in frames_of(assembly.model)):
        refuse_unsteady(assembly, orbits=True)
    assembly = with_positions(dataclasses.replace(assembly, model=assembly.model.copy()))
    if equilibrium is None:
        equilibrium = solve_static(assembly, y=y, time=time, rotating=rotating, centre=centre, relaxed=relaxed)
    elif y is not None or rotating is not None or centre is not None or time != 0.0 or relaxed:
        raise InputError("give an equilibrium, or y, time, rotating, centre and relaxed to find one, not both")
    if equilibrium.path is None:
        raise InputError(f"equilibrium is a motion by {equilibrium.method}; it must be a solution of solve_static")
    if not equilibrium.success:
        raise RunFailed(f"there is no equilibrium to vibrate about: {equilibrium.message}", equilibrium)
    still = freeze(assembly.model, float(equilibrium.t[-1]))
    assembly = dataclasses.replace(assembly, model=still, s=equilibrium.s[-1].copy())
    hold(float(equilibrium.t[-1]), equilibrium.y[-1], assembly.s, still)
    try:
        work = Work(assembly, equilibrium.y[-1], float(equilibrium.t[-1]), equilibrium.path.spin)
        for memory in asked("statics.memory").values():
            memory(work.model).resume(equilibrium.y[-1])
        work.allow_redundant()
        work.balance.la[:] = equilibrium.la[-1]
        return assembly, equilibrium, work, matrices(work, damped=damped)
    except EvolventError:
        raise
    except Exception as error:
        raise RunFailed(law_failure(assembly, error), equilibrium) from error
