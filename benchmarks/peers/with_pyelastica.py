"""PyElastica: the cable as a Cosserat rod; the section's stiffness and inertia are set to those of the square."""

from __future__ import annotations

import importlib.metadata
import itertools
from collections.abc import Callable
from typing import Any

import elastica as ea
import numpy as np


def version() -> str:
    return importlib.metadata.version("pyelastica")


class Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing):
    """A rod, a pin and gravity."""


class Pin(ea.ConstraintBase):
    """Holds the first node at a place; the rod is free to turn there."""

    def __init__(self, place: Any, **given: Any) -> None:
        super().__init__(**given)
        self.place = np.array(place)

    def constrain_values(self, system: Any, time: float) -> None:
        """Put the node there."""
        system.position_collection[..., 0] = self.place

    def constrain_rates(self, system: Any, time: float) -> None:
        """Stop it."""
        system.velocity_collection[..., 0] = 0.0


def prepare(work: str, spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    """Position Verlet, one call a step as its own examples do."""
    n, side, E, nu = spec["elements"], spec["side"], spec["E"], spec["nu"]
    area, moment, shear = side**2, side**4 / 12.0, E / (2.0 * (1.0 + nu))
    rod = ea.CosseratRod.straight_rod(
        n,
        np.zeros(3),
        np.array([1.0, 0.0, 0.0]),
        np.array([0.0, 1.0, 0.0]),
        spec["length"],
        np.sqrt(area / np.pi),
        spec["density"],
        youngs_modulus=E,
        shear_modulus=shear,
    )
    inertia = spec["density"] * spec["length"] / n * np.array([moment, moment, 2.0 * moment])
    across = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu) * shear * area
    for i, (bend, force) in enumerate(
        ((E * moment, across), (E * moment, across), (0.1406 * shear * side**4, E * area))
    ):
        rod.bend_matrix[i, i], rod.shear_matrix[i, i] = bend, force
        rod.mass_second_moment_of_inertia[i, i], rod.inv_mass_second_moment_of_inertia[i, i] = (
            inertia[i],
            1.0 / inertia[i],
        )
    simulator = Simulator()
    simulator.append(rod)
    simulator.constrain(rod).using(Pin, constrained_position_idx=(0,))
    simulator.add_forcing_to(rod).using(ea.GravityForces, acc_gravity=np.array([0.0, -spec["gravity"], 0.0]))
    simulator.finalize()
    stepper = ea.PositionVerlet()

    def run() -> dict[str, Any]:
        times, places, steps, t = spec["samples"], [], 0, np.float64(0.0)
        for a, b in itertools.pairwise(times):
            for _ in range(round((b - a) / step)):
                t = stepper.step(simulator, t, step)
                steps += 1
            places.append(rod.position_collection[:, -1].tolist())
        return {"places": places, "steps": steps}

    return run
