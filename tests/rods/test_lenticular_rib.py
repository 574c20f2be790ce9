"""Closed forms of sections that flatten, and the study of a lenticular rib on a hub."""

from __future__ import annotations

import math
import pathlib
import runpy
from typing import Any

import numpy as np
import pytest

from evolvent import closed_forms
from evolvent.elements import Arc, Lenticular, Material, TapeSection
from evolvent.families.rods import tape as kernel
from evolvent_base.errors import InputError

EXAMPLE = pathlib.Path(__file__).parents[2] / "examples" / "lenticular_rib.py"
FILM = Material(young_modulus=5e6, poisson_ratio=0.3, density=1600.0)
TAPE = TapeSection(radius=0.15, angle=0.2, thickness=1.5e-4)
LENS = Lenticular(radius=0.15, angle=0.2, thickness=1.5e-4)


@pytest.mark.parametrize("section", [TAPE, LENS])
@pytest.mark.parametrize("x", [1e-5, 2e-3, 0.3, -0.3, 2.0, -2.0, 500.0])
def test_the_closed_form_is_the_law_of_the_rods(section: TapeSection, x: float) -> None:
    """The energy of the kernels at the flattening of least energy; 2e-3 1/m and below is the series."""
    own, k0 = section.flattening(FILM), 1.0 / section.radius
    N, g = kernel.profile(own.slenderness * x * x, own.closed)[0], own.slenderness * own.stretching * x * x
    wanted = (1.0 - own.poisson**2) * x * x + N * g / (N + g) * (k0 + own.poisson * x) ** 2
    _, energy = closed_forms.flattened_bending(section, FILM, x)
    assert float(energy) == pytest.approx(0.5 * own.bending * wanted, rel=1e-6)


@pytest.mark.parametrize("section", [TAPE, LENS])
@pytest.mark.parametrize("x", [1e-5, 0.02, 0.3, -0.3, 2.0, -2.0, 500.0])
def test_the_moment_is_the_slope_of_the_energy(section: TapeSection, x: float) -> None:
    h = 1e-3 * abs(x)
    (_, before), (_, after) = (closed_forms.flattened_bending(section, FILM, x + d) for d in (-h, h))
    moment, _ = closed_forms.flattened_bending(section, FILM, x)
    assert float(moment) == pytest.approx(float(after - before) / (2.0 * h), rel=1e-5)


def test_small_bending_is_that_of_the_shallow_arcs() -> None:
    s, t, R = 0.03, 1.5e-4, 0.15
    x = np.array([0.0, 1e-6])
    for section, own in ((TAPE, s**5 * t / (720.0 * R**2) + s * t**3 / 12.0), (LENS, s**5 * t / (60.0 * R**2))):
        moment, energy = closed_forms.flattened_bending(section, FILM, x)
        assert moment[0] == energy[0] == 0.0
        # both walls bend as plates, 2 s D, which is a part of 2.5e-3
        assert moment[1] == pytest.approx(FILM.E * own * x[1], rel=5e-3)


def test_a_thin_lens_folds_at_the_moment_without_boundary_layers() -> None:
    """2 D angle and the radius of the walls, in the limit of thin walls."""
    errors = []
    for t in (1e-6, 1e-8):
        section = Lenticular(radius=0.015, angle=1.2, thickness=t)
        found, D = closed_forms.snap(section, FILM), FILM.E * t**3 / (12.0 * (1.0 - FILM.nu**2))
        errors.append(1.0 - found.propagation_moment / (2.0 * D * section.angle))
        assert found.fold_radius == pytest.approx(section.radius, rel=20.0 * math.sqrt(t))
    assert 0.0 < errors[1] < 5e-3
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.1)  # of the order 1/L


def test_what_is_refused() -> None:
    arc: Any = Arc(radius=0.15, angle=0.2, thickness=1.5e-4)
    with pytest.raises(InputError, match="section is Arc; it must be TapeSection or Lenticular"):
        closed_forms.flattened_bending(arc, FILM, 1.0)
    with pytest.raises(InputError, match="sense is 0; it must be 1 or -1"):
        closed_forms.snap(TAPE, FILM, 0)
    with pytest.raises(InputError, match="section does not snap"):
        closed_forms.snap(TapeSection(radius=0.5, angle=0.1, thickness=1e-2), FILM)


@pytest.mark.slow
def test_a_wound_lens_unwinds_as_its_energy_says(monkeypatch: pytest.MonkeyPatch, book: Any) -> None:
    """What the example says; the finer mesh is nearer to the closed form."""
    monkeypatch.setenv("MPLBACKEND", "Agg")
    study = runpy.run_path(str(EXAMPLE))
    table, fine = study["table"], study["figures"]
    plain, wide, narrow = (table[name] for name in ("plain", "wide lens", "narrow lens"))
    stiffness, time = "bending stiffness, uN m2", "time to unwind, s"
    assert [round(rib[stiffness] / plain[stiffness]) for rib in (wide, narrow)] == [58, 40]
    assert [round(rib[time] / plain[time], 1) for rib in (wide, narrow)] == [2.5, 0.5]
    assert plain[time] / narrow[time] == pytest.approx(1.9, abs=0.05)
    assert plain[time] == pytest.approx(8587.0, rel=1e-3)
    assert narrow["energy of a radian, nJ"] / narrow["least energy of a radian, nJ"] == pytest.approx(1.75, abs=0.05)
    for rib in (wide, narrow):
        assert rib["snaps at, uN m"] < 0.2 * rib["root moment if elastic, uN m"]
    wanted = wide["energy of a radian, nJ"]
    released = fine["energy released per radian, nJ"]
    speed, coarse = (f["tip speed over the closed form"] for f in (fine, study["compare"](study["run"](100, 75.0))[3]))
    assert coarse == pytest.approx(0.90, abs=0.015)
    assert coarse < speed
    assert study["after"].max() > wide["snaps at, uN m"] * 1e-6
    assert study["after"].max() < 0.5e-6 * wide["root moment if elastic, uN m"]
    case = "Lenticular rib unwinding from a hub (200 elements): "
    book(
        "Wrapped rib", case + "energy released per radian", reference="w R of Mansfield's section",
        source="closed form", error=abs(released / wanted - 1.0), allowed=0.01,
    )  # fmt: skip
    book(
        "Wrapped rib", case + "tip speed", reference="all energy is kinetic energy of a straight tail",
        source="closed form", error=abs(speed - 1.0), allowed=0.07,
    )  # fmt: skip
