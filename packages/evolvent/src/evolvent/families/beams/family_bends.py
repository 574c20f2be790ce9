"""Relaxation of the bending of cables of viscoelastic materials.

The strain that relaxes at each of the two points of an element (`cable.curvature`) is its curvature x = |a x k|, 1/m,
of the slope a = r,x and k = r,xx, with a sign: that of the side to which it bends, at the start positive. A cable has no
torsional stiffness, and no directions across it: its sections turn about the tangent with the plane in which it bends,
and the set that they keep turns with them. So a rigid rotation changes no stress, the forces keep both momenta, and what
bends back through straight without leaving its plane bends to the other side.

Notes
-----
What relaxation adds to the moment is E I s, s = sum g (w - x) of the branches. With A = a.a, P = a.k, Q = k.k and their
means over a step, x^2 = A Q - P^2 changes by A d(k.k) + Q d(a.a) - 2 P d(a.k), and the force s/x (Q a - P k) on a,
s/x (A k - P a) on k, along the means of a, k and x, does the work s (x1 - x0). The part of s that is proportional to x
is defined in a straight cable, too; the rest, by the past, fades out in one that bends by less than `_STRAIGHT`. Over a
step through straight the rest is a moment along a vector p of which p . (c1 - c0) = x1 - x0 for c = a x k: in a plane
its normal.
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
#: Points of an element.
COUNT = 2
#: Angle, rad, by which an element bends below which its curvature has no direction.
_STRAIGHT = 1e-8
#: Places in the scratch `Model.work`: mean strains, those of the end, and what relaxation adds.
_MEAN, _END, _ADDED, _LAST = 0, COUNT, 2 * COUNT, 3 * COUNT


@inlined
def _sum(a, u, b, v):
    """a u + b v."""
    return a * u[0] + b * v[0], a * u[1] + b * v[1], a * u[2] + b * v[2]


@inlined
def _across(a, k):
    return cross(a[0], a[1], a[2], k[0], k[1], k[2])


@inlined
def _vectors(row, p, at, y, model):
    """Slope and second derivative at point p of the coordinates from `at` on."""
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
def _bent(row, p, y, model):
    """Curvature at point p in a state, with its sign, and the vector that it is the length of."""
    a, k = _vectors(row, p, model.elements[row.element].iq, y, model)
    return _signed(row, p, _across(a, k), y)


@inlined
def _signed(row, p, c, y):
    """The length of a vector of curvature, with its sign beside the side of the last state that was accepted."""
    at, size = row.account + 3 * p, math.sqrt(dot(c, c))
    return -size if c[0] * y[at] + c[1] * y[at + 1] + c[2] * y[at + 2] < 0.0 else size, c


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
    work, h = model.work, interval.step.h
    for p in range(COUNT):
        a0, k0, a1, k1, _, _ = _ends(row, p, interval, model)
        x, _ = _signed(row, p, _across(a1, k1), interval.y0)
        work[_END + p], work[_MEAN + p], work[_ADDED + p] = x, x, 0.0
        if h != 0.0:
            c0 = _across(a0, k0)
            work[_MEAN + p] = 0.5 * (x + math.copysign(math.sqrt(dot(c0, c0)), model.branch_strains[row.branch + p].x0))
    mean, end, added = work[_MEAN:_END], work[_END:_ADDED], work[_ADDED:_LAST]
    return relax_strains(row.prony, row.prony_end, row.branch, COUNT, h, mean, end, model, added)


@inlined
def _stress(row, p, part, model):
    """What relaxation adds at point p by the past alone, strains of start and end, and its factor of their mean."""
    mean, end = model.work[_MEAN + p], model.work[_END + p]
    past = model.work[_ADDED + p] - part * mean
    return past, 2.0 * mean - end, end, past * math.copysign(1.0 / max(abs(mean), row.least), mean)


@inlined
def _through(a0, k0, a1, k1, x0, x1):
    """The vector p of the notes of a step through straight."""
    c0, c1 = _across(a0, k0), _across(a1, k1)
    u0, u1 = _sum(1.0 / x0, c0, 0.0, c0), _sum(1.0 / x1, c1, 0.0, c1)
    c = max(dot(u0, u1), 0.0)
    turn = (x0 + x1) / max(x0 * x0, x1 * x1)
    return _sum((1.0 - turn * (x1 - c * x0)) / (1.0 + c), u0, (1.0 - turn * (x0 - c * x1)) / (1.0 + c), u1)


@inlined
def _squares(a0, k0, a1, k1):
    """Means of a.a, a.k and k.k."""
    return (
        0.5 * (dot(a0, a0) + dot(a1, a1)), 0.5 * (dot(a0, k0) + dot(a1, k1)), 0.5 * (dot(k0, k0) + dot(k1, k1))
    )  # fmt: skip


@inlined
def _factors(row, p, model):
    """Factors by which a and k at point p are sums of an element's vectors, times the root of E I times its length."""
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
            past, x0, x1, ratio = _stress(row, p, part, model)
            A, P, Q = _squares(a0, k0, a1, k1)
            factor = part if x0 * x1 < 0.0 else part + ratio
            on_a, on_k = _sum(factor * Q, a, -factor * P, k), _sum(factor * A, k, -factor * P, a)
            if x0 * x1 < 0.0:
                by = _through(a0, k0, a1, k1, x0, x1)
                on_a, on_k = _sum(1.0, on_a, past, _across(k, by)), _sum(1.0, on_k, past, _across(by, a))
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
            a0, k0, a1, k1, a, k = _ends(row, p, interval, model)
            past, x0, x1, ratio = _stress(row, p, part, model)
            A, P, Q = _squares(a0, k0, a1, k1)
            S, C = _factors(row, p, model)
            factor, slope, moment = part + ratio, 0.0, (0.0, 0.0, 0.0)
            if x0 * x1 < 0.0:
                factor, moment = part, _through(a0, k0, a1, k1, x0, x1)
                moment = _sum(past, moment, 0.0, moment)
            elif abs(x0 + x1) > 2.0 * row.least and x1 != 0.0:
                slope = -2.0 * ratio / ((x0 + x1) * x1)
            A1, P1, Q1 = dot(a1, a1), dot(a1, k1), dot(k1, k1)
            left, right = (_sum(Q, a, -P, k), _sum(A, k, -P, a)), (_sum(Q1, a1, -P1, k1), _sum(A1, k1, -P1, a1))
            for r in range(3):
                for s in range(3):
                    one = 1.0 if r == s else 0.0
                    turned = _turned(moment, r, s)
                    aa = factor * (Q * one - k[r] * k1[s]) + slope * left[0][r] * right[0][s]
                    ak = factor * (2.0 * a[r] * k1[s] - k[r] * a1[s] - P * one) + slope * left[0][r] * right[1][s]
                    ka = factor * (2.0 * k[r] * a1[s] - a[r] * k1[s] - P * one) + slope * left[1][r] * right[0][s]
                    kk = factor * (A * one - a[r] * a1[s]) + slope * left[1][r] * right[1][s]
                    ak, ka = ak - turned, ka + turned
                    for i in range(3):
                        for j in range(3):
                            K[3 * i + 3 + r, 3 * j + 3 + s] += (
                                S[i] * (aa * S[j] + ak * C[j]) + C[i] * (ka * S[j] + kk * C[j])
                            )
        cable.fill_first_position(K)
        ancf_beams.add_with_mass(matrix, element.iv - model.info.nq, 12, K, 0.0, model.M[element.mass])


