"""Segments that relax: the elongation of a viscoelastic segment as a strain with a memory (`kernels.viscoelastic`).

The strain is X = f e, of the elongation e and the factor f of the segment's stiffness (`boundary`): the elongation that
a whole segment would have. The tension is that of the stiffness c of a whole segment on X, and the energy U = c B psi,
with B = 1/f and psi the energy of X over c. Where the length b at the spool changes B, thread that leaves the spool has
the memory of what is out, and the spool is turned by T + W with W = (T X - c psi) dB/db, which is the strain energy per
length where nothing has relaxed. Over a step, with means m of both ends, tension and W do the work

    T (e1 - e0) - W (b1 - b0) = U1 - U0 + c B_m D,    W = (T X_m - c psi_m) (B1 - B0)/(b1 - b0)

exactly, D what relaxation takes over c at constant B. Among the accounts of a state are the strains of the dashpots,
which stay where X jumps, as where a node goes back onto its spool.
"""

import numpy as np
from numba import types

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.kernels.slack import pull, recovered
from evolvent.kernels.thread.boundary import length_factor
from evolvent.kernels.viscoelastic import (
    excess_square,
    is_kept,
    lost_square,
    relax,
    relaxed_over,
    stiffness_factor,
)
from evolvent.model import MODEL, having

USED_FOR = having("threads", prony_end=lambda found: found > 0)
_I = types.int64


@inlined
def relaxes(threads, p):
    """Whether thread p is viscoelastic."""
    return threads[p].prony_end != 0


@inlined
def _strain(h, start, extension, p, k, model):
    """Tension over c by the strains X at both ends of a step (of a state the same), and factor of its stiffness."""
    threads = model.threads
    first, last, branch = threads[p].prony, threads[p].prony_end, model.nodes[k].branch
    if threads[p].slack != 0:
        stress, _, factor = pull(first, last, branch, h, start, extension, model)
        return stress, factor
    if is_kept(h, model):
        for i in range(branch, branch + last - first):
            model.branch_strains[i].w, model.branch_strains[i].rate = extension + model.branch_strains[i].kept, 0.0
    mean = 0.5 * (start + extension)
    added, factor = relax(first, last, branch, h, mean, extension, model)
    return mean + added, factor


@inlined
def _psi(p, k, model):
    """Energy of the strain of segment k over c, at its last evaluation."""
    branch, first, last = model.nodes[k].branch, model.threads[p].prony, model.threads[p].prony_end
    x = model.branch_strains[branch].x
    return 0.5 * (x * x + excess_square(first, last, branch, x, model))


@inlined
def _psi_before(p, k, model):
    """Energy of the strain of segment k over c, of the last state that was accepted."""
    first, branch, rows = model.threads[p].prony, model.nodes[k].branch, model.branch_strains
    x = rows[branch].x0
    found = x * x
    for i in range(model.threads[p].prony_end - first):
        w = rows[branch + i].w0
        found += model.prony_terms[first + i].share * (w * w - x * x)
    return 0.5 * found


@inlined
def _growth(h, p, threads):
    """dB/db of the segment at the spool, 1/m: of a state, or the quotient of differences over a step."""
    l0, shortest = threads[p].segment, threads[p].shortest
    if shortest == 0.0:
        return 0.0
    b0, b1 = threads[p].rest0, threads[p].rest1
    if h == 0.0 or b0 == b1:
        return 1.0 / l0 if threads[p].b[0] >= shortest else 0.0
    return (max(b1, shortest) - max(b0, shortest)) / (l0 * (b1 - b0))


