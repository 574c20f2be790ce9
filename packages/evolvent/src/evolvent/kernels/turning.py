"""Where dry friction turns back within a step: steps end there, for a step sees the way of its start to its end alone.

Every dry friction is a `bristle` (`joint_friction`, `resistance`, `contact_laws.friction`). Its force follows from the
way that it has moved by since the step's start, as if this went one way. Where the sliding rate changes sign within the
step it does not: the force would keep the sense of the first part on the second one, which it would then drive. So a
step over a turn is taken again, as one that ends at the turn, where the rate is none. Friction is continuous there:
nothing starts again. A bristle that sticks all along has the same force by both ways, and shortens no step.

Rates are those of states, `measure_rates`, at both ends of a step, and between them as of a constant acceleration. A
turn does not count where the forces by both ways differ by less than `NEAR` of the limit. Wheels, whose friction has no
bristle, turn where their rates change sign; free spools are held by switches (`kernels.thread`).
"""

import math

from numba import void

from evolvent.compiled.jit import REAL, VECTOR, indirect, inlined
from evolvent.kernels import body_gaps, contact_laws, rigid, surfaces
from evolvent.kernels.ancf_beams import NODE_VECTORS
from evolvent.kernels.bristle import SLIP, bristle_between
from evolvent.kernels.calls import note_at, power_at, rates_at, until_turn_at
from evolvent.kernels.contact import place, turn_axes
from evolvent.model import MODEL

#: Part of the limit of a friction by which the force at the end of a step may be off by a turn within it.
NEAR = 0.02
#: Part of a step within which nothing turns back.
NO_TURN = 1.0


@inlined
def has_friction(model):
    """Whether a model may have dry friction, in compiled code."""
    return model.friction_until_turn_calls.size > 0


def USED_FOR(model):  # noqa: N802
    """Dry friction."""
    return model.friction_until_turn_calls.size > 0


# ------------------------------------------------------------------------------------------------ rates


@inlined
def measure_rates(y, model):
    """Rates of all sliders in the state y, as those of the end of a step, by the bodies' current positions and rates.

    Contacts are those that touch by the gaps measured last.
    """
    calls = model.friction_measure_rates_calls
    for k in range(calls.size):
        rates_at(model, calls[k])(y, model)


@indirect(void(VECTOR, MODEL), used_for="contact_surfaces")
def measure_point_slides(y, model):
    """`measure_rates` of contact points of beams."""
    bodies, contacts, elements = model.bodies, model.contact_points, model.elements
    for k in range(model.contact_surfaces.size):
        row, body = model.contact_surfaces[k], bodies[model.contact_surfaces[k].body]
        half = NODE_VECTORS[model.beams[row.under].kind] if row.under >= 0 else 0
        _, a = surfaces.frame(bodies, row)
        for i in range(row.first, row.last if row.friction > 0.0 else row.first):
            point, axes = contacts[i], contact_laws.body_axes(body.R)
            slid, n = point.slid1, (point.n1[0], point.n1[1], point.n1[2])
            slid[0] = slid[1] = slid[2] = 0.0
            if point.gap1 < 0.0:
                _, _, u, _, _ = place(y, y, point, row, body, elements, half, 0.0)
                if row.under >= 0:
                    axes = turn_axes(a, n)
                slid[0], slid[1], slid[2] = contact_laws.into_axes(axes, contact_laws.tangential(u, n))


@indirect(void(MODEL), used_for="body_contacts")
def measure_body_slides(model):
    """`measure_rates` of contacts between bodies."""
    bodies, rows = model.bodies, model.body_contacts
    for k in range(rows.size):
        row, slid, n1 = rows[k], rows[k].slid1, rows[k].n1
        slid[0] = slid[1] = slid[2] = 0.0
        if not (row.friction > 0.0 and row.gap1 < 0.0):
            continue
        A, B, n, r, s = bodies[row.a], bodies[row.b], (n1[0], n1[1], n1[2]), row.radius_a, row.s1
        (p, _, e, _), x, z = body_gaps.body_axes(row, bodies), A.x, B.x
        arm = (p[0] + s * e[0] - r * n[0], p[1] + s * e[1] - r * n[1], p[2] + s * e[2] - r * n[2])
        v = rigid.relative_velocity(A, B, arm, (arm[0] + x[0] - z[0], arm[1] + x[1] - z[1], arm[2] + x[2] - z[2]))
        axes = contact_laws.body_axes(B.R)
        slid[0], slid[1], slid[2] = contact_laws.into_axes(axes, contact_laws.tangential(v, n))


