"""The families of parts, and which solver supports which.

One row a family. A solver asks the table by `check`: it runs a model only where every record of it belongs to families
that it supports, so that a family which the table does not name is refused, never left out in silence.

A family's force, energy, tangent, momentum and bound of the explicit step stand in one file of `evolvent.kernels`, or
in a few: `rigid`, `points`, `springs`, `joint` (with `gaps`, `joint_tangent`, and `constraint_rows` of explicit
methods), `gear`, `coordinate` (with `coordinate_laws`, `joint_friction`, `drivetrain`, `resistance`, `bearing`,
`coordinate_tangent`; both with `axial`, `axial_tangent`), `custom` (user-defined laws between points), `ancf_beams`
(with `beam_strains`), `rod` (with `tape`), `reduced`, `beam_loads` (with `node_loads`, `node_load_tangents`),
`thermal`, `contact` (with `contact_laws`, `contact_tangent` and `surfaces`), `loads`, `fields`, `attitude` (wheels,
thrusters, controllers; with `attitude_tangent`), and for threads the package `thread`. `evolvent.flow` calls them,
family by family.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.base.errors import InputError
from evolvent.kernels import (
    axial,
    body_gaps,
    contact_laws,
    fields,
    joint,
    loads,
    node_loads,
    resistance,
    rigid,
    springs,
    thread,
)
from evolvent.kernels.beam_loads import FIELD
from evolvent.kernels.drive import FREE
from evolvent.model import Model

Array = np.ndarray

EXPLICIT, IMPLICIT, ENERGY, STATIC, MODES = "explicit", "implicit", "energy", "static", "modes"
#: Solvers, and what messages call them.
SOLVERS = {
    EXPLICIT: "rk4, heun and dopri5",
    IMPLICIT: "generalized-alpha",
    ENERGY: "energy-momentum",
    STATIC: "equilibrium",
    MODES: "modes",
}
EVERY = frozenset(SOLVERS)
#: In place of a law: a table that a loop of feedback writes while it runs (`evolvent.analysis.feedback`).
OPEN = -1
#: Most parts that a refusal names.
MOST_NAMED = 5
#: Families of records that belong to others: what they hold is supported where those are.
PARTS_OF_OTHERS = (
    "info", "blocks", "markers", "nodes", "rows", "row_sides", "row_pairs", "elements", "beam_nodes", "contact_points",
    "field_points", "rod_elements", "gear_coordinates", "modes", "curves", "bristles",
    "tapes", "tape_nodes",
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Family:
    """A family of parts.

    Attributes
    ----------
    name : str, as messages call one of it
    records : str, its field in the model
    solvers : frozenset of str, those that support it
    advice : str, what to use instead
    which : function of the records to a mask of those that belong to the family; None for all
    symmetric : whether its stiffness is symmetric: for all records, or a function of the model and the records
    """

    name: str
    records: str
    solvers: frozenset[str]
    advice: str = ""
    which: Callable[[Array], Array] | None = None
    symmetric: bool | Callable[[Model, Array], bool] = False

    def mask(self, model: Model) -> Array:
        """Which records of the model belong to the family: (n,) bool."""
        found = records(model, self.records)
        if self.which is None:
            return np.ones(found.size, dtype=bool)
        return np.asarray(self.which(found), dtype=bool)

    def is_symmetric(self, model: Model) -> bool:
        """Whether the stiffness of all its records in the model is symmetric."""
        mask = self.mask(model)
        if not np.any(mask) or isinstance(self.symmetric, bool):
            return bool(self.symmetric) or not np.any(mask)
        return self.symmetric(model, records(model, self.records)[mask])


def records(model: Model, name: str) -> Array:
    """Records of a family."""
    found: Array = getattr(model, name)
    return found


def _is(field: str, value: Any) -> Callable[[Array], Array]:
    return lambda found: found[field] == value


def _keeps_direction(model: Model, found: Array) -> bool:
    """Whether no load on a thread stands in the axes of a body that may turn."""
    for load in found[(found["kind"] == loads.UNIFORM) | (found["kind"] == loads.NODE)]:
        reel = model.threads["body"][load["target"]]
        if model.parameters[load["first"] + loads.FRAME] != 0.0 and model.bodies["motion"][reel] != rigid.DRIVEN:
            return False
    return not np.any(found["kind"] == loads.RADIATION)


def _is_potential(model: Model, found: Array) -> bool:
    """Whether no torque acts on a free body, and no force that turns with it."""
    for load in found:
        marker = model.markers[load["target"]]
        on_free = marker["kind"] == springs.ON_BODY and model.bodies["motion"][marker["index"]] == rigid.FREE
        if on_free and (load["kind"] == loads.TORQUE or model.parameters[load["first"] + loads.FRAME] != 0.0):
            return False
    return True


def _slides_freely(_: Model, found: Array) -> bool:
    return not np.any(found["friction"] > 0.0)


def _is_reciprocal(_: Model, found: Array) -> bool:
    return bool(np.all(found["symmetric"] != 0.0))


def _is_in_no_field(_: Model, found: Array) -> bool:
    return not np.any(found["kind"] == FIELD)


_NOT_ENERGY = EVERY - {ENERGY}
#: Kinds of threads with segments of fixed length.
_FIXED = (thread.INEXTENSIBLE, thread.JOINED)

FAMILIES = (
    Family(
        "a driven body", "bodies", EVERY, which=lambda found: (found["motion"] == rigid.DRIVEN) & (found["path"] == 0),
        symmetric=True,
    ),
    Family(
        "a body driven along a line", "bodies", EVERY,
        which=lambda found: (found["motion"] == rigid.DRIVEN) & (found["path"] != 0),
        symmetric=True,
    ),
    Family("a body that spins about an axis", "bodies", EVERY, which=_is("motion", rigid.SPIN), symmetric=True),
    Family("a free body", "bodies", EVERY, which=_is("motion", rigid.FREE), symmetric=True),
    Family("a point mass", "points", EVERY, which=lambda found: found["mass"] > 0.0, symmetric=True),
    Family("a beam's node at a spring's end", "points", EVERY, which=_is("mass", 0.0), symmetric=True),
    Family("a spring", "springs", EVERY, symmetric=True),
    Family("a link", "links", EVERY, symmetric=True),
    Family("a guide", "guides", EVERY, symmetric=True),
    Family(
        "a thread on a spool under feedback", "threads", frozenset(),
        "`System.simulate` and `Stepper` close its loop, by rk4, heun or dopri5; `System.loop_modes` has its modes",
        which=lambda t: t["law"] == OPEN,
    ),
    Family(
        "a thread with segments of springs", "threads", EVERY,
        which=lambda t: (t["kind"] == thread.SPRINGS) & _is_turned(t) & (t["slack"] == 0),
        symmetric=True,
    ),
    Family(
        "a thread that goes slack", "threads", EVERY,
        which=lambda t: (t["kind"] == thread.SPRINGS) & _is_turned(t) & (t["slack"] != 0),
        symmetric=True,
    ),
    Family(
        "a thread with segments of fixed length", "threads", EVERY,
        which=lambda t: np.isin(t["kind"], _FIXED) & _is_turned(t),
        symmetric=True,
    ),
    Family(
        "a thread on a moving mesh", "threads", _NOT_ENERGY,
        "use generalized-alpha: no discrete gradient of the energy is at hand for a mesh whose masses change with the "
        "length that is out",
        which=lambda t: (t["kind"] == thread.MOVING) & _is_turned(t),
        symmetric=True,
    ),
    Family(
        "a thread on a moving mesh and a free spool", "threads", _NOT_ENERGY - {STATIC, MODES},
        "use generalized-alpha; for an equilibrium or modes a drive that prescribes the spool's angle",
        which=lambda t: (t["kind"] == thread.MOVING) & (t["drive"] == FREE),
        symmetric=True,
    ),
    Family(
        "a thread on a free spool", "threads", EVERY - {STATIC, MODES},
        "use a drive that prescribes the spool's angle: the number of nodes that are out follows from it",
        which=lambda t: (t["kind"] == thread.SPRINGS) & (t["drive"] == FREE),
        symmetric=True,
    ),
    Family(
        "a thread with segments of fixed length on a free spool", "threads", EVERY - {STATIC, MODES},
        "for an equilibrium or modes a drive that prescribes the spool's "
        "angle, from which the number of nodes that are out follows",
        which=lambda t: np.isin(t["kind"], _FIXED) & (t["drive"] == FREE),
        symmetric=True,
    ),
    Family(
        "a load on a thread", "loads", EVERY,
        which=lambda found: (found["kind"] < loads.AT_MARKER) & (found["kind"] != loads.NODE),
        symmetric=_keeps_direction,
    ),
    Family("a force on a node of a thread", "loads", EVERY, which=_is("kind", loads.NODE), symmetric=_keeps_direction),
    Family(
        "a force or torque", "loads", EVERY,
        which=lambda found: _at_markers(found) & ~_has_profile(found, loads.PROFILE) & (found["law"] == 0),
        symmetric=_is_potential,
    ),
    Family(
        "a force or torque by a profile", "loads", EVERY,
        which=lambda found: _at_markers(found) & _has_profile(found, loads.PROFILE) & (found["law"] == 0),
        symmetric=_is_potential,
    ),
    Family("radiation pressure on a panel", "loads", EVERY, which=_is("kind", loads.PANEL)),
    Family("a force or torque by a law", "loads", EVERY, which=lambda found: _at_markers(found) & (found["law"] != 0)),
    Family("an orbital frame", "fields", EVERY, which=_is("kind", fields.ORBIT), symmetric=True),
    Family("an acceleration field", "fields", EVERY, which=_is("kind", fields.LAW)),
    Family("a reaction wheel", "wheels", EVERY, symmetric=True),
    Family("a thruster", "thrusters", EVERY),
    Family("an attitude controller", "controllers", EVERY),
    # equilibria and modes are those of the state before any event
    Family("an event that stops a run", "events", EVERY, which=lambda found: found["stops"] != 0, symmetric=True),
    Family("an event", "events", EVERY, which=_is("stops", 0), symmetric=True),
    Family("a beam", "beams", EVERY, which=_is("paper", 0), symmetric=True),
    Family(
        "a beam with the paper's damping", "beams", _NOT_ENERGY, "use `damping` 'objective', or generalized-alpha",
        which=_is("paper", 1),
        symmetric=True,
    ),
    Family(
        "a load on a beam", "beam_loads", EVERY,
        which=lambda found: ~_has_profile(found, 0) & ~follows(found), symmetric=_is_in_no_field,
    ),
    Family(
        "a load on a beam by a profile", "beam_loads", EVERY,
        which=lambda found: _has_profile(found, 0) & ~follows(found),
        symmetric=_is_in_no_field,
    ),
    Family(
        "a moment or follower force on a beam", "beam_loads", EVERY,
        which=lambda found: follows(found) & (found["law"] == 0),
    ),
    Family("a load on a beam by a law", "beam_loads", EVERY, which=lambda found: found["law"] != 0),
    Family("a thermal load on a beam", "thermal_loads", EVERY, which=lambda found: found["beam"] >= 0, symmetric=True),
    Family("a thermal load on a rod", "thermal_loads", EVERY, which=lambda found: found["rod"] >= 0, symmetric=True),
    Family(
        "a joint by a penalty", "joints", EVERY,
        which=lambda found: (found["stiffness"] > 0.0) & ~_is_gear(found), symmetric=True,
    ),
    Family(
        "a gear by a penalty", "joints", EVERY,
        which=lambda found: (found["stiffness"] > 0.0) & _is_gear(found), symmetric=True,
    ),
    Family(
        "a gear that is a constraint", "joints", EVERY,
        which=lambda found: (found["stiffness"] == 0.0) & _is_gear(found),
        symmetric=True,
    ),
    Family(
        "a joint driven along a path", "joints", EVERY,
        which=lambda found: (found["stiffness"] == 0.0) & _is_driven(found) & (found["nodes"] == 0),
        symmetric=True,
    ),
    Family(
        "a joint driven along a path on a beam's node", "joints", EVERY,
        which=lambda found: (found["stiffness"] == 0.0) & _is_driven(found) & (found["nodes"] == 1),
        symmetric=True,
    ),
    Family(
        "a joint that is a constraint", "joints", EVERY,
        which=lambda found: (found["stiffness"] == 0.0) & ~_is_driven(found) & ~_is_gear(found) & (found["nodes"] == 0),
        symmetric=True,
    ),
    Family(
        "a joint that is a constraint on a beam's node", "joints", EVERY,
        which=lambda found: (found["stiffness"] == 0.0) & ~_is_driven(found) & ~_is_gear(found) & (found["nodes"] == 1),
        symmetric=True,
    ),
    Family(
        "a rotational spring", "coordinates", EVERY,
        which=lambda found: _is_angle(found) & ~np.isfinite(found["latch"]) & (found["friction"] == 0.0),
        symmetric=True,
    ),
    Family(
        "a rotational spring with a latch", "coordinates", EVERY,
        which=lambda found: _is_angle(found) & np.isfinite(found["latch"]) & (found["friction"] == 0.0),
        symmetric=True,
    ),
    Family(
        "a translational spring", "coordinates", EVERY,
        which=lambda found: ~_is_angle(found) & (found["friction"] == 0.0),
        symmetric=True,
    ),
    Family(
        "a joint coordinate with friction", "coordinates", EVERY,
        which=lambda found: found["friction"] > 0.0,
        symmetric=True,
    ),
    Family("a motor", "motors", EVERY, symmetric=True),
    Family("a motor's drivetrain", "drivetrains", EVERY, symmetric=True),
    Family("a synchronization", "synchronizations", EVERY, symmetric=True),
    Family("a harness", "resistances", EVERY, which=_is("kind", resistance.HARNESS), symmetric=True),
    Family(
        "a tape-spring hinge", "resistances", EVERY - {EXPLICIT},
        "use generalized-alpha or energy-momentum, whose steps end where it snaps",
        which=_is("kind", resistance.TAPE_SPRING),
        symmetric=True,
    ),
    Family(
        "an adhesion", "resistances", EVERY - {EXPLICIT},
        "use generalized-alpha or energy-momentum, whose steps end where it breaks",
        which=_is("kind", resistance.ADHESION),
        symmetric=True,
    ),
    Family(
        "a bearing", "bearings", EVERY - {EXPLICIT},
        "use generalized-alpha or energy-momentum, which find friction and reactions together",
    ),
    Family("a custom force", "custom_forces", EVERY, symmetric=_is_reciprocal),
    Family("a rod", "rods", EVERY, which=lambda r: (r["tape"] == 0) & (r["payout"] == 0), symmetric=True),
    Family(
        "a rod that pays out", "rods", EVERY - {ENERGY},
        "use generalized-alpha: a discrete gradient of a kinetic energy whose masses depend on the length is not "
        "implemented",
        which=lambda found: found["payout"] != 0,
        symmetric=True,
    ),
    Family("a tape-spring rod", "rods", EVERY, which=lambda found: found["tape"] > 0, symmetric=True),
    Family("a reduced body", "reduced_bodies", EVERY, symmetric=True),
    Family(
        "a contact without friction", "contact_surfaces", EVERY,
        which=lambda found: (
            (found["friction"] == 0.0) & (found["under"] < 0) & (found["law"] == contact_laws.HUNT_CROSSLEY)
        ),
        symmetric=True,
    ),
    Family(
        "a contact with friction", "contact_surfaces", EVERY,
        which=lambda found: (found["friction"] > 0.0) & (found["under"] < 0),
    ),
    Family(
        "a contact with the law conservative", "contact_surfaces", EVERY, which=lambda found: _is_conservative(found),
        symmetric=_slides_freely,
    ),
    Family(
        "a contact with the paper's law", "contact_surfaces", EVERY,
        which=_is("law", contact_laws.PAPER),
        symmetric=_slides_freely,
    ),
    Family(
        "a layer on other turns", "contact_surfaces", EVERY,
        which=lambda found: found["under"] >= 0,
        symmetric=_slides_freely,
    ),
    Family(
        "a contact between bodies without friction", "body_contacts", EVERY,
        which=lambda found: (
            (found["friction"] == 0.0) & (found["law"] == contact_laws.HUNT_CROSSLEY) & ~_is_of_box(found)
        ),
        symmetric=True,
    ),
    Family(
        "a contact between bodies with friction", "body_contacts", EVERY,
        which=lambda found: (found["friction"] > 0.0) & ~_is_of_box(found),
    ),
    Family(
        "a contact between bodies with the law conservative", "body_contacts", EVERY,
        which=lambda found: _is_conservative(found) & ~_is_of_box(found),
        symmetric=_slides_freely,
    ),
    Family(
        "a contact of a box", "body_contacts", EVERY,
        which=lambda found: _is_of_box(found),
        symmetric=_slides_freely,
    ),
)  # fmt: skip


def _is_turned(found: Array) -> Array:
    """Whether a spool's angle is known beforehand."""
    return np.asarray((found["drive"] != FREE) & (found["law"] != OPEN))


