"""What the laws of contact take of a rib that whips onto its hub and rebounds."""

import numpy as np
import pytest

import evolvent

WHIP = {
    "damping.alpha": 0, "rib.length": 2, "rib.elements": 10, "solver.duration": 3.5, "solver.step": 0.005,
    "solver.spectral_radius": 1, "output.fine": False,
}  # fmt: skip


@pytest.mark.parametrize(("law", "takes"), [("conservative", False), ("hunt-crossley", True)])
def test_a_conservative_contact_takes_no_energy(law, takes):
    """Whatever `contact.dissipation` and `contact.damping` are, which are of the other laws."""
    run = evolvent.run("wrapped-rib", WHIP | {"contact.law": law})
    assert float(run["contact-1"].impulse[-1]) > 1.0  # N s: it has been on the hub
    taken, most = float(run.energy_losses.sel(cause="contact")[-1]), float(np.abs(run.work_loads).max())
    if takes:
        assert taken > 0.05 * most
    else:
        assert abs(taken) < 1e-9 * most
        assert float(run.energy[-1]) == pytest.approx(float(run.work_loads[-1]), rel=1e-6)
