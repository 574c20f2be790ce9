"""Relaxation of beams and cables of viscoelastic materials.

The strains that relax are the products of an element's nodal vectors less those of its shape without stress, of which
its energy is quadratic (`kernels.ancf`): s = H (x + sum g (w - x)) with their branches' strains w. Of a cable these are
the membrane alone, since its bending is linear in the products: `family_bends`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.compiled.jit import REAL, VECTOR, entry, inlined
from evolvent.compiled.views import matrix_view
from evolvent.families.beams import cable
from evolvent.families.beams.beam_strains import MIDDLE, OF_BEAM, OF_CABLE, POINTS
from evolvent.families.relaxation import family as relaxation
from evolvent.kernels import ancf, ancf_beams, calls
from evolvent.kernels.ancf_beams import BEAM
from evolvent.kernels.viscoelastic import add_branches, branch_energy, relax_strains, relaxed_by, stiffness_factor
from evolvent.model.family import Family, record
from evolvent.model.powers import STIFFNESS_DAMPING
from evolvent.model.questions import Implicit, Samples, Stability

Array = np.ndarray
#: Nodal vectors of an element, by kind of beam.
_VECTORS = (cable.N, ancf.N)
#: Places in the scratch `Model.work`: vectors, their rates, products at the mean and the end; what relaxation adds
#: and stresses stand behind.
_V, _W, _MEAN, _END = 0, 21, 42, 70


@inlined
def _vectors(k, model):
    """Nodal vectors of the element of record k: their number n, and that of their products."""
    n = _VECTORS[model.beams[model.elements[model.beam_relaxations[k].element].beam].kind]
    return n, n * (n + 1) // 2


@inlined
def _relax(k, n, interval, model, out):
    """What relaxation adds to the products of element k over an interval, into `out`; its n vectors into `work`."""
    row, work, m = model.beam_relaxations[k], model.work, n * (n + 1) // 2
    iq, iv, h = model.elements[row.element].iq, model.elements[row.element].iv, interval.step.h
    v, w, mean, end = work[_V:_W], work[_W:_MEAN], work[_MEAN:_END], work[_END : _END + m]
    ancf.nodal_vectors(interval.ym[iq : iq + 3 * n + 3], n, v)
    ancf.nodal_vectors(interval.ym[iv : iv + 3 * n + 3], n, w)
    ancf.products(v, n, mean)
    for i in range(m):
        end[i] = mean[i]
    if h != 0.0:
        ancf.add_product_rates(w, w, 0.125 * h * h, n, mean)
        ancf.add_product_rates(w, w, 0.125 * h * h, n, end)
        ancf.add_product_rates(v, w, 0.5 * h, n, end)
    for i in range(m):
        rest = model.parameters[row.rest + i]
        mean[i] -= rest
        end[i] -= rest
        out[i] = 0.0
    relax_strains(row.prony, row.prony_end, row.branch, m, h, mean, end, model, out)


@calls.force
def force(interval, model):
    """Forces by which relaxation changes those of all elements."""
    rows = model.beam_relaxations
    for k in range(rows.size):
        n, m = _vectors(k, model)
        out, s = model.work[_END + m : _END + 2 * m], model.work[_END + 2 * m : _END + 3 * m]
        _relax(k, n, interval, model, out)
        at, H = model.elements[rows[k].element].iv - model.info.nq, model.H[model.elements[rows[k].element].form]
        ancf.multiply(H, out, n, s)
        ancf.add_force(s, model.work[_V:_W], n, model.F[at : at + 3 * n + 3])


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    rows, h, work, K = model.beam_relaxations, interval.step.h, model.work, model.K24
    for k in range(rows.size):
        n, m = _vectors(k, model)
        out, s, v, w = work[_END + m : _END + 2 * m], work[_MEAN:_END], work[_V:_W], work[_W:_MEAN]
        _relax(k, n, interval, model, out)
        element = model.elements[rows[k].element]
        H, at = model.H[element.form], element.iv - model.info.nq
        ancf.multiply(H, out, n, s)
        factor = stiffness_factor(rows[k].prony, rows[k].prony_end, h, model) - 1.0
        for i in range(3 * n):
            w[i] = factor * (v[i] + 0.5 * h * w[i])
        ancf.write_tangent(H, s, v, w, n, matrix_view(work, _END, 3 * n, m), K)
        ancf_beams.add_with_mass(matrix, at, 3 * n + 3, K, 0.0, model.M[element.mass])


@inlined
def _strains(k, n, y, model, x):
    """Strains x of element k, of n vectors, in a state."""
    row, v = model.beam_relaxations[k], model.work[_V:_W]
    iq = model.elements[row.element].iq
    ancf.nodal_vectors(y[iq : iq + 3 * n + 3], n, v)
    ancf.products(v, n, x)
    for i in range(n * (n + 1) // 2):
        x[i] -= model.parameters[row.rest + i]


@inlined
def _energy(k, m, H, x, model):
    """What relaxation changes the energy of element k by, by a form H of m products."""
    row, found = model.beam_relaxations[k], 0.0
    for i in range(row.prony_end - row.prony):
        share = model.prony_terms[row.prony + i].share
        found += branch_energy(share, model.branch_strains, row.branch + m * i, H, 0, m)
        for a in range(m):
            part = 0.0
            for b in range(m):
                part += H[a, b] * x[b]
            found -= 0.5 * share * part * x[a]
    return found


@calls.energy
def energy(interval, model, out):
    """What relaxation changes the energies of all elements by."""
    rows, x = model.beam_relaxations, model.work[_MEAN:_END]
    for k in range(rows.size):
        n, m = _vectors(k, model)
        _strains(k, n, interval.ym, model, x)
        element = model.elements[rows[k].element]
        out[1] += _energy(k, m, model.H[element.form], x, model)
        out[2] += _energy(k, m, model.H[element.bending], x, model)


@calls.force
def end_step(interval, model):
    """What relaxation of all elements takes over a step."""
    rows, taken, h = model.beam_relaxations, 0.0, interval.step.h
    for k in range(rows.size):
        if h > 0.0:
            H, (_, m) = model.H[model.elements[rows[k].element].form], _vectors(k, model)
            taken += relaxed_by(rows[k].prony, rows[k].prony_end, rows[k].branch, m, H, h, model)
    interval.powers[STIFFNESS_DAMPING] += taken


@inlined
def _product(out, i, j):
    return out[ancf.pair(i, j, ancf.N)]


@entry(REAL, REAL, VECTOR, VECTOR)
@inlined
def _line(length, xi, out, strains):
    """Strains of the axis (`ancf.line_strains`) of products `out` of the nodal vectors, linear in these."""
    # factors of a = r,x, b, b', c, c' by the nodal vectors: slopes p, y, z of the first node, d, slopes of the second
    a = (1.0 - 4.0 * xi + 3.0 * xi * xi, 0.0, 0.0, 6.0 * xi * (1.0 - xi) / length, 3.0 * xi * xi - 2.0 * xi, 0.0, 0.0)
    b, b1 = (0.0, 1.0 - xi, 0.0, 0.0, 0.0, xi, 0.0), (0.0, -1.0 / length, 0.0, 0.0, 0.0, 1.0 / length, 0.0)
    c, c1 = (0.0, 0.0, 1.0 - xi, 0.0, 0.0, 0.0, xi), (0.0, 0.0, -1.0 / length, 0.0, 0.0, 0.0, 1.0 / length)
    for i in range(9):
        strains[i] = 0.0
    for i in range(ancf.N):
        for j in range(ancf.N):
            g = _product(out, i, j)
            strains[0] += 0.5 * a[i] * a[j] * g
            strains[1] += a[i] * b[j] * g
            strains[2] += a[i] * c[j] * g
            strains[3] += 0.5 * (b1[i] * c[j] - c1[i] * b[j]) * g
            strains[4] += a[i] * b1[j] * g
            strains[5] += a[i] * c1[j] * g
            strains[6] += 0.5 * b[i] * b[j] * g
            strains[7] += 0.5 * c[i] * c[j] * g
            strains[8] += b[i] * c[j] * g


@inlined
def _evaluate_beam(element, i, out, off, S, interval, model):
    """Add what relaxation changes forces and moments at point i of a beam's element by; returns that of its axis."""
    p, e = model.parameters, interval.ym[element.iq : element.iq + 24]
    at, N, shear_y, shear_z, square = element.section + OF_BEAM * i, 0.0, 0.0, 0.0, 0.0
    _line(element.length, POINTS[i], out, off)
    for r in range(9):
        S[r] = 0.0
        for c in range(9):
            S[r] += p[at + 9 * r + c] * off[c]
    for r in range(3):
        a, b, b1, c, c1 = ancf.line_vectors(e, element.length, POINTS[i], r)
        g = S[0] * a + S[1] * b + S[2] * c + S[4] * b1 + S[5] * c1
        N, shear_y, shear_z, square = N + g * a, shear_y + g * b, shear_z + g * c, square + a * a
    if i < 2:
        element.shear_force_y[i] += shear_y
        element.shear_force_z[i] += shear_z
    if i == MIDDLE:
        element.torsional_moment += S[3]
        element.bending_moment_y += S[5]
        element.bending_moment_z -= S[4]
    return N / np.sqrt(square)


