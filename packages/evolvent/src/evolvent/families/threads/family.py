"""Threads and their nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.families.relaxation.family import set_of
from evolvent.families.threads import (
    family_forces as forces,
    family_lengths as lengths,
    family_limits as limits,
    family_motion as motion,
    family_positions as positions,
    family_releases as releases,
    family_rest as rest,
)
from evolvent.kernels import constraint_rows, loads, thread
from evolvent.kernels.blocks import POSITION, SCALAR
from evolvent.kernels.drive import FREE, LAW, OPEN
from evolvent.kernels.ends import of_markers
from evolvent.model import N_INVENTORY
from evolvent.model.family import ENERGY, EVERY, EXPLICIT, MODES, STATIC, End, Family, Kind, Records, record, where
from evolvent.model.layout import Events, Switches
from evolvent.model.questions import (
    DRIVE,
    Advice,
    Block,
    Bound,
    Coordinates,
    Coupling,
    Drives,
    Energies,
    Explicit,
    Implicit,
    Inertia,
    Law,
    LinearizedPoint,
    Moment,
    NodeEvents,
    Notes,
    Parts,
    Rows,
    Samples,
    Stability,
    State,
    Statics,
    Step,
)
from evolvent.model.shares import ELASTIC, Elastic, Rule, Shares
from evolvent_base.errors import InputError

Array = np.ndarray
_3, _6 = (3,), (6,)


#: Kinds of threads with segments of fixed length.
_FIXED = (thread.INEXTENSIBLE, thread.JOINED)
#: Kinds of threads with segments of springs.
_SPRINGS = (thread.SPRINGS, thread.MOVING)


def _is_free(found: Array) -> Array:
    """Whether a spool turns freely."""
    return np.asarray(found["drive"] == FREE)


def _is_turned(found: Array) -> Array:
    """Whether a spool's angle is known beforehand."""
    return np.asarray((found["drive"] != FREE) & (found["law"] != OPEN))


def _relaxes(found: Array) -> Array:
    """Whether a thread is viscoelastic."""
    return np.asarray(found["prony_end"] > found["prony"])


def _is_of_springs(found: Array) -> Array:
    """Whether a thread has elastic springs and nodes that are fixed to the material."""
    return np.asarray((found["kind"] == thread.SPRINGS) & ~_relaxes(found))


def _sets(model: Any, index: int) -> Iterator[tuple[str, float, str]]:
    row, count = model.threads[index], int(model.switches[index])
    nodes = model.nodes[int(row["node"]) :][:count]
    terms = {"prony": row["prony"], "prony_end": row["prony_end"]}
    found = np.array([set_of(model, terms | {"branch": node["branch"]})[0] for node in nodes])
    if found.size:
        yield "largest strain", float(found[np.abs(found).argmax()] / row["segment"]), "1"


def _has_no_stiffness(found: Array) -> str:
    if np.any(found["kind"] != thread.INEXTENSIBLE):
        return ""
    return "threads with segments of fixed length have no stiffness: adaptive steps of fifth order"


def _of_thread(row: Any, records: Records) -> Iterator[End]:
    """But for its nodes."""
    yield "bodies", int(row["body"])
    if row["end"] >= 0:
        yield from of_markers([row["end"]], records)


def _coupled(row: Any, records: Records) -> Iterator[list[End]]:
    """Each node with the body and a free spool, since the departure moves from node to node; the end with the next."""
    spool = [("vectors", int(row["spool_v"]))] if row["drive"] == FREE else []
    reel = [("bodies", int(row["body"])), *spool]
    for i in range(row["n"]):
        yield [("vectors", int(row["iv"]) + 3 * i), *reel]
    if row["end"] >= 0:
        (end,) = of_markers([row["end"]], records)
        yield [end, *reel]
        if row["n"] > 1:
            yield [end, ("vectors", int(row["iv"]) + 3)]


def _unforced(model: Any) -> dict[str, Array]:
    found = model.threads.copy()
    found["stiffness"] = found["damping"] = 0.0
    return {"threads": found}


def _stiff(whole: Any, bare: Any, index: int) -> dict[str, Array]:
    found = bare.threads.copy()
    found["stiffness"][index] = whole.threads["stiffness"][index]
    return {"threads": found}


