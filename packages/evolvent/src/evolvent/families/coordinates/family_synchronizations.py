"""Synchronizations."""

from __future__ import annotations

import numpy as np

from evolvent.families.coordinates import coordinate_laws, coordinate_tangent
from evolvent.kernels import calls
from evolvent.kernels.ends import OfCoordinates
from evolvent.kernels.extremes import note_extremes
from evolvent.model.family import Family, Kind, record
from evolvent.model.layout import Accounts
from evolvent.model.questions import AdjointSupport, Explicit, Implicit, Parts, Samples, Statics, Step, Torques, never
from evolvent.model.shares import DAMPING, SPRING, Rule, Shares, Tie

Array = np.ndarray


@calls.apply
def apply(t, share, kept, y, s, model):
    """Torques of all cables between coordinates."""
    stored, lost = coordinate_laws.add_synchronizations(share, model)
    return stored, lost, 0.0


@calls.tangent
def apply_tangent(interval, model, matrix):
    """What cables couple between different coordinates; the rest is among the slopes of each."""
    step = interval.step
    coordinate_tangent.add_synchronization_tangents(interval.ym, step.h, step.c_rate, model, matrix)


@calls.force
def explicit_force(interval, model):
    """Rates of what cables dissipate."""
    rows = model.synchronizations
    for k in range(rows.size):
        interval.rates[rows[k].account] = rows[k].lost


@calls.force
def end_step(interval, model):
    """What cables have dissipated into their accounts."""
    rows, step = model.synchronizations, interval.step
    now = (0.5 if step.share == 1.0 else 1.0) * step.h
    then = step.h - now
    for k in range(rows.size):
        interval.y1[rows[k].account] += now * rows[k].lost + then * rows[k].lost0
        rows[k].lost0 = rows[k].lost


@calls.stored
def coupled_energy(t, model):
    """Energy of all cables."""
    return coordinate_laws.synchronization_energy(model)


@calls.note_extremes
def note_synchronizations(s, model):
    """Extremes of the stretches and torques of all cables."""
    rows = model.synchronizations
    for k in range(rows.size):
        note_extremes(rows[k].extremes, 0, rows[k].stretch)
        note_extremes(rows[k].extremes, 1, rows[k].torque)


# cables between two coordinates: they keep ratio_b x_b - ratio_a x_a = offset; account: of what is dissipated
SYNCHRONIZATIONS = Family(
    "synchronizations",
    record(
        "a b account", "ratio_a ratio_b offset stiffness damping", "stretch torque energy lost lost0 extremes",
        extremes=(4,),
    ),
    order=255,
    results={
        "stretch": ("difference", "rad", "difference of the angles that each loop couples, times their ratios"),
        "torque": ("torque", "N m", "torque of each loop, at a ratio of 1"),
        "energy": ("energy_elastic", "J", "elastic energy of the loops"),
        "lost": ("dissipation", "W", "power dissipated by the loops"),
    },
    kinds=(
        Kind("a synchronization", symmetric=True),
    ),

    ends=OfCoordinates("a", "b"),
    isolated=True,
    accounts=(Accounts(1, order=3),),
    shares=Shares(
        (Rule(SPRING, "", ("stiffness",)), Rule(DAMPING, "damping", ("damping",))), place=3,
        tie=lambda row: Tie(
            (int(row["b"]), int(row["a"])), (float(row["ratio_b"]), -float(row["ratio_a"])), float(row["offset"])
        ),
    ),
    smooth=True,
    of_step=False,
    adjoint=AdjointSupport("its torque follows from the state, with all derivatives", timed=False, smooth=True),
    parts=Parts(several=True, changes="stiffness damping", reads_inertia=False),
    torques=Torques(apply=apply, tangent=apply_tangent),
    explicit=Explicit(force=explicit_force),
    implicit=Implicit(end_step=end_step),
    step=Step(energy=coupled_energy),
    statics=Statics(uneven=never),
    samples=Samples(local=True, evaluate=False, extremes=("stretch", "torque"), note_extremes=note_synchronizations),
)  # fmt: skip
