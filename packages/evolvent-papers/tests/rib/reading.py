"""What tests of the wrapped rib read of a run."""

import numpy as np

from evolvent import cases
from evolvent.view.balance import stored_energies


def case_of(run):
    """The case that a run was made from."""
    return cases.load(cases.parse_yaml(run.attrs["case"], "case"))


def over_ribs(run, name):
    """Values over time, and the ribs in the second dimension; {} in the name stands for the rib's number."""
    part, _, variable = name.partition(".")
    return np.stack([run[part.format(k)][variable].values for k in run["rib"].values], axis=1)


def stored(run, kind):
    """Elastic energy over time of one kind: "bending", "stretch and shear" or "contacts", J."""
    return stored_energies(run)[kind]


def elastic(run):
    """Strain energy of the ribs over time, J."""
    return stored(run, "bending") + stored(run, "stretch and shear")


def work(run):
    """Work from outside over time, J."""
    return run["work_loads"].values + run["work_drives"].values


def balance(run):
    """What the energy balance has gained, over the largest energy or work."""
    return run["energy_defect"].values / max(run["energy"].values.max(), np.abs(work(run)).max())
