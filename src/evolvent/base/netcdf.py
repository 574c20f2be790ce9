"""NetCDF-4 files of plain data, written by h5py alone: five times as fast as through h5netcdf, and the same to read.

A NetCDF-4 file is an HDF5 file. Every dimension is a "dimension scale": its coordinate, or an empty dataset with a name
that says so. Every variable is attached to the scales of its dimensions, which are numbered (``_Netcdf4Dimid``).
Source: NetCDF-4 file format specification, Unidata.
"""

from __future__ import annotations

import io
from typing import Any, BinaryIO

import numpy as np
import xarray as xr
from xarray import conventions

#: Kinds of values that `write` knows: truth values, numbers and texts.
_KINDS = "biufU"
#: What xarray notes on variables that it has read, and that says nothing of how to write them.
_IDLE = {"source", "original_shape", "dtype", "_FillValue", "contiguous"}


def is_plain(run: xr.DataTree | xr.Dataset) -> bool:
    """Whether `write` can write a run: plain values, nothing empty, no encoding of the user's, no groups in groups."""
    if isinstance(run, xr.DataTree):
        if any(node.children for node in run.children.values()):
            return False
        return all(map(is_plain, datasets(run).values()))
    if run.encoding.get("unlimited_dims") or any(size == 0 for size in run.sizes.values()):
        return False
    for name, variable in run.variables.items():
        asked = {key for key, value in variable.encoding.items() if value not in (None, False, 0)}
        clash = variable.ndim != 1 and name in run.dims
        if variable.dtype.kind not in _KINDS or asked - _IDLE or clash:
            return False
    return True


def datasets(run: xr.DataTree | xr.Dataset) -> dict[str, xr.Dataset]:
    """Data sets of the root ('') and of all groups, without what they inherit."""
    if not isinstance(run, xr.DataTree):
        return {"": run}
    return {"": run.to_dataset()} | {name: node.to_dataset(inherit=False) for name, node in run.children.items()}


def image(run: xr.DataTree | xr.Dataset) -> memoryview:
    """A run or data set as the bytes of a NetCDF file.

    It is made in memory, where no write fails: HDF5 keeps a file open that it could not write, and ends the process
    with a fault as it tries again.
    """
    file = io.BytesIO()
    if is_plain(run):
        write(run, file)
    else:
        run.to_netcdf(file, engine="h5netcdf")
    return file.getbuffer()


def write(run: xr.DataTree | xr.Dataset, file: BinaryIO) -> None:
    """Write a run that `is_plain`."""
    import h5py

    with h5py.File(file, "w", track_order=True) as opened:
        scales: dict[str, Any] = {}
        count = 0
        for name, dataset in datasets(run).items():
            group = opened.create_group(name, track_order=True) if name else opened
            count = _write(group, dataset, scales, first=count)
        made_with = f"version=2,h5py={h5py.__version__},hdf5={h5py.version.hdf5_version}".encode("ascii")
        opened.attrs["_NCProperties"] = np.array(made_with, dtype=h5py.string_dtype("ascii", len(made_with)))


def _write(file: Any, dataset: xr.Dataset, inherited: dict[str, Any], *, first: int) -> int:
    """Write a data set into a file or group; returns the number of dimensions so far.

    Parameters
    ----------
    inherited : scales of the root, which the root itself adds
    first : number of the next dimension
    """
    variables, attributes = conventions.cf_encoder(*conventions.encode_dataset_coordinates(dataset))
    made = {str(name): _dataset(file, str(name), variable) for name, variable in variables.items()}
    scales = dict(inherited)
    own = [str(d) for d in dataset.sizes if str(d) not in inherited]
    for k, dimension in enumerate(own):
        size = dataset.sizes[dimension]
        scale, title = made.get(dimension), dimension
        if scale is None:
            scale = file.create_dataset(title, shape=(size,), dtype=">f4", track_order=True)
            title = f"This is a netCDF dimension but not a netCDF variable.{size:10}"
        scale.make_scale(title)
        scale.attrs["_Netcdf4Dimid"] = np.int32(first + k)
        scales[dimension] = scale
    numbers = {name: scale.attrs["_Netcdf4Dimid"] for name, scale in scales.items()}
    for name, variable in variables.items():
        target = made[str(name)]
        if name not in own:
            for k, dimension in enumerate(variable.dims):
                target.dims[k].attach_scale(scales[str(dimension)])
        if variable.dims:
            ids = [numbers[str(d)] for d in variable.dims]
            target.attrs["_Netcdf4Coordinates"] = np.array(ids, dtype=np.int32)
            target.attrs["_Netcdf4Dimid"] = np.int32(ids[0])
        _add_attributes(target, variable.attrs, {"_FillValue": target.dtype})
    _add_attributes(file, attributes, {})
    if file.name == "/":
        inherited |= scales
    return first + len(own)


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
