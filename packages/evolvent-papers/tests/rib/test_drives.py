"""Torque and rate of the hub: tails at rest against elastica and string, and the figures of their studies."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from scipy.special import airy

import evolvent
from evolvent import cases, closed_forms
from evolvent.closed_forms import Strip
from evolvent_base.errors import InputError
from evolvent_papers import wrapped_rib as system

#: A rib of 50 GPa.
STIFF = Strip(radius=0.6, length=12.0, line_density=0.0144, bending_stiffness=3.375e-3, axial_stiffness=450e3)


def test_the_constant_of_a_short_tail_is_a_root_of_airys_equation():
    """q = A Ai(z) + B Bi(z), z = b^(1/3) (1 - u): q(0) = 1/2 and q'(1) = 1/2 give A and B, q'(0) = -1/2 gives b."""

    def off(root: float) -> float:
        at_tip, at_contact = airy(0.0), airy(root)
        M = np.array([[at_contact[0], at_contact[2]], [-root * at_tip[1], -root * at_tip[3]]])
        A, B = np.linalg.solve(M, [0.5, 0.5])
        return float(-root * (A * at_contact[1] + B * at_contact[3]) + 0.5)

    assert brentq(off, 1.0, 2.0) ** 3 == pytest.approx(closed_forms.SHORT_TAIL, rel=1e-9)


@pytest.mark.slow
def test_short_tails_are_the_limit_of_the_elastica():
    found = closed_forms.held_tails(STIFF, samples=14)
    short = [closed_forms.short_tail(STIFF, torque) for torque in found.torque[:2]]
    assert short == pytest.approx(found.tail[:2], rel=5e-3)
    assert np.all(np.diff(found.torque) < 0.0)
    # no moment about the last contact but that of the tail: the least torque is far below those that hold
    assert found.torque[-1] > 5.0 * closed_forms.least_winding_torque(STIFF)
    assert closed_forms.least_winding_torque(STIFF) == pytest.approx(3.375e-3 / 1.2)


@pytest.mark.parametrize(("torque", "turns"), [(0.025, 2.724), (0.06, 2.854)])
def test_what_touches_is_that_of_an_elastica_by_shooting(torque, turns):
    """The tail, from the hub's tangent with the curvature 1/R: forces, length and field such that its end is free.

    The field is T z x r / int r^2 ds per length, of the whole rib.
    """
    R, L, EI = STIFF.radius, STIFF.length, STIFF.bending_stiffness
    guess = closed_forms.short_tail(STIFF, torque)
    scale = np.array([torque / (R * L) * guess, EI / (R * guess), guess, torque / (R * R * L)])

    def tail(unknown):
        pull, shear, length, field = unknown * scale

        def rates(_, y):
            (x, z), angle, bend, (fx, fz) = y[:2], y[2], y[3], y[4:6]
            along = np.cos(angle), np.sin(angle)
            return [*along, bend, (fx * along[1] - fz * along[0]) / EI, field * z, -field * x, x * x + z * z]

        begin = [R, 0.0, 0.5 * np.pi, 1.0 / R, shear, pull, 0.0]
        return solve_ivp(rates, (0.0, length), begin, rtol=1e-9, atol=1e-12).y[:, -1]

    def off(unknown):
        end = tail(unknown)
        whole = R * R * (L - unknown[2] * scale[2]) + end[6]
        return [end[3] * R, end[4] / scale[1], end[5] / scale[1], unknown[3] * scale[3] * whole / torque - 1.0]

    solution, _, good, _ = fsolve(off, [1.0, -1.0, 1.0, 1.0], full_output=True)
    assert good == 1
    found = solution * scale
    held = closed_forms.held_tails(STIFF)
    assert (L - found[2]) / (2.0 * np.pi * R) == pytest.approx(turns, abs=1e-3)
    assert np.interp(-torque, -held.torque, held.touching) == pytest.approx((L - found[2]) / R, rel=3e-4)
    assert np.all(held.wrap > held.touching)


@pytest.mark.parametrize(("rate", "alpha", "turns"), [(0.5, 0.2, 2.561), (2.0, 0.5, 2.211)])
def test_what_touches_of_a_spun_string_is_all_but_its_tail(rate, alpha, turns):
    found = closed_forms.spun_tail(STIFF, rate, alpha)
    assert found.touching / (2.0 * np.pi) == pytest.approx(turns, abs=1e-3)
    assert found.wrap > found.touching == pytest.approx((12.0 - found.tail) / 0.6)


@pytest.mark.slow
def test_a_held_rib_rests_as_the_elastica_says(book):
    torque = 0.06
    changes = {"rib.young_modulus": 50e9, "rib.elements": 40, "hold.time": 40.0, "output.fine": False}
    run = evolvent.run("wrapped-rib-hold", changes | {"drive.torque": torque, "drive.ramp": 0.0})
    held = closed_forms.held_tails(STIFF)
    for name, wanted in (("tip_radius", held.tip_radius), ("wrap_angle", held.wrap), ("touching_angle", held.touching)):
        assert float(run[name][-1, 0]) == pytest.approx(np.interp(-torque, -held.torque, wanted), rel=3e-3)
    assert float(run.touching_angle[-1, 0]) < float(run.wrap_angle[-1, 0]) - 0.5
    touching = float(run.touching_angle[-1, 0]), np.interp(-torque, -held.torque, held.touching)
    book(
        "Wrapped rib", "Rib held on the hub by 21 EI/(2R): angle that touches", reference="elastica, solve_bvp",
        source="independent computation", allowed=3e-3, error=abs(touching[0] / touching[1] - 1.0),
    )  # fmt: skip
    # at the hinge, which carries no moment, the rib is straight and may lift off
    first = float(run.touching_angle[-1, 0]) * 0.6 - float(run["contact-1"].touching_length[-1])
    assert -1e-3 < first < 0.3
    book(
        "Wrapped rib", "Tip of a rib held on the hub by 21 EI/(2R), from the axis", reference="elastica, solve_bvp",
        source="independent computation", allowed=3e-3,
        error=abs(float(run.tip_radius[-1, 0]) / np.interp(-torque, -held.torque, held.tip_radius) - 1.0),
    )  # fmt: skip


def test_a_torque_below_the_least_does_not_wind():
    torque = 0.7 * closed_forms.least_winding_torque(STIFF)
    changes = {"rib.young_modulus": 50e9, "rib.elements": 20, "damping.alpha": 0.1, "solver.duration": 300.0}
    run = evolvent.run("wrapped-rib", changes | {"drive.torque": torque, "output.fine": False, "output.every": 20.0})
    assert float(np.abs(run.wrap_angle.values).max()) * 0.6 < 0.6


@pytest.mark.parametrize("ratio", [0.1, 0.4, 2.0])
def test_a_spun_tail_is_in_balance_of_moments(ratio):
    """The tension at the hub times R is the moment of the drag about the axis; both are those of the tail alone."""
    rate, alpha = 0.5, 0.5 * ratio
    found = closed_forms.spun_tail(STIFF, rate, alpha)
    # the moment from the tail's shape: rebuilt as a chain of small links from the tip inwards
    n = 20000
    h = found.tail / n
    z, force, moment = complex(found.tip_radius, 0.0), 0.0 + 0.0j, 0.0
    k = STIFF.line_density * rate**2 * complex(1.0, -alpha / rate)
    for _ in range(n):
        half = z - 0.5 * h * (force + 0.5 * h * k * z) / abs(force + 0.5 * h * k * z)
        force += h * k * half
        moment += h * STIFF.line_density * alpha * rate * abs(half) ** 2
        z = half - 0.5 * h * force / abs(force)
    assert abs(z) == pytest.approx(STIFF.radius, rel=1e-3)
    assert abs(force) == pytest.approx(found.tension, rel=1e-3)
    assert found.tension * STIFF.radius == pytest.approx(moment, rel=2e-3)


def test_a_slowly_dragged_tail_is_that_of_the_balance_of_moments():
    found = closed_forms.spun_tail(STIFF._replace(length=200.0), 1.0, 0.01)
    assert found.tail == pytest.approx(1.5 * 0.6 / 0.01, rel=1e-3)


def test_a_string_that_no_drag_holds_points_outwards():
    """The tension at the hinge is the integral of m W^2 r over the string."""
    found = closed_forms.spun_tail(STIFF, 0.5, 0.0)
    assert (found.tail, found.tip_radius, found.wrap) == pytest.approx((12.0, 12.6, 0.0))
    assert found.tension == pytest.approx(0.0144 * 0.25 * (12.6**2 - 0.6**2) / 2.0)


def test_a_slow_drag_leaves_all_of_a_string_in_the_air():
    slow, longer = (closed_forms.spun_tail(STIFF, 0.5, alpha) for alpha in (0.03, 0.04))
    assert slow.tail == pytest.approx(12.0)
    assert slow.wrap == 0.0
    assert 11.0 < longer.tail < 12.0
    assert longer.wrap == pytest.approx((12.0 - longer.tail) / 0.6, abs=0.1)


def test_a_fast_drag_leaves_a_tail_along_the_hub():
    """The force on a short tail leads the hub's tangent by W/alpha, less half of the angle l/R that the tail covers."""
    found = closed_forms.spun_tail(STIFF, 0.5, 1e4)
    assert found.tail == pytest.approx(2.0 * 0.6 * 0.5 / 1e4, rel=1e-3)
    assert found.tension == pytest.approx(2.0 * 0.0144 * (0.5 * 0.6) ** 2, rel=1e-3)


