"""Rods."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.elements.thermal import refuse_unheated
from evolvent.families.bodies.family import node_point
from evolvent.families.relaxation.family import LineSet, set_of
from evolvent.families.rods import family_limits as rod_limits, rod, rod_payout, rod_strains, rod_tangent
from evolvent.families.rods.rod import evaluate_rods
from evolvent.kernels import calls, free_strains
from evolvent.kernels.blocks import SCALAR
from evolvent.kernels.drive import LAW
from evolvent.model.family import ENERGY, EVERY, EXPLICIT, End, Family, Kind, Records, record
from evolvent.model.powers import DRIVEN, MARKER_LOADS, MASS_DAMPING, STIFFNESS_DAMPING
from evolvent.model.questions import (
    BETWEEN,
    DRIVE,
    AdjointSupport,
    Advice,
    Block,
    Coordinates,
    Drives,
    Energies,
    Explicit,
    Implicit,
    Law,
    LinearizedPoint,
    Notes,
    Parts,
    Samples,
    Stability,
    State,
    Statics,
    Step,
    TouchPoint,
    along,
    never,
    skew,
)
from evolvent.model.shares import ELASTIC, Elastic, Rule, Shares, Strained
from evolvent_base.errors import InputError

Array = np.ndarray
#: Strain of a rod that is round-off: it is the difference of positions beside the length of an element.
_ROUND_OFF = 1e-10
_3, _33, _6, _66 = (3,), (3, 3), (6,), (6, 6)


def _nodes(row: Any) -> range:
    """Its bodies."""
    return range(int(row["first_body"]), int(row["first_body"] + row["elements"]) + 1)


def _of_rod_element(row: Any, records: Records) -> Iterator[End]:
    yield from (("bodies", int(row[key])) for key in ("a", "b"))
    if row["tape"] > 0:
        first = int(row["tape_node"])
        yield from (("vectors", int(iv)) for iv in records("tape_nodes")["iv"][first : first + 2])


@calls.kinematics
def kinematics(t, y, model):
    """Lengths and masses of rods that pay out."""
    for k in range(model.rods.size):
        if model.rods[k].payout != 0:
            rod_payout.spread(t, k, model)


@calls.force
def force(interval, model):
    """Forces of all rods, and what drives those that pay out."""
    step, powers = interval.step, interval.powers
    lost, viscous, heat = rod.add_rods(step.h, step.chi, step.ratio, model)
    powers[MASS_DAMPING] += lost
    powers[STIFFNESS_DAMPING] += viscous
    powers[MARKER_LOADS] += heat
    for k in range(model.rods.size):
        if model.rods[k].payout != 0:
            driven, by_weight = rod_payout.drive_rod(interval.dv, model.info.nq, k, model)
            rod_payout.set_weight(step.factor, k, model, model.P)
            powers[DRIVEN] += driven
            powers[MARKER_LOADS] += by_weight


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    step = interval.step
    rod_tangent.add_rod_tangents(step.h, step.c_rate, step.chi, step.ratio, model, matrix)


@calls.measure
def measure(end, t, y, model):
    """Strains of all rods."""
    rod_strains.measure_rods(end, model)


@calls.energy
def energy(interval, model, out):
    """Energies of all rods; that of motion is what flows, the rest is the bodies'."""
    rod.evaluate_rods(model, out)
    rod_payout.sum_flows(model)
    out[0] += model.sums[1, 0]


@calls.momentum
def momentum(y, model, out):
    """Momenta of what flows."""
    rod_payout.sum_flows(model)
    for i in range(6):
        out[i] += model.sums[1, 1 + i]


@calls.force
def explicit_force(interval, model):
    """Forces of all rods."""
    powers = interval.powers
    lost, viscous, heat = rod.add_rods_of_state(model)
    powers[MASS_DAMPING] += lost
    powers[STIFFNESS_DAMPING] += viscous
    powers[MARKER_LOADS] += heat


@calls.force
def explicit_end(interval, model):
    """Powers of what drives rods that pay out, by the accelerations."""
    for k in range(model.rods.size):
        if model.rods[k].payout != 0:
            driven, by_weight = rod_payout.drive_rod(interval.rates, 0, k, model)
            interval.powers[DRIVEN] += driven
            interval.powers[MARKER_LOADS] += by_weight


@calls.force
def end_step(interval, model):
    """What relaxation of all rods takes over a step."""
    interval.powers[STIFFNESS_DAMPING] += rod.relaxed_rods(interval.step.h, model)