@inlined
def keep_rates(model):
    """Make the rates at the end of a step those of the start of the next."""
    calls = model.friction_keep_rates_calls
    for k in range(calls.size):
        note_at(model, calls[k])(model)


@inlined
def keep_slides(rows):
    """`keep_rates` of contacts."""
    for i in range(rows.size):
        a, b = rows[i].slid0, rows[i].slid1
        for c in range(3):
            a[c] = b[c]


@inlined
def friction_power(model):
    """Power that all frictions of a model take or store at the last evaluation, W, after `measure_rates` of its state.

    Those of bearings, which explicit methods do not have, are left out.
    """
    calls, power = model.friction_power_calls, 0.0
    for k in range(calls.size):
        power += power_at(model, calls[k])(model)
    return power


@inlined
def contact_power(rows):
    """Minus the power of the frictions of contacts, W."""
    power = 0.0
    for i in range(rows.size):
        d, v = rows[i].drag1, rows[i].slid1
        power += d[0] * v[0] + d[1] * v[1] + d[2] * v[2]
    return power


@inlined
def note_slips(found, rows):
    """`found` with the senses in which rows of friction slip, as a contact set."""
    for k in range(rows.size):
        found = 3 * found + 1 + int(rows[k].slips)
    return found


# ------------------------------------------------------------------------------------------------ turns


@inlined
def until_turn_of(kind, stick, limit, start, rate0, rate1, h):
    """Part of a step of length h at which a bristle's slider turns back, if that counts, else `NO_TURN`.

    Parameters
    ----------
    kind, stick, limit, start : of `bristle.bristle_between`
    rate0, rate1 : float, rates of the slider at both ends of the step
    """
    if rate0 * rate1 >= 0.0 or limit <= 0.0:
        return NO_TURN
    part = rate0 / (rate0 - rate1)
    way, back = 0.5 * part * h * rate0, 0.5 * (1.0 - part) * h * rate1
    far, _, _, _ = bristle_between(kind, stick, limit, start, way)
    turned, _, _, _ = bristle_between(kind, stick, limit, far, back)
    straight, _, _, _ = bristle_between(kind, stick, limit, start, way + back)
    return part if abs(turned - straight) > NEAR * limit else NO_TURN


@inlined
def until_slider_turns(kind, stick, limit, start, slider, h):
    """`until_turn_of` with the rates of a record of coordinates."""
    return until_turn_of(kind, stick, limit, start, slider.start_rate, slider.end_rate, h)


@inlined
def until_contact_turns(point, row, h):
    """`until_turn_of` of the friction of a contact along the direction in which it slides at the start of the step."""
    a, b, u = point.slid0, point.slid1, point.stick
    size = math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    if size == 0.0:
        return NO_TURN
    rate = (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) / size
    start = row.bristle_stiffness * (a[0] * u[0] + a[1] * u[1] + a[2] * u[2]) / size
    return until_turn_of(SLIP, row.bristle_stiffness, row.friction * point.force, start, size, rate, h)


@inlined
def until_reversal(rate0, rate1, least):
    """Part of a step at which a rate changes sign, `NO_TURN` where it does not, or by less than `least`."""
    if rate0 * rate1 >= 0.0 or min(abs(rate0), abs(rate1)) <= least:
        return NO_TURN
    return rate0 / (rate0 - rate1)


@indirect(REAL(VECTOR, VECTOR, REAL, MODEL))
def until_turn(y0, y, h, model):
    """Part of a step of length h from y0 to y at which the first friction turns back; `NO_TURN` where none does.

    After `measure_rates` of its end; frictions at its start are among the accounts, or in their records.
    """
    calls, part = model.friction_until_turn_calls, NO_TURN
    for k in range(calls.size):
        part = min(part, until_turn_at(model, calls[k])(y0, y, h, model))
    return part
