"""Moment of inertia of body and straight radial blades."""

from __future__ import annotations

import numpy as np

from evolvent.systems.heliogyro.case import Case

Array = np.ndarray


def straight_inertia(case: Case, deployed: Array, *, corrected: bool) -> Array:
    """Moment of inertia of body and straight radial blades about the spin axis, kg m2.

    Parameters
    ----------
    deployed : (nt, blades) float, m
    corrected : bool, with the spools' distance from the spin axis and, where it is carried, the wound thread;
        without, as in (18)
    """
    rho, tip = case.blade.line_density, case.blade.tip_mass
    L0 = case.body.spool_offset if corrected else 0.0
    each = rho * ((L0 + deployed) ** 3 - L0**3) / 3.0 + tip * (L0 + deployed) ** 2
    if corrected and case.carried:
        each = each + rho * (case.blade.length - deployed) * L0**2
    return np.asarray(case.body.spin_inertia + each.sum(axis=1))
