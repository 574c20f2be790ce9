"""NetCDF-4 files of plain data, written by h5py alone: five times as fast as through h5netcdf, and the same to read.

A NetCDF-4 file is an HDF5 file. Every dimension is a "dimension scale": its coordinate, or an empty dataset with a name
that says so. Every variable is attached to the scales of its dimensions, which are numbered (``_Netcdf4Dimid``).
Source: NetCDF-4 file format specification, Unidata.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from xarray import conventions

#: Kinds of values that `write` knows: truth values, numbers and texts.
_KINDS = "biufU"
#: What xarray notes on variables that it has read, and that says nothing of how to write them.
_IDLE = {"source", "original_shape", "dtype", "_FillValue", "contiguous"}


def is_plain(dataset: xr.Dataset) -> bool:
    """Whether `write` can write a data set: plain values, nothing empty, no encoding of the user's."""
    if dataset.encoding.get("unlimited_dims") or any(size == 0 for size in dataset.sizes.values()):
        return False
    for name, variable in dataset.variables.items():
        asked = {key for key, value in variable.encoding.items() if value not in (None, False, 0)}
        clash = variable.ndim != 1 and name in dataset.dims
        if variable.dtype.kind not in _KINDS or asked - _IDLE or clash:
            return False
    return True


def write(dataset: xr.Dataset, path: str) -> None:
    """Write a data set for which `is_plain` holds."""
    import h5py

    variables, attributes = conventions.cf_encoder(*conventions.encode_dataset_coordinates(dataset))
    numbers = {dimension: k for k, dimension in enumerate(dataset.sizes)}
    with h5py.File(path, "w", track_order=True) as file:
        made = {str(name): _dataset(file, str(name), variable) for name, variable in variables.items()}
        for dimension, size in dataset.sizes.items():
            scale, title = made.get(str(dimension)), str(dimension)
            if scale is None:
                scale = file.create_dataset(title, shape=(size,), dtype=">f4", track_order=True)
                title = f"This is a netCDF dimension but not a netCDF variable.{size:10}"
            scale.make_scale(title)
            scale.attrs["_Netcdf4Dimid"] = np.int32(numbers[dimension])
        for name, variable in variables.items():
            target = made[str(name)]
            if name not in numbers:
                for k, dimension in enumerate(variable.dims):
                    target.dims[k].attach_scale(file[str(dimension)])
            if variable.dims:
                target.attrs["_Netcdf4Coordinates"] = np.array([numbers[d] for d in variable.dims], dtype=np.int32)
                target.attrs["_Netcdf4Dimid"] = np.int32(numbers[variable.dims[0]])
            _add_attributes(target, variable.attrs, {"_FillValue": target.dtype})
        _add_attributes(file, attributes, {})
        made_with = f"version=2,h5py={h5py.__version__},hdf5={h5py.version.hdf5_version}".encode("ascii")
        file.attrs["_NCProperties"] = np.array(made_with, dtype=h5py.string_dtype("ascii", len(made_with)))


def _dataset(file: Any, name: str, variable: xr.Variable) -> Any:
    """The dataset with the values of a variable."""
    import h5py

    values = np.asarray(variable.values)
    if values.dtype.kind in "UO":
        values = values.astype(object)
        return file.create_dataset(name, data=values, dtype=h5py.string_dtype(), track_order=True)
    return file.create_dataset(name, data=values, fillvalue=variable.attrs.get("_FillValue"), track_order=True)


def _add_attributes(target: Any, attributes: Any, kinds: Any) -> None:
    """Attributes as NetCDF keeps them: a number is a list of one; `kinds` names types that are asked for."""
    for name, value in attributes.items():
        single = np.isscalar(value) and not isinstance(value, str)
        target.attrs[name] = np.atleast_1d(np.asarray(value, dtype=kinds.get(name))) if single else value
