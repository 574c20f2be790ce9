"""What an implicit run is set up with: its workspace, and what counts in the error of its steps."""

from __future__ import annotations

import contextlib

import numpy as np

from evolvent import model as mdl
from evolvent.assembly.assembled import Assembly
from evolvent.compiled.pointer import zeros_record
from evolvent.kernels.blocks import indices
from evolvent.kernels.drive import drive
from evolvent.model.interval import NUMBERS, Interval
from evolvent.model.powers import N_POWERS
from evolvent.model.registry import along_axes, asked, forget_steps
from evolvent.solvers.common.balance import BALANCE
from evolvent.solvers.common.sampled import empty
from evolvent.solvers.common.start import acts_from_outside
from evolvent.solvers.time import event_search
from evolvent.solvers.time.implicit import reactions
from evolvent.solvers.time.implicit.workspace import LOOP, Workspace

#: Times at which the rates of drives are evaluated.
SOUGHT = 101


def error_sizes(model: mdl.Model, weight: np.ndarray, *, conserves: bool) -> np.ndarray:
    """What counts as 1 in the error of a step: `weight`, and without limit turns of rods' sections across their axes.

    Those follow the slope of the axis but for shear, whose waves are far faster than bending and carry next to no
    energy: after a sudden load they would rule the steps of a thin rod. The slope is held by the positions of nodes.
    That is so of a method that `conserves` the energy of what it does not resolve; others may gain from it.
    """
    found = weight.copy()
    if conserves:
        found[_section_turns(model)] = np.inf
    return found


def _section_turns(model: mdl.Model) -> np.ndarray:
    """Indices of turns about axes across a part of its nodes; of one with one element nothing but these may move."""
    nodes = [model.bodies["iv"][own] for own in along_axes(model) if own.size > 2]
    first = np.concatenate([*nodes, np.zeros(0, dtype=np.int64)]) - int(model.info.nq)
    return np.concatenate([first + 4, first + 5])  # the first axis is that of the part


def shares(model: mdl.Model, weight: np.ndarray, *, conserves: bool) -> np.ndarray:
    """Share of each rate in the mean square of the rates: (nv,) float, 1/m2 or 1, 0 of what has no inertia.

    The rates beside `weight` are averaged by their inertias, the diagonal of the mass matrix, as in the kinetic energy.
    Turns of rods' sections across their axes are left out, as in `error_sizes`.
    """
    inertia, own = np.zeros(weight.size), np.arange(3) < model.blocks["count"][:, None]
    inertia[indices(model.blocks, "iv")[own] - int(model.info.nq)] = model.blocks["inertia"][own]
    if conserves:
        inertia[_section_turns(model)] = 0.0
    total = float(inertia @ weight**2)
    return inertia / total if total > 0.0 else inertia


def paid_out_energy(assembly: Assembly, start: float, end: float) -> float:
    """Kinetic energy of rods and threads that drives pay out, at their largest rates in a run, J.

    The scale of the energy of a run that begins at rest, before it has moved any.
    """
    model, times = assembly.model, np.linspace(start, end, SOUGHT)
    return sum(
        paid_out(model, lambda row: _fastest(model, row, times)) for paid_out in asked("drives.paid_out").values()
    )


def _fastest(model: mdl.Model, row: np.void, times: np.ndarray) -> float:
    """Largest rate of the drive of a row at some times; where a user's law has none the run fails when it is there."""
    own, fastest = model.parameters[row["first"] : row["last"]], 0.0
    for t in times:
        with contextlib.suppress(Exception):
            fastest = max(fastest, abs(drive(int(row["drive"]), own, int(row["law"]), float(t))[1]))
    return fastest


def stops_of(assembly: Assembly, times: np.ndarray) -> np.ndarray:
    """Times between the first and the last sample on which steps land, (n,) float, s: loads or joints change there."""
    model = assembly.model
    own = [stops_of(model, times[0], times[-1]) for stops_of in asked("drives.stops").values()]
    stops = np.unique(np.concatenate([*own, model.breaks]))
    return stops[(stops > times[0]) & (stops < times[-1])]


def _most_logged(model: mdl.Model) -> int:
    """Most latches and events that a run notes the times of."""
    return int(model.info.ne)


