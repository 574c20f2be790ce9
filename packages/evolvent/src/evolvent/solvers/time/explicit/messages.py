"""Why an explicit run ended before its end: what happened, where, when, and what to try."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.solvers.common import balance as eb
from evolvent.solvers.common.laws import large_law, states_energy, what_may_jump
from evolvent.solvers.time.explicit import events as explicit_events
from evolvent.solvers.time.messages import outrun
from evolvent.solvers.time.pace import Stall
from evolvent.solvers.time.run import MotionRun


def explicit_reason(code: int, run: Any) -> str:
    """Why the loop of an explicit method ended with a status below zero, or with its log of events full."""
    reached, work, method = run.reached, run.work, run.plan.method
    if code == explicit_events.NOT_FINITE:
        worst = int(np.argmax(~np.isfinite(work.y1)))
        return (
            f"the state stopped being finite at t = {reached:.6g} s (component {worst}) with {method}; "
            "use a smaller `step`, or check loads, laws and constraints there"
        )
    if code == explicit_events.TOO_SMALL:
        return (
            f"the step became too small at t = {reached:.6g} s with {method}: the motion is singular there "
            "or a law jumps; check the last samples, or loosen the tolerance"
        )
    if code == explicit_events.NO_THREAD:
        return outrun(reached)
    return f"{run.all_logged()[0].size} events by t = {reached:.6g} s: one of them fires repeatedly"


def explicit_stalled(stall: Stall, run: MotionRun) -> str:
    """Why a run of ever smaller steps was ended."""
    law = large_law(run.assembly, run.moments())
    return f"{stall}{law}; " + (
        "check the law" if law else "use an implicit method, a greater `tolerance`, or a shorter `until`"
    )


def unbalanced(run: MotionRun, found: eb.Closure) -> str:
    """What is known of an explicit run whose energy does not balance, and what to try."""
    smaller = "use a smaller `tolerance`"
    if run.plan.step is not None:
        model = run.model
        other = "energy-momentum" if model.info.slender else "dopri5"
        smaller = f"use a smaller `step` than {float(run.work.loop.step):.3g} s, or `method` {other}"
    return (
        f"the energy balance is off by {found.defect:.3g} J at t = {run.reached:.6g} s, {found.share:.2g} of the "
        f"{found.moved:.3g} J that were moved, more than {eb.GAINED:g}: the steps do not resolve the motion"
        f"{what_may_jump(run.assembly)}{states_energy(run.assembly)}; {smaller}"
    )
