"""A platform on three wires: its moment of inertia by the torsion modes of recordings, and frequencies of others.

Two nuts stand on the platform at another radius R in each recording. Every other recording gives the moment I of the
platform, with which the frequencies of the others are predicted::

    omega^2 = g M Rw^2 / (L (I + m R^2))

Source: morloy/trifilar-mass-prop, folder data/Inertia/5s (KTH Stockholm, 2014; GPL-2). The recordings are not shipped.
"""

from __future__ import annotations

import math
import os
import re
from typing import Any

import numpy as np

from evolvent_base.errors import InputError
from evolvent_base.figures import Figure, Line, Panel
from evolvent_massprops import mass_properties
from evolvent_papers.laboratory.book import Array, Budget, Comparison, Contribution, NoSettings, Set, Verdict

SOURCE = "public repository morloy/trifilar-mass-prop, folder data/Inertia/5s; GPL-2; not shipped"
NEEDS = (
    "the recordings are published in the repository morloy/trifilar-mass-prop, folder data/Inertia/5s, under the "
    "GPL-2, and are not shipped"
)
#: g m/s2, wire length L m, attachment radius Rw m, mass of the platform and of both nuts kg.
GRAVITY, LENGTH, ATTACHED, PLATFORM, NUTS = 9.80665, 0.995, 1.0, 0.848, 0.02094
#: Published moment of the platform and scatter of eleven recordings, kg m2.
PUBLISHED, SCATTER, PUBLISHED_OF = 0.23479, 0.00035, 11
#: Recordings that are needed: two that give the moment, two that are predicted.
LEAST = 4


def radii_of(folder: str) -> dict[str, float]:
    """Files of recordings, and the radius of the nuts by their names, m.

    Raises
    ------
    InputError
        If the folder does not hold recordings of this form.
    """
    if not os.path.isdir(folder):
        raise InputError(f"{folder!r} is not a folder with recordings")
    found = {}
    for name in sorted(os.listdir(folder)):
        radius = re.fullmatch(r".*_(\d*\.\d+)\.csv", name)
        if radius is not None:
            found[name] = float(radius[1])
    if len(found) < LEAST:
        raise InputError(
            f"{folder!r} has {len(found)} recordings; {LEAST} or more are needed, named like 5s_0.25.csv by the radius "
            f"of the nuts in metres"
        )
    return found


def description(radii: dict[str, float]) -> dict[str, Any]:
    """The stand as `evolvent identify` reads it."""
    return {
        "title": "Platform of a trifilar pendulum",
        "signals": {"rate": "240 Hz", "unit": "px"},
        "stand": {"kind": "trifilar", "radius": ATTACHED, "length": LENGTH, "gravity": GRAVITY, "amplitude": "0 deg"},
        "body": {"name": "platform", "mass": PLATFORM},
        "tare": [{"name": "two nuts", "mass": NUTS, "radius": 0.25}],
        "recordings": {name: {"tare.0.radius": radius} for name, radius in radii.items()},
    }


def frequency(moment: float, radius: float) -> float:
    """Frequency of the torsion with the nuts at a radius, rad/s."""
    whole = moment + NUTS * radius**2
    return math.sqrt(GRAVITY * (PLATFORM + NUTS) * ATTACHED**2 / (LENGTH * whole))


def run(settings: NoSettings, data: str | None) -> Verdict:
    """The moment of all recordings, and the frequencies of every other one."""
    assert data is not None
    radii = radii_of(data)
    names, radius = list(radii), np.array(list(radii.values()))
    found = mass_properties([os.path.join(data, name) for name in names], description(radii))
    moments = np.array([float(one.values[0]) for one in found.evaluations])
    measured = np.array([float(one.modal.frequency[one.used[0]]) for one in found.evaluations])
    noise = [float(one.modal.frequency_std[one.used[0]]) for one in found.evaluations]
    own, u = float(found.values[0]), float(found.std[0])
    comparisons = [
        Comparison(
            what=f"moment of the platform, mean of {len(names)} recordings; measured: published", unit="kg m2",
            predicted=own, measured=PUBLISHED, allowed=SCATTER, goal="within the published scatter",
            band=BUDGET.band({"published moment": SCATTER / math.sqrt(PUBLISHED_OF), "moment": u}),
        )
    ]  # fmt: skip
    given = np.arange(len(names)) % 2 == 0
    scatter, mean = float(np.std(moments[given], ddof=1)), float(np.mean(moments[given]))
    for k in np.flatnonzero(~given):
        expected = frequency(mean, float(radius[k]))
        slope = 0.5 * expected / (mean + NUTS * float(radius[k]) ** 2)
        comparisons.append(
            Comparison(
                what=f"torsion with the nuts at {radius[k]:.2f} m", unit="rad/s", predicted=expected,
                measured=float(measured[k]),
                band=BUDGET.band({
                    "recording": max(slope * scatter, noise[k]),
                    "moment": slope * scatter / math.sqrt(np.count_nonzero(given)),
                }),
            )
        )  # fmt: skip
    return Verdict(
        comparisons=tuple(comparisons),
        figures=(_figure(radius, measured, given, mean),),
        notes=(
            f"moment of the platform: {own:.5f} kg m2, standard uncertainty {u:.5f} kg m2",
            f"{np.count_nonzero(given)} recordings give {mean:.5f} kg m2 with a scatter of {scatter:.5f} kg m2, and "
            f"predict the others",
            "scale, radius and mass of the pendulum are published without uncertainty and count as exact",
        ),
    )


def _figure(radius: Array, measured: Array, given: Array, mean: float) -> Figure:
    """Frequencies over the radius of the nuts."""
    over = np.linspace(radius.min(), radius.max(), 50)
    lines = [
        Line(x=over, y=np.array([frequency(mean, one) for one in over]), label="predicted"),
        Line(x=radius[given], y=measured[given], label="recordings that give the moment", style="", marker="o"),
        Line(x=radius[~given], y=measured[~given], label="recordings that are predicted", style="", marker="s"),
    ]
    panel = Panel(x_label="radius of the nuts, m", y_label="frequency of the torsion, rad/s", lines=lines)
    return Figure(name="trifilar", title="Trifilar pendulum: predicted and measured", panels=[panel])


BUDGET = Budget(
    contributions=(
        Contribution(
            name="published moment", kind="measurement", size=f"{SCATTER:g} kg m2 over the root of {PUBLISHED_OF}",
            source="published scatter of eleven recordings",
        ),
        Contribution(
            name="recording", kind="measurement",
            size="the larger of the deviation of its frequency and of the scatter of those that give the moment",
            source="identification of the recordings",
        ),
        Contribution(
            name="moment", kind="parameters", size="of the mean of the recordings that give it", source="their scatter",
        ),
    ),
    widened="the scatter was added to the deviations of single recordings, with which 4 of 6 differences were within",
)  # fmt: skip
SETS = {
    "trifilar": Set(
        name="trifilar", title="Moment of a platform on three wires, and the frequency with nuts on it", source=SOURCE,
        Settings=NoSettings, run=run, needs=NEEDS, budget=BUDGET,
    ),
}  # fmt: skip