@calls.force
def evaluate(interval, model):
    """Strains, forces, energies, momenta and nodes of all rods, with their free strains."""
    step = interval.step
    if model.thermal_loads.size > 0:
        free_strains.heat_rods(step.t, step.t, step.factor, model)
    rod.evaluate_rods(model, model.sums[1])
    rod.evaluate_sums(interval.ym, model)
    rod.evaluate_nodes(model)


def _stiff(whole: Any, bare: Any, index: int) -> dict[str, Array]:
    return {name: getattr(whole, name) for name in ("rods", "rod_elements", "thermal_loads")}


def _strains(elements: Any) -> Array:
    return np.asarray(elements["m1"][:, rod_strains.STRAIN : rod_strains.STRAIN + 6])


def _shift_strains(elements: Any, own: Any, added: Array) -> None:
    elements["rest"] = own["rest"] - added


def _transverse(records: Records, _: Mapping[str, Any]) -> Iterator[Block]:
    """Curvatures of sections that flatten."""
    for k, row in enumerate(records("rods")):
        if row["tape"] > 0:
            tape = records("tapes")[row["tape"] - 1]
            for i, node in enumerate(records("tape_nodes")[tape["first_node"] :][: tape["nodes"]]):
                yield Block(SCALAR, node["iq"], node["iv"], k, node["mass"], i)


def _sizes(model: Any, _: float) -> Iterator[tuple[Any, Any]]:
    """Of curvatures of a section that flattens: that without stress."""
    for tape in model.tapes:
        yield model.tape_nodes["iv"][tape["first_node"] :][: tape["nodes"]], tape["transverse"]


def _bending(model: Any, _: Array) -> float:
    found = np.zeros(3)
    evaluate_rods(model, found)
    return float(found[2])


def arms(model: Any, index: int) -> Array:
    """Nodes of a rod as seen from its bodies' centres: (n + 1, 3), m, body axes."""
    row = model.rods[index]
    elements = model.rod_elements[int(row["first_element"]) :][: int(row["elements"])]
    return np.concatenate([elements["arm_a"], elements["arm_b"][-1:]])


def _points(assembly: Any, name: str, index: int, where: slice, y: Array) -> Iterator[tuple[str, LinearizedPoint]]:
    """Nodes: bodies, whose centres are off the rod's ends."""
    model, found = assembly.model, []
    for arm, b in zip(arms(model, index), _nodes(model.rods[index]), strict=True):
        place = node_point(model, b, y)
        assert place.rotation is not None
        R = place.rotation[:, 3:]
        displacement = np.hstack([np.eye(3), -skew(R @ arm) @ R])
        found.append(place._replace(position=place.position + R @ arm, displacement=displacement))
    yield from along(name, found)


def _touches(builder: Any, name: str) -> Iterator[TouchPoint]:
    """Nodes but the root."""
    for i in range(1, builder.rows["rods"][builder.names[name][1]]["elements"] + 1):
        at = builder.location(f"{name}[{i}]")
        yield TouchPoint(at.row, at.local)


def _heat(builder: Any, name: str, load: Any, called: str) -> dict[str, int]:
    """Free strains of the elements at a temperature of 1 K: of the mean of the factor over each."""
    rod, index = builder.specs[name], builder.names[name][1]
    if rod.payout is not None:
        raise InputError(
            f"{called}.part is {name!r}, a rod with `payout`, on which thermal loads are not supported; leave one of "
            f"them out"
        )
    if rod.couples_twist:
        raise InputError(
            f"{called}.part is {name!r}, a rod whose tension resists twist; a thermal load needs one with "
            f"{name}.tension_twist false"
        )
    refuse_unheated(load, rod, name, called)
    builder.parameters(rod.material.thermal_expansion * load.means(rod.arc / rod.length))
    first = builder.rows["rods"][index]["first_element"]
    for row in builder.rows["rod_elements"][first : first + rod.elements]:
        row["heated"] = 1
    return {"rod": index}


def _place(builder: Any, at: Any) -> Any:
    """A node of a rod, which is a body."""
    row = builder.rows["rods"][at.row]
    number = at.number(row["elements"], "rod")
    last = number == row["elements"]
    if row["payout"] and not last and number > 0:
        raise InputError(
            f"{at.key} is {at.where!r}, a node of a mesh through which material flows ({at.name}.payout); give "
            f"'{at.name}.root' or '{at.name}.tip'"
        )
    element = builder.rows["rod_elements"][row["first_element"] + number - last]
    return builder.on_body(row["first_body"] + number, element["arm_b" if last else "arm_a"])


def _paid_out(model: Any, rate: Callable[[Any], float]) -> float:
    paid = model.rods[model.rods["payout"] != 0]
    return float(sum(0.5 * row["density"] * row["length"] * rate(row) ** 2 for row in paid))