def _is_of_box(found: Array) -> Array:
    return (found["surface"] == body_gaps.BOX) | (found["surface"] == body_gaps.EDGES)


def _is_driven(found: Array) -> Array:
    return (found["path"] != joint.STILL) | (found["kind"] == joint.ANGLE)


def _is_angle(found: Array) -> Array:
    return np.asarray(found["kind"] == axial.ANGLE)


def _is_gear(found: Array) -> Array:
    return np.asarray(found["kind"] == joint.GEAR)


def _is_conservative(found: Array) -> Array:
    return np.asarray(found["law"] == contact_laws.CONSERVATIVE)


def _at_markers(found: Array) -> Array:
    return np.asarray((found["kind"] >= loads.AT_MARKER) & (found["kind"] != loads.PANEL))


def follows(found: Array) -> Array:
    """Whether loads on beams follow their beam or a law: `node_loads.follows`."""
    return np.asarray((found["kind"] == node_loads.MOMENT) | (found["frame"] != 0) | (found["law"] != 0))


def _has_profile(found: Array, others: int) -> Array:
    """Whether loads have more than `others` parameters."""
    return np.asarray(found["last"] - found["first"] > others)


def is_open(model: Model) -> bool:
    """Whether a spool reacts, by a loop of feedback that is not closed."""
    return bool(np.any(model.threads["law"] == OPEN))