@pytest.mark.parametrize("length", [0.03, 0.3, 1.0])
def test_tails_of_a_short_rib_are_no_longer_than_it(length):
    found = closed_forms.held_tails(STIFF._replace(length=length), samples=6)
    assert found.tail[-1] == pytest.approx(length)
    assert np.all(np.isfinite(np.array(found)))
    short = closed_forms.short_tail(STIFF._replace(length=length), found.torque[0])
    assert short == pytest.approx(found.tail[0], rel=2e-2 if length < 1.0 else 0.1)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: closed_forms.spun_tail(STIFF, 0.0, 0.1), "rate is 0 rad/s"),
        (lambda: closed_forms.spun_tail(STIFF, np.inf, 0.1), "rate is inf rad/s"),
        (lambda: closed_forms.spun_tail(STIFF, 0.5, -1.0), "alpha is -1 1/s"),
        (lambda: closed_forms.short_tail(STIFF, 0.0), "torque is 0 N m"),
        (lambda: closed_forms.short_tail(STIFF, 1e-6), "a tail of 47.11 m, longer than the rib of 12 m"),
        (lambda: closed_forms.held_tails(STIFF, samples=1), "samples is 1"),
        (lambda: closed_forms.held_tails(STIFF._replace(taper=0.5)), "taper is 0.5"),
    ],
)
def test_tails_that_cannot_be_are_refused(call, words):
    with pytest.raises(InputError, match=words):
        call()


