"""Edgewise buckling of film blades in pay-out: estimate, Ritz's method, and limits that are known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.sparse import diags_array
from scipy.sparse.linalg import eigsh

from evolvent import closed_forms as forms
from evolvent.closed_forms import Film, Rotor

#: Body and blade of Tenenbaum (2014), table IV.1; film of 20 um and 1400 kg/m3, so that a width gives the line density.
INERTIA, OFFSET, TIP, SPIN, THICKNESS, DENSITY = 0.004, 0.05, 5e-4, 6.0, 20e-6, 1400.0
MOMENTUM = (INERTIA + 2.0 * TIP * OFFSET**2) * SPIN


def satellite(width: float) -> tuple[Film, Rotor]:
    """Film of a width, and the satellite with its blades."""
    return Film(width, THICKNESS, 1e9, 0.3), Rotor(INERTIA, OFFSET, 2, DENSITY * THICKNESS * width, TIP)


@pytest.mark.parametrize(("power", "factor"), [(0, math.pi / 2.0), (1, 4.0126), (2, 12.8538)])
def test_without_tension_it_has_the_factors_of_prandtl_and_michell(power: int, factor: float) -> None:
    """Cantilever under an end moment, a force at the tip, and a load per length."""
    film, length = Film(0.02, 20e-6, 1e9, 0.3), 1.7
    x = forms.buckling_places(length)
    moment = (length - x) ** power / math.factorial(power) * math.sqrt(film.flatwise * film.torsion)
    found = forms.lateral_buckling(film, length, moment / length ** (power + 1), clamped=True)
    assert found == pytest.approx(factor, rel=2e-5)


def differences(film: Film, rotor: Rotor, length: float, n: int = 1500) -> float:
    """Largest rate of a free root, m/s: boundary value problem in the plane, finite differences of the twist."""
    rho, tip, L0 = rotor.line_density, rotor.tip_mass, rotor.offset
    inertia = INERTIA + 2.0 * (rho * ((L0 + length) ** 3 - L0**3) / 3.0 + tip * (L0 + length) ** 2)
    W = MOMENTUM / inertia
    fall = W * 2.0 * (rho * (L0 + length) ** 2 + 2.0 * tip * (L0 + length)) / inertia
    EI, square = film.edgewise, film.gyration**2

    def tension(s: Any) -> Any:
        return W**2 * (0.5 * rho * ((L0 + length) ** 2 - (L0 + s) ** 2) + tip * (L0 + length))

    def rates(s: Any, y: Any) -> Any:
        load = rho * (2.0 * W - fall * (L0 + s)) + rho * W**2 * y[0] - rho * W**2 * (L0 + s) * y[1]
        return np.stack([y[1], y[2], y[3], (load + tension(s) * y[2]) / EI])

    def ends(a: Any, b: Any) -> Any:
        force = tip * (2.0 * W - fall * (L0 + length) + W**2 * b[0])
        return np.array([a[0], a[2], b[2], EI * b[3] - tension(length) * b[1] + force])

    s = np.linspace(0.0, length, n + 1)
    found = solve_bvp(rates, ends, s[::30], np.zeros((4, s[::30].size)), tol=1e-8)
    assert found.success
    M, h, middle = EI * found.sol(s)[2], length / n, 0.5 * (s[1:] + s[:-1])
    own = (film.torsion + tension(middle) * square) / h
    kept = np.zeros((2, n + 1))  # upper band and diagonal
    kept[1, :-1] += own
    kept[1, 1:] += own
    kept[0, 1:] -= own
    kept[1] += rho * square * W**2 * h
    lost = np.zeros((2, n + 1))
    weight = 1.0 / (tension(middle) * h)
    lost[1, :-1] += M[:-1] ** 2 * weight
    lost[1, 1:] += M[1:] ** 2 * weight
    lost[0, 1:] -= M[:-1] * M[1:] * weight
    lost[1] += M**2 / EI * h
    K, B = (diags_array([one[0, 2:], one[1, 1:], one[0, 2:]], offsets=[-1, 0, 1]).tocsc() for one in (kept, lost))
    largest = eigsh(B, k=1, M=K, Minv=None, which="LA", return_eigenvectors=False)[0]
    return float(1.0 / math.sqrt(largest))


@pytest.mark.parametrize(("width", "length"), [(0.02625, 1.0), (0.02625, 5.0), (0.01, 3.0)])
def test_ritz_s_method_agrees_with_finite_differences(width: float, length: float) -> None:
    """Of the reduced equation of the twist, in which the deflection out of the plane is eliminated."""
    film, rotor = satellite(width)
    found = forms.payout_buckling_modes(film, rotor, length, MOMENTUM)
    assert found == pytest.approx(differences(film, rotor, length), rel=5e-3)


@pytest.mark.parametrize("width", [0.01, 0.02625, 0.05])
@pytest.mark.parametrize("length", [1.0, 2.0, 3.0, 5.0, 8.0])
def test_the_estimate_agrees_with_ritz_s_method(width: float, length: float) -> None:
    """A free root, whose long waves buckle: within -3 and 5 %."""
    film, rotor = satellite(width)
    estimate = forms.payout_buckling(film, rotor, length, MOMENTUM)
    modes = [forms.payout_buckling_modes(film, rotor, length, MOMENTUM, terms=n) for n in (12, 16)]
    assert modes[1] == pytest.approx(modes[0], rel=1e-3)
    assert 0.97 < estimate / modes[1] < 1.05
    if width > 0.02:  # narrow films buckle before
        assert forms.payout_slack(film, rotor, length, MOMENTUM) < estimate


@pytest.mark.parametrize("length", [0.5, 1.0, 2.0, 3.0])
def test_a_held_root_buckles_by_short_waves_there(length: float) -> None:
    """The estimate is a lower bound, near r W0 / 2, which the length does not enter."""
    film, rotor = satellite(0.02625)
    estimate = forms.payout_buckling(film, rotor, length, MOMENTUM, root="held")
    assert 0.95 < estimate / forms.payout_buckling_modes(film, rotor, length, MOMENTUM, root="held", terms=32) < 1.02
    assert estimate == pytest.approx(0.5 * film.gyration * SPIN, rel=0.2)
    slack = forms.payout_slack(film, rotor, length, MOMENTUM, root="held")
    assert slack == pytest.approx(estimate / math.sqrt(3.0), rel=0.07)  # not without the torsion of the film


def test_stiff_strips_buckle_at_multiples_of_the_spin() -> None:
    """No tip mass, root on the axis: 4.97 r W (free root, light body) and r W / 2 (held root, heavy body)."""
    film, length, momentum = Film(0.02, 1e-9, 1e16, 0.3), 3.0, 1e-3
    light, heavy = (Rotor(inertia, 1e-6, 2, 1e-3, 0.0) for inertia in (1e-8, 1e4))
    spin = momentum / float(forms.rotor_inertia(light, length))
    free = forms.payout_buckling_modes(film, light, length, momentum)
    assert free / (film.gyration * spin) == pytest.approx(4.969, abs=0.002)
    assert forms.payout_buckling(film, light, length, momentum) == pytest.approx(free, rel=0.085)
    held = forms.payout_buckling(film, heavy, length, 1e5, root="held")
    assert held == pytest.approx(0.5 * film.gyration * 10.0, rel=1e-3)
