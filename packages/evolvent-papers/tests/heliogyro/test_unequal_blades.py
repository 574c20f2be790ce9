"""Blades of a heliogyro that differ on a free body: mass centre, nutation, their closed forms and the limit by them."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import evolvent
from evolvent import InputError, cases
from evolvent.results.kept import REDUCTIONS
from evolvent_papers.heliogyro import chart, free_body
from evolvent_papers.heliogyro.free_figures import crossing

NAME = "heliogyro-unequal"
#: A body so heavy that its rate hardly falls, and thread that is out at the start: blades follow their closed form.
HEAVY = {
    "body.mass": 24.0, "body.inertia": [0.3, 0.3, 0.4], "spool.start_length": 0.2, "spool.ramp": 10.0,
    "output.every": 1.0, "output.fine": False,
}  # fmt: skip


@functools.cache
def run(*rates: float, heavy: bool = True) -> Any:
    return evolvent.run(NAME, {"spool.rate": list(rates)} | (HEAVY if heavy else {}))


def test_the_closed_form_of_straight_blades_is_that_of_many_points() -> None:
    """Mass centre and inertia of three bent-back blades, beside a sum over points and rings of points."""
    changes = {"body.blades": 3, "spool.rate": [3.5, 3.0, 2.0], "blade.length": 2.0, "spool.radius": 0.02}
    case = cases.load(NAME, changes)
    lengths, lags = np.array([[1.9, 1.2, 0.3]]), np.array([[0.2, 0.1, -0.1]])
    found = free_body.rigid(case, lengths, lags)
    masses, places = [2.4], [np.zeros(3)]
    for k, (length, lag) in enumerate(zip(lengths[0], lags[0], strict=True)):
        turn = Rotation.from_euler("z", 2.0 * np.pi * k / 3)
        d = turn.apply(Rotation.from_euler("z", -lag).apply([1.0, 0.0, 0.0]))
        root, count = turn.apply([0.05, 0.0, 0.02]), 4000
        for s in (np.arange(count) + 0.5) / count * length:
            masses.append(0.735e-3 * length / count)
            places.append(root + s * d)
        masses.append(0.5e-3)
        places.append(root + length * d)
        for angle in np.arange(60) * np.pi / 30.0:
            masses.append(0.735e-3 * (2.0 - length) / 60)
            places.append(turn.apply([0.05 + 0.02 * np.cos(angle), 0.0, 0.02 * np.sin(angle)]))
    m, x = np.array(masses), np.array(places)
    centre = m @ x / m.sum()
    square = np.einsum("i,ia,ib->ab", m, x - centre, x - centre)
    inertia = np.trace(square) * np.eye(3) - square + np.diag([0.00328, 0.00328, 0.004])
    assert found.mass == pytest.approx(m.sum(), rel=1e-12)
    assert found.centre[0] == pytest.approx(centre, abs=1e-9)
    assert found.inertia[0] == pytest.approx(inertia, abs=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1e-4, 0.3])
def test_the_tilt_of_a_principal_axis(angle: float) -> None:
    R = Rotation.from_euler("x", angle).as_matrix()
    inertia = R @ np.diag([1.0, 2.0, 3.0]) @ R.T
    assert free_body.principal_tilt(inertia[None]) == pytest.approx(angle, abs=1e-7)


@pytest.mark.slow
def test_equal_blades_do_not_tilt_the_body() -> None:
    found = run(3.5, 3.5)
    assert found.nutation.values.max() < 1e-9
    assert np.abs(found.mass_centre.values[:, :2]).max() < 1e-12


@pytest.mark.slow
def test_the_mass_centre_is_that_of_straight_blades() -> None:
    """And no force acts on it from outside: it moves steadily, but for the height r that a released node jumps by."""
    found = run(3.5, 2.8)
    centre, straight = found.mass_centre.values, found.mass_centre_straight.values
    assert np.abs(centre).max() > 1.4e-4
    assert np.abs(centre - straight).max() < 0.01 * np.abs(centre).max()
    body = found["body"]
    R = Rotation.from_quat(body.attitude.values, scalar_first=True)
    moved = body.position.values + R.apply(centre)
    drift = moved - moved[0] - np.outer(found.time.values, np.polyfit(found.time.values, moved, 1)[0])
    assert np.abs(drift[:, :2]).max() < 1e-9


def test_nutation_is_that_of_straight_threads() -> None:
    """Its mean over the swing of the blades; a rigid blade would keep its angle to the body, and tilt it 40 % less."""
    found = run(3.5, 2.8)
    late = found.time.values > 40.0
    ratio = found.nutation.values[late] / found.nutation_threads.values[late]
    assert ratio.mean() == pytest.approx(1.0, abs=0.01)
    assert np.abs(ratio - 1.0).max() < 0.06
    assert found.nutation_rigid.values[-1] / found.nutation.values[-1] == pytest.approx(0.62, abs=0.05)
    assert np.degrees(found.rate_nutation.values.max()) < 0.01


def test_a_body_with_equal_moments_of_inertia_has_no_steady_axis() -> None:
    """Nothing holds it about the line of its blades: the closed form has no value, and no difference is a limit."""
    case = cases.load(NAME, {"body.inertia": 0.004})
    assert np.isnan(free_body.thread_nutation(case, np.array([[2.0, 1.0]]), 0.2)).all()
    with pytest.raises(InputError, match="one that a difference of rates causes"):
        free_body.largest_difference(case, 0.01)


@pytest.mark.slow
def test_a_body_that_spins_backwards_is_the_mirror_image() -> None:
    there, back = run(3.5, 2.8), evolvent.run(NAME, HEAVY | {"spool.rate": [3.5, 2.8], "body.rate": -6.0})
    assert back.nutation.values == pytest.approx(there.nutation.values, abs=1e-7)
    assert back.nutation_threads.values == pytest.approx(there.nutation_threads.values, rel=1e-12)
    assert back.mass_centre.values == pytest.approx(there.mass_centre.values * [1.0, -1.0, 1.0], abs=1e-7)


@pytest.mark.slow
def test_the_limit_of_the_difference_is_near_that_of_the_run() -> None:
    """1 deg at 10.2 %; in a run with that difference, whose body slows down to 0.3 rad/s, 0.88 deg."""
    case = cases.load(NAME, {"spool.rate": 3.5})
    share = free_body.largest_difference(case, np.radians(1.0))
    assert share == pytest.approx(0.10176, abs=1e-4)
    found = run(3.5, 3.5 * (1.0 - share), heavy=False)
    assert np.degrees(found.nutation_threads.values[-1]) == pytest.approx(1.0, abs=1e-3)
    assert np.degrees(found.nutation.values.max()) == pytest.approx(1.0, abs=0.15)
    assert "nutation" in {figure.name for figure in cases.system("heliogyro").figures(found)}
    assert "largest nutation" in {row.label for row in cases.system("heliogyro").numbers(found)}


def test_the_study_draws_the_difference_at_the_bound() -> None:
    rate, nutation = np.array([3.5, 3.325, 3.15]), np.radians([0.0, 0.5, 1.5])
    dataset = xr.Dataset(
        {"nutation_max": ("spool.rate.1", nutation), "nutation_threads_max": ("spool.rate.1", nutation),
         "rate_difference": ("spool.rate.1", 1.0 - rate / 3.5)},
        {"spool.rate.1": rate}, {"keys": '["spool.rate.1"]', "sample": "grid"},
    )  # fmt: skip
    (figure,) = chart.study_figures(dataset).values()
    assert figure.panels[0].title == "1 deg is reached at 7.5 %"
    assert np.isnan(crossing(np.arange(3.0), np.arange(3.0), 5.0))


def test_the_difference_is_that_of_each_run() -> None:
    """Rates in any order, of 0 and below; runs without rates are left out."""
    rate = np.array([2.8, 0.0, 4.2, 3.5])
    cases_of = [cases.load(NAME, {"spool.rate": [3.5, one]}) for one in rate]
    shares = np.array([free_body.rate_difference(case) for case in cases_of])
    assert shares == pytest.approx([0.2, 1.0, 1.0 / 6.0, 0.0])
    assert np.isnan(free_body.rate_difference(cases.load(NAME, {"spool.rate": 0.0})))
    nutation = np.radians([2.0, 9.0, 1.5, 0.0])
    dataset = xr.Dataset(
        {"nutation_max": ("spool.rate.1", nutation), "rate_difference": ("spool.rate.1", shares)},
        {"spool.rate.1": rate}, {"keys": '["spool.rate.1"]', "sample": "grid"},
    )  # fmt: skip
    (figure,) = chart.study_figures(dataset).values()
    assert figure.panels[0].lines[0].x == pytest.approx([0.0, 100.0 / 6.0, 20.0, 100.0])
    assert np.degrees(np.sort(nutation)) == pytest.approx(figure.panels[0].lines[0].y)
    assert chart.study_figures(dataset.assign(rate_difference=np.nan * dataset.rate_difference)) == {}


def test_a_spool_at_rest_and_an_offset_of_either_sign() -> None:
    """The study keeps the largest magnitude of the offset, whichever blade is longer."""
    short = {"solver.duration": 5.0, "output.every": 1.0, "output.fine": False, "spool.start_length": 0.2}
    offsets = []
    for rates in ([3.5, 0.0], [0.0, 3.5]):
        found = evolvent.run(NAME, short | {"spool.rate": rates})
        assert float(found.rate_difference) == 1.0
        offsets.append(REDUCTIONS["abs_max"](found.mass_centre.values, found.time.values)[0])
    assert offsets[0] == pytest.approx(offsets[1], rel=1e-9)
    assert offsets[0] > 1e-6


@pytest.mark.parametrize(
    ("changes", "nutation", "message"),
    [
        ({"body.motion": "spin", "body.mass": None}, 0.01, "needs body.motion 'free'"),
        ({"spool.rate": -1.0, "spool.start_length": 1.0}, 0.01, "a spool.rate above 0"),
        ({"spool.start_length": 1.0}, 0.01, "spool.start_length is 1 m"),
        ({}, 0.0, "nutation is 0.0 rad"),
        ({}, 3.0, "one that a difference of rates causes"),
    ],
)
def test_a_limit_that_does_not_exist_is_refused(changes: dict[str, Any], nutation: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        free_body.largest_difference(cases.load(NAME, changes), nutation)


def test_rates_of_another_number_of_blades_are_refused() -> None:
    with pytest.raises(InputError, match=r"spool.rate has 3 values, but body.blades is 2"):
        cases.load(NAME, {"spool.rate": [3.5, 3.4, 3.3]})


def test_closed_forms_have_no_value_without_spin() -> None:
    case = cases.load(NAME, {"body.rate": 0.0})
    lengths = np.array([[1.0, 0.9]])
    lags = free_body.steady_lags(case, lengths, np.full((1, 2), 0.035))
    assert np.isnan(lags).all()
    assert np.isnan(free_body.principal_tilt(free_body.rigid(case, lengths, lags).inertia)).all()
