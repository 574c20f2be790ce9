"""Events by which the number of moving nodes changes between steps of an implicit method."""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.equations.events import apply_event, event_values
from evolvent.equations.implicit import residual
from evolvent.equations.rhs import rhs
from evolvent.model.powers import DRIVEN, SPOOLS
from evolvent.model.questions import Equations
from evolvent.model.registry import asked
from evolvent.solvers.common.balance import columns, dissipated, energy, extend, lost, potential, worked
from evolvent.solvers.time.implicit.balance import fill_energies
from evolvent.solvers.time.implicit.samples import begin_next
from evolvent.solvers.time.implicit.workspace import Workspace


def releases_of(assembly: Assembly) -> list[Any]:
    """What carries out such events, of every family of the model that has some (`NodeEvents.between_steps`)."""
    equations = Equations(event_values, apply_event, rhs, needs.load)
    own = asked("node_events.between_steps").items()
    return [make(assembly, equations) for name, make in own if getattr(assembly.model, name).size]


def resume(releases: Any, model: mdl.Model, work: Workspace) -> int:
    """Events at the loop's time: state, accelerations, energies and balance; returns what `fire` returns.

    Notes
    -----
    A node that begins to move goes on as its neighbour does: what its spring would do to it at once is far shorter than
    a step. So are the powers of what drives it, which the balance takes the mean of over the step: they go on as well.
    What an event brings in or takes away is `released` in the balance.
    """
    t, before, powers = float(work.loop.time), model.switches.copy(), work.powers[0].copy()
    count = int(releases.fire(t, work.y))
    if count < 0:
        return count
    kept = (work.step.before, work.rate, work.acceleration) if work.options.midpoint else (work.a1, work.dv1)
    _go_on(model, before, work.y, kept)
    if count > 0 and releases.begins_again:
        releases.begin_again(work)
    if not work.options.midpoint:  # whose powers and loads are those of whole steps
        residual(t, work.y, work.dv1, work.la, 0.0, 1.0, model, work.r, work.powers[0])
        if count > 0 and releases.keeps_powers(before):
            for k in (SPOOLS, DRIVEN):
                work.powers[0, k] = powers[k]
        work.loads1[:] = model.P
    model.wheels["motor0"], model.wheels["drag0"] = model.wheels["motor"], model.wheels["drag"]
    model.thrusters["push0"] = model.thrusters["push"]
    had = energy(work.balance)
    fill_energies(t, model, work)
    work.balance.released += energy(work.balance) - had
    balance = work.balance
    extend(work.loop, balance.kinetic, potential(balance), worked(balance), lost(balance))
    work.loop.factored = 0.0
    begin_next(model, work)
    return count


def _go_on(model: mdl.Model, before: np.ndarray, y: np.ndarray, kept: tuple[np.ndarray, ...]) -> None:
    """Values of nodes that begin to move are those of their neighbours, of nodes that stop zero."""
    for block in model.blocks[model.blocks["switch"] >= 0]:
        was, now, node = int(before[block["switch"]]), int(model.switches[block["switch"]]), int(block["node"])
        at, n = int(block["iv"] - model.info.nq), int(block["count"])
        for values in kept if was <= node < now else ():
            values[at : at + n] = values[at - n : at] if node > 0 else 0.0
        if now <= node < was:
            for values in kept:
                values[at : at + n] = 0.0
            y[int(block["iv"]) :][:n] = 0.0


def write_accounts(model: mdl.Model, y: np.ndarray, balance: Any) -> None:
    """Write what an energy balance holds into the accounts of states (nt, ny), where explicit methods have it."""
    accounts, of = y[:, int(model.info.nq + model.info.nv) :], columns(balance)
    accounts[:, mdl.DISSIPATED], accounts[:, mdl.SPOOL] = dissipated(of), of.spools
    accounts[:, mdl.LOAD], accounts[:, mdl.DRIVE] = of.loads, of.drives
