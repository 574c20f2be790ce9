"""Runs beside a run: neighbours that differ in a parameter by little, and take its steps (see `steps_beside`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numba import config

from evolvent.assembly import needs
from evolvent.assembly.families import owner
from evolvent.model.registry import asked, event_of
from evolvent.solvers.common.solution import event_numbers
from evolvent.solvers.sensitivity.steps_beside import (
    ELSEWHERE,
    FAILED,
    HASTY,
    LEFT,
    N_FACTORED,
    N_PACE,
    RATIO,
    SINCE,
    STATUS,
    TOGETHER,
    TOO_SHORT,
    UNLIKE,
    advance_beside,
)
from evolvent.solvers.time import run as runs
from evolvent.solvers.time.implicit.messages import reason
from evolvent.solvers.time.implicit.methods import METHODS
from evolvent.solvers.time.implicit.run import ImplicitRun
from evolvent.solvers.time.implicit.workspace import AT_RESTART, BUDGET, DONE, STOPPED
from evolvent_base.errors import InputError

#: Steps between two looks at a run.
BUDGET_OF_SLICE = 200


class TooFar(Exception):
    """A neighbour does not take a step of the run: it has come too far from it, or the step is not smooth.

    Attributes
    ----------
    index : int, of the neighbour, -1 of the middle; why : str
    """

    def __init__(self, index: int, why: str) -> None:
        super().__init__(why)
        self.index, self.why = index, why


class Neighbours:
    """A run, and neighbours that take its steps.

    Attributes
    ----------
    lead : ImplicitRun, the run itself, with the steps and the numbers that it has alone
    middle : ImplicitRun, the same parameters; its steps are solved as those of the neighbours are
    beside : list of ImplicitRun
    pace, factored : (1 + neighbours, N_PACE) float, of the middle first, and (N_FACTORED,) float
    """

    def __init__(self, lead: Any, middle: Any, beside: Sequence[Any]) -> None:
        self.lead, self.middle, self.beside = (
            ImplicitRun(lead),
            ImplicitRun(middle),
            [ImplicitRun(plan) for plan in beside],
        )
        self.all = [self.middle, *self.beside]
        self.pace = np.zeros((len(self.all), N_PACE))
        self.pace[:, RATIO], self.pace[:, SINCE] = 1.0, math.inf
        self.factored = np.zeros(N_FACTORED)
        for one in self.beside:
            one.matrix = self.middle.matrix
            if one.work.stops.size != self.lead.work.stops.size:
                raise InputError(
                    "a key moves a time at which loads change onto another one; the motion has no derivative by it"
                )
        others = [row.modules for name, row in METHODS.items() if name != lead.method]
        for one in self.all:
            needs.load(one.model, advance_beside, without=frozenset().union(*others))
        structs = [[getattr(one, of) for one in self.beside] for of in ("model", "work")]
        self.addresses: list[Any] = structs
        if not config.DISABLE_JIT:
            self.addresses = [np.array([one.address for one in of], dtype=np.int64) for of in structs]

    def start(self) -> str:
        """Start all; returns why that failed, '' where it did not."""
        return self._each(ImplicitRun.begin)

    def _each(self, start: Callable[[ImplicitRun], str]) -> str:
        """Start all, or start them again, neighbours as the run does; returns why that failed."""
        failure = start(self.lead)
        for one in self.all:
            one.work.loop.follows = self.lead.work.loop.resolves
            failure = failure or start(one)
        return failure

    def run(self, progress: Callable[[float], None] | None = None) -> runs.Ending:
        """Run to the end; returns how.

        Raises
        ------
        TooFar
        """
        failure, code, lead, middle = self.start(), BUDGET, self.lead, self.middle
        while not failure and code not in (DONE, STOPPED):
            code = advance_beside(
                BUDGET_OF_SLICE, lead.model, lead.matrix, lead.work, middle.model, middle.matrix, middle.work,
                *self.addresses, self.pace, self.factored,
            )  # fmt: skip
            if code == LEFT:
                raise self._left()
            if code == TOGETHER:
                raise self._together()
            if code == HASTY:
                raise InputError(
                    f"the step to a release at t = {lead.reached:.6g} s is {lead.work.loop.tried:.2g} s, "
                    f"too short for a derivative; take another step"
                )
            if code == AT_RESTART:
                failure = self._each(ImplicitRun.restart)
            elif code not in (BUDGET, DONE, STOPPED):
                failure = reason(code, lead)
            if not failure:
                self._check_likeness()
            if progress is not None:
                progress(lead.reached)
        if code == STOPPED and not failure:
            return lead.stopped()
        return ("failed", failure) if failure else runs.FINISHED

    def _check_likeness(self) -> None:
        """Refuse a neighbour of which other contacts touch, or other joints slip, than in the run.

        Raises
        ------
        TooFar
        """
        for k, steps in enumerate(self.pace[:, UNLIKE].astype(int)):
            if steps:
                model = self.lead.model
                touches = any(getattr(model, name).size for name in asked("contacts.presses"))
                what = "contacts touch" if touches else "joints slip"
                raise TooFar(k - 1, f"other {what} in steps to t = {self.lead.reached:.6g} s")

    def _left(self) -> TooFar:
        """Which neighbour has not taken the last step of the run, and why."""
        failed = int(self.factored[FAILED])
        why = {
            TOO_SHORT: "ends before it starts, as events shift the steps",
            ELSEWHERE: "ends on an event by chance; take another step",
        }.get(int(self.pace[failed, STATUS]), "is not solved")
        return TooFar(failed - 1, f"the step of the run to t = {self.lead.reached:.6g} s {why}")

    def _together(self) -> InputError:
        """Why a run with several latches or events at the end of a step, or one at its given end, has no derivative."""
        work = self.lead.work
        last = work.log_k[: int(work.loop.latches)][work.log_t[: int(work.loop.latches)] == self.lead.reached]
        model = self.lead.model
        found = [event_of(lambda name: getattr(model, name), int(number)) for number in event_numbers(model, last)]
        names = " and ".join(repr(owner(self.lead.assembly, family.name, index)) for family, index, _ in found)
        happen = "latch" if np.all(last >= 0) else "happen"
        return InputError(
            f"{names} {happen} at t = {self.lead.reached:.6g} s in one step, together or with the end or a change of "
            f"loads; the motion has no derivative there"
        )
