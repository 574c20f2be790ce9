"""The Model: flat arrays of one type for every system.

A state is a vector ``y = [q | v | accounts]`` of floats and a vector ``s`` of integer switches: the nodes released of
each thread, then whether the whole of each is, then quarter turns and latch of each coordinate, then the sense in which
each spool with friction turns, 0 where it sticks. `evolvent.equations` holds the functions of it that a solver calls.
Families may be empty. Scratch memory lives in the model, so that nothing is
allocated in a time loop; two threads of execution therefore need two models.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import config
from numba.np import numpy_support

from evolvent.compiled.jit import ADDRESSES
from evolvent.compiled.pointer import Struct, array, record, shared, zeros_record
from evolvent.model.having import has as has, having as having, nonzero as nonzero, not_negative as not_negative
from evolvent.model.interval import NUMBERS
from evolvent.model.powers import N_POWERS
from evolvent.model.records import *  # noqa: F403  (the names of the model are those of this package)
from evolvent.model.records import OWN_RECORDS
from evolvent.model.registry import TABLES, calls_of, families, kept_of

Array = np.ndarray


class _OfFamilies(Mapping[str, Any]):
    """What all families have, by their names; they are looked up when something of it is asked for."""

    def __init__(self, found: Callable[[], dict[str, Any]]) -> None:
        self._found = functools.cache(found)

    def __getitem__(self, name: str) -> Any:
        return self._found()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._found())

    def __len__(self) -> int:
        return len(self._found())


#: Records of the model by their names, and which fields of them are results (`Family.results`).
RECORDS: Mapping[str, np.dtype] = _OfFamilies(
    lambda: OWN_RECORDS | {family.name: family.record for family in families().values()}
)
RESULTS: Mapping[str, Mapping[str, tuple[str, str, str]]] = _OfFamilies(
    lambda: {family.name: family.results for family in families().values() if family.results}
)


def family_type(name: str) -> Any:
    """Function that returns the type of a family in signatures of compiled functions, for `jit.entry`."""
    return lambda: numpy_support.from_dtype(RECORDS[name])[::1]


def zeros(name: str, size: int) -> Array:
    """An empty family of `size` records; fields read as attributes of a record, as compiled code does."""
    family = np.zeros(size, dtype=RECORDS[name])
    return family.view(np.recarray) if config.DISABLE_JIT else family


class Model(Struct):
    """A whole assembled system: families of records (see `RECORDS`) and plain arrays, of one type for every system.

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
    custom : (k,) float, scratch of user-defined laws between points (`kernels.custom`)
    rod : (k,) float, scratch of an element of a rod (`kernels.rod_strains`)
    F, P : (nv,) float, scratch, generalised forces and the loads among them
    work, e, f, K24, K12 : scratch of an element, and of tangents
    J : (3, 3, 9) float, scratch, columns of sides
    kept : (m, 6) int, fields that a run keeps at its samples (`evolvent.model.registry.kept_of`)
    event_firsts : (n,) int, number of the first event of each group in the tables of events
    *_calls : (n,) int, the functions of the families that it has, by question (`evolvent.kernels.calls`)
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

    @classmethod
    def _further(cls) -> dict[str, Any]:
        """Records of all families, and the tables of calls."""
        found = {family.name: array(1, family.record) for family in families().values()}
        tables = (*(f"{name}_calls" for name in TABLES), "event_firsts")
        return found | {name: array(1, np.int64, constant=True) for name in tables}

    def __init__(self, **values: Any) -> None:
        scratch = {"interval": zeros_record(NUMBERS), "powers": np.zeros(N_POWERS), "energies": np.zeros(3)}
        scratch = {name: value for name, value in scratch.items() if name not in values}
        super().__init__(**scratch, **values | calls_of(values) | {"kept": kept_of(values, self._places)})

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Records of a family."""


#: The type of a model in signatures of compiled functions.
MODEL = Model._numba_type_
