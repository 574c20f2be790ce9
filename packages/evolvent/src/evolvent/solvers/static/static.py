"""solve_static(): equilibria of an assembled model, by load steps or along an arc."""

from __future__ import annotations

import dataclasses
import math
import time as clock
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from evolvent.assembly import families
from evolvent.assembly.assembled import Assembly
from evolvent.compiled import codecache
from evolvent.model import family
from evolvent.model.registry import asked
from evolvent.parts.checks import number, positive
from evolvent.solvers.common.coordinates import given_positions
from evolvent.solvers.common.laws import law_failure, refusing_laws, try_laws
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.common.standing import at_time
from evolvent.solvers.static.search import FIRST_STEP, StaticSearch
from evolvent.solvers.static.storage import check_relaxes
from evolvent.solvers.static.work import Work, spin_of
from evolvent_base.errors import InputError

Array = np.ndarray

#: What messages of a search that ends early end with.
_KEPT = "what was computed is kept"


def solve_static(
    assembly: Assembly,
    *,
    y: Any = None,
    load_steps: int | Sequence[float] | None = None,
    arc_length: bool = False,
    time: float = 0.0,
    rotating: str | Sequence[float] | None = None,
    centre: Sequence[float] | None = None,
    relaxed: bool = False,
    tolerance: float = 1e-10,
    most_steps: int = 1000,
    progress: Callable[[float], None] | None = None,
) -> Solution:
    """Find the equilibrium of an assembled model under its loads.

    Gravity, beam loads, forces and torques and a steady turn grow together with the load factor from 0 to 1, and what
    the start leaves unbalanced fades out meanwhile; steps are cut where Newton's method does not converge. Where no
    step leads on, the state slides down its energy to the next equilibrium.

    Parameters
    ----------
    assembly : Assembly; its initial state is left as it is
    y : (ny,) float, state to start from, with the coordinates of the assembly; the assembly's own if left out
    load_steps : int or sequence of float, optional
        Load factors on whose equilibria the path lands, n for 1/n, 2/n, ... 1; along an arc, the first step is 1/n.
    arc_length : bool
        Follow the path through limits of load and of displacement, from the equilibrium without load to where the
        factor first reaches 1 (Crisfield 1981, cylindrical).
    time : float, s, at which drives stand and loads act; ramps count as over
    rotating : str or (3,) float, optional, rad/s
        A steady turn about an axis: a driven body's, by its name, or a rate. What stands on the ground, or keeps a
        direction, is refused unless it is the same at every angle; a clamp on the ground is one on a base that turns.
    centre : (3,) float, m, on that axis; the body's position or the origin if left out
    relaxed : bool
        Whether viscoelastic parts have relaxed whole, with the stiffness that never relaxes: the equilibrium after a
        long time under the loads. If not, they answer at once, with their instantaneous stiffness from the strains that
        their branches have in the start, such as after storage.
    tolerance : float, correction at which an iteration has converged, beside the size of the system (or 1 for slopes)
    most_steps : int, after which the search ends
    progress : called with the load factor reached

    Returns
    -------
    Solution
        One that fails keeps what it reached, at least the state that it started from.

    Raises
    ------
    InputError
        For arguments out of range, parts without an implicit form, loads that cannot turn, redundant constraints;
        `relaxed` without viscoelastic parts.

    Notes
    -----
    Dampers rest, open latches stay open. Friction acts where the path rubs. `path.newton` has the unbalance and the
    correction of every iteration, which converge quadratically but for contacts and gears. An end that is unstable by
    its energy may lie on a branch that a long step has led to: the path is then followed again from its last stable
    point, in steps in which no direction becomes unstable, and beyond where it becomes so itself. Where the loads have
    no potential, or there are gyroscopic forces, the motions that grow about the end are counted, with all dampers.
    """
    targets = _targets(load_steps)
    tolerance = positive("tolerance", tolerance)
    time = number("time", time, allowed="a finite time, s")
    if isinstance(most_steps, bool) or not isinstance(most_steps, int) or most_steps < 1:
        raise InputError(f"most_steps is {most_steps!r}; it must be a whole number from 1")
    families.check(assembly, family.STATIC)
    if relaxed:
        check_relaxes(assembly, "relaxed")
    assembly, y = given_positions(dataclasses.replace(assembly, model=assembly.model.copy()), y, time)
    try_laws(assembly, time, time)
    if assembly.model.info.releases:
        assembly, y = at_time(assembly, y, time)
    began = clock.perf_counter()
    with refusing_laws(assembly):
        work = Work(assembly, y, time, spin_of(assembly, rotating, centre))
    for memory in asked("statics.memory").values():
        memory(work.model).pass_over(math.inf if relaxed else 0.0, {})
    compile_time = clock.perf_counter() - began
    began = clock.perf_counter()
    with refusing_laws(assembly):
        work.allow_redundant()
    search = StaticSearch(work, tolerance, most_steps, progress)
    try:
        if arc_length:
            search.along_an_arc(FIRST_STEP if load_steps is None else targets[0])
        else:
            search.by_steps(targets, whole=load_steps is None)
    except KeyboardInterrupt:
        search.keep_start()
        search.status, search.message = "interrupted", f"interrupted at load factor {search.reached:.6g}; {_KEPT}"
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
        search.keep_start()
        failure = law_failure(assembly, error, [(work.time, work.balance.y, assembly.s)])
        search.status, search.message = "failed", f"beyond load factor {search.reached:.6g}, {failure}; {_KEPT}"
    wall_time = clock.perf_counter() - began
    codecache.mark_warm("statics")
    found = search.solution(wall_time, compile_time)
    beyond = _no_balance(assembly, work, found.y[-1]) if found.success or search.free else ""
    if beyond:
        found.status, found.message = "failed", beyond
    if work.redundancy is not None:
        found.message = f"{found.message}; {work.redundancy.text}"
        found.statistics |= {"constraints": work.redundancy.constraints, "rank": work.redundancy.rank}
    return found


def _no_balance(assembly: Assembly, work: Work, y: Array) -> str:
    """A sentence on the first record that is in no equilibrium in spite of its forces; '' for none."""
    for name, found in asked("statics.no_balance").items():
        for k, why in found(work.model, work.time, y):
            return f"{families.owner(assembly, name, k)!r} {why}"
    return ""


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
