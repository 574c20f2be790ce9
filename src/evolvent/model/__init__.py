"""The Model: flat arrays of one type for every system.

A state is a vector ``y = [q | v | accounts]`` of floats and a vector ``s`` of integer switches: the nodes released of
each thread, then whether the whole of each is, then quarter turns and latch of each coordinate, then the sense in which
each spool with friction turns, 0 where it sticks. `evolvent.flow` holds the functions of it that a solver calls.
Families may be empty. Scratch memory lives in the model, so that nothing is
allocated in a time loop; two threads of execution therefore need two models.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import config
from numba.np import numpy_support

from evolvent.compiled.jit import ADDRESSES
from evolvent.compiled.pointer import Struct, array, record, shared
from evolvent.model.having import has as has, having as having, nonzero as nonzero, not_negative as not_negative
from evolvent.model.records import *  # noqa: F403  (the names of the model are those of this package)
from evolvent.model.records import RECORDS
from evolvent.model.results import RESULTS as RESULTS

Array = np.ndarray


def family_type(name: str) -> Any:
    """Type of a family in signatures of compiled functions."""
    return numpy_support.from_dtype(RECORDS[name])[::1]


def zeros(name: str, size: int) -> Array:
    """An empty family of `size` records; fields read as attributes of a record, as compiled code does."""
    family = np.zeros(size, dtype=RECORDS[name])
    return family.view(np.recarray) if config.DISABLE_JIT else family


class Model(Struct):
    """A whole assembled system: families of records (see `RECORDS`) and plain arrays, of one type for every system.

    Attributes
    ----------
    breaks : (nb,) float, s, times on which a solver lands
    parameters : (k,) float, of drives, laws and loads; families hold the indices of theirs
    A, la : (nr, 1 + bandwidth), (nr,) float, scratch, matrix and multipliers of the rows
    scratch, dy, sums : (3, 3), (2, ny), (2, N_INVENTORY) float, scratch
    pose : (12,) float, scratch, what the law of a torque is called with: position and attitude of its body
    H, h, U0 : (k, m, m), (k, m), (k,) float, forms of elements (`evolvent.elements`), m of the kind that has most: 28
        of 24 coordinates, 6 of cables
    M : (k, n, n) float, masses of elements, n of the kind that has most: 8 of 24 coordinates, 4 of cables
    B : (k, 2, 4) float, curvature of cables at two points (`evolvent.elements.cable_bending`), 0 of other forms
    G : (nv,) float, weight
    masses : (N, 8) float, factors of the beams' masses, a row a nodal vector (`linalg.banded_solve_vectors`)
    switches : (ns,) int, those of the state that an implicit method has reached
    strands : (nodes + 1, 9) float, of each thread's segment under an implicit method: vector and direction at the last
        residual, tension, the one that its tangent uses, the one at the start of the step; last: time of that residual
    angles : (nodes of beams and rods,) float, scratch, angles about a layer's axis
    custom : (k,) float, scratch of user-defined laws between points (`kernels.custom`)
    rod : (k,) float, scratch of an element of a rod (`kernels.rod_strains`)
    F, P : (nv,) float, scratch, generalised forces and the loads among them
    work, e, f, K24, K12 : scratch of an element, and of tangents
    J : (3, 3, 9) float, scratch, columns of sides
    addresses : of functions that compiled code calls by address (`evolvent.compiled.jit.Indirect`)
    """

    info: np.record = record(RECORDS["info"])
    breaks: Array = array(1)
    parameters: Array = array(1)
    blocks: Array = array(1, RECORDS["blocks"])
    bodies: Array = array(1, RECORDS["bodies"])
    points: Array = array(1, RECORDS["points"])
    markers: Array = array(1, RECORDS["markers"])
    springs: Array = array(1, RECORDS["springs"])
    links: Array = array(1, RECORDS["links"])
    guides: Array = array(1, RECORDS["guides"])
    threads: Array = array(1, RECORDS["threads"])
    nodes: Array = array(1, RECORDS["nodes"])
    loads: Array = array(1, RECORDS["loads"])
    events: Array = array(1, RECORDS["events"])
    fields: Array = array(1, RECORDS["fields"])
    field_points: Array = array(1, RECORDS["field_points"])
    wheels: Array = array(1, RECORDS["wheels"])
    thrusters: Array = array(1, RECORDS["thrusters"])
    controllers: Array = array(1, RECORDS["controllers"])
    rows: Array = array(1, RECORDS["rows"])
    row_sides: Array = array(1, RECORDS["row_sides"])
    row_pairs: Array = array(1, RECORDS["row_pairs"])
    A: Array = array(2)
    la: Array = array(1)
    scratch: Array = array(2)
    pose: Array = array(1)
    dy: Array = array(2)
    sums: Array = array(2)
    beams: Array = array(1, RECORDS["beams"])
    beam_nodes: Array = array(1, RECORDS["beam_nodes"])
    elements: Array = array(1, RECORDS["elements"])
    joints: Array = array(1, RECORDS["joints"])
    coordinates: Array = array(1, RECORDS["coordinates"])
    contact_surfaces: Array = array(1, RECORDS["contact_surfaces"])
    contact_points: Array = array(1, RECORDS["contact_points"])
    beam_loads: Array = array(1, RECORDS["beam_loads"])
    custom_forces: Array = array(1, RECORDS["custom_forces"])
    body_contacts: Array = array(1, RECORDS["body_contacts"])
    motors: Array = array(1, RECORDS["motors"])
    synchronizations: Array = array(1, RECORDS["synchronizations"])
    drivetrains: Array = array(1, RECORDS["drivetrains"])
    resistances: Array = array(1, RECORDS["resistances"])
    curves: Array = array(1, RECORDS["curves"])
    bristles: Array = array(1, RECORDS["bristles"])
    bearings: Array = array(1, RECORDS["bearings"])
    rods: Array = array(1, RECORDS["rods"])
    rod_elements: Array = array(1, RECORDS["rod_elements"])
    tapes: Array = array(1, RECORDS["tapes"])
    tape_nodes: Array = array(1, RECORDS["tape_nodes"])
    reduced_bodies: Array = array(1, RECORDS["reduced_bodies"])
    modes: Array = array(1, RECORDS["modes"])
    gear_coordinates: Array = array(1, RECORDS["gear_coordinates"])
    thermal_loads: Array = array(1, RECORDS["thermal_loads"])
    H: Array = array(3)
    h: Array = array(2)
    U0: Array = array(1)
    M: Array = array(3)
    B: Array = array(3)
    G: Array = array(1)
    masses: Array = array(2)
    switches: Array = array(1, np.int64)
    strands: Array = array(2)
    angles: Array = array(1)
    custom: Array = array(1)
    rod: Array = array(1)
    F: Array = array(1)
    P: Array = array(1)
    work: Array = array(1)
    e: Array = array(2)
    f: Array = array(1)
    K24: Array = array(2)
    K12: Array = array(2)
    J: Array = array(3)
    addresses: Array = shared(ADDRESSES)


#: The type of a model in signatures of compiled functions.
MODEL = Model._numba_type_
