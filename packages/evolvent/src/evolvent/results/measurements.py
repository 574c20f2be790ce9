"""Measured values that the runs of a case are compared with."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Array = np.ndarray


@dataclasses.dataclass(frozen=True, kw_only=True)
class Series:
    """Measured values of one variable.

    Attributes
    ----------
    name : str, full name of the variable, or with the reduction of a table of runs
    unit : str, of the values
    values : (n,) float
    labels : tuple of str, what each value is, for tables
    times : function of the case's content to the times of a run that the values belong to, (n,) s; None in a table of
        runs, whose row k is the run k
    """

    name: str
    unit: str
    values: Array
    labels: tuple[str, ...]
    times: Callable[[Mapping[str, Any]], Array] | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Measurements:
    """Measured data.

    Attributes
    ----------
    source : str, the file
    overrides : mapping, keys of the case that the data set in every run
    series : tuple of Series
    rows : tuple of mappings, keys that each run of a table sets; one empty mapping for one run
    notes : tuple of str, what the data do not determine
    """

    source: str
    overrides: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    series: tuple[Series, ...]
    rows: tuple[Mapping[str, Any], ...] = ({},)
    notes: tuple[str, ...] = ()
