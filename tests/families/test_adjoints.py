"""Derivatives of the state at the end by the adjoint are those of neighbours, through every family that it supports."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import System
from evolvent.analysis import sensitivity
from evolvent.analysis.runs import plan
from evolvent.analysis.sensitivity import Key
from evolvent.model.registry import whole
from evolvent.solvers.sensitivity.adjoint import Adjoint
from evolvent.solvers.sensitivity.adjoint_events import between
from evolvent.solvers.sensitivity.patches import Sides
from evolvent_base.errors import InputError
from families.case import CASES
from families.test_sensitivities import ENERGY, PAIRS, keys_of

#: Of a part of a family that has no adjoint.
UNSUPPORTED = "is (a|the|one) .*, which the adjoint does not support"
#: Families of systems that are refused, by what they are called in the sentence.
REFUSED = {
    "a joint spring on an angle with a latch": "latches and events beside beams",
    "a joint coordinate with friction": "joints have friction",
    "a bearing": UNSUPPORTED,
    "a custom force": UNSUPPORTED,
    "a load on a thread": UNSUPPORTED,
    "a force on a node of a thread": UNSUPPORTED,
    "a thermal load on a beam": UNSUPPORTED,
    "a thermal load on a rod": UNSUPPORTED,
    "a thermal load on a shell": UNSUPPORTED,
    "a balance of heat of a shell": UNSUPPORTED,
    "a tape-spring rod": "section that is a tape",
    "a contact between bodies with friction": "contacts between bodies have friction",
    "a contact without friction": UNSUPPORTED,
    "a contact with friction": UNSUPPORTED,
    "a contact with the law conservative": UNSUPPORTED,
    "a contact with the paper's law": UNSUPPORTED,
    "a Prony term": "a part is viscoelastic",
    "a viscoelastic beam": "a part is viscoelastic",
    "a viscoelastic cable": "a part is viscoelastic",
    "a viscoelastic rod": "a part is viscoelastic",
    "a viscoelastic thread": "a part is viscoelastic",
    "a viscoelastic thread on a free spool": "a part is viscoelastic",
    "a viscoelastic shell": "a part is viscoelastic",
}
#: Largest difference beside the largest change of a coordinate, or of a rate times a step.
WITHIN = 1e-6
#: The same where neighbours have fewer digits: rotations of thin walls beside their stiffest directions.
FEWER = {"a shell": 5e-6, "a seam": 5e-6}
CHANGE = sensitivity.CHANGES[0]


def sides_of(system: System, key: Key) -> Sides:
    """What a key changes."""
    changed = [sensitivity._changed(system, key, side * CHANGE) for side in (1.0, -1.0)]
    return Sides.of(system._assembled(), (changed[0], changed[1]), key.name)


def listed(system: System, part: str) -> list[tuple[Key, Sides]]:
    """Three keys of a part, or of the others beside it, and of the gravity, and what they change."""
    names = [
        name for one in [part, *(other for other in system.parts if other != part)] for name in keys_of(system, one)
    ]
    found: list[tuple[Key, Sides]] = []
    for name in [*names, *(f"gravity.{c}" for c in range(3) if system._gravity[c] != 0.0)]:
        key = sensitivity.key_of(system, name)
        try:
            found.append((key, sides_of(system, key)))
        except InputError:  # it changes what the system is made of
            continue
        if len(found) == 3:
            break
    return found


def run(system: System, keys: list[tuple[Key, Sides]], samples: np.ndarray, settings: dict[str, Any]) -> np.ndarray:
    """Derivatives of the coordinates and rates at the end by the adjoint, times the keys."""
    assembly = system._assembled()
    changed = [(key.name, CHANGE * key.size, sides) for key, sides in keys]
    adjoint = Adjoint(lambda: plan(assembly, samples, **settings)[0], changed)
    status, message = adjoint.run()
    assert status != "failed", message
    solution, n = adjoint.lead.result(status, message, 0.0), 2 * adjoint.n_v
    by_sample = np.zeros((n, solution.t.size, n))
    by_sample[:, -1] = np.eye(n)
    found = adjoint.gradients(by_sample, np.zeros((n, solution.event_times.size)))
    return found * np.array([key.size for key, _ in keys])


@pytest.mark.slow
@pytest.mark.parametrize(("family", "method"), PAIRS)
def test_they_are_those_of_neighbours(family: str, method: str) -> None:
    case = CASES[family]()
    system = case.system()
    assembly, keys = system._assembled(), listed(system, case.part)
    until = 0.37 * case.end
    step, samples = until / 60.0, np.linspace(0.0, until, 3)
    own = [one for one in whole() if one.records(assembly.model).size]
    filtered = any(one.adjoint is not None and one.adjoint.filtered for one in own)
    settings = {"method": method, "step": step, "spectral_radius": 1.0 if filtered and method == ENERGY else 0.9}
    if not keys:
        pytest.skip("no key of the system is a number other than zero")
    if family in REFUSED:
        with pytest.raises(InputError, match=f"{REFUSED[family]}.*mode 'forward'"):
            run(system, keys, samples, settings)
        return
    found = run(system, keys, samples, settings)
    change, solutions, _ = sensitivity._solutions(system, assembly, [key for key, _ in keys], samples, None, settings)
    n_v = int(assembly.model.info.nv)
    sides = [(up.y[-1], down.y[-1]) for up, down in zip(solutions[2::2], solutions[3::2], strict=True)]
    forward = np.stack([between(up, down, assembly.model) / (2.0 * change) for up, down in sides], axis=1)
    size, within = np.append(np.ones(n_v), np.full(n_v, step))[:, None], FEWER.get(family, WITHIN)
    assert np.abs(size * (found - forward)).max() < within * max(np.abs(size * forward).max(), 1e-3)
