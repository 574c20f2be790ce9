"""Thermal loads."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.families.rods import rod
from evolvent.families.shells import shell
from evolvent.families.thermal import thermal, walls
from evolvent.kernels import calls, free_strains, rigid
from evolvent.model import zeros
from evolvent.model.family import EVERY, EXPLICIT, Family, Kind, record
from evolvent.model.questions import Energies, Parts, Samples, Stability, Statics
from evolvent.model.shares import Shares

Array = np.ndarray
_6 = (6,)


@calls.force
def force(interval, model):
    """Forces of free strains on beams; free strains of rods and shells, before their forces."""
    step = interval.step
    if model.elements.size > 0:
        thermal.add_thermal_loads(step.t, step.t + step.h, interval.ym, step.factor, model, model.P)
    if model.rods.size > 0:
        free_strains.heat_rods(step.t, step.t + step.h, step.factor, model)
    if model.shells.size > 0:
        if model.heated_walls.size > 0:
            walls.predict_walls(step.t + 0.5 * step.h, interval.ym, model)
        free_strains.heat_shells(step.t, step.t + step.h, step.factor, model)


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of forces on beams."""
    if model.elements.size > 0:
        thermal.add_thermal_tangents(interval.ym, model, matrix)


@calls.force
def evaluate_last(interval, model):
    """What strain energies change by, less the free strains, and works of these; after what is heated."""
    thermal.evaluate_energies(int(interval.step.sample), interval.ym, model)


def _less_free_strain(model: Any, t: Array, y: Array, factor: Array | float, balance: Any) -> Any:
    """A balance with the strain energies of heated parts, and the work of loads by which they change.

    The solvers treat thermal strain as loads and take strain energies of the total strain. The strain energy of the
    total strain less the free one differs from that by `thermal.evaluate_energies`; the work of loads since the
    start differs by its change.
    """
    loads = model.thermal_loads
    if not loads.size:
        return balance
    found, y, elastic = balance.copy(), np.ascontiguousarray(y), np.zeros(t.size)
    heats_rods, heats_shells = (bool(np.any(loads[key] >= 0)) for key in ("rod", "shell"))
    for k, scale in enumerate(np.resize(factor, t.size)):
        free_strains.heat_beams(t[k], scale, model)
        if heats_rods or heats_shells:
            rigid.kinematics(t[k], y[k], model)
        if heats_rods:
            free_strains.heat_rods(t[k], t[k], scale, model)
            rod.evaluate_rods(model, model.sums[1])
        if heats_shells:
            walls.load_walls(y[k], model)
            free_strains.heat_shells(t[k], t[k], scale, model)
            shell.evaluate_shells(model, model.sums[1])
        thermal.evaluate_energies(k, y[k], model)
        elastic[k] = loads["elastic"].sum()
        found["bending"][k] += loads["bending"].sum()
    found["elastic"] += elastic
    found["loads"] += elastic - elastic[:1]
    return found


def _uneven(turn: Any, rows: list[int]) -> Iterator[int]:
    """Balances of heat whose light is not along the axis of the turn."""
    for k in rows:
        light = int(turn.model.thermal_loads["light"][k])
        if light >= 0 and not turn.along(turn.model.parameters[light : light + 3]):
            yield k


# temperatures of a beam, a rod or a shell, the others are -1 (`thermal`): indices of profiles among the parameters, or
# -1, and of the constants of the elements; walls, light: first heated wall and parameters of a balance of heat, or -1;
# expansions: of those of a beam by temperature at `beam_strains.POINTS`; now: last amplitudes; change, along_y,
# along_z, work: see `RESULTS`. Of a sample: amplitudes; elastic, bending: J, what strain energies change by, less the
# free strains; own: the part of it that is quadratic in the amplitudes; pull: minus the derivative of the rest by them
THERMAL_LOADS = Family(
    "thermal_loads",
    record(
        "beam rod shell temperature gradient_y gradient_z constants expansions walls light", "",
        "now change along_y along_z elastic bending own amplitudes pull work", now=_6, amplitudes=_6, pull=_6,
    ),
    order=50,
    results={
        "change": ("temperature", "K", "change of the temperature of the axis, where `along` is 1, or mean"),
        "along_y": ("gradient_y", "K m-1", "gradient of the temperature along y, where `along` is 1"),
        "along_z": ("gradient_z", "K m-1", "gradient of the temperature along z, where `along` is 1, or mean"),
        "work": (
            "work",
            "J",
            "work done as the free strain changes, since the first sample, by the trapezoidal rule over the samples",
        ),
    },
    kinds=(
        Kind("a thermal load on a beam", which=lambda found: found["beam"] >= 0, symmetric=True),
        Kind("a thermal load on a rod", which=lambda found: found["rod"] >= 0, symmetric=True),
        Kind("a thermal load on a shell", which=lambda r: (r["shell"] >= 0) & (r["walls"] < 0), symmetric=True),
        Kind(
            "a balance of heat of a shell", EVERY - {EXPLICIT},
            "use generalized-alpha or energy-momentum: heat goes through a wall in short times",
            which=lambda found: found["walls"] >= 0,
            symmetric=True,
        ),
    ),
    isolated=True,
    force=force,
    tangent=tangent,
    shares=Shares(unforced=lambda _: {"thermal_loads": zeros("thermal_loads", 0)}),
    smooth=True,
    of_step=False,
    parts=Parts(reads_inertia=False),
    stability=Stability(by_rates=False),
    statics=Statics(uneven=_uneven),
    energies=Energies(rebalance=_less_free_strain),
    samples=Samples(evaluate=False, last=evaluate_last),
)  # fmt: skip
