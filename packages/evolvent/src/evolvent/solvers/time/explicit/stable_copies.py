"""Whether a given step is stable in copies of an explicit run, by bounds of their highest frequencies.

A bound takes a few evaluations of the accelerations of a copy, where its highest frequency takes some hundred. Of a
copy of which it does not show that the step is stable, the plan finds the frequency.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import config

from evolvent.assembly import needs
from evolvent.model.registry import asked, is_by_rates
from evolvent.solvers.time.explicit.fastest_modes import displaceable, touches
from evolvent.solvers.time.explicit.many_steps import bound_many
from evolvent.solvers.time.explicit.methods import METHODS
from evolvent.solvers.time.explicit.stability import bounds_of_families, stable_radius

Array = np.ndarray


class StableCopies:
    """Whether the step of a run is stable in its copies.

    Parameters
    ----------
    run : ExplicitRun, whose step was given

    Notes
    -----
    Of a matrix A with an eigenvalue lambda and its left eigenvector w, and x of independent normal deviates,
    |A^j x| >= |w A^j x| / |w| = |lambda|^j |g|, where g = w x / |w| is a normal deviate. So |lambda| is at most
    (|A^j x| / |g|)^(1/j), and |g| is less than e^-14 once in a million draws of x. Rates are scaled by the roots of
    their inertias, which makes the bound close and changes no eigenvalue. The poles of all modes with frequencies and
    damping rates up to a bound lie in half a disc, where the method must be stable.
    """

    def __init__(self, run: Any) -> None:
        self.run, plan = run, run.plan
        duration = float(plan.times[-1] - plan.times[0])
        radius = stable_radius(METHODS[plan.method], plan.step, duration)
        self.most = radius / plan.step
        model = run.model
        self.by_rates = is_by_rates(model)
        self._bounded = any(getattr(model, name).size for name in asked("stability.bound"))
        n_q, n_v = int(model.info.nq), int(model.info.nv)
        moves, turning, moving = displaceable(model)
        places = np.zeros(n_v)
        places[moves >= 0] = 1.0
        for _, v in turning:
            places[v : v + 3] = 1.0
        self._moves = np.array([places, moving])
        inertia = np.zeros(n_v)
        for block in model.blocks:
            at, size = int(block["iv"]) - n_q, int(block["count"])
            inertia[at : at + size] = block["inertia"][:size]
        self._scale = np.sqrt(np.where(inertia > 0.0, inertia, 1.0))
        self._start = np.random.default_rng(0).standard_normal(n_v)
        self._stiffen = [of for name, of in asked("stability.stiffest").items() if getattr(model, name).size]

    @staticmethod
    def apply(run: Any) -> bool:
        """Whether bounds can be found of the copies of a run."""
        model, plan = run.model, run.plan
        alone = config.DISABLE_JIT or plan.step is None or plan.asked is None or touches(model)
        return not (alone or run.assembly.laws or run.assembly.expressions)

    def of(self, which: Array, addresses: Array, models: Sequence[Any]) -> Array:
        """Which of some copies surely have a stable step, (k,) bool.

        Parameters
        ----------
        which : (k,) int
        addresses : (n,) int, of the models of all copies
        models : these, which are written to
        """
        codes = np.ones(len(addresses), dtype=np.int64)
        if self._bounded:
            for k in which.tolist():
                found = bounds_of_families(dataclasses.replace(self.run.assembly, model=models[k], shared=None))
                codes[k] = max(max(math.sqrt(square), rate) for square, rate, *_ in found) <= self.most
        left = which[codes[which] != 0]
        if self.by_rates and left.size:
            for stiffen in self._stiffen:
                for k in left.tolist():
                    stiffen(models[k])
            assembly = self.run.assembly
            needs.load(self.run.model, bound_many)
            y, s = assembly.y.copy(), assembly.s.copy()
            rates, states = np.zeros((3, self._start.size)), np.zeros((2, y.size))
            moves, scale, start = self._moves, self._scale, self._start
            bound_many(left, addresses, y, s, moves, scale, start, rates, states, self.most, codes)
        return np.asarray(codes[which] != 0)
