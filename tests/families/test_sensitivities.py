"""Sensitivities of a run through every family that they support are central differences of runs with fixed steps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import evolvent
import families.plain  # noqa: F401  (it imports all cases)
from evolvent import System
from evolvent.analysis.sensitivity import key_of
from evolvent.model.registry import families as family_table
from evolvent.results.kept import kept_of
from evolvent.results.tree import root_of
from evolvent.solvers.time.implicit import plan as implicit
from evolvent_base.errors import InputError
from families.case import CASES
from families.rows import FAMILIES

ALPHA, ENERGY = "generalized-alpha", "energy-momentum"
#: Families, and methods that support them.
SOLVERS = {"implicit": ALPHA, "energy": ENERGY}
PAIRS = [
    (family.name, method)
    for family in FAMILIES
    if family_table()[family.records].smooth
    and family.name in CASES
    and family.name not in ("a layer on other turns", "a rod that pays out")
    for solver, method in SOLVERS.items()
    if solver in family.solvers
]
VALUE = "energy_kinetic.last"


def keys_of(system: System, part: str) -> list[str]:
    """Keys of a part that hold numbers above zero with units, and may be changed to both sides."""
    found: list[str] = []
    if part not in system.parts:
        return found
    for name in type(system.parts[part]).model_fields:
        try:
            key = key_of(system, f"{part}.{name}")
            for side in (1.0, -1.0):
                system.with_values({key.name: key.value * (1.0 + 1e-3 * side)}).assemble()
        except InputError:
            continue
        if key.value > 0.0:
            found.append(key.name)
    return found


def value_of(system: System, samples: np.ndarray, **settings: Any) -> float:
    found = implicit.plan(system.assemble(), samples=samples, newton=1e-14, **settings).run()
    assert found.status == "success", found.message
    kept = kept_of(found, [VALUE], lambda: root_of(found, {}), fine=np.zeros(found.t.size, dtype=bool), why="")
    return float(kept[VALUE])


@pytest.mark.slow
@pytest.mark.parametrize(("family", "method"), PAIRS)
def test_they_are_central_differences(family: str, method: str) -> None:
    case = CASES[family]()
    system = case.system()
    keys = keys_of(system, case.part)[:3]
    if not keys:
        pytest.skip("no key of the part is a number above zero")
    until = 0.37 * case.end
    step = until / 60.0
    settings = {"method": method, "step": step, "spectral_radius": 0.9}
    found = system.sensitivity(VALUE, keys, until=until, fine=False, **settings).dataset
    samples = evolvent.analysis.settings.sample_times(until)
    scale = max(float(found.result[0]), 1e-9)
    for j, key in enumerate(keys):
        at, d = float(found["at"][j]), 1e-3

        def central(part: float, key: str = key, at: float = at) -> float:
            ends = [value_of(system.with_values({key: at * (1.0 + s * part)}), samples, **settings) for s in (1, -1)]
            return (ends[0] - ends[1]) / (2.0 * part)

        compared = (4.0 * central(0.5 * d) - central(d)) / 3.0
        relative = float(found.derivative[0, j]) * at
        assert relative == pytest.approx(compared, rel=1e-6, abs=1e-6 * scale), key
