"""Keys of the heliogyro: stiffness from the film, spiral spools, spools that turn freely; the paper's case."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import evolvent
from evolvent import InputError, cases, model as mdl
from evolvent.solvers.common.observations import observe
from helpers import L0, RHO, TIP, L, R

FILM = {"blade.young_modulus": "4 GPa", "blade.thickness": "5 um", "blade.width": "2 cm"}
EA = 400.0
LINKS = {"blade.segments": "inextensible", "solver.method": "dopri5", "output.every": "1 s"}


@pytest.mark.parametrize("nodes", [3, 20, 80])
def test_the_film_keeps_its_stiffness_over_nodes(nodes: int) -> None:
    """A stretch of the whole blade takes the energy EA e^2 L/2, whatever the number of segments."""
    case = cases.load("heliogyro", FILM | {"blade.nodes": nodes, "spool.start_length": L, "spool.rate": 0.0})
    assert case.blade.segment_stiffness == pytest.approx(EA * nodes / L, rel=1e-14)
    assembly, strain = cases.system("heliogyro").build(case).assemble(), 1e-3
    assert assembly.model.threads["stiffness"][0] == pytest.approx(EA * nodes / L, rel=1e-14)
    at, y = int(assembly.model.threads["iq"][0]), assembly.y.copy()
    y[at : at + 3 * nodes : 3] = L0 + (1.0 + strain) * (y[at : at + 3 * nodes : 3] - L0)
    seen = observe(assembly.model, np.zeros(1), y[None], assembly.s[None])
    copies = 2
    assert seen.inventory[0, mdl.ELASTIC] == pytest.approx(copies * 0.5 * EA * strain**2 * L, rel=1e-9)


def turned(time: float, thickness: float) -> float:
    """Length that a spiral spool pays out at 3.5 rad/s (thread.md), m."""
    phi = 3.5 * time
    return R * phi - thickness * phi * phi / (4.0 * math.pi)


@pytest.mark.parametrize(("thickness", "end"), [(0.0, 142.857), (5e-6, 145.8), (20e-6, 156.5)])
def test_a_spiral_spool_takes_longer(thickness: float, end: float) -> None:
    """5 m take 145.8 and 156.5 s at 5 and 20 um (thread.md); the length is r phi - h phi^2/4 pi."""
    found = evolvent.run("heliogyro", LINKS | {"spool.film_thickness": thickness})
    assert float(found.time[-1]) == pytest.approx(end, abs=0.05)
    exact = [turned(t, thickness) for t in found.time.values]
    assert found.deployed_length.values[:, 0] == pytest.approx(exact, abs=1e-12)
    assert exact[-1] == pytest.approx(L, rel=1e-12)


def test_a_spiral_spool_starts_at_the_angle_of_its_length() -> None:
    case = cases.load("heliogyro", {"spool.film_thickness": "20 um", "spool.start_length": "2 m"})
    assert turned(case.spool.start_angle / 3.5, 20e-6) == pytest.approx(2.0, rel=1e-14)


def test_a_braked_spool_against_the_pendulum_of_changing_length() -> None:
    """One node on a link (mass m at the length l, lag a) on a hub of constant rate: thread.md, "Free spool".

    (m + S/r^2) l'' = m (l a'^2 + L0 W^2 cos(a - W t)) - M/r;  l a'' + 2 l' a' + L0 W^2 sin(a - W t) = 0
    """
    W, S, brake, m, end = 6.0, 1e-4, 1.2e-4, TIP + 0.5 * RHO * L, 6.0
    free = {"inertia": S, "brake": brake, "rate": "3.5 rad/s"}
    changes: dict[str, Any] = {
        "body.motion": "driven", "spool.rate": None, "spool.free": free, "spool.start_length": "10 cm",
        "blade.nodes": 1, "blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": end,
        "output.every": "0.5 s",
    }  # fmt: skip
    found = evolvent.run("heliogyro", changes)
    assert found.attrs["status"] == "success"

    def slope(t: float, y: np.ndarray) -> list[float]:
        length, a, dl, da = y
        ddl = (m * (length * da * da + L0 * W * W * math.cos(a - W * t)) - brake / R) / (m + S / R**2)
        return [dl, da, ddl, -(2.0 * dl * da + L0 * W * W * math.sin(a - W * t)) / length]

    exact = solve_ivp(slope, (0.0, end), [0.1, 0.0, 0.035, W], t_eval=found.time.values, rtol=1e-10, atol=1e-12).y
    assert exact[0, -1] > 0.4
    assert exact[2, -1] > 0.0  # the brake slips throughout
    assert found.deployed_length.values[:, 0] == pytest.approx(exact[0], rel=1e-5)
    assert found.tip_lag.values[:, 0] == pytest.approx(W * found.time.values - exact[1], abs=1e-4)


@pytest.mark.parametrize("segments", ["springs", "inextensible"])
def test_free_spools_on_the_spinning_body(segments: str) -> None:
    """Two free spools in a spiral, symmetric about the spin axis: one blade stands for both; both balances hold."""
    free = {"inertia": "0.1 g m^2", "torque": "-20 uN m", "viscous_damping": "1 uN m s/rad", "rate": "3 rad/s"}
    changes = {
        "spool.rate": None, "spool.free": free, "spool.film_thickness": "20 um", "spool.start_length": "0.3 m",
        "blade.segments": segments, "blade.stiffness": 1e3, "solver.method": "dopri5", "solver.duration": "10 s",
        "output.every": "0.5 s", "blade.wound_mass": "carried",
    }  # fmt: skip
    found = evolvent.run("heliogyro", changes)
    assert found.attrs["status"] == "success"
    assert "blade-2" not in found.children
    assert found.deployed_length.values[-1, 0] > 0.4
    assert found.momentum_balance.values.max() < 1e-8
    assert np.abs(found.energy_defect.values).max() < 1e-6 * float(found.energy[0])


def test_the_papers_case() -> None:
    """Its keys; the first second under generalized-alpha, against the built-in case's 1e4 N/m: 0.0016 deg apart."""
    case, softer = cases.load("heliogyro-paper"), cases.load("heliogyro")
    assert (case.blade.stiffness, case.solver.method) == (1e7, "rk4")
    assert case.blade.model_copy(update={"stiffness": 1e4}) == softer.blade
    assert (case.body, case.spool) == (softer.body, softer.spool)
    short = {"solver.method": "generalized-alpha", "solver.duration": "1 s"}
    found, other = evolvent.run("heliogyro-paper", short), evolvent.run("heliogyro", LINKS | {"solver.duration": "1 s"})
    assert np.degrees(found.tip_lag.values[-1, 0] - other.tip_lag.values[-1, 0]) == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    [
        (FILM | {"blade.stiffness": 2e4}, "blade.stiffness and blade.young_modulus are both given; give one of them"),
        ({"blade.thickness": "5 um"}, "blade.thickness is given without blade.young_modulus; give both or neither"),
        (FILM | {"blade.width": None}, "blade.width is missing; blade.young_modulus needs it, such as '10 cm'"),
        (FILM | {"blade.thickness": None}, "blade.thickness is missing; blade.young_modulus needs it, such as '5 um'"),
        ({"spool.free": {"inertia": 1e-5}}, "spool.rate and spool.free are both given; give one of them"),
        (
            {"spool.free": {"inertia": 1e-5}, "spool.rate": None, "spool.table": [[0, 1], [1, 2]]},
            "spool.table and spool.free are both given; give one of them",
        ),
        ({"spool.free": {}, "spool.rate": None}, "spool.free.inertia is missing"),
        (
            {"spool.free": {"inertia": 1e-5}, "spool.rate": None},
            "solver.duration is auto, but the spools turn freely; give it, such as '60 s'",
        ),
        ({"spool.film_thickness": "1 mm"}, "spool.film_thickness is 0.001 m, which leaves no core"),
        (
            {"spool.film_thickness": "1 mm", "spool.start_length": "2 m"},
            "spool.film_thickness is 0.001 m; with spool.start_length 2 m out it must be below 0.00015708 m",
        ),
        (
            {"spool.free": {"inertia": 1e-5}, "spool.rate": None, "solver.duration": 1, **LINKS},
            "spool starts at rest with nothing out",
        ),
    ],
)
def test_refusals(overrides: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        evolvent.run("heliogyro", overrides)
    assert sentence in str(caught.value)
    assert "blade-" not in str(caught.value)
    assert "reel-" not in str(caught.value)