def _stretched(model: Any) -> float:
    own = model.rod_elements
    return 0.5 * _ROUND_OFF**2 * float(np.sum(own["length"] * own["stiffness"][:, 0, 0]))


@calls.note_part
def note_part(theta, t, h, model):
    """Lengths that are out at a sample, beside those at the ends of its step."""
    for r in range(model.rods.size):
        if model.rods[r].payout != 0:
            rod_payout.note_lengths(theta, t, h, model)
            return


@calls.interpolate
def interpolate(theta, y0, y1, model, y):
    """Chords of elements lie on straight lines."""
    rod_strains.keep_chords(theta, y0, y1, model, y)


def _set(model: Any, index: int) -> LineSet:
    """What a rod keeps, in the middle of each element."""
    row = model.rods[index]
    elements = model.rod_elements[int(row["first_element"]) :][: int(row["elements"])]
    found = np.array([set_of(model, element, 6) for element in elements])
    curvatures = {words: found[:, k] for k, words in ((5, "curvature about z"), (4, "curvature about y"), (3, "twist"))}
    return LineSet(elements["length"], curvatures, found[:, 0])


def _sets(model: Any, index: int) -> Iterator[tuple[str, float, str]]:
    return _set(model, index).largest()


def _sets_along(model: Any, index: int) -> Iterator[tuple[str, Array, Array, str]]:
    return _set(model, index).along()


def _by_rates(model: Any) -> bool:
    """Whether forces of rods follow from rates, beside the inertia of their nodes."""
    rods = model.rods
    return bool(np.any(rods["alpha"]) or np.any(rods["payout"]) or np.any(model.rod_elements["beta"]))


# geometrically exact rods: their nodes are the bodies from first_body on; alpha: damping by mass; relaxes: 1 of a
# viscoelastic one; tape: 1 + tape of which the section flattens, or 0; payout: 1 where the length that is out follows a
# drive (`rod_payout`): density and gyration, mass and inertia per length; out, rate, acceleration: of the
# length; grown0, grown1: of a sample, ratios of its length to those at the ends of its step
RODS = Family(
    "rods",
    record(
        "first_element elements first_body first_node tape payout relaxes drive law first last",
        "length alpha density gyration",
        "kinetic linear angular out rate acceleration drive_force grown0 grown1",
        linear=_3, angular=_3, gyration=_33,
    ),
    order=90,
    results={
        "kinetic": ("energy_kinetic", "J", "kinetic energy"),
        "linear": ("momentum", "kg m s-1", "linear momentum, inertial axes"),
        "angular": ("angular_momentum", "kg m2 s-1", "angular momentum about the inertial origin"),
        "out": ("deployed_length", "m", "length without stress that is out"),
        "rate": ("payout_rate", "m s-1", "rate of the length that is out"),
    },
    kinds=(
        Kind("a rod", which=lambda r: (r["tape"] == 0) & (r["payout"] == 0) & (r["relaxes"] == 0), symmetric=True),
        Kind(
            "a viscoelastic rod", EVERY - {EXPLICIT},
            "use generalized-alpha or energy-momentum: rods have far shorter periods than relaxation times",
            which=lambda found: found["relaxes"] != 0,
            symmetric=True,
        ),
        Kind(
            "a rod that pays out", EVERY - {ENERGY},
            "use generalized-alpha: a discrete gradient of a kinetic energy whose masses depend on the length is not "
            "implemented",
            which=lambda found: found["payout"] != 0,
            symmetric=True,
        ),
        Kind("a tape-spring rod", which=lambda r: (r["tape"] > 0) & (r["relaxes"] == 0), symmetric=True),
    ),
    isolated=lambda found, _: not np.any(found["payout"] != 0) and not np.any(found["alpha"] != 0.0),
    force=force,
    tangent=tangent,
    energy=energy,
    momentum=momentum,
    laws=(Law(DRIVE, lambda found: (found["payout"] != 0) & (found["law"] != 0) & (found["drive"] == LAW)),),
    shares=Shares((Rule(ELASTIC),), place=11,
        elastic=Elastic(_stiff, strained=Strained("rod_elements", _strains, _shift_strains)),
    ),
    smooth=lambda found: found["payout"] == 0,
    of_step=False,
    adjoint=AdjointSupport(
        "its strains follow from the state, with all derivatives", filtered="strains of rods",
        timed=lambda found: found["payout"] != 0, rates=_by_rates,
        smooth=lambda found: found["payout"] == 0,
        refused={"rods have a section that is a tape": lambda found: found["tape"] > 0},
    ),
    parts=Parts(
        consists=lambda row, _: _nodes(row), place=_place, touches=_touches, heat=_heat,
        totals={"slender": lambda found: found.size}, scratch=lambda *_: {"rod": np.zeros(rod_strains.WORK)},
        changes="", reads_inertia=False,
    ),
    state=State(
        unknowns=(Coordinates(_transverse, 80, lambda found: 0),), sizes=_sizes, points=_points,
        nodal=lambda row: (int(row["elements"]) + 1, 6), axes=lambda model: map(_nodes, model.rods),
        kinematics=kinematics,
    ),
    explicit=Explicit(force=explicit_force, end=explicit_end),
    stability=Stability(waves=lambda _: 1.0),
    implicit=Implicit(end_step=end_step),
    step=Step(measure=measure),
    drives=Drives(
        paid_out=_paid_out, check=rod_limits.check_lengths, freeze=rod_limits.freeze, place=rod_limits.lengthen,
    ),
    statics=Statics(uneven=never, sets=_sets, sets_along=_sets_along),
    energies=Energies(bending=_bending, by_causes=True, round_off=_stretched),
    samples=Samples(evaluate=evaluate, kept={"drive_force": BETWEEN}, note_part=note_part, interpolate=interpolate),
    advice=Advice(conserved="rods"),
    notes=Notes(hint=rod_limits.bending_hint, limits=rod_limits.beyond_tension),
)  # fmt: skip