def _pushing(model: Any) -> dict[str, Array]:
    found = model.threads.copy()
    found["slack"] = 0
    return {"threads": found} if np.any(model.threads["slack"]) else {}


def _refused(row: Any, part: Any, spins: bool) -> str:
    if row["drive"] == FREE:
        return "leaves a free spool, which stands at no length of its own"
    return "stands for several threads" if row["copies"] != 1 else ""


def _at_spool(model: Any, k: int, moment: Moment, _: bool) -> Iterator[tuple[Any, ...]]:
    row, (time, y, _s) = model.threads[k], moment
    yield float(y[row["spool_q"]]), float(y[row["spool_v"]]), time


def _is_by_law(drive: str, law: str) -> Callable[[Array], Array]:
    return lambda found: np.asarray((found[law] != 0) & (found[drive] == LAW))


def _nodes_of_threads(records: Records, _: Mapping[str, Any]) -> Iterator[Block]:
    """The first node of a thread that ends on another part is fixed to that."""
    for p, row in enumerate(records("threads")):
        for i, mass in enumerate(records("nodes")["mass"][row["node"] :][: row["n"]]):
            switch = p if i > 0 or row["end"] < 0 else -2
            yield Block(POSITION, row["iq"] + 3 * i, row["iv"] + 3 * i, p, mass, i, switch)


def _spools(records: Records, _: Mapping[str, Any]) -> Iterator[Block]:
    for p, row in enumerate(records("threads")):
        if row["spool_q"] >= 0:
            yield Block(SCALAR, row["spool_q"], row["spool_v"], p, row["spool_inertia"], -1)


def _bound(model: Any, _: Array, felt: Mapping[str, Array]) -> Iterator[Bound]:
    for p in range(model.threads.size):
        for square, rate in thread.add_thread_bound(model, p, felt["bodies"], felt["points"]):
            yield p, square, rate


def _sizes(model: Any, length: float) -> Iterator[tuple[Any, Any]]:
    for row in model.threads[model.threads["drive"] == FREE]:
        yield int(row["spool_v"]), length / row["radius"]


def _released_nodes(
    assembly: Any, name: str, index: int, where: slice, y: Array
) -> Iterator[tuple[str, LinearizedPoint]]:
    """Nodes that move by coordinates of their own, by number; the first is the tip."""
    row, found = assembly.model.threads[index], {}
    for i in range(int(row["end"] >= 0), int(assembly.s[index])):
        at, first = where.start + 3 * i, int(row["iq"]) + 3 * i
        found[i] = LinearizedPoint(y[first : first + 3].copy(), slice(at, at + 3), np.eye(3), None)
    yield from ((f"{name}[{i}]", point) for i, point in found.items())
    if 0 in found:
        yield f"{name}.tip", found[0]


def _rows(found: Array, _: Records) -> Iterator[tuple[int, list[End]]]:
    for p in np.flatnonzero(found["kind"] == thread.INEXTENSIBLE).tolist():
        yield p, [("bodies", int(found["body"][p]))]


def _is_braked(found: Array) -> Array:
    """Whether friction can hold a spool."""
    return np.asarray(found["spool_friction"] > 0.0)


def _senses(found: Array, builder: Any) -> Array:
    """Senses in which the spools with friction turn at the start."""
    return np.sign(np.array(builder.v)[found["spool_v"][_is_braked(found)] - len(builder.q)])


def _tip(builder: Any, at: Any) -> Any:
    """The end of a thread."""
    if at.on == "tip":
        return builder.specs[at.name].tip_location(builder, at.name, at.where, at.key)
    raise InputError(
        f"{at.key} is {at.where!r}; {at.name!r} is a Thread, not a body, point or beam; its end is "
        f"{at.name + '.tip'!r}; a mass at its end is its key `tip_mass`, a point it is fixed to its key `end`"
    )


def _is_off(axis: Array, vector: Any) -> bool:
    """Whether a vector has a part across an axis."""
    return bool(np.linalg.norm(np.cross(axis, vector)) > 1e-9 * np.linalg.norm(vector))


