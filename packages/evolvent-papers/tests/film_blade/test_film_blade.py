"""The system film-blade: a strip that is paid out, on both sides of the rate at which it buckles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import evolvent as ev
from evolvent import cases, closed_forms
from evolvent_base.errors import InputError
from evolvent_papers import film_blade
from evolvent_papers.film_blade.show import study_figures

#: The last 0.8 m before 4 m.
SHORT = {"payout.start": 3.2, "payout.length": 4.0}


def run(**changes: Any) -> Any:
    """A run of the built-in case over the last part of 4 m."""
    return ev.run("film-blade", SHORT | {key.replace("__", "."): value for key, value in changes.items()})


@pytest.mark.slow
@pytest.mark.parametrize(("width", "root"), [(0.02625, "free"), (0.01, "free"), (0.05, "held")])
def test_it_buckles_above_the_limit_and_not_below(width: float, root: str) -> None:
    """0.8 and 1.2 times the rate of Ritz's method at 4 m, by a twist of 5 degrees."""
    shared = {"blade__width": width, "blade__root": root, "payout__ramp": 1.0 if root == "held" else 0.0}
    limit = float(run(payout__rate=0.02, **shared).limit_modes)
    below, above = (run(payout__rate=share * limit, **shared) for share in (0.8, 1.2))
    assert np.isnan(float(below.buckled_length))
    assert 3.4 < float(above.buckled_length) < 4.0
    assert float(above.limit_modes) == float(below.limit_modes)


@pytest.mark.slow
def test_before_it_buckles_it_moves_as_a_thread_in_steady_pay_out() -> None:
    """Lag of the thread, whose swing is not excited; spin by the angular momentum; edge load by the closed form."""
    found = run(payout__rate=0.012)
    case = cases.of_run(found.attrs["case"])
    assert np.degrees(found.tip_lag.values) == pytest.approx(np.degrees(case.steady_lag), rel=0.15)
    inertia = closed_forms.rotor_inertia(case.rotor, found.deployed_length.values, case.steady_lag)
    assert found.body_rate.values == pytest.approx(case.momentum / inertia, rel=0.01)
    late = found.deployed_length.values > 3.9
    slack = closed_forms.payout_slack(case.film, case.rotor, 3.95, case.momentum)
    assert float(found.edge_share.values[late].mean()) == pytest.approx(0.012 / slack, rel=0.15)
    numbers = {one.label: one.value for one in film_blade.SYSTEM.numbers(found)}
    assert numbers["length at which it buckles"] == "it does not"
    assert len(film_blade.SYSTEM.figures(found)[0].panels) == 4


@pytest.mark.slow
def test_eight_elements_are_enough() -> None:
    """The length at which it buckles changes by less than 1 % with three times as many."""
    coarse, fine = (float(run(payout__rate=0.03, blade__elements=n).buckled_length) for n in (8, 24))
    assert coarse == pytest.approx(fine, rel=0.01)


@pytest.mark.slow
def test_the_twist_at_a_held_root_begins_at_the_limit_of_short_waves_and_stays_small() -> None:
    """24 elements, at 1 m: next to nothing below 25 mm/s, some degrees above."""
    fixed = {"payout.start": 0.9, "payout.length": 1.1, "payout.ramp": 3.0, "blade.root": "held", "blade.elements": 24}
    found = [ev.run("film-blade", fixed | {"payout.rate": rate}) for rate in (0.022, 0.03)]
    assert 0.022 < float(found[0].limit_estimate) < float(found[0].limit_modes) < 0.03
    none, some = (float(np.degrees(run.twist.values[-100:]).mean()) for run in found)
    assert none < 0.5
    assert 1.5 < some < 5.0


@pytest.mark.slow
def test_a_study_draws_the_rate_over_the_length() -> None:
    """Points of the runs and curves of the closed forms, two values of the width."""
    study = {
        "study": "limits", "case": "film-blade", "set": SHORT, "sample": "grid",
        "over": {"payout.rate": [0.02, 0.035], "blade.width": [0.02625, 0.05]}, "keep": ["buckled_length"],
    }  # fmt: skip
    found = ev.sweep(study, workers=1)
    panel = study_figures(found)["limit"].panels[0]
    points = [line for line in panel.lines if line.marker]
    assert len(panel.lines) == 6
    assert [line.y.tolist() for line in points] == [[20.0, 35.0]] * 2
    assert np.isnan(points[0].x[0])
    assert 3.2 < points[0].x[1] < 3.6


@pytest.mark.slow
def test_the_case_of_strips_pays_out_at_less_than_a_tenth_of_its_limit() -> None:
    """The table of rates of heliogyro-strip-payout, from 0.5 m at 20 rad/s."""
    payout = cases.load("heliogyro-strip-payout").parts["blade 1"].payout
    time, rate = np.array(payout.time), np.array(payout.rate)
    out = 0.5 + np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time))])
    film, rotor = closed_forms.Film(26.25e-3, 20e-6, 1e9, 0.3), closed_forms.Rotor(0.004, 0.05, 2, 0.000735, 5e-4)
    momentum = 20.0 * float(closed_forms.rotor_inertia(rotor, 0.5))
    for v, length in zip(rate[1:], out[1:], strict=True):
        assert v < 0.1 * closed_forms.payout_buckling(film, rotor, length, momentum)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"payout.rate": 0.2}, "payout.rate is 0.2 m/s; it must be below 0.15"),
        ({"payout.rate": 0.0}, "payout.rate is 0 m/s; it must be above 0"),
        ({"payout.start": 6.0}, "payout.start is 6 m; it must be below payout.length"),
        ({"payout.start": 0.001}, "at least a thousandth"),
        ({"payout.ramp": 1000.0}, "payout.ramp is 1000 s; it must be at most half of the run"),
        ({"blade.width": 1e-5}, "blade.width is 1e-05 m; it must be above blade.thickness"),
        ({"blade.pitch": "0 deg"}, "blade.pitch is 0 deg; it must be within 2.5 deg"),
        ({"blade.pitch": "-3 deg"}, "blade.pitch is -3 deg; it must be within 2.5 deg"),
        ({"blade.root": "fixed"}, "blade.root"),
        ({"blade.elements": 2}, "blade.elements"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(changes: dict[str, Any], words: str) -> None:
    """Each names the key, its value and what is allowed."""
    with pytest.raises(InputError) as error:
        cases.load("film-blade", changes)
    assert words in str(error.value)
    assert "\n" not in str(error.value)
