"""Which compiled functions a model needs: those of the families that it has."""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent import families, jit
from evolvent.flow import events, explicit_flexible, implicit, impulse, inventory, projection, rhs, sampling
from evolvent.kernels import (
    constraint_rows,
    contact,
    drive,
    flexible,
    hinge,
    loads,
    passing,
    profile,
    rigid,
    sparse,
    sparse_lu,
    thread,
)
from evolvent.model import Model


def is_flexible(model: Model) -> bool:
    """Whether a model has beams, rods, joints by penalties, hinges or user-defined laws between points."""
    f = model.flexible
    return bool(
        f.beams.size or f.rods.size or model.info.penalties or f.hinges.size or f.custom_forces.size
        or f.body_contacts.size
    )  # fmt: skip


def forces(model: Model) -> Iterator[Any]:
    """Functions of the families that explicit and implicit methods need alike."""
    f = model.flexible
    yield rigid.kinematics
    yield from families.functions(model)
    if model.loads.size:
        yield loads.concentrated_loads
    if model.threads.size and (model.loads.size or model.fields.size or np.any(model.info.gravity)):
        yield thread.node_loads
    if model.threads.size and model.fields.size:
        yield thread.wound_fields
    if passing.can_pass(model):
        yield passing.passing
    yield from (*jit.at_slots(f.elements["force"]), *jit.at_slots(f.elements["energy"]))


def preparation(model: Model) -> Iterator[Any]:
    """Functions that place a model's parts: kinematics, masses and constraint rows (`impulse.prepare`)."""
    yield from (impulse.prepare, rigid.kinematics)
    if model.threads.size:
        yield from (thread.reels, thread.carry_wound)
    if np.any(model.threads["drive"] == drive.FREE):
        yield profile.profile  # of the motor
    if model.rows.size:
        yield constraint_rows.build_rows
    if model.links.size:
        yield constraint_rows.link_geometry
    if has_chains(model):
        yield thread.chain_matrix


def has_chains(model: Model) -> bool:
    """Whether a model has threads of fixed segments."""
    return bool(np.any(model.threads["kind"] == thread.INEXTENSIBLE))


def explicit(model: Model) -> Iterator[Any]:
    """Functions that explicit methods call."""
    yield from (rhs.rhs, inventory.inventory)
    yield from forces(model)
    if model.threads.size:  # whose motion is read off afterwards
        yield sampling.fill_observations
    if model.rows.size:
        yield from preparation(model)
        yield from (constraint_rows.row_velocity_terms, constraint_rows.solve_rows, impulse.impulse)
    if has_chains(model):
        yield from (thread.chain_rhs, thread.chain_solve, thread.chain_rates, thread.chain_points)
        yield from (thread.kick_chain, events.start_links)
    if is_flexible(model):
        yield from (explicit_flexible.add_flexible_forces, flexible.beam_rates)
        yield from (explicit_flexible.add_flexible_inventory, explicit_flexible.release_penalties)
    if model.flexible.hinges.size:
        yield from (hinge.note_turns, hinge.latch_values)
    if projection.is_corrected(model):
        yield projection.project
    if model.links.size or model.guides.size:
        yield projection.project_links
    yield from changes(model)


def changes(model: Model) -> Iterator[Any]:
    """Functions that events call."""
    if model.info.ne:
        yield from (events.event_values, events.apply_event)
    if model.info.ne and (model.info.penalties or model.flexible.motors.size):
        yield explicit_flexible.release_by
    if model.threads.size:
        yield from preparation(model)
        yield from (impulse.impulse, events.release_nodes, events.capture_node, events.separate)


def balance(model: Model) -> Iterator[Any]:
    """Functions of the implicit equations and their linear solver."""
    f = model.flexible
    yield from (implicit.residual, implicit.tangent, implicit.energies)
    yield from forces(model)
    yield from (*sparse.functions(), *sparse_lu.functions())
    yield from families.functions(model, tangents=True)
    yield from jit.at_slots(f.elements["tangent"])


def implicit_steps(model: Model) -> Iterator[Any]:
    """Functions that implicit steps call beside `balance`."""
    yield from balance(model)
    yield from (implicit.keep_momentum, implicit.momenta, implicit.add_rigid_motion)
    if model.flexible.cylinders.size:
        yield contact.count_touching
    if model.threads.size:
        yield from explicit(model)  # an event needs the state's sums, impulses and rates


def load_preparation(model: Model) -> None:
    """Load the functions that place a model's parts."""
    jit.load(preparation(model))


def load_weight(model: Model) -> None:
    """Load `implicit.add_weight` and what it calls."""
    jit.load([implicit.add_weight, *([flexible.add_gravity] if model.flexible.elements.size else [])])


#: Models whose functions for explicit methods are loaded; to list them takes as long as a hundred small steps.
_LOADED: weakref.WeakSet[Model] = weakref.WeakSet()


def load_explicit(model: Model, *others: Any) -> None:
    """Load the functions that explicit methods call, and other ones with them."""
    jit.load(others if model in _LOADED else (*explicit(model), *others))
    _LOADED.add(model)


def unload() -> None:
    """Unload all functions, as at the start of a process; tests find functions that are missing here so."""
    jit.unload()
    _LOADED.clear()


def load_implicit(model: Model) -> None:
    """Load the implicit equations and what implicit steps call beside them."""
    jit.load(implicit_steps(model))