def has_symmetric_stiffness(model: Model) -> bool:
    """Whether every family that the model has is one whose stiffness is symmetric."""
    return all(family.is_symmetric(model) for family in FAMILIES)


def check(assembly: Any, solver: str, called: str = "") -> None:
    """Refuse parts that a solver does not support, by name.

    Parameters
    ----------
    assembly : evolvent.assembly.assembled.Assembly
    solver : one of `SOLVERS`
    called : str, what messages call it; left out, as `SOLVERS` does

    Raises
    ------
    InputError
        Naming the parts that are not supported, what to use instead, and a solver that supports them all.
    """
    supported = set() if assembly.shared is None else assembly.shared.setdefault("supported", set())
    if solver in supported:
        return
    found = list(_unsupported(assembly, solver))
    if not found:
        supported.add(solver)
        return
    called = called or SOLVERS[solver]
    what = "does" if solver in (IMPLICIT, ENERGY, STATIC) else "do"
    refused = f"which {called} {what} not support"
    named: dict[str, list[str]] = {}
    for who, name, _ in found:
        named.setdefault(who, []).append(name)
    if len(found) == 1:
        who, name, advice = found[0]
        raise InputError(f"{who!r} is {name}, {refused}{advice}")
    alike: dict[str, list[str]] = {}
    for who, names in list(named.items())[:MOST_NAMED]:
        alike.setdefault(" and ".join(names), []).append(repr(who))
    several = ", ".join(f"{', '.join(parts)} ({kind})" for kind, parts in alike.items())
    more = f" and {len(named) - MOST_NAMED} more" if len(named) > MOST_NAMED else ""
    others = (EXPLICIT, ENERGY, IMPLICIT) if solver in (EXPLICIT, ENERGY, IMPLICIT) else ()
    whole = [SOLVERS[other] for other in others if other != solver and not any(_unsupported(assembly, other))]
    own = dict.fromkeys(one for _, _, one in found)
    if len(own) == 1 and found[0][2] and len(whole) != 1:
        advice = found[0][2]
    elif whole:
        able = " and ".join(whole)
        advice = f"; {able} {'support' if ' and ' in able else 'supports'} all of them"
    else:
        advice = "".join(dict.fromkeys(one for _, _, one in found[:MOST_NAMED] if one))
        advice = f"; no method supports all of them{advice}" if others else advice
    raise InputError(f"{called} {what} not support {several}{more}{advice}")


