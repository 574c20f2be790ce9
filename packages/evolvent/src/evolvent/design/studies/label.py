"""The results of a study as a dataset over the keys that vary."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from evolvent.design.evaluator.record import CaseTable
from evolvent.design.evaluator.sources import sources, versions
from evolvent.design.studies.axes import Axis
from evolvent.design.studies.study import Study
from evolvent.results.limits import LIMITS
from evolvent_base import __version__


def table(rows: CaseTable, dims: Sequence[str], shape: Sequence[int]) -> xr.Dataset:
    """What is kept of cases over the dimensions that they span."""

    def over(values: np.ndarray, attrs: dict[str, Any], own: Sequence[str] = ()) -> xr.Variable:
        return xr.Variable((*dims, *own), values.reshape(*shape, *values.shape[1:]), attrs)

    found = xr.Dataset(
        {
            "status": over(np.array(rows.status), {"long_name": "how the run ended"}),
            "reason": over(np.array(rows.reason), {"long_name": "why the run failed"}),
        }
    )
    for name, column in rows.columns.items():
        label = name if name not in found.variables and name not in dims else f"{name}_of_run"
        found[label] = over(column.values, dict(column.attrs), column.dims)
    common = {dim: one for dim, one in rows.coordinates.items() if one.common}
    return found.assign_coords({dim: xr.Variable((dim,), one.values, dict(one.attrs)) for dim, one in common.items()})


def dataset(study: Study, rows: CaseTable) -> xr.Dataset:
    """What is kept of all cases, labelled.

    Parameters
    ----------
    rows : Table, of all cases of the study
    """
    along = {}
    for axis in study.axes:
        attrs = {"units": axis.unit or "1", "long_name": axis.key, "description": axis.what}
        along[axis.key] = xr.Variable((axis.key,) if study.sample == "grid" else ("case",), values(axis), attrs)
    found = table(rows, study.dims, study.shape).assign_coords(along)
    return found.assign_attrs(
        {
            "title": f"evolvent study {study.name}",
            "source": f"evolvent {__version__}",
            "system": study.system,
            "study": study.text,
            "sample": study.sample,
            "keys": json.dumps([axis.key for axis in study.axes]),
            "draws": json.dumps([axis.draw for axis in study.axes]),
            "distributions": json.dumps([axis.text for axis in study.axes]),
            "stages": json.dumps([stage.name for stage in study.stages]),
            "key_stages": json.dumps([axis.stage for axis in study.axes]),
            "version": __version__,
            "versions": json.dumps(versions()),
            "sources": sources(),
            **({LIMITS: json.dumps(study.limits)} if study.limits else {}),
        }
    )


def values(axis: Axis) -> np.ndarray:
    """Values of a varied key: numbers, or texts where they are none."""
    if all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in axis.values):
        return np.array(axis.values)
    return np.array([v if isinstance(v, str) else json.dumps(v) for v in axis.values])
