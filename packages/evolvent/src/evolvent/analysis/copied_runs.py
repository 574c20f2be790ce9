"""Runs of which copies are made, by explicit and by implicit methods."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.solvers.time.copies import Copies
from evolvent.solvers.time.explicit.copies import ExplicitCopies
from evolvent.solvers.time.explicit.plan import ExplicitPlan
from evolvent.solvers.time.explicit.run import ExplicitRun
from evolvent.solvers.time.implicit.copies import ImplicitCopies, prepared as prepared_implicit
from evolvent.solvers.time.implicit.run import ImplicitRun


def prepared(plan: Any, *, of_ends: bool = False) -> ExplicitRun | ImplicitRun:
    """The run of a plan, of which copies can be made; `of_ends` where its samples are ends of steps.

    Raises
    ------
    InputError
        Where copies cannot be stepped by compiled code alone.
    """
    if isinstance(plan, ExplicitPlan):
        return ExplicitRun(plan)
    run = prepared_implicit(ImplicitRun(plan))
    if of_ends:
        run.work = run.work._replace(out_momenta=np.zeros((0, 6)))
    return run


def copies_of(run: ExplicitRun | ImplicitRun, count: int, workers: int) -> Copies:
    """Copies of a prepared run: see `evolvent.solvers.time.copies.Copies`."""
    if isinstance(run, ExplicitRun):
        return ExplicitCopies(run, count, workers)
    return ImplicitCopies(run, count, workers)
