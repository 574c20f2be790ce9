"""A platform on three wires: made recordings, and the eleven real ones where they are at hand."""

from __future__ import annotations

import pathlib

import numpy as np
import pytest

from book import Book
from evolvent_base.errors import InputError
from evolvent_papers import laboratory
from evolvent_papers.laboratory import trifilar

FOLDER = pathlib.Path(__file__).parents[4].parent / "shared" / "data" / "trifilar"


def record(path: pathlib.Path, moment: float, radius: float, seed: int) -> None:
    """Five seconds of a dot in pixels at 240 Hz: torsion, and two sways near sqrt(g / L)."""
    rng, t = np.random.default_rng(seed), np.arange(1200) / 240.0
    torsion = 60.0 * np.exp(-0.01 * t) * np.cos(trifilar.frequency(moment, radius) * t + 0.3)
    sway = 8.0 * np.cos(3.139 * t + 1.0)
    x = 400.0 + torsion + sway + 0.3 * rng.standard_normal(t.size)
    y = 300.0 + 0.2 * torsion - 0.7 * sway + 0.3 * rng.standard_normal(t.size)
    rows = "".join(f"{a:.6f}\t{b:.6f}\n" for a, b in zip(x, y, strict=True))
    path.write_text(f"x\ty\n{rows}", encoding="utf-8")


@pytest.mark.slow
def test_the_moment_of_made_recordings(tmp_path) -> None:
    for k, radius in enumerate((0.25, 0.4, 0.55, 0.7)):
        record(tmp_path / f"5s_{radius:.2f}.csv", 0.2349, radius, k)
    found = laboratory.found("trifilar").validate(data=str(tmp_path))
    moment, *frequencies = found.comparisons
    assert moment.predicted == pytest.approx(0.2349, abs=1e-4)
    assert [one.what for one in frequencies] == ["torsion with the nuts at 0.40 m", "torsion with the nuts at 0.70 m"]
    for one, radius in zip(frequencies, (0.4, 0.7), strict=True):
        assert one.predicted == pytest.approx(trifilar.frequency(0.2349, radius), rel=2e-4)
        assert one.measured == pytest.approx(one.predicted, rel=4e-4)
    assert moment.meets


def test_the_frequency_is_that_of_the_closed_form() -> None:
    """omega^2 I L = g M Rw^2, with `massprops.inertia.trifilar` as its inverse."""
    from evolvent_massprops.inertia import trifilar as moment_of

    for radius in (0.0, 0.5):
        omega = trifilar.frequency(0.2, radius)
        whole = moment_of(
            omega, mass=trifilar.PLATFORM + trifilar.NUTS, length=trifilar.LENGTH, radius=trifilar.ATTACHED,
            gravity=trifilar.GRAVITY,
        )  # fmt: skip
        assert whole == pytest.approx(0.2 + trifilar.NUTS * radius**2, rel=1e-12)


def test_other_folders_are_refused(tmp_path) -> None:
    (tmp_path / "5s_0.25.csv").write_text("x\ty\n")
    with pytest.raises(InputError, match=r"has 1 recordings; 4 or more are needed, named like 5s_0.25.csv"):
        trifilar.radii_of(str(tmp_path))


@pytest.mark.slow
@pytest.mark.skipif(len(list(FOLDER.glob("5s_*.csv"))) != 11, reason=f"the eleven recordings are not in {FOLDER}")
def test_the_real_pendulum(book: Book) -> None:
    """`docs/laboratory/trifilar.md` states these numbers."""
    found = laboratory.found("trifilar").validate(data=str(FOLDER))
    moment, *frequencies = found.comparisons
    assert moment.predicted == pytest.approx(0.23488, abs=1e-5)
    book(
        "Inertia stand and identification", "Trifilar pendulum, eleven recordings: mean moment",
        reference="0.23479(35) kg m2", source="published, KTH Stockholm 2014", error=abs(moment.predicted - 0.23479),
        allowed=0.0004, unit="kg m2",
    )  # fmt: skip
    assert moment.band.parameters == pytest.approx(0.00011, abs=5e-6)
    assert (moment.covered, moment.meets) == (True, True)
    assert len(frequencies) == 5
    assert max(abs(one.difference) for one in frequencies) == pytest.approx(0.0111, abs=2e-4)
    assert found.text == "1 of 1 goals are met; 6 of 6 differences are within their bands of 95 %"
