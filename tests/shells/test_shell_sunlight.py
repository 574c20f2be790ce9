"""Balance of heat of shells in sunlight, against closed forms and an independent integration."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import scipy.integrate
import scipy.optimize

import evolvent as ev
from evolvent import cases, parts
from evolvent_base.errors import InputError

Array = np.ndarray
SIGMA, FLUX = 5.670374419e-8, 1361.0
E, NU, DENSITY, EXPANSION, THICKNESS = 70e9, 0.3, 1600.0, 2e-6, 2e-3
CONDUCTIVITY, SPECIFIC_HEAT = 0.8, 900.0
CAPACITY, CONDUCTANCE = SPECIFIC_HEAT * DENSITY * THICKNESS, CONDUCTIVITY / THICKNESS
WALL = ev.Material(young_modulus=E, poisson_ratio=NU, density=DENSITY, thermal_expansion=EXPANSION)
#: Light from +z on the top, which is less than all that it takes.
BALANCE = {
    "conductivity": CONDUCTIVITY, "specific_heat": SPECIFIC_HEAT, "absorptivity": 0.9, "emissivity": 0.8,
    "absorptivity_bottom": 0.3, "emissivity_bottom": 0.5, "direction": (0.6, 0.0, -0.8),
}  # fmt: skip


def panel(held: bool = True, shell: Any = None, **balance: Any) -> ev.System:
    system = ev.System()
    keys: Any = {"size": (0.2, 0.1), "elements": (2, 1), "thickness": THICKNESS, "material": WALL} | (shell or {})
    system.add(parts.Shell(**keys), "panel")
    if held:
        system.add(parts.Joint(a="ground", b="panel[0]", type="clamp"), "held")
    system.add(parts.ThermalLoad(part="panel", balance=BALANCE | balance), "heat")
    return system


def faces(found: Any) -> tuple[Array, Array]:
    """Temperatures of top and bottom of the first element, K, over time."""
    heat = found["heat"]
    return heat.absolute_temperature_top.values[:, 0], heat.absolute_temperature_bottom.values[:, 0]


def balanced(q_top: float, q_bottom: float) -> Array:
    """Temperatures of top and bottom at which as much goes as comes."""

    def unbalance(T: Array) -> list[float]:
        flow = CONDUCTANCE * (T[0] - T[1])
        return [
            q_top - 0.8 * SIGMA * (T[0] ** 4 - 2.7**4) - flow, q_bottom - 0.5 * SIGMA * (T[1] ** 4 - 2.7**4) + flow
        ]  # fmt: skip

    return np.asarray(scipy.optimize.fsolve(unbalance, [300.0, 290.0], xtol=1e-11))


@pytest.mark.parametrize("side", ["top", "bottom"])
def test_the_steady_temperatures_of_a_panel(side: str, book: Any) -> None:
    """The lit face is the one towards the sun; the other one is warmed through the wall alone."""
    sign = -1.0 if side == "top" else 1.0
    found: Any = panel(direction=(0.6, 0.0, 0.8 * sign)).equilibrium()
    cosine = float(found["heat"][f"absorbed_{side}"][-1, 0]) / (FLUX * (0.9 if side == "top" else 0.3))
    assert cosine == pytest.approx(0.8, abs=1e-3)  # the panel bends a little
    lit = FLUX * cosine * (0.9 if side == "top" else 0.3)
    wanted = balanced(*((lit, 0.0) if side == "top" else (0.0, lit)))
    error = float(np.abs(np.array([one[-1] for one in faces(found)]) / wanted - 1.0).max())
    book("Statics of shells", f"temperatures of a panel in sunlight on its {side}", reference="balance of both faces",
         source="independent solution", error=error, allowed=1e-9)  # fmt: skip
    other = "bottom" if side == "top" else "top"
    assert float(found["heat"][f"absorbed_{other}"][-1, 0]) == 0.0
    steady = found["heat"].temperature_gradient.values[-1, 0] * THICKNESS
    assert steady == pytest.approx(wanted[0] - wanted[1], rel=1e-9)


def series(t: Array) -> Array:
    """Difference of the faces of a slab with the flux q into one face, the other insulated, over q h/k."""
    n = np.arange(1, 400, 2)[:, None]
    rate = math.pi**2 * CONDUCTIVITY / (DENSITY * SPECIFIC_HEAT * THICKNESS**2)
    return np.asarray(0.5 - 4.0 / math.pi**2 * np.sum(np.exp(-(n**2) * rate * t) / n**2, axis=0))


@pytest.mark.parametrize("method", ["energy-momentum", "generalized-alpha"])
def test_conduction_through_the_thickness(method: str, book: Any) -> None:
    """A wall that hardly emits: its difference of temperatures grows with h^2/(pi^2 a), 0.73 s, its mean steadily."""
    flux = 100.0
    dark: Any = {
        "emissivity": 1e-9,
        "emissivity_bottom": 0.0,
        "absorptivity": 1.0,
        "flux": flux,
        "direction": (0, 0, -1),
    }
    found: Any = panel(False, **dark).simulate(until=2.0, every=0.1, method=method, step=0.02, fine=False)
    (top, bottom), t = faces(found), found.time.values
    wanted = flux / CONDUCTANCE * series(t[2:])  # before, the heat has not gone through the wall
    error = float(np.abs((top - bottom)[2:] - wanted).max() / wanted.max())
    book("Dynamics", f"conduction through the wall of a shell ({method})", reference="slab with a flux, series",
         source="closed form", error=error, allowed=0.01)  # fmt: skip
    rise = found["heat"].temperature_change.values[:, 0]
    np.testing.assert_allclose(rise, flux * t / CAPACITY, rtol=1e-4, atol=1e-9)


def test_a_wall_cools_in_the_shadow() -> None:
    """A thin wall of one temperature: 1/T^3 grows steadily, by 3 (e_top + e_bottom) sigma/C."""
    found: Any = panel(initial=350.0, conductivity=400.0, flux=0.0, surroundings=1e-3).simulate(
        until=100.0, every=20.0, method="energy-momentum", step=2.0
    )
    top, _ = faces(found)
    wanted = (350.0**-3 + 3.0 * 1.3 * SIGMA * found.time.values / CAPACITY) ** (-1.0 / 3.0)
    np.testing.assert_allclose(top, wanted, rtol=1e-5)


def test_a_panel_that_turns_is_lit_on_both_faces_in_turn() -> None:
    """Free, with the rate w about y: it takes the heat of |cos w t| by the absorptivity of the lit face."""
    w, bright = 0.5, {"emissivity": 1e-9, "emissivity_bottom": 0.0, "conductivity": 400.0, "direction": (0, 0, -1)}
    found: Any = panel(held=False, shell={"angular_velocity": (0.0, w, 0.0)}, **bright).simulate(
        until=12.0, every=0.5, method="energy-momentum", step=0.05
    )
    t = found.time.values
    fine = np.linspace(0.0, 12.0, 24001)
    cosine = np.cos(w * fine)
    taken = FLUX * np.where(cosine > 0.0, 0.9 * cosine, -0.3 * cosine)
    wanted = np.interp(t, fine, scipy.integrate.cumulative_simpson(taken, x=fine, initial=0.0)) / CAPACITY
    rise = found["heat"].temperature_change.values[:, 0]
    np.testing.assert_allclose(rise, wanted, atol=2e-4 * wanted.max())
    assert found["heat"].absorbed_top.values[:, 0].max() > 0.0
    assert found["heat"].absorbed_bottom.values[:, 0].max() > 0.0


def test_the_balance_of_energy_of_a_panel_that_comes_into_the_sun() -> None:
    """Thermal snap of a cantilever at sunrise: the work of the heat closes the balance."""
    found: Any = panel(
        held=False, shell={"clamped": ("x0",), "elements": (4, 1), "size": (0.4, 0.05)}, start=0.05, until=0.3
    ).simulate(until=0.5, every=0.01, method="energy-momentum", step=0.005, spectral_radius=1.0)
    energy = float(found.energy.max())
    assert energy > 0.0
    assert np.abs(found.energy_defect).max() < 1e-8 * energy
    assert float(found["heat"].absorbed_top[2, 0]) == 0.0
    assert float(found["heat"].absorbed_top[20, 0]) > 0.0
    assert float(found["heat"].absorbed_top[-1, 0]) == 0.0


@pytest.mark.parametrize(
    ("balance", "words"),
    [
        ({"emissivity": 0.0, "emissivity_bottom": 0.0}, "at least one face must emit"),
        ({"conductivity": 0.0}, "conductivity"),
    ],
)
def test_a_balance_without_an_end_is_refused(balance: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        panel(**balance)


def test_what_has_no_wall_is_refused() -> None:
    system = ev.System()
    system.add(parts.Rod(length=1.0, section=ev.Circle(radius=0.01), material=WALL, elements=2), "rod")
    system.add(parts.ThermalLoad(part="rod", balance=BALANCE), "heat")
    with pytest.raises(InputError, match=r"heat\.balance is given, but 'rod' is no shell"):
        system.assemble()
    system = panel()
    with pytest.raises(InputError, match="balance of heat"):
        system.simulate(until=0.1, every=0.1, method="dopri5")
    system = ev.System()
    system.add(parts.Shell(size=(0.2, 0.1), elements=(2, 1), thickness=THICKNESS, material=WALL), "panel")
    system.add(parts.ThermalLoad(part="panel", balance=BALANCE, temperature={"constant": 1.0}), "heat")
    with pytest.raises(InputError, match=r"heat\.temperature is given beside heat\.balance"):
        system.assemble()


def test_a_turn_across_the_light_is_refused() -> None:
    """Light along the axis of a steady turn is the same at every angle."""
    for direction in ((0.0, 0.0, -1.0), (0.6, 0.0, -0.8)):
        system = ev.System()
        system.add(parts.RigidBody(motion="driven", rate=0.1), "hub")
        shell: Any = {"size": (0.2, 0.1), "elements": (2, 1), "thickness": THICKNESS, "material": WALL}
        system.add(parts.Shell(angular_velocity=(0, 0, 0.1), **shell), "panel")
        system.add(parts.Joint(a=("hub", (0, 0, 0)), b="panel[0]", type="clamp"), "held")
        system.add(parts.ThermalLoad(part="panel", balance=BALANCE | {"direction": direction}), "heat")
        if direction[0] == 0.0:
            assert system.equilibrium(rotating="hub").attrs["status"] == "success"
            continue
        with pytest.raises(InputError, match="heat"):
            system.equilibrium(rotating="hub")


def test_a_case_file_holds_a_balance() -> None:
    system = panel(conductivity="0.8 W/(m K)", specific_heat="900 J/(kg K)", flux="1.361 kW/m^2", initial="20 degC")
    again = ev.load(cases.parse_yaml(system.to_yaml(), "text"))
    assert np.array_equal(system.assemble().model.parameters, again.assemble().model.parameters)
