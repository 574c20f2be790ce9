"""Fields of records that a run keeps at its samples (`Samples.kept`), in a row of numbers."""

from numba import void

from evolvent.compiled.jit import VECTOR, indirect, inlined
from evolvent.compiled.pointer import array_at, number_at, put_number_at
from evolvent.kernels.calls import note_at
from evolvent.model import MODEL
from evolvent.model.questions import CLEARED


@indirect(void(MODEL, VECTOR))
def write_forces(model, row):
    """Write what the last forces left in their records as a sample's row, field by field, record by record."""
    kept, calls, at = model.kept, model.samples_keep_calls, 0
    for k in range(calls.size):
        note_at(model, calls[k])(model)
    for i in range(kept.shape[0]):
        first = array_at(model, kept[i, 0]) + kept[i, 3]
        for k in range(kept[i, 2]):
            for c in range(kept[i, 4]):
                row[at + c] = number_at(first + k * kept[i, 1] + 8 * c)
            at += kept[i, 4]


@inlined
def restore_cleared(model, row):
    """Write fields that `kinematics` clears, as they stand in a row, back to their records."""
    kept, at = model.kept, 0
    for i in range(kept.shape[0]):
        if kept[i, 5] == CLEARED:
            first = array_at(model, kept[i, 0]) + kept[i, 3]
            for k in range(kept[i, 2]):
                for c in range(kept[i, 4]):
                    put_number_at(first + k * kept[i, 1] + 8 * c, row[at + c])
                at += kept[i, 4]


@inlined
def count_kept(how, model):
    """Number of the numbers in a row that are kept in a way."""
    kept, found = model.kept, 0
    for i in range(kept.shape[0]):
        if kept[i, 5] == how:
            found += kept[i, 2] * kept[i, 4]
    return found
