"""Ribs that are curved when deployed: energy and torque that wind them against closed forms, start, and refusals."""

from __future__ import annotations

import numpy as np
import pytest

import evolvent
from evolvent import cases, closed_forms
from evolvent.closed_forms import Strip
from evolvent.parts import Parabola
from evolvent_base.errors import InputError

#: A rib of 50 GPa on a hub of 0.6 m.
STIFF = Strip(radius=0.6, length=12.0, line_density=0.0144, bending_stiffness=3.375e-3, axial_stiffness=450e3)
CURVED = {"rib.shape": {"parabola": {"focal_length": 1.0}}, "rib.formulation": "assumed_strain"}


def _closed_energy(strip: Strip, shape: Parabola) -> float:
    tip = float(shape.plane(np.array([strip.length]))[1][0]) + shape.root_angle
    return closed_forms.parabola_energy(strip, shape.focal_length, shape.root_angle, tip)


@pytest.mark.slow
@pytest.mark.parametrize(("focal_length", "offset"), [(1.0, 0.0), (2.0, -3.0), (5.0, 4.0), (1e6, 0.0)])
def test_the_energy_of_a_wound_parabola_is_that_of_its_change_of_curvature(focal_length, offset):
    shape = Parabola(focal_length=focal_length, offset=offset)
    arc = np.linspace(0.0, 12.0, 40_001)
    places, angle = shape.plane(arc)
    turned = np.gradient(angle, arc, edge_order=2)  # another way to the curvature
    assert shape.curvature(arc) == pytest.approx(turned, abs=1e-8 + 1e-6 / focal_length)
    assert np.linalg.norm(np.diff(places, axis=0), axis=1) == pytest.approx(np.diff(arc), rel=1e-6)
    quadrature = np.trapezoid(0.5 * STIFF.bending_stiffness * (1.0 / 0.6 - turned) ** 2, arc)
    assert _closed_energy(STIFF, shape) == pytest.approx(quadrature, rel=1e-7)


def _rolled(shape: Parabola, wound: float, arc: np.ndarray) -> np.ndarray:
    """Points of a rib that lies on the hub up to the arc length `wound`, and is its own shape from there on."""
    R = STIFF.radius
    places, angle = shape.plane(np.append(arc, wound))
    at, facing = wound / R, wound / R + 0.5 * np.pi - angle[-1]
    c, s = np.cos(facing), np.sin(facing)
    tail = (places[:-1] - places[-1]) @ np.array([[c, s], [-s, c]]) + R * np.array([np.cos(at), np.sin(at)])
    on = R * np.stack([np.cos(arc / R), np.sin(arc / R)], axis=1)
    return np.where((arc < wound)[:, None], on, tail)


@pytest.mark.parametrize("wound", [0.3, 4.0])
def test_the_work_of_a_torque_as_a_curved_tail_rolls(wound):
    """The field's work, by differences of the points' places, is T (1 - k R) dph times the share of the tail."""
    shape, R, step = Parabola(focal_length=1.0), STIFF.radius, 1e-6
    arc = np.linspace(0.0, STIFF.length, 40_001)
    here, there = (_rolled(shape, wound + d, arc) for d in (-step, step))
    r = 0.5 * (here + there)
    across = np.stack([-r[:, 1], r[:, 0]], axis=1)
    work = np.trapezoid(np.einsum("ni,ni->n", across, there - here), arc) / np.trapezoid(np.sum(r * r, axis=1), arc)
    k = float(shape.curvature(np.array([wound]))[0])
    share = closed_forms.winding_share(STIFF, r[arc >= wound])
    assert work == pytest.approx((1.0 - k * R) * 2.0 * step / R * share, rel=1e-4)
    assert share == pytest.approx(1.0, abs=0.2)
    # what the torque has to do: the bending of that length, in the limit of a long tail
    bent = 0.5 * STIFF.bending_stiffness * (1.0 / R - k) ** 2 * R
    assert bent / (1.0 - k * R) == pytest.approx(closed_forms.least_winding_torque(STIFF, k))


