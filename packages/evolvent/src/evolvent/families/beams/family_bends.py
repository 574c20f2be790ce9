"""Relaxation of the bending of cables of viscoelastic materials.

The strains that relax at each of the two points of an element (`cable.curvature`) are both parts of k = r,xx times the
radius of gyration, of whose squares its energy is the sum: the bending x = |t x k| across the tangent t = a/|a|,
a = r,x, and y = t . k along it, which the cubic has where its stretch varies. The bending has a sign, that of the side
to which it bends, at the start positive. A cable has no torsional stiffness, and no directions across it: its sections
turn about the tangent with the plane in which it bends, and the set that they keep turns with them. So a rigid rotation
changes no stress, and what bends back through straight without leaving its plane bends to the other side. A plane that
turns by more than a right angle in a step is taken for that, too.

Notes
-----
The moment changes by E A times the radius times s = sum g (w - x) of the branches. Over a step x^2 = k.k - y^2 changes
by 2 km . dk - 2 ym dy, with means m of both ends, and y by Y . d(a, k) with Y = (D, w am), w the mean of 1/|a|,
D = w km - b Pm am, P = a.k, b = 2/(|a0| |a1| (|a0| + |a1|)). So the force s_x/xm (km - ym Y) + s_y Y on a and k does
the work s_x dx + s_y dy, and keeps both momenta. The part of s that is proportional to the strains themselves is that
of k alone, along km. The rest, by the past, fades out in a cable that bends by less than `_STRAIGHT`. Over a step
through straight the rest of s_x is a moment along a vector p of which p . (c1 - c0) = x1 - x0 for c = t x k: in a plane
its normal; out of a plane such a step keeps all but the angular momentum.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.compiled.jit import inlined
from evolvent.elements.forms import STRAIGHT, slope_factors
from evolvent.families.beams import cable
from evolvent.families.beams.beam_strains import OF_CABLE, POINTS
from evolvent.families.relaxation import family as relaxation
from evolvent.kernels import ancf_beams, calls
from evolvent.kernels.rotations import cross, dot
from evolvent.kernels.viscoelastic import add_branches, excess_of, relax_strains, relaxed_one
from evolvent.model.family import Family, record
from evolvent.model.layout import Accounts
from evolvent.model.powers import STIFFNESS_DAMPING
from evolvent.model.questions import Implicit, Samples, Stability

Array = np.ndarray
#: Points of an element, and their strains: x of both, y of both.
COUNT, STRAINS = 2, 4
#: Angle, rad, by which an element bends below which its curvature has no direction.
_STRAIGHT = 1e-8
#: Places in the scratch `Model.work`: mean strains, those of the end, and what relaxation adds.
_MEAN, _END, _ADDED, _LAST = 0, STRAINS, 2 * STRAINS, 3 * STRAINS


@inlined
def _sum(a, u, b, v):
    """a u + b v."""
    return a * u[0] + b * v[0], a * u[1] + b * v[1], a * u[2] + b * v[2]


@inlined
def _across(a, k):
    return cross(a[0], a[1], a[2], k[0], k[1], k[2])


@inlined
def _vectors(row, p, at, y, model):
    """Slope and second derivative at point p of the coordinates from `at` on, this one times the radius."""
    element, root = model.elements[row.element], row.roots[p]
    e, S = y[at : at + 12], cable.slope_factors(element.length, POINTS[p])
    k = cable.curvature(model.B[element.form], p, e)
    a = (
        S[0] * e[3] + S[1] * (e[6] - e[0]) + S[2] * e[9],
        S[0] * e[4] + S[1] * (e[7] - e[1]) + S[2] * e[10],
        S[0] * e[5] + S[1] * (e[8] - e[2]) + S[2] * e[11],
    )
    return a, (k[0] / root, k[1] / root, k[2] / root)


@inlined
def _bent(row, p, a, k, y):
    """Strains x and y at point p, x with its sign beside the side of the last state that was accepted; a x k."""
    at, c, size = row.account + 3 * p, _across(a, k), math.sqrt(dot(a, a))
    x = math.sqrt(dot(c, c)) / size
    return -x if c[0] * y[at] + c[1] * y[at + 1] + c[2] * y[at + 2] < 0.0 else x, dot(a, k) / size, c


@inlined
def _bent_in(row, p, y, model):
    """`_bent` of a state."""
    a, k = _vectors(row, p, model.elements[row.element].iq, y, model)
    return _bent(row, p, a, k, y)


@inlined
def _ends(row, p, interval, model):
    """Slope and second derivative at point p at the start and the end of an interval, and their means."""
    element, h = model.elements[row.element], interval.step.h
    a, k = _vectors(row, p, element.iq, interval.ym, model)
    if h == 0.0:
        return a, k, a, k, a, k
    da, dk = _vectors(row, p, element.iv, interval.ym, model)
    r = 0.5 * h
    return _sum(1.0, a, -r, da), _sum(1.0, k, -r, dk), _sum(1.0, a, r, da), _sum(1.0, k, r, dk), a, k


@inlined
def _relax(row, interval, model):
    """Strains of both points over an interval and what relaxation adds to them, into `work`; the stiffness's factor."""
    work, h, rows = model.work, interval.step.h, model.branch_strains
    for p in range(COUNT):
        a0, k0, a1, k1, _, _ = _ends(row, p, interval, model)
        x, y, _ = _bent(row, p, a1, k1, interval.y0)
        work[_END + p], work[_END + COUNT + p] = x, y
        if h != 0.0:
            x0, y0, _ = _bent(row, p, a0, k0, interval.y0)
            x, y = 0.5 * (x + math.copysign(x0, rows[row.branch + p].x0)), 0.5 * (y + y0)
        work[_MEAN + p], work[_MEAN + COUNT + p] = x, y
        work[_ADDED + p] = work[_ADDED + COUNT + p] = 0.0
    mean, end, added = work[_MEAN:_END], work[_END:_ADDED], work[_ADDED:_LAST]
    return relax_strains(row.prony, row.prony_end, row.branch, STRAINS, h, mean, end, model, added)


