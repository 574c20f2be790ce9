"""Contacts of shells with shells."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.families.contact import face_forces, face_patch, face_search, face_tangent
from evolvent.families.contact.family_surfaces import add_energies, book, book_end, note_pressing
from evolvent.kernels import calls, contact, turning
from evolvent.model.family import ENERGY, IMPLICIT, MODES, STATIC, End, Family, Kind, Records, has_friction, record
from evolvent.model.questions import (
    BETWEEN,
    NEARER,
    SUMMED,
    Advice,
    Contacts,
    Coupling,
    Friction,
    Implicit,
    Samples,
    Statics,
    Step,
)

Array = np.ndarray
_3 = (3,)
#: What tells nodes that press on faces from other contacts, in a contact set.
_WEIGHT = 15485863
#: Most nodes that press on faces with which the matrix does not couple them yet.
_MOST_INNER = 64
_SOLVERS = frozenset((IMPLICIT, ENERGY, STATIC, MODES))
_ADVICE = "use generalized-alpha or energy-momentum"


def _of_contact(row: Any, records: Records) -> Iterator[End]:
    """All nodes of both sides."""
    points = records("face_points")[int(row["first"]) : int(row["last"])]
    yield from (("bodies", int(node)) for node in np.unique(points["body"]))


def _touches(model: Any) -> Iterator[list[End]]:
    """Nodes with those of the face that is near."""
    for point in model.face_points[model.face_points["face1"] >= 0]:
        nodes = model.faces["nodes"][point["face1"]].tolist()
        yield [("bodies", int(node)) for node in (point["body"], *nodes)]


@calls.ties
def ties(t, model):
    """Whether a contact with what is not part of the system touches."""
    found = 0
    for k in range(model.face_contacts.size):
        if model.face_contacts[k].outside != 0 and model.face_contacts[k].touching > 0.0:
            found = 1
    return found


@calls.force
def force(interval, model):
    """Forces of all contacts of shells with shells; what they take in a step, J."""
    step = interval.step
    book(interval, face_forces.add_faces(interval.y1, step.span, step.rub, step.soft, step.chi, step.ratio, model))


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    step = interval.step
    face_tangent.add_face_tangents(step.h, 0.0 if step.h > 0.0 else step.c_rate, model, matrix)


@calls.measure
def measure(end, t, y, model):
    """Gaps of all nodes."""
    face_search.measure_faces(end, model)


@calls.energy
def energy(interval, model, out):
    """Energy by the last forces, of bristles too."""
    add_energies(model.face_contacts, out)


@calls.force
def end_step(interval, model):
    """The end of a step as the start of the next one; what friction and damping took, and impulses."""
    step, rows = interval.step, model.face_contacts
    if step.again != 0.0:
        return
    book_end(interval, face_forces.end_faces(model))
    for k in range(rows.size):
        rows[k].impulse += step.h * rows[k].normal


@calls.contact_set
def contact_set(found, model):
    """Which nodes press."""
    return note_pressing(found, model.face_points, _WEIGHT)


@calls.rates
def measure_rates(y, model):
    """Sliding velocities of nodes that touch."""
    face_forces.measure_slides(model)


@calls.note
def keep_rates(model):
    """Sliding velocities of nodes."""
    turning.keep_slides(model.face_points)


@calls.until_turn
def until_turn(y0, y, h, model):
    """Where the friction of a node turns back."""
    part = turning.NO_TURN
    for i in range(model.face_points.size):
        point = model.face_points[i]
        if point.friction > 0.0:
            part = min(part, turning.until_contact_turns(point, point, h))
    return part


@calls.power
def friction_power(model):
    """Power of the frictions of nodes."""
    return -turning.contact_power(model.face_points)


def _forget(model: Any) -> None:
    points = model.face_points
    contact.clear_history(points)
    points["face0"] = points["face1"] = -1
    points["distance0"] = points["distance"] = np.inf
    model.face_contacts["impulse"] = 0.0


def _at_rest(model: Any) -> None:
    _forget(model)
    model.face_points["bristle_damping"], model.face_contacts["impulse"] = 0.0, np.nan


def _presses(model: Any) -> Array:
    force = model.face_points["force"]
    return np.array([bool(np.any(force[row["first"] : row["last"]] > 0.0)) for row in model.face_contacts], dtype=bool)


# contacts of the nodes of shells with faces of shells: their contact points, faces and cells, first and last; reach:
# m, distance from a face within which nodes are looked for; cell: m, size of cells; way: of `face_search.passing`;
# force: N, on what the part has as `a`; work: scratch
FACE_CONTACTS = Family(
    "face_contacts",
    record(
        "law first last first_face last_face first_cell last_cell outside",
        "friction reach",
        "cell way force normal impulse energy touching work",
        way=_3, force=_3, work=(face_tangent.WORK,),
    ),
    order=85,
    results={
        "force": ("force", "N", "resultant of the contact on its first side, `a`, inertial axes"),
        "normal": ("normal_force", "N", "sum of the normal forces of the nodes of both sides"),
        "impulse": ("impulse", "N s", "integral of the normal forces since the start"),
        "touching": ("points", "1", "nodes that touch"),
        "energy": ("energy_elastic", "J", "elastic energy of the contact and of what sticks by friction"),
    },
    kinds=(
        Kind(
            "a contact of shells", solvers=_SOLVERS, advice=_ADVICE, which=lambda found: ~has_friction(found),
            symmetric=True,
        ),
        Kind("a contact of shells with friction", solvers=_SOLVERS, advice=_ADVICE, which=has_friction),
    ),
    ends=_of_contact,
    isolated=True,
    force=force,
    tangent=tangent,
    energy=energy,
    coupling=Coupling(
        at_times=True, couples=lambda row, records: iter(()), ties=ties, touches=_touches, always=True,
        layered=lambda found: np.ones(found.size, dtype=bool),
    ),
    friction=Friction(
        rubs=has_friction, measure_rates=measure_rates, keep_rates=keep_rates,
        until_turn=until_turn, power=friction_power,
    ),
    contacts=Contacts(presses=_presses, passing=face_search.passing),
    implicit=Implicit(
        end_step=end_step, contact_set=contact_set, forget=_forget,
        inner=lambda found: _MOST_INNER if found.size else 0,
    ),
    step=Step(measure=measure),
    statics=Statics(at_rest=_at_rest, settle=lambda model, _: face_forces.end_faces(model)),
    samples=Samples(
        evaluate=False,
        kept=dict.fromkeys(("force", "normal", "energy"), BETWEEN) | {"touching": NEARER, "impulse": SUMMED},
    ),
    advice=Advice(conserved="contact"),
)  # fmt: skip

# two contact points of a node of a shell, what is before and what is behind it along `way`: faces of the group
# `target`, but those listed from first_apart to last_apart; sense: 1 of nodes of `a`, -1 of those of `b`, 0 of a shell
# that touches itself. Of the step's start what ends in 0, of its end what ends in 1: closest face, its point (xi, eta)
# and distance; of an interval: faces of0 and of1, distances d0 and d1, weights W0 and W1, mean offsets D0 and D1, and
# their shares of the force. arm, arms: of friction, axes of the node and of those of face0. whole: force (N), and
# friction `rubbing`; the other fields as of contacts between bodies
FACE_POINTS = Family(
    "face_points",
    record(
        "body target law first_apart last_apart face0 face1 hint of0 of1",
        "sense radius reach "
        "stiffness exponent damping friction bristle_stiffness bristle_damping viscous way",
        "xi0 eta0 xi1 eta1 xi eta distance0 distance least gap gap1 apart d0 d1 W0 W1 D0 D1 share0 share1 fell arm "
        "arms stick damper drag stick1 damper1 drag1 slide n n1 t whole rubbing "
        "force d_gap d_rate along across by_normal tilt sank slid0 slid1",
        way=_3, W0=(face_patch.WEIGHTS,), W1=(face_patch.WEIGHTS,), D0=_3, D1=_3, arm=_3, arms=(4, 3),
        stick=_3, drag=_3, stick1=_3, drag1=_3, slide=_3, n=_3, n1=_3, t=_3, whole=_3, rubbing=_3, slid0=_3, slid1=_3,
    ),
    order=86,
    results={
        "force": ("point_force", "N", "normal force of each node on the faces before and behind it"),
        "whole": (
            "point_resultant",
            "N",
            "whole force on each node, inertial axes: of the sample, or the mean over its step",
        ),
        "rubbing": (
            "point_friction",
            "N",
            "friction on each node, inertial axes: of the sample, or the mean over its step",
        ),
        "apart": ("gap", "m", "distance of the face of each node from what is before and behind it, if that is near"),
    },
    of="face_contacts",
    samples=Samples(evaluate=False, kept=dict.fromkeys(("force", "whole", "rubbing", "apart"), BETWEEN)),
)  # fmt: skip

# faces of shells that nodes touch (`face_patch`): `t`: m, two vectors of each node along it, in the axes of this;
# next: face in the same list; V: its vectors, inertial axes; middle, axes, extent: its box; wide: of a step
FACES = Family(
    "faces",
    record(
        "nodes group next", "radius t", "V middle axes extent wide",
        nodes=(4,), t=(8, 3), V=(face_patch.WEIGHTS, 3), middle=_3, axes=(3, 3), extent=_3,
    ),
    order=87,
    of="face_contacts",
)  # fmt: skip

# lists of faces by cells: the first one
FACE_CELLS = Family("face_cells", record("head"), order=88, of="face_contacts")

# faces that a node does not touch, being too near along the surface, in ascending order
FACE_APART = Family("face_apart", record("face"), order=89, of="face_contacts")
