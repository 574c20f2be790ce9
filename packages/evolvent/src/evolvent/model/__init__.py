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

from evolvent.compiled.pointer import array, zeros_record
from evolvent.model.family import EXTREMES
from evolvent.model.fields import ModelFields
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
    if EXTREMES in (family.dtype.names or ()):  # before the first step
        family[EXTREMES][:, ::2], family[EXTREMES][:, 1::2] = np.inf, -np.inf
    return family.view(np.recarray) if config.DISABLE_JIT else family


class Model(ModelFields):
    """A whole assembled system: families of records (see `RECORDS`) and plain arrays, of one type for every system.

    Attributes
    ----------
    event_firsts : (n,) int, number of the first event of each group in the tables of events
    *_calls : (n,) int, the functions of the families that it has, by question (`evolvent.kernels.calls`)
    and those of `ModelFields`
    """

    @classmethod
    def _further(cls) -> dict[str, Any]:
        """Fields of every model, records of all families, and the tables of calls."""
        found = {family.name: array(1, family.record) for family in families().values()}
        tables = (*TABLES, "event_firsts")
        return ModelFields._declared | found | {name: array(1, np.int64, constant=True) for name in tables}

    def __init__(self, **values: Any) -> None:
        scratch = {"interval": zeros_record(NUMBERS), "powers": np.zeros(N_POWERS), "energies": np.zeros(3)}
        scratch = {name: value for name, value in scratch.items() if name not in values}
        super().__init__(**scratch, **values | calls_of(values) | {"kept": kept_of(values, self._places)})

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Records of a family."""


#: The type of a model in signatures of compiled functions.
MODEL = Model._numba_type_