@indirect(types.UniTuple(REAL, 2)(REAL, types.boolean, REAL, _I, _I, MODEL))
def relaxing_tension(h, leaves, extension, p, k, model):
    """Elastic tension of the segment at node k of thread p; its slope goes to the node's record, W to the thread's.

    Parameters
    ----------
    h : float, s, of a step, after `measure_segments` of both ends, 0 of a state
    leaves : bool, whether the segment is the one at the spool
    extension : float, m, of a state

    Returns
    -------
    tension : float, N; lost : float, W, what relaxation takes in a state of an explicit method, else 0
    """
    threads, nodes, c, lost = model.threads, model.nodes, model.threads[p].stiffness, 0.0
    f0 = f1 = 1.0
    if leaves:
        f1 = length_factor(threads, p, threads[p].b[0] if h == 0.0 else threads[p].rest1)[0]
        f0 = f1 if h == 0.0 else length_factor(threads, p, threads[p].rest0)[0]
    start, end = f1 * extension, f1 * extension
    if h != 0.0:
        start, end = f0 * nodes[k].extension0, f1 * nodes[k].extension1
    stress, nodes[k].along = _strain(h, start, end, p, k, model)
    nodes[k].along *= 2.0 * f1 / (f0 + f1)
    if is_kept(h, model):
        first, last, branch = threads[p].prony, threads[p].prony_end, nodes[k].branch
        lost = c / f1 * lost_square(first, last, branch, model)
    if leaves and threads[p].shortest != 0.0:
        psi = _psi(p, k, model)
        if h != 0.0:
            psi = 0.5 * (psi + _psi_before(p, k, model))
        threads[p].line_energy = c * (0.5 * stress * (start + end) - psi) * _growth(h, p, threads)
    return c * stress, lost


@inlined
def relaxing_slope(h, p, k, model):
    """Factor of the stiffness of the segment at node k of thread p, as `relaxing_tension` leaves it."""
    threads = model.threads
    if h != 0.0 or threads[p].slack != 0:
        return model.nodes[k].along
    return stiffness_factor(threads[p].prony, threads[p].prony_end, h, model)


@indirect(REAL(types.boolean, REAL, _I, _I, MODEL))
def relaxing_energy(leaves, extension, p, k, model):
    """Energy of the segment at node k of thread p in a state, J; leaves: whether it is the one at the spool."""
    f = length_factor(model.threads, p, model.threads[p].b[0])[0] if leaves else 1.0
    _strain(0.0, f * extension, f * extension, p, k, model)
    return model.threads[p].stiffness / f * _psi(p, k, model)


@indirect(REAL(REAL, REAL, _I, MODEL))
def _relaxed_thread(h, share, p, model):
    """What relaxation of thread p takes (`relaxed_threads`), over its stiffness and its copies."""
    threads, nodes, s, taken = model.threads, model.nodes, model.switches, 0.0
    first, last, count = threads[p].prony, threads[p].prony_end, s[p] - (1 if s[threads.size + p] != 0 else 0)
    for i in range(count):
        k, f, part, rest = threads[p].node + i, 1.0, 1.0, threads[p].element
        if i == s[p] - 1:
            rest = threads[p].b[0] if share == 1.0 else threads[p].rest1
            f = length_factor(threads, p, rest)[0]
            part = 1.0 / f
            if share != 1.0:
                part = 0.5 * (part + 1.0 / length_factor(threads, p, threads[p].rest0)[0])
        taken += part * relaxed_over(first, last, nodes[k].branch, h, model)
        if threads[p].slack != 0:
            end = f * (nodes[k].length - rest if share == 1.0 else nodes[k].extension1)
            taken += part * recovered(first, last, nodes[k].branch, h, end, model)
    return taken


@inlined
def relaxed_threads(h, share, model):
    """What relaxation of all threads takes over a step of length h that is accepted, J.

    Parameters
    ----------
    share : 1 where the last evaluation was one of the step's end, 0.5 where it was one of the step
    """
    threads, taken = model.threads, 0.0
    for p in range(threads.size):
        if h > 0.0 and relaxes(threads, p):
            taken += threads[p].copies * threads[p].stiffness * _relaxed_thread(h, share, p, model)
    return taken


@inlined
def begin_strains(y, s, model):
    """After an event that was evaluated last: segments that are out go on from their strains, wound ones have none.

    A segment that becomes the one at the spool as its node goes back jumps to another strain.
    """
    threads, rows = model.threads, model.branch_strains
    for p in range(threads.size):
        count = threads[p].prony_end - threads[p].prony
        for i in range(threads[p].n if count > 0 else 0):
            first = model.nodes[threads[p].node + i].branch
            for k in range(first, first + count):
                if i >= s[p]:
                    rows[k].x = rows[k].w = rows[k].rate = rows[k].kept = y[rows[k].account] = 0.0
                rows[k].x0, rows[k].w0 = rows[k].x, rows[k].w


def strains_of(model):
    """Rows of `branch_strains` that are those of threads. Not compiled."""
    threads, nodes = model.threads, model.nodes
    counts = np.repeat(threads["prony_end"] - threads["prony"], threads["n"])
    return np.repeat(nodes["branch"] - np.cumsum(counts) + counts, counts) + np.arange(counts.sum())
