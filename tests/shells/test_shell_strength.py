"""Strength of walls: plies against closed forms of Jones, and a shell that is bent to yield."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, parts
from evolvent.elements import Material
from evolvent.elements.laminates import Laminate, Ply
from evolvent.elements.strength import failure_index, ply_stresses
from shells.plates import loaded, material

Array = np.ndarray
# E-glass and epoxy (Jones 1999, table 2-3), ksi as Pa
GLASS = Material(
    young_modulus=7.8e6, young_modulus_2=2.6e6, shear=1.25e6, poisson_ratio=0.25, density=1.0, tensile_strength=150e3,
    compressive_strength=150e3, tensile_strength_2=4e3, compressive_strength_2=20e3, shear_strength=6e3,
)  # fmt: skip


def strains(plies: tuple[Ply, ...], resultants: Any) -> Array:
    """Strains and curvatures by membrane forces and moments."""
    return np.asarray(np.linalg.solve(Laminate(plies=plies).properties().stiffness[:6, :6], resultants))


@pytest.mark.parametrize("angle", [0.0, 15.0, 30.0, 60.0, 90.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_off_axis_strength(angle: float, sign: float) -> None:
    """A ply pulled at an angle: 1/s^2 = c^4/X^2 + (1/S^2 - 1/X^2) c^2 s^2 + s^4/Y^2 (Jones, 2.128)."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    X, Y, S = 150e3, 4e3 if sign > 0.0 else 20e3, 6e3
    wanted = 1.0 / math.sqrt(
        (c / math.sqrt(X) * c / math.sqrt(X)) ** 2 + (1 / S**2 - 1 / X**2) * (c * s) ** 2 + s**4 / Y**2
    )
    plies = (Ply(material=GLASS, thickness=0.3, angle=math.radians(angle)),)
    stress = ply_stresses(plies, strains(plies, [sign * wanted * 0.3, 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert failure_index(GLASS, stress) == pytest.approx(np.ones((1, 2)), rel=1e-9)


def test_plies_of_a_cross_ply() -> None:
    """Plies of [0, 90, 90, 0] share a tension as their moduli; bent, the outer ones have the stress of a sandwich."""
    plies = tuple(Ply(material=GLASS, thickness=0.1, angle=math.radians(a)) for a in (0, 90, 90, 0))
    E1, E2, nu, d = 7.8e6, 2.6e6, 0.25, 1.0 - 0.25**2 * 2.6 / 7.8
    A = np.array([[E1 + E2, 2.0 * nu * E2], [2.0 * nu * E2, E1 + E2]]) * 0.2 / d
    e = np.linalg.solve(A, [100.0, 0.0])
    stress = ply_stresses(plies, strains(plies, [100.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert stress[0, 0, :2] == pytest.approx([(E1 * e[0] + nu * E2 * e[1]) / d, (nu * E2 * e[0] + E2 * e[1]) / d])
    assert stress[1, 1, :2] == pytest.approx([(E1 * e[1] + nu * E2 * e[0]) / d, (nu * E2 * e[1] + E2 * e[0]) / d])
    assert stress[0, 0] == pytest.approx(stress[3, 1])
    bent = ply_stresses(plies, np.array([0.0, 0.0, 0.0, 1e-3, 0.0, 0.0]))
    across = np.array([-0.2 * E1, -0.1 * E1, -0.1 * nu * E2, 0.0, 0.0, 0.1 * nu * E2, 0.1 * E1, 0.2 * E1])
    assert bent[:, :, 0].ravel() == pytest.approx(1e-3 / d * across)


def test_isotropic_is_von_mises() -> None:
    """Of an isotropic material with one strength."""
    own, stress = Material(young_modulus=1e9, density=1.0, tensile_strength=5.0), np.array([3.0, -2.0, 1.5])
    wanted = math.sqrt(3.0**2 + 2.0**2 + 3.0 * 2.0 + 3.0 * 1.5**2) / 5.0
    assert float(failure_index(own, stress)) == pytest.approx(wanted)
    with pytest.raises(InputError, match=r"shear_strength is given, but tensile_strength is missing; give it too"):
        Material(young_modulus=1e9, density=1.0, shear_strength=5.0)


def test_strip_bent_to_yield() -> None:
    """By a moment per length m: the stress 6 m/h^2 and the strain h/2 of the curvature."""
    E, h, m, strength = 1e9, 0.01, 20.0, 2e6
    own = material(E).model_copy(update={"tensile_strength": strength})
    shell = parts.Shell(size=(1.0, 0.2), elements=(8, 2), thickness=h, material=own, clamped=("x0",))
    run = loaded(shell, "x1", torque=(0.0, -m, 0.0)).equilibrium()["shell"]
    stress, curvature = 6.0 * m / h**2, 12.0 * m / (E * h**3)
    assert run["failure_index"].values[-1] == pytest.approx(np.full(16, stress / strength), rel=2e-3)
    assert float(run["strength_margin"].values[-1]) == pytest.approx(strength / stress - 1.0, rel=5e-3)
    assert run["curvature_1"].values[-1] == pytest.approx(np.full(16, -curvature), rel=2e-3)
    assert run["largest_strain"].values[-1] == pytest.approx(np.full(16, 0.5 * h * curvature), rel=2e-3)
    assert run["curvature_1"].attrs["units"] == "m-1"
    assert "strength_margin" in run.attrs["plots"]


@pytest.mark.parametrize("angles", [(0, 90, 90, 0), (0, 90)])
def test_cooled_plies(angles: tuple[int, ...]) -> None:
    """Without forces: stress across fibres, of layers that hold one another; curvature of a pair (Timoshenko 1925)."""
    E1, E2, T, Y, one, h = 100e9, 10e9, -10.0, 40e6, 3e-5, 0.1e-3
    ply = Material(
        young_modulus=E1, young_modulus_2=E2, poisson_ratio=0.0, shear=4e9, density=1600.0, thermal_expansion=0.0,
        thermal_expansion_2=one, tensile_strength=1e15, tensile_strength_2=Y,
    )  # fmt: skip
    wall: Any = {"laminate": [{"material": ply, "thickness": h, "angle": f"{a} deg"} for a in angles]}
    system = System()
    system.add(parts.Shell(size=(0.04, 0.005), elements=(4, 1), section=wall), "wall")
    system.add(parts.ThermalLoad(part="wall", temperature={"constant": T}), "cool")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="wall[0]", type="clamp"), "held")
    run: Any = system.equilibrium()["wall"]
    if len(angles) == 4:
        stress, curvature = E1 * E2 * one * -T / (E1 + E2), 0.0
        assert run["failure_index"].values[-1] == pytest.approx(np.full(4, stress / Y), rel=1e-3)
        assert run["largest_strain"].values[-1] == pytest.approx(np.full(4, E2 * one * -T / (E1 + E2)), rel=1e-3)
    else:
        curvature = 12.0 * one * T / (h * (14.0 + E1 / E2 + E2 / E1))
    assert run["curvature_1"].values[-1] == pytest.approx(np.full(4, curvature), rel=1e-2, abs=1e-9)
