"""Why a run by the energy-momentum method ended before its end: what happened, where, when, and what to try."""

from __future__ import annotations

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import owner
from evolvent.kernels import flexible, rigid
from evolvent.solvers import energy_loop
from evolvent.solvers.balance import moved
from evolvent.solvers.laws import states_energy, what_may_jump
from evolvent.solvers.pace import Stall
from evolvent.solvers.rod_messages import bending_hint

Array = np.ndarray


def reason(code: int, work: energy_loop.EnergyLoop, assembly: Assembly, *, fixed: bool) -> str:
    """What happened, where, when, and what to try.

    Parameters
    ----------
    code : int, below zero, of `energy_loop.advance`
    work : the loop's workspace, with the last correction and residual
    fixed : whether the steps are fixed
    """
    t, h = float(work.loop.time), float(work.step.step.h)
    smaller = "use a smaller `step`, or None" if fixed else "use a smaller `tolerance`"
    bent = bending_hint(assembly, work.step.y0)
    when = f"in the step of {h:.3g} s from t = {t:.6g} s"
    if code == energy_loop.NOT_FINITE:
        # a correction that is not finite says less than the residual from which it comes
        return f"forces stopped being finite {when}, at {_location(assembly, work.step.r)}{bent}; {smaller}"
    if code in (energy_loop.SINGULAR, energy_loop.REDUNDANT):
        return (
            f"the equations are singular {when}: something has no mass, constraints have become redundant, or the step "
            f"leads too far; {smaller}, and check the last samples"
        )
    if code == energy_loop.GAINED:
        share, whole, hint = 100.0 * float(work.options.gain), float(moved(work.loop)), states_energy(assembly)
        found = f"the energy balance has gained more than {share:g} % of the {whole:.3g} J that were moved {when}"
        if hint:
            return f"{found}{hint}; {smaller}"
        return (
            f"{found}, which no step of this method does: Newton's method leaves too large a residual; use another "
            f"`step` or `tolerance`, and report it"
        )
    size = float(np.abs(work.x[: work.weight.size] / work.weight).max(initial=0.0))
    where, softer = _where(work, assembly)
    rounding = ", or a greater `newton`: the corrections are round-off" if size < 1e-9 else ""
    return (
        f"Newton's method found no solution {when}, the shortest that was tried; the largest correction, {size:.2g} of "
        f"the size of the system, is at {where}{what_may_jump(assembly)}{bent}; {smaller}{softer}{rounding}, and "
        f"check the last samples"
    )


def stalled(work: energy_loop.EnergyLoop, assembly: Assembly, stall: Stall, law: str) -> str:
    """Why a run of ever smaller steps was ended; `law`: of `laws.large_law`."""
    if law:
        return f"{stall}{law}; check the law"
    where, softer = _where(work, assembly)
    return (
        f"{stall}; Newton's method corrects most at {where}{what_may_jump(assembly)}"
        f"{bending_hint(assembly, work.step.y0)}; use a greater `tolerance` or `step`{softer}, and look at the last "
        f"samples"
    )


def _where(work: energy_loop.EnergyLoop, assembly: Assembly) -> tuple[str, str]:
    """Where the largest correction is, contacts that touch included; and what to try about them."""
    at, touching = _location(assembly, work.x[: work.weight.size] / work.weight), _touching(assembly)
    if not touching:
        return at, ""
    return f"{at}, with contact at {touching}", f", or a softer contact (`stiffness` of {touching})"


def _location(assembly: Assembly, values: Array) -> str:
    """Name of the part, and its node, to which the largest of values of all velocities (and joints) belongs."""
    size = np.abs(values)
    if not np.all(np.isfinite(size)):
        size = np.where(np.isfinite(size), 0.0, np.inf)
    k = int(np.argmax(size))
    model, n_q, n_v = assembly.model, int(assembly.model.info.nq), int(assembly.model.info.nv)
    if k >= n_v:
        return repr(owner(assembly, "joints", k - n_v))
    for b, row in enumerate(model.flexible.beams):
        node = (k - int(row["iv"]) + n_q) // (3 * flexible.NODE_VECTORS[row["kind"]])
        if 0 <= node < row["nodes"]:
            return f"{owner(assembly, 'beams', b)!r}, node {node} of {row['nodes'] - 1}"
    for r, row in enumerate(model.flexible.rods):
        node = (k - int(model.bodies["iv"][row["first_body"]]) + n_q) // 6
        if 0 <= node <= row["elements"]:
            return f"{owner(assembly, 'rods', r)!r}, node {node} of {row['elements']}"
    for family, rows in (("points", model.points), ("bodies", model.bodies)):
        for i, row in enumerate(rows):
            extent = 3 if family == "points" else {rigid.FREE: 6, rigid.SPIN: 1}.get(int(row["motion"]), 0)
            if 0 <= k - int(row["iv"]) + n_q < extent:
                return repr(owner(assembly, family, i))
    return "an unknown of the joints"


def _touching(assembly: Assembly) -> str:
    """Names of the contacts whose points press."""
    contacts, found = assembly.model.flexible.contact_points, []
    for k, row in enumerate(assembly.model.flexible.cylinders):
        if np.any(contacts["force"][row["first"] : row["last"]] > 0.0):
            found.append(repr(owner(assembly, "cylinders", k)))
    for i in np.flatnonzero(assembly.model.flexible.body_contacts["force"] > 0.0):
        found.append(repr(owner(assembly, "body_contacts", int(i))))
    found = list(dict.fromkeys(found))
    return " and ".join(found[:3]) + (" and others" if len(found) > 3 else "")
