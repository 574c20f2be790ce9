"""Copies of a prepared implicit run: see `evolvent.solvers.time.copies`."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable, Collection
from typing import Any

import numpy as np
from numba import config

from evolvent.algebra.sparse import OUTSIDE, SparseBlocks
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.model import Model
from evolvent.model.registry import asked
from evolvent.solvers.common import balance as eb, redundancy
from evolvent.solvers.common.sampled import Sampled
from evolvent.solvers.common.solution import event_numbers
from evolvent.solvers.common.start import acts_from_outside
from evolvent.solvers.time.copies import GOES_ON, STEPS, STOPPED_BY_EVENT, Copies
from evolvent.solvers.time.implicit.captures import Captures
from evolvent.solvers.time.implicit.many_steps import advance_many, begin_many, count_open, restart_many
from evolvent.solvers.time.implicit.messages import reason
from evolvent.solvers.time.implicit.methods import METHODS
from evolvent.solvers.time.implicit.releases import write_accounts
from evolvent.solvers.time.implicit.run import ImplicitRun
from evolvent.solvers.time.implicit.workspace import AT_RESTART, BUDGET, DONE, SAMPLED, STOPPED, Workspace
from evolvent_base.errors import InputError

Array = np.ndarray
#: Number of copies whose balances are checked together.
AT_ONCE = 16


class ImplicitCopies(Copies):
    """Copies of an implicit run.

    Attributes
    ----------
    ranks_apart : bool, whether Python finds ranks of constraints, copy by copy: where they have been redundant
    """

    run: ImplicitRun

    def __init__(self, run: ImplicitRun, count: int, workers: int) -> None:
        super().__init__(run, count, workers, {"model": run.model, "matrix": run.matrix, "work": run.work}, SAMPLED)
        self.midpoint = run.midpoint
        others = frozenset().union(*(row.modules for row in METHODS.values())) - METHODS[run.plan.method].modules
        roots: list[Any] = [begin_many, advance_many]
        roots += [count_open] if run.model.constraints.size else []
        roots += [] if self.midpoint else [restart_many]
        needs.load(run.model, *roots, without=others)
        self.stops, self.rows = self.values("work", "stops"), self.values("model", "constraints")
        ranks = run.ranks.found
        self.ranks_apart = bool(config.DISABLE_JIT or any(one.redundancy is not None for one in ranks))
        self._ranked = np.repeat(ranks[0].held[None], count, axis=0) if ranks else np.zeros((count, 0), dtype=bool)
        self._ranked_latches = np.zeros(count, dtype=np.int64)

    def sampled(self, which: Array, model: Model) -> dict[str, Any]:
        """As of all copies."""
        last = np.maximum(self.loop["sample"][which] - 1, 0)
        found = self.kept_samples(which, np.stack([np.zeros_like(last), last], axis=1), model)
        return {**found, "kept": found["kept"]._replace(points=None, momenta=None)}

    def kept_samples(self, which: Array, at: Array, model: Model, *, without: Collection[str] = ()) -> dict[str, Any]:
        """As of all copies."""

        def taken(name: str) -> Array:
            """Values that the loop has stored at the samples."""
            nominal: Array = getattr(self.run.work, name)
            kept = self.values("work", name)
            if kept is None:
                return np.zeros((at.size, *nominal.shape[1:]), dtype=nominal.dtype)
            found = kept[which[:, None], at]
            return np.ascontiguousarray(found.reshape(at.size, *found.shape[2:]))

        y, balance = taken("out_y"), taken("out_balance").view(eb.BALANCE)[:, 0].view(np.recarray)
        write_accounts(model, y, balance)
        has = {"points": self.midpoint, "momenta": not model.info.releases and self.run.work.out_momenta.size}
        names = {"acceleration": "out_a", "la": "out_la", "forces": "out_forces"}
        names |= {name: f"out_{name}" for name, own in has.items() if own}
        kept: dict[str, Any] = {name: None if name in without else taken(of) for name, of in names.items()}
        return {"y": y, "s": taken("out_s"), "kept": Sampled(balance=balance, **kept)}

    def closes(self, which: Array) -> Array:
        """As of all copies, by the criterion of `analysis.closure` for single runs."""
        model, balance = self.run.model, self.values("work", "out_balance")
        if any(getattr(model, name).size for name in asked("energies.rebalance")) or balance is None:
            return np.zeros(which.size, dtype=bool)
        whole = (self.status[which] == GOES_ON) & (self._codes[which] == DONE)
        whole &= self.loop["sample"][which] == self.samples.shape[1]
        counts = self.values("matrix", "counts")
        whole &= counts is None or counts[which, OUTSIDE] == 0
        found = np.zeros(which.size, dtype=bool)
        for first in range(0, which.size, AT_ONCE):
            some = np.flatnonzero(whole[first : first + AT_ONCE]) + first
            moved = [eb.moved(self.loop[k : k + 1].view(np.recarray)[0]) for k in which[some].tolist()]
            closures = eb.closures(eb.columns_of(balance[which[some]]), [float(one) for one in moved])
            found[some] = [not own.fails for own in closures]
        return found

    def events(self, k: int) -> tuple[Array, Array]:
        """As of all copies."""
        times, kinds, count = self.values("work", "log_t"), self.values("work", "log_k"), int(self.loop["latches"][k])
        if times is None or kinds is None:
            return np.zeros(0), np.zeros(0, dtype=np.int64)
        return times[k, :count].copy(), event_numbers(self.run.model, kinds[k, :count])

    def _begin(self, which: Array) -> None:
        """As of all copies."""
        first = self.run.ranks.found
        if first:
            self._ranked[which], self._ranked_latches[which] = first[0].held, 0
        if first and first[0].redundancy is not None:  # whose compliance follows from the masses
            for k in which.tolist():
                self._guarded(k, lambda one: one.begin_anew())
            return
        self._start(which, lambda part: begin_many(part, *self._structs.values(), self._codes))

    def _start(self, which: Array, start: Callable[[Array], None]) -> None:
        """Start copies by compiled code, which gives the codes `DONE` or why it failed."""
        for part in self._parts(which):
            try:
                start(part)
            except Exception as error:  # noqa: BLE001  (whatever a user's law may raise)
                self._fail(int(part[0]), self._failure_of(int(part[0]), error))
                continue
            for k in part[self._codes[part] != DONE].tolist():
                self._guarded(k, lambda one: reason(int(self._codes[one.number]), one))

    def _go_on(self, which: Array, ends: Array, changed: Array) -> Array:
        """As of all copies."""
        self.loop["sample"][which] = 1
        return np.asarray(changed | self._pass_stops(which))

    def _pass_stops(self, which: Array) -> Array:
        """Pass stops at the ends of the steps before; returns at which copies there was one, (k,) bool."""
        found = np.zeros(which.size, dtype=bool)
        if self.stops is None:
            return found
        near = 10.0 * float(self.run.plan.options.smallest)
        while True:
            at = self.loop["stop"][which]
            left = at < self.stops.shape[1]
            next_one = self.stops[which, np.minimum(at, self.stops.shape[1] - 1)]
            passed = left & (next_one <= self.time[which] + near)
            if not passed.any():
                return found
            self.loop["stop"][which[passed]] += 1
            found |= passed

    def _take_steps(self, which: Array) -> None:
        """As of all copies."""
        advance_many(which, *self._structs.values(), self._codes, STEPS)

    def _run_of(self, views: dict[str, Any], number: int) -> Any:
        """As of all copies; it has begun where the run has not."""
        return _run_of(self.run, views, number)

    def _ended(self, which: Array) -> Array:
        """As of all copies."""
        codes = self._codes[which]
        self.status[which[codes == STOPPED]] = STOPPED_BY_EVENT
        for k in which[codes < 0].tolist():
            self._guarded(k, lambda one: reason(int(self._codes[one.number]), one))
        restarts = which[codes == AT_RESTART]
        if restarts.size:
            self._restart(restarts)
        for k in which[codes == BUDGET].tolist():
            self._look(k)
        goes_on = (codes == AT_RESTART) | (codes == BUDGET)
        if (ranked := self.run.ranks.now) is not None:
            for k in which[codes >= 0].tolist():
                self._guarded(k, lambda one: (one.ranks.now or ranked).contradiction(one.gaps(), one.reached))
        return which[goes_on & (self.status[which] == GOES_ON)]

    def _restart(self, which: Array) -> None:
        """As of all copies."""
        smallest = 20.0 * float(self.run.plan.options.smallest)
        after = np.zeros(self.count)
        after[which] = self.time[which] + np.maximum(1e-9 * self.loop["last"][which], smallest)
        due = which[self._is_due(which, after[which])]
        if due.size:
            self._find_ranks(due, after)
        which = which[self.status[which] == GOES_ON]
        if self.midpoint:
            for k in which.tolist():
                self._hold(k, float(after[k]))
            return
        self._start(which, lambda part: restart_many(part, after, *self._structs.values(), self._codes))

    def _hold(self, k: int, after: float) -> None:
        """Note whether something acts on a copy of energy-momentum from outside."""
        one = self.of(k)
        one.work.step.step.held = float(one.plan.options.chi > 0.0 and acts_from_outside(one.model, after))

    def _held(self, which: Array, times: Array) -> Array:
        """Rows that are constraints and hold at times (k,), s: (k, nj) bool (`redundancy.is_held`)."""
        assert self.rows is not None
        stiffness, until = self.rows["stiffness"][which], self.rows["until"][which]
        return np.asarray((stiffness == 0.0) & (times[:, None] <= until))

    def _is_due(self, which: Array, after: Array) -> Array:
        """Whether the rank of the constraints of copies may have changed (`redundancy.Ranks.is_due`), (k,) bool."""
        if self.rows is None:
            return np.zeros(which.size, dtype=bool)
        due = self._ranked_latches[which] != self.loop["latches"][which]
        if not due.all():
            own = self.rows["alone"][which] == 0
            due |= np.any((self._ranked[which] != self._held(which, after)) & own, axis=1)
        return np.asarray(due)

    def _find_ranks(self, which: Array, after: Array) -> None:
        """Find the ranks of the constraints of copies just after the times reached, (count,) float, s.

        Where they are not redundant compiled code finds that.
        """
        held = self._held(which, after[which])
        apart = which[:0] if self.ranks_apart else which[np.any(held, axis=1)]
        self._codes[which] = -1 if self.ranks_apart else 0
        if apart.size:
            room = self._rank_room(int(apart[0]))
            count_open(apart, after, *self._structs.values(), *room, self._codes)
        for k in which[self._codes[which] != 0].tolist():
            self._guarded(k, self._find_rank)
        self._ranked[which], self._ranked_latches[which] = held, self.loop["latches"][which]

    def _rank_room(self, placed: int) -> tuple[Any, ...]:
        """What `count_open` takes of this thread: what moves to a model that is evaluated, the model, and scratch.

        By the place of a copy that goes on: others may never have been placed.
        """
        if not hasattr(self._room, "found"):
            model, n_v = self.run.model.copy(), int(self.run.model.info.nv)
            needs.note_alike(self.run.model, model)
            first = self.memory.views(self.blocks[placed])["model"]
            moves = np.array(model.moves(first), dtype=np.int64).reshape(-1, 3)
            assert not np.any(moves[:, 2] % 8)
            moves[:, 2] //= 8
            n_j = self.run.model.constraints.size
            self._room.found = moves, first.address, model, np.zeros(n_j), np.zeros(n_v), np.zeros(n_v + n_j)
        found: tuple[Any, ...] = self._room.found
        return found

    def _find_rank(self, one: Any) -> str:
        """Find the rank of the constraints of a copy, with the room of this thread."""
        one.ranks._apart = getattr(self._room, "model", None)
        try:
            return str(one.find_rank(one.after, one.work.y))
        finally:
            self._room.model, one.ranks._apart = one.ranks._apart, None


class _CopiedRun(ImplicitRun):
    """The run of a copy: see `ImplicitRun`.

    Attributes
    ----------
    number : int, of the copy
    """

    number: int

    def begin_anew(self) -> str:
        """Find the rank of the constraints and start the loop; returns why that failed, '' where it did not."""
        self.ranks.found = []
        return self.begin()


def _run_of(run: ImplicitRun, views: dict[str, Any], number: int) -> _CopiedRun:
    """The run of a copy, of views of its block; it has begun where `run` has not."""
    found = object.__new__(_CopiedRun)
    found.__dict__.update(run.__dict__)
    model: Model = views["model"]
    matrix: SparseBlocks = views["matrix"]
    work: Workspace = views["work"]
    needs.note_alike(run.model, model)
    assembly: Assembly = dataclasses.replace(run.assembly, model=model)
    found.number, found.assembly, found.model, found.matrix, found.work = number, assembly, model, matrix, work
    found.plan = dataclasses.replace(
        run.plan, assembly=assembly, matrix=matrix, weight=work.weight, options=work.options
    )
    found.__dict__["evaluates_reactions"] = run.evaluates_reactions  # found once
    found.captures, found.ranks = Captures(), redundancy.Ranks(assembly)
    found.ranks.found = copy.copy(run.ranks.found)
    return found


def prepared(run: ImplicitRun) -> ImplicitRun:
    """A run of which copies are made, with the rank of its constraints at the start.

    Raises
    ------
    InputError
        Where copies cannot be stepped by compiled code alone.
    """
    what = "; simulate variants of it by evolvent.simulate_many"
    if run.releases:
        raise InputError(f"a batch cannot have threads that are paid out or taken up node by node{what}")
    if run.has_layers:
        raise InputError(f"a batch cannot have layers that come to lie on one another{what}")
    run.find_rank(run.reached, run.work.y)
    return run
