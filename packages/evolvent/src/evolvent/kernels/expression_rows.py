"""Values of an expression at many points."""

from evolvent.compiled.jit import MATRIX, VECTOR, entry, kernel
from evolvent.kernels.expression import evaluate


@entry(VECTOR, MATRIX, VECTOR)
@kernel
def evaluate_rows(p, variables, found):
    """Write into found : (n,) the values of the program at ``p[0]``; variables : (n, k) float, a row a point."""
    for i in range(found.size):
        found[i] = evaluate(p, 0, variables[i])