@pytest.mark.slow
def test_a_turning_hub_throws_off_the_tail_of_a_string(book):
    changes = {
        "drive": {"kind": "hub", "rate": 0.5, "ramp": 2.0}, "hub.motion": "driven", "rib.start_angle": 0.5 * np.pi,
        "rib.young_modulus": 50e6, "damping.alpha": 0.5, "solver.duration": 80.0, "output.fine": False,
    }  # fmt: skip
    run = evolvent.run("wrapped-rib", changes)
    string = closed_forms.spun_tail(cases.load("wrapped-rib", changes).strip, 0.5, 0.5)
    assert float(run.tip_radius[-1, 0]) == pytest.approx(string.tip_radius, rel=5e-3)
    assert float(run.wrap_angle[-1, 0]) == pytest.approx(string.wrap, rel=5e-3)
    # without stiffness the tail begins within an element, of 0.3 m: what lies and what is free share one polynomial
    assert run.touching_angle.values[-10:, 0] * 0.6 == pytest.approx(12.0 - string.tail, abs=0.3)
    book(
        "Wrapped rib", "Tip of a rib on a hub that turns in drag, from the axis", reference="string, solve_ivp",
        source="independent computation", allowed=5e-3,
        error=abs(float(run.tip_radius[-1, 0]) / string.tip_radius - 1.0),
    )  # fmt: skip


