"""The energy balance of a run: what every solver keeps of it at its samples, and what follows from that.

The functions take one record, or a whole array of them (`numpy.recarray`), in Python and in compiled code.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from evolvent.jit import inlined

#: Energies now. elastic: of elements, springs, threads and contacts, of which bending (of beams) and contact; coupled:
#: of hinges and penalties.
ENERGIES = ("kinetic", "elastic", "bending", "contact", "coupled")
#: What came in since the start: work of loads, of drives and of spools, and what nodes brought in at their release.
WORK = ("loads", "drives", "spools", "released")
#: What was dissipated since the start, by causes.
LOSSES = ("by_mass", "by_stiffness", "by_contact", "by_friction", "by_joints", "by_springs")
#: One record of the balance, J.
BALANCE = np.dtype([(name, np.float64) for name in (*ENERGIES, *WORK, *LOSSES)], align=True)


def energy(balance: Any) -> Any:
    """Kinetic and potential energy, J."""
    return balance.kinetic + balance.elastic + balance.coupled


def work(balance: Any) -> Any:
    """All that came in since the start, J."""
    return balance.loads + balance.drives + balance.spools + balance.released


def dissipated(balance: Any) -> Any:
    """All that was dissipated since the start, J."""
    return (
        balance.by_mass + balance.by_stiffness + balance.by_contact + balance.by_friction + balance.by_joints
        + balance.by_springs
    )  # fmt: skip


def defect(balance: Any, start: Any) -> Any:
    """Energy less that at the start and less work, plus losses, J: zero but for the numerical error."""
    return (
        balance.kinetic + balance.elastic + balance.coupled - start
        - (balance.loads + balance.drives + balance.spools + balance.released)
        + (balance.by_mass + balance.by_stiffness + balance.by_contact)
        + (balance.by_friction + balance.by_joints + balance.by_springs)
    )  # fmt: skip


def scale(balance: Any, peak: Any) -> Any:
    """Energy beside which a defect counts: the largest there was, or the sum of the magnitudes of all work, J."""
    given = abs(balance.loads) + abs(balance.drives) + abs(balance.spools) + abs(balance.released)
    return max(peak, given)


#: The same for compiled code.
energy_of, defect_of, scale_of = inlined(energy), inlined(defect), inlined(scale)


def records(size: int) -> Any:
    """Room for the balances of `size` samples: fields are attributes."""
    return np.zeros(size, dtype=BALANCE).view(np.recarray)