def _check_copies(builder: Any) -> None:
    """Refuse loads that differ from copy to copy of a thread that stands for several."""
    names = {found: name for name, found in builder.names.items()}
    for p, row in enumerate(builder.rows["threads"]):
        if row["copies"] == 1:
            continue
        body = builder.rows["bodies"][row["body"]]
        axis = body["R0"] @ body["axis"]
        differ = ["gravity"] if _is_off(axis, builder.gravity) else []
        for k, load in enumerate(builder.rows["loads"]):
            if load["kind"] >= loads.AT_MARKER or load["target"] != p:
                continue
            values = np.array(builder.values[load["first"] : load["last"]])
            if load["kind"] == loads.NODE:
                off = load["law"] != 0 or _is_off(body["axis"] if values[3] != 0.0 else axis, values[:3])
            elif load["kind"] == loads.UNIFORM:
                off = _is_off(body["axis"] if values[3] != 0.0 else axis, values[:3])
            else:
                off = load["kind"] == loads.LAW or _is_off(axis, values[:3])
            differ += [names["loads", k]] if off else []
        if differ:
            raise InputError(
                f"{names['threads', p]!r} stands for {row['copies']} copies, but {differ[0]!r} is not the same for "
                "all of them; add a thread for each"
            )


def _directions(model: Any) -> Array:
    own = [row["iq"] + 3 * np.arange(row["n"]) for row in model.threads if row["kind"] == thread.INEXTENSIBLE]
    return np.concatenate([*own, np.zeros(0, dtype=np.int64)])


def _flows(model: Any) -> Array:
    own = [row["iv"] + np.arange(3 * row["n"]) for row in model.threads if row["take_drive"] >= 0]
    return np.concatenate([*own, np.zeros(0, dtype=np.int64)])


def _paid_out(model: Any, rate: Callable[[Any], float]) -> float:
    found = 0.0
    for row in model.threads[model.threads["drive"] != FREE]:
        total = model.nodes["mass"][row["node"] : row["node"] + row["n"]].sum()
        found += 0.5 * row["copies"] * total * (row["radius"] * rate(row)) ** 2
    return float(found)