def _unsupported(assembly: Any, solver: str) -> Iterator[tuple[str, str, str]]:
    """Parts that a solver does not support: name, family and advice of each, once."""
    model = assembly.model
    seen: set[tuple[str, str]] = set()
    for name in mdl.RECORDS:
        if name in PARTS_OF_OTHERS or not records(model, name).size:
            continue
        left = np.ones(records(model, name).size, dtype=bool)
        for family in FAMILIES:
            if family.records != name:
                continue
            mask = family.mask(model)
            left &= ~mask
            for index in np.flatnonzero(mask):
                if solver not in family.solvers:
                    found = _refusal(assembly, name, int(index), family)
                    if found[:2] not in seen:
                        seen.add(found[:2])
                        yield found
        for index in np.flatnonzero(left):
            yield _refusal(assembly, name, int(index), None)


def owner(assembly: Any, family: str, index: int) -> str:
    """Name of the part that wrote a record."""
    if family == "joints":
        return assembly.joint_parts[index]
    if family == "drivetrains":
        family, index = "motors", int(assembly.model.drivetrains["motor"][index])
    if family == "body_contacts":
        index = int(assembly.model.body_contacts["first"][index])
    if family == "spools":  # rows of threads that call a motor's law
        family = "threads"
    if family == "loads":  # of which a line load on a rod has several, named by the first
        index = max((at for of, at in assembly.names.values() if of == family and at <= index), default=index)
    if family == "tapes":
        family, index = "rods", int(np.flatnonzero(assembly.model.rods["tape"] == index + 1)[0])
    if family == "bodies":
        for name in ("rods", "reduced_bodies"):  # which consist of bodies
            for k in range(records(assembly.model, name).size):
                if index in bodies_of(assembly.model, name, k):
                    return owner(assembly, name, k)
    return next((name for name, found in assembly.names.items() if found == (family, index)), family)


def bodies_of(model: Model, family: str, index: int) -> range:
    """Bodies of a part: itself, the nodes of a rod, or frame and interface nodes of a reduced body; none of others."""
    if family == "reduced_bodies":
        row = model.reduced_bodies[index]
        return range(int(row["first_body"]), int(row["first_body"] + row["nodes"]) + 1)
    if family == "rods":
        row = model.rods[index]
        return range(int(row["first_body"]), int(row["first_body"] + row["elements"]) + 1)
    return range(index, index + 1) if family == "bodies" else range(0)


def rod_arms(model: Model, index: int) -> Array:
    """Nodes of a rod as seen from its bodies' centres: (n + 1, 3), m, body axes."""
    row = model.rods[index]
    elements = model.rod_elements[int(row["first_element"]) :][: int(row["elements"])]
    return np.concatenate([elements["arm_a"], elements["arm_b"][-1:]])


def _refusal(assembly: Any, name: str, index: int, family: Family | None) -> tuple[str, str, str]:
    """Name of a part, what it is, and what to use instead."""
    what = family.name if family is not None else f"one of the {name}"
    who = owner(assembly, name, index)
    advice = f"; {family.advice}" if family is not None and family.advice else ""
    return who, what, advice