@inlined
def _past(row, p, part, model):
    """Strains x of start and end at point p; stress of x by the past alone, and over the mean; factor z of Y."""
    mean, end, added = model.work[_MEAN:_END], model.work[_END:_ADDED], model.work[_ADDED:_LAST]
    past, x0, q = added[p] - part * mean[p], 2.0 * mean[p] - end[p], COUNT + p
    ratio = past * math.copysign(1.0 / max(abs(mean[p]), row.least), mean[p])
    if x0 * end[p] < 0.0:
        ratio = 0.0
    return x0, end[p], past, ratio, added[q] - part * mean[q] - ratio * mean[q]


@inlined
def _through(a0, k0, a1, k1, x0, x1):
    """The vector p of the notes of a step through straight."""
    c0, c1 = _across(a0, k0), _across(a1, k1)
    i0, i1 = 1.0 / (x0 * math.sqrt(dot(a0, a0))), 1.0 / (x1 * math.sqrt(dot(a1, a1)))
    u0, u1 = _sum(i0, c0, 0.0, c0), _sum(i1, c1, 0.0, c1)
    c = max(dot(u0, u1), 0.0)
    turn = (x0 + x1) / max(x0 * x0, x1 * x1)
    return _sum((1.0 - turn * (x1 - c * x0)) / (1.0 + c), u0, (1.0 - turn * (x0 - c * x1)) / (1.0 + c), u1)


@inlined
def _sizes(a0, k0, a1, k1):
    """Lengths of a at start and end; w, b and Pm of the notes."""
    l0, l1 = math.sqrt(dot(a0, a0)), math.sqrt(dot(a1, a1))
    return l0, l1, 0.5 / l0 + 0.5 / l1, 2.0 / (l0 * l1 * (l0 + l1)), 0.5 * (dot(a0, k0) + dot(a1, k1))


@inlined
def _factors(row, p, model):
    """Factors by which a and k at point p are sums of an element's vectors, times the root of E A times its length."""
    element = model.elements[row.element]
    B, root, S = model.B[element.form], row.roots[p], cable.slope_factors(element.length, POINTS[p])
    return (root * S[0], root * S[1], root * S[2]), (B[p, 0], B[p, 1], B[p, 2])


