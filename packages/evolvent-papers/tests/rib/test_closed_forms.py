"""The closed forms against one another, against quadrature and against a numerical solution of the same mechanics."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from evolvent import closed_forms
from evolvent.closed_forms import Strip

#: Yi et al. (2017): 12 m x 30 mm x 0.3 mm, 1600 kg/m3, 5 MPa, hub of 1.2 m.
PAPER = Strip(
    radius=0.6, length=12.0, line_density=0.0144, bending_stiffness=5e6 * 0.03 * 0.0003**3 / 12, axial_stiffness=45.0
)
T = 0.2


@pytest.mark.parametrize(("alpha", "end"), [(0.0, 27.63), (0.2, 66.40), (0.5, 145.86)])
def test_a_light_string_is_wound_when_other_computations_say(alpha, end, book):
    found = closed_forms.string_winding(PAPER, T, alpha)
    assert found.end_time == pytest.approx(end, abs=0.005)
    assert found.wrap[-1] * PAPER.radius == pytest.approx(0.98 * PAPER.length, rel=1e-9)
    assert np.all(np.diff(found.swing) >= 0.0)
    assert np.all(np.diff(found.wrap) >= 0.0)
    assert np.argmax(found.tip_speed) == found.time.size - 1
    book(
        "Wrapped rib", f"Light string wound on a hub, alpha {alpha:g} 1/s: end", reference=f"{end} s",
        source="independent computation", error=abs(found.end_time - end), allowed=0.005, unit="s",
    )  # fmt: skip


@pytest.mark.parametrize(("alpha", "damped"), [(0.0, None), (0.2, None), (0.5, None), (0.5, [(0.0, 2.0), (5.0, 7.0)])])
def test_the_strings_energy_is_the_work_less_the_drag(alpha, damped):
    found = closed_forms.string_winding(PAPER, T, alpha, damped=damped)
    assert found.kinetic == pytest.approx(found.work - found.drag, rel=1e-7, abs=1e-9)
    assert np.any(found.drag > 0.0) == (alpha > 0.0)


def test_a_string_that_is_damped_in_parts():
    whole = closed_forms.string_winding(PAPER, T, 0.5)
    parts = closed_forms.string_winding(PAPER, T, 0.5, damped=[(0.0, 3.0), (3.0, 12.0)])
    assert parts.end_time == pytest.approx(whole.end_time, rel=1e-9)
    # the power is alpha times the integral of m v^2 over what is damped
    found = closed_forms.string_winding(PAPER, T, 0.5, damped=[(4.0, 9.0)])
    arc = np.linspace(4.0, 9.0, 100001)
    across = np.clip(arc - PAPER.radius * found.wrap[1500], 0.0, None) * found.rate[1500]
    power = 0.5 * PAPER.line_density * np.trapezoid(across**2, arc)
    dt = found.time[1]
    assert (found.drag[1501] - found.drag[1499]) / (2.0 * dt) == pytest.approx(power, rel=1e-3)


def test_the_strings_motion_is_that_of_its_shape():
    found = closed_forms.string_winding(PAPER, T, 0.2, samples=20001)
    k = np.arange(100, 19900, 7)
    dt = found.time[1]
    arc = np.linspace(0.0, PAPER.length, 401)
    for i in k[::150]:
        before, after = (
            closed_forms.string_shape(PAPER, arc, wrap=found.wrap[j], swing=found.swing[j]) for j in (i - 1, i + 1)
        )
        v = np.linalg.norm(after - before, axis=1) / (2.0 * dt)
        assert v[-1] == pytest.approx(found.tip_speed[i], rel=1e-3)
        kinetic = 0.5 * PAPER.line_density * np.trapezoid(v**2, arc)
        assert kinetic == pytest.approx(found.kinetic[i], rel=2e-3)


def test_a_string_that_starts_tangent_has_no_swing():
    found = closed_forms.string_winding(PAPER, T, 0.2, start_angle=0.5 * math.pi)
    assert np.all(found.swing == 0.5 * math.pi)
    outwards, early = (closed_forms.string_winding(PAPER, T, 0.2, start_angle=a) for a in (0.0, -0.5 * math.pi))
    assert found.end_time < outwards.end_time < early.end_time


def test_a_string_that_has_no_time_is_cut_off():
    during = closed_forms.string_winding(PAPER, T, 0.2, longest=30.0)
    assert during.time[-1] == 30.0
    assert math.isinf(during.end_time)
    before = closed_forms.string_winding(PAPER, T, 0.2, longest=5.0)
    assert before.time[-1] == 5.0
    assert not np.any(before.wrap)


def test_a_string_round_a_thin_hub_is_a_rod_under_a_constant_field():
    thin = PAPER._replace(radius=1e-6)
    found = closed_forms.string_winding(thin, T, 0.0, longest=20.0)
    c = 3.0 * T / (thin.line_density * thin.length**3)
    assert found.swing[found.swing < 1.5] == pytest.approx((0.5 * c * found.time**2)[found.swing < 1.5], rel=1e-5)


def test_shape_keeps_its_length_and_winds_on_the_hub():
    arc = np.linspace(0.0, PAPER.length, 20001)
    x = closed_forms.string_shape(PAPER, arc, wrap=3.0, at=1.0)
    assert np.linalg.norm(np.diff(x, axis=0), axis=1).sum() == pytest.approx(PAPER.length, rel=1e-6)
    r = np.linalg.norm(x, axis=1)
    assert r[arc <= 1.8] == pytest.approx(0.6, rel=1e-12)
    assert r[-1] == pytest.approx(math.hypot(0.6, 12.0 - 1.8), rel=1e-12)
    assert x[0] == pytest.approx([0.6 * math.cos(1.0), 0.6 * math.sin(1.0)])


def test_wound_and_held():
    assert closed_forms.wound_contact_force(PAPER, T) == pytest.approx(10.0 / 3.0, rel=1e-12)
    arc = np.linspace(0.0, 12.0, 1001)
    tension, pressure = closed_forms.wound_tension(PAPER, T, arc), closed_forms.wound_pressure(PAPER, T, arc)
    assert tension[[0, -1]] == pytest.approx([T / 0.6, 0.0])
    assert np.trapezoid(pressure, arc) == pytest.approx(closed_forms.wound_contact_force(PAPER, T), rel=1e-12)
    # the field's moment about the axis is the root's tension times the radius
    assert tension[0] * PAPER.radius == pytest.approx(T)
    energy = np.trapezoid(tension**2, arc) / (2.0 * PAPER.axial_stiffness)
    assert closed_forms.membrane_energy(PAPER, T) == pytest.approx(energy, rel=1e-6)
    assert closed_forms.root_strain(PAPER, T) == pytest.approx(0.0074074, rel=1e-4)
    ratio = closed_forms.membrane_energy(PAPER, T) / closed_forms.bending_energy(PAPER)
    assert ratio == pytest.approx(870, rel=0.02)


@pytest.mark.parametrize("k", [0.2, 1.0, 3.0])
def test_a_tapered_rib_wound_and_held(k):
    """A field along the hub in proportion to the mass, summed from the tip on."""
    rib = PAPER._replace(taper=k)
    x = (np.arange(20000) + 0.5) / 20000
    thickness = 2.0 * (1.0 + (k - 1.0) * x) / (1.0 + k)
    summed = T / 0.6 * (1.0 - np.cumsum(thickness) / thickness.sum())
    ends = 12.0 * (x + 0.5 / 20000)
    assert closed_forms.wound_tension(rib, T, ends) == pytest.approx(summed, abs=1e-9)
    pressure = closed_forms.wound_pressure(rib, T, 12.0 * x)
    assert closed_forms.wound_contact_force(rib, T) == pytest.approx(12.0 * pressure.mean(), rel=1e-6)
    assert closed_forms.axial_stiffness_at(rib, 12.0 * x) == pytest.approx(45.0 * thickness)
    strain = closed_forms.wound_tension(rib, T, 12.0 * x) / (45.0 * thickness)
    assert closed_forms.root_strain(rib, T) == pytest.approx(strain.max(), rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("alpha", [1.9, 20.0, 1e5])
def test_strong_drag_winds_a_string_at_a_rate_that_the_drag_allows(alpha):
    """Without inertia the times are in proportion to alpha; by quadrature of the moments' balance."""
    R, L, m = PAPER.radius, PAPER.length, PAPER.line_density
    th = (np.arange(2000) + 0.5) / 2000 * 0.5 * math.pi
    inertia = R * R * L + L**3 / 3.0 + R * L * L * np.cos(th)
    swing = np.mean(inertia / (1.0 + 1.5 * R * np.cos(th) / L)) * 0.5 * math.pi
    tail = L * (1.0 - 0.98 * (np.arange(2000) + 0.5) / 2000)
    wind = np.mean(R * R * L + tail**3 / 3.0) * 0.98 * L / R
    found = closed_forms.string_winding(PAPER, T, alpha, longest=1e9)
    assert found.end_time == pytest.approx(alpha * m / T * (swing + wind), rel=5e-3 / alpha + 1e-6)