def _study(key: str, values: list[float], unit: str, extra: dict[str, Any]) -> xr.Dataset:
    alphas = [0.2, 0.5]
    wrap = np.full((len(values), 2, 3, 1), 10.0)
    data = xr.Dataset({"touching_angle": ((key, "damping.alpha", "time", "rib"), wrap, {"units": "rad"})})
    data = data.assign_coords({
        key: (key, values, {"units": unit}), "damping.alpha": ("damping.alpha", alphas, {"units": "1/s"}),
        "time": [0.0, 1.0, 2.0], "rib": [1],
    })  # fmt: skip
    case = {"system": "wrapped-rib", "phase": "wind"} | extra
    keys = json.dumps([key, "damping.alpha"])
    data.attrs = {"sample": "grid", "keys": keys, "stages": "[]", "system": "wrapped-rib"}
    data.attrs["study"] = json.dumps({"case": case, "set": {"rib.young_modulus": 50e9}})
    return data


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "values", "unit", "extra"),
    [
        ("drive.torque", [0.002, 0.06], "N m", {"drive": {"kind": "torque", "torque": 0.2}}),
        ("drive.rate", [0.5, 1.0], "rad/s", {"drive": {"kind": "hub", "rate": 1.0}, "hub": {"motion": "driven"}}),
    ],
)
def test_figures_of_studies_over_torque_and_rate(key, values, unit, extra):
    data = _study(key, values, unit, extra)
    figure = system.study_figures(data)["touching"]
    lines = figure.panels[0].lines
    runs = [line for line in lines if line.marker == "o"]
    assert [line.label for line in runs] == ["damping.alpha 0.2 1/s", "damping.alpha 0.5 1/s"]
    assert runs[0].y == pytest.approx(0.5)
    if key == "drive.torque":
        assert runs[0].x == pytest.approx(np.array(values) / 2.8125e-3)
        assert lines[-2].y == pytest.approx(lines[-2].y.clip(0.8, 1.0))
    else:
        ratio = lines[1].y[-1] * 12.0 / 0.6
        assert ratio == pytest.approx(closed_forms.spun_tail(STIFF, 1.0, 0.2).touching)
    assert system.study_figures(data.assign_attrs(sample="list")) == {}
    assert system.study_figures(data.drop_vars("touching_angle")) == {}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("other", "values", "unit"), [("rib.length", [12.0, 9.0], "m"), ("hub.radius", [0.6, 0.5], "m")]
)
def test_tails_of_a_study_over_length_or_radius_are_those_of_each(other, values, unit):
    data = _study("drive.torque", [0.02, 0.06], "N m", {"drive": {"kind": "torque", "torque": 0.2}})
    data = data.rename({"damping.alpha": other}).assign_coords({other: (other, values, {"units": unit})})
    data.attrs["keys"] = json.dumps(["drive.torque", other])
    lines = system.study_figures(data)["touching"].panels[0].lines
    tails = [line for line in lines if line.style == "--"]
    assert [line.color for line in tails] == [0, 1]
    strip = STIFF._replace(length=values[1]) if other == "rib.length" else STIFF._replace(radius=values[1])
    held = closed_forms.held_tails(strip)
    least = closed_forms.least_winding_torque(strip)
    assert tails[1].y[-1] == pytest.approx(held.touching[-1] * strip.radius / strip.length)
    assert tails[1].x[-1] == pytest.approx(held.torque[-1] / least)


def test_runs_of_refused_cases_are_left_out_of_a_figure():
    given = {"drive": {"kind": "hub", "rate": 1.0}, "hub": {"motion": "driven"}}
    lines = system.study_figures(_study("drive.rate", [0.0, 0.5, 1.0], "rad/s", given))["touching"].panels[0].lines
    assert [line.x.size for line in lines if line.marker == "o"] == [2, 2]
    assert min(line.x.min() for line in lines) == pytest.approx(0.25)


def test_no_tails_are_drawn_where_they_are_not_found(monkeypatch):
    def fails(*_: Any) -> None:
        raise ArithmeticError("not found")

    monkeypatch.setattr(closed_forms, "held_tails", fails)
    data = _study("drive.torque", [0.02, 0.06], "N m", {"drive": {"kind": "torque", "torque": 0.2}})
    lines = system.study_figures(data)["touching"].panels[0].lines
    assert [line.style for line in lines] == ["", "", ":"]