# shortest: m, of the segment at the spool whose stiffness follows its length (`kernels.thread.boundary`), 0 where
# it does not; line_energy: J/m, W there; tip: the point mass that the first node is, or -1. Of a step: rest lengths
# at the spool, rates of the spool and squares of the end's speed at both ends; sums: of `kernels.thread.energy`;
# density, tip_mass, root, drift, pull, exit, take_* (take_drive -1 without a take-up reel), growth (1/s), taken,
# out_pull, exit_field, end_field: of a mesh that moves (`kernels.thread.moving`); element: m, rest length of a
# segment off the spool
THREADS = Family(
    "threads",
    record(
        "kind iq iv n node copies body drive first last law spool_q spool_v turned carried separates end slack coupled "
        "spool_switch motor_profile motor_law motor_first motor_last tip take_drive take_first take_last take_law "
        "prony prony_end",
        "segment stiffness damping departure payout_axis chord normal radius spool_inertia spool_torque capture "
        "coiling core spool_friction spool_viscous shortest density tip_mass take_radius",
        "Q d X phi b spool leaving start field r loose motor friction line_energy rest0 rest1 turning0 turning1 "
        "square0 square1 sums turning reach out hub torque hub_pull end_pull kinetic elastic linear angular "
        "root drift pull exit element growth taken out_pull exit_field end_field extremes",
        extremes=(2,),
        departure=_3, payout_axis=_3, chord=_3, normal=_3, Q=_6, d=_3, X=_3, b=_3, start=_3,
        sums=(N_INVENTORY,), hub_pull=_3, end_pull=_3, linear=_3, angular=_3, root=(10,), drift=_3, exit=_3,
        taken=_3, exit_field=_3, end_field=_3,
    ),
    order=350,
    results={
        "phi": ("angle", "rad", "angle of the spool, positive pays out"),
        "turning": ("rate", "rad s-1", "rate of the spool"),
        "torque": ("torque", "N m", "torque of the thread's tension on the spool"),
        "reach": ("radius", "m", "radius at which the tape leaves the spool"),
        "motor": ("motor_torque", "N m", "torque of the motor on the spool, positive pays out"),
        "friction": ("friction_torque", "N m", "torque of friction and brake on the spool"),
        "out": ("deployed_length", "m", "length of thread paid out"),
        "hub": ("hub_tension", "N", "tension at the spool"),
        "hub_pull": ("hub_force", "N", "pull of the thread where it leaves the spool, inertial axes"),
        "end_pull": ("end_force", "N", "force on the end part, inertial axes"),
        "Q": ("hub_position", "m", "where the thread leaves the spool, inertial axes"),
        "kinetic": (
            "energy_kinetic",
            "J",
            "kinetic energy of the released thread, of wound thread that is carried and of a free spool{copies}",
        ),
        "elastic": ("energy_elastic", "J", "elastic energy of the segments{copies}"),
        "linear": (
            "momentum",
            "kg m s-1",
            "linear momentum of released thread, and of wound thread that is carried{copies}, inertial axes",
        ),
        "angular": (
            "angular_momentum",
            "kg m2 s-1",
            "angular momentum about the inertial origin of released thread, and of wound thread that is carried"
            "{copies}",
        ),
    },
    kinds=(
        Kind(
            "a thread on a spool under feedback", frozenset(),
            "`System.simulate` and `Stepper` close its loop, by rk4, heun or dopri5; `System.loop_modes` has its modes",
            which=lambda t: t["law"] == OPEN,
        ),
        Kind(
            "a thread with segments of springs",
            which=lambda t: _is_of_springs(t) & _is_turned(t) & (t["slack"] == 0),
            symmetric=True,
        ),
        Kind(
            "a thread that goes slack",
            which=lambda t: _is_of_springs(t) & _is_turned(t) & (t["slack"] != 0),
            symmetric=True,
        ),
        Kind("a viscoelastic thread", which=lambda t: _relaxes(t) & _is_turned(t), symmetric=True),
        Kind(
            "a viscoelastic thread on a free spool", frozenset({EXPLICIT}),
            "use rk4 or heun, or a drive that prescribes the spool's angle",
            which=lambda t: _relaxes(t) & (t["drive"] == FREE),
        ),
        Kind(
            "a thread with segments of fixed length",
            which=lambda t: np.isin(t["kind"], _FIXED) & _is_turned(t),
            symmetric=True,
        ),
        Kind(
            "a thread on a moving mesh", EVERY - {ENERGY},
            "use generalized-alpha: no discrete gradient of the energy is at hand for a mesh whose masses change with "
            "the length that is out",
            which=lambda t: (t["kind"] == thread.MOVING) & _is_turned(t),
            symmetric=True,
        ),
        Kind(
            "a thread on a moving mesh and a free spool", EVERY - {ENERGY} - {STATIC, MODES},
            "use generalized-alpha; for an equilibrium or modes a drive that prescribes the spool's angle",
            which=lambda t: (t["kind"] == thread.MOVING) & (t["drive"] == FREE),
            symmetric=True,
        ),
        Kind(
            "a thread on a free spool", EVERY - {STATIC, MODES},
            "use a drive that prescribes the spool's angle: the number of nodes that are out follows from it",
            which=lambda t: _is_of_springs(t) & (t["drive"] == FREE),
            symmetric=True,
        ),
        Kind(
            "a thread with segments of fixed length on a free spool", EVERY - {STATIC, MODES},
            "for an equilibrium or modes a drive that prescribes the spool's "
            "angle, from which the number of nodes that are out follows",
            which=lambda t: np.isin(t["kind"], _FIXED) & (t["drive"] == FREE),
            symmetric=True,
        ),
    ),
    ends=_of_thread,
    isolated=False,
    concerned={
        "node_events.project": where("kind", thread.INEXTENSIBLE),
        "inertia.kick": lambda found: np.isin(found["kind"], (thread.INEXTENSIBLE, thread.MOVING)),
        "node_events.longest_step": lambda found: found["slack"] != 0,
        "node_events.until": _is_free,
        "node_events.is_due": _is_free,
    },
    force=forces.force,
    tangent=forces.tangent,
    energy=forces.energy,
    switches=(
        Switches(2, lambda found, builder: [*builder.released, *np.zeros(found.size, dtype=int)], field="", order=0),
        Switches(_is_braked, _senses, field="spool_switch", order=np.inf),
    ),
    events=(
        Events(lambda found: 2 * found.size, lambda _, k: (k // 2, "taken up" if k % 2 else "released"), order=0),
        Events(
            lambda found: int(np.sum(_is_braked(found))),
            lambda found, k: (int(np.flatnonzero(_is_braked(found))[k]), "sticks or slips"),
            order=np.inf,
        ),
    ),
    rows=Rows(_rows, constraint_rows.THREAD),
    laws=(
        Law(DRIVE, _is_by_law("drive", "law")),
        Law(DRIVE, _is_by_law("take_drive", "take_law"), field="take_law", before="take_"),
        Law("spring", lambda found: found["motor_law"] != 0, _at_spool, field="motor_law", before="motor_"),
    ),
    offsets=("iv", "spool_v"),
    shares=Shares(
        (Rule(ELASTIC),), place=12, unforced=_unforced, elastic=Elastic(_stiff, alone=True, pushing=_pushing),
        refused=_refused,
    ),
    parts=Parts(
        totals={
            "brakes": lambda found: int(np.sum(_is_braked(found))),
            "releases": lambda found: 2 * found.size,
            "abrupt": lambda found: int(np.sum((found["slack"] != 0) | (found["drive"] == FREE))),
        },
        place=_tip,
        check=_check_copies,
    ),
    coupling=Coupling(couples=_coupled),
    state=State(
        unknowns=(
            Coordinates(_nodes_of_threads, 20, lambda found: 3 * int(np.sum(found["n"]))),
            Coordinates(_spools, 30, lambda found: 0),
        ),
        sizes=_sizes,
        extents=lambda found: found["n"] * found["segment"],
        points=_released_nodes,
        positions=positions.with_positions,
        multipliers=positions.evaluate_tensions,
        directions=_directions,
        nodal=lambda row: (int(row["n"]), 3),
        flows=_flows,
    ),
    inertia=Inertia(turning_tangent=forces.turning_tangent, turning=forces.turning, lock=motion.lock, kick=motion.kick),
    explicit=Explicit(force=forces.explicit_force, energy=False, carried=forces.explicit_carried, sums=forces.add_sums),
    stability=Stability(
        by_rates=False, bound=_bound,
        waves=lambda found: 0.25 if np.any(found["kind"] == thread.INEXTENSIBLE) else 1.0,
    ),
    implicit=Implicit(taut=lambda found: np.isin(found["kind"], _SPRINGS), end_step=forces.end_step),
    step=Step(force=forces.step_force, tangent=forces.step_tangent, measure=forces.measure),
    node_events=NodeEvents(
        values=motion.change_values, apply=motion.apply_change, longest_step=motion.longest_step,
        until=motion.until_change, is_due=motion.is_due, project=motion.project, between_steps=releases.Releases,
        captures=limits.captures,
    ),
    drives=Drives(
        paid_out=_paid_out, check=lengths.check_lengths, stops=releases.release_times, freeze=rest.freeze,
        place=rest.place_nodes, hold=positions.hold_segments,
    ),
    statics=Statics(unsteady=limits.unsteady, sets=_sets),
    energies=Energies(round_off=limits.lifted),
    samples=Samples(
        prepare=forces.prepare_sample, rates=forces.evaluate_rates, evaluate=forces.evaluate,
        interpolate=motion.interpolate, between=motion.between, extremes=("hub",), note_extremes=forces.note_extremes,
    ),
    advice=Advice(
        adaptive=_has_no_stiffness,
        short_steps=lambda t: "threads of springs are stiff" if np.any(np.isin(t["kind"], _SPRINGS)) else "",
    ),
    notes=Notes(tensions=limits.tensions),
)  # fmt: skip

# branch: first branch of the segment inwards, of a viscoelastic thread; mass, its inverse, and the length of thread
# whose loads the node carries; lost: W, what relaxation of the segment takes under explicit methods; of a step
# lengths and elongations at both ends, direction at its end
NODES = Family(
    "nodes",
    record(
        "branch", "mass compliance span",
        "x v af tension piv off rhs lost length along length0 length1 extension0 extension1 end",
        x=_3, v=_3, af=_3, end=_3,
    ),
    order=360,
    results={
        "x": ("position", "m", "positions of the nodes from the tip, wound ones on their spool, inertial axes"),
        "v": ("velocity", "m s-1", "velocities of the nodes, inertial axes"),
        "tension": ("tension", "N", "tension of the segment inwards of each node, NaN while it is wound"),
    },
    of="threads",
    parts=Parts(scratch=lambda records, _: {"strands": np.zeros((records("nodes").size + 1, 9))}),
)  # fmt: skip
