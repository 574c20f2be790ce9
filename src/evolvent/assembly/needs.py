"""Which compiled functions a model needs: what a function calls, but the kernels of what the model does not have."""

from __future__ import annotations

import functools
import weakref
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import numpy as np
from numba import config

from evolvent.assembly import families
from evolvent.compiled import jit, lookups
from evolvent.compiled.codecache import Linked, names_in
from evolvent.kernels import ancf_beams, axial, constraint_rows, drive, joint, passing, thread
from evolvent.model import Model


def has_explicit_forces(model: Model) -> bool:
    """Whether a model has beams, rods, joints by penalties, joint coordinates or user-defined laws between points."""
    return bool(
        model.beams.size or model.rods.size or model.info.penalties or model.coordinates.size
        or model.custom_forces.size or model.body_contacts.size
    )  # fmt: skip


def absent(model: Model) -> frozenset[str]:
    """Modules, and functions of other modules, for what a model does not have; without `evolvent.` and `kernels.`.

    A name that is missing here costs compilation; one that is wrong has a function loaded when it is called.
    """
    threads, joints, ties = model.threads, model.joints, model.synchronizations
    acts = model.wheels.size or model.thrusters.size or model.controllers.size
    penalties, turns = model.info.penalties, np.any(model.contact_surfaces["under"] >= 0)
    gears, follows = model.gear_coordinates, np.any(families.follows(model.beam_loads))
    held = np.any(model.rows["kind"] == constraint_rows.JOINT)
    has = {
        "attitude": acts,
        "attitude_tangent": acts,
        "beam_loads": model.beam_loads.size,
        "beam_strains": model.elements.size,
        "node_load_tangents": follows,
        "node_loads": follows,
        "constraint_rows": model.rows.size,
        "constraint_rows._measure_joint_row": held,
        "contact": model.contact_surfaces.size or model.body_contacts.size,
        "contact.add_points": model.contact_surfaces.size,
        "contact.add_bodies": model.body_contacts.size,
        "contact.end_bodies": model.body_contacts.size,
        "contact_tangent": model.contact_surfaces.size or model.body_contacts.size,
        "contact_tangent.add_point_tangents": model.contact_surfaces.size,
        "contact_tangent.add_body_tangents": model.body_contacts.size,
        "contact_tangent.add_turn_tangents": turns,
        "contact.end_points": model.contact_surfaces.size,
        "contact.evaluate_points": model.contact_surfaces.size,
        "surfaces": model.contact_surfaces.size or model.body_contacts.size,
        "surfaces.measure_points": model.contact_surfaces.size,
        "surfaces.measure_bodies": model.body_contacts.size,
        "surfaces.measure_turns": turns,
        "surfaces.nearest": turns,
        "coordinate_laws": model.coordinates.size,
        "resistance": model.resistances.size,
        "bearing": model.bearings.size,
        "coordinate_laws.add_motors": model.motors.size,
        "coordinate_laws.measure_motor_slopes": model.motors.size,
        "coordinate_laws.add_synchronizations": ties.size,
        "joint._add_cord_force": np.any(joints["kind"] == joint.CORD),
        "joint._cord_geometry": np.any(joints["kind"] == joint.CORD),
        "custom": model.custom_forces.size,
        "fields": model.fields.size,
        "ancf_beams": model.elements.size,
        "gear": gears.size,
        "axial_tangent": model.coordinates.size or gears.size,
        "axial_tangent._add_outer": model.coordinates.size,
        "axial_tangent._add_turns_of_body": np.any(model.coordinates["kind"] != axial.ANGLE)
        or np.any(gears["kind"] != axial.ANGLE),
        "coordinate": model.coordinates.size,
        "coordinate_tangent": model.coordinates.size,
        "coordinate_tangent.add_synchronization_tangents": ties.size,
        "coordinate_tangent.add_travel_tangent": np.any(model.coordinates["kind"] != axial.ANGLE),
        "joint": joints.size,
        "joint_tangent": joints.size,
        "loads": model.loads.size,
        "passing": passing.can_pass(model),
        "rigid.move_along": np.any(model.bodies["path"] != 0),
        "rod": model.rods.size,
        "rod_strains": model.rods.size,
        "rod_tangent": model.rods.size,
        "springs": model.springs.size,
        "thermal": model.thermal_loads.size,
        "work": model.loads.size or model.beam_loads.size,
        "thermal.heat_rods": np.any(model.thermal_loads["rod"] >= 0),
        "thread.carried": threads.size,
        "thread.chain": np.any(threads["kind"] == thread.INEXTENSIBLE),
        "thread.energy": threads.size,
        "thread.fields": threads.size and model.fields.size,
        "thread.free": np.any(threads["drive"] == drive.FREE),
        "thread.implicit": threads.size,
        "thread.loads": threads.size and (model.loads.size or model.fields.size or np.any(model.info.gravity)),
        "thread.results": threads.size,
        "thread.springs": threads.size,
        "thread.step": threads.size,
        "thread.springs.spring_thread": np.any(threads["kind"] == thread.SPRINGS),
        "thread.wound": threads.size,
        "flow.events": model.info.ne,
        "flow.events.release_nodes": threads.size,
        "flow.events.start_links": np.any(threads["kind"] == thread.INEXTENSIBLE),
        "flow.events.capture_node": threads.size,
        "flow.events.separate": threads.size,
        "flow.explicit_forces.add_explicit_forces": has_explicit_forces(model),
        "flow.explicit_forces.add_explicit_inventory": has_explicit_forces(model),
        "flow.explicit_forces.release_by": penalties or held or model.motors.size,
        "flow.explicit_forces.release_penalties": penalties,
        "flow.sampling.evaluate_threads": threads.size,
        "flow.sampling.evaluate_fields": model.fields.size,
        "flow.impulse": model.rows.size or threads.size,
        "flow.projection.project_joints": held,
        "solvers.alpha_start.thread_accelerations": threads.size,
        "solvers.implicit_samples.keep_lengths_at_spools": threads.size,
    }
    return frozenset(name for name, found in has.items() if not found)