@calls.force
def force(interval, model):
    """Forces by which relaxation changes those of the bending of all elements."""
    rows, F = model.bend_relaxations, model.F
    for n in range(rows.size):
        row = rows[n]
        part, at = _relax(row, interval, model) - 1.0, model.elements[row.element].iv - model.info.nq
        for p in range(COUNT):
            a0, k0, a1, k1, a, k = _ends(row, p, interval, model)
            x0, x1, past, ratio, z = _past(row, p, part, model)
            l0, l1, w, b, P = _sizes(a0, k0, a1, k1)
            on_a, on_k = _sum(z * w, k, -z * b * P, a), _sum(part + ratio, k, z * w, a)
            if x0 * x1 < 0.0:
                by = _through(a0, k0, a1, k1, x0, x1)
                bent = 0.5 * (dot(by, _across(a0, k0)) + dot(by, _across(a1, k1)))
                on_a = _sum(1.0, on_a, past, _sum(w, _across(k, by), -b * bent, a))
                on_k = _sum(1.0, on_k, past * w, _across(by, a))
            S, C = _factors(row, p, model)
            root = row.roots[p]
            for c in range(3):
                d = root * (S[1] * on_a[c] + C[1] * on_k[c])
                F[at + c] -= d
                F[at + 3 + c] += root * (S[0] * on_a[c] + C[0] * on_k[c])
                F[at + 6 + c] += d
                F[at + 9 + c] += root * (S[2] * on_a[c] + C[2] * on_k[c])


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`; over a step through straight at the vector p of the notes, which is that of a plane."""
    rows, K = model.bend_relaxations, model.K24
    for n in range(rows.size):
        row, element = rows[n], model.elements[rows[n].element]
        part = _relax(row, interval, model) - 1.0
        for i in range(12):
            for j in range(12):
                K[i, j] = 0.0
        for p in range(COUNT):
            _add_tangent(row, p, part, interval, model, K)
        cable.fill_first_position(K)
        ancf_beams.add_with_mass(matrix, element.iv - model.info.nq, 12, K, 0.0, model.M[element.mass])


@inlined
def _add_tangent(row, p, part, interval, model, K):
    """Add the derivatives of the forces of point p, over a step twice those by its end, to the rows of the vectors."""
    a0, k0, a1, k1, a, k = _ends(row, p, interval, model)
    x0, x1, past, ratio, z = _past(row, p, part, model)
    l0, l1, w, b, P = _sizes(a0, k0, a1, k1)
    S, C = _factors(row, p, model)
    y, y1, i = model.work[_MEAN + COUNT + p], model.work[_END + COUNT + p], 1.0 / l1
    # derivatives of y, and of the ratio, by the end's a and k
    y_a, y_k, slope = _sum(i, k1, -y1 * i * i, a1), _sum(i, a1, 0.0, a1), 0.0
    if ratio != 0.0 and abs(x0 + x1) > 2.0 * row.least and x1 != 0.0:
        slope = -2.0 * ratio / ((x0 + x1) * x1)
    h_a, h_k = _sum(-slope * y1, y_a, 0.0, a), _sum(slope, k1, -slope * y1, y_k)
    z_a, z_k = _sum(-y, h_a, -ratio, y_a), _sum(-y, h_k, -ratio, y_k)
    D, b_a = _sum(w, k, -b * P, a), -2.0 * b * (i + 1.0 / (l0 + l1)) * i
    # of the moment m through straight, whose direction stays
    m, bent, none = (0.0, 0.0, 0.0), 0.0, (0.0, 0.0, 0.0)
    if x0 * x1 < 0.0:
        m = _sum(past, _through(a0, k0, a1, k1, x0, x1), 0.0, none)
        bent = 0.5 * (dot(m, _across(a0, k0)) + dot(m, _across(a1, k1)))
    m_a, m_a1, k_m, k1_m = _across(m, a), _across(m, a1), _across(k, m), _across(k1, m)
    for r in range(3):
        for s in range(3):
            one, turned = 1.0 if r == s else 0.0, _turned(m, r, s)
            aa = (
                D[r] * z_a[s] - z * (i**3 * k[r] * a1[s] + b * (P * one + a[r] * k1[s]) + P * b_a * a[r] * a1[s])
                - i**3 * k_m[r] * a1[s] - b * (bent * one + a[r] * k1_m[s]) - bent * b_a * a[r] * a1[s]
            )  # fmt: skip
            ak = D[r] * z_k[s] + z * (w * one - b * a[r] * a1[s]) - w * turned - b * a[r] * m_a1[s]
            ka = k[r] * h_a[s] + a[r] * (w * z_a[s] - z * i**3 * a1[s]) + w * (z * one + turned) - i**3 * m_a[r] * a1[s]
            kk = k[r] * h_k[s] + w * a[r] * z_k[s] + (part + ratio) * one
            for c in range(3):
                for d in range(3):
                    K[3 * c + 3 + r, 3 * d + 3 + s] += S[c] * (aa * S[d] + ak * C[d]) + C[c] * (ka * S[d] + kk * C[d])


@inlined
def _turned(m, r, s):
    """Entry of the matrix by which m x v is of v."""
    if (r + 1) % 3 == s:
        return -m[(r + 2) % 3]
    return m[(r + 1) % 3] if (r + 2) % 3 == s else 0.0


@inlined
def _energy(row, p, x, y, model):
    """What relaxation changes the energy of point p by, at the strains x and y."""
    first, last, branch = row.prony, row.prony_end, row.branch
    found = excess_of(first, last, branch, STRAINS, p, x, model)
    found += excess_of(first, last, branch, STRAINS, COUNT + p, y, model)
    return 0.5 * row.roots[p] ** 2 * found


@calls.energy
def energy(interval, model, out):
    """What relaxation changes the energies of bending of all elements by."""
    rows = model.bend_relaxations
    for k in range(rows.size):
        for p in range(COUNT):
            x, y, _ = _bent_in(rows[k], p, interval.ym, model)
            changed = _energy(rows[k], p, x, y, model)
            out[1] += changed
            out[2] += changed


@calls.force
def end_step(interval, model):
    """What relaxation of the bending of all elements takes over a step; the sides to which they bend."""
    rows, h, y, taken = model.bend_relaxations, interval.step.h, interval.y1, 0.0
    for k in range(rows.size):
        row = rows[k]
        for i in range(STRAINS):
            lost = relaxed_one(row.prony, row.prony_end, row.branch, STRAINS, i, h, model)
            taken += row.roots[i % COUNT] ** 2 * lost
        for p in range(COUNT):
            (x, _, c), at = _bent_in(row, p, y, model), row.account + 3 * p
            if abs(x) >= row.least:
                size = math.copysign(math.sqrt(dot(c, c)), model.branch_strains[row.branch + p].x)
                for i in range(3):
                    y[at + i] = c[i] / size
    interval.powers[STIFFNESS_DAMPING] += taken


@calls.force
def evaluate(interval, model):
    """Relaxed moments, and what they do along the axis, into the records of all elements; energies of their beams."""
    rows, work, state = model.bend_relaxations, model.work, interval.ym
    for k in range(rows.size):
        row, element = rows[k], model.elements[rows[k].element]
        beam, strains, added = model.beams[element.beam], work[_END:_ADDED], work[_ADDED:_LAST]
        for p in range(COUNT):
            x, y, _ = _bent_in(row, p, state, model)
            strains[p], strains[COUNT + p], added[p], added[COUNT + p] = x, y, 0.0, 0.0
            changed = _energy(row, p, x, y, model)
            beam.elastic += changed
            beam.bending += changed
        add_branches(row.prony, row.prony_end, row.branch, STRAINS, 0, strains, model, added)
        for p in range(COUNT):
            a, _ = _vectors(row, p, element.iq, state, model)
            EA, radius = model.parameters[element.section + OF_CABLE * p], row.radii[p]
            EA /= math.sqrt(dot(a, a))
            moment = element.bending_moment[p] + EA * radius * math.copysign(1.0, strains[p]) * added[p]
            element.bending_moment[p] = abs(moment)
            element.axial_force[p] += EA * (strains[p] * added[p] + strains[COUNT + p] * added[COUNT + p])


# element: of a cable; account: index in the state of the directions to which positive strains bend at both points; of
# these radii: of gyration, m, and roots: of E A times their length, N1/2 m1/2; least: strain that has no direction
BEND_RELAXATIONS = Family(
    "bend_relaxations",
    record("element prony prony_end branch account", "radii roots least", radii=(COUNT,), roots=(COUNT,)),
    order=32,
    of="beams",
    accounts=(Accounts(3 * COUNT, states=tuple(range(3 * COUNT)), order=5.6),),
    force=force,
    tangent=tangent,
    energy=energy,
    of_step=False,
    stability=Stability(by_rates=False),
    implicit=Implicit(end_step=end_step),
    samples=Samples(evaluate=evaluate),
)  # fmt: skip


def add_bends(builder: Any, terms: dict[str, int], first: int, lengths: Sequence[float], starts: Array) -> None:
    """Write the relaxation of the bending of the elements of a cable, which have been written.

    Parameters
    ----------
    builder : evolvent.assembly.builder.Builder
    terms : as of `evolvent.families.relaxation.family.add_terms`
    first : int, its first element
    lengths : (n,) float, m, of the elements; starts : (n, 12) float, their coordinates at the start
    """
    for k, (length, start) in enumerate(zip(lengths, starts, strict=True)):
        B = builder.pools["B"][builder.rows["elements"][first + k]["form"]]
        at = builder.rows["elements"][first + k]["section"]
        EA, EI, _ = np.reshape(builder.values[at : at + COUNT * OF_CABLE], (COUNT, OF_CABLE)).T
        radii = np.sqrt(EI / EA)
        roots = np.sqrt(B[:, 3]) * length / STRAIGHT / radii
        vectors = np.stack([start[3:6], start[6:9] - start[:3], start[9:]])
        slopes = np.array([slope_factors(length, xi) for xi in POINTS[:COUNT]]) @ vectors
        tangents, bends = slopes / np.linalg.norm(slopes, axis=1)[:, None], (B[:, :3] @ vectors) / roots[:, None]
        strains = [*np.linalg.norm(np.cross(tangents, bends), axis=1), *np.einsum("ij,ij->i", tangents, bends)]
        builder.add(
            "bend_relaxations", element=first + k, **terms, radii=radii, roots=roots,
            least=_STRAIGHT * radii.min() / length,
            branch=relaxation.add_branches(builder, terms, strains),
        )  # fmt: skip