def test_the_share_of_a_straight_tail_is_its_closed_form():
    arc = np.linspace(0.0, 3.0, 10_001)
    places = np.stack([np.full_like(arc, 0.6), arc], axis=1)
    wanted = 3.0**3 / 3.0 / (0.6**2 * 12.0 + 3.0**3 / 3.0)
    assert closed_forms.winding_share(STIFF, places) == pytest.approx(wanted, rel=1e-7)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rib.formulation": "cable"}, "rib.formulation is 'cable'; a cable is straight at rest, use assumed_strain"),
        ({"rib.pitch": 0.1}, "rib.shape and rib.pitch are both given"),
        ({"rib.shape": {"parabola": {"focal_length": 0.3}}}, "curvature of 1.667 1/m, not below 1/hub.radius"),
        ({"rib.shape": {"parabola": {"focal_length": -1.0}}}, "rib.shape.parabola.focal_length is"),
        ({"rib.shape": {"circle": {"radius": 1.0}}}, "'circle' is none of its kinds"),
        ({"drive": {"kind": "tip", "rate": 0.1}}, "a carried tip starts from a straight, taut rib"),
    ],
)
def test_curved_ribs_that_cannot_be_wound_are_refused(changes, words):
    with pytest.raises(InputError) as refused:
        cases.load("wrapped-rib", CURVED | changes)
    assert words in str(refused.value)


def test_a_torque_that_is_too_small_is_reported():
    case = cases.load("wrapped-rib", CURVED | {"drive.torque": 1e-7, "solver.duration": 10.0})
    from evolvent_papers.wrapped_rib import case_checks

    (warning,) = [text for text in case_checks.warnings(case) if "cannot wind" in text]
    assert "EI (1/R - k)/2 where its curvature k is largest" in warning
    # f = 1 m: k = 0.5 1/m at the root, 0.7 of the straight rib's
    needed = 0.7 * case_checks.bending_stiffness_ratio(case) * case.strip.bending_stiffness / 1.2
    assert f"{needed:.3g} N m" in warning


@pytest.mark.slow
def test_a_curved_rib_starts_wound_with_its_closed_energy(book):
    from evolvent_papers.wrapped_rib import case_checks

    changes = CURVED | {"rib.young_modulus": 50e6, "rib.elements": 80, "hold.time": 0.01, "output.every": 0.01}
    run, case = evolvent.run("wrapped-rib-hold", changes), cases.load("wrapped-rib-hold", changes)
    # EI of the mesh, by which a straight rib's is too small as well
    wanted = _closed_energy(case.strip, case.rib.shape) * case_checks.bending_stiffness_ratio(case)
    assert float(run.energy_elastic[0]) == pytest.approx(wanted, rel=5e-3)
    assert wanted < 0.9 * closed_forms.bending_energy(case.strip)
    book(
        "Wrapped rib", "Energy of a rib wound on the hub that is a parabola when deployed", reference="closed form",
        source="closed form", allowed=5e-3, error=abs(float(run.energy_elastic[0]) / wanted - 1.0),
    )  # fmt: skip


@pytest.mark.slow
def test_a_curved_rib_winds():
    changes = CURVED | {
        "rib.length": 6.0, "rib.young_modulus": 50e9, "rib.elements": 20, "drive.torque": 0.06, "damping.alpha": 0.5,
        "solver.duration": 40.0, "output.fine": False,
    }  # fmt: skip
    run, shape = evolvent.run("wrapped-rib", changes), Parabola(focal_length=1.0)
    assert float(run.energy_elastic[0]) < 1e-12
    tip = shape.plane(np.array([6.0]))[0][0]
    assert float(run.tip_radius[0, 0]) == pytest.approx(np.hypot(0.6 + tip[0], tip[1]))
    assert float(run.wrap_angle[-1, 0]) > 0.8 * 10.0
    assert float(np.abs(run.energy_defect).max()) < 1e-2 * float(run.energy_moved.values.ravel()[-1])
