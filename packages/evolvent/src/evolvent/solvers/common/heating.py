"""Energy balances of heated beams and rods.

The solvers treat thermal strain as loads and take strain energies of the total strain. The strain energy of the total
strain less the free one differs from that by `kernels.thermal.evaluate_energies`; the work of loads since the start
differs by its change.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.assembly import needs
from evolvent.kernels import rigid, rod, thermal
from evolvent.model import Model

Array = np.ndarray


def less_free_strain(model: Model, t: Array, y: Array, factor: Array | float, balance: Any) -> Any:
    """A balance with the strain energies of heated beams, and the work of loads by which they change."""
    if not model.thermal_loads.size:
        return balance
    found, y = balance.copy(), np.ascontiguousarray(y)
    elastic, loads = np.zeros(t.size), model.thermal_loads
    heats_rods = bool(np.any(loads["rod"] >= 0))
    of_rods = (thermal.heat_rods, rigid.kinematics, rod.evaluate_rods) if heats_rods else ()
    needs.load(model, thermal.heat_beams, thermal.evaluate_energies, *of_rods)
    for k, scale in enumerate(np.resize(factor, t.size)):
        thermal.heat_beams(t[k], scale, model)
        if heats_rods:
            thermal.heat_rods(t[k], t[k], scale, model)
            rigid.kinematics(t[k], y[k], model)
            rod.evaluate_rods(model, model.sums[1])
        thermal.evaluate_energies(k, y[k], model)
        elastic[k] = loads["elastic"].sum()
        found["bending"][k] += loads["bending"].sum()
    found["elastic"] += elastic
    found["loads"] += elastic - elastic[:1]
    return found