@calls.note
def note_step(model):
    """Changes of the strains of all elements."""
    rod_strains.note_strains(model.rod_elements)


# an element between bodies a and b, whose axes are those of its sections; arms: from the bodies' centres to its
# ends, body axes; stiffness: of strains of force and moment; rest: (Gamma_0, K_0), see `rod_strains`;
# section: compliance of the section in its middle; fibres: E A times the means of rho^2 and rho^4, N m2, N m4, see
# `strip`, or 0; diagonal: 1 where the stiffness is; heated: 1 with a thermal load, whose free strains are `free`.
# m0, m1: measures at the start and the end of an interval; before: change of the strains over the step before;
# stored, bent: J, elastic energy and that of moments; the others are in `RESULTS`. tape: as of rods, and tape_node
# its first node; flattening, flattening_slope: forces by `tape.evaluate_tape`, with derivatives; curvature_rate: of
# a state, before_product: changes of curvature times coordinates over the step before. flows: 1 of a rod that pays
# out, with the whole strains, their rates, stresses times length of the flow, and pull (`rod_payout.pull_of`)
ROD_ELEMENTS = Family(
    "rod_elements",
    record(
        "a b heated diagonal tape tape_node flows prony prony_end branch flat_branch",
        "length beta arm_a arm_b stiffness rest section fibres",
        "free m0 m1 before stored bent energy_density strain shear_strain_y shear_strain_z twist curvature_y "
        "curvature_z axial_force shear_force_y shear_force_z torsional_moment bending_moment_y bending_moment_z "
        "flattening flattening_slope curvature_rate before_product whole rates flow pull",
        whole=_6, rates=_6, flow=_6,
        flattening=_3, flattening_slope=_33, before_product=(2,), fibres=(2,),
        arm_a=_3, arm_b=_3, stiffness=_66, rest=_6, section=_66, free=_6, m0=(15,), m1=(15,), before=_6,
    ),
    order=100,
    results={
        "strain": ("strain", "1", "strain of the axis"),
        "shear_strain_y": ("shear_strain_y", "1", "shear strain along y"),
        "shear_strain_z": ("shear_strain_z", "1", "shear strain along z"),
        "twist": ("twist", "m-1", "change of twist per length"),
        "curvature_y": ("curvature_y", "m-1", "change of curvature about y"),
        "curvature_z": ("curvature_z", "m-1", "change of curvature about z"),
        "axial_force": ("axial_force", "N", "force along x, positive in tension"),
        "shear_force_y": ("shear_force_y", "N", "shear force along y in the section's axes"),
        "shear_force_z": ("shear_force_z", "N", "shear force along z in the section's axes"),
        "torsional_moment": ("torsional_moment", "N m", "moment about x in the section's axes"),
        "bending_moment_y": ("bending_moment_y", "N m", "moment about y in the section's axes"),
        "bending_moment_z": ("bending_moment_z", "N m", "moment about z in the section's axes"),
        "energy_density": ("energy_density", "J m-1", "strain energy per length"),
        "free": ("free_strains", "1", "strains and curvatures without stress"),
        "stored": ("energy_elastic", "J", "strain energy"),
        "bent": ("energy_bending", "J", "strain energy of bending and torsion"),
    },
    of="rods",
    ends=_of_rod_element,
    parts=Parts(changes="stiffness section fibres"),
    step=Step(note=note_step),
)  # fmt: skip