@inlined
def _turned(m, r, s):
    """Entry of the matrix by which m x v is of v."""
    if (r + 1) % 3 == s:
        return -m[(r + 2) % 3]
    return m[(r + 1) % 3] if (r + 2) % 3 == s else 0.0


@inlined
def _energy(row, p, x, model):
    """What relaxation changes the energy of point p by, at the curvature x."""
    return 0.5 * row.roots[p] ** 2 * excess_of(row.prony, row.prony_end, row.branch, COUNT, p, x, model)


@calls.energy
def energy(interval, model, out):
    """What relaxation changes the energies of bending of all elements by."""
    rows = model.bend_relaxations
    for k in range(rows.size):
        for p in range(COUNT):
            x, _ = _bent(rows[k], p, interval.ym, model)
            changed = _energy(rows[k], p, x, model)
            out[1] += changed
            out[2] += changed


@calls.force
def end_step(interval, model):
    """What relaxation of the bending of all elements takes over a step; the sides to which they bend."""
    rows, h, y, taken = model.bend_relaxations, interval.step.h, interval.y1, 0.0
    for k in range(rows.size):
        row = rows[k]
        for p in range(COUNT):
            taken += row.roots[p] ** 2 * relaxed_one(row.prony, row.prony_end, row.branch, COUNT, p, h, model)
            (x, c), at = _bent(row, p, y, model), row.account + 3 * p
            if abs(x) >= row.least:
                x = math.copysign(x, model.branch_strains[row.branch + p].x)
                for i in range(3):
                    y[at + i] = c[i] / x
    interval.powers[STIFFNESS_DAMPING] += taken


@calls.force
def evaluate(interval, model):
    """Relaxed moments, and what they do along the axis, into the records of all elements; energies of their beams."""
    rows, work, y = model.bend_relaxations, model.work, interval.ym
    for k in range(rows.size):
        row, element = rows[k], model.elements[rows[k].element]
        beam, x, added = model.beams[element.beam], work[_END:_ADDED], work[_ADDED:_LAST]
        for p in range(COUNT):
            x[p], _ = _bent(row, p, y, model)
            added[p], changed = 0.0, _energy(row, p, x[p], model)
            beam.elastic += changed
            beam.bending += changed
        add_branches(row.prony, row.prony_end, row.branch, COUNT, 0, x, model, added)
        for p in range(COUNT):
            EI, side = model.parameters[element.section + OF_CABLE * p + 1], math.copysign(1.0, x[p])
            element.bending_moment[p] = abs(element.bending_moment[p] + EI * side * added[p])
            a, _ = _vectors(row, p, element.iq, y, model)
            element.axial_force[p] += EI * x[p] * added[p] / math.sqrt(dot(a, a))


# element: of a cable; account: index in the state of the directions to which positive curvatures bend at both points;
# roots: of E I times the length of both points, N1/2 m3/2; least: curvature below which it has no direction, 1/m
BEND_RELAXATIONS = Family(
    "bend_relaxations",
    record("element prony prony_end branch account", "roots least", roots=(COUNT,)),
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
        roots = np.sqrt(B[:, 3]) * length / STRAIGHT
        vectors = np.stack([start[3:6], start[6:9] - start[:3], start[9:]])
        slopes = np.array([slope_factors(length, xi) for xi in POINTS[:COUNT]]) @ vectors
        bends = np.linalg.norm(np.cross(slopes, B[:, :3] @ vectors), axis=1) / roots
        builder.add(
            "bend_relaxations", element=first + k, **terms, roots=roots, least=_STRAIGHT / length,
            branch=relaxation.add_branches(builder, terms, bends),
        )  # fmt: skip
