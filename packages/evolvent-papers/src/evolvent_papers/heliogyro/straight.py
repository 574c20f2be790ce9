"""Moment of inertia and angular momentum of body and straight radial blades."""

from __future__ import annotations

import numpy as np

from evolvent import closed_forms
from evolvent_papers.heliogyro.case import Case

Array = np.ndarray


def straight_inertia(case: Case, deployed: Array, *, corrected: bool) -> Array:
    """Moment of inertia of body and straight radial blades about the spin axis, kg m2.

    Parameters
    ----------
    deployed : (nt, blades) float, m
    corrected : bool, with the spools' distance from the spin axis and, where it is carried, the wound thread;
        without, as in (18)
    """
    own = rotor(case)._replace(inertia=0.0, blades=1)
    each = closed_forms.rotor_inertia(own if corrected else own._replace(offset=0.0), deployed)
    if corrected and case.carried:
        each = each + case.blade.line_density * (case.blade.length - deployed) * case.body.spool_offset**2
    return np.asarray(case.body.spin_inertia + each.sum(axis=1))


def rotor(case: Case) -> closed_forms.Rotor:
    """Body and blades of a case for closed forms."""
    body, blade = case.body, case.blade
    return closed_forms.Rotor(body.spin_inertia, body.spool_offset, body.blades, blade.line_density, blade.tip_mass)


def start_momentum(case: Case) -> float:
    """Size of the angular momentum of body and straight blades about the spin axis at the start, kg m2/s.

    Notes
    -----
    With nothing out it is J W0: the momentum of wound thread counts where that thread is carried.
    """
    inertia, out = case.body.spin_inertia, case.spool.start_length
    if out > 0.0 or case.carried:
        inertia = float(straight_inertia(case, np.full((1, case.body.blades), out), corrected=True)[0])
    return inertia * abs(case.body.rate)
