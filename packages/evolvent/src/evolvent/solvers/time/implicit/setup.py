"""What an implicit or static run is set up with: room for the tangent, sizes of the unknowns, options, workspace."""

from __future__ import annotations

import contextlib
import functools
import math

import numpy as np

from evolvent import model as mdl
from evolvent.algebra import ordering
from evolvent.algebra.sparse import SparseBlocks
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.blocks import owners
from evolvent.assembly.checks import redundant_part
from evolvent.assembly.families import row_owner
from evolvent.compiled.pointer import zeros_record
from evolvent.equations.implicit import measure_constraints
from evolvent.kernels.blocks import ANGLE, MOVES, POSITION, SCALAR, indices
from evolvent.kernels.drive import drive
from evolvent.model.family import EXPLICIT, SOLVERS
from evolvent.model.interval import NUMBERS, Interval
from evolvent.model.powers import N_POWERS
from evolvent.model.registry import along_axes, asked, families, forget_steps
from evolvent.solvers.common import graph
from evolvent.solvers.common.balance import BALANCE, LEAST_ENERGY, RESOLVED
from evolvent.solvers.common.laws import largest_works
from evolvent.solvers.common.sampled import empty
from evolvent.solvers.time import event_search
from evolvent.solvers.time.implicit import reactions
from evolvent.solvers.time.implicit.workspace import LOOP, Workspace
from evolvent_base.errors import InputError

#: Redundant rows of joints that can be named.
MOST_REDUNDANT = 64
#: Share of energies of the system's size that is round-off.
ROUND_OFF = 1e-9
#: Part of the elements' `form_energy` that is round-off of their strain energy.
STRAIN_ROUND_OFF = 1e-14
#: Part of the energies and works that a run handles which is round-off.
WORK_ROUND_OFF = 1e-14
#: Times at which the rates of drives are evaluated.
SOUGHT = 101
#: Sizes of a system from which the origin of the ground says nothing of it.
GROUND_IS_FAR = 100.0
#: Share of the distance from the origin below which steps cannot be measured, for the round-off of positions.
KNOWN_TO = 1e-4
#: What a joint may be off at the start, beside the size of the system and its speed.
_FITS = 1e-6


def matrix_of(model: mdl.Model, *, spare: int | None = None, layers: bool = False) -> SparseBlocks:
    """Room for the tangent of a model, and for `spare` deferred pivots; by default what redundant joints may need.

    Turns that lie on one another are inner unknowns; those that do so at present are coupled directly if `layers`. So
    is what a torque spread over a beam couples.
    """
    inner = sum(own(getattr(model, name)) for name, own in asked("inner").items())
    if spare is None:
        spare = min(model.constraints.size, MOST_REDUNDANT)
    return ordering.matrix_of(graph.pattern_of(model, layers=layers), spare=spare, inner=inner)


def matrix_for(assembly: Assembly) -> SparseBlocks:
    """`matrix_of` the model of an assembly; variants of a system share the order of its blocks."""
    shared = assembly.shared
    if shared is None or assembly.model.info.releases:
        return matrix_of(assembly.model)
    if "matrix" not in shared:
        shared["matrix"] = matrix_of(assembly.model)
    found: SparseBlocks = shared["matrix"].copy()
    return found


def sizes(assembly: Assembly) -> tuple[np.ndarray, float]:
    """What counts as 1 of each velocity's coordinate (m, or 1 for slopes and turns), and a typical mass (kg).

    Of a wheel that is the angle which turns its body by 1 rad.
    """
    model, blocks, n_q = assembly.model, assembly.model.blocks, int(assembly.model.info.nq)
    weight = np.ones(int(model.info.nv))
    positions, inertia = blocks["kind"] == POSITION, blocks["inertia"][:, 0]
    placed = assembly.y[indices(blocks[positions & (blocks["switch"] == MOVES)], "iq")]
    own = asked("extents").items()
    lengths = [(one, 0.0, 0.0) for name, extents in own for one in extents(getattr(model, name))]
    length = _extent(np.concatenate([model.bodies["x"], placed, np.reshape(lengths, (-1, 3))]))
    weight[indices(blocks[positions], "iv") - n_q] = length
    for sizes_of in asked("sizes").values():
        for velocities, size in sizes_of(model, length):
            weight[velocities - n_q] = size
    # the first node of a beam has the mass of half an element; a point mass has that of a thread's end on it
    first = _first_masses()[blocks["family"]]
    typical = (positions & ((first == 0.0) | (blocks["node"] == 0)) | (blocks["kind"] == ANGLE)) & (inertia > 0.0)
    masses = np.where(first > 0.0, first, 1.0)[typical] * inertia[typical]
    return weight, float(np.exp(np.mean(np.log(masses)))) if masses.size else 1.0


@functools.cache
def _first_masses() -> np.ndarray:
    """What the first coordinate of an owner has of the typical mass, by the codes of owners: (n,)."""
    return np.array([max(one.first for one in families()[name].unknowns) for name in owners()])


def _extent(places: np.ndarray) -> float:
    """Size of a system by the places of its bodies, of which the first is the ground: without it where it is far, m."""
    together, own = (float(np.linalg.norm(np.ptp(found, axis=0))) for found in (places, places[1:]))
    own = own or 1.0
    return (together or 1.0) if together <= GROUND_IS_FAR * own else max(own, KNOWN_TO * together)


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


