"""What the loop of implicit steps carries from step to step, of both methods."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.algebra import sparse_lu
from evolvent.compiled.jit import inlined
from evolvent.compiled.pointer import Struct, array, record, struct
from evolvent.model.interval import Interval
from evolvent.solvers.common.balance import BALANCE, EXTREMES
from evolvent.solvers.time.event_search import EventSearch

# status codes of the loop
BUDGET, DONE, AT_STOP, AT_RESTART, STOPPED = 0, 1, 2, 3, 4
NO_CONVERGENCE, NOT_FINITE, SINGULAR, GAINED, REDUNDANT = -1, -2, -3, -4, -5
#: Codes of methods: generalized-alpha and energy-momentum; others have theirs in their own modules.
ALPHA, ENERGY = 0, 1
#: The loop's counters and clock.
#:
#: sample, stop: the next ones; contact_set: number that encodes which points touch; over: steps in a row at which the
#: balance has gained too much; latches: events and latches so far; extended: whether the step was made longer to end
#: behind an event; settling: steps until rates are smooth again after a contact; stages: solutions that needed softened
#: contacts; divided: steps that were divided; steady: steps of one length in a row; resolves: 1 where the last start of
#: generalized-alpha has resolved the rate of accelerations, else -1, and follows: the same, of the run that a neighbour
#: follows, 0 of the run itself; found: times that the step was shortened for events between its ends. step, wanted:
#: length of the next step, and that of undivided fixed ones, s; event_step: its limit, on which a latch or an event
#: lies; turn_step: on which a friction turns back, or that on which the rest of a fixed step ends; whole: length of the
#: step that this was cut from, s, or 0; last: length of the step before, s; factored: length of the step whose matrix
#: is factored, s, 0 of none; quality: its worst pivot so far; start_energy: J; gain, lowest_gain: what the balance has
#: gained since the start, and the lowest of that so far, J; fastest: largest mean rate so far, 1/s; left, left0: what
#: Newton's method has left in this step and in those before, beside `weight`; tried: length of the step that was tried
#: last, s; behind: by how much rounding has put `time` before the sum of the steps, s; and the extremes of
#: `evolvent.solvers.common.balance`.
LOOP = np.dtype(
    [(name, np.int64) for name in ("steps", "iterations", "rejected", "factorizations", "sample", "stop", "contact_set",
                                   "over", "latches", "extended", "settling", "stages", "divided", "steady",
                                   "resolves", "follows", "found")]
    + [(name, np.float64) for name in ("time", "step", "wanted", "event_step", "turn_step", "whole", "last", "factored",
                                       "quality", "start_energy", "gain", "lowest_gain", "fastest", "left", "left0",
                                       "tried", "behind")]
    + list(EXTREMES),
    align=True,
)  # fmt: skip
#: Options of a run.
#:
#: newton, sharp: correction at which an iteration has converged beside `weight`, and share of `rates` that it may
#: leave; tolerance, rates: of coordinates and rates, 0 of fixed steps; smallest, longest, first: steps, s; gain, floor:
#: part of the energy moved that may come from nothing, and energy (J) that is added to it; mass, span: a typical mass
#: (kg) and time (s); then the constants of the methods. Flags of the method: midpoint: forces are means of a step,
#: whose start needs no accelerations; conserves: energy and momenta, to what Newton's method leaves; divides: fixed
#: steps that fail are divided. laws: whether a user's law acts, whose work is integrated by itself.
OPTIONS = np.dtype(
    [(name, np.int64) for name in ("method", "midpoint", "conserves", "divides", "corrects", "laws")]
    + [(name, np.float64) for name in ("newton", "sharp", "tolerance", "rates", "smallest", "longest", "first", "gain",
                                       "floor", "mass", "span", "alpha_m", "alpha_f", "beta", "gamma", "chi")],
    align=True,
)  # fmt: skip


#: Attributes of a workspace that samples alone are written into.
SAMPLED = (
    "ends", "end_times", "out_y", "out_s", "out_a", "out_la", "out_balance", "out_momenta", "out_forces", "out_points",
)  # fmt: skip


class Workspace(Struct):
    """What the loop carries from step to step. Of a pair, 0 is the start of the step and 1 its end.

    Attributes
    ----------
    options, loop, balance : records (see `OPTIONS`, `LOOP` and `evolvent.solvers.common.balance`)
    step : Interval, whose arrays of the same names are those here; y1 is y
    row, row0 : (number of fields,) float, J, the fields of `balance`, and those of the step's start
    y, y0, spare : (ny,) float, state at the end and the start of a step, and scratch
    a1, a0 : (nv,) float, algorithmic accelerations
    dv1, dv0 : (nv,) float, accelerations v', of energy-momentum the mean one of the step
    loads1, loads0 : (nv,) float, loads
    la, la0 : (nj,) float, multipliers; dq : (nv,) float, increments; r, x : (nv + nj,) float
    dq0, la1 : (nv,) and (nj,) float, increments and multipliers of the last stage that has converged
    rate, acceleration : (nv,) float, mean rates of the step before, and accelerations by it and the one before that
    weight, error_weight : (nu,) float, size of each unknown that counts as 1, in iterations and in errors of steps
        (`setup.error_sizes`); shares : (nv,) float, see `setup.shares`
    kept : (12,) float, angular momentum that an isolated system keeps (see `keep_momentum`)
    momenta : (6,) float, scratch; search : Search, of events within a step
    booked : (N_POWERS,) float, scratch, what families book of a step
    powers : (2, N_POWERS) float, at the end and the start; gaps : (nj,) float, what drives change in the joints' gaps
    energies : (3,) float, scratch
    forces : (2, n) float, see `solvers.common.sampled.Sampled`, of the start first
    samples : (nt,) float; stops : (ns,) float, times on which the loop lands and restarts
    R0, x0, R1, x1 : (nb, 3, 3) and (nb, 3) float, rotations and positions of the bodies at both ends of a step
    ends, end_times : (nt, 2, ny) and (nt, 2) float, s, of the steps with the samples, where reactions are evaluated
    log_t, log_k : (nh + ne,) float and int, s, times of latches and events; their coordinates, and -1 - k of event k
    out_* : what is kept at the samples; of no row where it is not
    """

    options: np.record = record(OPTIONS)
    loop: np.record = record(LOOP)
    balance: np.record = record(BALANCE)
    step: Interval = struct(Interval)
    row: np.ndarray = array(1)
    row0: np.ndarray = array(1)
    y: np.ndarray = array(1)
    y0: np.ndarray = array(1)
    spare: np.ndarray = array(1)
    a1: np.ndarray = array(1)
    a0: np.ndarray = array(1)
    dv1: np.ndarray = array(1)
    dv0: np.ndarray = array(1)
    loads1: np.ndarray = array(1)
    loads0: np.ndarray = array(1)
    la: np.ndarray = array(1)
    la0: np.ndarray = array(1)
    dq: np.ndarray = array(1)
    r: np.ndarray = array(1)
    x: np.ndarray = array(1)
    dq0: np.ndarray = array(1)
    la1: np.ndarray = array(1)
    rate: np.ndarray = array(1)
    acceleration: np.ndarray = array(1)
    weight: np.ndarray = array(1)
    error_weight: np.ndarray = array(1)
    shares: np.ndarray = array(1)
    powers: np.ndarray = array(2)
    booked: np.ndarray = array(1)
    gaps: np.ndarray = array(1)
    energies: np.ndarray = array(1)
    forces: np.ndarray = array(2)
    R0: np.ndarray = array(3)
    R1: np.ndarray = array(3)
    x0: np.ndarray = array(2)
    x1: np.ndarray = array(2)
    ends: np.ndarray = array(3)
    end_times: np.ndarray = array(2)
    kept: np.ndarray = array(1)
    samples: np.ndarray = array(1)
    stops: np.ndarray = array(1)
    momenta: np.ndarray = array(1)
    search: EventSearch = struct(EventSearch)
    log_t: np.ndarray = array(1)
    log_k: np.ndarray = array(1, np.int64)
    out_y: np.ndarray = array(2)
    out_s: np.ndarray = array(2, np.int64)
    out_a: np.ndarray = array(2)
    out_la: np.ndarray = array(2)
    out_balance: np.ndarray = array(2)
    out_momenta: np.ndarray = array(2)
    out_forces: np.ndarray = array(2)
    out_points: np.ndarray = array(2)

    def copy(self) -> Any:
        """A workspace with arrays of its own, those of its `step` among them."""
        found = super().copy()
        if not self.options["midpoint"]:
            return found
        own = {name: getattr(found, name) for name in ("y0", "dq", "la", "r", "R0", "R1", "x0", "x1")}
        return found._replace(step=found.step._replace(y1=found.y, powers=found.powers[0], **own))


WORKSPACE = Workspace._numba_type_


@inlined
def factor(matrix, work):
    """Factor the assembled tangent; returns what `sparse_lu.factor` returns."""
    found = sparse_lu.factor(matrix)
    work.loop.factorizations += 1
    work.loop.quality = min(work.loop.quality, matrix.quality[0])
    return found
