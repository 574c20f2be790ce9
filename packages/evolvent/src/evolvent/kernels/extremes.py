"""Least and largest values over all steps of fields of records that are results (`Samples.extremes`)."""

from evolvent.compiled.jit import inlined


@inlined
def note_extremes(extremes, k, value):
    """Take a value of the k-th of the fields into the least and the largest ones so far of a record."""
    extremes[2 * k] = min(extremes[2 * k], value)
    extremes[2 * k + 1] = max(extremes[2 * k + 1], value)
