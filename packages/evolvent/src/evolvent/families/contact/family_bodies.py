"""Body contacts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.families.contact import contact_tangent
from evolvent.families.contact.family_surfaces import (
    RULES,
    add_energies,
    book,
    book_end,
    kinds,
    note_pressing,
    pressing,
    slides_freely,
)
from evolvent.kernels import body_gaps, calls, contact, surfaces, turning
from evolvent.kernels.ends import of_bodies
from evolvent.model.family import Family, Kind, has_friction, record
from evolvent.model.layout import Accounts
from evolvent.model.questions import (
    BETWEEN,
    SUMMED,
    AdjointSupport,
    Advice,
    Bound,
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
from evolvent.model.shares import Pressing, Shares

Array = np.ndarray
_3, _33, _6 = (3,), (3, 3), (6,)
#: What tells contacts that press from points of beams that do, in a contact set.
_WEIGHT = 104729


def _is_of_box(found: Array) -> Array:
    return np.asarray((found["surface"] == body_gaps.BOX) | (found["surface"] == body_gaps.EDGES))


@calls.ties
def ties(t, model):
    """Whether a contact with what is not part of the system touches."""
    found = 0
    for k in range(model.body_contacts.size):
        if model.body_contacts[k].outside != 0 and model.body_contacts[k].gap1 < 0.0:
            found = 1
    return found


@calls.force
def force(interval, model):
    """Forces of all contacts between bodies; what they take in a step, J."""
    step = interval.step
    book(interval, contact.add_bodies(interval.y1, step.span, step.rub, step.soft, step.chi, step.ratio, model))


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    step = interval.step
    contact_tangent.add_body_tangents(step.h, 0.0 if step.h > 0.0 else step.c_rate, model, matrix)


@calls.measure
def measure(end, t, y, model):
    """Gaps of all contacts between bodies."""
    body_gaps.measure_bodies(end, model)


@calls.energy
def energy(interval, model, out):
    """Energy by the last forces, of bristles too."""
    add_energies(model.body_contacts, out)


@calls.energy
def explicit_energy(interval, model, out):
    """Energy by the forces of the state, of bristles too."""
    force(interval, model)
    energy(interval, model, out)


def _bound(model: Any, _: Array, felt: Mapping[str, Array]) -> Iterator[Bound]:
    contact_tangent.add_body_contact_bound(model, felt["bodies"])
    return iter(())


@calls.force
def end_step(interval, model):
    """The end of a step as the start of the next one; what friction and damping took, and impulses."""
    step, rows = interval.step, model.body_contacts
    if step.again != 0.0:
        return
    book_end(interval, contact.end_bodies(model))
    for k in range(rows.size):
        rows[k].impulse += step.h * rows[k].force


@calls.contact_set
def contact_set(found, model):
    """Which contacts press."""
    return note_pressing(found, model.body_contacts, _WEIGHT)


@calls.rates
def measure_rates(y, model):
    """Sliding velocities of contacts that touch."""
    turning.measure_body_slides(model)


@calls.note
def keep_rates(model):
    """Sliding velocities of all contacts."""
    turning.keep_slides(model.body_contacts)


@calls.until_turn
def until_turn(y0, y, h, model):
    """Where the friction of a contact turns back."""
    part = turning.NO_TURN
    for k in range(model.body_contacts.size):
        row = model.body_contacts[k]
        if row.friction > 0.0:
            part = min(part, turning.until_contact_turns(row, row, h))
    return part


@calls.power
def friction_power(model):
    """Power of the frictions of all contacts."""
    return -turning.contact_power(model.body_contacts)


def _forget(model: Any) -> None:
    contact.clear_history(model.body_contacts)
    model.body_contacts["energy"] = model.body_contacts["impulse"] = 0.0


def _at_rest(model: Any) -> None:
    _forget(model)
    model.body_contacts["bristle_damping"], model.body_contacts["impulse"] = 0.0, np.nan


#: Distance beside the radius below which the normal of a contact that presses jumps.
NEAR = 1e-7


def _no_balance(model: Any, _: float, y: Array) -> Iterator[tuple[int, str]]:
    """Contacts that press where their normal jumps.

    At a centre or axis, where a point lies on an edge of the core of a box, which is the box less its rounding, and
    where edges cross in one plane, as of boxes that are flush: round-off alone has a direction there.
    """
    for k, row in enumerate(model.body_contacts):
        small = NEAR * float(row["radius"])
        if row["surface"] == surfaces.PLANE or not row["force"] > 0.0 or abs(row["distance"]) > small:
            continue
        place = np.abs([row["u1"], row["v1"], row["w1"]])
        if row["surface"] != body_gaps.BOX or np.sum(place >= row["sides"] - small) > 1:
            why = (
                f"is {-row['gap1']:.3g} m deep, where its force of {row['force']:.3g} N has no direction: this is no "
                f"equilibrium; use a greater `stiffness`, of boxes also a greater `rounding`"
            )
            yield k, why


def _without_stiffness(model: Any) -> None:
    model.body_contacts["stiffness"] = 0.0


def _without_normal(found: Array) -> Array:
    """With the centre or axis of one body on that of the other."""
    alike = (found["surface"] != surfaces.PLANE) & (found["surface"] != body_gaps.BOX)
    return np.asarray(alike & (found["gap"] < 0.0) & (found["distance0"] == 0.0))


# contact points between two bodies: a sphere or capsule (half length, radius_a) of body a, and on body b another
# one, a plane with the normal axis_b, or a box with the half lengths `sides` (`kernels.body_gaps`); radius: sum of
# both; first: the first of its part; extent: m, of which a share is the depth of the explicit step's bound;
# share: of the points of the part's kind that can touch at the same time. Of the step's start:
# position X and rotation Q of a in the axes of b, and what ends in 0; of its end: what ends in 1. rubbing: friction
# on a (N), c: point of contact (m), inertial axes; on_a, on_b: force (N) and moment (N m) at the bodies' origins;
# impulse: of the normal force, N s, NaN under explicit methods; slid0, slid1: as of contact points
BODY_CONTACTS = Family(
    "body_contacts",
    record(
        "a b first law surface account outside",
        "place_a axis_a place_b axis_b half_a half_b sides radius_a radius extent share "
        "stiffness exponent damping friction bristle_stiffness bristle_damping viscous",
        "X Q gap stick damper drag gap1 stick1 damper1 drag1 slide "
        "distance0 distance u0 v0 w0 s0 t0 u1 v1 w1 s1 t1 n n1 t "
        "rubbing c on_a on_b force impulse d_gap d_rate along across by_normal tilt energy power sank "
        "slid0 slid1",
        place_a=_3, axis_a=_3, place_b=_3, axis_b=_3, sides=_3,
        X=_3, Q=_33, stick=_3, drag=_3, stick1=_3, drag1=_3, slide=_3, n=_3, n1=_3, t=_3, rubbing=_3, c=_3,
        on_a=_6, on_b=_6, slid0=_3, slid1=_3,
    ),
    order=80,
    results={
        "impulse": ("impulse", "N s", "integral of the normal forces since the start; NaN if explicit"),
        "energy": ("energy_elastic", "J", "elastic energy of the contact and of what sticks by friction"),
        "force": ("point_force", "N", "normal force of each contact point"),
        "on_a": (
            "point_resultant",
            "N",
            "whole force of each contact point on its {on}, inertial axes: of the sample, or the mean over its step",
        ),
        "rubbing": (
            "point_friction",
            "N",
            "friction of each contact point on its {on}, inertial axes: of the sample, or the mean over its step",
        ),
        "c": ("point_position", "m", "position of each contact point, on the first body's surface, inertial axes"),
        "gap1": ("gap", "m", "distance of the surfaces, negative where they overlap"),
    },
    kinds=kinds("a contact between bodies", Kind("a contact of a box", which=_is_of_box, symmetric=slides_freely)),
    ends=of_bodies("a", "b"),
    isolated=True,
    force=force,
    tangent=tangent,
    energy=energy,
    accounts=(Accounts(lambda found: np.where(found["friction"] > 0.0, 3, 0), order=10),),
    shares=Shares(RULES, place=9, contact=Pressing(pressing)),
    smooth=True,
    adjoint=AdjointSupport(
        "without friction its force follows from the state, with all derivatives", filtered="gaps of body_contacts",
        timed=False,
        refused={
            "contacts between bodies have friction": lambda found: found["friction"] != 0.0,
            "contacts between bodies have viscous friction": lambda found: found["viscous"] != 0.0,
        },
    ),
    parts=Parts(several=True),
    coupling=Coupling(at_times=True, ties=ties),
    friction=Friction(
        rubs=has_friction, measure_rates=measure_rates, keep_rates=keep_rates,
        until_turn=until_turn, power=friction_power,
    ),
    contacts=Contacts(presses=lambda model: model.body_contacts["force"] > 0.0, without_normal=_without_normal),
    explicit=Explicit(energy=explicit_energy),
    stability=Stability(bound=_bound, stiffest=_without_stiffness),
    implicit=Implicit(end_step=end_step, contact_set=contact_set, forget=_forget),
    step=Step(measure=measure),
    statics=Statics(at_rest=_at_rest, settle=lambda model, _: contact.end_bodies(model), no_balance=_no_balance),
    samples=Samples(
        evaluate=False,
        kept=dict.fromkeys(("on_a", "on_b", "rubbing", "c", "force", "gap1", "energy"), BETWEEN) | {"impulse": SUMMED},
    ),
    advice=Advice(conserved="contact"),
)  # fmt: skip