def test_deployment():
    assert closed_forms.deployment_speed(PAPER) == pytest.approx(0.01398, abs=1e-5)
    assert closed_forms.deployment_time(PAPER) == pytest.approx(8587.0, abs=1.0)
    found = closed_forms.deployed_tip_radius(PAPER, np.array([0.0, 1000.0, 4000.0, 8000.0]))
    # these were computed with the speed rounded to four digits
    assert found == pytest.approx([0.6, 4.139, 8.214, 11.599], abs=2e-3)
    end = closed_forms.deployment_time(PAPER)
    assert closed_forms.deployed_length(PAPER, np.array([end, 2 * end])) == pytest.approx([12.0, 12.0], rel=1e-12)


def test_deployment_solves_lagranges_equation(book):
    """Tail of length l = R ph, m l^3 ph'^2/6 less EI l/(2 R^2) released: solved from a short tail on."""
    R, m, EI = PAPER.radius, PAPER.line_density, PAPER.bending_stiffness
    v = closed_forms.deployment_speed(PAPER)

    def rates(_, y):
        tail = R * y[0]
        return [y[1], (EI / (2 * R) - 0.5 * m * R * tail**2 * y[1] ** 2) / (m * tail**3 / 3)]

    start = 100.0
    tail = float(closed_forms.deployed_length(PAPER, start))
    found = solve_ivp(rates, (start, 8000.0), [tail / R, v / tail], rtol=1e-10, atol=1e-12)
    assert R * found.y[0, -1] == pytest.approx(float(closed_forms.deployed_length(PAPER, 8000.0)), rel=1e-6)
    assert R * found.y[0, -1] * found.y[1, -1] == pytest.approx(v, rel=1e-6)
    book(
        "Wrapped rib", "Free deployment: length out", reference="v^2 = 3 E I/(rho A R^2), Lagrange's equation",
        source="SciPy, 1e-10", error=abs(R * found.y[0, -1] / float(closed_forms.deployed_length(PAPER, 8000.0)) - 1.0),
        allowed=1e-6,
    )  # fmt: skip