def length_of(model: mdl.Model, weight: np.ndarray) -> float:
    """Largest size of the unknowns (m, or 1 for slopes and turns) but for wheels and free spools."""
    kept = np.ones(weight.size, dtype=bool)
    kept[model.blocks["iv"][model.blocks["kind"] == SCALAR] - int(model.info.nq)] = False
    return float(weight[kept].max(initial=0.0))


def form_energy(model: mdl.Model) -> float:
    """Energies of which the strain energies of elements are differences, J (`Family.strained`)."""
    return sum(strained(model) for strained in asked("strained").values())


def strain_round_off(model: mdl.Model) -> float:
    """Energy of which the part `balance.RESOLVED` is the round-off of the elements' strain energies, J."""
    return STRAIN_ROUND_OFF / RESOLVED * form_energy(model)


def round_off_energy(assembly: Assembly, time: float) -> float:
    """Round-off of the energies and works that a run from `time` handles, J: of weights lifted and of laws' forces."""
    weight, mass = sizes(assembly)
    return WORK_ROUND_OFF * (_lifted(assembly.model, mass, weight) + largest_works(assembly, time))


def _lifted(model: mdl.Model, mass: float, weight: np.ndarray) -> float:
    """Work of weights that are lifted by the system's size, J."""
    return mass * weight.size * float(np.linalg.norm(model.info["gravity"])) * length_of(model, weight)


def paid_out_energy(assembly: Assembly, start: float, end: float) -> float:
    """Kinetic energy of rods and threads that drives pay out, at their largest rates in a run, J.

    The scale of the energy of a run that begins at rest, before it has moved any.
    """
    model, times = assembly.model, np.linspace(start, end, SOUGHT)
    return sum(paid_out(model, lambda row: _fastest(model, row, times)) for paid_out in asked("paid_out").values())


def _fastest(model: mdl.Model, row: np.void, times: np.ndarray) -> float:
    """Largest rate of the drive of a row at some times; where a user's law has none the run fails when it is there."""
    own, fastest = model.parameters[row["first"] : row["last"]], 0.0
    for t in times:
        with contextlib.suppress(Exception):
            fastest = max(fastest, abs(drive(int(row["drive"]), own, int(row["law"]), float(t))[1]))
    return fastest


def energy_floor(assembly: Assembly, mass: float, weight: np.ndarray) -> float:
    """Energy beside which a gain is round-off, J.

    That of weights lifted by the system's size, of forms of elements, and what families state (`Family.round_off`).
    """
    model = assembly.model
    own = sum(round_off(model) for round_off in asked("round_off").values())
    return ROUND_OFF * (_lifted(model, mass, weight) + form_energy(model)) + own + LEAST_ENERGY


def check_start(assembly: Assembly, t: float) -> None:
    """Refuse constraints that the start does not meet, by name: positions or velocities that contradict them."""
    model, y = assembly.model, assembly.y.copy()
    rows = model.constraints
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    length = max(1.0, float(np.abs(y[:n_q]).max(initial=0.0)))
    speed = max(1.0, float(np.abs(y[n_q : n_q + n_v]).max(initial=0.0)))
    needs.load(model, measure_constraints)
    measure_constraints(t, y, model)
    held = (rows["stiffness"] == 0.0) & (t <= rows["until"])
    off = ~(np.abs(rows["gap"]) <= _FITS * length) | ~(np.abs(rows["rate"]) <= _FITS * speed)
    for k in np.flatnonzero(held & off).tolist():
        gap, rate = float(rows["gap"][k]), float(rows["rate"][k])
        unit = "" if rows["turns"][k] else " m"
        if not abs(gap) <= _FITS * length:
            raise InputError(
                f"{row_owner(assembly, k)!r} does not fit the start at t = {t:g} s: it is {gap:.6g}{unit} off; "
                f"move the parts that it joins, or its drive"
            )
        if not abs(rate) <= _FITS * speed:
            raise InputError(
                f"{row_owner(assembly, k)!r} does not fit the velocities at the start: its two points separate "
                f"at {rate:.6g}{unit}/s; give velocities that keep it"
            )


def acts_from_outside(model: mdl.Model, t: float = -math.inf) -> bool:
    """Whether something joins, pushes or pulls on the system from outside at t, beside gravity and loads."""
    if model.info.outside:
        return True
    rows = model.constraints
    if np.any((rows["outside"] != 0) & (t <= rows["until"])):
        return True
    for family in families().values():
        names, found = family.record.names or (), family.records(model)
        if "outside" in names:
            acts = found["outside"] != 0
            if np.any(acts & (t <= found["until"]) if "until" in names else acts):
                return True
    return False


def check_redundancy(assembly: Assembly, t: float) -> None:
    """Refuse joints that others imply at the start t, by name, which explicit methods do not support."""
    if assembly.model.rows.size and (redundant := redundant_part(assembly, t)):
        raise InputError(
            f"{redundant!r} is redundant: the other constraints already imply it, which {SOLVERS[EXPLICIT]} do not "
            "support; use energy-momentum or generalized-alpha"
        )


def stops_of(assembly: Assembly, times: np.ndarray) -> np.ndarray:
    """Times between the first and the last sample on which steps land, (n,) float, s: loads or joints change there."""
    model = assembly.model
    own = [stops_of(model, times[0], times[-1]) for stops_of in asked("stops").values()]
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