@inlined
def _evaluate_cable(element, i, out, x, model):
    """What relaxation changes the axial force at point i of a cable's element by; x : products in the state."""
    a, square, strain, row = cable.slope_factors(element.length, POINTS[i]), 0.0, 0.0, 0
    for r in range(cable.N):
        for c in range(r, cable.N):
            g = (0.5 if r == c else 1.0) * a[r] * a[c]
            strain += g * out[row]
            square += 2.0 * g * x[row]
            row += 1
    return model.parameters[element.section + OF_CABLE * i] * strain * np.sqrt(square)


@calls.force
def evaluate(interval, model):
    """Relaxed forces and moments of all elements into their records, and energies into those of their beams."""
    rows, work = model.beam_relaxations, model.work
    for k in range(rows.size):
        element, pull, (n, m) = model.elements[rows[k].element], 0.0, _vectors(k, model)
        x, out = work[_MEAN:_END], work[_END : _END + m]
        off, S = work[_END + m : _END + m + 9], work[_END + m + 9 : _END + m + 18]
        _strains(k, n, interval.ym, model, x)
        beam = model.beams[element.beam]
        beam.elastic += _energy(k, m, model.H[element.form], x, model)
        beam.bending += _energy(k, m, model.H[element.bending], x, model)
        for i in range(m):
            out[i] = 0.0
        add_branches(rows[k].prony, rows[k].prony_end, rows[k].branch, m, 0, x, model, out)
        if beam.kind != BEAM:
            ancf.products(work[_V:_W], n, x)
        for i in range(len(POINTS)):
            if beam.kind == BEAM:
                N = _evaluate_beam(element, i, out, off, S, interval, model)
            else:
                N = _evaluate_cable(element, i, out, x, model)
            if i < 2:
                element.axial_force[i] += N
                pull -= 0.5 * N
            else:
                pull += (5.0, 8.0, 5.0)[i - 2] / 18.0 * N
        for i in range(2):
            element.axial_force[i] += pull


