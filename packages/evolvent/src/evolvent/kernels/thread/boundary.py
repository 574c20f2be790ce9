"""Segment between a spool and the last node off it, whose natural length b grows as the thread is paid out.

Its stiffness is that of a whole segment, c, whatever its length, or follows it: c f(b) with f = l0/max(b, S), S > 0 the
shortest length that counts; its damping likewise. The energy U = c f (l - b)^2/2 then changes with b beyond the work of
the tension T: the spool is turned by -dU/db = T + W. Above S, where W = -c f' (l - b)^2/2 = U/b, W is the strain energy
per length, and T + W = T (1 + strain/2).

Over an interval, f is the mean of both ends, f' the quotient of their differences, and (l - b)^2 the mean of the
squares: T and W then do the work U1 - U0.
"""

from evolvent.compiled.jit import inlined


@inlined
def length_factor(threads, p, rest):
    """Stiffness of the segment at the spool of natural length `rest` over that of a whole one, and its derivative."""
    l0, shortest = threads[p].segment, threads[p].shortest
    if shortest == 0.0:
        return 1.0, 0.0
    if rest < shortest:
        return l0 / shortest, 0.0
    return l0 / rest, -l0 / (rest * rest)


@inlined
def interval_factor(h, threads, p):
    """`length_factor` of thread p over an interval of length h; of a state, h = 0.

    Returns
    -------
    factor, slope : the mean, and the quotient of differences by the natural length, 1/m
    end, bend : derivatives by the natural length at the end: of the factor there, 1/m, and of `slope`, 1/m2
    """
    if threads[p].shortest == 0.0:
        return 1.0, 0.0, 0.0, 0.0
    if h == 0.0:
        factor, slope = length_factor(threads, p, threads[p].b[0])
        return factor, slope, slope, (-slope / threads[p].b[0] if slope != 0.0 else 0.0)
    b0, b1 = threads[p].rest0, threads[p].rest1
    f0, s0 = length_factor(threads, p, b0)
    f1, s1 = length_factor(threads, p, b1)
    slope = bend = 0.0
    if s0 != 0.0 and s1 != 0.0:
        slope = -f0 * f1 / threads[p].segment
        bend = -slope / b1
    elif s0 != 0.0 or s1 != 0.0:  # one above and one below the shortest length
        slope = (f1 - f0) / (b1 - b0)
        bend = (s1 - slope) / (b1 - b0)
    return 0.5 * (f0 + f1), slope, s1, bend


@inlined
def mean_square(h, p, k, model):
    """Mean of the squares of the elongation of the segment at the spool, k the number of its node; that at the end.

    Of a segment that goes slack without its contractions.
    """
    threads, nodes = model.threads, model.nodes
    e0 = e1 = nodes[k].length - threads[p].b[0]
    if h != 0.0:
        e0, e1 = nodes[k].extension0, nodes[k].extension1
    if threads[p].slack != 0:
        e0, e1 = max(e0, 0.0), max(e1, 0.0)
    return 0.5 * (e0 * e0 + e1 * e1), e1


@inlined
def pull_slopes(h, along, p, model):
    """Derivatives of what the segment at the spool p pulls with, after its force; over a step twice those by its end.

    Parameters
    ----------
    along : float, N/m, derivative of the tension by the length of the segment (`springs.segment_slope`)

    Returns
    -------
    tension by the length paid out; pull on a free spool by the length of the segment, and by that paid out : N/m
    """
    threads, k = model.threads, model.threads[p].node + model.switches[p] - 1
    if threads[p].shortest == 0.0:
        return -along, along, -along
    c = threads[p].stiffness
    factor, slope, end, bend = interval_factor(h, threads, p)
    squares, e1 = mean_square(h, p, k, model)
    by_out = -along + model.nodes[k].tension * end / factor
    return by_out, along - c * slope * e1, by_out + c * (e1 * slope - squares * bend)
