"""An interval of time between two states, along which every force is evaluated; a state is one of length 0."""

from __future__ import annotations

import numpy as np

from evolvent.compiled.pointer import Struct, array, on_stack, record

#: Numbers of an interval.
#:
#: t, h, tm: start, length and middle, s; span: h, or `KEPT` of a state of explicit methods, whose frictions are among
#: its accounts; chi, chi_v, ratio: filter of strains and of velocities, and r of the step before
#: (`equations.energy_momentum`); soft: share of the contacts' stiffness; held: 1 where velocities are not filtered,
#: else 0; of the step before chi_p, and what it filters of accelerations: the largest beside the size, and the root
#: mean square by shares of inertia (1/s2). rub: s, length of the step of friction of contacts that ends at a state
#: (`kernels.contact.add_contacts`); factor: of loads on beams and of gravity; over: time in which `dv` changes
#: velocities, h, or 1 of a state, whose `dv` are accelerations, and inertia: 1/over. Of a tangent: c_mass and c_rate,
#: derivatives of accelerations and of velocities, and scale of the constraints. Of the end of a step: share, 1 where
#: the last forces are those of its end, 0.5 where they are means over it; again, 1 where forces change at once at an
#: end that is booked already. sample: index among `times`
NUMBERS = np.dtype(
    [
        (name, np.float64)
        for name in (
            "t", "h", "span", "tm", "chi", "chi_v", "ratio", "soft", "held", "chi_p", "largest", "rms", "rub", "factor",
            "over", "inertia", "c_mass", "c_rate", "scale", "share", "again", "sample",
        )
    ]
)  # fmt: skip


class Interval(Struct):
    """An interval from 0 to 1.

    Attributes
    ----------
    step : record (see `NUMBERS`)
    y0, y1, ym : (ny,) float, states at both ends; mean coordinates with velocities dq/h; all three the same of a state
    dq : (nv,) float, increments; of rotations 2 tan(angle/2) about the axis, in body axes
    la : (nj,) float, multipliers; r : (nv + nj,) float, residual
    dv, before : (nv,) float, changes of the velocities over this step and the one before; of a state `dv` are
        accelerations
    R0, R1 : (nb, 3, 3) float, and x0, x1 : (nb, 3) float, rotations and positions of bodies at both ends of a step
    powers : (N_POWERS,) float, means over a step; contact : (2,) float, J, what normal forces and friction of contacts
        take in a step
    s, rates : (ns,) int and (ny,) float, of a state of explicit methods its switches and its rates
    times : (nt,) float, s, of samples, of which the state is one
    """

    step: np.record = record(NUMBERS)
    y0: np.ndarray = array(1)
    y1: np.ndarray = array(1)
    ym: np.ndarray = array(1)
    dq: np.ndarray = array(1)
    la: np.ndarray = array(1)
    r: np.ndarray = array(1)
    dv: np.ndarray = array(1)
    before: np.ndarray = array(1)
    R0: np.ndarray = array(3)
    R1: np.ndarray = array(3)
    x0: np.ndarray = array(2)
    x1: np.ndarray = array(2)
    powers: np.ndarray = array(1)
    contact: np.ndarray = array(1)
    s: np.ndarray = array(1, np.int64)
    rates: np.ndarray = array(1)
    times: np.ndarray = array(1)


#: The type of an interval in signatures of compiled functions.
INTERVAL = Interval._numba_type_
_OF_STATE = {
    "step": "step", "y0": "y", "y1": "y", "ym": "y", "dq": "a", "dv": "a", "before": "a", "la": "la", "r": "r",
    "powers": "powers", "s": "s", "rates": "rates",
}  # fmt: skip
#: ``state_interval(step, y, a, la, r, powers, s, rates)``: for compiled code, the interval of a state with
#: accelerations `a` and multipliers `la`.
state_interval = on_stack(Interval, "step", "y", "a", "la", "r", "powers", "s", "rates", **_OF_STATE)
#: ``sample_interval(step, y, a, la, r, powers, s, rates, times)``: the same of a sample.
sample_interval = on_stack(
    Interval, "step", "y", "a", "la", "r", "powers", "s", "rates", "times", **_OF_STATE, times="times"
)
