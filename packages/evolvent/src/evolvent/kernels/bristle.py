"""A bristle, of which every dry friction is made: a spring in series with a slider.

It has the stiffness k and a limit L of its force F. Along a path that goes one way (s = 1 or -1),
- slip (an element of the models of Masing and Iwan): dF/dx = k below the limit, then F = s L;
- Dahl: dF/dx = k (1 - s F/L) (Dahl, 1976), so F goes to s L exponentially.
Both have the energy F^2/(2 k), and take (F dx - F dF/k) >= 0: L of each slip, and F^2/L dx. Over an interval the path
is taken to go one way (`turning` ends steps where it turns back), and all integrals are closed forms: the mean force
times the way is exactly what is stored and lost.
"""

import math

from evolvent.compiled.jit import inlined

#: Kinds of bristles.
SLIP, DAHL = 0, 1
#: Part of the way k/L over which a bristle's integrals are series.
_SERIES = 1e-3


@inlined
def bristle_between(kind, stick, limit, start, moved):
    """Force of a bristle behind a way in one sense, and its mean; the derivative of the first, twice of the second.

    Parameters
    ----------
    stick, limit : stiffness k and largest force L
    start : force at the start; moved : rad or m, the way
    """
    if moved == 0.0:
        return start, start, stick, stick
    sense, d = (1.0, moved) if moved > 0.0 else (-1.0, -moved)
    room = sense * limit - start  # to the limit
    if kind == SLIP:
        until = max(sense * room / stick, 0.0)
        if d <= until:
            return start + stick * moved, start + 0.5 * stick * moved, stick, stick
        part = until / d
        return sense * limit, sense * (limit - 0.5 * stick * until * part), 0.0, stick * part * part
    u = stick * d / limit
    gone = -math.expm1(-u)
    if u > _SERIES:
        mean, bend = 1.0 - gone / u, (gone - 1.0 + gone / u) / u
    else:
        mean, bend = u * (0.5 - u * (1.0 / 6.0 - u / 24.0)), 0.5 - u * (1.0 / 3.0 - 0.125 * u)
    free = stick * sense * room / limit
    return start + room * gone, start + room * mean, free * (1.0 - gone), 2.0 * free * bend


@inlined
def energy_taken(stick, start, end, mean, moved):
    """Energy that a bristle takes over a way, J."""
    return mean * moved - 0.5 * (end - start) * (end + start) / stick
