"""Compiled functions that evaluate the states of a finished run."""

from __future__ import annotations

from numba import types, void

from evolvent.compiled.jit import INTEGERS, MATRIX, REAL, VECTOR, indirect, inlined
from evolvent.compiled.pointer import number_at, put_number_at
from evolvent.equations.inventory import inventory
from evolvent.equations.rhs import rhs, set_state
from evolvent.kernels import rigid
from evolvent.kernels.calls import force_at
from evolvent.model import MODEL
from evolvent.model.interval import sample_interval

_3D, _4D = types.Array(REAL, 3, "C"), types.Array(REAL, 4, "C")
_INTEGERS_2D = types.Array(types.int64, 2, "C")


@indirect(
    void(
        VECTOR, MATRIX, _INTEGERS_2D, MATRIX, MODEL, _3D, _3D, MATRIX, _3D, _4D, _3D, _3D, _3D,
        MATRIX, _3D,
    )
)  # fmt: skip
def fill_observations(times, Y, S, LA, model, position, velocity, tension, spool, R, X, V, W, sums, thread_sums):
    """Fill `observations.Observations`, all but the first five arguments, from the states Y, S, LA at `times`."""
    bodies, threads, nodes = model.bodies, model.threads, model.nodes
    for n in range(times.size):
        prepare_sample(times, n, Y[n], S[n], LA[n], 1.0, model)
        for k in range(nodes.size):
            tension[n, k] = nodes[k].tension
            for c in range(3):
                position[n, k, c], velocity[n, k, c] = nodes[k].x[c], nodes[k].v[c]
        for p in range(threads.size):
            spool[n, p, 0], spool[n, p, 1] = threads[p].phi, threads[p].turning
            for i in range(threads[p].sums.size):
                thread_sums[n, p, i] = threads[p].sums[i]
        inventory(times[n], Y[n], S[n], model, sums[n])
        for b in range(bodies.size):
            for c in range(3):
                X[n, b, c] = bodies[b].x[c]
                V[n, b, c] = bodies[b].v[c]
                W[n, b, c] = bodies[b].w[c]
                for d in range(3):
                    R[n, b, c, d] = bodies[b].R[c, d]


@inlined
def _at_sample(times, n, factor, model):
    """Set the numbers of the interval of sample n."""
    at = model.interval
    set_state(times[n], -1.0, at)
    at.factor, at.sample = factor, n
    return at


def _has_rates(model):
    return model.samples_rates_calls.size > 0


@indirect(void(VECTOR, types.int64, VECTOR, INTEGERS, VECTOR, REAL, MODEL), used_for=_has_rates)
def evaluate_rates(times, n, y, s, la, factor, model):
    """Fields of sample n that follow from the rates of explicit methods."""
    rhs(times[n], y, s, model, model.dy[0])
    at, powers, calls = _at_sample(times, n, factor, model), model.powers, model.samples_rates_calls
    interval = sample_interval(at, y, model.dy[0], la, la, powers, s, model.dy[0], times)
    for k in range(calls.size):
        force_at(model, calls[k])(interval, model)


@inlined
def prepare_sample(times, n, y, s, la, factor, model):
    """What the evaluation of sample n needs, and fields that follow from the rates of explicit methods."""
    at, powers, calls = _at_sample(times, n, factor, model), model.powers, model.samples_prepare_calls
    interval = sample_interval(at, y, model.dy[0], la, la, powers, s, model.dy[0], times)
    for k in range(calls.size):
        force_at(model, calls[k])(interval, model)
    if model.samples_rates_calls.size > 0:
        evaluate_rates(times, n, y, s, la, factor, model)


@indirect(void(types.int64, VECTOR, VECTOR, INTEGERS, VECTOR, REAL, MODEL))
def evaluate(n, times, y, s, la, factor, model):
    """Fields that are results, at sample n with the multipliers la of joints and a load factor, into the records.

    Joints are evaluated where la has theirs; without threads and bearings, which read them, it may be empty. The factor
    then stands in the records of fields as their `scale`. Samples follow each other: works go on from the sample
    before, and the first one, 0, starts them.
    """
    prepare_sample(times, n, y, s, la, factor, model)
    rigid.kinematics(times[n], y, model)
    at, powers, calls = _at_sample(times, n, factor, model), model.powers, model.samples_evaluate_calls
    interval = sample_interval(at, y, model.dy[0], la, la, powers, s, model.dy[0], times)
    for k in range(calls.size):
        force_at(model, calls[k])(interval, model)
    calls = model.samples_last_calls
    for k in range(calls.size):
        force_at(model, calls[k])(interval, model)


@indirect(void(VECTOR, MATRIX, _INTEGERS_2D, MATRIX, VECTOR, MODEL, _INTEGERS_2D, MATRIX))
def evaluate_samples(times, Y, S, LA, factors, model, fields, out):
    """Evaluate all samples as `evaluate` does one, and keep fields of records of each in a row of `out`.

    Parameters
    ----------
    fields : (m, 4) int, of each field: address in its family's first record, bytes from record to record, number of
        records, and numbers of the field
    out : (nt, n) float, field by field, record by record
    """
    for n in range(times.size):
        evaluate(n, times, Y[n], S[n], LA[n], factors[n], model)
        _copy_fields(fields, out[n])


@inlined
def _copy_fields(fields, out):
    """Copy fields of records to a row of results: see `evaluate_samples`."""
    at = 0
    for i in range(fields.shape[0]):
        for k in range(fields[i, 2]):
            first = fields[i, 0] + k * fields[i, 1]
            for c in range(fields[i, 3]):
                out[at + c] = number_at(first + 8 * c)
            at += fields[i, 3]


@indirect(
    void(INTEGERS, types.int64, VECTOR, MATRIX, _INTEGERS_2D, MATRIX, VECTOR, _INTEGERS_2D, MODEL, _INTEGERS_2D, MATRIX)
)
def evaluate_samples_of_copies(which, size, times, Y, S, LA, factors, moves, model, fields, out):
    """Evaluate the samples of several copies as `evaluate_samples` does those of one model.

    Parameters
    ----------
    which : (k,) int, numbers of the copies
    size : int, distance in bytes between copies in memory
    times : (m,) float, s, the same of all copies
    Y, S, LA, factors : (k m, ...), states, switches, multipliers and load factors, copy by copy
    moves : (n, 3) int, address in `model`, address in copy 0, and number of words of each block of memory that is
        copied to `model` before its copy is evaluated
    fields : as of `evaluate_samples`
    out : (k m, n) float, output, as of `evaluate_samples`, copy by copy
    """
    for k in range(which.size):
        for i in range(moves.shape[0]):
            to, of = moves[i, 0], moves[i, 1] + size * which[k]
            for w in range(moves[i, 2]):
                put_number_at(to + 8 * w, number_at(of + 8 * w))
        for n in range(times.size):
            row = k * times.size + n
            evaluate(n, times, Y[row], S[row], LA[row], factors[row], model)
            _copy_fields(fields, out[row])


@indirect(void(VECTOR, MATRIX, _INTEGERS_2D, MODEL, MATRIX))
def inventories(times, Y, S, model, sums):
    """Energies and momenta of the states Y, S at `times`, a row each, to `sums` (`equations.inventory`)."""
    for n in range(times.size):
        inventory(times[n], Y[n], S[n], model, sums[n])
