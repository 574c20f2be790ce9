"""The results of a study as a dataset over the keys that vary."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr

from evolvent import __version__
from evolvent.design.studies.axes import Axis
from evolvent.design.studies.record import Table
from evolvent.design.studies.store import sources, versions
from evolvent.design.studies.study import Study


def dataset(study: Study, rows: Table) -> xr.Dataset:
    """What is kept of all cases, labelled.

    Parameters
    ----------
    rows : Table, of all cases of the study
    """
    found = xr.Dataset(
        {"status": _variable(study, np.array(rows.status), {"long_name": "how the run ended"})},
        attrs={
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
        },
    )
    found["reason"] = _variable(study, np.array(rows.reason), {"long_name": "why the run failed"})
    for name, column in rows.columns.items():
        label = name if name not in found.variables and name not in study.dims else f"{name}_of_run"
        found[label] = _variable(study, column.values, dict(column.attrs), column.dims)
    for dim, along in rows.coordinates.items():
        if along.common:
            found = found.assign_coords({dim: xr.Variable((dim,), along.values, dict(along.attrs))})
    for axis in study.axes:
        dims = (axis.key,) if study.sample == "grid" else ("case",)
        attrs = {"units": axis.unit or "1", "long_name": axis.key, "description": axis.what}
        found = found.assign_coords({axis.key: xr.Variable(dims, values(axis), attrs)})
    return found


def _variable(study: Study, rows: np.ndarray, attrs: dict[str, Any], dims: tuple[str, ...] = ()) -> xr.Variable:
    return xr.Variable((*study.dims, *dims), rows.reshape(*study.shape, *rows.shape[1:]), attrs)


def values(axis: Axis) -> np.ndarray:
    """Values of a varied key: numbers, or texts where they are none."""
    if all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in axis.values):
        return np.array(axis.values)
    return np.array([v if isinstance(v, str) else json.dumps(v) for v in axis.values])
