"""Steps of copies of explicit runs: found stable by bounds, refused with the number of the copy, or planned alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import config

from evolvent import System, elements, parts
from evolvent.solvers.time.explicit.methods import METHODS
from evolvent.solvers.time.explicit.plan import choose_step
from evolvent.solvers.time.explicit.stability import amplification, stability_polynomial, stable_radius
from evolvent.solvers.time.explicit.stable_copies import StableCopies
from evolvent_base.errors import InputError

COMPILED = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="bounds are found by compiled functions")


def rod() -> System:
    """A rod that hangs on a joint, with a spring at its tip."""
    system = System(gravity=(0.0, -9.81, 0.0))
    material = elements.Material(young_modulus=2e7, poisson_ratio=0.3, density=7200.0)
    section = elements.Circle(radius=0.01)
    system.add(parts.Rod(length=1.0, section=section, material=material, elements=5), "rod")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root"))
    system.add(parts.Spring(a=(1.0, 0.2, 0.0), b="rod.tip", stiffness=1.0, damping=0.1, length=0.1), "spring")
    return system


def hinged() -> System:
    """A body on a damped hinge."""
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.2, 0.3), position=(0.5, 0.0, 0.0)), "arm")
    system.add(
        parts.Joint(a=(0.0, 0.0, 0.0), b=("arm", (-0.5, 0.0, 0.0)), type="revolute", axis=(0.0, 0.0, 1.0)), "hinge"
    )
    system.add(parts.JointSpring(joint="hinge", stiffness=5.0, damping=0.1), "spring")
    return system


CASES = [(rod, "spring.stiffness", 1.0), (rod, "rod.material.young_modulus", 2e7), (hinged, "spring.stiffness", 5.0)]


@COMPILED
@pytest.mark.parametrize(("build", "key", "value"), CASES)
def test_a_bound_is_no_less_than_the_highest_frequency(build: Any, key: str, value: float) -> None:
    """No step that the plan of a copy refuses is taken for stable; small ones are."""
    factors, sure = np.array([0.5, 1.0, 2.0, 1e2, 1e4]), []
    system = build()
    for step in (1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 0.1, 0.3):
        try:
            batch = system.batch(factors.size, until=1.0, method="rk4", step=step, workers=1)
        except InputError:
            break
        found = dict[int, Any]()
        parameters, copies = batch._parameters, batch._copies
        assert StableCopies.apply(copies.run)
        try:
            batch.expand(key, value * factors)
        except InputError as error:
            found[-1] = error
        kept = copies.keep_plan(np.arange(factors.size), parameters._write_to)
        for k, factor in enumerate(factors):
            assembly = system.with_values({key: value * factor}).assemble()
            try:
                choose_step(assembly, "rk4", step, 1.0)
            except InputError:
                assert not kept[k], (step, factor)
                assert found, (step, factor)
        sure.append(int(kept.sum()))
        batch.close()
    assert sure[0] >= 4
    assert sure == sorted(sure, reverse=True)


def test_an_unstable_step_of_one_copy_is_refused() -> None:
    """With the number of the copy; the others are as before."""
    batch = rod().batch(4, until=0.01, method="rk4", step=1e-4, workers=1)
    with pytest.raises(InputError, match=r"copy 2: step is 0\.0001 s, above the stability limit"):
        batch.expand("rod.material.young_modulus", [2e7, 2.1e7, 2e13, 1.9e7])
    batch.close()


@pytest.mark.parametrize("build", [rod, hinged])
def test_copies_of_which_a_bound_is_known_have_the_bits_of_single_runs(build: Any) -> None:
    """Of a mass that changes, too."""
    key = "rod.material.density" if build is rod else "arm.mass"
    values = [1.9, 2.0, 2.2] if build is hinged else [7000.0, 7200.0, 7500.0]
    system = build()
    batch = system.batch(3, until=0.02, method="rk4", step=1e-4, workers=1)
    batch.expand(key, values)
    batch.run()
    for k, value in enumerate(values):
        one = system.with_values({key: value}).batch(1, until=0.02, method="rk4", step=1e-4, workers=1)
        one.run()
        assert batch.states[k].tobytes() == one.states[0].tobytes()
        one.close()
    batch.close()


@pytest.mark.parametrize("method", [name for name, of in METHODS.items() if not of.is_adaptive])
def test_a_method_is_stable_in_half_a_disc(method: str) -> None:
    """Of the radius that is found, and in none that is much larger."""
    radius, rng = stable_radius(METHODS[method], 1e-3, 1.0), np.random.default_rng(0)
    polynomial = stability_polynomial(METHODS[method])
    within = radius * np.sqrt(rng.random(2000)) * np.exp(1j * np.pi * (0.5 + rng.random(2000)))
    assert np.all(amplification(polynomial, within) <= 1.0 + 0.05e-3)
    edge = 1.05 * radius * np.exp(1j * np.pi * np.linspace(0.5, 1.0, 400))
    assert np.any(amplification(polynomial, edge) > 1.0 + 0.05e-3)