# element: of a beam; rest: index among the parameters of the products without stress
BEAM_RELAXATIONS = Family(
    "beam_relaxations",
    record("element prony prony_end branch rest"),
    order=31,
    of="beams",
    force=force,
    tangent=tangent,
    energy=energy,
    of_step=False,
    stability=Stability(by_rates=False),
    implicit=Implicit(end_step=end_step),
    samples=Samples(evaluate=evaluate),
)  # fmt: skip


def kept(model: Any, index: int) -> relaxation.LineSet:
    """Deformation of a beam that it keeps just after all stress is released at once, in the middle of each element."""
    rows = [row for row in model.beam_relaxations if model.elements[int(row["element"])]["beam"] == index]
    lengths = np.array([model.elements[int(row["element"])]["length"] for row in rows])
    found = np.zeros((len(rows), 9))
    for row, length, own in zip(rows, lengths.tolist(), found, strict=True):
        _line(length, 0.5, relaxation.set_of(model, row, ancf.PRODUCTS), own)
    components = {"curvature about z": -found[:, 4], "curvature about y": found[:, 5], "twist": found[:, 3]}
    return relaxation.LineSet(lengths, components, found[:, 0])


def _products(e: Array) -> Array:
    """Products of the nodal vectors of an element with the coordinates e (3 n + 3,)."""
    n = e.size // 3 - 1
    v, second = e[3:].copy(), 3 * (n // 2)
    v[second : second + 3] -= e[:3]
    vectors = v.reshape(n, 3)
    return (vectors @ vectors.T)[np.triu_indices(n)]


def add_relaxation(builder: Any, terms: dict[str, int], first: int, starts: Array, rests: Array) -> None:
    """Write the relaxation of the products of the elements of a beam, which have been written.

    Parameters
    ----------
    builder : evolvent.assembly.builder.Builder
    terms : as of `evolvent.families.relaxation.family.add_terms`
    first : int, its first element
    starts, rests : (n, 24) float, or (n, 12) of a cable, coordinates of the elements at the start and without stress
    """
    for k, (start, rest) in enumerate(zip(starts, rests, strict=True)):
        own = _products(rest)
        builder.add(
            "beam_relaxations", element=first + k, **terms, rest=builder.parameters(own.tolist())[0],
            branch=relaxation.add_branches(builder, terms, _products(start) - own),
        )  # fmt: skip
