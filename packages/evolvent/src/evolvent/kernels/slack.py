"""Springs that only pull: elastic ones, and viscoelastic ones, which recover while they are slack.

The strain x of a viscoelastic one is the extension e, or larger while it is slack, so that the stress
s = K (x + sum_i g_i (w_i - x)) is never negative: x = max(e, x*), with the strain x* = sum_i g_i (x - w_i) without
stress, which the strains of the dashpots give. Over a step of length h the strain goes at a constant rate to x1, which
is e1, or where the stress at the end of the step is zero,

    x1 = max(e1, -b/a),    a = 1 - sum_i g_i (1 - phi_1),    b = sum_i g_i (w_i exp(-u_i) - phi_1 x0).

The mean stress s over the step does the work s (x1 - x0) that is stored and dissipated (`kernels.viscoelastic`). The
tension T over the step is s W/(e1 - e0), with the part W of e1 - e0 that is taut:

    taut at both ends       x1 - x0 = e1 - e0
    from slack to taut      x1 - x0, or 0 if the strain without stress falls by more than the ends part
    from taut to slack      x1 - x0 if both fall, 0 if x alone rises, e1 - e0 if both rise
    slack at both ends      0

What is left, s (W - (x1 - x0)), is stored energy that goes while the spring is slack: it is lost with that of the
dashpots. The sum is not negative.
"""

from numba import types

from evolvent.compiled.jit import REAL, indirect, inlined
from evolvent.kernels.viscoelastic import branch_strain, decay, decay_of, is_kept
from evolvent.model import MODEL

USED_FOR = "branch_strains"
_I = types.int64
#: Stress over K beside the strain, up to which a spring is slack at the start of a step.
_ROUND_OFF = 1e-12


@inlined
def taut_over(start, end):
    """Mean over an interval of an extension, where it is above zero, and the part of the interval where it is.

    Notes
    -----
    From start to end: with u = max(e, 0), (u1^2 - u0^2)/(2 (e1 - e0)), so that the work is the change of k u^2/2.
    """
    low, high = max(start, 0.0), max(end, 0.0)
    if (start > 0.0) == (end > 0.0) or start == end:
        share = 1.0 if start > 0.0 else 0.0
    else:
        share = (high - low) / (end - start)
    return 0.5 * share * (low + high), share


@inlined
def _is_slack(first, last, branch, model):
    """Whether the spring was slack in the last state that was accepted."""
    rows, x0 = model.branch_strains, model.branch_strains[branch].x0
    stress = x0
    for i in range(last - first):
        stress += model.prony_terms[first + i].share * (rows[branch + i].w0 - x0)
    return stress <= _ROUND_OFF * abs(x0)


@inlined
def _taut_part(slack0, slack1, dx, de):
    """The part W of the change de of the extension that is taut, with the change dx of the strain."""
    if slack0:
        return 0.0 if slack1 else max(dx, 0.0)
    return min(dx, max(de, 0.0)) if slack1 else dx


@inlined
def _kept_strain(first, last, branch, end, model):
    """Strain of a state with the strains of dashpots among the accounts, and that without stress; into the records."""
    rows, free = model.branch_strains, 0.0
    for i in range(last - first):
        free -= model.prony_terms[first + i].share * rows[branch + i].kept
    x = max(end, free)
    for k in range(branch, branch + last - first):
        rows[k].x, rows[k].w, rows[k].rate = x, x + rows[k].kept, 0.0
    return x, free


@indirect(types.UniTuple(REAL, 3)(_I, _I, _I, REAL, REAL, REAL, MODEL))
def pull(first, last, branch, h, start, end, model):
    """Tension of a viscoelastic spring that only pulls, over its stiffness.

    Parameters
    ----------
    first, last : int, range of Prony terms; branch : int, its first branch
    h : float, s, of a step, 0 of a state
    start, end : float, m, extensions at both ends of the step

    Returns
    -------
    tension : float, m; share : float, of the change of the extension that is taut
    slope : float, derivative by the extension, over a step twice that of the mean by the end
    """
    if is_kept(h, model):
        x, free = _kept_strain(first, last, branch, end, model)
        taut = 1.0 if end > free else 0.0
        return x - free, taut, taut
    rows, terms, x0 = model.branch_strains, model.prony_terms, model.branch_strains[branch].x0
    a, b, factor = 1.0, 0.0, 1.0
    for i in range(last - first):
        left, one, two = decay_of(first + i, h, model)
        a += terms[first + i].share * (one - 1.0)
        b += terms[first + i].share * (rows[branch + i].w0 * left - one * x0)
        factor += terms[first + i].share * (2.0 * two - 1.0)
    slack1 = a * end + b <= 0.0
    x1 = max(-b / a, end) if slack1 else end
    mean = 0.5 * (x0 + x1)
    stress = mean
    for i in range(last - first):
        change = decay_of(first + i, h, model)
        stress += terms[first + i].share * (branch_strain(rows, branch + i, h, False, change, x1) - mean)
    if h == 0.0:
        return (0.0, 0.0, 0.0) if slack1 else (a * end + b, 1.0, a)
    dx, de, slack0 = x1 - x0, end - start, _is_slack(first, last, branch, model)
    if not (slack0 or slack1):
        return stress, 1.0, factor
    worked = _taut_part(slack0, slack1, dx, de)
    if worked == 0.0 or de == 0.0:
        return 0.0, 0.0, 0.0
    share, slope = min(max(worked / de, 0.0), 1.0), 0.0
    if slack0:
        slope = factor * share + 2.0 * stress * (1.0 - share) / de
    elif de < 0.0:
        slope = -2.0 * stress * share / de
    return stress * share, share, slope


@inlined
def recovered(first, last, branch, h, end, model):
    """What a step of length h that is accepted loses beside the dashpots, over K; end: extension at its end."""
    rows, terms, x0, x1 = (
        model.branch_strains,
        model.prony_terms,
        model.branch_strains[branch].x0,
        model.branch_strains[branch].x,
    )
    dx, stress, slack1 = x1 - x0, 0.5 * (x0 + x1), x1 > end
    slack0 = _is_slack(first, last, branch, model)
    if not (slack0 or slack1):
        return 0.0
    for i in range(last - first):
        _, one, two = decay(h / terms[first + i].time)
        stress += terms[first + i].share * (rows[branch + i].w0 * one + two * dx - 0.5 * (x0 + x1))
    return stress * (_taut_part(slack0, slack1, dx, end - x0) - dx)
