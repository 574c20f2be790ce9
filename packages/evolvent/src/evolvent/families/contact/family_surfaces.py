"""Contact surfaces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.compiled.jit import inlined
from evolvent.families.contact import contact_tangent
from evolvent.kernels import calls, contact, contact_laws, surfaces, turning
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.model import IMPULSE, N_ACCOUNTS
from evolvent.model.family import End, Family, Kind, Records, has_friction, record, where
from evolvent.model.layout import Accounts
from evolvent.model.powers import CONTACTS, RUBBED
from evolvent.model.questions import (
    BETWEEN,
    NEARER,
    SUMMED,
    Contacts,
    Coupling,
    Explicit,
    Friction,
    Implicit,
    Parts,
    Samples,
    Stability,
    Statics,
    Step,
)
from evolvent.model.shares import FRICTION, NORMAL, RUBS, SPRING, Pressing, Rule, Shares

Array = np.ndarray
_3 = (3,)


def is_conservative(found: Array) -> Array:
    """Which contacts have the law conservative: (n,) bool."""
    return np.asarray(found["law"] == contact_laws.CONSERVATIVE)


#: Share of an element's length from which on one that lies on it is coupled with it.
_NEAR = 0.1


def _touches(model: Any) -> Iterator[list[End]]:
    """Nodes of elements that lie on one another."""
    for cylinder in model.contact_surfaces[is_layered(model.contact_surfaces)]:
        half = NODE_VECTORS[model.beams["kind"][cylinder["under"]]]
        for point in model.contact_points[int(cylinder["first"]) : int(cylinder["last"])]:
            if point["carrier1"] < 0 or not point["gap1"] < _NEAR * model.elements["length"][point["carrier1"]]:
                continue
            below = int(model.elements["iv"][point["carrier1"]])
            nodes = [*point["iv"][::2].tolist(), below, below + 3 * half]
            yield [("vectors", int(iv)) for iv in nodes]


def is_layered(found: Array) -> Array:
    """Which contacts are those with the layers of another beam: (n,) bool."""
    return np.asarray(found["under"] >= 0)


def slides_freely(_: Any, found: Array) -> bool:
    """Whether none of the contacts has friction."""
    return not np.any(found["friction"] > 0.0)


def kinds(what: str, other: Kind) -> tuple[Kind, ...]:
    """Kinds of contacts: by friction and law those that are not of an `other` kind, and that one."""

    def is_plain(found: Array) -> Array:
        return ~has_friction(found) & np.asarray(found["law"] == contact_laws.HUNT_CROSSLEY) & ~other.mask(found)

    return (
        Kind(f"{what} without friction", which=is_plain, symmetric=True),
        Kind(f"{what} with friction", which=lambda found: has_friction(found) & ~other.mask(found)),
        Kind(
            f"{what} with the law conservative", which=lambda found: is_conservative(found) & ~other.mask(found),
            symmetric=slides_freely,
        ),
        other,
    )  # fmt: skip


_LAYER = Kind("a layer on other turns", which=lambda found: found["under"] >= 0, symmetric=slides_freely)


@inlined
def book(interval, taken):
    """Add what normal forces and friction take: in a step J, at a state W."""
    if interval.step.h > 0.0:
        interval.contact[0] += taken[0]
        interval.contact[1] += taken[1]
    else:
        interval.powers[CONTACTS] += taken[0]


@inlined
def book_end(interval, taken):
    """Add what friction and damping took in the step that has ended, J."""
    if interval.step.share == 1.0:  # else `Interval.contact` has them
        interval.powers[RUBBED] += taken[0]
        interval.powers[CONTACTS] += taken[1]


@inlined
def add_energies(rows, out):
    """Energies by the last forces, of bristles too."""
    for k in range(rows.size):
        out[1] += rows[k].energy


@inlined
def note_pressing(found, rows, weight):
    """`found` with the rows that press, as a contact set."""
    for i in range(rows.size):
        if rows[i].force != 0.0:
            found += weight * (i * i + 1)
    return found


def _of_surface(row: Any, records: Records) -> Iterator[End]:
    """Of a layer on other turns, whose points pass from element to element, its body alone."""
    yield "bodies", int(row["body"])
    if row["under"] < 0:
        for point in records("contact_points")[int(row["first"]) : int(row["last"])]:
            yield from (("vectors", int(iv)) for iv in point["iv"])


def _coupled(row: Any, records: Records) -> Iterator[list[End]]:
    """Point by point; turns on one another are coupled where they touch (`solvers.common.graph`)."""
    if row["under"] < 0:
        for point in records("contact_points")[int(row["first"]) : int(row["last"])]:
            yield [*(("vectors", int(iv)) for iv in point["iv"]), ("bodies", int(row["body"]))]


@calls.ties
def ties(t, model):
    """Whether a contact with what is not part of the system touches."""
    found = 0
    for k in range(model.contact_surfaces.size):
        if model.contact_surfaces[k].outside != 0 and model.contact_surfaces[k].touching > 0.0:
            found = 1
    return found


@calls.force
def force(interval, model):
    """Forces of all contact points of beams; what they take in a step, J."""
    step = interval.step
    y0, y1 = interval.y0, interval.y1
    book(interval, contact.add_points(y0, y1, step.span, step.rub, step.soft, step.chi, step.ratio, model, model.F))


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    step = interval.step
    contact_tangent.add_point_tangents(
        interval.y0, interval.y1, step.h, 0.0 if step.h > 0.0 else step.c_rate, model, matrix
    )


@calls.measure
def measure(end, t, y, model):
    """Gaps of all contact points of beams."""
    surfaces.measure_points(y, end, model)


@calls.energy
def energy(interval, model, out):
    """Energy by the last forces, of bristles too."""
    add_energies(model.contact_surfaces, out)


@calls.force
def explicit_force(interval, model):
    """Forces of all contact points of beams; rates of the impulses of their normal forces."""
    force(interval, model)
    account = model.info.nq + model.info.nv + N_ACCOUNTS + IMPULSE
    for k in range(model.contact_surfaces.size):
        interval.rates[account + k] = model.contact_surfaces[k].normal


@calls.energy
def explicit_energy(interval, model, out):
    """Energy by the forces of the state, of bristles too."""
    force(interval, model)
    energy(interval, model, out)


#: Damping of bristles with which friction is at its limit at any rate, N s/m.
_SLIPS = 1e30
#: Shares of contacts.
RULES = (Rule(SPRING, NORMAL), Rule(FRICTION, RUBS, ("friction",)))


def pressing(rows: Array, rubs: bool) -> Array:
    """Records of contacts with their elastic normal force alone, or with friction that slips at any rate."""
    found = rows.copy()
    found["damping"] = found["bristle_stiffness"] = 0.0
    found["bristle_damping"] = _SLIPS
    if not rubs:
        found["friction"] = 0.0
    return found


def _is_undetermined(row: Any) -> str:
    if row["under"] < 0:
        return ""
    return "turns of a beam press on one another as they were wound, which no coordinate says"


@calls.force
def evaluate(interval, model):
    """All contact points of beams."""
    contact.evaluate_points(interval.ym, model)


@calls.force
def end_step(interval, model):
    """The end of a step as the start of the next one; what friction and damping took, and impulses."""
    step, rows = interval.step, model.contact_surfaces
    if step.again != 0.0:
        return
    book_end(interval, contact.end_points(interval.y1, model))
    for k in range(rows.size):
        rows[k].impulse += step.h * rows[k].normal


@calls.contact_set
def contact_set(found, model):
    """Which contact points press."""
    return note_pressing(found, model.contact_points, 1)


@calls.rates
def measure_rates(y, model):
    """Sliding velocities of contact points that touch."""
    turning.measure_point_slides(y, model)


@calls.note
def keep_rates(model):
    """Sliding velocities of contact points."""
    turning.keep_slides(model.contact_points)


@calls.until_turn
def until_turn(y0, y, h, model):
    """Where the friction of a contact point turns back."""
    part = turning.NO_TURN
    for k in range(model.contact_surfaces.size):
        row = model.contact_surfaces[k]
        for i in range(row.first, row.last if row.friction > 0.0 else row.first):
            part = min(part, turning.until_contact_turns(model.contact_points[i], row, h))
    return part


@calls.power
def friction_power(model):
    """Power of the frictions of contact points."""
    return -turning.contact_power(model.contact_points)


def _forget(model: Any) -> None:
    points = model.contact_points
    contact.clear_history(points)
    points["rest"], points["rest1"], points["carrier"] = 0.0, 0.0, -1
    model.contact_surfaces["impulse"] = 0.0


def _at_rest(model: Any) -> None:
    _forget(model)
    model.contact_surfaces["bristle_damping"] = 0.0


def _inner(found: Array) -> int:
    """Of turns on one another."""
    layers = found[found["under"] >= 0]
    return int(np.sum((layers["last"] - layers["first"]) * np.where(layers["friction"] > 0.0, 3, 1)))


def _presses(model: Any) -> Array:
    rows, force = model.contact_surfaces, model.contact_points["force"]
    points = [bool(np.any(force[row["first"] : row["last"]] > 0.0)) for row in rows]
    return np.asarray((rows["normal"] > 0.0) | np.array(points, dtype=bool))


def _without_stiffness(model: Any) -> None:
    model.contact_surfaces["stiffness"] = 0.0


# rigid surfaces on bodies (`kernels.surfaces`), and the points of beams that are checked against them: first, last;
# under: -1, or the beam on whose turns these lie, wound in the sense +-1 and ahead of them by the angle `shift`;
# account: index in the state of the bristle of its first point under explicit methods, three numbers a point;
# impulse: N s, which implicit methods sum up
CONTACT_SURFACES = Family(
    "contact_surfaces",
    record(
        "body law first last under surface account outside",
        "sense shift centre axis radius half_length stiffness exponent damping friction bristle_stiffness "
        "bristle_damping",
        "force moment normal impulse energy power touching",
        centre=_3, axis=_3, force=_3, moment=_3,
    ),
    order=60,
    results={
        "force": ("force", "N", "resultant of the surface on what touches it, inertial axes"),
        "moment": (
            "moment",
            "N m",
            "moment of the surface on what touches it about the origin of the surface's body, inertial axes",
        ),
        "normal": ("normal_force", "N", "sum of the normal forces"),
        "impulse": ("impulse", "N s", "integral of the normal forces since the start"),
        "touching": ("points", "1", "contact points that touch"),
        "energy": ("energy_elastic", "J", "elastic energy of the contact and of what sticks by friction"),
    },
    kinds=(
        *kinds("a contact", _LAYER),
        Kind("a contact with the paper's law", which=where("law", contact_laws.PAPER), symmetric=slides_freely),
    ),
    ends=_of_surface,
    isolated=True,
    force=force,
    tangent=tangent,
    energy=energy,
    accounts=(
        Accounts(1, field="", order=0),  # impulse of the normal forces
        Accounts(lambda found: np.where(found["friction"] > 0.0, 3 * (found["last"] - found["first"]), 0), order=9),
    ),
    shares=Shares(RULES, place=8, contact=Pressing(pressing, _is_undetermined)),
    smooth=lambda found: found["under"] < 0,
    parts=Parts(reads_inertia=False),
    coupling=Coupling(at_times=True, couples=_coupled, ties=ties, touches=_touches, layered=is_layered),
    friction=Friction(
        rubs=has_friction, measure_rates=measure_rates, keep_rates=keep_rates,
        until_turn=until_turn, power=friction_power,
    ),
    contacts=Contacts(
        presses=_presses, jumps=lambda found: (found["law"] == contact_laws.PAPER) & (found["damping"] > 0.0),
    ),
    explicit=Explicit(force=explicit_force, energy=explicit_energy),
    stability=Stability(by_rates=False, stiffest=_without_stiffness),
    implicit=Implicit(end_step=end_step, contact_set=contact_set, forget=_forget, inner=_inner),
    step=Step(measure=measure),
    statics=Statics(at_rest=_at_rest, settle=lambda model, y: contact.end_points(y, model)),
    samples=Samples(
        evaluate=evaluate,
        kept=dict.fromkeys(("force", "moment", "normal", "energy"), BETWEEN) | {"touching": NEARER, "impulse": SUMMED},
    ),
)  # fmt: skip


@calls.note
def keep_friction(model):
    """Frictions of all contact points by their last forces."""
    points = model.contact_points
    for i in range(points.size):
        f, n, lam, drag = points[i].f, points[i].n, points[i].force, points[i].rubbing
        for j in range(3):
            drag[j] = f[j] - lam * n[j] if lam > 0.0 else 0.0


def _any_rubs(records: Records) -> bool:
    """Whether a contact point of beams has friction."""
    return bool(np.any(has_friction(records("contact_surfaces"))))


# a contact point is S . (four vectors of its element). Of the step's start: gap (m), distance `offset` from the
# axis and place `xi` on it (m), point `anchor` in body axes (m), bristle `stick` (m) and friction `drag` (N) in the
# bristle's axes, part `damper` of the normal force (N); of its end: those with 1, `distance`, position x (m) and
# normal n1. Of the interval: normal force (N) with derivatives d_gap and d_rate, n: its direction, f: whole force
# (N), and t, along, across, by_normal of `contact_laws.friction`, tilt: part of the bristle's stretch along
# the normal, by which friction turns with it (m). Of turns: element and point below, carrier and
# xi, normals n0 and n1 at both ends, how far `offset` off along the axis the start was; `anchor` is what it moved
# by against what is below. rest: depth that a point keeps (`surfaces.measure_points`); sank: change of the gap over
# the step before, of the filter of `contact_laws.press`; viscous: of `contact_laws.sliding_damper`;
# rubbing: of f the friction; slid0, slid1: sliding velocity at both ends of a step, in the bristle's axes
CONTACT_POINTS = Family(
    "contact_points",
    record(
        "element iq iv carrier carrier1", "S reach viscous",
        "xi xi1 offset "
        "gap anchor stick damper gap1 stick1 n distance f force d_gap d_rate damper1 t along across by_normal tilt "
        "drag drag1 "
        "x n0 n1 rest rest1 sank apart rubbing slid0 slid1",
        x=_3, n0=_3, n1=_3, rubbing=_3, slid0=_3, slid1=_3,
        iq=(4,), iv=(4,), S=(4,), anchor=_3, stick=_3, stick1=_3, n=_3, f=_3, t=_3, drag=_3, drag1=_3,
    ),
    order=70,
    results={
        "force": ("point_force", "N", "normal force of each contact point, positive where it pushes"),
        "apart": (
            "gap",
            "m",
            "distance of each contact point, negative where it overlaps, NaN where it is too far away or past the edge",
        ),
        "x": ("point_position", "m", "position of each contact point, inertial axes"),
        "n1": ("point_normal", "1", "normal of the surface at each contact point, inertial axes"),
        "rubbing": ("point_friction", "N", "friction of each contact point on its beam, inertial axes"),
    },
    of="contact_surfaces",
    samples=Samples(keep=keep_friction, kept={"rubbing": BETWEEN}, keeps=_any_rubs),
)  # fmt: skip
