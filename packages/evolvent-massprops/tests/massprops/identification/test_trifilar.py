"""A measured trifilar pendulum: the torsion mode of eleven recordings, with no value set by hand.

The recordings are those of the public repository morloy/trifilar-mass-prop, folder data/Inertia/5s (KTH Stockholm,
2014; GPL-2), and no part of this project. Each shows torsion near 6 rad/s, two pendulum modes near sqrt(g / L) =
3.14 rad/s, and sums and multiples of these, in pixels; neither the noise nor the decay is the model's.
"""

from __future__ import annotations

import pathlib

import numpy as np
import pytest

from book import Book
from evolvent_massprops.identification import identify

FOLDER = pathlib.Path(__file__).parents[4].parent / "shared" / "data" / "trifilar"
FILES = sorted(FOLDER.glob("5s_*.csv"))
#: g m/s2, wire length m, attachment radius m, mass of the platform and of both nuts kg.
G, L, RW, PLATFORM, NUTS = 9.80665, 0.995, 1.0, 0.848, 0.02094


@pytest.mark.skipif(len(FILES) != 11, reason=f"the eleven recordings are not in {FOLDER}")
def test_inertia_of_the_platform(book: Book) -> None:
    """I = g M Rw^2 / (L omega^2) - m R^2; published: 0.23479(35) kg m2, mean and scatter of the eleven."""
    inertia = []
    for file in FILES:
        data = np.genfromtxt(file, skip_header=1)
        modes = identify({"x": data[:, 0], "y": data[:, 1]}, rate=240.0)
        torsion = int(np.argmax(modes.amplitude[:, 0]))  # the dot moves along x by torsion most of all
        assert modes.amplitude[torsion, 0] > 2.0 * np.delete(modes.amplitude[:, 0], torsion).max()
        R = float(file.stem.removeprefix("5s_"))
        omega = modes.natural_frequency[torsion]
        inertia.append(G * (PLATFORM + NUTS) * RW**2 / (L * omega**2) - NUTS * R**2)
    assert np.mean(inertia) == pytest.approx(0.2348, abs=0.0004)
    assert np.std(inertia, ddof=1) < 0.0005
    book(
        "Inertia stand and identification", "Trifilar pendulum, eleven recordings: mean moment",
        reference="0.23479(35) kg m2", source="published, KTH Stockholm 2014", error=abs(np.mean(inertia) - 0.23479),
        allowed=0.0004, unit="kg m2",
    )  # fmt: skip