def workspace(assembly: Assembly, times: np.ndarray, weight: np.ndarray, options: np.record) -> Workspace:
    """The loop's workspace at the start of a run; the model's history is cleared.

    Parameters
    ----------
    times : (nt,) float, s, of the samples
    weight : (nv,) float, size of each unknown that counts as 1
    options : record `workspace.OPTIONS`
    """
    model, midpoint = assembly.model, bool(options.midpoint)
    n_v, n_j, n_b, n_t = int(model.info.nv), model.constraints.size, model.bodies.size, times.size
    model.switches[:] = assembly.s
    forget_steps(model)
    out, evaluated = empty(model, n_t), n_t if reactions.applies(model, options) else 0
    balance, fields, logged = np.zeros(1, dtype=BALANCE), len(BALANCE.names or ()), _most_logged(model)
    shared = {name: assembly.y.copy() for name in ("y", "y0")} | {name: np.zeros((n_b, 3)) for name in ("x0", "x1")}
    shared |= {name: np.zeros((n_b, 3, 3)) for name in ("R0", "R1")}
    shared |= {"dq": np.zeros(n_v), "la": np.zeros(n_j), "r": np.zeros(n_v + n_j), "powers": np.zeros((2, N_POWERS))}
    return Workspace(
        options=options,
        loop=zeros_record(
            LOOP,
            time=times[0],
            step=options.first,
            wanted=options.first,
            last=0.0 if midpoint else options.first,
            quality=1.0,
            event_step=np.inf,
            turn_step=np.inf,
        ),
        balance=balance.view(np.recarray)[0],
        row=balance.view(np.float64),
        row0=np.zeros(fields),
        step=_energy_step(assembly, options, shared),
        **shared,
        spare=assembly.y.copy(),
        search=event_search.room(np.zeros(model.watches.size, dtype=bool)),
        **{
            name: np.zeros(n_v)
            for name in ("a1", "a0", "dv1", "dv0", "loads1", "loads0", "dq0", "rate", "acceleration")
        },
        **{name: np.zeros(n_j) for name in ("la0", "la1", "gaps")},
        x=np.zeros(n_v + n_j),
        weight=weight,
        error_weight=error_sizes(model, weight, conserves=bool(midpoint)),
        shares=shares(model, weight, conserves=bool(midpoint)),
        energies=np.zeros(3),
        booked=np.zeros(N_POWERS),
        forces=np.zeros((2, out.forces.shape[1])),
        ends=np.zeros((evaluated, 2, assembly.y.size)),
        end_times=np.zeros((evaluated, 2)),
        kept=np.full(12, np.nan),
        momenta=np.zeros(6),
        samples=times.copy(),
        stops=stops_of(assembly, times),
        log_t=np.zeros(logged),
        log_k=np.zeros(logged, dtype=np.int64),
        out_y=np.zeros((n_t, assembly.y.size)),
        out_s=np.zeros((n_t, assembly.s.size), dtype=np.int64),
        out_a=out.acceleration,
        out_la=out.la,
        out_balance=np.zeros((n_t, fields)),
        out_momenta=np.zeros((0 if model.info.releases else n_t, 6)),
        out_forces=out.forces,
        out_points=np.zeros((n_t if midpoint else 0, model.contact_points.size)),
    )


def _energy_step(assembly: Assembly, options: np.record, shared: dict[str, np.ndarray]) -> Interval:
    """Arrays of a step of energy-momentum, some of them shared with the loop."""
    model, n_v, chi = assembly.model, int(assembly.model.info.nv), float(options.chi)
    return Interval(
        s=np.zeros(0, dtype=np.int64),
        rates=np.zeros(0),
        times=np.zeros(0),
        step=zeros_record(NUMBERS, soft=1.0, held=float(chi > 0.0 and acts_from_outside(model))),
        **{name: shared[name] for name in ("y0", "dq", "la", "r", "R0", "R1", "x0", "x1")},
        y1=shared["y"],
        ym=assembly.y.copy(),
        **{name: np.zeros(n_v) for name in ("dv", "before")},
        powers=shared["powers"][0],
        contact=np.zeros(2),
    )