#: Functions that call others by indices in records of elements, with the field of these.
_BY_RECORD = {
    ancf_beams.add_elements: "force",
    ancf_beams.add_element_tangents: "tangent",
    ancf_beams.beam_energies: "energy",
}


@functools.cache
def _called(function: Any) -> tuple[Any, ...]:
    """Functions called by their address in a compiled function and in what is compiled into it."""
    found: dict[Any, None] = {}
    seen, waiting = {function}, [function]
    while waiting:
        for other in _linked(waiting.pop().py_func):
            if isinstance(other, jit.Indirect):
                found[other] = None
            elif other not in seen:
                waiting.append(other)
            seen.add(other)
    return tuple(found)


def _linked(function: Any) -> Iterator[Any]:
    """Compiled functions that a Python function names."""
    names = names_in(function.__code__)
    for name in names:
        value = function.__globals__.get(name)
        if isinstance(value, Linked):
            yield value
        elif isinstance(value, ModuleType):
            yield from (other for at in names if isinstance(other := getattr(value, at, None), Linked))


@functools.cache
def _reached(roots: tuple[Any, ...], absent: frozenset[str]) -> tuple[Any, ...]:
    """Functions that some functions call, but those that are absent, themselves first."""
    found: dict[Any, None] = dict.fromkeys(roots)
    waiting = list(roots)
    while waiting:
        for other in _called(waiting.pop()):
            module = other.py_func.__module__.removeprefix("evolvent.").removeprefix("kernels.")
            if other not in found and absent.isdisjoint((module, f"{module}.{other.py_func.__name__}")):
                found[other] = None
                waiting.append(other)
    return tuple(found)


def needed(model: Model, roots: tuple[Any, ...], without: frozenset[str]) -> list[Any]:
    """Functions that `roots` call on a model that lacks what `absent` names, `roots` among them."""
    found = _reached(roots, without)
    by_record = [field for caller, field in _BY_RECORD.items() if caller in found]
    return [*found, *(one for field in by_record for one in lookups.at_slots(model.elements[field]))]


#: What a model does not have, and what was loaded for it.
_LOADED: weakref.WeakKeyDictionary[Model, tuple[frozenset[str], set[Any]]] = weakref.WeakKeyDictionary()


def load(model: Model, *roots: Any, without: frozenset[str] = frozenset()) -> None:
    """Load functions, and all that they call on a model, before they are called; what is in no cache is compiled.

    Parameters
    ----------
    without : names that are not called either, as of `absent`
    """
    if config.DISABLE_JIT:
        return
    if model not in _LOADED:
        _LOADED[model] = absent(model), set()
    lacks, loaded = _LOADED[model]
    if (roots, without) not in loaded:
        jit.load(needed(model, roots, lacks | without))
        loaded.add((roots, without))


def unload() -> None:
    """Unload all functions, as at the start of a process."""
    jit.unload()
    _LOADED.clear()
