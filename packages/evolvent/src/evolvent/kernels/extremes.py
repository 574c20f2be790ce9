"""Least and largest values over all steps of results in records (`Samples.extremes`)."""

from evolvent.compiled.jit import inlined


@inlined
def note_extremes(extremes, k, value):
    """Update the least and the largest value of the k-th result of a record.

    extremes : (2 m,) float, least and largest value of each of m results in turn
    """
    extremes[2 * k] = min(extremes[2 * k], value)
    extremes[2 * k + 1] = max(extremes[2 * k + 1], value)
