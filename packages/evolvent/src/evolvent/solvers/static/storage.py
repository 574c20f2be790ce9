"""store(): what a time in the stowed position leaves of the stresses and shapes of viscoelastic parts."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from evolvent.assembly import families
from evolvent.assembly.assembled import Assembly
from evolvent.kernels import axial
from evolvent.model import family
from evolvent.model.registry import asked, motions, motions_of
from evolvent.solvers.common.laws import refusing_laws
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.static.search import StaticSearch
from evolvent.solvers.static.work import Work, spin_of
from evolvent_base.errors import InputError

Array = np.ndarray
#: First step beside the shortest relaxation time, and what a step may be longer than the one before.
_FIRST, _GROWTH = 1e-3, 2.0
#: Strains, beside the largest of their law, below which they do not count in the error.
_SMALL = 1e-3
#: Steps after which storage ends as failed, and step beside the whole time below which it does.
MOST_STEPS, _SMALLEST = 20_000, 1e-12
#: What an angle (rad) or a travel (m) of a mechanism may move from the start to the stowed equilibrium.
MOST_MOVED = 0.05
#: Share of its strain that a part loses from the start to the stowed equilibrium where nothing holds it.
_GONE = 1e-6
_HOLD = "hold it by a joint that is released later, a contact or a drive"
#: Correction at which an iteration has converged.
_CONVERGED = 1e-11


@dataclasses.dataclass
class Stored:
    """A stowed system after its storage.

    Attributes
    ----------
    assembly : Assembly, whose start is the state in which storage has left it
    solution : Solution, the equilibria over storage
        Its first state is the stowed equilibrium before any relaxation, its last the one at the end.
    times : (n,) float, s, since the start of storage, of the states
    """

    assembly: Assembly
    solution: Solution
    times: Array


def check_relaxes(assembly: Assembly, key: str) -> None:
    """Refuse a key that is of viscoelastic parts alone, where there are none.

    Raises
    ------
    InputError
    """
    if not assembly.relaxations:
        raise InputError(
            f"`{key}` has no effect: no part is viscoelastic; give `viscoelastic` to a material or a spring, or leave "
            f"`{key}` out"
        )


def store(
    assembly: Assembly,
    time: float,
    temperature: float | Sequence[tuple[float, float]] | None = None,
    *,
    tolerance: float = 1e-6,
    most_moved: float = MOST_MOVED,
    progress: Callable[[float], None] | None = None,
) -> Stored:
    """Let a stowed system stand for a time, in equilibrium with its loads and with what holds it.

    Parameters
    ----------
    assembly : Assembly, its start is the stowed position; it is left as it is
    time : float, s
    temperature : float, K, or rows [time since the start of storage (s), temperature (K)] with straight lines between
        them, the first and last are held before and after; that of each part while it moves if left out
    tolerance : error of the strains of a step beside their size
    most_moved : float, rad or m, that mechanisms may be from the start in the stowed equilibrium
    progress : called with the time reached (s)

    Raises
    ------
    InputError
        Without viscoelastic parts, for a temperature at which a shift does not hold, for a part that statics do not
        support; where there is no equilibrium.

    Notes
    -----
    Every step is an equilibrium at its end, with strains that change at a constant rate over it, by which relaxation is
    exact (`evolvent.kernels.viscoelastic`): of strains that are held, steps of any length have no error. Their length
    follows from how the rates of the strains change.
    """
    check_relaxes(assembly, "store")
    rows = None if temperature is None else np.atleast_2d(np.array(temperature, dtype=float))
    if rows is not None and rows.shape == (1, 1):
        rows = np.array([[0.0, rows[0, 0]]])
    if rows is not None and not any(law.shift for _, law in assembly.relaxations.values()):
        raise InputError("store.temperature has no effect: no Prony series has a `shift`; give both, or leave it out")
    values = [] if rows is None else rows[:, 1].tolist()
    for name, law in assembly.relaxations.values():
        for k, value in enumerate(values):
            law.factor(value, f"store.temperature.{k}.1" if len(values) > 1 else "store.temperature", name)
    families.check(assembly, family.STATIC)
    if assembly.directions is not None:
        raise InputError("`store` does not support threads with segments of fixed length; leave it out")
    own, y = dataclasses.replace(assembly, model=assembly.model.copy()), assembly.y
    with refusing_laws(own):
        work = Work(own, y, 0.0, spin_of(own, None, None))
        work.allow_redundant()
    search = _Storage(work, rows, tolerance, progress)
    search.stow(most_moved)
    search.relax(time)
    return Stored(search.stored(assembly), search.search.solution(0.0, 0.0), np.array(search.times))


#: Points and weights by which 1/a is integrated along a straight line of temperatures.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(16)


#: Most decades of the shift over which these points integrate at once.
_DECADES = 4.0


def _smooth(law: Any, rows: Array, start: float, end: float) -> list[float]:
    """Times, s, between which the logarithm of the shift is smooth and changes by few decades."""
    times = [start, *rows[(rows[:, 0] > start) & (rows[:, 0] < end), 0].tolist(), end]
    found = [start]
    for a, b in itertools.pairwise(times):
        Ta, Tb = np.interp([a, b], rows[:, 0], rows[:, 1])
        inner = [a + (b - a) * (T - Ta) / (Tb - Ta) for T in law.shift.kinks if min(Ta, Tb) < T < max(Ta, Tb)]
        for c, d in itertools.pairwise([a, *sorted(inner), b]):
            Tc, Td = np.interp([c, d], rows[:, 0], rows[:, 1])
            pieces = 1 + int(abs(law.shift.decades(float(Td)) - law.shift.decades(float(Tc))) / _DECADES)
            found += np.linspace(c, d, pieces + 1)[1:].tolist()
    return found


def reduced_time(law: Any, rows: Array, start: float, end: float) -> float:
    """Integral of dt/a over a history of temperatures, s.

    Parameters
    ----------
    law : evolvent.elements.viscoelastic.Viscoelastic
    rows : (n, 2) float, times (s) and temperatures (K)
    start, end : float, s
    """
    if law.shift is None:
        return end - start
    found = 0.0
    for a, b in itertools.pairwise(_smooth(law, rows, start, end)):
        at = np.interp(0.5 * (a + b) + 0.5 * (b - a) * _POINTS, rows[:, 0], rows[:, 1])
        paces = [1.0 / law.factor(float(T), "store.temperature") for T in at]
        found += 0.5 * (b - a) * float(_WEIGHTS @ paces)
    return found


class _Storage:
    """Storage so far, and how it goes on."""

    def __init__(
        self, work: Work, rows: Array | None, tolerance: float, progress: Callable[[float], None] | None
    ) -> None:
        self.work, self.rows, self.tolerance, self.progress = work, rows, tolerance, progress
        self.search = StaticSearch(work, _CONVERGED, MOST_STEPS, None)
        self.times: list[float] = []
        (self._memory,) = (memory(work.model) for memory in asked("statics.memory").values())
        self._rate: Array | None = None

    def stow(self, most_moved: float) -> None:
        """Find the stowed equilibrium, before any relaxation."""
        rows = motions_of(self.work.model)
        start, strains = rows["angle"].copy(), self._strains()
        with refusing_laws(self.work.assembly):
            self.search.by_steps(np.ones(1), whole=True)
        if self.search.status != "success":
            raise InputError(
                f"storage: from the start no equilibrium of the stowed position is found "
                f"({self.search.message.partition(';')[0]}); {_HOLD}"
            )
        for k in np.flatnonzero(np.abs(rows["angle"] - start) > most_moved):
            name, moved = families.owner(self.work.assembly, motions(), int(k)), float(rows["angle"][k] - start[k])
            unit = "rad" if rows["kind"][k] == axial.ANGLE else "m"
            raise InputError(
                f"storage: nothing holds {name!r} in its stowed position: its equilibrium is {moved:.3g} {unit} from "
                f"the start; {_HOLD}"
            )
        for name, largest in self._strains().items():
            if largest < _GONE * strains[name]:
                raise InputError(
                    f"storage: nothing holds {name!r} in its stowed position: in equilibrium its stress is gone; "
                    f"{_HOLD}"
                )
        del self.search.kept[:-1]
        self.times.append(0.0)

    def _strains(self) -> dict[str, float]:
        """Largest strain of each viscoelastic part."""
        found: dict[str, float] = {}
        for first, (name, _) in self.work.assembly.relaxations.items():
            found[name] = max(self._memory.largest(first), found.get(name, 0.0))
        return found

    def _shift(self, step: float) -> None:
        """Set the relaxation times of a step, by its temperatures."""
        start, factors = self.times[-1], dict[int, tuple[Any, float]]()
        for first, (_, law) in self.work.assembly.relaxations.items():
            if self.rows is not None:
                factors[first] = law, step / reduced_time(law, self.rows, start, start + step)
        self._memory.pass_over(step, factors)

    def relax(self, duration: float) -> None:
        """Let a time pass, s."""
        reached = 0.0
        self._shift(np.finfo(float).tiny if self.rows is None else 1e-9 * duration)
        step = _FIRST * self._memory.shortest
        while reached < duration:
            if len(self.times) > MOST_STEPS:
                raise InputError(f"storage: {MOST_STEPS} steps were not enough at t = {reached:.4g} s")
            left = duration - reached
            step = left if step >= left else 0.5 * left if 2.0 * step > left else step
            error = self._try(step)
            if error <= 1.0:
                reached = duration if step == left else reached + step
                self._accept(reached, step)
            elif step <= _SMALLEST * duration:
                raise InputError(
                    f"storage: no equilibrium is found beyond t = {reached:.6g} s: what is stowed may move off there "
                    f"as its stiffness relaxes; hold it"
                )
            step *= min(max(0.9 / max(error, 1e-12) ** 0.5, 0.2), _GROWTH)
        self._memory.end()

    def _try(self, step: float) -> float:
        """Equilibrium after a step; its error beside the tolerance, or a large number without one."""
        state = self.search._state()
        self._shift(step)
        found = self.search._balance(1.0)
        if found < 0:
            self.search._back(state)
            return 1e3
        moved, size = self._memory.moved(), self._memory.sizes(_SMALL)
        off = np.zeros_like(moved) if self._rate is None else moved - step * self._rate
        error = np.abs(off[size > 0.0]) / size[size > 0.0]
        beside = float(error.max(initial=0.0)) / (6.0 * self.tolerance)
        if beside > 1.0:
            self.search._back(state)
        return beside

    def _accept(self, time: float, step: float) -> None:
        """Make the end of a step the start of the next one."""
        self._rate = self._memory.moved() / step
        self.search.steps += 1
        self.search._store_point(1.0)
        self._memory.accept()
        self.times.append(time)
        if self.progress is not None:
            self.progress(time)

    def stored(self, assembly: Assembly) -> Assembly:
        """The assembly whose start is the last state."""
        model, y = assembly.model.copy(), assembly.y.copy()
        _, last, switches, *_ = self.search.kept[-1]
        n_q, n_v = int(model.info.nq), int(model.info.nv)
        y[:n_q], y[n_q + n_v :] = last[:n_q], last[n_q + n_v :]
        self._memory.give(model)
        model.switches[:] = switches
        return dataclasses.replace(assembly, model=model, y=y, s=switches.copy(), touched=None)
