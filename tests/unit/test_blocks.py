"""The table of coordinates by kind: every coordinate once, masses, displacements of both methods, mean states."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent import model as mdl
from evolvent.kernels.blocks import ANGLE, RATE, ROTATION, displace, indices
from evolvent.model.interval import NUMBERS
from evolvent.solvers.common.balance import BALANCE
from evolvent.solvers.common.sizes import sizes
from evolvent.solvers.static import equilibrium
from evolvent.solvers.static.work import Work
from evolvent.solvers.time.explicit import events as explicit_events
from evolvent.solvers.time.implicit import workspace as implicit_state
from evolvent.solvers.time.implicit.setup import shares
from families.plain import CASES
from families.rows import FAMILIES


@pytest.mark.parametrize("name", [row.name for row in FAMILIES])
def test_every_coordinate_is_in_one_block(name: str) -> None:
    model = CASES[name]().system().assemble().model
    blocks, n_q = model.blocks, int(model.info.nq)
    own = np.arange(4) < blocks["count"][:, None]
    assert sorted(indices(blocks, "iv", 4)[own]) == list(range(n_q, n_q + int(model.info.nv)))
    own[blocks["kind"] == ROTATION] = True
    own[blocks["kind"] == RATE] = False
    assert sorted(indices(blocks, "iq", 4)[own]) == list(range(n_q))


@pytest.mark.parametrize("name", ["a beam", "a rod", "a free body", "a point mass", "a contact with friction"])
def test_shares_are_those_of_the_mass_matrix(name: str) -> None:
    """Shares of the rates, beside the diagonal of the mass matrix that the residual has."""
    assembly = CASES[name]().system().assemble()
    weight, _ = sizes(assembly)
    mass = Work(assembly, None, 0.0, np.zeros(6)).mass().diagonal()
    assert shares(assembly.model, weight, conserves=False) == pytest.approx(mass / (mass @ weight**2), rel=1e-9)


@pytest.mark.parametrize(
    "name", ["a beam", "a rod", "a free body", "a body that spins about an axis", "a reaction wheel"]
)
def test_both_maps_of_rotations_are_one_turn(name: str) -> None:
    """A rotation by its angle is that by 2 tan(angle/2) about the same axis; quaternions keep the length 1."""
    assembly = CASES[name]().system().assemble()
    model, n_q, rng = assembly.model, int(assembly.model.info.nq), np.random.default_rng(1)
    by_angle, by_tangent = assembly.y.copy(), assembly.y.copy()
    dq = 0.3 * rng.standard_normal(int(model.info.nv))
    tangents = dq.copy()
    for block in model.blocks[np.isin(model.blocks["kind"], (ROTATION, ANGLE))]:
        own = slice(int(block["iv"]) - n_q, int(block["iv"]) - n_q + int(block["count"]))
        angle = np.linalg.norm(dq[own])
        tangents[own] *= 2.0 * np.tan(0.5 * angle) / angle
    displace(assembly.y, dq, False, model, by_angle)
    displace(assembly.y, tangents, True, model, by_tangent)
    assert by_tangent == pytest.approx(by_angle, abs=1e-15)
    for block in model.blocks[model.blocks["kind"] == ROTATION]:
        assert np.linalg.norm(by_angle[block["iq"] : block["iq"] + 4]) == pytest.approx(1.0, abs=1e-15)


def test_fields_of_records_are_no_attributes_of_numpy_records() -> None:
    """Without compilation a field is read as an attribute, which NumPy's own attributes would hide."""
    own = {"step": NUMBERS, "loop": implicit_state.LOOP, "options": implicit_state.OPTIONS, "balance": BALANCE}
    kinds = dict(mdl.RECORDS) | own | {"explicit loop": explicit_events.LOOP, "search": equilibrium.LOOP}
    hidden = {name: [f for f in kind.names or () if hasattr(np.record, f)] for name, kind in kinds.items()}
    assert not {name: fields for name, fields in hidden.items() if fields}
