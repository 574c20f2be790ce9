"""Fields of a model beside the records of families, which are those of every system."""

from __future__ import annotations

import numpy as np

from evolvent.compiled.jit import ADDRESSES
from evolvent.compiled.pointer import Struct, array, record, shared
from evolvent.model.interval import NUMBERS
from evolvent.model.records import OWN_RECORDS

Array = np.ndarray


class ModelFields(Struct):
    """Fields that every model has.

    Attributes
    ----------
    interval : record (see `evolvent.model.interval.NUMBERS`), scratch, of a state whose forces are evaluated
    powers, energies : (N_POWERS,) and (3,) float, scratch, of a state of an explicit method
    breaks : (nb,) float, s, times on which a solver lands
    parameters : (k,) float, of drives, laws and loads; families hold the indices of theirs
    A, la : (nr, 1 + bandwidth), (nr,) float, scratch, matrix and multipliers of the rows
    watched : (n,) float, scratch, values of the events that are watched
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
    custom : (k,) float, scratch of user-defined laws between points (`families.springs.custom`)
    rod : (k,) float, scratch of an element of a rod (`families.rods.rod_strains`)
    F, P : (nv,) float, scratch, generalised forces and the loads among them
    work, e, f, K24, K12 : scratch of an element, and of tangents
    J : (3, 3, 9) float, scratch, columns of sides
    kept : (m, 6) int, fields that a run keeps at its samples (`evolvent.model.registry.kept_of`)
    addresses : of functions that compiled code calls by address (`evolvent.compiled.jit.Indirect`)
    """

    info: np.record = record(OWN_RECORDS["info"])
    interval: np.record = record(NUMBERS)
    powers: Array = array(1)
    energies: Array = array(1)
    breaks: Array = array(1)
    parameters: Array = array(1)
    blocks: Array = array(1, OWN_RECORDS["blocks"])
    markers: Array = array(1, OWN_RECORDS["markers"])
    constraints: Array = array(1, OWN_RECORDS["constraints"])
    watches: Array = array(1, OWN_RECORDS["watches"])
    watched: Array = array(1)
    rows: Array = array(1, OWN_RECORDS["rows"])
    row_sides: Array = array(1, OWN_RECORDS["row_sides"])
    row_pairs: Array = array(1, OWN_RECORDS["row_pairs"])
    A: Array = array(2)
    la: Array = array(1)
    scratch: Array = array(2)
    pose: Array = array(1)
    dy: Array = array(2)
    sums: Array = array(2)
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
    kept: Array = array(2, np.int64)
    addresses: Array = shared(ADDRESSES)
